"""The thesis' arm for use outside the control loop: arrays in, arrays out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate._vector import Mat3, Vec3
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.records import Readable
from palpate.robots.arm3 import Arm3

_THESIS = Arm3()

_REACH_TOLERANCE = 1e-9
"""Distance beyond reach that counts as rounding of a stretched arm [m]."""

_SINGULAR = 1e-6
"""Sine of joint 2 below which the inverse Jacobian is refused: about the inverse of its condition."""


@dataclass(frozen=True)
class Planar3R(Readable):
    """A planar arm with three revolute joints, in a level plane.

    Joint angles q [rad], rates qd [rad/s] and accelerations qdd [rad/s^2] are arrays of shape (..., 3); so
    are poses (x [m], y [m], phi [rad]), torques [N m] and wrenches (F_x [N], F_y [N], N_z [N m]). Leading
    axes are batches and broadcast against each other.

    When to use it: planning, analysis, tests, an arm of one's own. Inside a control loop use the laws of
    `arm`, of which this class is the array edge.

    Args:
        arm: the numbers of the arm; the default is the one of the thesis' appendices B and D.

    Raises:
        InputError: a length, mass, moment of inertia or limit that is not positive; from every method, an
            array whose last axis is not 3.
    """

    arm: Arm3 = _THESIS

    def __post_init__(self) -> None:
        numbers = Arm3(*(Vec3(*(float(v) for v in field)) for field in self.arm))
        for name in ("length", "mass", "moment", "limits"):
            values = getattr(numbers, name)
            if not all(0.0 < v < np.inf for v in values):
                raise InputError(f"{name} of an arm must be positive and finite, got {tuple(values)}")
        object.__setattr__(self, "arm", numbers)

    @property
    def torque_limits(self) -> Array:
        """Limit of each motor [N m], shape (3,)."""
        return _freeze(self.arm.limits)

    @property
    def rotor_inertia(self) -> Array:
        """Inertias of the motors' rotors [kg m^2], shape (3,); not in `mass_matrix`, see `with_rotors`."""
        return _freeze(self.arm.rotor)

    def with_rotors(self) -> "Planar3R":
        """The arm whose links carry the rotors of their direct-drive motors."""
        return Planar3R(self.arm.with_rotors())

    def forward_kinematics(self, q: ArrayLike) -> Array:
        """Pose of the tip, shape (..., 3); phi is the sum of the joint angles, turns included."""
        return _join(self.arm.pose(_split(q, "q")))

    def inverse_kinematics(self, pose: ArrayLike, elbow: ArrayLike = +1) -> Array:
        """Joint angles of a pose, shape (..., 3).

        q1 and q2 lie in [-pi, pi]; q3 is phi - q1 - q2, so that the pose comes back with all turns of phi.

        Args:
            pose: shape (..., 3).
            elbow: +1 bends joint 2 to the positive side, -1 to the negative; a number or an array.

        Raises:
            InputError: a pose out of reach (it says by how much), or an elbow that is neither +1 nor -1.
        """
        p = _split(pose, "pose")
        side = np.asarray(elbow, dtype=float)
        if not np.all(np.abs(side) == 1.0):
            raise InputError(f"elbow must be +1 or -1, got {elbow!r}")
        self._check_reach(p)
        return _join(self.arm.inverse(p, side if side.ndim else float(side)))

    def jacobian(self, q: ArrayLike) -> Array:
        """d pose / d q, shape (..., 3, 3)."""
        return _join(self.arm.jac(_split(q, "q")))

    def jacobian_inverse(self, q: ArrayLike) -> Array:
        """Inverse of the Jacobian in closed form, shape (..., 3, 3).

        Raises:
            InputError: joint 2 is straight or folded (it names the determinant).
        """
        angles = _split(q, "q")
        det = np.asarray(np.abs(self.arm.jac_det(angles)))
        min_det = _SINGULAR * self.arm.length.x * self.arm.length.y
        if not np.all(det > min_det):
            worst = np.unravel_index(np.argmin(np.where(np.isnan(det), 0.0, det)), det.shape)
            raise InputError(
                f"the Jacobian is singular at q{_at(worst)}: |det J| = {det[worst]:.3g} m^2, "
                f"at least {min_det:.3g} is needed; bend joint 2 away from 0 and pi"
            )
        return _join(self.arm.jac_inverse(angles))

    def jacobian_dot(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """Time derivative of the Jacobian, shape (..., 3, 3)."""
        return _join(self.arm.jac_dot(*_together(q=q, qd=qd)))

    def mass_matrix(self, q: ArrayLike) -> Array:
        """M(q) [kg m^2], shape (..., 3, 3), without the rotors."""
        return _join(self.arm.inertia(_split(q, "q")))

    def bias_torque(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """Centrifugal and Coriolis torque h(q, qd) [N m], shape (..., 3)."""
        return _join(self.arm.bias(*_together(q=q, qd=qd)))

    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, tip_wrench: ArrayLike = 0.0
    ) -> Array:
        """Joint torques [N m], shape (..., 3), by recursive Newton-Euler: tau = M qdd + h + J^T w.

        Args:
            q: joint angles.
            qd: joint rates.
            qdd: joint accelerations.
            tip_wrench: w, what the arm exerts on what it touches, in base axes at the tip; 0 for none.
        """
        return _join(self.arm.newton_euler(*_together(q=q, qd=qd, qdd=qdd, tip_wrench=_wrench(tip_wrench))))

    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, torque: ArrayLike, tip_wrench: ArrayLike = 0.0
    ) -> Array:
        """Joint accelerations [rad/s^2], shape (..., 3): the qdd of tau = M qdd + h + J^T w."""
        return _join(
            self.arm.accelerations(*_together(q=q, qd=qd, torque=torque, tip_wrench=_wrench(tip_wrench)))
        )

    def kinetic_energy(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """1/2 qd^T M qd [J], shape (...)."""
        return np.asarray(self.arm.kinetic_energy(*_together(q=q, qd=qd)))

    def _check_reach(self, pose: Vec3) -> None:
        beyond = np.asarray(self.arm.beyond_reach(pose))
        if np.all(beyond <= _REACH_TOLERANCE):
            return
        worst = np.unravel_index(np.argmax(np.where(np.isnan(beyond), np.inf, beyond)), beyond.shape)
        x, y, phi = (float(np.asarray(v)[worst]) for v in pose)
        a1, a2, _ = self.arm.length
        raise InputError(
            f"pose x = {x:.6g} m, y = {y:.6g} m, phi = {phi:.6g} rad{_at(worst)} "
            f"is out of reach by {1e3 * float(beyond[worst]):.3g} mm: joint 3 can be "
            f"{1e3 * abs(a1 - a2):.1f} to {1e3 * (a1 + a2):.1f} mm from the base"
        )


def _split(a: ArrayLike, name: str) -> Vec3:
    """An array of shape (..., 3) as the vector of its three components."""
    array = np.asarray(a, dtype=float)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InputError(f"{name} must have shape (..., 3), got {array.shape}")
    return Vec3(*np.moveaxis(array, -1, 0)) if array.ndim > 1 else Vec3(*array.tolist())


def _together(**arrays: ArrayLike) -> list[Vec3]:
    """Several arrays, their leading axes broadcast against each other."""
    shapes = {name: np.shape(a) for name, a in arrays.items()}
    for name, shape in shapes.items():
        if not shape or shape[-1] != 3:
            raise InputError(f"{name} must have shape (..., 3), got {shape}")
    try:
        common = np.broadcast_shapes(*shapes.values())
    except ValueError:
        raise InputError(f"shapes do not broadcast: {shapes}") from None
    return [_split(np.broadcast_to(np.asarray(a, dtype=float), common), name) for name, a in arrays.items()]


def _wrench(w: ArrayLike) -> Array:
    """A wrench; the number 0 stands for none."""
    array = np.asarray(w, dtype=float)
    if array.ndim:
        return array
    if array != 0.0:
        raise InputError(f"tip_wrench must be 0 or have shape (..., 3) (F_x, F_y, N_z), got {float(array)}")
    return np.zeros(3)


def _join(value: Vec3 | Mat3) -> Array:
    """A vector of arrays (...) as one array (..., 3), a matrix of them as (..., 3, 3)."""
    if isinstance(value, Mat3):
        shape = np.broadcast_shapes(*(np.shape(v) for row in value for v in row))
        return np.stack([np.broadcast_to(_join(row), (*shape, 3)) for row in value], axis=-2)
    return np.stack(np.broadcast_arrays(*value), axis=-1).astype(float, copy=False)


def _freeze(v: Vec3) -> Array:
    array = np.array(v)
    array.setflags(write=False)
    return array


def _at(index: tuple[Any, ...]) -> str:
    """Words for the index within a batch; empty for a single input."""
    return f" (index {tuple(int(i) for i in index)})" if index else ""
