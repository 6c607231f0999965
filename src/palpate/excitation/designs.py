"""The shortest excitation that reaches a precision; if none does, changes of the limits that help."""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from palpate.arrays import Array
from palpate.excitation.multisine import Excitation, PredictedWidths, best_multisine, period_for
from palpate.excitation.problem import LONGEST, DesignProblem
from palpate.references import Multisine

_FIRST = 10.0
"""Duration from which the search for the shortest one starts [s]."""
_ROUNDS = 4
"""Rounds of that search; the error shrinks in each, as the precision goes with the root of the duration."""
_LONGER, _STEP = 1.05, 0.5
"""Factor and seconds by which a duration grows that is not sufficient."""
FOREVER = 1e7
"""Duration after which more time helps no more [s]."""


@dataclass(frozen=True)
class Design:
    """An excitation for a problem.

    Args:
        problem: that it solves.
        excitation: the wave and its predictions.
        seconds: duration of the part that counts.
    """

    problem: DesignProblem
    excitation: Excitation
    seconds: float

    @property
    def wave(self) -> Multisine:
        """The wave that is added to the mean force."""
        return self.excitation.wave

    @property
    def predictions(self) -> tuple[PredictedWidths, ...]:
        """Predictions, one for each surface, the middle first."""
        return self.excitation.predictions

    @property
    def excess(self) -> float:
        """Largest ratio of half-width and wanted precision."""
        return self.excitation.excess(self.seconds, self.problem.precision)

    @property
    def feasible(self) -> bool:
        """True if every surface reaches the wanted precision."""
        return self.excess <= 1.0

    @property
    def needed(self) -> float:
        """Seconds after which the same wave, repeated, reaches the precision; infinite if it never does."""
        return seconds_needed(self.excitation, self.problem)

    def worst(self) -> dict[str, float]:
        """Largest half-width of each parameter on any surface, as a fraction of its value."""
        return self.excitation.worst(self.seconds)

    def force(self, rate: float = 1000.0) -> tuple[Array, Array]:
        """Times [s] and desired force [N], both of shape (n,); the wave is eased in during the settling time."""
        settle = self.problem.settle
        time = np.arange(round((settle + self.seconds) * rate) + 1) / rate
        easing = np.sin(0.5 * np.pi * np.clip(time / settle, 0, 1)) ** 2 if settle else 1.0
        return time, self.problem.budget.mean + easing * self.wave.at(time)


def design(problem: DesignProblem) -> Design:
    """The excitation that reaches the precision in the shortest time, or the best one in the given time.

    Raises:
        InputError: the band has room for fewer than two frequencies.
    """
    if problem.duration is not None:
        return Design(problem, best_multisine(problem, problem.duration), problem.duration)
    seconds = min(_FIRST, problem.longest)
    for _ in range(_ROUNDS):
        excitation = best_multisine(problem, seconds)
        before, seconds = seconds, _whole_periods(problem, seconds_needed(excitation, problem))
        if before == seconds:
            break
    result = Design(problem, best_multisine(problem, seconds), seconds)
    while not result.feasible and result.seconds < problem.longest:
        seconds = _whole_periods(problem, _LONGER * result.seconds + _STEP)
        result = Design(problem, best_multisine(problem, seconds), seconds)
    return result


def seconds_needed(excitation: Excitation, problem: DesignProblem) -> float:
    """Seconds after which an excitation reaches the precision, by bisection; infinite if it never does."""
    low, high = 1e-3, FOREVER
    if excitation.excess(high, problem.precision) > 1:
        return np.inf
    while high / low > 1 + 1e-6:
        middle = float(np.sqrt(low * high))
        if excitation.excess(middle, problem.precision) > 1:
            low = middle
        else:
            high = middle
    return high


def _whole_periods(problem: DesignProblem, seconds: float) -> float:
    """The next whole number of periods [s], at most the longest duration."""
    if seconds >= FOREVER:
        return problem.longest
    period = period_for(problem)
    return min(ceil(seconds / period - 1e-6) * period, problem.longest)


_MAX_FACTOR = 10.0
"""Largest factor by which a remedy changes a limit."""
_MAX_EXCESS, _MAX_TIME = 0.95, 0.5
"""Largest excess and time with a remedy, relative to those without it; a change that helps less is no remedy."""


