"""Force and position loops that leave each other alone, and what the printed law does instead."""

import math

import numpy as np
import pytest

from controllers.ideal_arm import press, task
from palpate._vector import Vec3
from palpate.controllers.hybrid import DecoupledHybrid, Hybrid

KP, KV = Vec3(400.0, 400.0, 400.0), Vec3(80.0, 80.0, 80.0)
KF, KFV, K_E = 3000.0, 110.0, 5200.0
CORRECTED = DecoupledHybrid.corrected(KP, KV, Vec3(KF, KF, KF), Vec3(KFV, KFV, KFV), K_E)
SAME_GAIN = DecoupledHybrid.printed(KP, KV, Vec3(KF, KF, KF) / K_E**2, K_E)
HYBRID = Hybrid(KP, KV, Vec3(1.0, 1.0, 1.0), Vec3(0.0, 0.0, 0.0))


def side(law, force, y=0.0, duration=0.3):
    """How far y [m] and phi [rad] stray from the start, at most."""
    _, x, _, _ = press(law, task(force, y), K_E, duration)
    return np.abs(x[:, 1:]).max(axis=0)


def test_the_force_follows_its_own_second_order_system():
    t, _, _, f = press(CORRECTED, task(20.0), K_E)
    # f'' = KF (20 - f) - KFV f', over-damped
    root = math.sqrt(KFV**2 - 4 * KF)
    slow, fast = (KFV - root) / 2, (KFV + root) / 2
    expected = 20.0 * (1 - (fast * np.exp(-slow * t) - slow * np.exp(-fast * t)) / root)
    assert f == pytest.approx(expected, abs=1e-5)


def test_a_step_of_force_leaves_the_position_alone():
    assert (side(CORRECTED, 20.0) < 1e-9).all()


def test_a_step_of_position_leaves_the_force_alone():
    _, x, _, f = press(CORRECTED, task(0.0, y=0.001), K_E)
    assert x[-1, 1] > 0.9e-3
    assert np.abs(f).max() < 1e-5


@pytest.mark.parametrize("law", [SAME_GAIN, HYBRID], ids=["as printed", "(4.13)"])
def test_without_measured_compensation_a_step_of_force_moves_the_position(law):
    y, phi = side(law, 20.0)
    assert y > 1e-4
    assert phi > math.radians(0.1)


def test_the_printed_gain_is_a_stiffness_squared_too_high():
    printed = DecoupledHybrid.printed(KP, KV, Vec3(KF, KF, KF), K_E)
    assert printed.force_gain.x / CORRECTED.force_gain.x == pytest.approx(K_E**2)
