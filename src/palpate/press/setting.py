"""Setting of a press, checked: an arm at a pose before a surface, with the tool that it carries."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from palpate._vector import Mat3, Vec3
from palpate.arrays import Array
from palpate.contact_frame.payload import Payload
from palpate.contact_frame.tool_payload import weight_sign
from palpate.environments.models import KelvinVoigt, Layered, stiffest
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, ServoLoop, TorqueLoop
from palpate.force.gains import padded_vector
from palpate.force.lag import STRUCTURE
from palpate.force.sampled_loop import filter_of, zero_order_hold
from palpate.press.cell import NO_TOOL, HeldTool, Workcell, WristSensor
from palpate.robots.serial.chain import spread_of
from palpate.robots.serial.inverse import checked_pose
from palpate.robots.serial.serial_arm import SerialArm
from palpate.signals.types import triple

GAP = 0.003
"""Between tip and surface at the start [m]."""
_STEP = 5e-4
"""Longest step of the physics [s]."""
_RESOLVED = 0.5
"""Largest frequency of a spring times the step [rad]: a quarter of where semi-implicit Euler diverges."""


@dataclass(frozen=True)
class Place:
    """Pose and surface of a press.

    Args:
        q: joint positions at the start, the tip before the surface, shape (n,).
        normal: into the surface, in the base's axes, shape (3,).
        axes: of the task in rows, the normal first, shape (3, 3).
        pose: of the tip at the start, shape (4, 4).
        place: of the surface along the normal [m].
        mass: of the tip along the normal [kg].
        weakest: smallest singular value of the Jacobian.
    """

    q: Array
    normal: Array
    axes: Array
    pose: Array
    place: float
    mass: float
    weakest: float

    @property
    def point(self) -> Array:
        """Point of the surface in front of the tip, in the base's axes (3,) [m]."""
        tip: Array = self.pose[:3, 3]
        return tip + (self.place - tip @ self.normal) * self.normal


def place_of(arm: SerialArm, at: ArrayLike | None, normal: ArrayLike | None, gap: float = GAP) -> Place:
    """Pose at which the arm starts, and the surface before it.

    Args:
        arm: what moves, six joints and more.
        at: point of the surface to touch [m]; the point before the tip at home when left out.
        normal: into the surface; the tip's own z at home when left out.
        gap: between tip and surface [m].

    Raises:
        InputError: too few joints; a pose out of reach; a normal of length 0.
    """
    if arm.joints < 6:
        raise InputError(
            f"{arm.title} has {arm.joints} joints; to hold its tip in all directions an arm needs 6 or more"
        )
    home = arm.forward_kinematics(arm.home)
    n = home[:3, 2] if normal is None else _unit(normal)
    if at is None and normal is None:
        q = np.array(arm.home)
    else:
        point = home[:3, 3] + gap * n if at is None else np.asarray(at, dtype=float)
        q = arm.inverse_kinematics(_facing(home, n, point - gap * n), near=arm.home)
    pose = arm.forward_kinematics(q)
    J, M = arm.jacobian(q), arm.mass_matrix(q)
    along = n @ J[:3]
    mass = 1.0 / float(along @ np.linalg.solve(M, along)) if np.linalg.norm(along) > 0.0 else np.inf
    return Place(
        q=q,
        normal=n,
        axes=_axes(n),
        pose=pose,
        place=float(n @ pose[:3, 3]) + gap,
        mass=mass,
        weakest=float(arm.singular_values(q)[-1]),
    )


