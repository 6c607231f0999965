"""No force is left after a press over each maker's protocol: at its force limit, at signals, and at its own end."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from palpate.cli import main
from palpate.logs import read_record
from palpate.wires import open_wire
from wires.slow_cell import ARM, PATIENCE, address_in, cell, own_class, standing, while_it_presses
from wires.test_own_wire import EXAMPLE

pytestmark = pytest.mark.real_time

LAYERS = ("--stiffness", "1e5", "--damping", "0", "--layer", "500", "0.02")
WORDS = ("--force", "20:N", "--normal", "0,0,-1", "--force-limit", "40:N", "--speed-limit", "100:mm/s",
         "--travel-limit", "40:mm", "--time-limit", "30:s", "--yes")  # fmt: skip
ALL = ["sim", "rtde", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("franka", "ros2"))]
LATE = re.compile(
    r"late, more than the loop's lag|no reading[^;]* for \S+ ms|stood still for|clock runs too slow"
    r"|communication_constraints_violation"
    r"|readings a second, and the gains|readings came in"
)
"""How a press says that this machine was late; that is no fault of the press, which is to stop then."""
SLOWEST = "60:s"
"""Time limit within which the law reaches a force on the soft layer if it never learns that the layer is soft.

Its bound is 40 kN/m then, and its lag 0.2 s: a time constant of 40e3 * 0.2 / 500 = 16 s, of which three reach 95 %.
When it learns the layer depends on the noise.
"""
QUIET = 0.3
"""Mean of half a second of readings that shows no force [N]: noise of 0.1 N, of which one in a lag is independent."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Cells of a lag of some 0.2 s, of 100 Hz and of libfranka's 1 kHz, whose gains' cap is above the hard layer."""
    made = {rate: tmp_path_factory.mktemp(f"at{rate}") for rate in (100, 1000)}
    text = ARM.replace("stiffness = 1e4", "stiffness = 2e5")
    for rate, folder in made.items():
        cell(folder, text, rate=rate, sampling=rate)
    return made


def pressed(words, capsys):
    """Exit code of a press and what it printed; the test is skipped where the press says that this machine was late."""
    code = main(words)
    printed = capsys.readouterr()
    skip_if_late(json.loads(printed.out)["ended"] if printed.out else printed.err)
    assert printed.out, printed.err
    return code, json.loads(printed.out)


def skip_if_late(said):
    if LATE.search(said):
        pytest.skip(f"this machine was late: {said}")


def force_at_rest(address, told):
    """Force along the press half a second after its end, without the bias of free motion [N]."""
    time.sleep(0.5)
    wire = open_wire(address)
    try:
        return -float(np.mean([wire.read(1.0).force[2] for _ in range(50)]) - told["bias_N"][2])
    finally:
        wire.close()


@pytest.mark.parametrize("kind", ALL)
def test_a_force_limit_leaves_no_force_and_the_next_command_presses(folders, here, capsys, kind):
    with standing(kind, folders, *LAYERS, task=WORDS) as (_, words):
        address = address_in(words)
        code, told = pressed([*words, "--record", "rec"], capsys)
        assert code == 1
        assert "above the limit of 40 N" in told["ended"]
        assert told["unloaded"]["free_motion"], told["unloaded"]
        assert abs(force_at_rest(address, told)) < QUIET
        time.sleep(1.2)  # the stand-in takes another master a second after the last one's silence
        softer = [{"20:N": "8:N", "30:s": SLOWEST}.get(w, w) for w in words]
        code, again = pressed([*softer, "--seconds", "1"], capsys)
        assert code == 0, again["ended"]
        assert again["touched"]
        assert abs(force_at_rest(address, again)) < QUIET
    record = read_record(here / "rec" / "record.parquet")
    back = record["phase"] == 4.0
    assert back.sum() > 20
    assert record["speed"][back].min() >= -0.1 * (1.0 + 1e-9)
    assert json.loads((here / "rec" / "press.json").read_text())["unloaded"] == told["unloaded"]


@pytest.mark.parametrize(
    ("kind", "name"), [("sim", "INT"), ("rtde", "TERM"), ("franka", "INT"), ("ros2", "TERM")]
)
def test_a_signal_in_contact_leaves_no_force_and_a_second_one_changes_nothing(folders, here, kind, name):
    number = getattr(signal, f"SIG{name}")
    with standing(kind, folders, "--stiffness", "4000", task=WORDS) as (_, words):
        address = address_in(words)
        command = [sys.executable, "-m", "palpate", *words, "--record", "rec", "--seconds", "20"]
        with subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, text=True) as press:
            wait_for_force(here / "rec" / "rows.f64", 10.0)
            for _ in range(3):
                press.send_signal(number)
                time.sleep(0.05)
            out, _ = press.communicate(timeout=PATIENCE)
        told = json.loads(out)
        skip_if_late(told["ended"])
        assert press.returncode == 128 + number
        assert told["ended"].startswith("stopped by the user")
        assert told["unloaded"]["free_motion"], told["unloaded"]
        assert abs(force_at_rest(address, told)) < QUIET


@pytest.mark.parametrize("kind", ALL)
def test_a_press_that_is_to_hold_rests_in_contact(folders, here, capsys, kind):
    with standing(kind, folders, "--stiffness", "4000", task=WORDS) as (_, words):
        code, told = pressed([*words, "--seconds", "2", "--end", "hold"], capsys)
        assert code == 0, told["ended"]
        assert force_at_rest(address_in(words), told) == pytest.approx(20.0, rel=0.1)
        assert "rests in contact" in told["unloaded"]["how"]


@pytest.mark.long
def test_a_wire_of_ones_own_is_unloaded_too(tmp_path, here, capsys, monkeypatch):
    cell(tmp_path, ARM.replace("stiffness = 1e4", "stiffness = 2e5"))
    address = f"{own_class(here, EXAMPLE, monkeypatch)}:OurWire?{tmp_path / 'arm.toml'}"
    words = ["press", "--wire", address, "--gains", str(tmp_path / "gains.toml"), *WORDS, "--json"]
    words[words.index("40:mm")] = "4:mm"
    code, told = pressed([*words, "--seconds", "1", "--record", "rec"], capsys)
    assert code == 1
    assert told["unloaded"]["free_motion"], told
    record = read_record(here / "rec" / "record.parquet")
    assert abs(record["force_sampled"][-20:].mean()) < QUIET


def test_a_connection_that_is_lost_in_contact_is_named_with_the_arms_own_stop(folders, here, capsys):
    with standing("sim", folders, "--gap", "0.05", task=WORDS) as (process, words):
        while_it_presses(here / "rec" / "rows.f64", process.kill)
        assert main([*words, "--record", "rec"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["unloaded"]["how"].startswith("could not unload: the wire broke")
    assert told["unloaded"]["how"].endswith("the simulated arm rests after 10 ticks without a command")


def wait_for_force(rows, force):
    """Until a press has felt so much [N]."""
    from palpate.wires.outcome import UNITS

    column = list(UNITS).index("force_sampled")
    end = time.monotonic() + 2.0 * PATIENCE
    while time.monotonic() < end:
        if rows.exists() and (np.fromfile(rows).reshape(-1, len(UNITS))[:, column] > force).any():
            return
        time.sleep(0.02)
    raise AssertionError("the press feels no force")
