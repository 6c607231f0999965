"""The torque says where the force passes."""

from __future__ import annotations

import numpy as np
import pytest

from contact_frame.synthetic_arm import any_world, log_of
from palpate.contact_frame import ContactFrame, describe, project
from palpate.records import Record


@pytest.fixture
def log():
    """A press with the torque that it makes about a point of the tool."""
    rng = np.random.default_rng(0)
    at = np.array([0.02, -0.01, 0.05])
    world = any_world(rng, frame="tool", sign=1.0, turns=False, noise=0.01)
    record = log_of(world, rng)
    load = world.turn.inv().apply(world.weight) + world.bias
    force = np.column_stack([record[f"force_{axis}"] for axis in "xyz"])
    own = np.array([0.3, -0.1, 0.2]) + rng.normal(0, 1e-3, force.shape)
    torque = np.cross(world.tcp - at, force - load) + own
    columns = dict(record.columns) | {f"torque_{axis}": torque[:, i] for i, axis in enumerate("xyz")}
    return world, at, Record(columns, dict.fromkeys(columns, "1"))


def off(record, **said):
    along = project(record, ContactFrame(wrench_frame="tool", **said))
    return along.meta["contact_frame"]["line_of_action_off_m"], describe(along.meta)


def test_the_right_lever_arm_is_met(log):
    world, at, record = log
    missed, lines = off(record, tcp=tuple(world.tcp), wrench_at=tuple(at))
    assert missed < 1e-3
    assert not any("right?" in line for line in lines)


def test_a_wrong_one_is_missed_by_as_much_as_it_is_off(log):
    world, at, record = log
    inside = world.turn.inv().apply(world.normal)
    across = np.cross(inside, [1.0, 0.0, 0.0])
    across *= 0.03 / np.linalg.norm(across)
    missed, lines = off(record, tcp=tuple(world.tcp + across + 0.1 * inside), wrench_at=tuple(at))
    assert missed == pytest.approx(0.03, rel=0.05)  # along the force the line does not tell
    assert any("--tcp" in line for line in lines)
