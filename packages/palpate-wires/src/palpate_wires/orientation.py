"""Orientations as the arms give them, as quaternions x, y, z, w."""

import math
from collections.abc import Sequence

from palpate.wires import Quaternion


def from_rotation_vector(vector: Sequence[float]) -> Quaternion:
    """The quaternion x, y, z, w of a rotation vector [rad]; no numbers of one that is not finite."""
    x, y, z = vector
    angle = math.hypot(x, y, z)
    if not angle < math.inf:
        return (math.nan,) * 4
    share = 0.5 if angle < 1e-12 else math.sin(angle / 2.0) / angle
    return share * x, share * y, share * z, math.cos(angle / 2.0)


def from_matrix_by_columns(m: Sequence[float]) -> Quaternion:
    """The quaternion x, y, z, w of a homogeneous matrix of 4 x 4 that is written by columns.

    From the largest of its four squares, so that nothing small divides (Shepperd, J. Guidance and Control 1 (1978)
    223). It has the length 1 if the matrix is a rotation, and another one if it is none.
    """
    a, b, c = float(m[0]), float(m[5]), float(m[10])
    squares = (1.0 + a - b - c, 1.0 - a + b - c, 1.0 - a - b + c, 1.0 + a + b + c)
    most = max(range(4), key=squares.__getitem__)
    xy, xz, yz = m[4] + m[1], m[8] + m[2], m[9] + m[6]
    xw, yw, zw = m[6] - m[9], m[8] - m[2], m[1] - m[4]
    row = (
        (squares[0], xy, xz, xw),
        (xy, squares[1], yz, yw),
        (xz, yz, squares[2], zw),
        (xw, yw, zw, squares[3]),
    )[most]
    double = 2.0 * math.sqrt(squares[most])
    x, y, z, w = (float(part) / double for part in row)
    return x, y, z, w


def turn_vector(q: Quaternion, v: Sequence[float]) -> tuple[float, float, float]:
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
