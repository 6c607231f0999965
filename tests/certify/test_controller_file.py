"""Parameter files of other projects: what is read, what is refused and why, and files that no person writes."""

from __future__ import annotations

import time

import pytest

from palpate.certify.controller_file import (
    SECTIONS,
    admittance_axes,
    crisp_axes,
    franka_axes,
    fzi_axes,
    named,
    node_interface,
    node_rate,
    read_controllers,
)
from palpate.certify.upstream_laws import Admittance, CartesianImpedance, ForwardDynamics
from palpate.errors import InputError

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
    admittance:
      selected_axes: [true, true, false, true, true, true]
      mass: [3.0, 3.5, 3.0, 0.05, 0.05, 0.05]
      damping_ratio: [2.8, 2.8, 2.8, 2.8, 2.8, 2.8] # D / (2 * sqrt(M * S))
      stiffness: [50.0, 0.0, 50.0, 1.0, 1.0, 1.0]
other_controller: {ros__parameters: {gains: {p: 77.5}}}
"""
FORCE = """\
controller_manager: {ros__parameters: {update_rate: 500}}
force:
  ros__parameters:
    ft_sensor_ref_link: sensor
    command_interfaces: [velocity]
    solver: {error_scale: 0.5, iterations: 3, forward_dynamics: {link_mass: 0.5}}
    pd_gains: {trans_x: {p: 0.5}, trans_y: {p: 0.4, d: 0.01}}
