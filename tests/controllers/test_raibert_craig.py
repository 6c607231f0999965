"""The original hybrid control: joint by joint, and blind to inertia."""

import math

import pytest

from controllers.ideal_arm import ARM, INTO, START, task
from palpate._vector import ZERO3, Vec3, solve
from palpate.controllers.raibert_craig import RaibertCraig, growth_rate
from palpate.signals.types import Sense

STIFFNESS, DAMPING = Vec3(414.0, 47.0, 1.15), Vec3(83.0, 9.4, 0.23)
LAW = RaibertCraig(STIFFNESS, DAMPING, ZERO3, 1.0, 0.0, 1.0, 0.001)


def still(law, q, x_error, f, ticks=1):
    """The torque after some ticks at rest at q, the desired pose off by x_error, the measured force f."""
    x = ARM.pose(q)
    sense = Sense(q, ZERO3, x, ZERO3, Vec3(f, 0.0, 0.0))
    asked = task(20.0)._replace(x=x + x_error)
    state = law.start()
    for _ in range(ticks):
        torque, state = law.step(state, sense, asked, ARM.model(q, ZERO3))
    return torque


def test_with_nothing_wrong_it_feeds_the_desired_force_forward():
    q = ARM.inverse(START, 1.0)
    assert still(LAW, q, ZERO3, 20.0) == pytest.approx(ARM.jac(q).T @ Vec3(20.0, 0.0, 0.0))


def test_errors_go_through_the_inverse_and_the_transpose():
    q = ARM.inverse(START, 1.0)
    J = ARM.jac(q)
    law = LAW._replace(feed_forward=0.0, integral=Vec3(3.0, 2.0, 1.0), ki=5.0)
    n = 7
    moved = solve(J, Vec3(0.0, 0.001, 0.01))  # the error along x, 0.5, is not selected
    lacking = J.T @ Vec3(8.0, 0.0, 0.0)
    expected = (STIFFNESS + n * 0.001 * law.integral) * moved + (1.0 + n * 0.001 * 5.0) * lacking
    assert still(law, q, Vec3(0.5, 0.001, 0.01), 12.0, ticks=n) == pytest.approx(expected)


def test_the_bench_posture_is_stable():
    q = ARM.inverse(START, 1.0)
    assert growth_rate(LAW, ARM.model(q, ZERO3), INTO) < 1e-3


@pytest.mark.parametrize("q", [(-0.30, -0.43, 0.75), (0.17, -0.15, 0.51)])
@pytest.mark.parametrize("gain", [0.1, 1.0, 10.0])
def test_in_some_postures_no_gain_makes_it_stable(q, gain):
    """An and Hollerbach's kinematic instability: q''= -M^-1 K J^-1 (I - S) J q with an unstable eigenvalue."""
    law = LAW._replace(stiffness=STIFFNESS * gain, damping=DAMPING * math.sqrt(gain))
    assert growth_rate(law, ARM.model(Vec3(*q), ZERO3), INTO) > 1.0
