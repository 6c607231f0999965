"""A serial arm out of a MuJoCo model: the joints from the world to a site, and all that they carry."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array, Counts
from palpate.errors import InputError, unknown
from palpate.robots.serial.chain import KinematicChain, spread_of
from palpate.robots.serial.loading import load_mjcf, mujoco, refusals
from palpate.robots.serial.serial_arm import Scene, SerialArm


def from_mujoco(model: Any, site: str | None = None) -> SerialArm:
    """The arm of a MuJoCo model, see `SerialArm.from_mujoco`."""
    if isinstance(model, str | PathLike):
        path = Path(model)
        loaded, notes = load_mjcf(path)
        return arm_of(loaded, site, str(path), notes)
    if not isinstance(model, mujoco().MjModel):
        raise InputError(f"from_mujoco takes a path or a mujoco.MjModel, got {type(model).__name__}")
    return arm_of(model, site, "the model", [])


def arm_of(model: Any, site: str | None, where: str, notes: Sequence[str]) -> SerialArm:
    """The arm that moves a site.

    Raises:
        InputError: no such site or body, no joint that moves it, a ball or free joint.
    """
    body, tip_p, tip_R = _tip(model, site, where)
    joints = _joints_to(model, body, where)
    data = _at_reference(model, where)
    frames = [_frame(model, data, j) for j in joints]
    links = _links(model, joints, frames, data)
    last_p, last_R = frames[-1]
    chain = _chain(model, joints, frames, links)._replace(
        tip=last_R.T @ (data.xpos[body] + _matrix(data.xmat[body]) @ tip_p - last_p),
        tip_turn=last_R.T @ _matrix(data.xmat[body]) @ tip_R,
    )
    dofs = np.array([model.jnt_dofadr[j] for j in joints])
    positions = np.array([model.jnt_qposadr[j] for j in joints])
    lower, upper = _limits(model, joints)
    return SerialArm(
        title=_title(model, where),
        names=tuple(model.joint(j).name or f"joint{k + 1}" for k, j in enumerate(joints)),
        chain=chain,
        lower=lower,
        upper=upper,
        torque=_torques(model, joints),
        speed=np.full(len(joints), np.inf),
        home=_home(model, positions),
        notes=(*notes, *_left_out(model, joints, dofs)),
        scene=Scene(model, _site_index(model, site), body, dofs, positions),
    )


def _tip(model: Any, site: str | None, where: str) -> tuple[int, Array, Array]:
    """Body that carries the tip, and the tip in it."""
    k = _site_index(model, site, where)
    if k >= 0:
        return int(model.site_bodyid[k]), np.array(model.site_pos[k]), _rotate(model.site_quat[k])
    return int(model.body(site).id), np.zeros(3), np.eye(3)


def _site_index(model: Any, site: str | None, where: str = "") -> int:
    """Index of the named site, or of the only one; -1 where the name is a body's."""
    sites = [model.site(k).name for k in range(model.nsite)]
    bodies = [model.body(k).name for k in range(1, model.nbody)]
    if site is None:
        if len(sites) == 1:
            return 0
        listed = ", ".join(filter(None, sites)) or "none; name a body instead: " + ", ".join(bodies)
        raise InputError(
            f"{where}: which site is the tip? There are {len(sites)}: {listed}; give it with --site"
        )
    if site in sites:
        return sites.index(site)
    if site in bodies:
        return -1
    raise unknown(f"site or body in {where}", site, filter(None, (*sites, *bodies)))


def _joints_to(model: Any, body: int, where: str) -> list[int]:
    """The joints that move a body, from the base on."""
    joints: list[int] = []
    while body > 0:
        first = model.body_jntadr[body]
        joints = [*range(first, first + model.body_jntnum[body]), *joints] if first >= 0 else joints
        body = int(model.body_parentid[body])
    kinds = mujoco().mjtJoint
    for j in joints:
        if model.jnt_type[j] not in (int(kinds.mjJNT_HINGE), int(kinds.mjJNT_SLIDE)):
            raise InputError(
                f"{where}: joint {model.joint(j).name!r} is a ball or a free joint; a serial arm has hinges and slides "
                "from the world to its tip: weld its base to the world"
            )
    if not joints:
        raise InputError(f"{where}: no joint moves the tip; name a site or a body further out")
    return joints


def _at_reference(model: Any, where: str) -> Any:
    """The model where every joint displaces nothing."""
    with refusals(where):
        data = mujoco().MjData(model)
        data.qpos[:] = model.qpos0
        mujoco().mj_kinematics(model, data)
        mujoco().mj_comPos(model, data)
    return data