def check_able(arm: SerialArm, place: Place, speed: float, force: float) -> list[str]:
    """Notes on a pose near a singular one.

    Args:
        arm: what moves.
        place: where.
        speed: of the approach [m/s].
        force: largest desired force [N].

    Raises:
        InputError: a pose so near a singular one that a joint would exceed its speed, or in which force and weight
            exceed a motor's torque.
    """
    J = arm.jacobian(place.q)
    _, s, V = np.linalg.svd(J)
    known = np.isfinite(arm.speed)
    max_speed = float(arm.speed[known].min()) if known.any() else 1.0
    min_singular_value = speed / max_speed
    joint = arm.names[int(np.argmax(np.abs(V[len(s) - 1])))]
    if s[-1] <= min_singular_value:
        raise InputError(
            f"the pose is {'singular' if s[-1] < 1e-9 else 'nearly singular'}: the smallest singular value of the "
            f"Jacobian is {s[-1]:.3g}, and at {1e3 * speed:.3g} mm/s at least {min_singular_value:.3g} is needed for "
            f"joints of {max_speed:.3g} rad/s; move {joint} away from where it is, or choose another --at or --normal"
        )
    _check_torques(arm, place, J, force)
    quick = 0.25 / max_speed
    if s[-1] > quick:
        return []
    note = (
        f"the pose is not far from a singular one: the smallest singular value of the Jacobian is {s[-1]:.3g}, of "
        f"which {joint} has the largest share"
    )
    return [note]


def _check_torques(arm: SerialArm, place: Place, J: Array, force: float) -> None:
    needed = np.abs(arm.gravity_torque(place.q) + J[:3].T @ (force * place.normal))
    worst = int(np.argmax(needed / arm.torque))
    if needed[worst] > arm.torque[worst]:
        raise InputError(
            f"{arm.title}: pressing with {force:g} N in this pose takes {needed[worst]:.3g} N m of {arm.names[worst]}, "
            f"which gives {arm.torque[worst]:.3g}; press with less, or choose another --at"
        )


def cell_of(
    arm: SerialArm, place: Place, surface: KelvinVoigt | Layered, loop: Arm, tool: HeldTool = NO_TOOL
) -> Workcell:
    """The simulated cell of an arm with its inner loop, before a surface, with the tool as its sensor shows it."""
    motors, servo = isinstance(loop.inner, PositionLoop), isinstance(loop.inner, ServoLoop)
    chain = arm.chain._replace(rotor=0.0 * arm.chain.rotor) if motors else arm.chain
    J, M = arm.jacobian(place.q), arm.mass_matrix(place.q)
    links = M - np.diag(arm.chain.rotor) if motors else M
    spring, damper = np.zeros(arm.joints), np.zeros(arm.joints)
    first = second = 0.0
    along = place.normal @ J[:3]
    fastest = np.sqrt(stiffest(surface) * float(along @ np.linalg.solve(links, along)))
    if not isinstance(loop.inner, TorqueLoop):
        spring = _joint_springs(arm, links, along, loop.inner.stiffness)
        fastest = max(fastest, np.sqrt(_fastest(links, spring)))
    if isinstance(loop.inner, PositionLoop):
        damper = 2.0 * STRUCTURE * np.sqrt(spring * np.diag(links))
        first, second = loop.inner.squared
    elif isinstance(loop.inner, ServoLoop):
        damper = loop.inner.lag * spring
        fastest = max(fastest, _fastest(links, damper))
    steps = int(np.ceil(loop.tick / min(_STEP, _RESOLVED / fastest) - 1e-9))
    return Workcell(
        chain=chain,
        normal=triple(place.normal),
        place=place.place,
        surface=surface,
        sensor=_sensor(loop, loop.tick / steps),
        tool=tool,
        step=loop.tick / steps,
        steps=steps,
        elastic=float(motors or servo),
        yields=float(servo),
        spring=spring,
        damper=damper,
        first=float(first),
        second=float(second),
    )


def _joint_springs(arm: SerialArm, links: Array, along: Array, stiffness: float) -> Array:
    """Joint stiffnesses proportional to the torque limits, with which the tip has this stiffness along the normal."""
    strength = arm.torque if np.isfinite(arm.torque).all() else np.diag(links)
    return np.asarray(strength * stiffness * float(along @ (along / strength)))


