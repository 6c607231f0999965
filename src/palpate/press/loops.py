"""The inner loop of an arm as its force loop sees it: what comes with palpate, or made for the arm and its pose."""

from __future__ import annotations

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, TorqueLoop, load_arm, names
from palpate.force.gains import Gains, approach_speed, free_motion_level
from palpate.force.lag import lag_of

MODES = ("torque", "position")
_TYPICAL = {"torque": "fr3", "position": "ur5e"}
"""Whose inner loop and sensor stand for those of an arm of which nobody has said any."""
_DAMPED = 0.7
"""Damping ratio of the tip on its spring in the air."""


def usual_mode(name: str) -> str:
    """How an arm is driven: torques, unless its own file says positions."""
    return load_arm(name).kind if name in names() else "torque"


def loop_of(name: str, title: str, mode: str, mass: float) -> Arm:
    """The arm for `palpate.force`.

    Args:
        name: of the arm; another than those that come with palpate gets the typical loop.
        title: of the arm.
        mode: torque or position.
        mass: of the tip along the normal, 1/(n^T J M^-1 J^T n) at the pose of the press [kg].
    """
    known = load_arm(name) if name in names() else None
    typical = load_arm(_TYPICAL[mode])
    arm = known if known is not None and known.kind == mode else typical
    inner = arm.inner
    if isinstance(inner, TorqueLoop):
        damping = 2.0 * _DAMPED * float(np.sqrt(inner.stiffness * mass))
        inner = msgspec.structs.replace(inner, mass=mass, damping=damping)
    else:
        inner = msgspec.structs.replace(inner, mass=mass)
    sensor = known.sensor if known is not None else arm.sensor
    return msgspec.structs.replace(arm, title=f"{title}, {mode}s", inner=inner, sensor=sensor)


def gains_for(arm: Arm, force: float) -> Gains:
    """Gains of the cautious law for a force, on any surface up to the arm's limit; no proof is made here.

    Raises:
        InputError: a force that the sensor's noise hides, or that it cannot read.
    """
    theta = lag_of(arm)
    cap = arm.limits.stiffness
    return Gains(
        arm=arm, force=force, theta=theta, cap=cap, force_limit=arm.sensor.full_scale,
        approach=approach_speed(arm, force, theta, cap), level=free_motion_level(arm, force),
    )  # fmt: skip


def check_mode(gains: Gains, mode: str | None) -> str:
    """The mode that gains are for.

    Raises:
        InputError: another was asked for.
    """
    if mode is not None and gains.arm.kind != mode:
        raise InputError(
            f"these gains are for a {gains.arm.kind} arm, and --mode says {mode}; "
            "leave --mode out, or tune for the other"
        )
    return gains.arm.kind


def mass_note(gains: Gains, mass: float | None = None) -> str | None:
    """Remedy where gains assume a position arm's tip without mass; None where nothing is missing.

    Args:
        gains: of the loop.
        mass: of the tip, where it is known [kg].
    """
    inner = gains.arm.inner
    if not isinstance(inner, PositionLoop) or inner.mass is not None:
        return None
    known = "the tip's along the normal, 1/(n^T J M^-1 J^T n)" if mass is None else f"{mass:.2g} kg here"
    return (
        f"the gains leave out the mass of the arm's tip: a heavy tip swings on the arm's {inner.stiffness:g} N/m,"
        f" and after a touch the force may go over; add mass = M, {known}, under [inner] of the arm's file, and tune"
        " again"
    )


def series_of(arm: Arm) -> float | None:
    """Stiffness between the encoders and the surface [N/m]; None where the encoders sit on the links."""
    return arm.inner.stiffness if isinstance(arm.inner, PositionLoop) else None
