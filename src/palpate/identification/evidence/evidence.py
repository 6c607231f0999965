"""All that a log shows before any model, one after the other."""

from __future__ import annotations

from palpate.identification import in_series
from palpate.identification.estimators.octaves import segments_of
from palpate.identification.evidence.press import press_of
from palpate.identification.evidence.spectrum import dynamic_stiffness
from palpate.identification.evidence.working_point import working_point
from palpate.identification.options import Options
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, Press, WorkingPoint

Evidence = tuple[tuple[DynamicStiffness, ...], Press | None, WorkingPoint | None]


def evidence_of(problem: Problem, options: Options, unit: str) -> Evidence:
    """Dynamic stiffness, press and working point of the surface.

    Args:
        problem: of the log.
        options: with the tolerance, and the stiffness in series with the surface.
        unit: of a stiffness.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        return (), None, None
    lag = problem.lag
    spectrum = dynamic_stiffness(problem, segments, lag.value, lag.std)
    whole = problem.with_touches or problem  # a press may be over before a filter has settled
    press = press_of(whole, lag.value, segments_of(whole.motion.rows, whole.spans) or segments)
    if options.series_stiffness is not None:
        series = options.series_stiffness, options.series_std
        spectrum = in_series.spectrum_without_series(spectrum, *series)
        press = None if press is None else in_series.press_without_series(press, *series)
    point = working_point(whole, spectrum, options, unit)
    return spectrum, press, point
