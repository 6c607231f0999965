"""The mass by which a force follows the acceleration in free motion, and what a wrong sign takes from an answer."""

from __future__ import annotations

import numpy as np
import pytest

from contact_frame.synthetic_arm import any_world
from contact_frame.synthetic_arm import log_of as press_of
from palpate.contact_frame import ContactFrame, identify_contact
from palpate.contact_frame.free_motion import free_inertia
from palpate.records import Record


def shaken(rng, mass, noise=0.1, n=4000, dt=0.002):
    time = np.arange(n) * dt
    phase = rng.uniform(0, 6, (3, 4))
    f = rng.uniform(0.5, 4.0, (3, 4))
    angle = 2 * np.pi * f[..., None] * time + phase[..., None]
    place = 0.004 * np.sin(angle).sum(axis=1).T
    acceleration = -0.004 * ((2 * np.pi * f[..., None]) ** 2 * np.sin(angle)).sum(axis=1).T
    force = -mass * acceleration + rng.normal(0, noise, place.shape)
    return time, force, place + rng.normal(0, 2e-5, place.shape)


@pytest.mark.parametrize("mass", [-0.3, 0.0, 0.8])
def test_the_mass_is_found_with_an_interval_that_holds_it(mass):
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(20):
        time, force, place = shaken(rng, mass)
        value, std = free_inertia(time, force + np.array([0.3, 0.0, -0.2]), place, np.ones(len(time), bool))
        ratios.append((value - mass) / std)
    # 20 draws of a unit deviation have a root mean square of 1 +- 0.16; the window is the one of the least std.
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_an_arm_at_rest_tells_nothing():
    time, force, place = shaken(np.random.default_rng(1), 0.5)
    still = place * 0.0 + np.random.default_rng(2).normal(0, 1e-6, place.shape)
    found = free_inertia(time, force, still, np.ones(len(time), bool))
    assert found is None or found[1] > 10.0


@pytest.mark.parametrize(
    ("left", "named"), [(-0.3, True), (0.0, False), pytest.param(0.3, False, marks=pytest.mark.long)]
)
def test_a_wrong_sign_is_named_and_damping_refused(left, named):
    """A sensor that shows what is exerted on the surface shows f + m a: what moves the tool goes through it."""
    rng = np.random.default_rng(3)
    world = any_world(rng, frame="base", turns=False, slip=np.zeros(3), sign=1.0)
    press = press_of(world, rng)
    time = np.arange(len(press) + 3000) * 0.001
    s = np.minimum(time, 3.0)
    swing = 0.004 * (np.sin(2 * np.pi * 3.0 * s) - np.sin(2 * np.pi * 9.0)) * np.minimum(3.0 - s, 1.0)
    columns = {"time": time}
    acceleration = np.gradient(np.gradient(swing, 0.001), 0.001)
    for i, axis in enumerate("xyz"):
        for what, add in (("position", swing), ("force", left * acceleration)):
            column = press[f"{what}_{axis}"]
            before = np.full(3000, column[0] if what == "position" else np.nan)
            if what == "force":
                before = column[:200].mean() + rng.normal(0, world.noise, 3000)
            columns[f"{what}_{axis}"] = np.r_[before, column] + world.normal[i] * add
    record = Record(columns, dict.fromkeys(columns, "1"))
    found, along = identify_contact(record, ContactFrame(wrench_frame="base", normal=tuple(world.normal)))
    said = [warn.text for warn in found.warnings if warn.code.word == "tool-inertia"]
    assert any("with the wrong sign" in text for text in said) is named
    assert bool(said) is (left != 0.0)  # a tool's own mass is told too, and taken out
    assert ("wrong sign" in found.parameters["B"].reason) is named
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.05)
    value, std = along.meta["contact_frame"]["free_inertia_kg"]
    assert abs(value - left) < 4 * std
