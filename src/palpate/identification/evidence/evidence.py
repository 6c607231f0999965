"""All that a log shows before any model, one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.arrays import Array
from palpate.identification import in_series
from palpate.identification.estimators.octaves import segments_of
from palpate.identification.evidence.loadings import loadings_in
from palpate.identification.evidence.press import at_constant_speed, press_of
from palpate.identification.evidence.slope import slope_of
from palpate.identification.evidence.spectrum import dynamic_stiffness
from palpate.identification.evidence.working_point import steady_point, working_point
from palpate.identification.options import Options
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, Press, WorkingPoint

Evidence = tuple[tuple[DynamicStiffness, ...], Press | None, WorkingPoint | None]


def evidence_of(problem: Problem, options: Options, unit: str, hidden: float) -> Evidence:
    """Dynamic stiffness, press and working point of the surface.

    Args:
        problem: of the log.
        options: with the tolerance, and the stiffness in series with the surface.
        unit: of a stiffness.
        hidden: share of the force's amplitude in contact that nothing explains, beyond its noise.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        return (), None, None
    lag = problem.lag
    spectrum = dynamic_stiffness(problem, segments, lag.value, lag.std)
    whole = problem.with_touches or problem  # a press may be over before a filter has settled
    press = press_of(whole, lag.value, segments_of(whole.motion.rows, whole.spans) or segments)
    steady = problem.contacts.press
    if steady is not None:
        press = at_constant_speed(steady, press, problem.origin)
    if options.series_stiffness is not None:
        series = options.series_stiffness, options.series_std
        spectrum = in_series.spectrum_without_series(spectrum, *series)
        press = None if press is None else in_series.press_without_series(press, *series)
    if options.series_mass is not None:
        spectrum = in_series.spectrum_without_swing(spectrum, *options.swing)
    if steady is not None:
        return spectrum, press, steady_point(steady.headline, problem, options, unit)
    point = working_point(whole, spectrum, options, unit, hidden)
    return spectrum, press, point


def stiffness_of(problem: Problem, force: Array, point: WorkingPoint) -> float | None:
    """Stiffness at a working point by another force at the same rows [N/m]; None if it shows none.

    Args:
        problem: of the log.
        force: as a model foretells it, shape (m,).
        point: an octave, or the press.
    """
    problem = replace(problem, force=force)
    segments = segments_of(problem.motion.rows, problem.spans)
    if point.source == "press":
        slope = slope_of(loadings_in(problem, problem.lag.value, segments))
        return None if slope is None else slope.stiffness
    spectrum = dynamic_stiffness(problem, segments, problem.lag.value, problem.lag.std)
    near = [own for own in spectrum if abs(np.log2(own.frequency / point.frequency_Hz)) < 0.5]
    return near[0].storage if near else None
