"""What comes over a real protocol, spoiled on the way: the arm stops in time, nothing is lost, one line says what."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from palpate.force import ForceLoop
from palpate.logs import read_record
from wires.slow_cell import ADDRESSES, PATIENCE, REHEARSAL, WORDS, child, slower_cell, while_it_presses

pytestmark = pytest.mark.real_time

ARM, OWN = next(ADDRESSES), next(ADDRESSES)
LIBRARIES = {"rtde": "rtde_control", "franka": "franky_sim"}
RELAY = Path(__file__).parent / "relay.py"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    made = {kind: tmp_path_factory.mktemp(kind) for kind in LIBRARIES}
    for kind, folder in made.items():
        slower_cell(folder, 1000 if kind == "franka" else 100)
    return made


def spoiled_press(kind, fault, folder, where):
    """Exit code, the JSON that was printed, what else was, the loop's lag and the time from the fault to the end."""
    if find_spec(LIBRARIES[kind]) is None:
        pytest.skip(f"{LIBRARIES[kind]} is not installed")
    theta = ForceLoop.load(folder / "gains.toml").gains.theta
    arm = (REHEARSAL / f"{kind}_arm.py", "--address", ARM, "--arm", folder / "arm.toml", "--seconds", "60")
    with child(*arm, "--gap", "0.05") as (_, line), child(RELAY, kind, OWN, ARM, fault) as (relay, _):
        assert line == f"{kind}:{ARM}"
        words = [
            "press",
            "--wire",
            f"{kind}:{OWN}",
            "--gains",
            folder / "gains.toml",
            *WORDS,
            "--json",
            "--yes",
        ]
        begun = while_it_presses(where / "rec" / "rows.f64", lambda: relay.send_signal(signal.SIGUSR1))
        # A process of its own: what a maker's library does with garbage is not to end the others' tests.
        told = subprocess.run(
            [sys.executable, "-m", "palpate", *map(str, words), "--record", "rec", "--seconds", "3"],
            cwd=where, capture_output=True, text=True, timeout=3.0 * PATIENCE, check=False,
        )  # fmt: skip
        took = time.monotonic() - begun[0]
    return told, theta, took


@pytest.mark.parametrize("fault", ["replay", "garbage"])
@pytest.mark.parametrize("kind", ["rtde", "franka"])
def test_a_spoiled_wire_ends_the_press_in_time_and_loses_nothing(folders, tmp_path, kind, fault):
    told, theta, took = spoiled_press(kind, fault, folders[kind], tmp_path)
    found = json.loads(told.stdout)
    assert told.returncode == 1
    assert found["ended"].count("\n") == 0
    assert any(why in found["ended"] for why in ("no reading", "controller", "late", "clock went back")), (
        found
    )
    # An arm that its watchdog has stopped is taken over again for the retreat, for which a controller may take 12 s.
    # Then two seconds for the stop and two to close; the rest is a busy machine's.
    assert took < theta + 12.0 + 7.0
    assert len(read_record(tmp_path / "rec" / "record.parquet")) == found["lateness"]["ticks"] > 20
