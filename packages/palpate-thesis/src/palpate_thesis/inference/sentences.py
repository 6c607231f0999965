"""The thesis' sentences about its laboratory, each with the threshold of its claim in one trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Literal

import msgspec

from palpate_thesis.claims import ENOUGH
from palpate_thesis.figures import fig_6_01_04 as first_seconds
from palpate_thesis.figures import fig_6_02_05 as later
from palpate_thesis.figures import fig_6_03, fig_6_06, fig_6_10, fig_6_15
from palpate_thesis.inference.trial import LARGEST_RATE, Trial, WatchedPress
from palpate_thesis.neural_identifier import claims as network_claims

if TYPE_CHECKING:
    from palpate_thesis.neural_identifier.network import NetworkAnswer

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


PressHolds = Callable[[WatchedPress], bool]


def _foam(holds: PressHolds) -> Holds:
    return lambda t: t.foam is not None and holds(t.foam)


def _rubber(holds: PressHolds) -> Holds:
    return lambda t: t.rubber is not None and holds(t.rubber)


def _settles_within(key: str, limit: float) -> PressHolds:
    return lambda p: first_seconds.settles(p.estimates, key, limit)


def _level(figure: later.Later) -> PressHolds:
    return lambda p: abs(p.estimates.K / (1e3 * figure.printed[0]) - 1.0) < later.LEVEL


def _network(part: network_claims.ClaimPart, answer: Callable[[Trial], NetworkAnswer | None]) -> Holds:
    def holds(trial: Trial) -> bool:
        networks_answer = answer(trial)
        return networks_answer is not None and part.holds(networks_answer)

    return holds


def _slower(trial: Trial) -> bool:
    answers = {rate: trial.answer_at(rate) for rate in fig_6_06.SMALLER}
    by_rate = {rate: [answer] for rate, answer in answers.items() if answer is not None}
    return len(by_rate) == len(answers) and fig_6_06.slower_throughout(by_rate)[0]


def _too_large(trial: Trial) -> bool:
    answer = trial.answer_at(LARGEST_RATE)
    return answer is not None and fig_6_06.stuck(answer)


def _sticks(trial: Trial) -> bool:
    stuck, free = trial.free_directions, trial.unstuck
    return stuck is not None and free is not None and 1.0 - free.y / stuck.y >= fig_6_15.SHARE


def _free_directions(holds: Callable[[fig_6_15.Errors], bool]) -> Holds:
    return lambda t: t.free_directions is not None and holds(t.free_directions)


def _settling(prefix: str, limit: float, surface: Callable[[PressHolds], Holds]) -> dict[str, Holds]:
    return {f"{prefix}.{key}": surface(_settles_within(key, limit)) for key in "KBM"}


HOLDS: Mapping[str, Holds] = {
    "switch-at-5N": lambda t: all(p is not None and p.clean for p in (t.foam, t.rubber)),
    "switch-at-5N.threshold": lambda t: t.foam is not None and not t.foam.early,
    "force-noise": _foam(lambda p: 1.5 <= p.half_range <= 2.5),
    **_settling(first_seconds.FOAM.claim, first_seconds.FOAM.limit, _foam),
    later.FOAM.claim: _foam(lambda p: later.FOAM.near(p.estimates)),
    f"{later.FOAM.claim}.K": _foam(_level(later.FOAM)),
    f"{later.FOAM.claim}.B": _foam(lambda p: later.plausible(p.estimates)),
    f"{later.FOAM.claim}.M": _foam(lambda p: p.estimates.M < 0.0),
    later.FOAM.ratio: _foam(lambda p: p.spread > 1.0),
    "least-squares-raw-signals.M": _foam(lambda p: p.estimates.M_raw < 0.0),
    "least-squares-raw-signals.B": _foam(lambda p: p.estimates.B_raw < 0.0),
    "least-squares-raw-signals.K": _foam(lambda p: abs(p.estimates.apart_raw) < fig_6_03.NEAR),
    "least-squares-one-foam": _foam(lambda p: all(shows(p.estimates) for shows in fig_6_03.SHOWS.values())),
    **_settling(first_seconds.RUBBER.claim, first_seconds.RUBBER.limit, _rubber),
    later.RUBBER.claim: _rubber(lambda p: later.RUBBER.near(p.estimates)),
    f"{later.RUBBER.claim}.K": _rubber(_level(later.RUBBER)),
    f"{later.RUBBER.claim}.B": _rubber(lambda p: later.plausible(p.estimates)),
    f"{later.RUBBER.claim}.M": _rubber(lambda p: p.estimates.M < 0.0),
    later.RUBBER.ratio: _rubber(lambda p: p.spread > 1.0),
    "network-learning-rate.slower": _slower,
    "network-learning-rate.too-large": _too_large,
    **{f"network-foam.{p.suffix}": _network(p, lambda t: t.foam_answer) for p in network_claims.FOAM},
    "network-foam.error": _network(network_claims.ERROR, lambda t: t.foam_answer),
    **{f"network-rubber.{p.suffix}": _network(p, lambda t: t.rubber_answer) for p in network_claims.RUBBER},
    "hybrid-alone-falls-short": lambda t: t.hybrid is not None and fig_6_10.misses(t.hybrid),
    "neural-foam-steps": lambda t: t.foam_steps.follows,
    "neural-foam-sine": lambda t: t.foam_sine.follows,
    "neural-slow-rate.first": lambda t: not t.slow_first.follows,
    "neural-slow-rate.later": lambda t: t.slow_later.follows,
    "neural-free-directions": _free_directions(fig_6_15.visible),
    "neural-free-directions.before": _free_directions(lambda e: abs(e.y_switch) > fig_6_15.VISIBLE[0]),
    "neural-free-directions.sticks": _sticks,
    "neural-rubber-steps": lambda t: t.rubber_steps.follows,
    "neural-rubber-sine": lambda t: t.rubber_sine[0].follows,
    "neural-rubber-sine.adapts": lambda t: bool(2.5 <= t.rubber_sine[1] <= 7.5),
}
"""Each claim's own threshold, unchanged, on one run."""
