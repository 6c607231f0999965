"""Logs of a tool on a force sensor that is turned in free motion, rests, and is shaken at the end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from palpate.records import Record

Array = NDArray[np.float64]
RATE = 500.0


@dataclass
class Tool:
    """What hangs on a sensor, and what its driver does.

    Args:
        mass: [kg].
        centre: in the tool's axes from the sensor [m].
        bias, drift: of the force [N], [N/s].
        torque_bias: [N m].
        side: 1 if the sensor shows what the tool exerts on it, -1 for the opposite.
        taken_off: share of the inertia that the driver takes off; 2 is the wrong sign.
        noise: of an axis [N]; of the torque a twentieth of it.
        uneven: by which a cable or a flange errs in each orientation, of an axis [N].
        sensor: how its axes are turned against the tool's.
    """

    mass: float = 0.8
    centre: tuple[float, float, float] = (0.01, -0.02, 0.07)
    bias: tuple[float, float, float] = (3.0, -1.0, 5.0)
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque_bias: tuple[float, float, float] = (0.1, 0.0, -0.2)
    side: float = -1.0
    taken_off: float = 0.0
    noise: float = 0.1
    uneven: float = 0.0
    sensor: Rotation | None = None


def six() -> Rotation:
    """Six orientations and the first again."""
    turns = [[0, 0, 0], [1.2, 0, 0], [-1.2, 0, 0], [0, 1.2, 0], [0, -1.2, 0], [0.8, 0.8, 0], [0, 0, 0]]
    return Rotation.from_rotvec(turns)


def log_of(tool: Tool, turns: Rotation, rng: np.random.Generator, *, shaken: float = 0.0) -> Record:
    """A second of rest in each orientation, half a second between, and seconds of shaking at the end."""
    keys, times = [], []
    for k in range(len(turns)):
        keys += [turns[k], turns[k]]
        times += [1.5 * k, 1.5 * k + 1.0]
    end = times[-1] + shaken
    time = np.arange(0.0, end, 1.0 / RATE)
    rest = np.mod(time, 1.5)
    s = np.clip((rest - 1.0) / 0.5, 0.0, 1.0)
    eased = np.where(
        time < times[-1], time - rest + np.minimum(rest, 1.0) + 0.5 * s**3 * (10 - 15 * s + 6 * s**2), time
    )
    way = Slerp([*times, end + 1.0], Rotation.concatenate([*keys, turns[-1]]))(eased)
    place = np.full((len(time), 3), 0.4)
    s = np.maximum(time - times[-1], 0.0)
    for axis, (f, phase) in enumerate(((2.0, 0.0), (3.0, 1.0), (2.5, 2.0))):
        place[:, axis] += 0.01 * np.sin(2 * np.pi * f * s) * np.minimum(s, 1.0) * np.cos(phase * s)
    acceleration = np.gradient(np.gradient(place + way.apply(tool.centre), time, axis=0), time, axis=0)
    gravity = np.array([0.0, 0.0, -9.80665])
    exerted = tool.mass * (gravity - (1.0 - tool.taken_off) * acceleration)
    force = tool.side * way.inv().apply(exerted)
    torque = np.cross(np.array(tool.centre), force) + tool.torque_bias
    uneven = rng.normal(0.0, 1.0, (len(turns), 3)) * tool.uneven
    which = np.clip(np.round(time / 1.5 - 0.33).astype(int), 0, len(turns) - 1)
    force = force + uneven[which] + np.array(tool.bias) + time[:, None] * np.array(tool.drift)
    if tool.sensor is not None:
        force, torque = tool.sensor.inv().apply(force), tool.sensor.inv().apply(torque)
    force = force + rng.normal(0.0, tool.noise, force.shape)
    torque = torque + rng.normal(0.0, tool.noise / 20.0, torque.shape)
    place = place + rng.normal(0.0, 1e-6, place.shape)
    names = [f"{what}_{axis}" for what in ("force", "torque", "position") for axis in "xyz"]
    names += [f"quaternion_{axis}" for axis in "xyzw"]
    columns = {"time": time} | dict(
        zip(names, np.hstack([force, torque, place, way.as_quat()]).T, strict=True)
    )
    return Record(columns, dict.fromkeys(columns, "1"))
