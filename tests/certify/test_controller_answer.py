"""Answers about other projects' controllers: claims, corrections that are read back, refusals, and the command."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.certify.controller_answer import ControllerRequest, certify_controller, judge_law
from palpate.certify.controller_lines import answer_lines
from palpate.certify.discrete_loop import overshoot
from palpate.certify.upstream_laws import Admittance, ForwardDynamics, Timing
from palpate.cli import main
from palpate.errors import InputError

ADMITTANCE = """\
controller_manager: {ros__parameters: {update_rate: 125}}
admittance_controller:
  ros__parameters:
    joints: [j1]
    command_interfaces: [position]
    ft_sensor: {filter_coefficient: 0.995}
    admittance:
      mass: [3.0, 3.0, 3.0, 0.05, 0.05, 0.05]
      damping_ratio: [2.8, 2.8, 2.8, 2.8, 2.8, 2.8]
      stiffness: [50.0, 50.0, 50.0, 1.0, 1.0, 1.0]
      joint_damping: 5.0
"""
FORCE = """\
controller_manager: {ros__parameters: {update_rate: 500}}
force:
  ros__parameters:
    ft_sensor_ref_link: sensor
    command_interfaces: [velocity]
    pd_gains: {trans_x: {p: 0.05}, trans_y: {p: 0.05}, trans_z: {p: 0.05}}
