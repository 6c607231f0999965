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


def from_matrix_by_columns(m: Sequence[float]) -> Quaternion:
    """The quaternion x, y, z, w of a matrix of 4 x 4 by columns (Shepperd's method)."""
    a, b, c = m[0], m[5], m[10]
    four = (1.0 + a - b - c, 1.0 - a + b - c, 1.0 - a - b + c, 1.0 + a + b + c)
    k = max(range(4), key=lambda i: four[i])
    half = math.sqrt(max(four[k], 0.0)) / 2.0
    s = 0.25 / half
    if k == 3:
        return s * (m[6] - m[9]), s * (m[8] - m[2]), s * (m[1] - m[4]), half
    if k == 0:
        return half, s * (m[1] + m[4]), s * (m[8] + m[2]), s * (m[6] - m[9])
    if k == 1:
        return s * (m[1] + m[4]), half, s * (m[6] + m[9]), s * (m[8] - m[2])
    return s * (m[8] + m[2]), s * (m[6] + m[9]), half, s * (m[1] - m[4])


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
