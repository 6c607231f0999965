"""Logs of an arm that presses on something known, as wrench and pose, whatever its axes, signs and loads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from identification.synthetic_contacts import pressed
from palpate.records import Record

Array = NDArray[np.float64]


@dataclass
class World:
    """An arm, its tool and a surface.

    Args:
        normal: into the surface, in the base.
        slip: what the tool moves along the surface for each unit into it, across the normal.
        turn: of the tool in contact.
        turns: whether the tool turns before it touches, so that its weight can be told from the bias.
        tcp: the point that touches, in the tool's axes [m].
        frame, sensor: axes of the wrench, and how the sensor is turned against the tool.
        sign: +1 for what the tool exerts, -1 for the reaction.
        weight: that the sensor shows, in the base [N].
        bias: of the sensor, in its axes [N].
        noise: of each axis of the force [N].
    """

    normal: Array
    slip: Array
    turn: Rotation
    turns: bool
    tcp: Array
    frame: str = "sensor"
    sensor: Rotation = field(default_factory=Rotation.identity)
    sign: float = 1.0
    weight: Array = field(default_factory=lambda: np.zeros(3))
    bias: Array = field(default_factory=lambda: np.zeros(3))
    noise: float = 0.05


def any_world(rng: np.random.Generator, **said: Any) -> World:
    """One drawn at random; what is given, stays."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    slip = np.cross(normal, rng.normal(size=3)) * rng.uniform(0, 0.5)
    own = {
        "normal": normal,
        "slip": slip,
        "turn": Rotation.random(rng=rng),
        "turns": True,
        "tcp": rng.uniform(-0.2, 0.2, 3),
        "frame": str(rng.choice(["base", "tool", "sensor"])),
        "sign": float(rng.choice([-1.0, 1.0])),
        "weight": np.array([0.0, 0.0, rng.uniform(2, 20)]),
        "bias": rng.uniform(-10, 10, 3),
    } | said
    if own["frame"] == "sensor":
        own.setdefault("sensor", Rotation.random(rng=rng))
    return World(**own)


def log_of(world: World, rng: np.random.Generator, n: int = 4000, **press: Any) -> Record:
    """Wrench and pose of a press in that world; the surface's own numbers are those of `pressed`."""
    flat = pressed(n=n - 1000 if world.turns else n, noise=0.0, **press)
    depth, force = flat["position"], flat["force"]
    if world.turns:  # a second of turning in free motion comes first
        depth = np.r_[np.full(1000, depth[0]), depth]
        force = np.r_[np.zeros(1000), force]
    time = np.arange(len(depth)) / 1000
    turn = _turning(world, time)
    place = np.outer(depth, world.normal + world.slip) + 0.3
    pose = place - turn.apply(world.tcp)
    exerted = np.outer(force, world.normal)
    shown = turn.inv().apply(world.sign * exerted + world.weight)
    shown = world.sensor.inv().apply(shown) + world.bias + rng.normal(0, world.noise, (len(time), 3))
    if world.frame == "base":
        shown = turn.apply(world.sensor.apply(shown))
    columns = {"time": time}
    columns |= dict(zip(("force_x", "force_y", "force_z"), shown.T, strict=True))
    columns |= dict(zip(("position_x", "position_y", "position_z"), pose.T, strict=True))
    quaternions = turn.as_quat() * rng.choice([-1.0, 1.0], (len(time), 1))
    columns |= dict(
        zip(("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w"), quaternions.T, strict=True)
    )
    return Record(columns, dict.fromkeys(columns, "1"))


def _turning(world: World, time: Array) -> Rotation:
    if not world.turns:
        return Rotation.concatenate([world.turn] * len(time))
    ways = [Rotation.from_rotvec(v) for v in ([0.8, 0, 0], [0, 0.8, 0], [0, 0, 0.8], [-0.6, 0.5, 0])]
    keys = Rotation.concatenate([world.turn, *(way * world.turn for way in ways), world.turn, world.turn])
    return Slerp([0, 0.2, 0.4, 0.6, 0.8, 1.0, time[-1] + 1], keys)(time)
