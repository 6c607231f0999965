"""The arm under impedance control is the target impedance."""

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from controllers.ideal_arm import START, press, task
from palpate._vector import Vec3
from palpate.controllers.impedance import Impedance

M, B, K = 5.0, 150.0, 2000.0
DEPTH, SPRING = 0.0138, 5200.0
LAW = Impedance(
    Vec3(M, 11.0, 0.25), Vec3(B, 880.0, 20.0), Vec3(K, 4400.0, 100.0), Vec3(START.x + DEPTH, 0.0, 0.0)
)


def test_the_tip_moves_as_the_target_impedance_on_the_same_spring():
    t, x, _, f = press(LAW, task(0.0), SPRING)
    # (2.2): M x'' + B x' + K x + SPRING x = K DEPTH
    target = StateSpace([[0, 1], [-(K + SPRING) / M, -B / M]], [[0], [K / M]], [[1, 0]], [[0]])
    _, expected, _ = lsim(target, np.full(t.size, DEPTH), t)
    assert x[:, 0] - START.x == pytest.approx(expected, abs=1e-8)
    assert f == pytest.approx(SPRING * expected, abs=1e-4)


def test_the_force_is_what_both_springs_agree_on():
    *_, f = press(LAW, task(0.0), SPRING, duration=1.5)
    assert f[-1] == pytest.approx(DEPTH * K * SPRING / (K + SPRING), rel=1e-6)


def test_along_the_surface_it_holds_the_pose_of_the_task():
    _, x, _, _ = press(LAW, task(0.0, y=0.001), SPRING, duration=1.5)
    assert x[-1, 1:] == pytest.approx([0.001, 0.0], abs=1e-6)
    assert np.abs(x[:, 2]).max() < 1e-8
