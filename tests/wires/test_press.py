"""A press over a wire that lies: in this process, at the speed of the computer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tool_axis_arm import REST, ToolAxisArm

from palpate.errors import InputError
from palpate.force import ForceLoop, load_arm
from palpate.force.simulated_press import surface
from palpate.wires import ArmReading, PressLimits, PressTask, Rows, check_order, press
from palpate.wires.order import safe_travel
from wires.slow_cell import servo_cell

SURFACE = surface(4000.0, 20.0)


class FakeWire:
    """An arm of one direction that answers at once; from a time of its own on its readings go through a lie.

    Args:
        arm: the simulated one.
        lie: given a reading and the one at which it began, another.
        since: when it begins [s].
    """

    title = watchdog = "none"

    def __init__(self, arm, lie=lambda sense, first: sense, since=math.inf):
        self.arm, self.lie, self.since, self.first = arm, lie, since, None
        self.velocity, self.did, self.sent = REST, [], []

    def read(self, timeout):
        self.arm.tick(self.velocity)
        v = self.arm.reading()
        sense = ArmReading(1000.0 + self.arm.time, self.arm.time, v[0:3], v[3:6], v[6:9], v[9:13])
        if self.arm.time < self.since:
            return sense
        self.first = self.first or sense
        return self.lie(sense, self.first)

    def tare(self):
        pass

    def begin(self, silence):
        self.did.append("begin")

    def write(self, command):
        self.velocity = command.velocity
        self.sent.append(command)

    def stop(self):
        self.velocity = REST
        self.did.append("stop")


class ArmClock:
    """Stands for a `Clock`: the arm's own, by which no machine halts a press or is late."""

    def __init__(self, arm):
        self._arm = arm

    def monotonic(self):
        return 1000.0 + self._arm.time

    since_boot = monotonic

    def sleep(self, seconds):
        """Not waited for: the arm's time goes on with its commands."""


def lying(
    folder, lie=lambda sense, first: sense, since=2.0, noise=None, hold=2.0, shown=None,
    touched=SURFACE, speed=0.05, travel=0.03, retreat=0.001,
):  # fmt: skip
    model = load_arm(str(folder / "arm.toml"))
    arm = ToolAxisArm(model, touched, 0.002, (0.0, 0.0, 1.0), 0)
    if noise is not None:
        arm.world = arm.world._replace(noise=noise)
    wire = FakeWire(arm, lie, since)
    order = check_order(
        ForceLoop.load(folder / "gains.toml"), PressTask(10.0, (0.0, 0.0, -1.0), hold, retreat),
        PressLimits(force=25.0, speed=speed, travel=travel, seconds=20.0),
    )  # fmt: skip
    rows = Rows(None, order.most, {})
    show = [].append if shown is None else shown.append
    outcome = press(wire, order, rows, lambda: None, show, ArmClock(arm))
    assert wire.did[-1] == "stop"
    return outcome, wire, rows


def retreat_of(wire):
    """Commands of the retreat: the last ones, from the first that leads out on."""
    last_in = max(k for k, command in enumerate(wire.sent) if command.velocity[2] < 0.0)
    out = wire.sent[last_in + 1 :]
    assert out
    assert out[0].velocity[2] > 0.0
    return out


def force(value):
    return lambda sense, first: sense._replace(force=(0.0, 0.0, value(sense.force[2], first.force[2])))


def test_a_press_without_a_lie_is_done(folder):
    outcome, wire, rows = lying(folder)
    assert outcome.ok, outcome.ended
    assert outcome.force == pytest.approx(10.0, rel=0.05)
    assert not outcome.troubles
    assert rows.count == len(wire.sent) > 200


def test_a_force_that_stands_still_ends_the_press_as_that_and_is_shown(folder):
    shown: list[str] = []
    outcome, _, _ = lying(folder, force(lambda now, first: first), since=0.6, shown=shown)
    assert not outcome.ok
    assert outcome.ended.startswith("the force reading has not changed")
    assert not outcome.touched
    assert [text for text in shown if text == outcome.ended]
    assert outcome.troubles[outcome.ended] >= 10


class LatePlaces:
    """A lie: each position is one of up to six ticks ago, at random, and never older than the one before.

    Args:
        stamped: it says how late each is.
        stretch: of the way that the positions show.
    """

    def __init__(self, stamped=True, stretch=1.0):
        self.stamped, self.stretch = stamped, stretch
        self.came, self.shown, self.rng = [], 0, np.random.default_rng(0)

    def __call__(self, sense, first):
        self.came.append(sense)
        self.shown = max(self.shown, len(self.came) - 1 - int(self.rng.integers(7)))
        old = self.came[self.shown]
        place = (np.array(old.position) - first.position) * self.stretch + first.position
        lag = sense.stamp - old.stamp if self.stamped else 0.0
        return sense._replace(position=tuple(place.tolist()), position_lag=lag)


