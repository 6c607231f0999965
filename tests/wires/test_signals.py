"""Every signal that can be caught ends a press with the arm told to rest, the record whole and a code that says it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from palpate.logs import read_record
from palpate.wires import open_wire
from wires.slow_cell import PATIENCE, WORDS, arm, relayed, standing, wait_for_rows
from wires.test_asking import Terminal

pytestmark = pytest.mark.real_time


def pressing(folder, address, where, *before):
    words = ["press", "--wire", address, "--gains", str(folder / "gains.toml"), *WORDS]
    command = [
        *before,
        sys.executable,
        "-m",
        "palpate",
        *words,
        "--yes",
        "--record",
        "rec",
        "--seconds",
        "10",
    ]
    return subprocess.Popen(command, cwd=where, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("name", ["TERM", "TSTP"])
def test_a_signal_tells_the_arm_to_rest_and_loses_nothing(folder, tmp_path, name):
    """One that would end a process and one that would halt it; that all are noticed alike is tested by the program."""
    number = getattr(signal, f"SIG{name}")
    with arm(folder, "--gap", "0.05") as (_, address), relayed(address, lambda *_: None) as relay:
        with pressing(folder, relay.address, tmp_path) as press:
            wait_for_rows(tmp_path / "rec" / "rows.f64")
            press.send_signal(number)
            sent = time.monotonic()
            out, err = press.communicate(timeout=PATIENCE)
        assert press.returncode == 128 + number, err
        assert f"stopped by the user (SIG{name}); the arm rests" in out
        after = [t for t, _ in relay.commands if t > sent]
        assert relay.rests
        assert not [t for t in relay.inwards if t > sent + 0.2]  # a tick, on a busy machine
        assert not after or after[-1] <= relay.rests[0]
    assert len(read_record(tmp_path / "rec" / "record.parquet")) >= 40


@pytest.mark.parametrize("kind", ["rtde", "franka", "ros2"])
def test_over_each_wire_the_arm_rests_if_the_loop_is_killed(folders, here, kind):
    """The process of the library outlives the loop; of the other signals: test_unload_over_wires.py."""
    with standing(kind, folders, "--gap", "0.05") as (_, words):
        command = [sys.executable, "-m", "palpate", *words, "--yes", "--record", "rec", "--seconds", "10"]
        with subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, text=True) as press:
            wait_for_rows(here / "rec" / "rows.f64")
            press.send_signal(signal.SIGKILL)
            press.communicate(timeout=PATIENCE)
        time.sleep(1.2)  # the slow arm's own lag
        wire = open_wire(words[words.index("--wire") + 1])
        depth = [wire.read(1.0).position[2] for _ in range(40)]
        wire.close()
    assert press.returncode == -signal.SIGKILL
    assert np.ptp(depth[10:]) < 1e-5


def test_a_press_that_stood_still_goes_back_and_not_on(folder, tmp_path):
    with arm(folder, "--gap", "0.05") as (_, address), relayed(address, lambda *_: None) as relay:
        with pressing(folder, relay.address, tmp_path) as press:
            wait_for_rows(tmp_path / "rec" / "rows.f64")
            press.send_signal(signal.SIGSTOP)
            time.sleep(1.5)
            halted = time.monotonic()
            press.send_signal(signal.SIGCONT)
            out, err = press.communicate(timeout=PATIENCE)
        assert press.returncode == 1, err
        assert "this process stood still for 1." in out
        assert not [t for t in relay.inwards if t > halted]
        assert [t for t in relay.outwards if t > halted]
        assert relay.rests
    assert len(read_record(tmp_path / "rec" / "record.parquet")) >= 40


def test_a_terminal_that_hangs_up_in_mid_press_leaves_the_arm_at_rest_and_the_record_whole(folder, tmp_path):
    with arm(folder, "--gap", "0.05") as (_, address), relayed(address, lambda *_: None) as relay:
        words = ["press", "--wire", relay.address, "--gains", folder / "gains.toml", *WORDS, "--yes"]
        terminal = Terminal([*words, "--record", "rec", "--seconds", "10"], tmp_path)
        wait_for_rows(tmp_path / "rec" / "rows.f64")
        os.close(terminal.ours)
        assert terminal.process.wait(PATIENCE) == 128 + signal.SIGHUP
        assert relay.rests
    assert len(read_record(tmp_path / "rec" / "record.parquet")) >= 40


def test_a_press_under_nohup_goes_on_without_its_terminal(folder, tmp_path):
    """Whoever says that a hang-up is not to end it has said so."""
    with arm(folder, "--gap", "0.05") as (_, address), pressing(folder, address, tmp_path, "nohup") as press:
        wait_for_rows(tmp_path / "rec" / "rows.f64")
        press.send_signal(signal.SIGHUP)
        time.sleep(1.0)
        assert press.poll() is None
        press.send_signal(signal.SIGTERM)
        press.communicate(timeout=PATIENCE)
    assert press.returncode == 143
