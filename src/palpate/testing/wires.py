"""Laws of every wire, for your own too: `palpate checks module:Class?WHERE`. The arm is at rest, and none moves it."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from palpate.testing.check import Check, require
from palpate.wires.wire import ArmReading, Command, NoReadingError, PressEndedError, unreadable

_READINGS, _PATIENCE = 50, 5.0
"""Readings in one series, and the longest time for them [s]."""
_CLOCK = 0.05
"""Relative difference allowed between two clocks: less than a press over a lag of some ticks bears."""
_STILL = 1e-4
"""Largest motion of an arm that was commanded to rest [m]."""
_PROMPT = 0.5
"""Longest time of a read that may not wait [s]."""


def wire_checks(make: Callable[[], Any]) -> list[Check]:
    """The checks of a wire.

    Args:
        make: opens it: a class with its address filled in, or a function.
    """
    return [Check(law, make) for law in LAWS]


@contextmanager
def _open(make: Callable[[], Any]) -> Iterator[Any]:
    wire = make()
    try:
        yield wire
    finally:
        wire.close()


def _readings(wire: Any, count: int = _READINGS) -> list[ArmReading]:
    """Read a number of readings as they come."""
    readings: list[ArmReading] = []
    end = time.monotonic() + _PATIENCE
    while len(readings) < count:
        require(time.monotonic() < end, f"only {len(readings)} readings came in {_PATIENCE:g} s")
        readings.append(wire.read(1.0))
    return readings


def title_and_watchdog_are_texts(make: Callable[[], Any]) -> None:
    """`title` and `watchdog` are lines of text, for the plan of a press."""
    with _open(make) as wire:
        for name in ("title", "watchdog"):
            words = getattr(wire, name, None)
            require(
                isinstance(words, str) and words.strip() and "\n" not in words,
                f"{name} is {words!r}, not a line",
            )


def readings_are_finite_with_an_orientation(make: Callable[[], Any]) -> None:
    """Finite numbers, and a quaternion of the length 1."""
    with _open(make) as wire:
        for sense in _readings(wire):
            require(isinstance(sense, ArmReading), f"read gave {type(sense).__name__}, not a ArmReading")
            require(unreadable(sense) is None, f"{unreadable(sense)}")
            require(all(map(math.isfinite, sense.torque)), "the torque is no number")


def readings_are_fresh(make: Callable[[], Any]) -> None:
    """The stamps grow from reading to reading."""
    with _open(make) as wire:
        stamps = [sense.stamp for sense in _readings(wire)]
        require(
            min(np.diff(stamps)) > 0.0, "a stamp does not grow: read gave one reading twice, or an older one"
        )


def readings_have_arrival_times(make: Callable[[], Any]) -> None:
    """`received` is of `time.monotonic`, and not of the future."""
    with _open(make) as wire:
        for _ in range(_READINGS):
            before = time.monotonic()
            received = wire.read(1.0).received
            after = time.monotonic()
            require(
                before - 1.0 <= received <= after,
                f"received is {received:.6g}, and time.monotonic {after:.6g}",
            )


def clock_agrees_with_this_computer(make: Callable[[], Any]) -> None:
    """The stamps are seconds, in real time."""
    with _open(make) as wire:
        readings = _readings(wire)
        while readings[-1].received - readings[0].received < _PROMPT:
            readings += _readings(wire, 1)
        elapsed = readings[-1].received - readings[0].received
        stamped = readings[-1].stamp - readings[0].stamp
        require(
            abs(stamped / elapsed - 1.0) <= _CLOCK, f"{stamped:.4g} s by the stamps were {elapsed:.4g} s here"
        )


def read_without_waiting_returns_at_once(make: Callable[[], Any]) -> None:
    """A reading that is there, or a NoReadingError."""
    with _open(make) as wire:
        _readings(wire, 2)
        before = time.monotonic()
        with suppress(NoReadingError):
            wire.read(0.0)
        waited = time.monotonic() - before
        require(
            waited < _PROMPT,
            f"read(0.0) took {waited:.3g} s; it raises NoReadingError where nothing came in time",
        )


def zero_speed_keeps_the_arm_at_rest(make: Callable[[], Any]) -> None:
    """After `begin`, the arm stays where it is."""
    with _open(make) as wire:
        wire.tare()
        start = _readings(wire, 1)[0].position
        wire.begin(1.0)
        for _ in range(_READINGS):
            wire.write(Command((0.0, 0.0, 0.0), start))
            distance = math.dist(wire.read(1.0).position, start)
            require(distance < _STILL, f"it went {1e3 * distance:.3g} mm")
        wire.stop()


def stop_and_close_may_be_repeated(make: Callable[[], Any]) -> None:
    """`stop` and `close` do not raise, before `begin` or after the end."""
    with _open(make) as wire:
        wire.stop()
        wire.begin(1.0)
        for end in (wire.stop, wire.stop, wire.close, wire.close):
            end()


def closed_wire_gives_no_reading(make: Callable[[], Any]) -> None:
    """A closed wire raises a ConnectionLostError."""
    with _open(make) as wire:
        _readings(wire, 1)
    before = time.monotonic()
    try:
        while time.monotonic() < before + _PROMPT:
            wire.read(0.01)
    except (PressEndedError, OSError, ValueError):
        return
    require(False, "read goes on after close; raise ConnectionLostError")


LAWS = (
    title_and_watchdog_are_texts,
    readings_are_finite_with_an_orientation,
    readings_are_fresh,
    readings_have_arrival_times,
    clock_agrees_with_this_computer,
    read_without_waiting_returns_at_once,
    zero_speed_keeps_the_arm_at_rest,
    stop_and_close_may_be_repeated,
    closed_wire_gives_no_reading,
)
"""The laws; the name of each is its sentence."""
