"""A tool weighed by turning it: right, with intervals that hold, and refused where the poses do not tell."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from contact_frame.turning_tool import Tool, log_of, six
from palpate.contact_frame import ContactFrame, load_payload, weigh
from palpate.errors import InputError
from palpate.records import Record

TOOL = ContactFrame(wrench_frame="tool")


def codes(found):
    return {note["code"] for note in found.notes}


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_all_numbers_of_a_tool_are_found(side):
    tool = Tool(side=side, drift=(0.05, 0.0, -0.02))
    found = weigh(log_of(tool, six(), np.random.default_rng(0), shaken=4.0), TOOL)
    assert not found.lacking
    truth = {
        "mass": 0.8,
        "centre": tool.centre,
        "drift": tool.drift,
        "inertia": 0.8,
        "torque_bias": tool.torque_bias,
    }
    for name, value in truth.items():
        one = found.parameters[name]
        # Twice the interval: twelve numbers, of which one in twenty may lie outside of it.
        assert np.all(np.abs(one.value - value) < 2 * one.half), name
    assert found.parameters["mass"].half < 0.01
    assert found.parameters["centre"].half.max() < 0.001
    assert found.payload.noise == pytest.approx(tool.noise, rel=0.05)
    assert found.payload.weight[2] * side < 0
    assert not found.notes


@pytest.mark.long
def test_the_intervals_hold_the_truth_where_each_orientation_errs_in_its_own_way():
    rng = np.random.default_rng(1)
    inside = {"mass": [], "weight": [], "centre": []}
    for _ in range(10):
        tool = Tool(uneven=0.2, noise=0.3)
        found = weigh(log_of(tool, six(), rng), TOOL)
        for name, value in {"mass": 0.8, "weight": [0, 0, 0.8 * 9.80665], "centre": tool.centre}.items():
            inside[name] += list(
                np.atleast_1d(np.abs(found.parameters[name].value - value) <= found.parameters[name].half)
            )
    # Of 10 masses at 95 % seven and fewer come by chance once in a thousand, of 30 numbers 25 and fewer.
    assert np.mean(inside["mass"]) > 0.7
    assert np.mean(inside["weight"]) > 0.8
    assert np.mean(inside["centre"]) > 0.8


@pytest.mark.parametrize(
    ("turns", "says"),
    [
        (Rotation.from_rotvec(np.zeros((4, 3))), "hardly turns"),
        (Rotation.from_rotvec(np.outer(np.linspace(0, 2.5, 6), [0, 0, 1])), "along (0, 0, 1) of the base"),
        (six()[:3], "turn the tool by 30 deg and more about"),
    ],
)
def test_poses_that_do_not_tell_are_refused_and_the_direction_is_named(turns, says):
    found = weigh(log_of(Tool(), turns, np.random.default_rng(2)), TOOL)
    assert found.payload is None
    assert says in found.lacking[0]


def test_an_inertia_taken_off_with_the_wrong_sign_is_named():
    rng = np.random.default_rng(3)
    wrong = weigh(log_of(Tool(taken_off=2.0), six(), rng, shaken=4.0), TOOL)
    assert codes(wrong) == {"tool-inertia"}
    assert wrong.parameters["inertia"].value == pytest.approx(-0.8, abs=0.02)
    right = weigh(log_of(Tool(taken_off=1.0), six(), rng, shaken=4.0), TOOL)
    assert not right.notes
    assert right.payload.inertia == pytest.approx(0.0, abs=0.02)


def test_axes_that_are_turned_are_named_with_their_angles():
    tool = Tool(sensor=Rotation.from_euler("xyz", [0, 0, 45], degrees=True), taken_off=1.0)
    record = log_of(tool, six(), np.random.default_rng(4))
    found = weigh(record, TOOL)
    (note,) = [note for note in found.notes if note["code"] == "pose-frame"]
    angles = [float(a) for a in note["text"].rpartition(" ")[2].split(",")]
    assert angles == pytest.approx([0, 0, 45], abs=2)
    told = ContactFrame(wrench_frame="sensor", sensor_rpy=(0.0, 0.0, np.pi / 4))
    mended = weigh(record, told)
    assert not mended.notes
    assert mended.parameters["mass"].value == pytest.approx(0.8, abs=0.005)


def test_a_pose_of_the_base_in_the_tool_is_named():
    # Turned about x and y alone, an inverse is the same as a sensor turned by 180 degrees about z.
    turns = six() * Rotation.from_rotvec(np.outer([0.0, 0.5, 1.0, -0.8, 0.3, -0.4, 0.0], [0, 0, 1]))
    record = log_of(Tool(taken_off=1.0), turns, np.random.default_rng(5))
    columns = dict(record.columns)
    for axis in "xyz":
        columns[f"quaternion_{axis}"] = -columns[f"quaternion_{axis}"]
    # Weight and bias then change their parts, as they do where the wrench is in the base's axes: both are named.
    found = weigh(Record(columns, record.units), TOOL)
    assert any("give its inverse" in note["text"] for note in found.notes)


def test_a_touch_and_a_saturated_axis_are_named():
    record = log_of(Tool(taken_off=1.0), six(), np.random.default_rng(6))
    time = record["time"]
    touched = record["force_z"] + np.where((time > 4.6) & (time < 5.4), 12.0, 0.0)
    found = weigh(Record({**record.columns, "force_z": touched}, record.units), TOOL)
    (note,) = [note for note in found.notes if note["code"] == "not-free"]
    assert "from 4." in note["text"]
    clipped = np.clip(record["force_z"], None, 10.0)
    assert "saturated" in codes(weigh(Record({**record.columns, "force_z": clipped}, record.units), TOOL))


def test_a_pose_without_orientation_is_refused():
    record = log_of(Tool(), six(), np.random.default_rng(7))
    plain = {name: column for name, column in record.columns.items() if not name.startswith("quaternion")}
    with pytest.raises(InputError, match="turning it"):
        weigh(Record(plain, dict.fromkeys(plain, "1")), ContactFrame())


def test_the_file_is_read_back_as_it_was_written(tmp_path):
    found = weigh(log_of(Tool(), six(), np.random.default_rng(8), shaken=4.0), TOOL)
    found.payload.save(tmp_path / "tool.toml")
    assert load_payload(tmp_path / "tool.toml") == found.payload


@pytest.mark.parametrize(
    "text", ["mass = -1", "mass = 1", "mass = 'a'", "nonsense", 'wrench_frame = "moon"', "mass = nan", ""]
)
def test_a_spoiled_file_is_refused(tmp_path, text):
    (tmp_path / "tool.toml").write_text(text)
    with pytest.raises(InputError, match=r"tool\.toml"):
        load_payload(tmp_path / "tool.toml")
