"""A wire of the user's own: its conformance, its place on the command line, and a press over it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.errors import InputError, PluginError
from palpate.testing import outcomes
from palpate.testing.wires import LAWS, wire_checks
from palpate.wires import ArmReading, ConnectionLostError, NoReadingError, open_wire
from palpate.wires.opening import wire_class_name
from wires.simulated import SimulatedClock
from wires.slow_cell import WORDS, cell, own_class

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "our_robot.py"


class Time(SimulatedClock):
    """Stands for the module `time` of the checks and of the wires that they look at."""

    def sleep(self, seconds):
        self.now += seconds

    def time(self):
        return 1e9 + self.now


time = Time()


@pytest.fixture(autouse=True)
def _simulated_time(monkeypatch):
    monkeypatch.setattr("palpate.testing.wires.time", time)


class Resting:
    """A wire to an arm at rest that reads at 1 kHz."""

    title, watchdog = "an arm at rest", "it always rests"

    def __init__(self):
        self.begun, self.closed = time.monotonic(), False
        self.number, self.z = 0, 0.3

    def read(self, timeout):
        if self.closed:
            raise ConnectionLostError("closed")
        self.number += 1
        wait = self.begun + 1e-3 * self.number - time.monotonic()
        if wait > timeout:
            self.number -= 1
            raise NoReadingError("", timeout)
        time.sleep(max(wait, 0.0))
        return self.sense(1e-3 * self.number, time.monotonic())

    def sense(self, stamp, received):
        return ArmReading(
            received, stamp, (0.0, 0.0, 1.0), (0.0,) * 3, (0.4, 0.0, self.z), (1.0, 0.0, 0.0, 0.0)
        )

    def tare(self):
        pass

    def begin(self, silence=0.1):
        pass

    def write(self, command):
        pass

    def stop(self):
        pass

    def close(self):
        self.closed = True


def broken(**methods):
    """Such a wire with other methods."""
    return type("Broken", (Resting,), methods)


def late(self, timeout):
    time.sleep(0.6)
    return Resting.read(self, 1.0)


def once(self):
    if self.closed:
        raise RuntimeError("closed twice")
    self.closed = True


BROKEN = {
    "title_and_watchdog_are_texts": broken(watchdog=""),
    "readings_are_finite_with_an_orientation": broken(
        sense=lambda self, a, b: Resting.sense(self, a, b)._replace(quaternion=(0.0,) * 4)
    ),
    "readings_are_fresh": broken(sense=lambda self, a, b: Resting.sense(self, a // 4e-3 * 4e-3, b)),
    "readings_have_arrival_times": broken(sense=lambda self, a, b: Resting.sense(self, a, time.time())),
    "clock_agrees_with_this_computer": broken(sense=lambda self, a, b: Resting.sense(self, 1.2 * a, b)),
    "read_without_waiting_returns_at_once": broken(read=late),
    "zero_speed_keeps_the_arm_at_rest": broken(write=lambda self, _: setattr(self, "z", self.z - 1e-4)),
    "stop_and_close_may_be_repeated": broken(close=once),
    "closed_wire_gives_no_reading": broken(close=lambda self: None),
}


def test_a_wire_that_obeys_all_laws_passes():
    assert [one.failed for one in outcomes(wire_checks(Resting))] == [""] * len(LAWS)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_each_law_sees_its_own_fault(law):
    (check,) = (one for one in wire_checks(BROKEN[law.__name__]) if one.law is law)
    with pytest.raises((AssertionError, RuntimeError)):
        check()


@pytest.mark.parametrize(
    ("address", "name", "where"),
    [
        ("mine:Robot", "mine:Robot", ""),
        ("mine.arms:Robot?10.0.0.2:5000", "mine.arms:Robot", "10.0.0.2:5000"),
        ("rtde:localhost", None, ""),
        ("rdte:192.168.0.10", None, ""),
    ],
)
def test_an_address_names_a_class_or_a_wire(address, name, where):
    assert wire_class_name(address) == (name, where)


def test_a_class_is_not_run_without_permission_and_another_kind_is_named(here):
    (here / "hidden_robot.py").write_text("raise SystemExit(3)\n")
    with pytest.raises(PluginError, match="names code, which would run with your rights"):
        open_wire("hidden_robot:Robot?x")
    with pytest.raises(InputError, match="module:Class"):
        open_wire("rdte:192.168.0.10")


def test_a_class_that_is_no_robot_is_refused_in_one_line(here, capsys):
    cell(here)
    words = ["press", *WORDS, "--gains", str(here / "gains.toml"), "--dry-run", "--wire"]
    (here / "wrong_robot.py").write_text(
        "class Robot:\n    def __init__(self, where):\n        raise OSError(where)\n"
    )
    for wire, said in (
        ("wrong_robot:Robot?10.0.0.2", "wrong_robot.py, line 3: OSError: 10.0.0.2"),
        ("wrong_robot:Rob", "did you mean 'Robot'"),
        ("no_robot:Robot", "there is no module 'no_robot'"),
    ):
        assert main([*words, wire]) == 2
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1


@pytest.mark.real_time
def test_a_press_over_a_class_of_one_s_own(here, capsys, monkeypatch):
    """In the process that every maker's library runs in, so that a halt of the loop brings it to rest."""
    cell(here)
    module = own_class(here, EXAMPLE, monkeypatch)
    words = [
        "press",
        *WORDS,
        "--gains",
        str(here / "gains.toml"),
        "--wire",
        f"{module}:OurWire?{here / 'arm.toml'}",
    ]
    code = main([*words, "--yes", "--json", "--seconds", "2", "--record", "rec"])
    told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.07)
    assert abs(told["bias_N"][2]) < 1.0  # its driver took 2 N for zero
