"""Any serial arm for use outside a control loop: arrays in, arrays out."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import BoundKernel, kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array, Counts
from palpate.errors import InputError
from palpate.records import Readable
from palpate.robots.serial.chain import KinematicChain, Room, Tip, chain_model, jacobian_rate, room_for
from palpate.robots.serial.loading import compile_model, mujoco, refusals


@part
class ArmState(NamedTuple):
    """The laws at one state, in arrays."""

    room: Room
    Jdot: Array  # shape (6, n)
    Jdqd: Array  # shape (6,)
    pose: Array  # shape (4, 4)


@law
def describe_arm(chain, q, qd, found):
    """Fills everything that is known of one state."""
    tip = chain_model(chain, q, qd, found.room)
    jacobian_rate(qd, found.room, tip, found.Jdot)
    bias, pose = found.Jdqd, found.pose
    bias[0], bias[1], bias[2] = tip.a.x, tip.a.y, tip.a.z
    bias[3], bias[4], bias[5] = tip.dw.x, tip.dw.y, tip.dw.z
    R = tip.R
    pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3] = R.r1.x, R.r1.y, R.r1.z, tip.p.x
    pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3] = R.r2.x, R.r2.y, R.r2.z, tip.p.y
    pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3] = R.r3.x, R.r3.y, R.r3.z, tip.p.z


@law
def tip_of(found, qd):
    """The tip, from the arrays."""
    pose, bias, J = found.pose, found.Jdqd, found.room.J
    v, w = ZERO3, ZERO3
    for i in range(len(qd)):
        v += qd[i] * Vec3(J[0, i], J[1, i], J[2, i])
        w += qd[i] * Vec3(J[3, i], J[4, i], J[5, i])
    R = Mat3(
        Vec3(pose[0, 0], pose[0, 1], pose[0, 2]),
        Vec3(pose[1, 0], pose[1, 1], pose[1, 2]),
        Vec3(pose[2, 0], pose[2, 1], pose[2, 2]),
    )
    p = Vec3(pose[0, 3], pose[1, 3], pose[2, 3])
    return Tip(p, R, v, w, Vec3(bias[0], bias[1], bias[2]), Vec3(bias[3], bias[4], bias[5]))


def arm_state_for(n: int) -> ArmState:
    """Room for what is found of an arm of n joints."""
    return ArmState(room_for(n), np.zeros((6, n)), np.zeros(6), np.eye(4))


compiled_description = kernel(describe_arm)


@dataclass(frozen=True)
class Scene:
    """A MuJoCo model in which an arm stands.

    Args:
        model: `mujoco.MjModel`.
        site: index of the site that is the tip; -1 where the tip is the body's own frame.
        body: index of the body that carries the tip.
        dofs: of the arm's joints, shape (n,).
        positions: indices of the arm's joints in qpos, shape (n,).
    """

    model: Any
    site: int
    body: int
    dofs: Counts
    positions: Counts

    def tip(self, data: Any) -> tuple[Array, Array]:
        """Place [m] and axes of the tip in the world."""
        if self.site < 0:
            return data.xpos[self.body], data.xmat[self.body].reshape(3, 3)
        return data.site_xpos[self.site], data.site_xmat[self.site].reshape(3, 3)


@dataclass(frozen=True)
class SerialArm(Readable):
    """An arm of n revolute and prismatic joints, one after the other.

    Joint positions q [rad, m], rates qd and accelerations qdd are arrays of shape (n,); torques [N m, N] too. A pose
    is a homogeneous matrix, shape (4, 4); a wrench is force [N] above moment about the tip [N m], shape (6,), what the
    arm exerts on what it touches. All in the base's axes. Gravity acts.

    When to use it: an arm of one's own, planning, analysis, tests. Inside a control loop use the laws of `chain` and
    `task`, of which this class is the array edge.

    Args:
        title: what it is called.
        names: of its joints, n of them.
        chain: its numbers.
        lower: lowest joint positions [rad, m], shape (n,); -inf where there is no limit.
        upper: highest.
        torque: what each motor may give [N m, N], shape (n,); inf where nobody says.
        speed: highest joint rates [rad/s, m/s], shape (n,); inf where nobody says.
        home: joint positions to start from [rad, m], shape (n,).
        notes: what a user should know of the numbers.
        scene: the MuJoCo model that it was read from, if it was.

    Raises:
        InputError: shapes that do not fit together; a mass matrix that is not positive definite.
    """

    title: str
    names: tuple[str, ...]
    chain: KinematicChain
    lower: Array
    upper: Array
    torque: Array
    speed: Array
    home: Array
    notes: tuple[str, ...] = ()
    scene: Scene | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        n = len(self.names)
        if n == 0:
            raise InputError(f"{self.title}: an arm needs at least one joint")
        for name in ("lower", "upper", "torque", "speed", "home"):
            values = np.array(getattr(self, name), dtype=float)
            if values.shape != (n,):
                raise InputError(f"{self.title}: {name} needs {n} numbers, got shape {values.shape}")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        _check_range(self)
        _check_moves(self)

    @classmethod
    def named(cls, name: str) -> "SerialArm":
        """An arm that comes with palpate: ur5e, panda, fr3, iiwa14.

        Raises:
            InputError: no such arm.
        """
        from palpate.robots.serial.from_toml import load_shipped

        return load_shipped(name)

    @classmethod
    def from_toml(cls, path: str | Path) -> "SerialArm":
        """An arm from a file as those that come with palpate.

        Raises:
            InputError: TOML that does not parse, an unknown or missing key, an inertia that is none.
        """
        from palpate.robots.serial.from_toml import read

        return read(Path(path))

    @classmethod
    def from_mujoco(cls, model: Any, site: str | None = None) -> "SerialArm":
        """An arm from MJCF, or from a `mujoco.MjModel`; needs the extra `arms`.

        Args:
            model: the path of a file, or a model.
            site: name of the site (or of the body) that is the tip; may be left out where there is one site only.

        Raises:
            InputError: what MuJoCo refuses, in its words; no such site; a ball or free joint below it.
        """
        from palpate.robots.serial.from_mujoco import from_mujoco

        return from_mujoco(model, site)

    @classmethod
    def from_urdf(cls, path: str | Path, link: str) -> "SerialArm":
        """An arm from URDF, its tip the origin of a link; read by MuJoCo, needs the extra `arms`.

        Meshes are neither needed nor read.

        Raises:
            InputError: what MuJoCo refuses, in its words; no such link.
        """
        from palpate.robots.serial.from_toml import from_urdf

        return from_urdf(Path(path), link)

    @property
    def joints(self) -> int:
        """Number of the joints, n."""
        return len(self.names)

    def forward_kinematics(self, q: ArrayLike) -> Array:
        """Pose of the tip, shape (4, 4)."""
        return self._state_at(q).pose

    def joint_places(self, q: ArrayLike) -> Array:
        """Origin of the base, of each joint's frame, and of the tip [m], shape (n + 2, 3)."""
        c = self.chain
        p = np.zeros(3)
        R = np.eye(3)
        places = [np.zeros(3)]
        for i, value in enumerate(self._check(q, "q")):
            p = p + R @ c.at[i]
            R = R @ c.turn[i]
            if c.slide[i]:
                p = p + value * R[:, 2]
            else:
                cosine = np.cos(value)
                sine = np.sin(value)
                R = R @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
            places.append(p)
        return np.array([*places, p + R @ c.tip])

    def inverse_kinematics(self, pose: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Joint positions of a pose within the joints' limits, shape (n,); of several, one near `near`.

        Args:
            pose: shape (4, 4).
            near: joint positions to start the search from; `home` when left out.

        Raises:
            InputError: no pose, or one out of reach: it says by how much.
        """
        from palpate.robots.serial.inverse import inverse_kinematics

        return inverse_kinematics(self, pose, self.home if near is None else self._check(near, "near"))

    def jacobian(self, q: ArrayLike) -> Array:
        """J, velocity of the tip [m/s] above its turning [rad/s] by joint rates, shape (6, n)."""
        return self._state_at(q).room.J

    def jacobian_dot(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """dJ/dt, shape (6, n)."""
        return self._state_at(q, qd).Jdot

    def jacobian_dot_qd(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """dJ/dt qd: acceleration of the tip at rest of the joints' accelerations, shape (6,)."""
        return self._state_at(q, qd).Jdqd

    def mass_matrix(self, q: ArrayLike) -> Array:
        """M(q) [kg m^2], rotors included, shape (n, n)."""
        return self._state_at(q).room.M

    def bias_torque(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """h(q, qd): centrifugal, Coriolis and gravity torque [N m], shape (n,)."""
        return self._state_at(q, qd).room.h

    def gravity_torque(self, q: ArrayLike) -> Array:
        """Torque that holds the arm at rest [N m], shape (n,)."""
        return self._state_at(q).room.h

    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, tip_wrench: ArrayLike | None = None
    ) -> Array:
        """Joint torques M qdd + h + J^T w [N m], shape (n,)."""
        state = self._state_at(q, qd)
        torque = state.room.M @ self._check(qdd, "qdd") + state.room.h
        return torque if tip_wrench is None else torque + state.room.J.T @ _wrench(tip_wrench)

    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, torque: ArrayLike, tip_wrench: ArrayLike | None = None
    ) -> Array:
        """Joint accelerations, the qdd of torque = M qdd + h + J^T w, shape (n,)."""
        state = self._state_at(q, qd)
        push = self._check(torque, "torque") - state.room.h
        if tip_wrench is not None:
            push = push - state.room.J.T @ _wrench(tip_wrench)
        return np.asarray(np.linalg.solve(state.room.M, push))

    def singular_values(self, q: ArrayLike) -> Array:
        """Singular values of J, largest first, shape (min(6, n),): the last is 0 in a singular pose."""
        return np.asarray(np.linalg.svd(self.jacobian(q), compute_uv=False))

    def _check(self, values: ArrayLike, name: str) -> Array:
        array = np.array(values, dtype=np.float64)
        if array.shape != (self.joints,) or not np.isfinite(array).all():
            raise InputError(
                f"{name} of {self.title} must be {self.joints} finite numbers, got shape {array.shape}"
                if array.shape != (self.joints,)
                else f"{name} of {self.title} must be finite, got {array.tolist()}"
            )
        return array

    @cached_property
    def _describe(self) -> BoundKernel:
        """The compiled description, bound to the types of this arm's chain."""
        return BoundKernel(compiled_description)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_describe"}

    def _state_at(self, q: ArrayLike, qd: ArrayLike | None = None) -> ArmState:
        rates = np.zeros(self.joints) if qd is None else self._check(qd, "qd")
        state = arm_state_for(self.joints)
        self._describe(self.chain, self._check(q, "q"), rates, state)
        return state


