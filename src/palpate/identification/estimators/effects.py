"""Columns of force that no contact model has, but many a log.

Friction, hysteresis, a stiffness that goes with depth; where the log holds the approach, a force that is there at once
with the touch (adhesion, or a surface that is met elsewhere), and the inertia of what moves before it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.octaves import Segment
from palpate.identification.models import Model, Motion, direction

Array = NDArray[np.float64]

FRICTION = "Fc"
TOUCH = "touch"


def effect_columns(motion: Motion, model: Model, lag: float, segments: list[Segment]) -> dict[str, Array]:
    """Columns by name, each of shape (m,), of what the model has not got itself.

    Args:
        motion: of the log.
        model: that they stand beside.
        lag: of the force behind the position [s].
        segments: of the rows.
    """
    found = {FRICTION: motion.filtered(direction(motion), 0, lag)}
    if model.nonlinear:
        return found
    if motion.free is not None and motion.touched is not None:
        found[TOUCH] = motion.filtered(motion.touched, 0, lag)
        found["free inertia"] = motion.filtered(motion.free, 2, lag)
    x = motion.moved(0, lag)
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    depth = (x - float(x[inside].mean())) / (float(np.ptp(x[inside])) or 1.0)
    return found | {"depth^2": depth**2, "depth^3": depth**3, "hysteresis": _in_quadrature(x, segments)}


def _in_quadrature(x: Array, segments: list[Segment]) -> Array:
    """A force a quarter of a period ahead of the position at every frequency, shape (m,): the loss goes with the way.

    Foam, rubber and friction lose so; over one frequency it is no other than damping (structural damping, Myklestad
    1952), and only a loss that grows with the frequency is a B.
    """
    from scipy.fft import next_fast_len
    from scipy.signal import detrend, hilbert

    found = np.zeros(len(x))
    for s in segments:
        own = detrend(x[s.first : s.last])
        found[s.first : s.last] = np.imag(hilbert(own, next_fast_len(2 * len(own))))[: len(own)]
    return found
