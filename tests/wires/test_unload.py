"""Every end of a press unloads: its tip goes back to free motion, or as far as it came where no force is believed."""

from __future__ import annotations

import math
import signal

import numpy as np
import pytest
from tool_axis_arm import ToolAxisArm

from palpate.errors import InputError
from palpate.force import ForceLoop, load_arm
from palpate.force.simulated_press import surface
from palpate.wires import (
    ConnectionLostError,
    NoReadingError,
    PressLimits,
    PressTask,
    Rows,
    WatchdogStopError,
    check_order,
    press,
)
from wires.slow_cell import ARM, cell
from wires.test_press import ArmClock, FakeWire

DOWN = (0.0, 0.0, -1.0)
GAP, THICK = 0.002, 0.02
LAYERS = (500.0, THICK)
HARD = 1e5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A slow arm, with gains whose cap is above the hard layer."""
    made = tmp_path_factory.mktemp("layers")
    cell(made, ARM.replace("stiffness = 1e4", "stiffness = 2e5"))
    return made


class Run:
    """A press in the arm's own time: its outcome, its wire and its rows."""

    def __init__(self, folder, lie=None, since=math.inf, *, end="retreat", layer=LAYERS, seed=0, wish=lambda: None,
                 gap=GAP, stiffness=HARD, wire=None, **limits):  # fmt: skip
        order = check_order(
            ForceLoop.load(folder / "gains.toml"),
            PressTask(limits.pop("desired", 20.0), DOWN, limits.pop("hold", 1.0), 0.002, end=end),
            PressLimits(**{"force": 40.0, "speed": 0.25, "travel": 0.04, "seconds": 30.0, **limits}),
        )
        if wire is None:
            arm = ToolAxisArm(
                load_arm(str(folder / "arm.toml")), surface(stiffness, 0.0), gap, (1.0, 0.0, 2.0), seed, layer
            )
            wire = FakeWire(arm, lie or (lambda sense, first: sense), since)
        self.rows, self.wire = Rows(None, order.most, {}), wire
        self.before = len(wire.sent)
        self.outcome = press(wire, order, self.rows, wish, clock=ArmClock(wire.arm))
        self.limits = order.limits

    @property
    def force_later(self):
        """True force on the surface half a second after the end, the arm left to itself [N]."""
        for _ in range(50):
            self.wire.arm.tick(self.wire.velocity)
        return self.wire.arm.body.force

    @property
    def sent(self):
        return self.wire.sent[self.before :]

    @property
    def retreat(self):
        """Velocities of the retreat along the normal, outwards [m/s]."""
        speeds = np.array([command.velocity[2] for command in self.sent])
        return speeds[np.flatnonzero(speeds < 0.0)[-1] + 1 :]


class Faulty(FakeWire):
    """From the first tick at which the tip presses with 15 N on, a fault."""

    def __init__(self, arm, fault):
        super().__init__(arm)
        self.fault, self.begun = fault, False

    def read(self, timeout):
        sense = super().read(timeout)
        if not self.begun and self.arm.body.force > 15.0:
            self.begun, self.first = True, sense
        return self.fault(self, sense) if self.begun else sense


def faulty(folder, fault, **changes):
    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (1.0, 0.0, 2.0), 0)
    return Run(folder, wire=Faulty(arm, fault), speed=0.05, **changes)


@pytest.mark.parametrize("speed", [0.25, 0.05])
@pytest.mark.parametrize("limit", [40.0, 25.0])
def test_a_force_limit_on_a_soft_layer_over_a_hard_one_leaves_no_force(folder, speed, limit):
    run = Run(folder, force=limit, speed=speed)
    assert not run.outcome.ok
    assert f"above the limit of {limit:g} N" in run.outcome.ended
    assert run.outcome.unloading.free
    assert run.outcome.unloading.how.endswith("to free motion")
    assert run.force_later == 0.0
    assert (run.retreat >= 0.0).all()
    assert run.retreat.max() <= speed * (1.0 + 1e-9)


def nothing(wire, sense):
    raise NoReadingError("", 0.01)


def lost(wire, sense):
    raise ConnectionLostError("the readings have ended")


