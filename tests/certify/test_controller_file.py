"""Refusal of other projects' controllers: what is named, that nothing is written, and who runs away."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from palpate.certify.controller_file import LAWS, refuse_controller
from palpate.cli import main
from palpate.errors import InputError

AXES = ("x", "y", "z", "rx", "ry", "rz")
ADMITTANCE = """\
controller_manager:
  ros__parameters:
    update_rate: 125
    admittance_controller: {type: admittance_controller/AdmittanceController}
admittance_controller:
  ros__parameters:
    joints: [j1, j2, j3, j4, j5, j6]
    command_interfaces: [position]
    kinematics: {plugin_name: kdl, base: base_link, tip: tool0, alpha: 0.05}
    ft_sensor: {name: wrist, frame: {id: tool0, external: false}, filter_coefficient: 0.995}
    control: {frame: {id: tool0}}
    admittance:
      selected_axes: [true, true, true, true, true, true]
      mass: [3.0, 3.0, 3.0, 0.05, 0.05, 0.05]
      damping_ratio: [2.8, 2.8, 2.8, 2.8, 2.8, 2.8] # D / (2 * sqrt(M * S))
      stiffness: [50.0, 50.0, 50.0, 1.0, 1.0, 1.0]
      joint_damping: 5.0
other_controller: {ros__parameters: {gains: {p: 77.5}}}
"""
BARE = """\
admittance:
  mass: [5.5, 6.6, 7.7, 8.8, 9.9, 10.1]
  damping_ratio: [2.8, 2.8, 2.8, 2.8, 2.8, 2.8]
  stiffness: [214.1, 214.2, 214.3, 214.4, 214.5, 214.6]
"""
FORCE = """\
controller_manager: {ros__parameters: {update_rate: 500}}
force:
  ros__parameters:
    robot_base_link: base_link
    command_interfaces: [velocity]
    solver: {error_scale: 0.5, iterations: 3, forward_dynamics: {link_mass: 0.5}}
    pd_gains: {trans_x: {p: 0.5}, trans_y: {p: 0.4, d: 0.01}}
