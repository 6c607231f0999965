"""Rotations between the ways in which wires write them, one at a time and without a library."""

from __future__ import annotations

import math
from collections.abc import Sequence

from palpate.wires.protocol import Quaternion


def from_rotation_vector(vector: Sequence[float]) -> Quaternion:
    """The quaternion x, y, z, w of a rotation vector [rad]."""
    x, y, z = vector
    angle = math.sqrt(x * x + y * y + z * z)
    share = 0.5 if angle < 1e-12 else math.sin(angle / 2.0) / angle
    return share * x, share * y, share * z, math.cos(angle / 2.0)


def turned(q: Quaternion, v: Sequence[float]) -> tuple[float, float, float]:
    """A vector in the tool's axes turned into the base's."""
    x, y, z, w = q
    a, b, c = v
    # v + 2 w (u x v) + 2 u x (u x v) with the quaternion's vector part u
    d, e, f = y * c - z * b, z * a - x * c, x * b - y * a
    return (
        a + 2.0 * (w * d + y * f - z * e),
        b + 2.0 * (w * e + z * d - x * f),
        c + 2.0 * (w * f + x * e - y * d),
    )