FAULTS = {
    "unreadable": lambda wire, sense: sense._replace(force=(0.0, 0.0, math.nan)),
    "saturated": lambda wire, sense: sense._replace(force=(0.0, 0.0, -100.0)),
    "frozen force": lambda wire, sense: sense._replace(force=wire.first.force),
    "frozen at zero": lambda wire, sense: sense._replace(force=(1.0, 0.0, 2.0)),
    "frozen readings": lambda wire, sense: wire.first,
    "clock": lambda wire, sense: sense._replace(stamp=sense.stamp + 1000.0),
    "clock back": lambda wire, sense: sense._replace(stamp=sense.stamp - 1.0),
    "silence": nothing,
    "readings lost": lost,
    "position jumps": lambda wire, sense: sense._replace(position=(0.4, 0.0, 0.2)),
    "position lost": lambda wire, sense: sense._replace(position=(math.nan,) * 3),
    "wrong sign": lambda wire, sense: sense._replace(force=tuple(-f for f in sense.force)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_contact_leaves_no_force(folder, fault):
    run = faulty(folder, FAULTS[fault], hold=5.0)
    assert run.wire.begun
    assert not run.outcome.ok
    assert run.outcome.unloading.completed
    assert run.force_later == 0.0
    assert run.retreat.max() <= 0.05 * (1.0 + 1e-9)
    assert run.wire.arm.command >= -GAP - 0.002 - 0.001  # not behind the start by more than the clearance


def test_a_retreat_is_bounded_though_the_readings_end_in_its_middle(folder):
    """While the force falls, the tip is given time to rest: it must not be waited for for ever."""

    def ends(wire, sense):
        if wire.velocity[2] > 0.0 and wire.arm.body.force < 10.0:
            wire.ended = True
        if getattr(wire, "ended", False):
            raise NoReadingError("", 0.01)
        return sense

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (1.0, 0.0, 2.0), 0)
    wire = Faulty(arm, ends)
    run = Run(folder, wire=wire, wish=lambda: "stopped" if wire.begun else None, speed=0.05)
    assert wire.ended
    assert run.force_later == 0.0


@pytest.mark.parametrize("fault", ["unreadable", "saturated", "frozen at zero", "frozen readings", "silence"])
def test_without_a_believable_force_the_way_back_is_the_way_that_it_came(folder, fault):
    run = faulty(folder, FAULTS[fault], hold=5.0)
    how = run.outcome.unloading
    assert not how.free
    assert "without a believable force" in how.how
    assert how.distance == pytest.approx(run.rows.record()["x_command"].max() + 0.002, abs=1e-3)


def test_a_wire_that_takes_no_command_is_named_with_the_arms_own_stop(folder):
    class Deaf(Faulty):
        watchdog = "the arm stops by itself"

        def write(self, command):
            if self.begun:
                raise ConnectionLostError("the controller has closed the connection")
            super().write(command)

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (0.0,) * 3, 0)
    run = Run(folder, wire=Deaf(arm, lambda wire, sense: sense), speed=0.05)
    assert run.outcome.unloading.how == (
        "could not unload: the controller has closed the connection; the arm stops by itself"
    )


def test_an_arm_that_its_own_watchdog_has_stopped_is_taken_over_again(folder):
    class Lapsed(Faulty):
        lapsed = False

        def write(self, command):
            if self.begun and not self.lapsed:
                self.lapsed = True
                raise WatchdogStopError("no command came for 200 ms, and the arm was brought to rest")
            if self.lapsed and self.did[-1] != "again":
                raise WatchdogStopError("still at rest")
            super().write(command)

        def begin(self, silence):
            self.did.append("again" if self.lapsed else "begin")

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (0.0,) * 3, 0)
    wire = Lapsed(arm, lambda wire, sense: sense)
    run = Run(folder, wire=wire, speed=0.05)
    assert "again" in wire.did
    assert run.outcome.unloading.free
    assert run.force_later == 0.0


@pytest.mark.parametrize(
    ("limits", "says"),
    [({"travel": 0.004}, "from the start"), ({"seconds": 4.0, "hold": 3.0}, "the time limit of 4 s is over")],
)
def test_a_limit_of_travel_or_time_leaves_no_force(folder, limits, says):
    run = faulty(folder, lambda wire, sense: sense, **limits)
    assert says in run.outcome.ended
    assert run.force_later == 0.0


def test_a_speed_limit_leaves_no_force(folder):
    def jump(wire, sense):
        shift = 0.003 if wire.did.count("jump") else 0.0
        wire.did.append("jump")
        return sense._replace(position=(*sense.position[:2], sense.position[2] - shift))

    run = faulty(folder, jump)
    assert "the tool moves at" in run.outcome.ended
    assert run.force_later == 0.0


def test_a_wish_in_contact_is_heard_and_leaves_no_force(folder):
    holder = {}

    def wish():
        wire = holder.get("wire")
        return "stopped by the user (Ctrl-C)" if wire is not None and wire.begun else None

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (0.0,) * 3, 0)
    holder["wire"] = Faulty(arm, lambda wire, sense: sense)
    run = Run(folder, wire=holder["wire"], wish=wish, speed=0.05)
    assert run.outcome.ended == "stopped by the user (Ctrl-C)"
    assert run.force_later == 0.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_it_retreats_waits_until_the_tip_is_out(folder, number):
    """Raised where nobody notices signals, as in a program that uses the library."""
    came = []

    class Interrupted(Faulty):
        def write(self, command):
            super().write(command)
            if command.velocity[2] > 0.0 and self.begun and not came:
                came.append(None)
                signal.raise_signal(number)

    before = signal.signal(number, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))
    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (0.0,) * 3, 0)
    wire = Interrupted(arm, FAULTS["unreadable"])
    try:
        with pytest.raises(KeyboardInterrupt):
            Run(folder, wire=wire, speed=0.05)
    finally:
        signal.signal(number, before)
    assert came
    assert wire.arm.command < 0.0
    assert wire.did[-1] == "stop"


