"""A slide over a wire: in this process, over the protocols of stand-ins, and stopped by a signal."""

from __future__ import annotations

import json
import math

import msgspec
import numpy as np
import pytest
from tool_axis_arm import FRICTION, ToolAxisArm

from palpate.cli import main
from palpate.errors import InputError
from palpate.force import ForceLoop, SlidingLoop, load_arm, load_gains
from palpate.force.simulated_press import surface
from palpate.force.slide_table import Slide
from palpate.force.sliding.slide_domain import start_time
from palpate.logs import read_record
from palpate.wires import PressLimits, PressTask, Rows, check_order, press
from palpate.wires.order import Path as SlidePath
from wires.simulated import simulated_arm
from wires.slow_cell import ADDRESSES, REHEARSAL, WORDS, cell, child, servo_cell
from wires.test_press import ArmClock, FakeWire, retreat_of

PATH = SlidePath("back", 0.01, 6.0)
ALONG = ("--path", "back", "--length", "10:mm", "--seconds", "4")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("slide")
    gains = load_gains(cell(made))
    slide = Slide(speed=0.004, mu_max=0.9, slope=0.05)
    (made / "plain.toml").write_text(gains.to_toml())
    (made / "gains.toml").write_text(msgspec.structs.replace(gains, slide=slide).to_toml())
    return made


@pytest.fixture(scope="module")
def servo(tmp_path_factory):
    made = tmp_path_factory.mktemp("servo-slide")
    slide = Slide(speed=0.004, mu_max=0.9, slope=0.05)
    gains = msgspec.structs.replace(load_gains(servo_cell(made)), slide=slide)
    (made / "gains.toml").write_text(gains.to_toml())
    return made


def order_of(folder, path=PATH, **limits):
    numbers = {"force": 25.0, "speed": 0.05, "travel": 0.03, "seconds": 30.0, **limits}
    task = PressTask(10.0, (0.0, 0.0, -1.0), 6.0, 0.001, path=path)
    return check_order(ForceLoop.load(folder / "gains.toml"), task, PressLimits(**numbers))


def sliding(folder, lie=lambda sense, first: sense, since=4.0):
    tip = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(4000.0, 20.0), 0.002, (1.0, -0.5, 2.0), 0)
    wire, order = FakeWire(tip, lie, since), order_of(folder)
    rows = Rows(None, order.most, {})
    outcome = press(wire, order, rows, lambda: None, clock=ArmClock(tip))
    assert wire.did[-1] == "stop"
    return outcome, wire, rows.record()


@pytest.mark.long
def test_a_servo_that_yields_slides_within_the_same_limits(servo):
    outcome, wire, record = sliding(servo, since=math.inf)
    assert outcome.ok, outcome.ended
    assert outcome.force == pytest.approx(10.0, rel=0.05)
    low, high = outcome.surface["friction"]["ci95"]
    assert low < FRICTION < high
    assert max(np.linalg.norm(c.velocity) for c in wire.sent) <= 0.05 * (1.0 + 1e-9)
    slid = record["phase"] == 3.0
    assert np.ptp(record["position_x"][slid]) + np.ptp(record["position_y"][slid]) > 0.009
    assert np.abs(record["force_sampled"][slid] / 10.0 - 1.0).max() < 0.1


def test_a_slide_holds_the_force_and_finds_normal_and_friction(folder):
    outcome, wire, record = sliding(folder, since=math.inf)
    assert outcome.ok, outcome.ended
    assert outcome.ended == "slid for 6 s"
    assert outcome.force == pytest.approx(10.0, rel=0.03)
    assert outcome.surface is not None
    low, high = outcome.surface["friction"]["ci95"]
    assert low < FRICTION < high < 0.6
    off = np.arccos(-outcome.surface["normal"][2])
    assert np.degrees(off) < outcome.surface["cone95_deg"] < 6.0
    # The path's first direction is the base's x; a line and back ends within its length.
    x, y = (record[f"position_{axis}"] - 0.4 * (axis == "x") for axis in "xy")
    assert 0.008 < x.max() < 0.011
    assert np.abs(y).max() < 1e-3
    assert record["phase"][record["phase"] < 4.0].max() == 3.0  # 4 is the retreat
    assert max(math.hypot(*c.velocity) for c in wire.sent) <= 0.05


@pytest.mark.parametrize(
    ("lie", "says"),
    [
        (lambda s, first: s._replace(force=(math.nan, *s.force[1:])), "no number"),
        (lambda s, first: s._replace(force=first.force), "has not changed"),
        (lambda s, first: s._replace(force=(60.0, *s.force[1:])), "above the limit of 25 N"),
        (lambda s, first: s._replace(position=(0.5, *s.position[1:])), "left the line"),
        (lambda s, first: s._replace(stamp=first.stamp - 1.0), "went back"),
    ],
)
def test_what_ends_a_press_ends_a_slide(folder, lie, says):
    outcome, wire, record = sliding(folder, lie)
    assert not outcome.ok
    assert says in outcome.ended
    assert len(record) <= len(wire.sent)  # the retreat has commands without a reading
    assert retreat_of(wire)
    for _ in range(50):
        wire.arm.tick(wire.velocity)
    assert wire.arm.body.force == 0.0


