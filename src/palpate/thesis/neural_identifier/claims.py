"""Claims of the thesis about its neural identifier, part by part, each with its threshold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.thesis.claims import ENOUGH, Claim, decided, spread
from palpate.thesis.neural_identifier.network import GONE, Answer, Choice
from palpate.thesis.neural_identifier.notes import TIME, Grounds, why

SMALL = 1.0
"""Upper limit of a small mass [kg]."""
FOAM_BAND, RUBBER_BAND = 0.06, 0.15
"""How far K may be from f/x, as a share of it: "almost same" is said of less than 6 % in sec. 6.1; on rubber the
thesis' own are 10 % apart."""


@dataclass(frozen=True)
class Part:
    """One thing that is claimed of one coefficient, or of the error."""

    suffix: str
    claim: str
    thesis: str
    tolerance: str
    value: Callable[[Answer], float]
    unit: str
    holds: Callable[[Answer], bool]


def _time(name: str, value: Callable[[Answer], float]) -> Part:
    return Part(
        suffix=f"time-{name}",
        claim=f"{name}_e by the network is practically identified after about 0.6 s.",
        thesis="about 0.6 s",
        tolerance=f"stays within 10 % of its value at 4 s from a time between {TIME[0]:g} and {TIME[1]:g} s on",
        value=value,
        unit="s",
        holds=lambda a: TIME[0] <= value(a) <= TIME[1],
    )


TIMES = (
    _time("K", lambda a: a.settled_K),
    _time("B", lambda a: a.settled_B),
    _time("M", lambda a: a.settled_M),
)
MASS = Part(
    "M",
    "M_e by the network is a small positive value.",
    "small, positive",
    f"above 0 and below {SMALL:g} kg",
    lambda a: a.M,
    "kg",
    lambda a: 0.0 < a.M < SMALL,
)
ERROR = Part(
    "error",
    "The error of the network's output becomes almost zero in about 0.6 s.",
    "about 0.6 s",
    f"its mean over 50 ms stays within {GONE:g} N (5 % of the desired force) from a time between "
    f"{TIME[0]:g} and {TIME[1]:g} s on",
    lambda a: a.error_gone,
    "s",
    lambda a: TIME[0] <= a.error_gone <= TIME[1],
)
FOAM = (
    *TIMES,
    Part(
        "K",
        "K_e by the network is almost the same as force over displacement.",
        "6.6 against 6.7 kN/m (ratio 0.985)",
        'K_e over f/x between 0.94 and 1.06: the thesis calls less than 6 % "almost same" in sec. 6.1',
        lambda a: a.over,
        "times f/x",
        lambda a: abs(a.over - 1.0) <= FOAM_BAND,
    ),
    Part(
        "B",
        "B_e by the network is similar to that of least squares.",
        "similar",
        "between 2/3 and 3/2 of what least squares give on the same press",
        lambda a: a.B / a.squares_B,
        "times that of least squares",
        lambda a: 2 / 3 <= a.B / a.squares_B <= 1.5,
    ),
    MASS,
)
RUBBER = (
    *TIMES,
    Part(
        "K",
        "K_e by the network is realistic beside force over displacement.",
        "56 against 62 kN/m (ratio 0.90)",
        "K_e over f/x between 0.85 and 1.15: the thesis' own are 10 % apart",
        lambda a: a.over,
        "times f/x",
        lambda a: abs(a.over - 1.0) <= RUBBER_BAND,
    ),
    Part(
        "B",
        "B_e by the network is smaller than that of least squares.",
        "smaller",
        "above 0 and below what least squares give on the same press",
        lambda a: a.B / a.squares_B,
        "times that of least squares",
        lambda a: 0.0 < a.B < a.squares_B,
    ),
    MASS,
)


def claims(grounds: Grounds, parts: Sequence[Part], id_: str, source: str) -> list[Claim]:
    """A row for each part."""
    return [_claim(grounds, part, id_, source, parts) for part in parts]


