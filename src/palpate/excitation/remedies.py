"""Remedies if an excitation cannot reach the requested precision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

from palpate.excitation.design import FOREVER, MAKERS, Design, needed
from palpate.excitation.problem import LONGEST, Problem

_MUCH = 10.0  # times the force
_HELPS, _SOONER = 0.95, 0.5  # of the excess, or of the time needed; what helps less is no remedy


@dataclass(frozen=True)
class Remedy:
    """A change of the limits, and its effect.

    Args:
        change: in words.
        reached: largest half-width of each parameter on any surface with it.
        enough: whether that reaches the requested precision.
        needed: how long it must last with it [s], the change of the duration aside; may be infinite.
        limit: largest half-width per that asked for, however long it lasts.
    """

    change: str
    reached: dict[str, float]
    enough: bool
    needed: float
    limit: float


def remedies(found: Design) -> list[Remedy]:
    """Of more time, more force, faster changes, a wider band, a better known lag and a finer position those that help.

    If none is enough by itself, all of them at once.
    """
    helpful = []
    if found.needed <= LONGEST:
        told = f"{ceil(found.needed)} s instead of {found.seconds:g} s"
        helpful.append(Remedy(told, found.made.worst(found.needed), True, found.needed, 1.0))
    together, limit = found.problem, found.made.excess(FOREVER, found.problem.precision)
    for change in (_stronger, _steeper, _wider, _synchronous, _finer):
        words, other = change(found.problem, found.excess)
        if other == found.problem:
            continue
        tried = _tried(words, other, found.seconds)
        sooner = tried.needed < _SOONER * found.needed
        if sooner or _excess(tried, found) < _HELPS * found.excess or tried.limit < _HELPS * limit:
            helpful.append(tried)
            together = change(together, found.excess)[1]
    if len(helpful) > 1 and not any(remedy.enough for remedy in helpful):
        helpful.append(_tried("all of these", together, found.seconds))
    return helpful


def _tried(words: str, problem: Problem, seconds: float) -> Remedy:
    made = MAKERS[problem.kind](problem, seconds)
    enough = made.excess(seconds, problem.precision) <= 1
    limit = made.excess(FOREVER, problem.precision)
    return Remedy(words, made.worst(seconds), enough, needed(made, problem), limit)


def _excess(tried: Remedy, found: Design) -> float:
    return max(tried.reached[name] / asked for name, asked in found.problem.precision.items())


def _stronger(problem: Problem, excess: float) -> tuple[str, Problem]:
    budget, more = problem.budget, min(1.1 * excess, _MUCH)
    swing = more * budget.swing
    mean = max(budget.mean, budget.least + swing)
    drive = None if budget.drive is None else more * budget.drive
    words = (
        f"a force of {mean:.3g} N with {swing:.3g} N to each side instead of {budget.mean:g} N "
        f"with {budget.swing:g} N"
    )
    return words, replace(problem, budget=replace(budget, mean=mean, peak=mean + swing, drive=drive))


def _steeper(problem: Problem, excess: float) -> tuple[str, Problem]:
    rate = problem.budget.rate
    faster = min(1.1 * excess, _MUCH) * rate
    words = f"a force that changes by {faster:.3g} N/s instead of {rate:g} N/s"
    return words, replace(problem, budget=replace(problem.budget, rate=faster))


def _wider(problem: Problem, _excess: float) -> tuple[str, Problem]:
    budget = problem.budget
    highest = max(budget.highest, min(2 * budget.highest, 0.45 * problem.sensors.force.sampling))
    words = f"frequencies up to {highest:g} Hz instead of {budget.highest:g} Hz"
    return words, replace(problem, budget=replace(budget, highest=highest))


def _synchronous(problem: Problem, _excess: float) -> tuple[str, Problem]:
    sensors = problem.sensors
    exact = replace(sensors, lag_std=0.0, force=replace(sensors.force, phase_std=0.0))
    words = f"a lag between force and position known exactly, not to {1e6 * sensors.lag_error:.0f} us"
    return words, replace(problem, sensors=exact)


def _finer(problem: Problem, _excess: float) -> tuple[str, Problem]:
    sensors = problem.sensors
    step = sensors.position_step / _MUCH
    words = f"a position in steps of {1e6 * step:.3g} um instead of {1e6 * sensors.position_step:.3g} um"
    return words, replace(problem, sensors=replace(sensors, position_step=step))
