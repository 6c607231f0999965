"""The thesis' sentences about its laboratory, each with the threshold of its claim in one trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Literal

import msgspec

from palpate_thesis.claims import ENOUGH
from palpate_thesis.figures import fig_6_01_04 as first_seconds
from palpate_thesis.figures import fig_6_02_05 as later
from palpate_thesis.figures import fig_6_03, fig_6_06, fig_6_10, fig_6_15
from palpate_thesis.inference.trial import LARGEST_RATE, Trial, WatchedPress
from palpate_thesis.neural_identifier import claims as network_claims

Holds = Callable[[Trial], bool]


@dataclass(frozen=True)
class Sentence:
    """A claim of the thesis about a result of its laboratory.

    Args:
        id: of the claim.
        figure: its number.
        calibrates: True in the half of the figures that calibrates, False in the half that validates.
        searched: False if it enters no search, because it follows from others or costs as much as all of them.
        holds: the claim's own threshold in one trial.
        fraction: least fraction of the seeds in which the sentence has to hold; None for a majority.
    """

    id: str
    figure: str
    calibrates: bool
    searched: bool
    holds: Holds
    fraction: float | None

    def is_true(self, held: int, seeds: int) -> bool:
        """True if the sentence holds in enough of the seeds."""
        return 2 * held > seeds if self.fraction is None else held >= self.fraction * seeds


class FigureRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A figure in halves.toml.

    Args:
        half: "calibration" or "validation".
        claims: of the figure, besides those of `states` and `besides`.
        searched: False if no search runs the figure's experiment.
        besides: claims that enter no search.
        states: claims that state the value of one unknown, and so calibrate in either half.
    """

    half: Literal["calibration", "validation"]
    claims: tuple[str, ...]
    searched: bool = True
    besides: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


@cache
def sentences() -> tuple[Sentence, ...]:
    """All sentences in the order of the figures; halves.toml assigns the figures to the halves."""
    text = resources.files("palpate_thesis.inference").joinpath("halves.toml").read_text("utf-8")
    figures = msgspec.toml.decode(text, type=dict[str, FigureRow])
    return tuple(
        Sentence(
            claim,
            number,
            figure.half == "calibration" or claim in figure.states,
            figure.searched and claim not in figure.besides,
            HOLDS[claim],
            _deciding_fraction(claim),
        )
        for number, figure in figures.items()
        for claim in (*figure.states, *figure.claims, *figure.besides)
    )


def halves() -> dict[str, tuple[Sentence, ...]]:
    """The sentences of the calibration half, of the validation half, and all."""
    calibration = tuple(s for s in sentences() if s.calibrates)
    validation = tuple(s for s in sentences() if not s.calibrates)
    return {"calibration": calibration, "validation": validation, "all": sentences()}


def true_ids(trial: Trial, among: Iterable[Sentence]) -> tuple[str, ...]:
    """Names of the sentences that hold in a trial."""
    return tuple(s.id for s in among if s.holds(trial))


def _deciding_fraction(claim: str) -> float | None:
    """The fraction of the seeds by which a claim's figure decides."""
    if claim == "switch-at-5N.threshold":
        return 1.0
    by_majority = ("least-squares", "single-sample", "force-noise", "switch")
    return None if claim.startswith(by_majority) or claim.endswith((".adapts", ".sticks")) else ENOUGH


def _when_kept(name: str, holds: Callable[[Any], bool]) -> Holds:
    """True if contact was kept in an experiment of `trial.MEASURES`, and `holds` of its result."""
    return lambda t: t[name] is not None and holds(t[name])


def _foam(holds: Callable[[WatchedPress], bool]) -> Holds:
    return _when_kept("foam", holds)


def _rubber(holds: Callable[[WatchedPress], bool]) -> Holds:
    return _when_kept("rubber", holds)


def _settling(figure: first_seconds.LeastSquaresFirstSeconds) -> dict[str, Holds]:
    def settles(key: str) -> Holds:
        return _when_kept(figure.surface, lambda p: first_seconds.settles(p.estimates, key, figure.limit))

    return {f"{figure.claim}.{key}": settles(key) for key in "KBM"}


