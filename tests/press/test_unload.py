"""A retreat from a surface in simulation: after a press that is done, ends early, or meets nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.bench.summary import CONTACT, RETREAT
from palpate.force import ForceLoop
from palpate.press.prepare import PressSpec, prepare_press, surface_of
from palpate.press.pressing import NOT_REACHED, press
from palpate.press.sequence import CautiousDriver, Plan
from palpate.press.setting import cell_of
from palpate.press.simulated_arm import SimulatedArm
from palpate.press.unload import Glimpse, RetreatPlan, unload


def question(**changes):
    asked = {"arm": "ur5e", "mode": "position", "force": 20.0, "seconds": 0.4, "probe": 0.0}
    return PressSpec(**{**asked, "surface": surface_of("K=5000,B=50"), **changes})


@pytest.mark.parametrize(("end", "force"), [("retreat", 0.0), ("hold", 20.0)])
def test_a_press_that_is_done_ends_as_asked(end, force):
    record = prepare_press(question(end=end)).run()
    assert record.meta["end"] == "done"
    assert record["force"][-1] == pytest.approx(force, abs=0.5 if force else 0.0)
    assert (record["phase"] == RETREAT).any() == (end == "retreat")
    assert record.meta["unloaded"].endswith("to free motion" if end == "retreat" else "--end hold")


@pytest.mark.parametrize("arm", ["ur5e", pytest.param("fr3", marks=pytest.mark.long)])
def test_an_interrupted_press_is_unloaded(arm):
    asked = prepare_press(question(arm=arm, mode=None)).request
    cell = cell_of(asked.arm, asked.place, asked.surface, asked.gains.arm)
    one = SimulatedArm(asked.arm, asked.gains.arm, asked.place, cell)
    driver = CautiousDriver(one, ForceLoop(asked.gains), asked.place.normal)

    def progress(time, phase):
        if phase == "contact" and one.truth.force > 10.0:
            raise KeyboardInterrupt

    record = press(one, driver, asked.place, Plan(20.0, 5.0), asked.gains, progress)
    assert record.meta["end"] == "interrupted"
    assert record["force"][record["phase"] == CONTACT][-1] > 10.0
    assert record["force"][-1] == 0.0


@pytest.mark.long
@pytest.mark.parametrize("controller", ["hybrid", "impedance"])
def test_a_controller_of_torques_is_unloaded_too(controller):
    record = prepare_press(question(controller=controller, mode="torque", arm="iiwa14", seconds=2.0)).run()
    assert record["force"][-1] == 0.0
    assert np.abs(np.diff(record["x"])).max() < 1e-3  # nothing jumps where the controller changes


@pytest.mark.long
def test_a_force_that_is_never_reached_is_no_press():
    """An impedance shares the depth with the surface, so that its force stays below 17 N of 20."""
    record = prepare_press(question(controller="impedance", mode="torque", arm="fr3", seconds=1.0)).run()
    assert record.meta["end"] == NOT_REACHED
    assert "the force of 20 N was never reached, 16" in record.meta["why"]
    assert record["force"][-1] == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_a_press_in_free_motion_meets_nothing(seed):
    asked = prepare_press(question()).request
    far = replace(asked.place, place=asked.place.place + 0.2)
    one = SimulatedArm(
        asked.arm, asked.gains.arm, far, cell_of(asked.arm, far, asked.surface, asked.gains.arm), seed=seed
    )
    driver = CautiousDriver(one, ForceLoop(asked.gains), far.normal)
    record = press(one, driver, far, Plan(20.0, 1.0, longest=1.0), asked.gains)
    assert record.meta["end"] == "no contact"
    assert record["x"][-1] <= record["x"][0] + 1e-4  # back at the start


class Tip:
    """A tip behind which nothing gives way, at once where it is commanded."""

    def __init__(self, gains, stiffness, depth):
        self.gains, self.stiffness, self.depth, self.sent = gains, stiffness, depth, []

    def glimpse(self):
        return Glimpse(self.stiffness * max(self.depth, 0.0), self.depth + 0.003)

    def retreat(self, velocity):
        self.sent.append(velocity)
        self.depth += self.gains.arm.tick * velocity[0]


@pytest.mark.parametrize("stiffness", [100.0, 5e3, 1e5])
def test_a_retreat_ends_at_the_clearance_after_free_motion(stiffness):
    gains = prepare_press(question()).request.gains
    tip = Tip(gains, stiffness, 0.01)
    plan = RetreatPlan(gains, np.array([1.0, 0.0, 0.0]), 0.02, 0.001, 0.013, 0.02, 20.0)
    done = unload(tip, plan)
    assert done.free
    assert tip.depth < 0.0
    assert done.distance <= 0.014 + 1e-9
    assert min(v[0] for v in tip.sent) == -0.02
    assert not tip.sent[-1].any()


def test_a_refused_command_ends_the_retreat_with_its_reason():
    gains = prepare_press(question()).request.gains
    tip = Tip(gains, 5e3, 0.01)
    tip.retreat = lambda velocity: "the connection is lost"
    plan = RetreatPlan(gains, np.array([1.0, 0.0, 0.0]), 0.02, 0.001, 0.013, 0.02, 20.0)
    done = unload(tip, plan)
    assert done.how == "could not unload: the connection is lost"
    assert not done.completed
