"""Claims of the thesis about its neural identifier, part by part, each with its threshold and its numbers."""

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.identifiers.neural_probe import SETTINGS
from palpate_thesis.claims import ENOUGH, ThesisClaim, claim, spread
from palpate_thesis.neural_identifier.network import GONE, NetworkAnswer, NetworkChoice

TIME = (0.3, 0.9)
"""Limits of "about 0.6 s": half of it more or less [s]."""
SMALL = 1.0
"""Upper limit of a small mass [kg]."""
FOAM_BAND, RUBBER_BAND = 0.06, 0.15
"""Maximum relative difference of K and f/x. Section 6.1 says "almost same" of less than 6 %; on rubber the thesis' own
values are 10 % apart."""


RATIO_BAND = 0.10
"""Maximum relative difference of f/x from the printed one: a network that gives one K on every surface would otherwise
agree on the surface that has it."""


class Grounds(NamedTuple):
    """Data of a claim's verdict and note.

    Args:
        surface: "foam" or "rubber".
        nominal: every start on the press of every noise seed.
        swept: variations of the network's unstated parameters.
        varied: friction, pose, surface.
        perfect: K over f/x of a network that knows the surface without error.
        starts: number of starts for each noise seed in `nominal`.
    """

    surface: str
    nominal: Sequence[NetworkAnswer]
    swept: Mapping[NetworkChoice, Sequence[NetworkAnswer]]
    varied: Mapping[str, Sequence[NetworkAnswer]]
    perfect: float
    starts: int


class ClaimPart(NamedTuple):
    """A statement about a coefficient or the error: its number in one run, and the condition for its truth."""

    suffix: str
    value: Callable[[NetworkAnswer], float]
    unit: str
    holds: Callable[[NetworkAnswer], bool]


def _time(suffix: str, value: Callable[[NetworkAnswer], float]) -> ClaimPart:
    return ClaimPart(suffix, value, "s", lambda a: TIME[0] <= value(a) <= TIME[1])


TIMES = tuple(_time(f"time-{key}", attrgetter(f"settled_{key}")) for key in "KBM")
MASS = ClaimPart("M", lambda a: a.M, "kg", lambda a: 0.0 < a.M < SMALL)
ERROR = _time("error", lambda a: a.error_gone)


def _parts(band: float, ratio: float, similar: Callable[[NetworkAnswer], bool]) -> tuple[ClaimPart, ...]:
    def near(a: NetworkAnswer) -> bool:
        return abs(a.over - 1.0) <= band and abs(a.ratio / ratio - 1.0) <= RATIO_BAND

    stiffness = ClaimPart("K", lambda a: a.over, "times f/x", near)
    damping = ClaimPart("B", lambda a: a.B / a.squares_B, "times that of least squares", similar)
    return (*TIMES, stiffness, damping, MASS)


FOAM = _parts(FOAM_BAND, 6700.0, lambda a: 2 / 3 <= a.B / a.squares_B <= 1.5)
RUBBER = _parts(RUBBER_BAND, 62000.0, lambda a: 0.0 < a.B < a.squares_B)


def claims(grounds: Grounds, parts: Sequence[ClaimPart]) -> list[ThesisClaim]:
    """A row for each part."""
    return [_claim(grounds, part, parts) for part in parts]


def _claim(grounds: Grounds, part: ClaimPart, parts: Sequence[ClaimPart]) -> ThesisClaim:
    values = [part.value(a) for a in grounds.nominal]
    return claim(
        f"network-{grounds.surface}.{part.suffix}",
        enough(grounds.nominal, part),
        values=describe_spread(values, part.unit, grounds.starts),
        good=sum(map(part.holds, grounds.nominal)),
        runs=len(values),
        key=part.suffix[-1],
        first=TIME[0],
        last=TIME[1],
        where=where(grounds, part),
        under=under(grounds, part),
        jointly=_jointly(grounds, parts),
        **_numbers(grounds, values),
    )


