"""The thesis' sentences about its laboratory, each with the threshold of its claim in one trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import msgspec

from palpate_laboratory.trial import LARGEST_RATE, Trial, WatchedPress
from palpate_thesis.claims import ENOUGH
from palpate_thesis.figures import fig_6_01_04 as first_seconds
from palpate_thesis.figures import fig_6_02_05 as later
from palpate_thesis.figures import fig_6_03, fig_6_06, fig_6_10, fig_6_15
from palpate_thesis.least_squares.press_runs import PressEstimates
from palpate_thesis.neural_identifier import claims as network_claims
from palpate_thesis.neural_identifier.network import NetworkAnswer

Holds = Callable[[Trial], bool]
MOST = 0.5
"""Where a median decides, or most seeds."""


@dataclass(frozen=True)
class Sentence:
    """A claim of the thesis about a result of its laboratory.

    Args:
        id: of the claim.
        figure: that has it.
        calibrates: whether its half of the figures calibrates; the other half judges.
        searched: whether it enters a search; one that follows from others, or costs as much as all, does not.
        holds: in a trial, by the claim's own threshold.
        share: of the seeds that it has to hold for, strictly more than a half or at least so many.
    """

    id: str
    figure: str
    calibrates: bool
    searched: bool
    holds: Holds
    share: float

    def enough(self, held: int, seeds: int) -> bool:
        """Whether it holds for enough of the seeds, as the claim has it."""
        return 2 * held > seeds if self.share == MOST else held >= self.share * seeds


class Figure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Of the data file: a figure and its half."""

    half: str
    claims: tuple[str, ...]
    searched: bool = True
    besides: tuple[str, ...] = ()  # claims that do not enter the search


@cache
def sentences() -> tuple[Sentence, ...]:
    """All of them, in the order of the figures; which figure is in which half stands in `halves.toml`."""
    text = resources.files("palpate_laboratory").joinpath("halves.toml").read_text("utf-8")
    figures = msgspec.toml.decode(text, type=dict[str, Figure])
    return tuple(
        Sentence(
            id_,
            number,
            figure.half == "calibration",
            figure.searched and id_ not in figure.besides,
            HOLDS[id_],
            _share(id_),
        )
        for number, figure in figures.items()
        for id_ in (*figure.claims, *figure.besides)
    )


TELLING_FIRST = (
    *("6.1", "6.2", "6.3", "4.4", "6.8", "6.7", "6.6", "6.9", "6.4", "6.5", "4.2"),
    *("6.10", "6.17", "6.12", "6.13", "6.11", "6.15", "6.16"),
)
"""Figures in the order in which a search tries them: what shares a run stands together, and runs that miss most
sentences for the time they take stand first, so that a laboratory which has to be given up is given up soon."""


def sentences_of_search(*, calibrating: bool) -> tuple[Sentence, ...]:
    """The sentences of a search, the telling ones first: those that calibrate, or all."""
    some = [s for s in sentences() if s.searched and (s.calibrates or not calibrating)]
    return tuple(sorted(some, key=lambda s: TELLING_FIRST.index(s.figure)))


def verdicts(trial: Trial, of: Sequence[Sentence]) -> list[bool]:
    """Which of the sentences hold in a trial."""
    return [bool(sentence.holds(trial)) for sentence in of]


def _share(id_: str) -> float:
    """The share of the seeds by which the figure of a claim decides."""
    if id_ == "switch-at-5N.threshold":
        return 1.0
    by_most = id_.startswith(("least-squares", "single-sample", "force-noise", "switch"))
    return MOST if by_most or id_.endswith((".adapts", ".sticks")) else ENOUGH


def _foam(holds: Callable[[WatchedPress], bool]) -> Holds:
    return lambda t: t.foam is not None and holds(t.foam)


def _rubber(holds: Callable[[WatchedPress], bool]) -> Holds:
    return lambda t: t.rubber is not None and holds(t.rubber)


def _settles_within(key: str, limit: float) -> Callable[[WatchedPress], bool]:
    return lambda p: getattr(p.found, f"settled_{key}") <= limit


