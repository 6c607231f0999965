"""Bags of an arm that presses on something known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contact_frame.synthetic_arm import World, any_world, log_of
from logs.ros_bags import Sent, pose, wrench, write_bag
from palpate.records import Record


def topics_of(record: Record, every: int = 1, **more: Any) -> list[Sent]:
    """Wrench and pose of a record in three dimensions as messages; the pose only every so many rows."""
    columns = {
        name: np.column_stack([record[f"{name}_{axis}"] for axis in axes])
        for name, axes in (("force", "xyz"), ("position", "xyz"), ("quaternion", "xyzw"))
    }
    rows = slice(None, None, every)
    return [
        wrench("/ft", record["time"], columns["force"], **more),
        pose("/pose", record["time"][rows], columns["position"][rows], columns["quaternion"][rows]),
    ]


def a_press(seed: int = 0, **said: Any) -> tuple[World, Record]:
    """A press of a tool whose sensor has the tool's axes."""
    rng = np.random.default_rng(seed)
    world = any_world(rng, **{"frame": "tool", "turns": False, **said})
    return world, log_of(world, rng, seed=seed)


def press_bag(path: Path, kind: str = "mcap", seed: int = 0, every: int = 1, **said: Any) -> World:
    """A bag of such a press."""
    world, record = a_press(seed, **said)
    write_bag(path, kind, topics_of(record, every))
    return world
