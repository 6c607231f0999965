"""Columns of force that no contact model has, but many a log: drift, friction, relaxation, change with time and depth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.octaves import Segment
from palpate.identification.models import Motion, direction

Array = NDArray[np.float64]

_ARMS = 9
_FASTEST, _SLOWEST = 0.02, 5.0
"""Relaxation times of the arms [s]. Between two of nine, spaced evenly in the logarithm, any relaxation is matched to a
few per cent; faster ones are damping, slower ones drift."""


def effect_columns(
    motion: Motion, lag: float, segments: list[Segment], time: Array
) -> dict[str, list[Array]]:
    """Columns by cause, each of shape (m,), scaled to the size of the position's.

    Args:
        motion: of the log.
        lag: of the force behind the position [s].
        segments: of its rows.
        time: of its rows [s], shape (m,).
    """
    x = motion.moved(0, lag)
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    middle, reach = float(x[inside].mean()), float(np.ptp(x[inside])) or 1.0
    depth = (x - middle) / reach
    age = 2 * (time - time[inside[0]]) / max(float(np.ptp(time[inside])), 1e-300) - 1
    friction = motion.filtered(direction(motion), 0, lag)
    return {
        "drift": [reach * age],
        "friction": [reach * friction],
        "relaxation": _arms(x, segments, float(time[1] - time[0])),
        "time": [age * (x - middle)],
        "depth": [reach * depth**2, reach * depth**3],
    }


def _arms(x: Array, segments: list[Segment], dt: float) -> list[Array]:
    """Stretch of the springs of Maxwell arms: y' + y/tau = x'. An arm is relaxed where its segment begins."""
    from scipy.signal import lfilter

    longest = max(s.last - s.first for s in segments) * dt
    times = np.geomspace(max(_FASTEST, 4 * dt), max(min(_SLOWEST, longest), max(_FASTEST, 4 * dt) * 2), _ARMS)
    found = [np.zeros(len(x)) for _ in times]
    for segment in segments:
        own = slice(segment.first, segment.last)
        step = np.diff(x[own], prepend=x[segment.first])
        for column, tau in zip(found, times, strict=True):
            decay = float(np.exp(-dt / tau))
            gain = tau / dt * (1 - decay)  # exact for straight lines between the rows
            column[own] = lfilter([gain], [1.0, -decay], step)
    return found
