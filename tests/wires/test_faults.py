"""What a wire can do to a press, of each kind: silence, jitter, a controller that starts again, an extra missing."""

from __future__ import annotations

import json
import signal
import sys
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

from palpate.cli import main
from palpate.force import ForceLoop
from palpate.logs import read_record
from palpate.logs.read import read_run
from wires.simulated import simulated_arm
from wires.slow_cell import DOMAIN, KINDS, WORDS, standing, while_it_presses


@contextmanager
def simulated(folders, **world):
    """An arm in simulated time, and the words of a press with it."""
    with simulated_arm(folders[100], **world) as network:
        gains = str(folders[100] / "gains.toml")
        yield network, ["press", "--wire", network.address, "--gains", gains, *WORDS, "--json"]


def said(capsys):
    """The JSON that was printed, and nothing beside it."""
    printed = capsys.readouterr()
    assert printed.err == ""
    return json.loads(printed.out)


@pytest.mark.real_time
@pytest.mark.parametrize("kind", ["sim", "rtde", "franka", "ros2"])
def test_silence_ends_the_press_in_time_and_loses_nothing(folders, here, capsys, kind):
    """The makers' libraries themselves would wait for a second, or for a minute for the answer to a stop."""
    with standing(kind, folders, "--gap", "0.05") as (process, words):
        theta = ForceLoop.load(words[words.index("--gains") + 1]).gains.theta
        halted = while_it_presses(here / "rec" / "rows.f64", lambda: process.send_signal(signal.SIGSTOP))
        code = main([*words, "--yes", "--record", "rec", "--seconds", "10"])
        ended = time.monotonic()
    told = said(capsys)
    assert code == 1
    took = ended - halted[0]
    assert told["ended"].startswith("no reading"), told["ended"]
    assert f"for {1e3 * theta:.3g} ms" in told["ended"]
    # Then at most two seconds for the stop, two to close, and three are a busy machine's.
    assert took < theta + 7.0
    assert len(read_record(here / "rec" / "record.parquet")) == told["lateness"]["ticks"] > 20


@pytest.mark.real_time
@pytest.mark.parametrize("kind", ["rtde", "franka"])
def test_jitter_that_it_can_bear_is_measured_and_told(folders, here, capsys, kind):
    """The controller halts for 60 ms, a quarter of the loop's lag, three times a second; of ROS 2: test_restarts.py."""
    with standing(kind, folders, "--stiffness", "4000") as (process, words):
        done = threading.Event()

        def halt():
            while not done.wait(0.3):
                process.send_signal(signal.SIGSTOP)
                time.sleep(0.06)
                process.send_signal(signal.SIGCONT)

        while_it_presses(here / "rec" / "rows.f64", halt)
        try:
            code = main([*words, "--yes", "--record", "rec", "--seconds", "5"])
        finally:
            done.set()
    # The law of a Franka's cell may show that the halted readings drift.
    told = json.loads(capsys.readouterr().out) if kind == "franka" else said(capsys)
    late = told["lateness"]
    assert late["most_s"] > 0.03
    if kind == "franka" and "communication_constraints_violation" in told["ended"]:
        return  # a controller of 1 kHz that misses 20 commands ends the motion itself: as it should be
    assert code == 0, told["ended"]
    assert late["p50_s"] <= late["p99_s"] <= late["p99.9_s"] <= late["most_s"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize(
    ("address", "module", "extra"),
    [
        ("rtde:127.0.0.1", "rtde_receive", "ur"),
        (f"ros2:{DOMAIN}?" + KINDS["ros2"][2].partition("?")[2], "cyclonedds.idl", "ros2"),
    ],
)
def test_a_missing_extra_is_named(folders, here, capsys, monkeypatch, address, module, extra):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, "palpate.wires.ros2_messages", raising=False)
    words = ["press", "--wire", address, "--gains", str(folders[100] / "gains.toml"), *WORDS, "--dry-run"]
    assert main(words) == 2
    assert f"pip install '.[{extra}]'" in capsys.readouterr().err


def test_a_tool_that_was_weighed_is_compared_and_its_mass_is_kept(folders, here, capsys):
    """A kilogram on a sensor with a bias; then the sensor is zeroed, and that is told."""
    tool = {
        "mass": 1.0, "mass_std": 0.01, "weight": [0.0, 0.0, 9.81], "weight_std": 0.05, "bias": [1.0, 0.5, 0.3],
        "bias_std": 0.02, "noise": 0.1, "wrench_frame": '"tool"',
    }  # fmt: skip
    (here / "tool.toml").write_text("".join(f"{name} = {value}\n" for name, value in tool.items()))
    notes = []
    # What the sensor shows with the tool pointing down: its bias turned, and the weight; as the tool exerts it.
    for bias in ((-1.0, 0.5, -9.51), (0.0, 0.0, 0.0)):
        with simulated(folders, stiffness=4000.0, bias=bias) as (_, words):
            plain = [w for w in words if w != "--json"]
            assert main([*plain, "--dry-run", "--payload", "tool.toml"]) == 0
            notes.append(capsys.readouterr().out)
    assert "the sensor shows the tool as it was weighed" in notes[0]
    assert "the sensor was zeroed since" in notes[1]
    with simulated(folders, stiffness=4000.0) as (_, words):
        assert main([*words, "--yes", "--payload", "tool.toml", "--record", "rec", "--seconds", "1.5"]) == 0
    capsys.readouterr()
    record = read_record(here / "rec" / "record.parquet")
    assert record.meta["wire"]["tool_mass_kg"] == [1.0, 0.01]
    assert read_run(here / "rec" / "record.parquet").meta["tool_mass_kg"] == (1.0, 0.01)


def test_options_that_were_saved_make_the_command_short_and_never_move_an_arm(folders, here, capsys):
    with simulated(folders) as (network, words):
        assert main([*words, "--dry-run", "--save-options", "cell.toml"]) == 0
        kept = (here / "cell.toml").read_text()
        assert "wire" not in kept
        assert "dry-run" not in kept
        assert "\nforce =" not in kept  # to palpate identify, which takes the same file, it is a column
        capsys.readouterr()
        network.wait(1.2)  # the arm takes another master a second after the last one's silence
        at = words[words.index("--wire") + 1]
        short = ["press", "--wire", at, "--force", "10:N", "--options", "cell.toml", "--dry-run", "--json"]
        assert main(short) == 0
        assert said(capsys)["rate_Hz"] == pytest.approx(100, rel=0.05)
    (here / "cell.toml").write_text(kept + 'wire = "sim:127.0.0.1:4000"\n')
    assert main(["press", "--force", "10:N", "--options", "cell.toml"]) == 2
    assert "wire" in capsys.readouterr().err
    assert np.all([not p.is_dir() for p in here.iterdir()])
