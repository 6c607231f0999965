"""How the estimates settled while the data of a log came in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.least_squares import covariance, noise_of, quantile, solve
from palpate.identification.result import Identification, Parameter, Traces

Array = NDArray[np.float64]

_POINTS = 48
_FEWEST = 30
_SINGULAR = 1e12
_EXACT = 1e-3


@dataclass(frozen=True)
class Growth:
    """One parameter by the growing part of the log.

    Args:
        time: up to which the log was used [s], shape (k,).
        value: the estimate, shape (k,).
        low, high: the ends of its 95 % interval, shape (k,).
    """

    time: Array
    value: Array
    low: Array
    high: Array


def growth(found: Identification) -> dict[str, Growth]:
    """The linear parameters fitted to growing parts of what was fitted; empty if there are too few samples.

    The model, its knobs, the lag and the colour of the noise are those of the whole log. What that fit knows beyond
    plain least squares (what noise of the position did to the answer) is taken over to all points alike, and so is what
    its intervals hold beyond (the lag's and the calibration's uncertainty): the last point is what is reported.
    """
    traces = found.traces
    if traces is None or not traces.columns or len(traces.fitted_time) < 2 * _FEWEST:
        return {}
    time, values, halves = _refits(traces)
    if not len(time):
        return {}
    return {
        name: _ending_as_reported(time, values[:, i], halves[:, i], found.parameters.get(name))
        for i, name in enumerate(traces.columns)
        if name != "offset"
    }


def _refits(traces: Traces) -> tuple[Array, Array, Array]:
    """Times, estimates and half-widths of all parameters, shapes (k,), (k, p) and (k, p)."""
    names, columns = tuple(traces.columns), np.column_stack(tuple(traces.columns.values()))
    theta = np.array([traces.theta[name] for name in names])
    residuals = traces.fitted_force - traces.predicted
    place = _place(traces.fitted_time)
    noise = noise_of(residuals, place, len(names))
    known = np.array([traces.prior.get(name, np.inf) for name in names])
    known[known == 0] = _EXACT * np.abs(theta[known == 0])
    # What was known beforehand stands as observations beside the log's, about the estimate that it led to.
    rows, targets = np.diag(np.sqrt(noise.variance) / known), np.zeros(len(names))
    counts = np.linspace(max(_FEWEST, len(place) // _POINTS), len(place), _POINTS).astype(int)
    counts = np.array([count for count in np.unique(counts) if _full_rank(columns[:count])], dtype=int)
    values, halves = np.empty((len(counts), len(names))), np.empty((len(counts), len(names)))
    for k, count in enumerate(counts):
        part = columns[:count]
        spread = np.diag(covariance(part, place[:count], noise, known))
        values[k] = theta + solve(np.vstack([part, rows]), np.concatenate([residuals[:count], targets]))
        t = quantile(noise.effective * count / len(place), len(names))
        halves[k] = t * np.sqrt(np.maximum(spread, 0.0))
    return traces.fitted_time[counts - 1], values + theta - values[-1:], halves


def _place(time: Array) -> NDArray[np.intp]:
    """Rows of the even grid that samples stand on."""
    step = float(np.median(np.diff(time)))
    return np.rint((time - time[0]) / step).astype(np.intp)


def _full_rank(columns: Array) -> bool:
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    if not scale.all():
        return False
    gram = columns.T @ columns / np.outer(scale, scale)
    return bool(np.linalg.cond(gram) < _SINGULAR)


def _ending_as_reported(time: Array, value: Array, half: Array, said: Parameter | None) -> Growth:
    """The own intervals, each side widened or scaled alike at all points so that the last is the reported one."""
    ends = [half, half]
    if said is not None and said.ci95 is not None and said.value is not None:
        ends = [_widened(half, abs(end - said.value)) for end in said.ci95]
    return Growth(time, value, value - ends[0], value + ends[1])


def _widened(half: Array, reported: float) -> Array:
    last = half[-1]
    if reported > last:
        return np.sqrt(half**2 + reported**2 - last**2)
    return half * reported / last if last else half