"""
COMPLIANCE = FORCE.replace("velocity", "position").replace(
    "solver:", "stiffness: {trans_x: 140}\n    solver:"
)
CRISP = (
    "a: {ros__parameters: {base_frame: base, task: {k_pos_x: 500.0, d_pos_x: 60.0}, use_friction: true}}\n"
)
DOTTED = "task.k_pos_x: 400.0\ntask.k_rot_x: 0.0\nuse_operational_space: true\nend_effector_frame: tool\n"
FRANKA = "arm_id: panda\ntranslational_stiffness: 200.0\nnullspace_stiffness: 0.5\n"
NO_RATE = ADMITTANCE.replace("update_rate: 125", "use_sim_time: true")
REFUSED = [
    ("ros2-admittance", ADMITTANCE, "controller_manager.update_rate 125"),
    ("ros2-admittance", ADMITTANCE, "ft_sensor.filter_coefficient 0.995"),
    ("ros2-admittance", ADMITTANCE, "admittance.joint_damping 5.0"),
    ("ros2-admittance", ADMITTANCE, "kinematics.alpha 0.05"),
    ("ros2-admittance", ADMITTANCE, "admittance.mass [3.0, 3.0, 3.0, 0.05, 0.05, 0.05]"),
    ("ros2-admittance", ADMITTANCE, "not used: joints, kinematics.base, kinematics.tip, ft_sensor.name"),
    ("ros2-admittance", ADMITTANCE.replace("50.0, 1.0", "0.0, 1.0"), "admittance.stiffness 0 along z makes D"),
    ("ros2-admittance", ADMITTANCE.replace("2.8", "121.5"), "it runs away along x (7.98), y (7.98), z (7.98)"),
    ("ros2-admittance", ADMITTANCE.replace("control:", "a_new_entry: 3\n    control:"), "a_new_entry 3"),
    ("ros2-admittance", NO_RATE, "update_rate the controller manager's"),
    ("ros2-admittance", "/ns:\n  /**:\n    " + BARE.replace("\n", "\n    "), "ft_sensor.filter_coefficient 0.05"),
    ("ros2-admittance", BARE, "left out, with the controller's default: update_rate"),
    ("ros2-admittance", BARE, "admittance.joint_damping 5"),
    ("ros2-admittance", BARE.replace("[5.5, 6.6, 7.7, 8.8, 9.9, 10.1]", "{x: 5.5}"), "admittance.mass.x 5.5"),
    ("ros2-admittance", "# Made by palpate certify.\n" + BARE, "nothing is proved or written"),
    ("fzi", FORCE, "accumulates its velocity in steps of 0.02 s"),
    ("fzi", FORCE, "pd_gains.trans_y.d 0.01"),
    ("fzi", FORCE, "solver.iterations 3"),
    ("fzi", FORCE.replace("iterations: 3, ", ""), "solver.iterations 1"),
    ("fzi", FORCE, "not used: robot_base_link"),
    ("fzi", COMPLIANCE, "stiffness.trans_x 140"),
    ("fzi", COMPLIANCE, "command_interfaces ['position']"),
    ("fzi", FORCE.replace("p: 0.5", "p: 0"), "pd_gains.trans_x.p 0"),
    ("crisp", CRISP, "task.k_pos_x 500.0"),
    ("crisp", CRISP, "use_friction true"),
    ("crisp", CRISP, "limit_torques true, max_delta_tau 0.5"),
    ("crisp", DOTTED, "task.k_rot_x 0.0, use_operational_space true"),
    ("franka", FRANKA, "translational_stiffness 200.0, nullspace_stiffness 0.5"),
    ("ur", BARE, "not published"),
]  # fmt: skip


@pytest.mark.parametrize(("controller", "text", "says"), REFUSED)
def test_each_entry_is_named_and_nothing_is_written(tmp_path, monkeypatch, capsys, controller, text, says):
    monkeypatch.chdir(tmp_path)
    for name, content in (("a.yaml", text), ("out.yaml", "earlier"), ("page.html", "earlier")):
        Path(name).write_text(content)
    words = ["certify", "a.yaml", "--controller", controller, "--delay", "24:ms", "--mass", "3:kg", "--json"]
    new = ["--out", "new.yaml", "--report", "new.html"]
    assert (
        main([*words, "--out", "out.yaml", "--replace", "--report", "page.html"]) == main([*words, *new]) == 2
    )
    printed = capsys.readouterr()
    assert not printed.out
    assert len(printed.err.splitlines()) == 2, "a line for each call"
    assert says in printed.err
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "a.yaml": text,
        "out.yaml": "earlier",
        "page.html": "earlier",
    }


def test_other_controllers_of_the_file_are_not_named(tmp_path):
    with pytest.raises(InputError) as error:
        refuse(tmp_path, ADMITTANCE, "ros2-admittance")
    assert "77.5" not in str(error.value)


def refuse(folder, text, controller):
    path = folder / "a.yaml"
    path.write_text(text)
    refuse_controller(path, controller)


def grows(mass, stiffness, ratio, joint_damping, rate):
    """Whether the rule, written from its source for one joint that moves one axis, grows in free motion.

    The joint follows at once, so a delay is no cause of it.
    """
    damping, h = 2.0 * ratio * np.sqrt(mass * stiffness), 1.0 / rate
    x, v = 0.0, 1e-4
    for _ in range(4000):
        v += h * ((-damping * v - stiffness * x) / mass - joint_damping * v)
        x += h * v
        if abs(v) > 1e3:
            return True
    return False


def test_an_axis_that_is_said_to_run_away_does(tmp_path):
    rng, named, growing = np.random.default_rng(3), 0, 0
    for _ in range(60):
        mass, stiffness = np.exp(rng.uniform(np.log([0.1, 1.0]), np.log([30.0, 2000.0])))
        ratio, joint_damping, rate = np.exp(rng.uniform(np.log([0.5, 0.1, 50]), np.log([200.0, 20.0, 1000])))
        lists = {"mass": mass, "stiffness": stiffness, "damping_ratio": ratio}
        rows = "".join(f"  {name}: {[float(value)] * 6}\n" for name, value in lists.items())
        text = f"update_rate: {rate}\nadmittance:\n{rows}  joint_damping: {joint_damping}\n"
        with pytest.raises(InputError) as error:
            refuse(tmp_path, text, "ros2-admittance")
        said, does = "it runs away" in str(error.value), grows(mass, stiffness, ratio, joint_damping, rate)
        assert does or not said, text
        named, growing = named + said, growing + does
    assert 10 < named <= growing < 50


@pytest.mark.parametrize("controller", LAWS)
@pytest.mark.parametrize("text", ["a: 1", "joint_trajectory_controller: {gains: {p: 1.0}}", "{}"])
def test_a_file_of_another_controller_is_named_so(tmp_path, controller, text):
    with pytest.raises(InputError, match=f"no settings of {controller}|no parameter file"):
        refuse(tmp_path, text, controller)


DOUBLED = [f"a{i}: &a{i} {{b: *a{i - 1}, c: *a{i - 1}}}" for i in range(1, 28)]
BOMB = "\n".join(["a0: &a0 {task: 1}", *DOUBLED])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: [1", "no YAML"),
        ("- 1", "no parameter file"),
        ("", "no parameter file"),
        ("a: &a {b: *a, task: 1}", "32 levels"),
        ("a: &a [*a]\ntask: {k_pos_x: 1}", "task.k_pos_x 1"),
        ("task: " + "{a: " * 40 + "1" + "}" * 40, "32 levels"),
        ("\n".join(f"task.k{i}: {i}" for i in range(20_000)), "10000 entries"),
        (BOMB, "10000 entries"),
        ("task: {k_pos_x: !!binary aGk=, k_pos_y: 2020-01-01, k: .nan}", "k_pos_y 2020-01-01, task.k nan"),
        ("task: {k: \"a\\nb\\e[31m\", long: " + "x" * 500 + "}", "task.k a b"),
    ],
)  # fmt: skip
def test_files_that_no_person_writes_are_refused_in_one_line_and_at_once(tmp_path, text, says):
    begun = time.process_time()
    with pytest.raises(InputError) as error:
        refuse(tmp_path, text, "crisp")
    assert time.process_time() - begun < 10.0
    line = str(error.value)
    assert says in line
    assert line.isprintable()
    assert "x" * 101 not in line


@pytest.mark.parametrize("option", [["--delay", "24:ms"], ["--mass", "3:kg"], ["--report", "page.html"]])
def test_options_of_another_controller_need_one(tmp_path, monkeypatch, capsys, option):
    monkeypatch.chdir(tmp_path)
    assert main(["certify", "gains.toml", *option]) == 2
    assert f"{option[0]} is of --controller" in capsys.readouterr().err
    assert main(["certify", "a.yaml", "--controller", "other"]) == 2
    assert "unknown controller 'other'" in capsys.readouterr().err