def _fastest(links: Array, joints: Array) -> float:
    """Largest eigenvalue of the joints' springs or dampers over the masses."""
    return float(np.linalg.eigvals(np.linalg.solve(links, np.diag(joints))).real.max())


def _sensor(loop: Arm, step: float) -> WristSensor:
    A, b, c = filter_of(loop.low_pass)
    E, e = zero_order_hold(A, b, step)
    wide = np.zeros((3, 3))
    wide[: len(b), : len(b)] = E
    return WristSensor(
        E=Mat3(*map(triple, wide)),
        e=padded_vector(e),
        c=padded_vector(c),
        d=0.0 if len(b) else 1.0,
        step=float(step),
        sampling=float(loop.sensor.sampling),
        noise=float(loop.sensor.noise),
        full_scale=float(loop.sensor.full_scale),
    )


def _facing(home: Array, normal: Array, point: Array) -> Array:
    """Pose whose z points along the normal and whose x is nearest to that at home."""
    z, x = normal, home[:3, 0]
    x = x - (x @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = home[:3, 1] - (home[:3, 1] @ z) * z
    x = x / np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), point
    return checked_pose(pose)


def _axes(normal: Array) -> Array:
    """The normal, and two directions along the surface."""
    unit_vector = np.eye(3)[int(np.argmin(np.abs(normal)))]
    y = unit_vector - (unit_vector @ normal) * normal
    y /= np.linalg.norm(y)
    return np.array([normal, y, np.cross(normal, y)])


def _unit(direction: ArrayLike) -> Array:
    v = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(v))
    if not (np.isfinite(length) and length > 0.0):
        raise InputError(f"a normal needs a length, got {v.tolist()}")
    return v / length


def held_tool(payload: Payload | None) -> HeldTool:
    """A tool as a sensor shows it, with the sign of a press.

    A weight that points down belongs to a sensor that shows the force of the tool on the sensor, opposite to a press.
    """
    if payload is None:
        return NO_TOOL
    sign = -(weight_sign(np.array(payload.weight)) or -1.0)
    follows = payload.mass if payload.inertia is None else payload.inertia
    return HeldTool(
        weight=sign * Vec3(*payload.weight),
        bias=sign * Vec3(*payload.bias),
        inertia=float(follows),
        centre=Vec3(*(payload.centre or (0.0, 0.0, 0.0))),
    )


def with_tool(arm: SerialArm, payload: Payload) -> SerialArm:
    """The arm with the tool's mass at its centre, on the last link; its control includes it, as any payload.

    The tool's inertia about its centre was not weighed and is left out. A MuJoCo model from which the arm was read does
    not have the tool and is dropped.
    """
    chain, last = arm.chain, arm.joints - 1
    mass = max(payload.mass, payload.inertia or 0.0)
    at = chain.tip + chain.tip_turn @ np.array(payload.centre or (0.0, 0.0, 0.0))
    total_mass = chain.mass[last] + mass
    com = (chain.mass[last] * chain.com[last] + mass * at) / total_mass
    moment = chain.inertia[last] + _point(chain.mass[last], chain.com[last] - com) + _point(mass, at - com)
    smallest, spread = spread_of(_change(chain.inertia, last, moment))
    loaded = chain._replace(
        mass=_change(chain.mass, last, total_mass),
        com=_change(chain.com, last, com),
        least=smallest,
        spread=spread,
    )
    return replace(arm, title=f"{arm.title} with a tool of {mass:.3g} kg", chain=loaded, scene=None)


def _point(mass: float, off: Array) -> Array:
    """Inertia of a point mass at an offset from the reference point [kg m^2], shape (3, 3)."""
    return np.asarray(mass * (off @ off * np.eye(3) - np.outer(off, off)))


def _change(values: Array, i: int, value: float | Array) -> Array:
    new = values.copy()
    new[i] = value
    return new
