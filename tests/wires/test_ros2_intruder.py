"""Another participant publishes at the arm's own topics: a reading that is none ends the press, all else is left."""

from __future__ import annotations

import json
import math
import time
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import new_class

import pytest

from palpate.cli import main
from palpate.logs import read_record
from wires.slow_cell import ALONE, DOMAIN, REHEARSAL, WORDS, child, while_it_presses

pytest.importorskip("cyclonedds", reason="cyclonedds has no wheel for this system")
pytestmark = pytest.mark.real_time
TOPIC = "rt/ft/wrench"


@pytest.fixture(scope="module")
def folder(folders):
    return folders[100]


@contextmanager
def intruder(kind):
    """A writer at the wrench's topic, of messages of this kind, and the time by the arm's own clock [ns]."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    participant = DomainParticipant(DOMAIN)
    qos = Qos(Policy.Reliability.Reliable(10**8), Policy.History.KeepLast(1))
    from palpate.wires import ros2_messages as m

    pose = m.message("geometry_msgs/msg/PoseStamped")
    reader = DataReader(participant, Topic(participant, "rt/tcp/pose", pose), qos=qos)

    def now():
        stamp = reader.read(1)[-1].header.stamp
        return stamp.sec * 10**9 + stamp.nanosec

    yield DataWriter(participant, Topic(participant, TOPIC, kind), qos=qos), now


def wrench(nanoseconds, force=(0.0, 0.0, 1.0)):
    from palpate.wires import ros2_messages as m

    return m.wrench(m.header(nanoseconds, "base"), force, (0.0, 0.0, 0.0))


@cache
def short():
    """A message that has the name of a wrench and ends after two numbers, so that its bytes are no wrench."""
    from cyclonedds.idl import IdlStruct, types

    typed = {"sec": types.int32, "nanosec": types.uint32}
    name = {"typename": "geometry_msgs::msg::dds_::WrenchStamped_"}
    return dataclass(
        new_class(
            "Short", (IdlStruct,), name, lambda body: body.update(__annotations__=typed, __module__=__name__)
        )
    )


def pressed(folder, capsys, kind, act, *more):
    """Exit code and what was printed, of a press into which another writes."""
    where = (
        f"ros2:{DOMAIN}?wrench=/ft/wrench&pose=/tcp/pose&command=/command&as=twist&wrench-frame=tool"
        "&force-sign=reaction"
    )
    words = ["press", "--wire", where, "--gains", str(folder / "gains.toml"), *WORDS, "--json", "--yes"]
    node = ("--domain", DOMAIN, "--arm", folder / "arm.toml", "--stiffness", 4000, "--seconds", 60)
    with (
        child(REHEARSAL / "ros2_arm.py", *node, *more, CYCLONEDDS_URI=ALONE),
        intruder(kind) as (writer, now),
    ):
        while_it_presses(Path("rec") / "rows.f64", lambda: act(writer, now))
        code = main([*words, "--record", "rec", "--seconds", "2"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("ahead", "force", "says"),
    [
        (0.05, (math.nan, 0.0, 0.0), "no number"),
        (1000.0, (0.0, 0.0, 1.0), "s ahead of this computer's"),
        (0.05, (0.0, 0.0, 1e6), "above the limit"),
    ],
)
def test_what_is_no_reading_ends_the_press(folder, here, capsys, ahead, force, says):
    from palpate.wires import ros2_messages as m

    def act(writer, now):
        for _ in range(20):
            writer.write(wrench(now() + round(1e9 * ahead), force))
            time.sleep(0.01)

    code, told = pressed(folder, capsys, m.message("geometry_msgs/msg/WrenchStamped"), act, "--gap", 0.05)
    assert code == 1
    assert says in told["ended"]
    assert len(read_record(here / "rec" / "record.parquet")) == told["lateness"]["ticks"] > 20


@pytest.mark.parametrize("what", ["frozen", "of another type", "malformed"])
def test_what_is_none_of_the_arms_is_left(folder, here, capsys, what):
    from palpate.wires import ros2_messages as m

    kinds = {
        "frozen": (m.message("geometry_msgs/msg/WrenchStamped"), lambda: wrench(10**9)),
        "of another type": (
            m.message("geometry_msgs/msg/PoseStamped"),
            lambda: m.pose(m.header(time.time_ns(), "base"), (0.0,) * 3, (0.0, 0.0, 0.0, 1.0)),
        ),
        "malformed": (short(), lambda: short()(2_000_000_000, 1)),
    }
    kind, made = kinds[what]

    def act(writer, _):
        for _ in range(50):
            writer.write(made())
            time.sleep(0.01)

    code, told = pressed(folder, capsys, kind, act)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.1)