def _numbers(grounds: Grounds, values: Sequence[float]) -> dict[str, Any]:
    """Further numbers of the claims, of which each names some; `values` are those of its part."""
    nominal, dampings = grounds.nominal, [a.B for a in grounds.nominal]
    fixed = [float(np.median([a.over for a in s])) for c, s in grounds.swept.items() if not c.thresholds]
    laws = [
        f"{np.median([a.over for a in grounds.varied[law]]):.2f} on a {law} one"
        for law in ("stiffening", "relaxing")
        if law in grounds.varied
    ]
    by_start = np.reshape(values, (-1, grounds.starts))
    times = {c.amplitude: answers for c, answers in grounds.swept.items() if c == NetworkChoice(c.amplitude)}
    gone = (f"{np.median([x.error_gone for x in s]):.2g} s at {a:g} N" for a, s in times.items())
    middle = {
        k: float(np.median([getattr(a, k) for a in nominal])) for k in ("error_gone", "at_zero", "K", "ratio")
    }
    return {
        "middle": middle,
        "stiffness": 1e-3 * middle["K"],
        "ratio": 1e-3 * middle["ratio"],
        "amplitude": NetworkChoice().amplitude,
        "early": sum(t < TIME[0] for t in values),
        "late": sum(t > TIME[1] for t in values),
        "perfect": grounds.perfect,
        "probe": 1e3 * SETTINGS[grounds.surface].values[0],
        "fixed": [min(fixed), max(fixed)],
        "laws": f"The median is {' and '.join(laws)}. " if laws else "",
        "dampings": [min(dampings), max(dampings)],
        "B_by_start": _by_start(dampings, grounds),
        "positive": int(np.sum(by_start > 0)),
        "firm": int(np.sum(np.all(by_start > 0, axis=0) | np.all(by_start < 0, axis=0))),
        "starts": grounds.starts,
        "by_start": _by_start(values, grounds),
        "small": SMALL,
        "limit": GONE,
        "amplitudes": ", ".join(gone),
    }


def _by_start(values: Sequence[float], grounds: Grounds) -> str:
    part = share_of_starts(values, grounds.starts)
    return f"Initial weights make {'over 99%' if part > 0.99 else f'{part:.0%}'} of its variance, noise the rest."


def share_of_starts(values: Sequence[float] | Array, starts: int) -> float:
    """Share of the variance that lies between starts; the rest lies between noise seeds of one start."""
    by_start = np.reshape(np.asarray(values, dtype=float), (-1, starts))
    total = float(np.var(by_start))
    return float(np.var(by_start.mean(axis=0))) / total if total > 0.0 else 0.0


def describe_spread(values: Sequence[float], unit: str, starts: int) -> str:
    """Median and range over noise seeds and starts."""
    return spread(values, unit).replace(
        f"{len(values)} seeds", f"{len(values) // starts} seeds x {starts} starts"
    )


def enough(answers: Sequence[NetworkAnswer], part: ClaimPart) -> bool:
    """True if a claim holds in enough of the runs."""
    return share(answers, part) >= ENOUGH


def share(answers: Sequence[NetworkAnswer], part: ClaimPart) -> float:
    """Fraction of the runs in which a claim holds."""
    return sum(map(part.holds, answers)) / len(answers)


def where(grounds: Grounds, part: ClaimPart) -> str:
    """Sentence with the part of the sweep in which a claim holds."""
    good = [choice for choice, answers in grounds.swept.items() if enough(answers, part)]
    among = f"{len(grounds.swept)} combinations of output amplitude, initial weights and thresholds"
    if not good:
        return f"It holds for none of {among}."
    kinds = {True: "thresholds that learn", False: "thresholds fixed at zero"}
    regions = [
        f"{name}: {_region([c for c in good if c.thresholds is kind])}" for kind, name in kinds.items()
    ]
    return f"Of {among} it holds for {len(good)} ({'; '.join(regions)})."


def _region(good: Sequence[NetworkChoice]) -> str:
    by_amplitude: dict[float, list[str]] = {}
    for choice in good:
        by_amplitude.setdefault(choice.amplitude, []).append(f"{choice.weights:g}")
    return ", ".join(f"{a:g} N with weights to {'/'.join(w)}" for a, w in by_amplitude.items()) or "none"


def under(grounds: Grounds, part: ClaimPart) -> str:
    """Sentence with the varied conditions under which the networks as chosen agree with the claim."""
    good = [name for name, answers in grounds.varied.items() if enough(answers, part)]
    bad = [name for name in grounds.varied if name not in good]
    if not bad:
        return "As chosen, it holds under every varied condition too (friction, pose, surface)."
    if not good:
        return f"As chosen, it holds under none of {len(bad)} varied conditions (friction, pose, surface)."
    return f"As chosen, of the varied conditions it holds with {', '.join(good)}; not with {', '.join(bad)}."


def _jointly(grounds: Grounds, parts: Sequence[ClaimPart]) -> str:
    """Sentence with the most parts that one network satisfies."""
    most = max(sum(enough(answers, p) for p in parts) for answers in grounds.swept.values())
    if most == len(parts):
        return f"Some combination shows all {most} parts of the claim at once."
    return f"No combination shows more than {most} of the {len(parts)} parts of the claim at once."