@dataclass(frozen=True)
class Remedy:
    """A change of the limits, and its effect.

    Args:
        change: in words.
        reached: largest half-width of each parameter on any surface.
        enough: True if that reaches the wanted precision.
        needed: necessary duration with the change [s]; may be infinite.
        limit: largest ratio of half-width and wanted precision, after an unlimited time.
    """

    change: str
    reached: dict[str, float]
    enough: bool
    needed: float
    limit: float


def remedies(result: Design) -> list[Remedy]:
    """Changes that help: more time, more force, faster changes, a wider band, a better known lag, a finer position.

    If none is enough by itself, the last remedy is all of them at once.
    """
    helpful = []
    if result.needed <= LONGEST:
        words = f"{ceil(result.needed)} s instead of {result.seconds:g} s"
        reached = result.excitation.worst(result.needed)
        helpful.append(Remedy(words, reached, enough=True, needed=result.needed, limit=1.0))
    together, limit = result.problem, result.excitation.excess(FOREVER, result.problem.precision)
    for change in (_stronger, _steeper, _wider, _synchronous, _finer):
        words, problem = change(result.problem, result.excess)
        if problem == result.problem:
            continue
        remedy = _try_remedy(words, problem, result.seconds)
        excess = max(remedy.reached[name] / target for name, target in problem.precision.items())
        if (
            remedy.needed < _MAX_TIME * result.needed
            or excess < _MAX_EXCESS * result.excess
            or remedy.limit < _MAX_EXCESS * limit
        ):
            helpful.append(remedy)
            together = change(together, result.excess)[1]
    if len(helpful) > 1 and not any(remedy.enough for remedy in helpful):
        helpful.append(_try_remedy("all of these", together, result.seconds))
    return helpful


def _try_remedy(words: str, problem: DesignProblem, seconds: float) -> Remedy:
    excitation = best_multisine(problem, seconds)
    enough = excitation.excess(seconds, problem.precision) <= 1
    limit = excitation.excess(FOREVER, problem.precision)
    return Remedy(words, excitation.worst(seconds), enough, seconds_needed(excitation, problem), limit)


def _stronger(problem: DesignProblem, excess: float) -> tuple[str, DesignProblem]:
    budget, factor = problem.budget, min(1.1 * excess, _MAX_FACTOR)
    swing = factor * budget.swing
    mean = max(budget.mean, budget.least + swing)
    drive = None if budget.drive is None else factor * budget.drive
    words = (
        f"a force of {mean:.3g} N with {swing:.3g} N to each side instead of {budget.mean:g} N "
        f"with {budget.swing:g} N"
    )
    return words, replace(problem, budget=replace(budget, mean=mean, peak=mean + swing, drive=drive))


def _steeper(problem: DesignProblem, excess: float) -> tuple[str, DesignProblem]:
    rate = problem.budget.rate
    faster = min(1.1 * excess, _MAX_FACTOR) * rate
    words = f"a force that changes by {faster:.3g} N/s instead of {rate:g} N/s"
    return words, replace(problem, budget=replace(problem.budget, rate=faster))


def _wider(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    budget = problem.budget
    highest = max(budget.highest, min(2 * budget.highest, 0.45 * problem.sensors.force.sampling))
    words = f"frequencies up to {highest:g} Hz instead of {budget.highest:g} Hz"
    return words, replace(problem, budget=replace(budget, highest=highest))


def _synchronous(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    sensors = problem.sensors
    exact = replace(sensors, lag_std=0.0, force=replace(sensors.force, phase_std=0.0))
    words = f"a lag between force and position known exactly, not to {1e6 * sensors.lag_error:.0f} us"
    return words, replace(problem, sensors=exact)


def _finer(problem: DesignProblem, _excess: float) -> tuple[str, DesignProblem]:
    sensors = problem.sensors
    step = sensors.position_step / _MAX_FACTOR
    words = f"a position in steps of {1e6 * step:.3g} um instead of {1e6 * sensors.position_step:.3g} um"
    return words, replace(problem, sensors=replace(sensors, position_step=step))