def _later(figure: later.Later) -> dict[str, Holds]:
    """The sentences of figure 6.2 or 6.5."""
    name, kilo = figure.surface, 1e3 * figure.printed[0]
    return {
        figure.claim: _when_kept(name, lambda p: figure.near(p.estimates)),
        f"{figure.claim}.K": _when_kept(name, lambda p: abs(p.estimates.K / kilo - 1.0) < later.LEVEL),
        f"{figure.claim}.B": _when_kept(name, lambda p: later.plausible(p.estimates)),
        f"{figure.claim}.M": _when_kept(name, lambda p: p.estimates.M < 0.0),
        figure.ratio: _when_kept(name, lambda p: p.spread > 1.0),
    }


def _network(surface: str, parts: Sequence[network_claims.ClaimPart]) -> dict[str, Holds]:
    def holds(part: network_claims.ClaimPart) -> Holds:
        return lambda t: (answer := t.answer(surface)) is not None and part.holds(answer)

    return {f"network-{surface}.{part.suffix}": holds(part) for part in parts}


def _slower(trial: Trial) -> bool:
    answers = {rate: trial.answer("foam", rate) for rate in fig_6_06.SMALLER}
    by_rate = {rate: [answer] for rate, answer in answers.items() if answer is not None}
    return len(by_rate) == len(answers) and fig_6_06.slower_throughout(by_rate)[0]


def _too_large(trial: Trial) -> bool:
    answer = trial.answer("foam", LARGEST_RATE)
    return answer is not None and fig_6_06.stuck(answer)


def _sticks(trial: Trial) -> bool:
    stuck, free = trial["steps on foam"][1], trial["unstuck"]
    return stuck is not None and free is not None and 1.0 - free.y / stuck.y >= fig_6_15.SHARE


def _free_directions(holds: Callable[[fig_6_15.Errors], bool]) -> Holds:
    return _when_kept("steps on foam", lambda result: result[1] is not None and holds(result[1]))


HOLDS: Mapping[str, Holds] = {
    "switch-at-5N": lambda t: all(p is not None and p.clean for p in (t["foam"], t["rubber"])),
    "switch-at-5N.threshold": _foam(lambda p: not p.early),
    "force-noise": _foam(lambda p: 1.5 <= p.half_range <= 2.5),
    **_settling(first_seconds.FOAM),
    **_later(later.FOAM),
    "least-squares-raw-signals.M": _foam(lambda p: p.estimates.M_raw < 0.0),
    "least-squares-raw-signals.B": _foam(lambda p: p.estimates.B_raw < 0.0),
    "least-squares-raw-signals.K": _foam(lambda p: abs(p.estimates.apart_raw) < fig_6_03.NEAR),
    "least-squares-one-foam": _foam(lambda p: all(shows(p.estimates) for shows in fig_6_03.SHOWS.values())),
    **_settling(first_seconds.RUBBER),
    **_later(later.RUBBER),
    "network-learning-rate.slower": _slower,
    "network-learning-rate.too-large": _too_large,
    **_network("foam", (*network_claims.FOAM, network_claims.ERROR)),
    **_network("rubber", network_claims.RUBBER),
    "hybrid-alone-falls-short": _when_kept("hybrid", fig_6_10.misses),
    "neural-foam-steps": lambda t: t["steps on foam"][0].follows,
    "neural-foam-sine": lambda t: t["sine on foam"].follows,
    "neural-slow-rate.first": lambda t: not t["slow, first"].follows,
    "neural-slow-rate.later": lambda t: t["slow, later"].follows,
    "neural-free-directions": _free_directions(fig_6_15.visible),
    "neural-free-directions.before": _free_directions(lambda e: abs(e.y_switch) > fig_6_15.VISIBLE[0]),
    "neural-free-directions.sticks": _sticks,
    "neural-rubber-steps": lambda t: t["steps on rubber"].follows,
    "neural-rubber-sine": lambda t: t["sine on rubber"][0].follows,
    "neural-rubber-sine.adapts": lambda t: bool(2.5 <= t["sine on rubber"][1] <= 7.5),
}
"""Each claim's own threshold, unchanged, on one run."""
