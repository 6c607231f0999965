"""The design of an excitation: no longer than it must be."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from palpate.arrays import Array
from palpate.excitation import chirp, multisine
from palpate.excitation.prediction import Made, Prediction, Wave
from palpate.excitation.problem import Problem
from palpate.references.waves import Multisine

MAKERS = {"multisine": multisine.make, "chirp": chirp.make}
"""By the kind of excitation: from a problem and a duration to the best one."""

_FIRST = 10.0  # s; where the search for the shortest duration starts
_ROUNDS = 4
"""Of a duration that is aimed at: each misses by less, as precision goes with its root."""
_LONGER = 1.05  # where the duration that was aimed at misses by a hair
_STEP = 0.5  # s; a chirp is as long as a whole number of these
FOREVER = 1e7  # s


@dataclass(frozen=True)
class Design:
    """An excitation for a problem.

    Args:
        problem: as requested.
        made: the wave and its predictions.
        seconds: of the part that counts.
    """

    problem: Problem
    made: Made
    seconds: float

    @property
    def wave(self) -> Wave:
        """The wave that is added to the mean force."""
        return self.made.wave

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """One a surface, the middle first."""
        return self.made.predictions

    @property
    def settle(self) -> float:
        """Seconds before the part that counts; a sweep has none."""
        return self.problem.settle if isinstance(self.wave, Multisine) else 0.0

    @property
    def excess(self) -> float:
        """Largest half-width per that asked for."""
        return self.made.excess(self.seconds, self.problem.precision)

    @property
    def feasible(self) -> bool:
        """Whether it reaches the requested precision on every surface."""
        return self.excess <= 1.0

    @property
    def needed(self) -> float:
        """Seconds after which the same wave, repeated, would reach it; infinite if it never does."""
        return needed(self.made, self.problem)

    def force(self, rate: float = 1000.0) -> tuple[Array, Array]:
        """Times [s] and desired force [N], both of shape (n,); while the touch settles, the wave is eased in."""
        time = np.arange(round((self.settle + self.seconds) * rate) + 1) / rate
        eased = np.sin(0.5 * np.pi * np.clip(time / self.settle, 0, 1)) ** 2 if self.settle else 1.0
        return time, self.problem.budget.mean + eased * self.wave.at(time)


def design(problem: Problem) -> Design:
    """The excitation that reaches the precision in the shortest time, or the best one in the time given.

    Raises:
        InputError: the budget leaves no excitation at all.
    """
    make = MAKERS[problem.kind]
    if problem.duration is not None:
        return Design(problem, make(problem, problem.duration), problem.duration)
    seconds = min(_FIRST, problem.longest)
    for _ in range(_ROUNDS):
        made = make(problem, seconds)
        before, seconds = seconds, _whole(problem, needed(made, problem))
        if before == seconds:
            break
    found = Design(problem, make(problem, seconds), seconds)
    while not found.feasible and found.seconds < problem.longest:
        seconds = _whole(problem, _LONGER * found.seconds + _STEP)
        found = Design(problem, make(problem, seconds), seconds)
    return found


def needed(made: Made, problem: Problem) -> float:
    """Seconds of a wave that reach the precision: more of them never give less information."""
    low, high = 1e-3, FOREVER
    if made.excess(high, problem.precision) > 1:
        return np.inf
    while high / low > 1 + 1e-6:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if made.excess(middle, problem.precision) > 1 else (low, middle)
    return high


def _whole(problem: Problem, seconds: float) -> float:
    """At least so many seconds, as a whole number of periods or steps, and no more than the longest."""
    step = max(multisine.PERIOD, 1 / problem.budget.lowest) if problem.kind == "multisine" else _STEP
    return min(ceil(seconds / step - 1e-6) * step if seconds < FOREVER else np.inf, problem.longest)
