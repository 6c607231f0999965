"""Corrected numbers of other projects' controllers, and the file that has them."""

import numpy as np
import pytest

from palpate.certify.controller_correction import (
    CorrectionError,
    correct_node,
    dump,
    is_acceptable,
    surfaces_between,
    with_changes,
)
from palpate.certify.controller_file import AxisLaw, find_controllers
from palpate.certify.discrete_loop import overshoot
from palpate.certify.upstream_laws import Admittance, CartesianImpedance, ForwardDynamics, Timing
from palpate.files import parse_yaml

NESTED = """\
a:
  ros__parameters:
    admittance: {mass: [1.0, 1.0], joint_damping: 5}
    name: "0x10"
b: {ros__parameters: {admittance.mass: [2.0]}}
"""


def changed(text, changes):
    file = find_controllers(parse_yaml(text, "a.yaml"), "a.yaml", "ros2-admittance")
    return parse_yaml(dump(with_changes(file, changes)), "a.yaml")


def test_values_change_in_their_place_and_nothing_else():
    file = changed(NESTED, {("a", "admittance", "mass"): [3.0, 1e-7], ("b", "admittance", "mass"): [4.0]})
    assert file["a"]["ros__parameters"]["admittance"] == {"mass": [3.0, 1e-7], "joint_damping": 5}
    assert file["a"]["ros__parameters"]["name"] == "0x10"
    assert file["b"]["ros__parameters"] == {"admittance.mass": [4.0]}
    assert "- 4.0\n" in dump({"a": [4.0]})  # a decimal point, which ROS 2 needs


def test_an_entry_that_the_file_lacks_is_added_to_its_controller():
    file = changed(NESTED, {("b", "admittance", "stiffness"): [1.0]})
    assert file["b"]["ros__parameters"] == {"admittance.mass": [2.0], "admittance.stiffness": [1.0]}
    assert "admittance.stiffness" not in file["a"]["ros__parameters"]


@pytest.mark.parametrize("seed", range(6))
def test_a_corrected_admittance_overshoots_little_between_the_surfaces_that_were_tried(seed):
    rng = np.random.default_rng(seed)
    law = Admittance(3.0, float(rng.uniform(0.0, 500.0)), 1.0, 5.0, float(rng.choice([0.05, 0.5, 1.0])))
    timing = Timing(float(rng.choice([125.0, 500.0])), float(rng.uniform(0.0, 0.03)))
    surfaces = (2e3, float(rng.uniform(1e4, 4e4)))
    text = "admittance: {mass: [3.0, 3.0], stiffness: [9.0, 9.0], damping_ratio: [1.0, 1.0]}"
    (node,) = find_controllers(parse_yaml(text, "a"), "a", "ros2-admittance").nodes
    changes = correct_node(node, [AxisLaw("x", law), AxisLaw("y", None)], timing, surfaces)
    better = law._replace(**{name.rpartition(".")[2]: values[0] for name, values in changes.items()})
    assert better.decay(timing.rate) < 2.0
    assert overshoot(better.loop(timing), rng.uniform(*surfaces, 40)).max() < 0.1
    assert all(values[1] in (3.0, 9.0, 1.0) for values in changes.values())  # an axis without a loop stays


def test_an_acceptable_law_is_left_as_it_is():
    law, timing = ForwardDynamics(1e-3, 0.0), Timing(500.0, 0.01, "velocity")
    assert is_acceptable(law, timing, (1e3, 1e4))
    assert correct_node(None, [AxisLaw("x", law)], timing, (1e3, 1e4)) == {}


def test_a_position_interface_that_repeats_its_motion_has_no_correction():
    (node,) = find_controllers({"pd_gains": {"trans_x": {"p": 0.05}}}, "a", "fzi").nodes
    with pytest.raises(CorrectionError, match="repeated every n ticks"):
        correct_node(node, [AxisLaw("x", ForwardDynamics(0.05, 0.0))], Timing(500.0, 0.01), (1e3, 1e4))


def test_an_impedance_is_damped_more_for_a_stiff_surface():
    (node,) = find_controllers({"task.k_pos_x": 600.0}, "a", "crisp").nodes
    law, timing, surfaces = CartesianImpedance(600.0, 20.0, 3.0), Timing(1000.0, 0.001, "torque"), (1e3, 2e4)
    damping = correct_node(node, [AxisLaw("x", law)], timing, surfaces)["task.d_pos_x"]
    assert damping > 20.0
    assert overshoot(law._replace(damping=damping).loop(timing), surfaces_between(*surfaces)).max() < 0.1