"""
COMPLIANCE = FORCE.replace("velocity", "position").replace(
    "solver:", "stiffness: {trans_x: 140}\n    solver:"
)
CRISP = "task.k_pos_x: 400.0\ntask.d_pos_x: 30.0\ntask.k_pos_y: 0.0\ntask.k_rot_x: 0.0\n"


def read(folder, text, controller):
    path = folder / "a.yaml"
    path.write_text(text)
    return read_controllers(path, controller)


def test_an_admittance_has_its_filter_and_joint_damping(tmp_path):
    file = read(tmp_path, ADMITTANCE, "ros2-admittance")
    (node,) = file.nodes
    x, y, z = admittance_axes(node)
    assert x.law == Admittance(3.0, 50.0, 2.8, 5.0, 0.995)
    assert y.law == Admittance(3.5, 0.0, 2.8, 5.0, 0.995)
    assert "stiffness 0 makes D" in y.reason
    assert z.law is None
    assert node.defaults == {"admittance.joint_damping": 5.0}
    assert (node_rate(node, file.rate), node_interface(node)) == (125.0, "position")
    assert set(node.unused) == {
        "joints", "kinematics.plugin_name", "kinematics.base", "kinematics.tip", "kinematics.alpha",
        "ft_sensor.name", "ft_sensor.frame.id", "ft_sensor.frame.external",
    }  # fmt: skip
    assert file.other == ["controller_manager.admittance_controller.type", "other_controller.gains.p"]


def test_iterations_count_in_the_compliance_controller_alone(tmp_path):
    (force,), (compliance,) = (read(tmp_path, text, "fzi").nodes for text in (FORCE, COMPLIANCE))
    assert [axis.law for axis in fzi_axes(force)] == [
        ForwardDynamics(0.25, 0.0), ForwardDynamics(0.2, 0.005), None,
    ]  # fmt: skip
    assert fzi_axes(compliance)[0].law == ForwardDynamics(0.25, 0.0, 140.0, 3)
    assert fzi_axes(compliance)[1].law == ForwardDynamics(0.2, 0.005, 500.0, 3)
    assert "solver.forward_dynamics.link_mass" in force.unused
    assert node_interface(force) == "velocity"


def test_flat_and_nested_files_of_an_impedance_are_alike(tmp_path):
    nested = "/**:\n  ros__parameters: {task: {k_pos_x: 400.0, d_pos_x: 30.0, k_pos_y: 0.0, k_rot_x: 0.0}}\n"
    for text in (CRISP, nested):
        (node,) = read(tmp_path, text, "crisp").nodes
        x, y, z = crisp_axes(node, 3.0)
        assert x.law == CartesianImpedance(400.0, 30.0, 3.0)
        assert y.law is None, "no stiffness makes no damping"
        assert z.law == CartesianImpedance(500.0, 2.0 * 500.0**0.5, 3.0), "damping -1 is 2 sqrt(k)"
        assert node.unused == ["task.k_rot_x"]


def test_the_joints_of_an_impedance_without_weights_are_not_driven(tmp_path):
    still = CRISP + "nullspace.projector_type: none\nnullspace.stiffness: 0.0\nnullspace.damping: 0.0\n"
    (node,) = read(tmp_path, still, "crisp").nodes
    assert crisp_axes(node, 3.0)[0].law is not None


def test_the_impedance_of_franka_is_damped_as_if_it_were_one_kilogram(tmp_path):
    (node,) = read(tmp_path, "translational_stiffness: 225.0\nnullspace_stiffness: 0.5\n", "franka").nodes
    assert franka_axes(node, 4.0)[2].law == CartesianImpedance(225.0, 30.0, 4.0)


def laws(controller):
    return {
        "ros2-admittance": admittance_axes,
        "fzi": lambda node: (fzi_axes(node), node_interface(node)),
        "crisp": lambda node: crisp_axes(node, 3.0),
        "franka": lambda node: franka_axes(node, 3.0),
    }[controller]


REFUSED = [
    ("ros2-admittance", ADMITTANCE.replace("[3.0, 3.5,", "[3.5,"), "admittance.mass must be six numbers"),
    ("ros2-admittance", ADMITTANCE.replace("3.5", "yes please"), "admittance.mass[1] must be a number"),
    ("ros2-admittance", ADMITTANCE.replace("3.5", ".nan"), "admittance.mass[1] must be a number, got nan"),
    ("ros2-admittance", ADMITTANCE.replace("3.5", "0.0"), "must be from 0.0001 to 1e+06, as its source checks"),
    ("ros2-admittance", ADMITTANCE.replace("50.0, 0.0", "50.0, -1.0"), "admittance.stiffness[1] must be from 0"),
    ("ros2-admittance", ADMITTANCE.replace("mass: [3.0, 3.5, 3.0, 0.05, 0.05, 0.05]", "mass: {x: 3.0}"), "older"),
    ("ros2-admittance", ADMITTANCE.replace("true, true, false", "true"), "selected_axes must be six"),
    ("fzi", FORCE.replace("solver:", "ik_solver: damped_least_squares\n    solver:"), "damped_least_squares is not"),
    ("fzi", FORCE.replace("ft_sensor_ref_link: sensor", "a: b"), "a motion controller does not measure the force"),
    ("fzi", FORCE.replace("[velocity]", "[effort]"), "command_interfaces must be [position] or [velocity]"),
    ("fzi", FORCE.replace("    command_interfaces: [velocity]\n", ""), "command_interfaces must be"),
    ("fzi", COMPLIANCE.replace("iterations: 3", "iterations: 2.5"), "must be a whole number"),
    ("fzi", COMPLIANCE.replace("iterations: 3", "iterations: 1000"), "solver.iterations must be from 1 to 100"),
    ("fzi", FORCE.replace("pd_gains", "pid_gains"), "pid_gains is of an older controller"),
    ("crisp", CRISP.replace("400.0", "9000.0"), "task.k_pos_x must be from 0 to 5000"),
    ("crisp", CRISP + "stop_commands: true\n", "commands no torque"),
    ("crisp", CRISP + "use_operational_space: 1\n", "must be true or false, got 1"),
    ("crisp", CRISP + "nullspace.projector_type: none\n", "torques in joint space"),
    ("franka", "translational_stiffness: 900.0\n", "must be from 0 to 400"),
    ("ur", CRISP, "not published"),
    ("other", CRISP, "unknown controller 'other'"),
]  # fmt: skip


@pytest.mark.parametrize(("controller", "text", "says"), REFUSED)
def test_what_is_not_modelled_is_refused_in_one_line_with_its_reason(tmp_path, controller, text, says):
    with pytest.raises(InputError) as error:
        for node in read(tmp_path, text, controller).nodes:
            laws(controller)(node)
    assert says in str(error.value)
    assert str(error.value).isprintable()


def test_a_controller_of_ros_1_has_its_interface_in_its_type(tmp_path):
    kind = "type: velocity_controllers/CartesianForceController"
    text = FORCE.replace("command_interfaces: [velocity]", kind)
    assert node_interface(read(tmp_path, text, "fzi").nodes[0]) == "velocity"


def test_a_rate_of_the_controller_itself_comes_before_that_of_its_manager(tmp_path):
    file = read(tmp_path, FORCE.replace("solver:", "update_rate: 250\n    solver:"), "fzi")
    assert node_rate(file.nodes[0], file.rate) == 250.0
    two = read(tmp_path, FORCE + "b: {ros__parameters: {update_rate: 100}}\n", "fzi")
    assert node_rate(two.nodes[0], two.rate) is None, "two rates are none"


@pytest.mark.parametrize("controller", SECTIONS)
@pytest.mark.parametrize("text", ["a: 1", "joint_trajectory_controller: {gains: {p: 1.0}}", "{}"])
def test_a_file_of_another_controller_is_named_so(tmp_path, controller, text):
    with pytest.raises(InputError, match=f"no settings of {controller}|no parameter file"):
        read(tmp_path, text, controller)


def test_names_that_differ_in_their_last_word_share_a_line():
    assert named(["a.b.c", "a.b.d", "e"]) == "a.b.(c, d), e"


DOUBLED = [f"a{i}: &a{i} {{b: *a{i - 1}, c: *a{i - 1}}}" for i in range(1, 28)]
BOMB = "\n".join(["a0: &a0 {task: 1}", *DOUBLED])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: [1", "no YAML"),
        ("- 1", "no parameter file"),
        ("", "no parameter file"),
        ("a: &a {b: *a, task: 1}", "32 levels"),
        ("a: &a [*a]\ntask: {k_pos_x: x}", "task.k_pos_x must be a number"),
        ("task: " + "{a: " * 40 + "1" + "}" * 40, "32 levels"),
        ("\n".join(f"task.k{i}: {i}" for i in range(20_000)), "10000 entries"),
        (BOMB, "10000 entries"),
        ("task: {k_pos_x: !!binary aGk=, k_pos_y: 2020-01-01}", "task.k_pos_x must be a number, got b'hi'"),
        ("task: {k_pos_x: \"a\\nb\\e[31m\"}", "must be a number, got a b"),
        ("task: {k_pos_x: " + "x" * 500 + "}", "must be a number, got xxx"),
        ("task: {k_pos_x: .inf}", "must be a number, got inf"),
        ("task: {k_pos_x: 1" + "0" * 400 + "}", "task.k_pos_x must be"),
    ],
)  # fmt: skip
def test_files_that_no_person_writes_are_refused_in_one_line_and_at_once(tmp_path, text, says):
    begun = time.process_time()
    with pytest.raises(InputError) as error:
        crisp_axes(read(tmp_path, text, "crisp").nodes[0], 3.0)
    assert time.process_time() - begun < 10.0
    line = str(error.value)
    assert says in line
    assert line.isprintable()
    assert "x" * 101 not in line
