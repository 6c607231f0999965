"""Rotations in the forms that arms and logs use. A quaternion is x, y, z, w; a rotation vector is axis times angle."""

import math
from collections.abc import Sequence

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

_Quaternion = tuple[float, float, float, float]
_MAX_LENGTH_ERROR = 0.1
"""Largest error of a quaternion's length when its four numbers are rounded to one digit."""
_MAX_MATRIX_ERROR = 0.1
"""Largest error of R R^T: logs are rounded, and numbers in another order miss the identity by far more."""


def quaternion_from_vector(vector: Sequence[float]) -> _Quaternion:
    """Quaternion of a rotation vector [rad]; four NaN if the vector is not finite."""
    x, y, z = vector
    angle = math.hypot(x, y, z)
    if not angle < math.inf:
        return (math.nan,) * 4
    factor = 0.5 if angle < 1e-12 else math.sin(angle / 2.0) / angle
    return factor * x, factor * y, factor * z, math.cos(angle / 2.0)


def quaternion_from_columns(m: Sequence[float]) -> _Quaternion:
    """Quaternion of a homogeneous 4 x 4 matrix that is written by columns.

    The largest of the four squares is divided by, so that nothing small is (Shepperd, J. Guidance and Control 1 (1978)
    223). The quaternion has the length 1 if the matrix is a rotation; four NaN if all squares are 0.
    """
    a = float(m[0])
    b = float(m[5])
    c = float(m[10])
    squares = (1.0 + a - b - c, 1.0 - a + b - c, 1.0 - a - b + c, 1.0 + a + b + c)
    largest = max(range(4), key=squares.__getitem__)
    xy = m[4] + m[1]
    xz = m[8] + m[2]
    yz = m[9] + m[6]
    xw = m[6] - m[9]
    yw = m[8] - m[2]
    zw = m[1] - m[4]
    row = (
        (squares[0], xy, xz, xw),
        (xy, squares[1], yz, yw),
        (xz, yz, squares[2], zw),
        (xw, yw, zw, squares[3]),
    )[largest]
    if not squares[largest] > 0.0:
        return (math.nan,) * 4
    double = 2.0 * math.sqrt(squares[largest])
    x, y, z, w = (float(part) / double for part in row)
    return x, y, z, w


def rotate(quaternion: _Quaternion, vector: Sequence[float]) -> tuple[float, float, float]:
    """A vector in the tool's axes, in the base's axes."""
    x, y, z, w = quaternion
    a, b, c = vector
    # v + 2 w (u x v) + 2 u x (u x v) with the quaternion's vector part u
    d = y * c - z * b
    e = z * a - x * c
    f = x * b - y * a
    return (
        a + 2.0 * (w * d + y * f - z * e),
        b + 2.0 * (w * e + z * d - x * f),
        c + 2.0 * (w * f + x * e - y * d),
    )


def vector_from_matrix(R: Array) -> Array:
    """Rotation vector [rad] of a matrix, shape (3,)."""
    w = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = float(np.linalg.norm(w))
    cosine = 0.5 * (float(np.trace(R)) - 1.0)
    if sine > 1e-6 or cosine > 0.0:
        return w * (np.arctan2(sine, cosine) / sine) if sine > 0.0 else w
    # Half a turn: the sign of the axis does not matter, its direction is the column that is longest.
    outer = 0.5 * (R + np.eye(3))
    axis = outer[:, int(np.argmax(np.diag(outer)))]
    return np.pi * axis / np.linalg.norm(axis)


def matrix_from_vector(vector: Array) -> Array:
    """Rotation matrix, shape (3, 3), of a rotation vector [rad]."""
    angle = float(np.linalg.norm(vector))
    k = np.cross(np.eye(3), vector / angle if angle > 0.0 else vector)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def matrix_from_rpy(rpy: Sequence[float]) -> Array:
    """Rotation matrix, shape (3, 3), of roll, pitch and yaw about fixed axes [rad]."""
    from scipy.spatial.transform import Rotation

    matrix: Array = Rotation.from_euler("xyz", rpy).as_matrix()
    return matrix