def _wrench(w: ArrayLike) -> Array:
    array = np.asarray(w, dtype=float)
    if array.shape != (6,):
        raise InputError(f"tip_wrench must have shape (6,), force above moment, got {array.shape}")
    return array


def _check_range(arm: SerialArm) -> None:
    """Refuse numbers that no arm has and that its laws, which multiply five of them, overflow by."""
    chain = arm.chain
    for what, unit, limit, values in (
        ("joint frame, centre of mass or tip", "m", 1e3, (chain.at, chain.com, chain.tip)),
        ("mass", "kg", 1e6, (chain.mass,)),
        ("moment of inertia", "kg m^2", 1e9, (chain.least, chain.spread**2)),
        ("rotor inertia", "kg m^2", 1e9, (chain.rotor,)),
        ("gravity", "m/s^2", 1e3, (chain.gravity,)),
        ("home position", "rad or m", 1e3, (arm.home,)),
    ):
        largest = float(np.max(np.abs(np.concatenate([array.ravel() for array in values]))))
        if not largest <= limit:
            raise InputError(f"{arm.title}: a {what} must be within {limit:g} {unit}, got {largest:g}")


def _check_moves(arm: SerialArm) -> None:
    """A mass matrix that is not positive definite belongs to no arm: its joints would move without being pushed."""
    room = room_for(arm.joints)
    # The laws run without compilation here: an arm that is refused has compiled nothing.
    chain_model(arm.chain, arm.home, 0.0 * arm.home, room)
    min_eigenvalue = np.linalg.eigvalsh(room.M)[0]
    if not min_eigenvalue > 0.0:
        raise InputError(
            f"{arm.title}: the mass matrix at home is not positive definite (smallest eigenvalue "
            f"{min_eigenvalue:.3g}); a joint moves nothing: "
            "give its link a mass and an inertia, or the joint a rotor inertia"
        )


