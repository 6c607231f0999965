"""A press under ROS 2 over DDS itself, with an arm in another process; and the bytes of the messages."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate.logs import read_record
from wires.slow_cell import ALONE, DOMAIN, REHEARSAL, WORDS, child

pytest.importorskip("cyclonedds", reason="cyclonedds has no wheel for this system")


@contextmanager
def node(folder, *words):
    where = ("--domain", DOMAIN, "--arm", folder / "arm.toml", "--stiffness", 4000, "--seconds", 60)
    with child(REHEARSAL / "ros2_arm.py", *where, *words, CYCLONEDDS_URI=ALONE) as (process, line):
        assert line == f"ros2:{DOMAIN}"
        yield process


def words_of(folder, *more, kind="twist", command="/command", place="pose=/tcp/pose"):
    where = (
        f"ros2:{DOMAIN}?wrench=/ft/wrench&{place}&command={command}&as={kind}"
        "&wrench-frame=tool&force-sign=reaction"
    )
    return ["press", "--wire", where, "--gains", str(folder / "gains.toml"), *WORDS, "--json", *more]


JOINTS = "joints=/joint_states&arm=ur5e"


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("kind", "place"),
    [
        ("twist", JOINTS),
        ("joint-speeds", JOINTS),
        *((kind, "pose=/tcp/pose") for kind in ("twist", "pose", "array")),
    ],
)
def test_it_presses_with_the_force_asked_for(folder, here, capsys, kind, place):
    with node(folder, "--as", kind, *(["--joints"] if place == JOINTS else [])):
        code = main(words_of(folder, "--yes", "--record", "rec", "--seconds", "2.5", kind=kind, place=place))
        told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) == told["lateness"]["ticks"] > 150
    if place == JOINTS:  # its tip points down before a UR5e at home
        assert record["quaternion_w"] == pytest.approx(0.0, abs=1e-4)
        assert np.ptp(record["position_x"]) < 1e-4


def test_a_reading_says_how_much_older_its_pose_is_than_its_wrench(monkeypatch):
    """Both topics in this process, without DDS: the newest wrench is of 5.03 s, the newest pose of 4.99 s."""
    from palpate.wires import ros2
    from palpate.wires import ros2_messages as m

    wrenches = [
        m.wrench(m.header(at, "base"), (0.0, 0.0, -3.0), (0.0,) * 3) for at in (5_010_000_000, 5_020_000_000)
    ]
    pose = m.pose(m.header(4_990_000_000, "base"), (0.4, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0))
    topic = lambda samples: SimpleNamespace(take=lambda most: samples)  # noqa: E731
    waiting = SimpleNamespace(wait=lambda nanoseconds: None)
    monkeypatch.setattr(
        ros2, "_open", lambda *_: ros2._Ends(topic(wrenches), topic([pose]), None, None, waiting)
    )
    wire = ros2.DdsWire(*ros2.topics_of(words_of(Path())[2].removeprefix("ros2:")))
    wrenches.append(m.wrench(m.header(5_030_000_000, "base"), (0.0, 0.0, -4.0), (0.0,) * 3))
    sense = wire.read(1.0)
    assert sense.stamp == pytest.approx(5.03)
    assert sense.position_lag == pytest.approx(0.04)


@pytest.mark.real_time
def test_nothing_that_listens_and_nothing_that_speaks_are_refused(folder, here, capsys):
    assert main(words_of(folder, "--dry-run")) == 2
    assert "nothing to read in ROS domain" in capsys.readouterr().err
    with node(folder):
        assert main(words_of(folder, "--yes", command="/nobody")) == 2
    assert "nothing listens at /nobody" in capsys.readouterr().err


@pytest.mark.real_time
def test_a_second_master_is_refused(folder, here, capsys):
    from palpate.wires import open_wire

    with node(folder):
        first = open_wire(words_of(folder)[2])
        first.begin(30.0)  # else it rests the arm by itself and lets go
        try:
            assert main(words_of(folder, "--yes")) == 2
            assert "another master" in capsys.readouterr().err
        finally:
            first.close()


@pytest.mark.parametrize(
    ("where", "says"),
    [
        ("ros2:", "there is no default"),
        ("ros2:x?wrench=/a", "with a domain"),
        ("ros2:0?wrench=/a&pose=/b", "missing required field `command`"),
        ("ros2:0?wrench=/a&pose=/b&command=/c&as=joint&wrench-frame=tool&force-sign=action", "as"),
        ("ros2:0?wrench=/a&pose=/b&command=/c&as=twist&wrench-frame=tool&force-sign=action&x=1", "x"),
        ("ros2:0?wrench=/a&command=/c&as=twist&wrench-frame=tool&force-sign=action", "joints=TOPIC&arm=ARM"),
        (
            "ros2:0?wrench=/a&joints=/b&command=/c&as=twist&wrench-frame=tool&force-sign=action",
            "belong together",
        ),
        (
            "ros2:0?wrench=/a&pose=/b&command=/c&as=joint-speeds&wrench-frame=tool&force-sign=action",
            "speeds of joints are of an arm",
        ),
    ],
)
def test_a_wrong_address_is_refused(folder, here, capsys, where, says):
    words = words_of(folder, "--dry-run")
    words[2] = where
    assert main(words) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def messages():
    """One of each kind that comes or goes."""
    from palpate.wires import ros2_messages as m

    head = m.header(7 * 10**9 + 8, "tool0")
    yield m.wrench(head, (1, 2, 3), (4, 5, 6))
    yield m.pose(head, (1, 2, 3), (0, 0, 0, 1))
    yield m.twist(head, (1, 2, 3))
    yield m.joints(head, ["elbow_joint", "wrist"], [0.1, -0.2])
    yield m.numbers([1.0, -2.0, 3.5])


@pytest.mark.parametrize("number", range(5))
def test_the_bytes_are_those_of_ros_2(number):
    """Those of rosbags, which knows no DDS, read what cyclonedds writes and write the same."""
    from rosbags.typesys import Stores, get_typestore

    ours = list(messages())[number]
    store = get_typestore(Stores.ROS2_HUMBLE)
    package, kind, short = type(ours).__idl__.idl_transformed_typename.split("::", 2)
    name = f"{package}/{kind}/{short.removeprefix('dds_::').removesuffix('_')}"
    written = ours.serialize()
    read = store.deserialize_cdr(bytes(written), name)
    assert same(written, store.serialize_cdr(read, name))
    assert str(type(ours).deserialize(bytes(store.serialize_cdr(read, name)))) == str(ours)


def test_joints_are_found_by_name_and_never_by_place():
    from palpate.wires.ros2_tool import joint_order

    names = ("shoulder_pan", "elbow", "wrist_1")
    assert joint_order(names, ["elbow_joint", "left_shoulder_pan_joint", "wrist_1_joint", "finger"]) == [
        1,
        0,
        2,
    ]
    assert joint_order(("joint1", "joint2"), ["joint2", "joint1", "fr3_joint1"]) == [1, 0]
    assert joint_order(names, ["finger"]) == []
    for there in (
        ["elbow", "wrist_1"],
        ["elbow", "shoulder_pan"],
        ["elbow_a", "elbow_b", "shoulder_pan", "wrist_1"],
    ):
        with pytest.raises(InputError, match="joint"):
            joint_order(names, there)


def same(ours, theirs):
    """Equal but for the padding behind the last byte, which the first four count."""
    return ours[4:].rstrip(b"\0") == bytes(theirs)[4:].rstrip(b"\0") and ours[:2] == bytes(theirs)[:2]


@pytest.mark.real_time
def test_a_controller_sees_by_deadline_and_liveliness_that_commands_ended(folder, here):
    """One that asks for them is served, and hears of the end of the commands from DDS itself."""
    from cyclonedds.core import Listener, Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from palpate.wires import Command, open_wire
    from palpate.wires import ros2_messages as m

    told = []

    class Told(Listener):
        def on_requested_deadline_missed(self, reader, status):
            told.append("deadline")

        def on_liveliness_changed(self, reader, status):
            told.append(f"alive {status.alive_count}")

    lag = 200_000_000
    with node(folder):
        participant = DomainParticipant(DOMAIN)
        kind = m.message("geometry_msgs/msg/TwistStamped")
        qos = Qos(
            Policy.Reliability.Reliable(10**8), Policy.Deadline(lag), Policy.Liveliness.ManualByTopic(lag)
        )
        reader = DataReader(participant, Topic(participant, "rt/command", kind), qos=qos, listener=Told())
        wire = open_wire(words_of(folder)[2])
        try:
            wire.begin(0.2)
            for _ in range(30):
                wire.read(1.0)
                wire.write(Command((0.0, 0.0, -0.001), (0.0, 0.0, 0.0)))
            assert reader.read(1), "a reader with a deadline is not served"
            served = list(told)
            wire._driver.kill()  # the process of the library: nothing says that it ended
            wire._driver.wait()
            time.sleep(0.6)
        finally:
            wire.close()
    assert "alive 1" in served
    assert {"deadline", "alive 0"} & set(
        told[len(served) :]
    )  # a writer that is gone misses no deadline any more
