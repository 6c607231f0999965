"""Claims of the thesis about its neural identifier, part by part, each with its threshold and its numbers."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from palpate.identifiers.neural_probe import SETTINGS
from palpate_thesis.claims import ThesisClaim, claim, often, spread
from palpate_thesis.neural_identifier.network import GONE, NetworkAnswer

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


def claims(surface: str, answers: Sequence[NetworkAnswer], parts: Sequence[ClaimPart]) -> list[ThesisClaim]:
    """A row for each part, from the answers of all runs on a surface."""
    K, ratio = (1e-3 * float(np.median([getattr(a, name) for a in answers])) for name in ("K", "ratio"))
    return [
        claim(
            f"network-{surface}.{part.suffix}",
            often(map(part.holds, answers)),
            values=spread([part.value(a) for a in answers], part.unit),
            good=sum(map(part.holds, answers)),
            runs=len(answers),
            key=part.suffix[-1],
            first=TIME[0],
            last=TIME[1],
            stiffness=K,
            ratio=ratio,
            probe=1e3 * SETTINGS[surface].values[0],
            small=SMALL,
            limit=GONE,
        )
        for part in parts
    ]
