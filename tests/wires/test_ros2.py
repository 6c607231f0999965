"""A press under ROS 2 over DDS itself, with an arm in another process; and the bytes of the messages."""

from __future__ import annotations

import json
import os
from contextlib import contextmanager
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.logs import read_record
from wires.slow_cell import WORDS, cell, child, killed_when_it_moves

pytest.importorskip("cyclonedds", reason="cyclonedds has no wheel for this system")

ALONE = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
DOMAIN = 20 + os.getpid() % 180


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("ros2")
    cell(made)
    return made


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLONEDDS_URI", ALONE)
    return tmp_path


@contextmanager
def node(folder, stiffness=4000.0, gap=0.002, kind="twist"):
    script = Path(__file__).parent / "ros2_cell.py"
    words = (script, DOMAIN, folder / "arm.toml", stiffness, gap, kind, 60)
    with child(*words, CYCLONEDDS_URI=ALONE) as (process, line):
        assert line == "ready"
        yield process


def words_of(folder, *more, kind="twist", command="/command"):
    where = (
        f"ros2:{DOMAIN}?wrench=/ft/wrench&pose=/tcp/pose&command={command}&as={kind}"
        "&wrench-frame=tool&force-sign=reaction"
    )
    return ["press", "--wire", where, "--gains", str(folder / "gains.toml"), *WORDS, "--json", *more]


@pytest.mark.parametrize(
    "kind", ["twist", *(pytest.param(k, marks=pytest.mark.long) for k in ("pose", "array"))]
)
def test_it_presses_with_the_force_asked_for(folder, here, capsys, kind):
    with node(folder, kind=kind):
        code = main(words_of(folder, "--yes", "--record", "rec", "--seconds", "2.5", kind=kind))
        told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert len(read_record(here / "rec" / "record.parquet")) == told["lateness"]["ticks"] > 150


def test_a_node_that_dies_ends_the_press(folder, here, capsys):
    with node(folder, gap=0.05) as process:
        killed_when_it_moves(process, here / "rec" / "rows.f64")
        code = main(words_of(folder, "--yes", "--record", "rec", "--seconds", "10"))
        told = json.loads(capsys.readouterr().out)
    assert code == 1
    assert "no reading at /ft/wrench" in told["ended"]
    assert len(read_record(here / "rec" / "record.parquet")) > 20


def test_nothing_that_listens_and_nothing_that_speaks_are_refused(folder, here, capsys):
    assert main(words_of(folder, "--dry-run")) == 2
    assert "nothing to read in ROS domain" in capsys.readouterr().err
    with node(folder):
        assert main(words_of(folder, "--yes", command="/nobody")) == 2
    assert "nothing listens at /nobody" in capsys.readouterr().err


def test_a_second_master_is_refused(folder, here, capsys):
    from palpate.wires import open_wire

    with node(folder):
        first = open_wire(words_of(folder)[2])
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
    ],
)
def test_a_wrong_address_is_refused(folder, here, capsys, where, says):
    words = words_of(folder, "--dry-run")
    words[2] = where
    assert main(words) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def test_the_bytes_are_those_of_ros_2():
    from rosbags.typesys import Stores, get_typestore

    from palpate.wires import ros2_messages as m

    store = get_typestore(Stores.ROS2_HUMBLE)
    T = store.types
    ours = m.Header(m.Time(7, 8), "tool0")
    header = T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](7, 8), "tool0")
    V, W = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Wrench"]
    wrench = T["geometry_msgs/msg/WrenchStamped"](header, W(V(1.0, 2.0, 3.0), V(4.0, 5.0, 6.0)))
    mine = m.WrenchStamped(ours, m.Wrench(m.Vector3(1.0, 2.0, 3.0), m.Vector3(4.0, 5.0, 6.0)))
    assert same(mine.serialize(), store.serialize_cdr(wrench, "geometry_msgs/msg/WrenchStamped"))
    P, Q = T["geometry_msgs/msg/Point"], T["geometry_msgs/msg/Quaternion"]
    pose = T["geometry_msgs/msg/PoseStamped"](
        header, T["geometry_msgs/msg/Pose"](P(1.0, 2.0, 3.0), Q(0.0, 0.0, 0.0, 1.0))
    )
    mine = m.PoseStamped(ours, m.Pose(m.Point(1.0, 2.0, 3.0), m.Turn(0.0, 0.0, 0.0, 1.0)))
    assert same(mine.serialize(), store.serialize_cdr(pose, "geometry_msgs/msg/PoseStamped"))
    twist = T["geometry_msgs/msg/TwistStamped"](
        header, T["geometry_msgs/msg/Twist"](V(1.0, 2.0, 3.0), V(0.0, 0.0, 0.0))
    )
    mine = m.TwistStamped(ours, m.Twist(m.Vector3(1.0, 2.0, 3.0), m.Vector3(0.0, 0.0, 0.0)))
    assert same(mine.serialize(), store.serialize_cdr(twist, "geometry_msgs/msg/TwistStamped"))


def same(ours, theirs):
    """Equal but for the padding behind the last byte, which the first four count."""
    return ours[4:].rstrip(b"\0") == bytes(theirs)[4:].rstrip(b"\0") and ours[:2] == bytes(theirs)[:2]
