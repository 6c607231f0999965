"""A flat face on an elastic bed: its wrench in closed form; the tool that six axes turn to the normal."""

import numpy as np
import pytest

from palpate_thesis.figures import fig_4_01
from palpate_thesis.figures.fig_4_01 import FOAM, RUBBER, SCHEMES, command, press


def test_the_wrench_of_a_tilted_face_is_that_of_a_winkler_bed():
    """All of it touching: F = K d, and the moment about each axis K r^2/4 times the tilt about it."""
    tilt, deep, still = np.array([0.02, -0.03]), 4e-3, np.zeros(3)
    normal = np.array([*tilt, 1.0]) / np.linalg.norm([*tilt, 1.0])
    depth = deep + FOAM.places @ normal
    force, moment = np.split(FOAM.wrench(normal, depth, 0.0 * depth, still), 2)
    assert force == pytest.approx(FOAM.stiffness * deep * normal)
    angular = FOAM.stiffness * FOAM.radius**2 / 4.0
    assert moment[:2] == pytest.approx(angular * np.array([normal[1], -normal[0]]) * normal[2])
    assert FOAM.wrench(normal, -depth, depth, still) == pytest.approx(np.zeros(6))


def test_the_moments_are_moved_to_the_face():
    force, at_face = np.array([1.0, -2.0, 20.0]), np.array([0.1, 0.2, 0.0])
    read = np.concatenate([force, at_face + np.cross([0.0, 0.0, fig_4_01.BEHIND], force)])
    turning = {scheme: command(read, scheme)[3:] for scheme in SCHEMES}
    assert turning["six axes"] == pytest.approx(-fig_4_01.GAINS[1] * at_face)
    assert turning["moments alone"] != pytest.approx(turning["six axes"])
    assert not turning["one axis"].any()


def test_a_sensor_without_faults_turns_the_tool_to_the_normal(monkeypatch):
    monkeypatch.setattr(fig_4_01, "NOISE", (0.0, 0.0))
    monkeypatch.setattr(fig_4_01, "CROSSTALK", 0.0)
    monkeypatch.setattr(fig_4_01, "BITS", 24)
    six, one = press(RUBBER, "six axes", 0, 1.5), press(RUBBER, "one axis", 0, 1.5)
    assert six.angle[0] > 1.0
    assert six.angle[-1] < 0.02
    assert six.force < 0.05
    assert one.angle[-1] == pytest.approx(one.angle[0], abs=1e-3)