motion: {ros__parameters: {pd_gains: {trans_x: {p: 1.0}}}}
invalid: {ros__parameters: {ft_sensor_ref_link: s, command_interfaces: [position], pd_gains: {trans_x: {p: 0.0}}}}
"""
CRISP = "task.k_pos_x: 600.0\ntask.d_pos_x: 60.0\nuse_friction: true\n"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def certify(text, controller, **numbers):
    path = Path("a.yaml")
    path.write_text(text)
    return certify_controller(path, ControllerRequest(controller, **{"delay": 0.024} | numbers))


def test_a_proof_lies_within_what_is_stable_and_holds_for_a_tick_more():
    law, timing = Admittance(3.0, 50.0, 2.8, 5.0, 0.995), Timing(125.0, 0.024)
    verdict = judge_law(law, timing)
    (ends,), late = verdict.ranges, judge_law(law, timing.later()).ranges[0]
    assert verdict.proved[1] == pytest.approx(0.99 * late[1])
    assert late[1] < ends[1]


def test_the_answer_is_of_the_worst_axis():
    result = certify(ADMITTANCE.replace("3.0, 3.0, 3.0", "3.0, 1.0, 3.0"), "ros2-admittance").answer
    axes = result["controllers"][0]["axes"]
    edges = {axis: axes[axis]["ranges"][0][1] for axis in axes}
    assert result["first_unstable"] == result["exact"]["stiffness"][1] == min(edges.values()) == edges["y"]
    assert result["proved"]["stiffness"][1] == axes["y"]["proved"][1]
    assert result["proved"]["stiffness"][0] == max(axes[axis]["proved"][0] for axis in axes)
    assert edges["x"] == edges["z"]


def test_numbers_that_run_away_are_said_and_not_proved():
    result = certify(ADMITTANCE.replace("2.8", "121.5"), "ros2-admittance").answer
    reason = result["controllers"][0]["axes"]["x"]["reason"]
    assert "runs away: (D/M + joint_damping)/update_rate must be below 2 and is 7.98" in reason
    assert result["proved"]["stiffness"] is result["exact"]["stiffness"] is None


@pytest.mark.parametrize(("controller", "text"), [("ros2-admittance", ADMITTANCE), ("fzi", FORCE)])
def test_a_correction_is_read_back_stable_and_overshoots_little(controller, text):
    surfaces = (2e3, 5e4)
    verdict = certify(text, controller, surfaces=surfaces)
    assert not verdict.holds
    again = certify(verdict.corrected, controller, surfaces=surfaces)
    assert again.holds
    assert again.answer["proved"]["stiffness"][0] <= 2e3
    assert again.answer["proved"]["stiffness"][1] >= 5e4
    for axis in again.answer["controllers"][0]["axes"].values():
        assert axis["overshoot"] < 0.1
    assert again.answer["corrected"] is None
    for word in ("update_rate", "pd_gains" if controller == "fzi" else "joint_damping: 5.0"):
        assert word in verdict.corrected


def test_an_axis_without_stiffness_is_corrected_with_one():
    text = ADMITTANCE.replace("50.0, 1.0", "0.0, 1.0")
    verdict = certify(text, "ros2-admittance", surfaces=(500.0, 1e4))
    name = "admittance_controller.admittance.stiffness"
    assert verdict.answer["corrected"][name] == [50.0, 50.0, 1.0, 1.0, 1.0, 1.0]
    assert certify(verdict.corrected, "ros2-admittance", surfaces=(500.0, 1e4)).holds


def test_without_a_setting_a_sentence_says_why():
    verdict = certify(CRISP, "crisp", surfaces=(1e3, 1e7), rate=100.0, mass=3.0)
    assert verdict.corrected is None
    assert "that this rule can run at this rate" in verdict.answer["not_corrected_because"]


def test_a_torque_arm_is_proved_and_its_null_space_is_noted():
    verdict = certify(CRISP, "crisp", delay=0.002, rate=1000.0, mass=3.0)
    assert 1e5 < verdict.answer["proved"]["stiffness"][1] < verdict.answer["exact"]["stiffness"][1]
    assert verdict.holds
    notes = " ".join(verdict.answer["controllers"][0]["notes"])
    assert all(word in notes for word in ("use_friction", "damping -1", "use_local_jacobian false"))
    franka = certify("translational_stiffness: 200.0\n", "franka", mass=3.0).answer["controllers"][0]
    assert "never compared with a run" in franka["notes"][0]


STILL = "".join(f"task.k_pos_{axis}: 0.0\ntask.k_rot_{axis}: 0.0\n" for axis in "xyz")
UNDAMPED = "nullspace.projector_type: none\nnullspace.stiffness: 0.0\n"


@pytest.mark.parametrize(("more", "says"), [("", "no torque acts"), (UNDAMPED, "the arm runs away")])
def test_an_arm_without_a_force_loop_is_answered_and_not_corrected(more, says):
    verdict = certify(STILL + more, "crisp", rate=1000.0, mass=3.0, surfaces=(1e3, 1e4))
    assert not verdict.holds
    assert verdict.answer["proved"]["stiffness"] is verdict.answer["first_unstable"] is None
    assert verdict.answer["not_corrected_because"] == "no axis has a force loop"
    assert all(says in axis["reason"] for axis in verdict.answer["controllers"][0]["axes"].values())
    claim = answer_lines(verdict.answer, None)[1]
    assert all(part in claim for part in ("Nothing to prove", says, "Not modelled: the other five axes"))


def test_controllers_that_do_not_measure_the_force_are_passed_over():
    result = certify(FORCE, "fzi", delay=0.010).answer
    assert [node["node"] for node in result["controllers"]] == ["force"]
    assert len(result["passed_over"]) == 2
    assert result["exact"]["stiffness"][1] == pytest.approx(23.9e3 / 2.0, rel=0.001)  # error_scale 1, not 0.5


def test_a_late_arm_behind_a_position_interface_is_told_from_a_late_force():
    result = certify(FORCE.replace("velocity", "position"), "fzi", delay=0.010).answer
    assert result["proved"]["stiffness"] is None
    late = result["controllers"][0]["if_only_the_force_is_late"]
    assert late["proved"][1] < late["exact"][0][1]


@pytest.mark.parametrize(
    ("controller", "text", "numbers", "says"),
    [
        ("ros2-admittance", ADMITTANCE.replace("update_rate: 125", "a: 1"), {}, "give --rate HZ"),
        ("ros2-admittance", ADMITTANCE, {"delay": None}, "give --delay"),
        ("crisp", CRISP, {}, "--rate HZ, the controller manager's update_rate and --mass"),
        ("crisp", CRISP, {"rate": 1000.0, "mass": 0.0}, "--mass must be above 0"),
        ("fzi", FORCE, {"delay": 3.0}, "up to 200 ticks"),
        ("fzi", FORCE, {"rate": -1.0}, "a rate from 1 to"),
        ("ros2-admittance", ADMITTANCE.replace("    joints:", "    type: other/AdmittanceController\n    joints:"), {},
         "its type is other/AdmittanceController, whose source is not"),
    ],
)  # fmt: skip
def test_a_missing_or_impossible_number_is_asked_for(controller, text, numbers, says):
    with pytest.raises(InputError) as error:
        certify(text, controller, **numbers)
    assert says in str(error.value)


EXTREME = st.sampled_from([0.0, 1e-300, 1e-9, 1.0, 1e6, 1e12, -1.0, -1e12])


@given(EXTREME, EXTREME, EXTREME, st.sampled_from([1, 2, 20]), st.sampled_from(["position", "velocity"]))
@settings(max_examples=20, deadline=None)
def test_extreme_numbers_are_answered(p, d, stiffness, iterations, interface):
    verdict = judge_law(ForwardDynamics(p, d, stiffness, iterations), Timing(500.0, 0.004, interface))
    assert all(math.isfinite(end) for ends in verdict.ranges for end in ends)


def test_what_is_called_stable_settles():
    law, timing = Admittance(3.0, 50.0, 2.8, 5.0, 0.995), Timing(125.0, 0.024)
    assert overshoot(law.loop(timing), [judge_law(law, timing).ranges[0][1] * 1.001])[0] == math.inf


COMMAND = ["certify", "a.yaml", "--controller", "ros2-admittance", "--delay", "24:ms"]


def test_the_command_writes_the_corrected_file_and_says_what_is_not_modelled(capsys):
    Path("a.yaml").write_text(ADMITTANCE)
    assert main([*COMMAND, "--stiffness", "500:20000", "--out", "b.yaml"]) == 1
    printed = capsys.readouterr().out
    (claim,) = [line for line in printed.splitlines() if "by eigenvalues" in line]
    assert "Not modelled: the other five axes" in claim
    assert "kinematics" in claim
    assert "saturation" in claim
    assert "94e74de35f9d" in printed
    assert "that the model does not use: admittance_controller.joints." in printed
    assert main([*COMMAND, "--stiffness", "500:20000", "--json"]) == 1
    before = json.loads(capsys.readouterr().out)
    assert main(["certify", "b.yaml", *COMMAND[2:], "--stiffness", "500:20000", "--json"]) == 0
    after = json.loads(capsys.readouterr().out)
    assert after["proved"]["stiffness"][1] > 2e4 > before["exact"]["stiffness"][1]
    assert before["source"]["commit"] == after["source"]["commit"]


def test_nothing_is_written_where_nothing_is_asked_or_a_file_is_refused(capsys):
    Path("a.yaml").write_text(ADMITTANCE)
    assert main([*COMMAND, "--out", "b.yaml"]) == 0
    assert "--stiffness LOW:HIGH" in capsys.readouterr().out
    Path("a.yaml").write_text(ADMITTANCE.replace("3.0, 3.0, 3.0", "none"))
    assert main([*COMMAND, "--out", "b.yaml"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not Path("b.yaml").exists()


@pytest.mark.parametrize("option", [["--delay", "24:ms"], ["--mass", "3:kg"]])
def test_options_of_another_controller_need_one(capsys, option):
    assert main(["certify", "gains.toml", *option]) == 2
    assert f"{option[0]} belongs to --controller" in capsys.readouterr().err
    Path("a.yaml").write_text(ADMITTANCE)
    assert main([*COMMAND, "--damping-time", "0:1"]) == 2
    assert "--damping-time belongs to tuned gains" in capsys.readouterr().err
