"""A controller that starts again in mid-press, and samples that come late under ROS 2, over the real protocols."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.force import ForceLoop
from palpate.logs import read_record
from wires.slow_cell import ALONE, DOMAIN, KINDS, PATIENCE, child, standing, while_it_presses

pytestmark = pytest.mark.real_time

RELAY = Path(__file__).parent / "dds_relay.py"


def pressed(words, here, seconds="3"):
    """Exit code, the JSON that was printed and the time of the end, of a press in a process of its own."""
    told = subprocess.run(
        [sys.executable, "-m", "palpate", *words, "--yes", "--record", "rec", "--seconds", seconds],
        cwd=here, capture_output=True, text=True, timeout=3.0 * PATIENCE, check=False,
    )  # fmt: skip
    assert "Traceback" not in told.stderr  # ur-rtde has words of its own there when it loses a controller
    return told.returncode, json.loads(told.stdout), time.monotonic()


def kept(here):
    return len(read_record(here / "rec" / "record.parquet"))


@pytest.mark.parametrize("kind", ["franka", "rtde", "ros2"])
def test_a_controller_that_starts_again_in_mid_press_ends_it(folders, here, capsys, kind):
    """Another process takes its place at the same address at once; the press is not taken up with that one."""
    again = []
    with standing(kind, folders, "--gap", "0.05") as (process, words):
        theta = ForceLoop.load(words[words.index("--gains") + 1]).gains.theta

        def restart():
            process.kill()
            process.wait()
            environment = {**os.environ, "CYCLONEDDS_URI": ALONE}
            again.append(subprocess.Popen(process.args, stdout=subprocess.DEVNULL, env=environment))

        try:
            begun = while_it_presses(here / "rec" / "rows.f64", restart)
            code, told, ended = pressed(words, here)
            assert again[0].poll() is None  # it is there, and stays, and is met by the next command
            assert main([*words, "--dry-run"]) == 0
            assert json.loads(capsys.readouterr().out)["rate_Hz"] > 90.0
        finally:
            for one in again:
                one.kill()
                one.wait()
    assert code == 1
    assert "no reading" in told["ended"] or "the controller" in told["ended"], told["ended"]
    assert "\n" not in told["ended"]
    # Then two seconds for the stop and two to close; the rest is a busy machine's.
    assert ended - begun[0] < theta + 7.0
    assert kept(here) == told["lateness"]["ticks"] > 20


def test_jitter_of_samples_under_ros_2_is_borne_and_measured(folders, here):
    pytest.importorskip("cyclonedds", reason="cyclonedds has no wheel for this system")
    with (
        standing("ros2", folders, "--stiffness", "4000") as (_, words),
        child(RELAY, DOMAIN, DOMAIN + 1, "jitter", CYCLONEDDS_URI=ALONE) as (relay, line),
    ):
        words[words.index("--wire") + 1] = KINDS["ros2"][2].format(line=line)
        while_it_presses(here / "rec" / "rows.f64", lambda: relay.send_signal(signal.SIGUSR1))
        code, told, _ = pressed(words, here)
    assert code == 0, told["ended"]
    assert told["lateness"]["p99_s"] > 0.03
    assert told["force_N"] == pytest.approx(10.0, rel=0.1)
    assert kept(here) == told["lateness"]["ticks"]