@pytest.mark.parametrize("error", [RuntimeError("a defect"), MemoryError(), KeyboardInterrupt()])
def test_an_error_of_the_law_in_contact_leaves_no_force(folder, monkeypatch, error):
    update = ForceLoop.update
    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (0.0,) * 3, 0)
    wire = Faulty(arm, lambda wire, sense: sense)

    def raising(self, *words):
        if wire.begun:
            raise error
        return update(self, *words)

    monkeypatch.setattr(ForceLoop, "update", raising)
    with pytest.raises(type(error)):
        Run(folder, wire=wire, speed=0.05)
    for _ in range(50):
        arm.tick(wire.velocity)
    assert arm.body.force == 0.0


@pytest.mark.parametrize(("end", "rests_with"), [("retreat", 0.0), ("hold", 20.0)])
def test_a_press_that_is_done_ends_as_asked(folder, end, rests_with):
    run = faulty(folder, lambda wire, sense: sense, end=end, hold=2.0)
    assert run.outcome.ok, run.outcome.ended
    assert run.force_later == pytest.approx(rests_with, abs=0.05 * 20.0 if rests_with else 0.0)
    assert ("rests in contact" in run.outcome.unloading.how) == (end == "hold")


def test_a_limit_retreats_though_the_end_is_to_hold(folder):
    run = Run(folder, end="hold")
    assert not run.outcome.ok
    assert run.force_later == 0.0


def test_another_end_is_refused():
    with pytest.raises(InputError, match="end 'stay'"):
        PressTask(10.0, DOWN, 1.0, 0.002, end="stay")


def test_the_rows_of_the_retreat_are_kept(folder):
    run = Run(folder, force=25.0)
    record = run.rows.record()
    back = record["phase"] == 4.0
    assert back.sum() > 10
    assert (record["speed"][back] <= 0.0).all()
    assert np.abs(record["force_sampled"][-5:]).max() < 0.8  # eight standard deviations


def test_an_obstacle_behind_the_tip_ends_the_retreat(folder):
    """A hand, 2 kN/m, right behind the tool: the way back would press it with 60 N."""
    touch = 0.3

    def hand(wire, sense):
        return sense._replace(force=(1.0, 0.0, sense.force[2] + 2e3 * max(sense.position[2] - touch, 0.0)))

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), 0.03, (1.0, 0.0, 2.0), 0)
    wire = Faulty(arm, hand)
    run = Run(folder, wire=wire, wish=lambda: "stopped" if wire.begun else None, speed=0.05)
    assert "met it from behind" in run.outcome.unloading.how
    assert not run.outcome.unloading.completed
    # Half of the desired force, and what the arm still goes within its lag of 0.23 s.
    assert -run.rows.record()["force_sampled"].min() < 10.0 + 2e3 * 0.05 * 0.3


@pytest.mark.parametrize("seed", range(3))
def test_a_press_that_meets_nothing_has_touched_nothing(folder, seed):
    run = Run(folder, layer=None, gap=0.05, seed=seed, travel=0.03, speed=0.05, desired=10.0, force=25.0)
    assert not run.outcome.ok
    assert not run.outcome.touched
    assert run.outcome.stiffness is None
    assert run.outcome.force is None
    assert run.outcome.ended.endswith("and no surface was met")
    assert run.outcome.to_json()["stiffness_N_per_m"] is None


def test_a_force_that_changes_with_the_place_in_free_motion_is_no_press(folder):
    """A hose: 30 N/m, so that the tip would go 0.3 m for its force."""

    def hose(sense, first):
        return sense._replace(
            force=(1.0, 0.0, sense.force[2] - 30.0 * (first.position[2] - sense.position[2]))
        )

    run = Run(
        folder, hose, since=0.7, layer=None, gap=0.05, travel=0.03, speed=0.05, desired=10.0, force=25.0
    )
    assert not run.outcome.ok
    assert not run.outcome.touched
    assert "the force of 10 N was never reached" in run.outcome.ended
    assert run.outcome.stiffness is None


def test_the_hold_counts_only_time_in_contact(folder):
    """The surface gives way for a second in mid-hold, and the tip follows it for that long."""

    class Sinking(Faulty):
        gone = 0

        def read(self, timeout):
            since = self.arm.time - self.first.stamp if self.begun else 0.0
            away = 1.0 < since < 2.0
            self.gone += away
            self.arm.surface = self.arm.surface._replace(place=0.02 if away else 0.0)
            return super().read(timeout)

    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(5000.0, 0.0), GAP, (1.0, 0.0, 2.0), 0)
    run = Run(folder, wire=Sinking(arm, lambda wire, sense: sense), hold=3.0, speed=0.05, force=90.0)
    assert run.outcome.ok, run.outcome.ended
    record = run.rows.record()
    pressed = (record["force_sampled"] > 15.0) & (record["phase"] < 4.0)
    assert run.wire.gone > 50
    assert pressed.sum() >= 300  # ticks of 10 ms
