"""A tool that was weighed, on a simulated arm: its mass on the last link, its weight and inertia on the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.contact_frame.load import Payload
from palpate.contact_frame.tool_payload import side_of
from palpate.press.cell import NO_TOOL, HeldTool
from palpate.robots.serial.chain import spread_of
from palpate.robots.serial.serial_arm import SerialArm


def held_tool(payload: Payload | None) -> HeldTool:
    """A tool as a sensor shows it, with the sign of a press.

    A weight that points down is that of a sensor that shows what the tool exerts on it: the opposite of a press.
    """
    if payload is None:
        return NO_TOOL
    sign = -(side_of(np.array(payload.weight)) or -1.0)
    follows = payload.mass if payload.inertia is None else payload.inertia
    return HeldTool(
        weight=sign * Vec3(*payload.weight),
        bias=sign * Vec3(*payload.bias),
        inertia=float(follows),
        centre=Vec3(*(payload.centre or (0.0, 0.0, 0.0))),
    )


def with_tool(arm: SerialArm, payload: Payload) -> SerialArm:
    """The arm with the tool's mass at its centre, on the last link; its control knows of it, as of any payload.

    How the mass spreads about its centre was not weighed, and is left out. A MuJoCo model that the arm was read from
    does not have the tool, and is left behind.
    """
    chain, last = arm.chain, arm.joints - 1
    mass = max(payload.mass, payload.inertia or 0.0)
    at = chain.tip + chain.tip_turn @ np.array(payload.centre or (0.0, 0.0, 0.0))
    whole = chain.mass[last] + mass
    com = (chain.mass[last] * chain.com[last] + mass * at) / whole
    moment = (
        chain.inertia[last]
        + _point(chain.mass[last], chain.com[last] - com)
        + _point(mass, at - com)
    )  # fmt: skip
    least, spread = spread_of(_change(chain.inertia, last, moment))
    loaded = chain._replace(
        mass=_change(chain.mass, last, whole), com=_change(chain.com, last, com), least=least, spread=spread
    )
    return replace(arm, title=f"{arm.title} with a tool of {mass:.3g} kg", chain=loaded, scene=None)


def _point(mass: float, off: Array) -> Array:
    """Inertia of a point mass about a point that it is off from [kg m^2], shape (3, 3)."""
    return np.asarray(mass * (off @ off * np.eye(3) - np.outer(off, off)))


def _change(values: Array, i: int, value: float | Array) -> Array:
    new = values.copy()
    new[i] = value
    return new
