"""The tool's mass out of M, the arm's compliance out of K."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import pressed, record, shaken
from palpate.contact_frame import ArmDynamics, describe, identify_contact, robot_stiffness
from palpate.errors import InputError
from palpate.identification import Verdict, identify

KNOWN = {"lag": 0.0, "model": "kelvin-voigt-mass"}


@pytest.mark.long
def test_the_tool_is_taken_out_of_the_mass():
    """f = (M + tool) a + ...: what is fitted is both."""
    both, _ = identify_contact(shaken(m=1.5), **KNOWN)
    alone, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(1.0, 0.0)), **KNOWN)
    fitted, left = both.parameters["M"], alone.parameters["M"]
    assert left.value == pytest.approx(fitted.value - 1.0)
    assert left.ci95 == pytest.approx([end - 1.0 for end in fitted.ci95])
    assert "the tool's 1 kg taken off" in left.reason
    assert "environment + tool" in fitted.reason
    assert alone.parameters["K"] == both.parameters["K"]


def test_the_tool_s_own_uncertainty_widens_the_interval():
    sure, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(1.0, 0.0)), **KNOWN)
    vague, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(1.0, 0.05)), **KNOWN)
    one, two = sure.parameters["M"], vague.parameters["M"]
    assert two.std == pytest.approx(np.hypot(one.std, 0.05))
    assert (two.ci95[1] - two.ci95[0]) / two.std == pytest.approx((one.ci95[1] - one.ci95[0]) / one.std)


def test_a_mass_that_is_lost_beside_the_tool_s_is_not_identified():
    found, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(1.49, 0.02)), **KNOWN)
    left = found.parameters["M"]
    assert left.verdict is Verdict.NOT_IDENTIFIABLE
    assert left.value is None
    assert "does not show the environment's" in left.reason


def test_a_mass_that_the_tool_nearly_makes_is_wider_than_it_may_be():
    found, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(1.3, 0.04)), **KNOWN)
    left = found.parameters["M"]
    assert left.verdict is Verdict.NOT_IDENTIFIABLE
    assert left.value == pytest.approx(0.2, abs=0.05)
    assert "wider than 25%" in left.reason


def test_a_tool_heavier_than_all_is_rejected():
    found, _ = identify_contact(shaken(m=1.5), arm=ArmDynamics(tool_mass=(2.0, 0.01)), **KNOWN)
    assert found.parameters["M"].verdict is Verdict.REJECTED
    assert found.parameters["M"].value is None
    assert "is the tool that heavy" in found.parameters["M"].reason


def in_series(stiffness: float, seed: int = 0, **press):
    """A press whose position is that of the joints: the arm gives way by f / stiffness."""
    flat, true = pressed(seed=seed, **press), pressed(seed=seed, **{**press, "noise": 0.0})
    return record(flat["time"], flat["position"] + true["force"] / stiffness, flat["force"])


def test_a_press_on_a_rigid_wall_is_the_arm():
    """1/K = 1/K_measured - 1/K_robot."""
    wall = identify(in_series(40e3, k=4e7, b=0.0, noise=0.02, seed=3), model="kelvin-voigt", lag=0.0)
    arm = robot_stiffness(wall, "wall.csv")
    assert arm[0] == pytest.approx(40e3, rel=0.01)
    soft, _ = identify_contact(in_series(40e3), arm=ArmDynamics(position_from="joints"), lag=0.0)
    calibrated = ArmDynamics(position_from="joints", stiffness=arm)
    found, along = identify_contact(in_series(40e3), arm=calibrated, lag=0.0)
    assert soft.parameters["K"].value == pytest.approx(1 / (1 / 5000 + 1 / 40e3), rel=0.05)
    own = found.parameters["K"]
    assert (
        abs(own.value - 5000) < 1.5 * (own.ci95[1] - own.ci95[0]) / 2
    )  # 95 % are missed once in twenty, not by half
    assert "series-compliance" not in found.codes
    assert any("taken out of K" in line for line in describe(along.meta))


def test_a_high_stiffness_of_joints_is_a_lower_bound():
    found, _ = identify_contact(in_series(40e3), arm=ArmDynamics(position_from="joints"))
    stiffness = found.parameters["K"]
    assert "series-compliance" in found.codes
    assert stiffness.verdict is Verdict.NOT_IDENTIFIABLE
    assert "a lower bound" in stiffness.reason
    assert stiffness.ci95[0] < 5000
    point = found.to_json()["working_point"]["stiffness"]
    assert point["verdict"] == "not identifiable", "of the surface, as K is"
    assert point["reason"].startswith("a lower bound of the surface's stiffness, at least ")


def test_a_low_one_stands_and_a_tip_s_is_not_doubted():
    soft, _ = identify_contact(pressed(k=300, b=3, noise=0.002), arm=ArmDynamics(position_from="joints"))
    assert soft.parameters["K"].verdict is Verdict.IDENTIFIED
    tip, _ = identify_contact(pressed(), arm=ArmDynamics(position_from="tip"))
    assert "series-compliance" not in tip.codes


def test_a_log_that_shows_no_stiffness_calibrates_nothing():
    time = np.arange(3000) / 1000
    free = record(time, np.sin(time), np.random.default_rng(0).normal(0, 0.1, 3000))
    with pytest.raises(InputError, match=r"air\.csv does not show the robot's stiffness"):
        robot_stiffness(identify(free), "air.csv")


def test_a_negative_mass_is_refused():
    with pytest.raises(InputError, match="tool's mass must be 0 kg or more"):
        ArmDynamics(tool_mass=(-1.0, 0.0))
    with pytest.raises(InputError, match="robot's mass must be 0 kg or more"):
        ArmDynamics(mass=(-1.0, 0.0))
    with pytest.raises(InputError, match="give --robot-stiffness too"):
        identify_contact(in_series(40e3), arm=ArmDynamics(mass=(1.0, 0.0)))