def to_base(rotations: Array, vectors: Array) -> Array:
    """Vectors in the tool's axes, shape (n, 3), in the base's, by the tool's rotation matrices, shape (n, 3, 3)."""
    rotated: Array = np.einsum("nij,nj->ni", rotations, vectors)
    return rotated


def to_tool(rotations: Array, vectors: Array) -> Array:
    """Vectors in the base's axes, shape (n, 3), or one of shape (3,), in the tool's axes, shape (n, 3)."""
    rotated: Array = np.einsum("nji,j->ni" if vectors.ndim == 1 else "nji,nj->ni", rotations, vectors)
    return rotated


def dot_rows(first: Array, second: Array) -> Array:
    """Scalar products of the rows of two arrays of shape (n, 3), shape (n,)."""
    products: Array = np.einsum("ij,ij->i", first, second)
    return products


def keep_sign(quaternions: Array) -> Array:
    """Quaternions, shape (n, 4), each with the sign that is nearer to the one before.

    q and -q are the same rotation, and drivers change between them at will; a mean of both is none.
    """
    products = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    signs = np.cumprod(np.r_[1.0, np.where(products < 0, -1.0, 1.0)])
    steady: Array = quaternions * signs[:, None]
    return steady


def matrices_from_quaternions(time: Array, quaternions: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of quaternions, shape (n, 4); rows with NaN are interpolated over time.

    Raises:
        InputError: the quaternions are not of unit length.
    """
    from scipy.spatial.transform import Rotation

    finite = np.isfinite(quaternions.sum(axis=1))
    lengths = np.linalg.norm(quaternions[finite], axis=1)
    if not len(lengths) or np.abs(lengths - 1).max() > _MAX_LENGTH_ERROR:
        worst = lengths[np.argmax(np.abs(lengths - 1))] if len(lengths) else float("nan")
        raise InputError(f"the pose's quaternions must have length 1, got {worst:.3g}; give them as x,y,z,w")
    steady = keep_sign(quaternions[finite])
    if not finite.all():
        steady = np.column_stack([np.interp(time, time[finite], part) for part in steady.T])
    matrices: Array = Rotation.from_quat(steady).as_matrix()
    return matrices


def quaternions_from(form: str, numbers: Array) -> Array:
    """Quaternions, shape (n, 4), of orientations in another form; NaN in rows with NaN.

    Args:
        form: `rotvec`, rotation vectors [rad]; `rpy`, roll, pitch and yaw about fixed axes [rad]; `matrix`, by rows.
        numbers: shape (n, 3) or (n, 9).

    Raises:
        InputError: nine numbers are no rotation.
    """
    from scipy.spatial.transform import Rotation

    finite = np.isfinite(numbers).all(axis=1)
    quaternions = np.full((len(numbers), 4), np.nan)
    if form == "rotvec":
        rotations = Rotation.from_rotvec(numbers[finite])
    elif form == "rpy":
        rotations = Rotation.from_euler("xyz", numbers[finite])
    else:
        matrices = numbers[finite].reshape(-1, 3, 3)
        _check_matrices(matrices)
        rotations = Rotation.from_matrix(matrices)
    quaternions[finite] = rotations.as_quat()
    return quaternions


def _check_matrices(matrices: Array) -> None:
    errors = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    determinants = np.linalg.det(matrices) if len(matrices) else np.ones(0)
    wrong = np.flatnonzero((errors > _MAX_MATRIX_ERROR) | (determinants < 0))
    if not len(wrong):
        return
    row = int(wrong[0])
    why = "it is a reflection, with determinant -1"
    if errors[row] > _MAX_MATRIX_ERROR:
        why = f"its rows are not orthonormal: they are off by {errors[row]:.2g}"
    raise InputError(
        f"row {row + 1} of the pose's matrix is no rotation: {why}; are the columns in the order of --rotation?"
    )
