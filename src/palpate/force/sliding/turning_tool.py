"""A tool that is kept perpendicular to the surface while it slides: a second, slower loop about its spherical tip."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.sliding.slide_state import HALT
from palpate.force.sliding.sliding_loop import SlidingLoop, three

HALF_TIME_CONSTANT = 10.0
"""Half the time constant of the turning, in theta: below 10 it moves the normal that the force loop learns."""
SMOOTHING = 0.25
"""Time constant of the turning's low-pass over that time: a normal that jumps would shake an elastic arm."""
MAX_RATE = 0.5
"""Largest rate of the turning [rad/s]."""


class TurningTool:
    """Turns a tool's axis into the estimated normal, about the centre of its spherical tip.

    The force loop works on that centre, which moves along a surface parallel to the touched one, with the same normal:
    so turning about it moves nothing. The turning is a proportional and integral one, smooth and well damped: it
    follows a normal that turns evenly without an error, and rests while the slide halts. Neither the tip nor the
    tool's point is faster than the loop's limit: the turning has the speed that the slide leaves. A flat tool's
    moment is not covered.

    Args:
        loop: holds the force.
        axis: of the tool, into the surface when it is perpendicular, in the tool's axes, shape (3,).
        centre: of the tip's sphere from the tool's point, in the tool's axes, shape (3,) [m].
        weight: reading of the payload alone, without a tare, in the base's axes, shape (3,) [N].
        tared: the tool's rotation when the sensor was tared, shape (3, 3); None for a sensor that was not.

    Raises:
        InputError: an axis without length, a vector that is not of three numbers, no rotation.
    """

    def __init__(
        self,
        loop: SlidingLoop,
        axis: ArrayLike = (0.0, 0.0, 1.0),
        centre: ArrayLike = (0.0, 0.0, 0.0),
        weight: ArrayLike = (0.0, 0.0, 0.0),
        tared: ArrayLike | None = None,
    ):
        self.loop = loop
        self._axis, self._centre, self._weight = (
            +three("a vector of the tool", v) for v in (axis, centre, weight)
        )
        length = np.linalg.norm(self._axis)
        if not length > 0.0:
            raise InputError("the tool's axis needs a length, got 0,0,0")
        self._axis /= length
        self._rate, self._turning = np.zeros((2, 3))
        self._bias = np.zeros(3) if tared is None else _rotation(tared).T @ self._weight

    def update(
        self,
        force: ArrayLike,
        position: ArrayLike,
        rotation: ArrayLike,
        direction: ArrayLike,
        missed: float = 0.0,
    ) -> Array:
        """Velocity of the tool's point [m/s] above its turning [rad/s] for this tick, in the base's axes, shape (6,).

        Args:
            force: reading [N], in the base's axes, shape (3,).
            position: of the tool's point [m], shape (3,).
            rotation: of the tool, its axes in columns, shape (3, 3).
            direction: as for `SlidingLoop.update`.
            missed: as for `SlidingLoop.update`.
        """
        R = _rotation(rotation)
        arm = R @ self._centre
        payload = self._weight - R @ self._bias
        velocity = self.loop.update(
            three("force", force) - payload, three("position", position) + arm, direction, missed
        )
        if not self.loop.sliding or self.loop.state[HALT] > 0.0:
            self._rate, self._turning = np.zeros((2, 3))
            return np.concatenate([velocity, self._rate])
        tick = self.loop.gains.arm.tick
        T = HALF_TIME_CONSTANT * self.loop.gains.theta
        error = np.cross(R @ self._axis, self.loop.normal)
        self._rate = _within(self._rate + tick / (4.0 * T * T) * error)
        self._turning += tick / (SMOOTHING * T) * (_within(self._rate + error / T) - self._turning)
        turning = self._turning
        added = np.cross(arm, turning)
        fraction = _share_within(velocity, added, self.loop.law.press.speed)
        return np.concatenate([velocity + fraction * added, fraction * turning])


def _share_within(velocity: Array, added: Array, most: float) -> float:
    """Largest share of what is added to a velocity with which its size stays within the most [m/s]."""
    square = float(added @ added)
    both = float(velocity @ added)
    room = max(most * most - float(velocity @ velocity), 0.0)
    if 2.0 * both + square <= room:
        return 1.0
    return float(max(np.sqrt(both * both + square * room) - both, 0.0) / square)


def _within(turning: Array) -> Array:
    return turning / max(float(np.linalg.norm(turning)) / MAX_RATE, 1.0)


def _rotation(values: ArrayLike) -> Array:
    R = np.asarray(values, dtype=np.float64)
    if R.shape != (3, 3) or not np.abs(R @ R.T - np.eye(3)).max() < 1e-3:
        raise InputError(
            "the tool's rotation needs a matrix of shape (3, 3) whose columns are perpendicular unit vectors"
        )
    return R