def scene_of(arm: SerialArm) -> Scene:
    """The model in which the arm stands; needs the extra `arms`.

    Raises:
        InputError: MuJoCo is not installed, or refuses the arm's numbers.
    """
    return arm.scene or _make_scene(arm)


def _make_scene(arm: SerialArm) -> Scene:
    with refusals(arm.title):
        model, _ = compile_model(mujoco().MjSpec.from_string(mjcf(arm)))
    n = np.arange(arm.joints)
    return Scene(model, 0, int(model.site_bodyid[0]), n, n)


def mjcf(arm: SerialArm) -> str:
    """The arm as MJCF: no shapes, no motors, a site `tip`."""
    root = ElementTree.Element("mujoco", model=arm.title)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
    ElementTree.SubElement(root, "option", gravity=_text(arm.chain.gravity))
    body = ElementTree.SubElement(root, "worldbody")
    for i, name in enumerate(arm.names):
        body = _link(arm, i, name, body)
    ElementTree.SubElement(
        body, "site", name="tip", pos=_text(arm.chain.tip), quat=_text(_quaternion(arm.chain.tip_turn))
    )
    return ElementTree.tostring(root, encoding="unicode")


def _link(arm: SerialArm, i: int, name: str, parent: ElementTree.Element) -> ElementTree.Element:
    c = arm.chain
    body = ElementTree.SubElement(
        parent, "body", name=f"link{i + 1}", pos=_text(c.at[i]), quat=_text(_quaternion(c.turn[i]))
    )
    kind = "slide" if c.slide[i] else "hinge"
    ElementTree.SubElement(
        body, "joint", name=name, type=kind, axis="0 0 1", armature=repr(float(c.rotor[i]))
    )
    moment = c.inertia[i]
    ElementTree.SubElement(
        body,
        "inertial",
        pos=_text(c.com[i]),
        mass=repr(float(c.mass[i])),
        fullinertia=_text(moment[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
    )
    return body


def _quaternion(turn: Array) -> Array:
    quat = np.zeros(4)
    mujoco().mju_mat2Quat(quat, np.ascontiguousarray(turn).ravel())
    return quat


def _text(numbers: Any) -> str:
    return " ".join(repr(float(v)) for v in numbers)
