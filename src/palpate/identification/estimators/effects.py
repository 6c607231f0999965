"""Columns of force that no contact model has, but many a log.

Friction, hysteresis, a stiffness that goes with depth; where the log holds the approach, a force that is there at once
with the touch (adhesion, or a surface that is met elsewhere), and the inertia of what moves before it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.estimators.octaves import Segment
from palpate.identification.models import Model, Motion
from palpate.signals.samples import detrend, quadrature

FRICTION = "Fc"
TOUCH = "touch"
_BREAKAWAY = (0.03, 0.1, 0.3)
"""Ways that friction turns within, of the reach in contact, half a decade apart from the longest that is no matter of
the stiffness on. Without them K took the spring that friction is before it slips: `make trust`, surface friction."""


def effect_columns(motion: Motion, model: Model, lag: float, segments: list[Segment]) -> dict[str, Array]:
    """Columns by name, each of shape (m,), of what the model has not got itself.

    Args:
        motion: of the log.
        model: that they stand beside.
        lag: of the force behind the position [s].
        segments: of the rows.
    """
    x = motion.moved(0, lag)
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    reach = float(np.ptp(x[inside])) or 1.0
    found = _friction(motion, lag, inside)
    if model.nonlinear:
        return found
    if motion.free is not None and motion.touched is not None:
        found[TOUCH] = motion.filtered(motion.touched, 0, lag)
        found["free inertia"] = motion.filtered(motion.free, 2, lag)
    depth = (x - float(x[inside].mean())) / reach
    return found | {"depth^2": depth**2, "depth^3": depth**3, "hysteresis": _in_quadrature(x, segments)}


def _friction(motion: Motion, lag: float, inside: NDArray[np.intp]) -> dict[str, Array]:
    """Friction, and what of it turns within a shorter way: elements that hold as springs and slip one after the other.

    Side by side they follow any curve from sticking to slipping (Iwan 1966; the Maxwell-slip model). What the probe
    passes from one sample to the next is not seen to turn.
    """
    reach = float(np.ptp(motion.moved(0, 0.0)[inside]))
    at = motion.instants[inside].astype(np.intp)
    step = float(np.sqrt(np.mean(np.diff(motion.position, append=motion.position[-1])[at] ** 2)))
    ways = (0.0, *(way * reach for way in _BREAKAWAY if way * reach >= step))
    turned = [motion.filtered(motion.direction(way), 0, lag) for way in ways]
    sooner = {f"{FRICTION} {i}": short - long for i, (short, long) in enumerate(pairwise(turned))}
    return {FRICTION: turned[-1]} | {name: column for name, column in sooner.items() if column.any()}


def _in_quadrature(x: Array, segments: list[Segment]) -> Array:
    """A force a quarter of a period ahead of the position at every frequency, shape (m,): the loss goes with the way.

    Foam, rubber and friction lose so; over one frequency it is no other than damping (structural damping, Myklestad
    1952), and only a loss that grows with the frequency is a B.
    """
    found = np.zeros(len(x))
    for s in segments:
        found[s.first : s.last] = quadrature(detrend(x[s.first : s.last]))
    return found
