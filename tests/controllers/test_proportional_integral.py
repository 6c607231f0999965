"""PI on the force: no error in the end, and the bandwidth that was asked for."""

import math

import numpy as np
import pytest

from controllers.ideal_arm import ARM, START, task
from palpate._vector import ZERO3, Vec3
from palpate.controllers.hybrid import Hybrid
from palpate.controllers.proportional_integral import ProportionalIntegral, integral_gain
from palpate.errors import InputError
from palpate.signals.types import Sense

GAIN = Vec3(400.0, 400.0, 400.0), Vec3(80.0, 80.0, 80.0), Vec3(0.25, 0.25, 0.25)
TICK = 0.001


def pi(ki):
    return ProportionalIntegral(*GAIN, Vec3(ki, ki, ki), TICK)


def yielding(law, friction, duration=1.0):
    """The force of each tick when the arm gives way at once: the command, less what friction takes [N]."""
    q = ARM.inverse(START, 1.0)
    model, x = ARM.model(q, ZERO3), ARM.pose(q)
    state, f, forces = law.start(), 5.0, []
    for _ in range(round(duration / TICK)):
        sense = Sense(q, ZERO3, x, ZERO3, Vec3(f, 0.0, 0.0))
        torque, state = law.step(state, sense, task(20.0), model)
        # model.J.T @ (f, 0, 0) = torque where only x is commanded
        f = 0.98 * f + 0.02 * (torque.y / model.J.r1.y - friction)
        forces.append(f)
    return np.array(forces)


def test_the_steady_error_is_zero_whatever_friction_takes():
    for friction in (0.0, 4.0):
        assert yielding(pi(20.0), friction)[-1] == pytest.approx(20.0, abs=1e-3)
    assert yielding(pi(0.0), 4.0)[-1] == pytest.approx(20.0 - 4.0 / 1.25, abs=1e-3)


def test_the_error_decays_with_the_bandwidth_asked_for():
    f = yielding(pi(integral_gain(2.0, kf=0.25)), 4.0)
    e = 20.0 - f
    measured = math.log(e[100] / e[300]) / (200 * TICK)  # [1/s]
    assert measured == pytest.approx(2 * math.pi * 2.0, rel=0.25)  # the arm's own lag adds to it


def test_it_is_the_hybrid_controller_with_its_integral_per_second():
    per_sample = Hybrid(*GAIN, Vec3(0.005, 0.005, 0.005))
    assert yielding(pi(5.0), 2.0) == pytest.approx(yielding(per_sample, 2.0), abs=1e-12)


@pytest.mark.parametrize(("bandwidth", "kf"), [(0.0, 0.0), (-1.0, 0.0), (math.nan, 0.0), (1.0, -1.0)])
def test_a_bandwidth_that_makes_no_sense_is_refused(bandwidth, kf):
    with pytest.raises(InputError, match="must be above"):
        integral_gain(bandwidth, kf)
