"""Bags as a recorder leaves them: topics, fields, streams."""

from __future__ import annotations

import builtins
import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest

from logs.ros_bags import BEGIN, KINDS, joints, pose, storage, wrench, write_bag
from palpate.errors import InputError
from palpate.logs import read_log, read_wrench_and_pose
from palpate.logs.bags import Bag
from palpate.logs.formats import kind_of

TIME = np.arange(200) / 100
FORCE = np.column_stack([0 * TIME, -TIME, np.sin(5 * TIME)])
PLACE = np.column_stack([TIME, 2 * TIME, np.cos(5 * TIME)])


def opened(path) -> Bag:
    return Bag(path, kind_of(path))


@pytest.fixture(params=KINDS, scope="module")
def bag(request, tmp_path_factory):
    sent = [wrench("/ft", TIME, FORCE), pose("/pose", TIME, PLACE)]
    sent.append(joints("/joints", TIME, ["lift", "turn"], PLACE[:, :2], FORCE[:, 1:]))
    return write_bag(tmp_path_factory.mktemp("bags") / "log.bag", request.param, sent, extra="/grip")


def test_topics_with_their_types(bag):
    with opened(bag) as log:
        topics = log.topics
    assert {name: (topic.kind, topic.count) for name, topic in topics.items()} == {
        "/ft": ("geometry_msgs/msg/WrenchStamped", 200),
        "/grip": ("my_msgs/msg/Grip", 5),
        "/joints": ("sensor_msgs/msg/JointState", 200),
        "/pose": ("geometry_msgs/msg/PoseStamped", 200),
    }
    assert all(topic.known for topic in topics.values())


def test_fields_over_time(bag):
    with opened(bag) as log:
        streams, begin = log.streams(
            {"/ft": ["wrench.force.z", "wrench.force.y"], "/joints": ["effort.turn"]}
        )
    assert begin == BEGIN / 1e9
    np.testing.assert_allclose(streams["/ft"].values, FORCE[:, [2, 1]])
    np.testing.assert_allclose(streams["/joints"].values[:, 0], FORCE[:, 2])
    np.testing.assert_allclose(streams["/ft"].stamped, TIME, atol=1e-8)
    np.testing.assert_allclose(streams["/ft"].received, TIME, atol=1e-8)
    assert streams["/ft"].frame == "tool0"


def test_a_file_is_known_by_what_it_holds_and_not_by_its_name(bag, tmp_path):
    other = tmp_path / "copy.of.it"
    shutil.copy(storage(bag), other)
    with opened(other) as copy, opened(bag) as log:
        assert set(copy.topics) == set(log.topics)


def test_a_type_that_the_bag_defines_itself_is_read(bag):
    with opened(bag) as log:
        streams, _ = log.streams({"/grip": ["grip", "load.right", "load.0"]})
    np.testing.assert_allclose(streams["/grip"].values[:, 0], 0.5 * np.arange(5))
    np.testing.assert_allclose(streams["/grip"].values[:, 1], 2.0 * np.arange(5))
    np.testing.assert_allclose(streams["/grip"].values[:, 2], 1.0 * np.arange(5))


def test_one_axis_of_two_topics(bag):
    record = read_log(bag, position="/pose.pose.position.z:mm", force="/ft.wrench.force.z")
    np.testing.assert_allclose(record["position"], 1e-3 * PLACE[:, 2], atol=1e-9)
    np.testing.assert_allclose(record["force"], FORCE[:, 2], atol=1e-6)
    assert record.units == {"time": "s", "position": "m", "force": "N"}
    assert record.meta["facts"] == ["timed by the stamps in their headers"]
    assert record.meta["start_s"] == pytest.approx(BEGIN / 1e9)


def test_a_joint_by_its_name_says_what_unit_it_took(bag):
    record = read_log(bag, position="/joints.position.lift", force="/joints.effort.lift:kN")
    np.testing.assert_allclose(record["force"], 1e3 * FORCE[:, 1])
    assert [note["code"] for note in record.meta["notes"]] == ["unit-guess"]
    turned = read_log(bag, position="/joints.position.turn:deg", force="/joints.effort.turn:Nm")
    assert turned.units == {"time": "s", "position": "rad", "force": "N m"}
    assert turned.meta["notes"] == []


def test_wrench_and_pose_are_taken_if_they_are_the_only_ones(bag):
    record = read_wrench_and_pose(bag)
    np.testing.assert_allclose(record["force_z"], FORCE[:, 2])
    np.testing.assert_allclose(record["position_y"], PLACE[:, 1], atol=1e-9)
    np.testing.assert_allclose(record["quaternion_w"], 1.0)
    assert record.meta["facts"][0] == "wrench of /ft, pose of /pose"
    assert record.meta["frames"]["force_x"] == "tool0"
    assert record.meta["frames"]["position_x"] == "base"
    assert record.units["torque_x"] == "N m"


def test_two_wrenches_are_not_chosen_between(tmp_path):
    sent = [wrench("/ft", TIME, FORCE), wrench("/hand", TIME, -FORCE), pose("/pose", TIME, PLACE)]
    path = write_bag(tmp_path / "log", "mcap", sent)
    with pytest.raises(InputError, match=r"name the wrench of .* \(there are /ft, /hand\)"):
        read_wrench_and_pose(path)
    assert read_wrench_and_pose(path, wrench="/hand")["force_z"][50] == pytest.approx(-FORCE[50, 2])


