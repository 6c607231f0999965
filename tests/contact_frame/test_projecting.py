"""A known press, put into any world, comes back out of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from contact_frame.synthetic_arm import World, any_world, log_of
from identification.synthetic_contacts import pressed
from palpate.contact_frame import ContactFrame, identify_contact, project
from palpate.errors import InputError
from palpate.identification import Verdict
from palpate.records import Record


def frame_of(world: World, **said) -> ContactFrame:
    turned = tuple(world.sensor.as_euler("xyz")) if world.frame == "sensor" else None
    return ContactFrame(wrench_frame=world.frame, sensor_rpy=turned, tcp=tuple(world.tcp), **said)


def without(record: Record, *families: str) -> Record:
    kept = {name: column for name, column in record.columns.items() if name.partition("_")[0] not in families}
    return Record(kept, dict.fromkeys(kept, "1"), record.meta)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(n, marks=pytest.mark.long) for n in range(2, 6))])
def test_the_press_comes_back_whatever_the_axes_lever_arms_signs_and_loads(seed):
    rng = np.random.default_rng(seed)
    world = any_world(rng)
    found, along = identify_contact(log_of(world, rng, seed=seed), frame_of(world))
    about = along.meta["contact_frame"]
    assert found.parameters["K"].verdict is Verdict.IDENTIFIED
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.03)
    damping = found.parameters["B"]
    assert damping.verdict is not Verdict.IDENTIFIED or damping.ci95[0] < 40 < damping.ci95[1]
    low, high = found.parameters["K"].ci95
    assert (
        abs(found.parameters["K"].value - 5000) < 1.5 * (high - low) / 2
    )  # once in twenty beyond, not by half
    assert about["force_sign"] == ("action" if world.sign > 0 else "reaction")
    assert np.array(about["normal"]) @ world.normal > np.cos(5 * about["normal_std_rad"])
    assert about["weight_N"] == pytest.approx(world.weight, abs=6 * about["weight_std_N"])
    bias = world.sensor.apply(world.bias)
    assert about["bias_N"] == pytest.approx(bias, abs=6 * about["weight_std_N"])


def test_the_force_and_the_position_are_those_of_one_axis():
    """Without noise the projection is exact but for the offset, and for the bridged rotation of the turning tool."""
    rng = np.random.default_rng(3)
    world = any_world(rng, turns=False, noise=0.0, weight=np.zeros(3), slip=np.zeros(3))
    along = project(log_of(world, rng), frame_of(world, normal=tuple(world.normal)))
    flat = pressed(n=4000, noise=0.0)
    np.testing.assert_allclose(along["position"], flat["position"] - flat["position"][0], atol=1e-12)
    np.testing.assert_allclose(along["force"], flat["force"], atol=1e-9)


@pytest.mark.parametrize("axes", ["base", "tool"])
def test_a_normal_that_is_given_is_taken(axes):
    rng = np.random.default_rng(4)
    world = any_world(rng)
    given = world.normal if axes == "base" else world.turn.inv().apply(world.normal)
    along = project(log_of(world, rng), frame_of(world, normal=tuple(3 * given), normal_frame=axes))
    assert along.meta["contact_frame"]["normal"] == pytest.approx(world.normal, abs=1e-9)
    assert along.meta["contact_frame"]["normal_std_rad"] == 0.0


def test_a_normal_that_points_out_is_turned_and_said():
    rng = np.random.default_rng(4)
    world = any_world(rng)
    along = project(log_of(world, rng), frame_of(world, normal=tuple(-world.normal)))
    assert along.meta["contact_frame"]["normal"] == pytest.approx(world.normal)
    assert "position-sign-reversed" in {note["code"] for note in along.meta["notes"]}


def test_a_wrong_sign_is_refused():
    rng = np.random.default_rng(5)
    world = any_world(rng, sign=-1.0)
    record = log_of(world, rng)
    with pytest.raises(InputError, match=r"declared to be the action, but falls.*--force-sign reaction"):
        project(record, frame_of(world, force_sign="action"))
    assert project(record, frame_of(world, force_sign="reaction"))["force"].max() > 5


def test_two_sensors_of_opposite_signs_say_the_same():
    rng = np.random.default_rng(6)
    world = any_world(rng, sign=1.0, noise=0.02)
    record = log_of(world, rng)
    other = Record(
        {name: -column if name.startswith("force") else column for name, column in record.columns.items()},
        record.units,
    )
    one, two = (project(r, frame_of(world)) for r in (record, other))
    np.testing.assert_allclose(one["force"], two["force"], atol=1e-9)
    assert {r.meta["contact_frame"]["force_sign"] for r in (one, two)} == {"action", "reaction"}


def test_free_motion_that_is_said_needs_no_finding():
    """Contact for most of the log, and a tool that tilts in it: only the user can say where it is free."""
    rng = np.random.default_rng(7)
    world = any_world(rng)
    record = log_of(world, rng)
    about = project(record, frame_of(world, free=(0.0, 1.0))).meta["contact_frame"]
    assert about["free_rows"] == 1000
    assert about["weight_N"] == pytest.approx(world.weight, abs=0.05)


def test_a_log_without_free_motion_says_what_it_cannot_tell():
    rng = np.random.default_rng(8)
    world = any_world(rng, turns=False)
    record = log_of(world, rng)
    rows = slice(700, 1900)
    held = Record({name: column[rows] for name, column in record.columns.items()}, record.units)
    found, along = identify_contact(held, frame_of(world))
    texts = [note["text"] for note in along.meta["notes"] if note["code"] == "contact-at-start"]
    assert any("cannot be told apart" in text for text in texts)
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.02)


def test_a_pose_without_orientation_serves_a_wrench_in_the_base():
    rng = np.random.default_rng(9)
    world = any_world(rng, frame="base", tcp=np.zeros(3), turns=False)
    record = without(log_of(world, rng), "quaternion")
    found, along = identify_contact(record)
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.03)
    assert "frame-guess" in {note["code"] for note in along.meta["notes"]}


NEEDS_A_TURN = {
    "tool": ContactFrame(wrench_frame="tool"),
    "lever arm": ContactFrame(wrench_frame="base", tcp=(0.0, 0.0, 0.1)),
    "normal": ContactFrame(wrench_frame="base", normal=(0.0, 0.0, 1.0), normal_frame="tool"),
}


@pytest.mark.parametrize("what", NEEDS_A_TURN)
def test_what_needs_an_orientation_is_refused_without_one(what):
    rng = np.random.default_rng(9)
    record = without(log_of(any_world(rng, frame="base"), rng), "quaternion")
    with pytest.raises(InputError, match="needs the pose's orientation"):
        project(record, NEEDS_A_TURN[what])


def test_a_log_without_a_whole_force_is_refused_in_one_line():
    world = any_world(np.random.default_rng(0))
    record = log_of(world, np.random.default_rng(0), seed=0)
    axis = np.full(len(record), np.nan)
    with pytest.raises(InputError, match="no row has a reading of all three axes"):
        project(Record({**record.columns, "force_z": axis}, record.units, record.meta), frame_of(world))


def test_axes_that_nobody_names_are_not_guessed():
    rng = np.random.default_rng(9)
    record = log_of(any_world(rng, frame="tool"), rng)
    with pytest.raises(InputError, match="say --wrench-frame base"):
        project(record, ContactFrame())
    frames = {"force_x": "base_link", "position_x": "base_link"}
    named = Record(record.columns, record.units, {"frames": frames})
    assert project(named, ContactFrame()).meta["contact_frame"]["wrench_frame"] == "base"
    named = Record(record.columns, record.units, {"frames": {**frames, "force_x": "tool0"}})
    assert project(named, ContactFrame()).meta["contact_frame"]["wrench_frame"] == "tool"


WRONG = {
    "sensor without turn": ({"wrench_frame": "sensor"}, "needs --sensor-rpy"),
    "turn without sensor": ({"wrench_frame": "tool", "sensor_rpy": (0.0, 0.0, 1.0)}, "no other frame"),
    "no length": ({"normal": (0.0, 0.0, 0.0)}, "must have a length"),
    "backwards": ({"free": (2.0, 1.0)}, "must end after it begins"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_contradictions_are_refused(kind):
    said, words = WRONG[kind]
    with pytest.raises(InputError, match=words):
        ContactFrame(**said)


def test_quaternions_of_no_length_are_refused():
    rng = np.random.default_rng(9)
    record = log_of(any_world(rng, frame="tool"), rng)
    columns = dict(record.columns) | {"quaternion_w": record["quaternion_w"] + 2}
    with pytest.raises(InputError, match="length 1"):
        project(Record(columns, record.units), ContactFrame(wrench_frame="tool"))


def test_a_free_stretch_outside_the_log_is_refused():
    rng = np.random.default_rng(9)
    with pytest.raises(InputError, match="only 0 rows lie in the free stretch"):
        project(
            log_of(any_world(rng, frame="tool"), rng), ContactFrame(wrench_frame="tool", free=(90.0, 99.0))
        )


def test_rows_without_a_reading_are_left_out():
    rng = np.random.default_rng(10)
    world = any_world(rng)
    record = log_of(world, rng)
    columns = {name: column.copy() for name, column in record.columns.items()}
    for name, column in columns.items():
        if name.startswith("force"):
            column[1::2] = np.nan
        elif name != "time":
            column[2::3] = np.nan
    found, along = identify_contact(Record(columns, record.units), frame_of(world))
    assert np.isnan(along["force"][1::2]).all()
    low, high = found.parameters["K"].ci95
    assert high - low < 0.05 * 5000
    assert (
        abs(found.parameters["K"].value - 5000) < 1.5 * (high - low) / 2
    )  # 3 of 1000 true intervals are farther off


def test_a_lever_arm_of_the_wrong_tool_shows_where_it_turns():
    """The tool tilts as it presses: the pose's origin does not move as the point that touches does."""
    rng = np.random.default_rng(11)
    world = any_world(rng, frame="base", turns=False, slip=np.zeros(3), tcp=np.array([0.0, 0.0, 0.2]))
    record = log_of(world, rng)
    tilt = Rotation.from_rotvec(
        np.outer(0.02 * np.sin(6 * record["time"]), np.cross(world.normal, [1.0, 0, 0]))
    )
    turn = tilt * world.turn
    place = np.column_stack([record[f"position_{a}"] for a in "xyz"]) + world.turn.apply(world.tcp)
    pose = place - turn.apply(world.tcp)
    columns = dict(record.columns)
    columns |= {f"position_{a}": pose[:, i] for i, a in enumerate("xyz")}
    columns |= {f"quaternion_{a}": turn.as_quat()[:, i] for i, a in enumerate("xyzw")}
    tilted = Record(columns, record.units)
    right = project(tilted, frame_of(world))["position"]
    wrong = project(tilted, ContactFrame(wrench_frame="base"))["position"]
    flat = pressed(n=4000, noise=0.0)["position"]
    assert np.std(right - flat) < 1e-6
    assert np.std(wrong - flat) > 1e-4