def _frame(model: Any, data: Any, joint: int) -> tuple[Array, Array]:
    """Origin and axes of a joint's frame in the world, its axis as z."""
    z = np.array(data.xaxis[joint])
    z /= np.linalg.norm(z)
    body_axes = _matrix(data.xmat[model.jnt_bodyid[joint]])
    x = body_axes[:, int(np.argmin(np.abs(body_axes.T @ z)))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.array(data.xanchor[joint]), np.column_stack([x, np.cross(z, x), z])


def _links(
    model: Any, joints: list[int], frames: list[tuple[Array, Array]], data: Any
) -> list[tuple[float, Array, Array]]:
    """Mass, centre and inertia of what each joint carries before the next, in its frame."""
    owners = {
        body: k for k, body in enumerate(int(model.jnt_bodyid[j]) for j in joints)
    }  # the last of a body's
    gathered: list[list[int]] = [[] for _ in joints]
    for body in range(1, model.nbody):
        above = body
        while above > 0 and above not in owners:
            above = int(model.body_parentid[above])
        if above > 0:
            gathered[owners[above]].append(body)
    return [_together(model, data, bodies, *frame) for bodies, frame in zip(gathered, frames, strict=True)]


def _together(model: Any, data: Any, bodies: list[int], p: Array, R: Array) -> tuple[float, Array, Array]:
    """Several bodies that move as one, in a frame."""
    masses = np.array([model.body_mass[b] for b in bodies])
    centres = np.array([R.T @ (data.xipos[b] - p) for b in bodies]).reshape(-1, 3)
    mass = float(masses.sum())
    if mass == 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    centre = masses @ centres / mass
    moment = np.zeros((3, 3))
    for b, m, c in zip(bodies, masses, centres, strict=True):
        turn = R.T @ _matrix(data.ximat[b])
        off = c - centre
        moment += turn @ np.diag(model.body_inertia[b]) @ turn.T
        moment += m * ((off @ off) * np.eye(3) - np.outer(off, off))
    return mass, centre, 0.5 * (moment + moment.T)


def _chain(
    model: Any,
    joints: list[int],
    frames: list[tuple[Array, Array]],
    links: list[tuple[float, Array, Array]],
) -> KinematicChain:
    at, turn = [], []
    p0 = np.zeros(3)
    R0 = np.eye(3)
    for j, (p, R) in zip(joints, frames, strict=True):
        slides = _slides(model, j)
        zero = float(model.qpos0[model.jnt_qposadr[j]])  # the position at which the joint displaces nothing
        at.append(R0.T @ (p - p0) - (zero * (R0.T @ R)[:, 2] if slides else 0.0))
        turn.append(R0.T @ R @ (np.eye(3) if slides else _about_z(-zero)))
        p0, R0 = p, R
    least, spread = spread_of(np.array([moment for _, _, moment in links]))
    return KinematicChain(
        at=np.array(at),
        turn=np.array(turn),
        slide=np.array([float(_slides(model, j)) for j in joints]),
        mass=np.array([mass for mass, _, _ in links]),
        com=np.array([centre for _, centre, _ in links]),
        least=least,
        spread=spread,
        rotor=np.array([float(model.dof_armature[model.jnt_dofadr[j]]) for j in joints]),
        tip=np.zeros(3),
        tip_turn=np.eye(3),
        gravity=np.array(model.opt.gravity, dtype=float),
    )


def _slides(model: Any, joint: int) -> bool:
    return int(model.jnt_type[joint]) == int(mujoco().mjtJoint.mjJNT_SLIDE)


def _limits(model: Any, joints: list[int]) -> tuple[Array, Array]:
    limited = [bool(model.jnt_limited[j]) for j in joints]
    ends = np.array(
        [model.jnt_range[j] if yes else (-np.inf, np.inf) for j, yes in zip(joints, limited, strict=True)]
    )
    return ends[:, 0], ends[:, 1]


def _torques(model: Any, joints: list[int]) -> Array:
    """The joint's own limit, or that of the motor that drives it straight."""
    drives = int(mujoco().mjtTrn.mjTRN_JOINT)
    limits = []
    for j in joints:
        limit = float(model.jnt_actfrcrange[j][1]) if model.jnt_actfrclimited[j] else np.inf
        for a in range(model.nu):
            if (
                model.actuator_trntype[a] == drives
                and model.actuator_trnid[a][0] == j
                and model.actuator_forcelimited[a]
            ):
                limit = min(limit, float(abs(model.actuator_gear[a][0]) * model.actuator_forcerange[a][1]))
        limits.append(limit if limit > 0.0 else np.inf)
    return np.array(limits)


def _home(model: Any, positions: Counts) -> Array:
    """The first keyframe, or where every joint displaces nothing."""
    return np.array(model.key_qpos[0] if model.nkey else model.qpos0, dtype=float)[positions]


def _left_out(model: Any, joints: list[int], dofs: Counts) -> list[str]:
    """Parts of the model that the arm's own laws do not include."""
    notes = []
    unused_joints = [model.joint(j).name or str(j) for j in range(model.njnt) if j not in joints]
    if unused_joints:
        notes.append(
            f"joints beside the way to the tip are held where they displace nothing: {', '.join(unused_joints)}"
        )
    at_work = {
        "damping": model.dof_damping[dofs],
        "friction loss": model.dof_frictionloss[dofs],
        "springs": np.array([model.jnt_stiffness[j] for j in joints]),
        "constraints": np.array([model.neq, model.ntendon]),
        "buoyancy or drag": np.array([model.opt.density, model.opt.viscosity]),
    }
    effects = [name for name, values in at_work.items() if np.any(values)]
    if effects:
        notes.append(f"only MuJoCo's physics has the model's {', '.join(effects)}")
    return notes


def _title(model: Any, where: str) -> str:
    name = bytes(model.names).split(b"\0", 1)[0].decode("utf-8", "replace")
    return name if name and name != "MuJoCo Model" else Path(where).stem


def _matrix(numbers: Any) -> Array:
    return np.array(numbers, dtype=float).reshape(3, 3)


def _rotate(quat: Any) -> Array:
    turn = np.zeros(9)
    mujoco().mju_quat2Mat(turn, np.array(quat, dtype=float))
    return turn.reshape(3, 3)


def _about_z(angle: float) -> Array:
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
