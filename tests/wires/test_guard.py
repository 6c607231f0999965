"""The last check on the wire's side: what goes out is finite and within the limits, and a halt ends the press."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.wires import Command, ConnectionLostError, NoReadingError, PressEndedError, PressLimits
from palpate.wires.guard import Guard, command_fault
from wires.simulated import SimulatedClock

LIMITS = PressLimits(force=40.0, speed=0.05, travel=0.01, seconds=20.0)
START = np.array([0.4, 0.0, 0.3])
TICK, LAG = 0.01, 0.1


class Wire:
    """Gives what it is told, each after its time."""

    def __init__(self, clock, answers):
        self.clock, self.answers, self.sent = clock, list(answers), []

    def begin(self, silence):
        self.silence = silence

    def read(self, timeout):
        answer = self.answers.pop(0) if self.answers else None
        self.clock.now += timeout
        if answer is None:
            raise NoReadingError(" at /wrench", timeout)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def write(self, command):
        self.sent.append(command)


@pytest.fixture
def clock():
    return SimulatedClock()


def guarded(clock, *answers, asked=lambda: None):
    wire = Wire(clock, answers)
    made = Guard(wire, LIMITS, START, TICK, LAG, asked, clock)
    made.begin()
    return made, wire


number = st.one_of(st.floats(), st.floats(-0.1, 0.1))
triple = st.tuples(number, number, number)


@given(triple, triple)
def test_whatever_goes_out_is_finite_and_within_the_limits(velocity, way):
    position = tuple(float(v) for v in START + np.array(way))
    if command_fault(Command(velocity, position), LIMITS, START) is None:
        assert all(map(math.isfinite, (*velocity, *position)))
        assert np.linalg.norm(velocity) <= LIMITS.speed * (1.0 + 1e-9)
        assert np.linalg.norm(np.array(position) - START) <= LIMITS.travel


@pytest.mark.parametrize(
    ("velocity", "way", "says"),
    [
        ((0.0, 0.0, math.nan), 0.0, "nan mm/s was not sent"),
        ((0.0, math.inf, 0.0), 0.0, "inf mm/s was not sent"),
        ((0.04, 0.0, -0.04), 0.0, "56.6 mm/s was not sent: it is beyond the limit of 50 mm/s"),
        ((0.0, 0.0, -0.01), 0.0101, "10.1 mm from the start was not sent: it is beyond the limit of 10 mm"),
        ((0.0, 0.0, -0.01), math.nan, "nan mm from the start was not sent"),
        ((0.0, 0.0, -0.01), 1e200, "from the start was not sent"),
    ],
)
def test_a_command_beyond_a_limit_ends_the_press_and_is_not_sent(clock, velocity, way, says):
    made, wire = guarded(clock)
    with pytest.raises(PressEndedError, match=says):
        made.write(Command(velocity, (START[0], START[1], START[2] - way)))
    assert not wire.sent
    made.write(Command((0.0, 0.0, -0.05), (START[0], START[1], START[2] - 0.01 + 1e-15)))
    assert len(wire.sent) == 1


@pytest.mark.parametrize("where", ["before a command", "while it was sent", "while it waited"])
def test_a_process_that_stood_still_ends_the_press_with_its_own_reason(clock, where):
    """Whatever the wire says of the same time: that it had no command, or that a reading came."""
    made, wire = guarded(clock, ConnectionLostError("no command came for 200 ms"))
    if where == "before a command":
        clock.now += 1.5
        with pytest.raises(
            PressEndedError, match=r"stood still for 1\.5 s, longer than the loop's lag of 100 ms"
        ):
            made.write(Command((0.0, 0.0, 0.0), tuple(START)))
        assert not wire.sent
    elif where == "while it was sent":
        wire.write = lambda _: setattr(clock, "now", clock.now + 1.5)
        with pytest.raises(PressEndedError, match="stood still"):
            made.write(Command((0.0, 0.0, 0.0), tuple(START)))
    else:
        wire.answers[0] = type("Late", (ConnectionLostError,), {})("no command came for 200 ms")
        read = wire.read
        wire.read = lambda timeout: (setattr(clock, "now", clock.now + 1.5), read(timeout))[1]
        with pytest.raises(PressEndedError, match="stood still"):
            made.read()


def test_a_tick_without_a_reading_is_waited_for_and_the_lag_without_one_ends_the_press(clock):
    made, wire = guarded(clock, None, None, "a reading")
    assert wire.silence == LAG
    assert made.read() == "a reading"
    begun = clock.now
    with pytest.raises(NoReadingError, match="no reading at /wrench for 100 ms"):
        made.read()
    assert LAG <= clock.now - begun <= LAG + 1.01 * TICK


def test_a_wish_to_stop_is_heard_within_a_tick_though_nothing_ever_comes(clock):
    wishes = iter([None, None, "stopped by the user (Ctrl-C)"])
    made, _ = guarded(clock, asked=lambda: next(wishes))
    begun = clock.now
    with pytest.raises(PressEndedError, match="Ctrl-C"):
        made.read()
    assert clock.now - begun <= 3.01 * TICK


def test_a_wire_that_is_lost_is_not_waited_for(clock):
    made, _ = guarded(clock, ConnectionLostError("the controller has closed the connection"))
    begun = clock.now
    with pytest.raises(ConnectionLostError, match="closed the connection"):
        made.read()
    assert clock.now - begun <= 1.01 * TICK
