"""The contact's normal: found from the direction in which the force changes, with how well it is known.

Changes, because a bias of the sensor that nobody has taken off has a direction of its own and does not change. A force
with friction stands off the normal by up to the arctangent of the coefficient of friction, and no log of one motion
tells; so what is found here is the direction of the force.

A normal that is off by a small angle d turns both the force and the position. K, B and M scale as F(n)/x(n), so where
tool and force go along the normal the two cosines cancel up to d^2; where the tool moves along the surface by s for
each unit of penetration they leave an error of s d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.free_motion.inertia import BLOCKS

MATTERS = 0.02
"""Relative standard deviation that the normal may add to K, B and M unsaid: 4 % at 95 %, which in quadrature takes a
hundredth from the 25 % that an identified parameter may have."""
_NOTHING = 0.99
"""Relative standard deviation of a number of which nothing is known; at 1 the interval holds zero for certain."""
_NO_AXIS = MATTERS**0.5
"""Standard deviation of the angle d above which the force has no direction [rad]: its square alone matters then."""


@dataclass(frozen=True)
class Normal:
    """A direction in the base's axes.

    Args:
        direction: of unit length, shape (3,).
        std: standard deviation of its angle about each of the two axes across it [rad]; 0 for one that was given.
        found: from the force; otherwise it was given.
    """

    direction: Array
    std: float
    found: bool

    @property
    def shown(self) -> bool:
        """Whether the log shows a normal at all."""
        return self.std <= _NO_AXIS


def direction_of(force: Array) -> tuple[Array, float]:
    """The axis along which a force, shape (n, 3), changes most, and the standard deviation of its angle [rad].

    It is the first axis of the covariance. To first order, noise turns it towards another axis by what the covariance
    between the two should not be, over the difference of their variances; the scatter of that from block to block of
    the log says how well the axis is known, whatever the noise's colour. A force that changes in all directions alike,
    as noise does, has no axis, and the angle's deviation says so.
    """
    changes = force - force.mean(axis=0)
    variances, axes = np.linalg.eigh(changes.T @ changes)
    along, across = changes @ axes[:, 2], changes @ axes[:, :2]
    blocks = np.array([block.sum(axis=0) for block in np.array_split(along[:, None] * across, BLOCKS)])
    turned = np.sum(blocks**2, axis=0) * BLOCKS / (BLOCKS - 1) / (variances[2] - variances[:2]) ** 2
    return axes[:, 2], float(np.sqrt(np.mean(turned)))


def across_per_along(vectors: Array, axis: Array) -> Array:
    """How far vectors, shape (n, 3), go across an axis for each unit along it, shape (3,)."""
    changes = vectors - vectors.mean(axis=0)
    along = changes @ axis
    slope: Array = (along @ changes) / (along @ along)
    return slope - axis


def scale_std(normal: Normal, force: Array, place: Array) -> float:
    """Effect of the normal's uncertainty on K, B and M, as a relative standard deviation.

    Args:
        normal: with its uncertainty.
        force: in contact [N], shape (n, 3).
        place: of the point that touches, in contact [m], shape (m, 3).

    Returns:
        Below 1: at that, nothing is known.
    """
    if not normal.std:
        return 0.0
    if not normal.shown:
        return _NOTHING
    slip = across_per_along(place, normal.direction) - across_per_along(force, normal.direction)
    return min(float(np.hypot(np.linalg.norm(slip) * normal.std, normal.std**2)), _NOTHING)
