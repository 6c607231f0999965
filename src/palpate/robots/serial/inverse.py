"""Joint positions of a pose, by search: arms of any number of joints have no formula for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.signals.rotations import vector_from_matrix

if TYPE_CHECKING:
    from palpate.robots.serial.serial_arm import SerialArm


_STARTS = 24
"""Points from which the search begins; the first is where the arm is."""
_REACHED = 1e-9
"""Distance [m] and angle [rad] within which a pose is reached: a nanometre is below any encoder."""
_STEPS, _LONGEST = 100, 0.3
"""Maximum steps of one search, and the largest motion of a joint in one step [rad, m]."""
_TURN = 2.0 * np.pi


def inverse_kinematics(arm: SerialArm, pose: ArrayLike, near: Array) -> Array:
    """Joint positions of a pose, see `SerialArm.inverse_kinematics`."""
    goal = checked_pose(pose)
    best = near
    off = np.full(6, np.inf)
    for start in _starts(arm, near):
        q = _search(arm, goal, start)
        error = pose_error(arm.forward_kinematics(q), goal)
        if np.linalg.norm(error) < np.linalg.norm(off):
            best, off = q, error
        if np.abs(off).max() < _REACHED:
            return best
    raise InputError(_out_of_reach(arm, goal, off))


def checked_pose(pose: ArrayLike) -> Array:
    """A homogeneous matrix.

    Raises:
        InputError: it is none.
    """
    goal = np.array(pose, dtype=np.float64)
    if goal.shape != (4, 4) or not np.isfinite(goal).all():
        raise InputError(f"a pose is a homogeneous matrix of shape (4, 4), finite, got shape {goal.shape}")
    R = goal[:3, :3]
    if np.abs(R.T @ R - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0.0:
        raise InputError("the upper left of a pose must be a rotation: orthonormal columns, right-handed")
    return goal


def pose_error(pose: Array, goal: Array) -> Array:
    """Error of a pose: translation to the goal [m] above rotation vector [rad], in the base's axes, shape (6,)."""
    return np.concatenate([goal[:3, 3] - pose[:3, 3], vector_from_matrix(goal[:3, :3] @ pose[:3, :3].T)])


def _starts(arm: SerialArm, near: Array) -> list[Array]:
    """Starts of the search: the present position, and random points of the range."""
    generator = np.random.default_rng(0)
    lower, upper = _box(arm)
    inside = np.clip(near, lower, upper)
    return [inside, *(generator.uniform(lower, upper) for _ in range(_STARTS - 1))]


def _box(arm: SerialArm) -> tuple[Array, Array]:
    """The range of each joint; a turn either way, or a metre, where it has no limit."""
    free = np.where(arm.chain.slide > 0.0, 1.0, 0.5 * _TURN)
    return np.where(np.isfinite(arm.lower), arm.lower, -free), np.where(
        np.isfinite(arm.upper), arm.upper, free
    )


def _search(arm: SerialArm, goal: Array, q: Array) -> Array:
    """Damped least squares (Wampler, 1986) in short steps within the joints' limits, so that it stays near.

    The damping falls with the error, so that it converges as Newton's method does where the pose can be reached.
    """
    for _ in range(_STEPS):
        error = pose_error(arm.forward_kinematics(q), goal)
        if np.abs(error).max() < 1e-3 * _REACHED:
            break
        J = arm.jacobian(q)
        damping = 1e-3 * min(float(error @ error), 1.0)
        step = _step(J, error, damping)
        blocked = ((q <= arm.lower) & (step < 0.0)) | ((q >= arm.upper) & (step > 0.0))
        if blocked.any():
            step = _step(np.where(blocked, 0.0, J), error, damping)
        q = np.clip(q + step / max(1.0, float(np.abs(step).max()) / _LONGEST), arm.lower, arm.upper)
    return q


def _step(J: Array, error: Array, damping: float) -> Array:
    return np.asarray(J.T @ np.linalg.lstsq(J @ J.T + damping * np.eye(6), error, rcond=None)[0])


def _out_of_reach(arm: SerialArm, goal: Array, off: Array) -> str:
    point = ", ".join(f"{v:.4g}" for v in goal[:3, 3])
    return (
        f"the pose at ({point}) m is out of reach of {arm.title} by {1e3 * np.linalg.norm(off[:3]):.0f} mm and "
        f"{np.degrees(np.linalg.norm(off[3:])):.3g} deg at the nearest found within the joints' limits"
    )