@pytest.mark.parametrize("velocity", [[math.nan, 0.0, 0.0], [0.0, 9.0, 0.0]])
def test_a_law_that_fails_sends_nothing(folder, monkeypatch, velocity):
    update, ticks = SlidingLoop.update, []

    def broken(self, *words):
        ticks.append(None)
        return np.array(velocity) if len(ticks) == 50 else update(self, *words)

    monkeypatch.setattr(SlidingLoop, "update", broken)
    outcome, wire, _ = sliding(folder)
    assert "was not sent: it is beyond the limit of 50 mm/s" in outcome.ended
    assert len(wire.sent) - len(retreat_of(wire)) == 49


@pytest.mark.parametrize(
    ("limits", "says"),
    [({"travel": 0.005}, "beyond the travel limit of 5 mm"), ({"speed": 0.001}, "speed limit")],
)
def test_limits_that_the_path_passes_are_refused_before_anything_moves(folder, limits, says):
    with pytest.raises(InputError, match=says):
        order_of(folder, **limits)


def test_a_line_ends_at_its_length(folder):
    order = order_of(folder, path=SlidePath("line", 0.01, 6.0), travel=0.011)
    assert order.task.hold == pytest.approx(2.5)  # at 4 mm/s


def words_of(folder, address, *more, gains="gains.toml"):
    return ["slide", "--wire", address, "--gains", str(folder / gains), *WORDS, *ALONG, *more]


@pytest.mark.parametrize(
    ("more", "gains", "says"),
    [
        (["--arm", "fr3"], "gains.toml", "--arm is for a simulated slide"),
        ([], "plain.toml", "no numbers for a slide"),
        (["--path", "zig"], "gains.toml", "unknown path"),
        (["--length", "0:mm"], "gains.toml", "--length must be"),
        (["--seconds", "30"], "gains.toml", "--seconds"),
    ],
)
def test_wrong_words_are_one_line(folder, here, capsys, more, gains, says):
    words = words_of(folder, "sim:127.0.0.1:9", gains=gains)
    if more and more[0] in words:
        at = words.index(more[0])
        words[at : at + 2] = more
    else:
        words += more
    assert main(words) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def test_limits_without_a_wire_are_refused(here, capsys):
    assert main(["slide", "--force-limit", "30:N"]) == 2
    assert "--wire is missing" in capsys.readouterr().err


def test_it_slides_over_the_protocol_of_a_simulated_arm(folder, here, capsys):
    with simulated_arm(folder) as network:
        assert main(words_of(folder, network.address, "--dry-run")) == 0
        start = f"{start_time(load_gains(folder / 'gains.toml')):.2g} s"
        assert f"along a back of 10 mm, begun within {start} of the first" in capsys.readouterr().out
    with simulated_arm(folder, gap=0.006) as network:
        code = main(words_of(folder, network.address, "--yes", "--record", "rec", "--json"))
    told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["surface"]["friction"]["ci95"][0] < FRICTION < told["surface"]["friction"]["ci95"][1]
    assert np.ptp(read_record(here / "rec" / "record.parquet")["position_x"]) > 0.005
    assert main(["identify", str(here / "rec" / "record.parquet"), "--json"]) == 0
    mu = json.loads(capsys.readouterr().out)["parameters"]["mu"]  # no press: it is read with its axes
    assert mu["ci95"][0] < FRICTION < mu["ci95"][1]


@pytest.mark.real_time
def test_it_slides_over_the_protocol_of_a_ur(folder, here, capsys):
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this system")
    address = next(ADDRESSES)
    where = ("--address", address, "--arm", folder / "arm.toml", "--seconds", "60", "--stiffness", "4000")
    with child(REHEARSAL / "rtde_arm.py", *where) as (_, line):
        code = main(words_of(folder, line, "--yes", "--json"))
    told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["surface"]["friction"]["value"] == pytest.approx(FRICTION, abs=0.1)


def test_a_direction_off_the_surface_meets_none_and_tells_no_normal(folder, here, capsys):
    words = words_of(folder, "", "--yes")
    words[words.index("0,0,-1")] = "0,0,1"
    words[words.index("30:mm")] = "11:mm"
    with simulated_arm(folder) as network:
        words[words.index("--wire") + 1] = network.address
        code = main(words)
    printed = capsys.readouterr().out
    assert code == 1
    assert "beyond the limit of 11 mm" in printed
    assert "no surface was held before that; --normal is the direction into it" in printed
    assert "friction" not in printed


@pytest.mark.parametrize("at", [1, 7])  # y of the force, and of the position
def test_a_slide_ends_where_one_axis_is_no_number(folder, here, capsys, at):
    def spoil(since, _):
        return (lambda values: (*values[:at], math.nan, *values[at + 1 :])) if since > 3.0 else None

    with simulated_arm(folder, spoil, gap=0.001) as network:
        code = main(words_of(folder, network.address, "--yes", "--record", "rec"))
    printed = capsys.readouterr().out
    assert code == 1
    assert "ended: the arm gives a reading that is no number; the arm rests\n" in printed
    assert network.rests
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) > 200
    assert record["phase"].max() == 3.0  # it was sliding
