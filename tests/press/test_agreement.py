"""A press by palpate's own physics and by MuJoCo's is the same press."""

import numpy as np
import pytest

from palpate.environments.models import KelvinVoigt
from palpate.force import ForceLoop
from palpate.press.engines import loop_of, press_gains
from palpate.press.pressing import press
from palpate.press.sequence import CautiousDriver, Plan
from palpate.press.setting import cell_of, place_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.robots import SerialArm

NAMES = ("ur5e", "panda", "fr3", "iiwa14")


def pressed(name, physics, mode="torque"):
    """Half a second around the touch, the surface so near that it comes at once."""
    arm = SerialArm.named(name)
    place = place_of(arm, None, None, gap=2e-4)
    loop = loop_of(name, arm.title, mode, place.mass)
    gains = press_gains(loop, 20.0)
    cell = cell_of(arm, place, KelvinVoigt(5000.0, 50.0, 0.0), loop)
    simulated = SimulatedArm(arm, loop, place, cell, physics, 0, 0.0)
    driver = CautiousDriver(simulated, ForceLoop(gains), place.normal)
    return press(simulated, driver, place, Plan(20.0, 0.25, 0.0), gains)


def difference(one, other, column="force"):
    n = min(len(one), len(other))
    return np.abs(one[column][:n] - other[column][:n])


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if n != "ur5e" else ()) for n in NAMES]
)
def test_the_force_is_the_same_through_touch_and_press(name):
    """M, h and J differ by 1e-15 relative; some hundred steps and the surface's 5000 N/m make 1e-9 N of it at most."""
    own, other = (pressed(name, physics) for physics in ("own", "mujoco"))
    assert own["force"].max() > 15.0
    assert len(own) == len(other)
    assert difference(own, other).max() < 1e-8
    assert difference(own, other, "q1").max() < 1e-11


def test_an_arm_of_positions_too():
    own, other = (pressed("ur5e", physics, "position") for physics in ("own", "mujoco"))
    assert own["force"].max() > 15.0
    assert difference(own, other).max() < 1e-7
