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
    motion: Motion, lag: float, segments: list[Segment]
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
    friction = motion.filtered(direction(motion), 0, lag)
    return {"friction": [reach * friction], "depth": [reach * depth**2, reach * depth**3]}