def test_positions_that_are_late_by_up_to_six_ticks_are_borne_by_their_stamps(folder):
    """As two topics of a network are; without the stamps one tick shows the way of seven, which is no speed."""
    outcome, wire, _ = lying(folder, LatePlaces(), retreat=0.02)
    assert outcome.ok, outcome.ended
    assert outcome.force == pytest.approx(10.0, rel=0.1)
    assert max(abs(command.velocity[2]) for command in wire.sent) <= 0.05
    assert "the tool moves at" in lying(folder, LatePlaces(stamped=False), retreat=0.02)[0].ended


def test_an_arm_that_moves_too_fast_is_seen_by_late_positions_too(folder):
    """On the way back at 25 mm/s, which its positions show as up to 125, above twice the limit."""
    outcome, _, _ = lying(folder, LatePlaces(stretch=5.0), travel=0.2, retreat=0.02)
    assert "the tool moves at 1" in outcome.ended
    assert "above the limit of 50" in outcome.ended


@pytest.mark.parametrize("times", [5.0, 1.0 / 5.0])
def test_a_clock_that_is_wrong_at_rest_moves_nothing(folder, times):
    """Of an arm at such a rate that its stamps are those of the gains'."""
    lie = lambda sense, first: sense._replace(received=1000.0 + sense.stamp / times)  # noqa: E731
    with pytest.raises(InputError, match=r"clock runs too (fast|slow)"):
        lying(folder, lie, since=0.0)


@pytest.mark.parametrize("speed", [math.nan, math.inf, -math.inf, 1e9, -0.3])
def test_a_law_that_fails_sends_nothing_that_is_not_within_the_limits(folder, monkeypatch, speed):
    update, ticks = ForceLoop.update, []

    def broken(self, *words):
        ticks.append(None)
        return speed if len(ticks) == 50 else update(self, *words)

    monkeypatch.setattr(ForceLoop, "update", broken)
    outcome, wire, _ = lying(folder)
    assert not outcome.ok
    assert "was not sent: it is beyond the limit of 50 mm/s" in outcome.ended
    assert len(wire.sent) - len(retreat_of(wire)) == 49
    assert all(np.linalg.norm(command.velocity) <= 0.05 for command in wire.sent)


def test_a_louder_sensor_is_tuned_for_and_said(folder):
    shown: list[str] = []
    outcome, _, _ = lying(folder, noise=0.5, shown=shown)
    assert shown[0].startswith("the force's noise is 0.")
    assert "and the gains are for 0.1 N: tuned again for 0." in shown[0]
    assert outcome.rest.noise == pytest.approx(0.5, rel=0.4)


def test_a_sensor_that_drifts_moves_nothing(folder):
    drifts = lambda sense, first: sense._replace(force=(0.0, 0.0, sense.force[2] + 2.0 * sense.stamp))  # noqa: E731
    with pytest.raises(InputError, match="the force drifts by"):
        lying(folder, drifts, since=0.0)


@pytest.fixture(scope="module")
def servo(tmp_path_factory):
    made = tmp_path_factory.mktemp("servo")
    servo_cell(made)
    return made


@pytest.mark.parametrize("K", [500.0, 4000.0, 1e4])
def test_a_servo_that_yields_presses_within_the_same_limits(servo, K):
    """Its command goes ahead of the tip by F/K_s and more; after the press the tip comes to where that has led."""
    outcome, wire, rows = lying(servo, touched=surface(K), hold=3.0, travel=0.06)
    assert outcome.ok, outcome.ended
    assert outcome.force == pytest.approx(10.0, rel=0.05)
    record = rows.record()
    assert record["force_sampled"].max() < 1.1 * 10.0
    assert max(np.linalg.norm(command.velocity) for command in wire.sent) <= 0.05 * (1.0 + 1e-9)
    for _ in range(200):
        wire.arm.tick()
    assert wire.arm.body.force == 0.0
    assert wire.arm.body.x == pytest.approx(wire.arm.command, abs=1e-6)
    assert (
        -0.002 - 0.001 - 5e-4 < wire.arm.command < -0.001
    )  # not behind the start by more than the clearance


def test_a_servo_whose_lead_knows_what_the_limit_takes_off_settles_sooner(servo, monkeypatch):
    """One that does not goes back from a speed that its tip has never had."""
    told = lying(servo, touched=surface(500.0), speed=0.1, hold=4.0, travel=0.06)[0].settled
    monkeypatch.setattr(ForceLoop, "limit_speed", lambda self, speed: None)
    untold = lying(servo, touched=surface(500.0), speed=0.1, hold=4.0, travel=0.06)[0].settled
    assert told < untold - 0.2


def test_a_servo_with_a_sensor_that_lies_presses_no_harder_than_the_plan_says(servo):
    """A force that ripples about zero, to the end of the travel that the plan gives."""
    rng = np.random.default_rng(0)
    ripple = force(lambda now, first: first + 0.05 * rng.standard_normal())
    gains = ForceLoop.load(servo / "gains.toml").gains
    outcome, wire, _ = lying(
        servo, ripple, since=0.0, touched=surface(gains.cap), travel=safe_travel(gains, 25.0)
    )
    assert "was not sent" in outcome.ended
    assert wire.arm.body.force < 25.0
