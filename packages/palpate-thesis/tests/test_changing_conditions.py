"""Friction that depends on the configuration: the moments against the geometry, and the part in the plant."""

from dataclasses import replace

import numpy as np
import pytest

from palpate._vector import Vec3
from palpate.bench import build, with_values
from palpate.friction import LuGre
from palpate.robots.arm3 import Arm3
from palpate_thesis.explanations.e11_changing_conditions import (
    GRAVITY,
    PARAMETERS,
    FrictionByConfiguration,
    tilting,
)


def test_the_tilting_moment_is_that_of_the_links_own_weights():
    """Link by link: the weight of each beyond the joint, at its centre of mass, about the joint, as a vector."""
    arm = Arm3()
    length, mass, com = (np.array(list(v)) for v in (arm.length, arm.mass, arm.com))
    for q in np.random.default_rng(0).uniform(-3, 3, (20, 3)):
        along = np.column_stack([np.cos(np.cumsum(q)), np.sin(np.cumsum(q)), np.zeros(3)])
        joints = np.vstack([np.zeros(3), np.cumsum(length[:, None] * along, axis=0)])
        centres = joints[:3] + (length + com)[:, None] * along
        weight = np.array([0.0, 0.0, -GRAVITY])
        for i, found in enumerate(tilting(arm, Vec3(*q))):
            moment = sum(np.cross(centres[j] - joints[i], mass[j] * weight) for j in range(i, 3))
            assert found == pytest.approx(np.linalg.norm(moment))


def test_at_its_reference_it_is_the_friction_itself_and_follows_the_angles():
    bench = build(with_values(PARAMETERS, {"run.duration": 0.6}))
    arm, plant = bench.loop.conditioning.arm, bench.loop.plant
    part = FrictionByConfiguration(LuGre(), arm, tilting(arm, bench.q), bench.q)
    torque, state = part.step(part.start(), Vec3(1e-9, 0.0, 0.0), 5e-5)
    assert torque.x == pytest.approx(LuGre().step(Vec3(0.0, 0.0, 0.0), Vec3(1e-9, 0.0, 0.0), 5e-5)[0].x)
    moved = replace(bench, loop=bench.loop._replace(plant=plant._replace(friction=part)))
    state = moved.loop.plant.start_at(moved.q)
    for _ in range(200):
        before = state.q
        state, _ = moved.loop.plant.advance(state, Vec3(8.0, 1.0, 0.2), 5e-5)
    assert np.array(list(state.bristles.q)) == pytest.approx(np.array(list(before)), abs=1e-12)
    assert abs(state.q.x - moved.q.x) > 1e-4