def test_components_by_name(bag):
    record = read_wrench_and_pose(
        bag,
        wrench="/ft.wrench.force.x,/ft.wrench.force.y,/ft.wrench.force.z:kN",
        pose="/pose.pose.position.x:mm,/pose.pose.position.y:mm,/pose.pose.position.z:mm",
    )
    np.testing.assert_allclose(record["force_z"], 1e3 * FORCE[:, 2])
    np.testing.assert_allclose(record["position_x"], 1e-3 * PLACE[:, 0], atol=1e-9)
    assert "quaternion_x" not in record.columns


def test_a_joint_that_some_messages_leave_out(tmp_path):
    """Several publishers share /joint_states, and each names its own joints."""
    sent = [
        joints("/joints", TIME, ["arm"], PLACE[:, :1], FORCE[:, 2:]),
        joints("/joints", TIME + 0.003, ["hand"], PLACE[:, 1:2], FORCE[:, 1:2]),
    ]
    record = read_log(
        write_bag(tmp_path / "log", "mcap", sent),
        position="/joints.position.arm:m",
        force="/joints.effort.arm:N",
    )
    np.testing.assert_allclose(record["force"], FORCE[:, 2])
    assert "200 of 400 messages of /joints hold no reading" in record.meta["notes"][0]["text"]


def test_a_bag_of_before_2023_has_no_definitions(tmp_path):
    path = write_bag(tmp_path / "log", "sqlite", [wrench("/ft", TIME, FORCE)], extra="/grip")
    with closing(sqlite3.connect(storage(path), isolation_level=None)) as database:
        database.execute("DELETE FROM message_definitions")
    with opened(path) as bag:
        assert bag.topics["/ft"].known
        assert not bag.topics["/grip"].known
        with pytest.raises(
            InputError, match="the type of /grip, my_msgs/msg/Grip, is not defined in the bag"
        ):
            bag.streams({"/grip": ["grip"]})


def test_a_folder_without_its_metadata(tmp_path):
    path = write_bag(tmp_path / "log", "mcap", [wrench("/ft", TIME, FORCE)])
    (path / "metadata.yaml").unlink()
    with opened(path) as bag:
        assert bag.topics["/ft"].count == 200
        assert "one by one" in bag.troubles[0]


WRONG = {
    "topic": ({"force": "/ftt.wrench.force.z"}, "unknown topic '/ftt'; did you mean '/ft'"),
    "field": (
        {"force": "/ft.wrench.force.zz"},
        "/ft: unknown field 'wrench.force.zz'; did you mean 'wrench.force.z'",
    ),
    "no field": ({"force": "/ft"}, "force needs a field of /ft"),
    "not a number": ({"force": "/ft.header.frame_id"}, "/ft: unknown field"),
    "a part": ({"force": "/ft.wrench.force"}, "/ft: unknown field"),
    "joint": ({"force": "/joints.effort.elbow"}, r"unknown field 'effort\.elbow'.*effort\.lift"),
    "place": ({"force": "/joints.effort.7"}, r"unknown field 'effort\.7'"),
    "unit": ({"force": "/ft.wrench.force.z:mm"}, "unit of length; force needs one of force"),
    "one twice": ({"force": "/pose.pose.position.z"}, "force and position cannot be the same column"),
    "time": ({"force": "/ft.wrench.force.z", "time": "/ft.header.stamp"}, "leave out --time"),
    "rate": ({"force": "/ft.wrench.force.z", "rate": 100.0}, "leave out --rate"),
    "missing": ({"force": "/ft.wrench.force.z", "missing": ["NA"]}, "--missing needs numbers"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_wrong_words(bag, kind):
    said, words = WRONG[kind]
    with pytest.raises(InputError, match=words) as caught:
        read_log(bag, position="/pose.pose.position.z", **said)
    assert "\n" not in str(caught.value)


WRONG_TOPICS = {
    "a pose as wrench": (
        {"wrench": "/pose"},
        "/pose is a geometry_msgs/msg/PoseStamped, which palpate does not know",
    ),
    "joints as pose": ({"pose": "/joints"}, "does not know as a pose"),
    "too few": ({"wrench": "/ft.wrench.force.x,/ft.wrench.force.y"}, "got 2 columns"),
}


@pytest.mark.parametrize("kind", WRONG_TOPICS)
def test_wrong_topics(bag, kind):
    said, words = WRONG_TOPICS[kind]
    with pytest.raises(InputError, match=words):
        read_wrench_and_pose(bag, **said)


def test_a_bag_without_messages(tmp_path):
    path = write_bag(tmp_path / "log", "mcap", [wrench("/ft", TIME[:0], FORCE[:0])])
    with pytest.raises(InputError, match="holds no messages"):
        opened(path)


def test_a_topic_without_messages(tmp_path):
    sent = [wrench("/ft", TIME[:0], FORCE[:0]), pose("/pose", TIME, PLACE)]
    path = write_bag(tmp_path / "log", "mcap", sent)
    with pytest.raises(InputError, match="no message came on /ft"), opened(path) as bag:
        bag.streams({"/ft": ["wrench.force.z"]})


def test_without_the_library_its_extra_is_named(bag, monkeypatch):
    plain = builtins.__import__

    def without(name, *rest):
        if name.startswith("rosbags"):
            raise ImportError(name)
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"\.\[bags\]"):
        opened(bag)
