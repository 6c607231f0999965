"""The stiffness at the working point: one number that the log shows, whatever the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.identification.estimators.budget import HIDDEN_SHARE
from palpate.identification.estimators.octaves import segments_of
from palpate.identification.evidence.slope import Slope, slope_in, unseen
from palpate.identification.in_series import slope_without_series
from palpate.identification.options import Options
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, Parameter, Verdict, WorkingPoint
from palpate.identification.tangents import Slopes

_EXCITED = 0.05
"""Share of the position's variance that makes an octave worth a headline: one part in twenty of the motion."""


def working_point(
    problem: Problem,
    spectrum: Sequence[DynamicStiffness],
    options: Options,
    unit: str,
    hidden: float,
) -> WorkingPoint | None:
    """The most excited octave whose interval is within the tolerance; else the press; else the narrower of them.

    An octave whose storage falls below a lower one's by more than both half-widths shows something other than the
    surface (a probe that follows it, an inertia), and is passed over. A force that nothing explains, as where the probe
    bounces, is at every frequency at once: as much of it as is seen may be at the octave's own.
    """
    lag, tolerance = problem.lag.value, options.tolerance
    segments = segments_of(problem.motion.rows, problem.spans)
    slope = slope_in(problem, segments)
    if slope is not None and options.series_stiffness is not None:
        series = options.series_stiffness, options.series_std
        value, half = slope_without_series(slope.stiffness, slope.half, *series)
        each = tuple(slope_without_series(own, 0.0, *series)[0] for own in slope.each)
        gain = half / slope.half if slope.half else 1.0
        slope = replace(slope, stiffness=value, half=half, each=each, budget=_scaled(slope.budget, gain))
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    depths = problem.motion.moved(0, lag)[inside]
    octave = _octave(spectrum, tolerance)
    if octave is None and slope is None:
        return None
    use_press = octave is None or (
        slope is not None
        and octave.storage_half > tolerance * abs(octave.storage)
        and slope.half / abs(slope.stiffness or 1e-300) < octave.storage_half / abs(octave.storage or 1e-300)
    )
    if use_press and slope is not None:
        value, half, frequency, again = slope.stiffness, slope.half, 0.25 / slope.rise, _again(slope)
        budget, force, depth = slope.budget, slope.force, slope.depth
    else:
        assert octave is not None
        value, half, frequency, again = octave.storage, octave.storage_half, octave.frequency, None
        force, depth = float(problem.force[inside].mean()), float(depths.mean())
        unseen_force = HIDDEN_SHARE * hidden * float(np.hypot(octave.storage, octave.loss))
        budget, half = {**octave.budget, "unexplained": unseen_force}, float(np.hypot(half, unseen_force))
    if problem.contacts.bonded and not options.bonded:  # nothing tells that the first reading is in contact
        budget = {**budget, "unseen way": abs(value) * unseen(problem)}
        half = float(np.hypot(half, budget["unseen way"]))
    rest = 0.0 if problem.counted else problem.contacts.resting
    contacts = problem.contacts
    stiffness = replace(_judged(value, half, tolerance, unit), budget=_largest(budget, half))
    against = ""
    if not contacts.signed or (contacts.bonded and value < 0 and not options.bonded):
        against = "the signs of force and position are not known (give --force-sign)"
    elif value < 0 and not options.bonded:
        against = (
            "the force falls as the probe goes in: either the surface yields, or it moves, and then this is the"
            " stiffness of what holds the probe"
        )
    if against:
        reason = f"{stiffness.reason}; {against}"
        stiffness = replace(stiffness, verdict=Verdict.NOT_IDENTIFIABLE, reason=reason)
    source = "press" if use_press else "octave"
    return WorkingPoint(stiffness, force - rest, depth, float(frequency), source, again, not contacts.bonded)


def steady_point(own: Slopes, problem: Problem, options: Options, unit: str) -> WorkingPoint:
    """The tangent of a press at constant speed, and the force and depth that it belongs to.

    Args:
        own: at the force that is named.
        problem: of the log.
        options: with the tolerance, and the stiffness in series with the surface.
        unit: of a stiffness.
    """
    value, half, again = own.stiffness, own.half, own.again
    if options.series_stiffness is not None:
        series = options.series_stiffness, options.series_std
        gain = slope_without_series(value, 0.0, *series)[0] / value
        value, half = slope_without_series(value, half, *series)
        again = None if again is None else gain**2 * again
    budget = _scaled(own.budget, half / own.half if own.half else 1.0)
    stiffness = replace(_judged(value, half, options.tolerance, unit), budget=_largest(budget, half))
    interval = None if again is None else (value - again, value + again)
    depth = own.depth - problem.origin
    return WorkingPoint(
        stiffness, own.force, depth, 0.25 / own.rise, "press", interval, not problem.contacts.bonded
    )


def _scaled(budget: dict[str, float], gain: float) -> dict[str, float]:
    return {cause: gain * part for cause, part in budget.items()}


def _largest(budget: dict[str, float], half: float) -> dict[str, float]:
    """Causes that count, largest first."""
    kept = {cause: part for cause, part in budget.items() if part > 1e-3 * half}
    return dict(sorted(kept.items(), key=lambda item: -item[1]))


def _octave(spectrum: Sequence[DynamicStiffness], tolerance: float) -> DynamicStiffness | None:
    """The most excited octave that tells its storage within the tolerance; else the most excited one.

    At a resonance the motion is largest, and the storage, which goes through zero there, is told least.
    """
    kept = []
    for i, own in enumerate(spectrum):
        lower = [o for o in spectrum[:i] if o.share >= _EXCITED]
        falls = any(own.storage + own.storage_half < o.storage - o.storage_half for o in lower)
        if own.share >= _EXCITED and not falls:
            kept.append(own)
    told = [own for own in kept if own.storage_half <= tolerance * abs(own.storage)]
    return max(told or kept, key=lambda own: own.share, default=None)


def _again(slope: Slope) -> tuple[float, float] | None:
    """Where the slope of the next loading falls: t(n - 2) sqrt(between + own)."""
    n = len(slope.each)
    if n < 3:
        return None
    from scipy.special import stdtrit

    half = float(stdtrit(n - 2, 0.975)) * float(np.std(slope.each, ddof=1)) * float(np.sqrt(1 + 1 / n))
    return slope.stiffness - half, slope.stiffness + half


def _judged(value: float, half: float, tolerance: float, unit: str) -> Parameter:
    share = half / abs(value) if value else np.inf
    interval = (value - half, value + half)
    if share <= tolerance:
        reason = f"known to {100 * share:.2g} % (95 %), whatever the model"
        return Parameter(value, half / 1.96, interval, unit, Verdict.IDENTIFIED, reason)
    reason = f"95 %: {interval[0]:.3g} to {interval[1]:.3g} {unit}; wider than {tolerance:.0%}"
    return Parameter(value, half / 1.96, interval, unit, Verdict.NOT_IDENTIFIABLE, reason)