def _claim(grounds: Grounds, part: Part, id_: str, source: str, parts: Sequence[Part]) -> Claim:
    values = [part.value(a) for a in grounds.nominal]
    good = sum(map(part.holds, grounds.nominal))
    shown = described(values, part.unit, grounds.starts)
    measured = f"{shown}{_figures(part, grounds)}; holds in {good} of {len(values)}"
    note = " ".join(
        [
            why(part.suffix, grounds),
            where(grounds, part),
            under(grounds, part),
            _jointly(grounds, part, parts),
        ]
    )
    return Claim(
        id=f"{id_}.{part.suffix}",
        source=source,
        claim=part.claim,
        thesis=part.thesis,
        measured=measured,
        tolerance=f"{part.tolerance}; in 9 of 10 runs",
        verdict=decided(enough(grounds.nominal, part)),
        note=note.strip(),
    )


def _figures(part: Part, grounds: Grounds) -> str:
    """For K: both numbers that are compared."""
    if part.suffix != "K":
        return ""
    stiffness, ratio = (
        1e-3 * np.median([getattr(a, name) for a in grounds.nominal]) for name in ("K", "ratio")
    )
    return f", {stiffness:.3g} against {ratio:.3g} kN/m"


def described(values: Sequence[float], unit: str, starts: int) -> str:
    """Median and range over noise seeds and starts."""
    return spread(values, unit).replace(
        f"{len(values)} seeds", f"{len(values) // starts} seeds x {starts} starts"
    )


def enough(answers: Sequence[Answer], part: Part) -> bool:
    """Whether a claim holds in enough of the runs."""
    return share(answers, part) >= ENOUGH


def share(answers: Sequence[Answer], part: Part) -> float:
    """In which share of the runs a claim holds."""
    return sum(map(part.holds, answers)) / len(answers)


def where(grounds: Grounds, part: Part) -> str:
    """A sentence: over which part of the sweep a claim holds."""
    good = [choice for choice, some in grounds.swept.items() if enough(some, part)]
    total = len(grounds.swept)
    if not good:
        return (
            f"It holds for none of {total} combinations of output amplitude, initial weights and thresholds."
        )
    kinds = {True: "thresholds that learn", False: "thresholds fixed at zero"}
    regions = [
        f"{name}: {_region([c for c in good if c.thresholds is kind])}" for kind, name in kinds.items()
    ]
    return (
        f"Of {total} combinations of output amplitude, initial weights and thresholds it holds for "
        f"{len(good)} ({'; '.join(regions)})."
    )


def _region(good: Sequence[Choice]) -> str:
    if not good:
        return "none"
    by_amplitude: dict[float, list[str]] = {}
    for choice in good:
        by_amplitude.setdefault(choice.amplitude, []).append(f"{choice.weights:g}")
    return ", ".join(f"{a:g} N with weights to {'/'.join(w)}" for a, w in by_amplitude.items())


def under(grounds: Grounds, part: Part) -> str:
    """A sentence: under which varied conditions the networks as chosen agree with the claim."""
    good = [name for name, some in grounds.varied.items() if enough(some, part)]
    bad = [name for name in grounds.varied if name not in good]
    if not bad:
        return "As chosen, it holds under every varied condition too (friction, pose, surface)."
    if not good:
        return f"As chosen, it holds under none of {len(bad)} varied conditions (friction, pose, surface)."
    return f"As chosen, of the varied conditions it holds with {', '.join(good)}; not with {', '.join(bad)}."


def _jointly(grounds: Grounds, part: Part, parts: Sequence[Part]) -> str:
    """For K alone: whether any one network does everything that is claimed."""
    if part.suffix != "K":
        return ""
    most = max(sum(enough(some, p) for p in parts) for some in grounds.swept.values())
    if most == len(parts):
        return f"Some combination shows all {most} parts of the claim at once."
    return f"No combination shows more than {most} of the {len(parts)} parts of the claim at once."