def _level(kilo: float) -> Callable[[WatchedPress], bool]:
    return lambda p: abs(p.found.K / (1e3 * kilo) - 1.0) < later.LEVEL


def _all_of_foam(f: PressEstimates) -> bool:
    return all(shows(f) for shows in fig_6_03.SHOWS.values())


def _network(part: network_claims.ClaimPart, answer: Callable[[Trial], NetworkAnswer | None]) -> Holds:
    def holds(trial: Trial) -> bool:
        found = answer(trial)
        return found is not None and part.holds(found)

    return holds


def _slower(trial: Trial) -> bool:
    found = {rate: trial.answer_at(rate) for rate in fig_6_06.SMALLER}
    by_rate = {rate: [one] for rate, one in found.items() if one is not None}
    return len(by_rate) == len(found) and fig_6_06.slower_throughout(by_rate)[0]


def _too_large(trial: Trial) -> bool:
    found = trial.answer_at(LARGEST_RATE)
    return found is not None and fig_6_06.stuck(found)


def _sticks(trial: Trial) -> bool:
    stuck, free = trial.free_directions, trial.unstuck
    return stuck is not None and free is not None and 1.0 - free.y / stuck.y >= fig_6_15.SHARE


def _of_errors(holds: Callable[[fig_6_15.Errors], bool]) -> Holds:
    return lambda t: t.free_directions is not None and holds(t.free_directions)


def _settling(
    prefix: str, limit: float, surface: Callable[[Callable[[WatchedPress], bool]], Holds]
) -> dict[str, Holds]:
    return {f"{prefix}.{key}": surface(_settles_within(key, limit)) for key in "KBM"}


HOLDS: dict[str, Holds] = {
    "switch-at-5N": lambda t: all(p is not None and p.clean for p in (t.foam, t.rubber)),
    "switch-at-5N.threshold": lambda t: t.foam is not None and not t.foam.in_the_air,
    "force-noise": _foam(lambda p: 1.5 <= p.half_range <= 2.5),
    **_settling(first_seconds.FOAM.claim, first_seconds.FOAM.limit, _foam),
    later.FOAM.claim: _foam(lambda p: abs(p.found.apart) < later.FOAM.apart),
    f"{later.FOAM.claim}.K": _foam(_level(later.FOAM.level)),
    f"{later.FOAM.claim}.B": _foam(lambda p: later.plausible(p.found)),
    f"{later.FOAM.claim}.M": _foam(lambda p: p.found.M < 0.0),
    later.FOAM.ratio: _foam(lambda p: p.spread > 1.0),
    "least-squares-raw-signals.M": _foam(lambda p: p.found.M_raw < 0.0),
    "least-squares-raw-signals.B": _foam(lambda p: p.found.B_raw < 0.0),
    "least-squares-raw-signals.K": _foam(lambda p: abs(p.found.apart_raw) < fig_6_03.NEAR),
    "least-squares-one-foam": _foam(lambda p: _all_of_foam(p.found)),
    **_settling(first_seconds.RUBBER.claim, first_seconds.RUBBER.limit, _rubber),
    later.RUBBER.claim: _rubber(lambda p: abs(p.found.apart) < later.RUBBER.apart),
    f"{later.RUBBER.claim}.K": _rubber(_level(later.RUBBER.level)),
    f"{later.RUBBER.claim}.B": _rubber(lambda p: later.plausible(p.found)),
    f"{later.RUBBER.claim}.M": _rubber(lambda p: p.found.M < 0.0),
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
    "neural-free-directions": _of_errors(fig_6_15.visible),
    "neural-free-directions.before": _of_errors(lambda e: abs(e.y_switch) > fig_6_15.VISIBLE[0]),
    "neural-free-directions.sticks": _sticks,
    "neural-rubber-steps": lambda t: t.rubber_steps.follows,
    "neural-rubber-sine": lambda t: t.rubber_sine[0].follows,
    "neural-rubber-sine.adapts": lambda t: bool(2.5 <= t.rubber_sine[1] <= 7.5),
}
"""Each claim's own threshold, unchanged, on one run."""
