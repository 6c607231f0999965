"""A press with a Franka by libfranka itself, against a server of its protocol in another process."""

from __future__ import annotations

import contextlib
import json
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.cli import main
from palpate.logs import read_record
from palpate.wires import Command, LostError
from palpate_wires import open_wire, realtime
from palpate_wires.franka_driver import Driver, nearer
from palpate_wires.orientation import from_matrix_by_columns
from wires.slow_cell import PATIENCE, WORDS, child, slower_cell, wait_for_rows, while_it_presses

pytest.importorskip("pylibfranka", reason="pylibfranka has no wheel for this system")
pytest.importorskip("franky_sim", reason="franky-sim is not installed")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("franka")
    # At its controller's 1 kHz; slower than the others', so that a loop at this rate may be late on a busy machine.
    slower_cell(made, 1000)
    return made


@contextmanager
def controller(folder, address, *words):
    where = ("--address", address, "--arm", folder / "arm.toml", "--seconds", "60")
    with child("-m", "palpate_rehearsal.franka_arm", *where, *words) as (process, line):
        assert line == f"franka:{address}"
        yield process


def words_of(folder, address, *more):
    where = ("--wire", f"franka:{address}", "--gains", str(folder / "gains.toml"))
    return ["press", *where, *WORDS, "--json", *more]


def pressed(capsys, folder, address, *more):
    code = main(words_of(folder, address, "--yes", *more))
    printed = capsys.readouterr()
    assert printed.err == ""
    return code, json.loads(printed.out)


@pytest.mark.long
def test_it_presses_with_the_force_asked_for(folder, here, capsys, address):
    for name in (
        "first",
        "second",
        "rec",
    ):  # a machine that is busy is late, and then the arm is stopped: as it should be
        with controller(folder, address, "--stiffness", "4000"):
            code, told = pressed(capsys, folder, address, "--record", name, "--seconds", "3")
        if "late" not in told["ended"] and "no reading" not in told["ended"]:
            break
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["rate_Hz"] == pytest.approx(1000, rel=0.01)
    assert told["lateness"]["ticks"] > 1000
    record = read_record(here / name / "record.parquet")
    assert len(record) == told["lateness"]["ticks"]
    assert main(["identify", f"{name}/record.parquet", "--json"]) in {0, 1}
    assert json.loads(capsys.readouterr().out)["working_point"]["stiffness"]["value"] is not None


def test_a_dry_run_moves_nothing(folder, here, capsys, address):
    with controller(folder, address) as process:
        assert main(words_of(folder, address, "--dry-run")) == 0
        told = json.loads(capsys.readouterr().out)
        assert process.poll() is None
    assert told["noise_N"] == pytest.approx(0.1, rel=0.3)
    assert "the controller stops it" in told["plan"][3]
    assert not list(here.iterdir())


@pytest.mark.long
def test_a_controller_that_dies_ends_the_press(folder, here, capsys, address):
    with controller(folder, address, "--gap", "0.05") as process:
        while_it_presses(here / "rec" / "rows.f64", process.kill)
        code, told = pressed(capsys, folder, address, "--record", "rec", "--seconds", "10")
    assert code == 1
    assert "the controller: " in told["ended"] or "no reading for" in told["ended"]
    assert len(read_record(here / "rec" / "record.parquet")) > 20
    with controller(folder, address):  # one that has started again is met anew
        assert main(words_of(folder, address, "--dry-run")) == 0


@pytest.mark.long
def test_the_arm_rests_when_its_master_dies(folder, here, address):
    words = [
        w for w in words_of(folder, address, "--yes", "--record", "rec", "--seconds", "10") if w != "--json"
    ]
    with controller(folder, address, "--gap", "0.05"):
        with subprocess.Popen([sys.executable, "-m", "palpate", *words], stdout=subprocess.DEVNULL) as master:
            wait_for_rows(here / "rec" / "rows.f64")
            master.kill()
        wire = open_wire(f"franka:{address}")
        time.sleep(1.0)  # the slow arm's own lag
        depth = [wire.read(1.0).position[2] for _ in range(40)]
        wire.close()
    assert np.ptp(depth[10:]) < 1e-5


@pytest.mark.long
def test_a_driver_that_dies_is_told_and_the_controller_has_the_arm(folder, here, address):
    with controller(folder, address, "--gap", "0.05"):
        wire = open_wire(f"franka:{address}")
        wire.begin()
        for _ in range(50):
            wire.read(1.0)
            wire.write(Command((0.0, 0.0, -0.01), (0.0, 0.0, 0.0)))
        wire._driver.kill()
        with pytest.raises(LostError, match="the process that held the connection"):
            for _ in range(1000):
                wire.read(1.0)
        wire.close()
        again = open_wire(f"franka:{address}")
        time.sleep(1.0)
        depth = [again.read(1.0).position[2] for _ in range(40)]
        again.close()
    assert np.ptp(depth[10:]) < 1e-5


@pytest.mark.long
def test_a_second_master_nothing_at_the_address_and_another_protocol_are_named(
    folder, here, capsys, address, monkeypatch
):
    monkeypatch.setattr("palpate_wires.franka.FrankaWire.answer", 1.0)
    assert main(words_of(folder, address, "--dry-run")) == 2
    assert f"no Franka answers at {address}, port 1337" in capsys.readouterr().err
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind((address, 1337))
        other.listen()
        begun = time.monotonic()
        assert main(words_of(folder, address, "--dry-run")) == 2
        assert time.monotonic() - begun < PATIENCE
        assert "nothing came within 1 s" in capsys.readouterr().err
    monkeypatch.undo()
    monkeypatch.chdir(here)
    with controller(folder, address):
        first = open_wire(f"franka:{address}")
        monkeypatch.setattr("palpate_wires.franka.FrankaWire.answer", 1.0)
        try:
            assert main(words_of(folder, address, "--yes")) == 2
            assert "no other program is connected" in capsys.readouterr().err
        finally:
            first.close()


@pytest.mark.long
def test_a_slow_start_of_our_own_process_is_no_arm_that_does_not_answer(folder, here, address, monkeypatch):
    (here / "sitecustomize.py").write_text("import time\ntime.sleep(3.0)\n")
    with controller(folder, address):
        monkeypatch.setenv("PYTHONPATH", str(here))
        monkeypatch.setattr("palpate_wires.franka.FrankaWire.answer", 2.0)
        open_wire(f"franka:{address}").close()


def test_gains_of_another_rate_are_refused(here, tmp_path, folder, capsys, address):
    text = (folder / "gains.toml").read_text().replace("rate = 1000", "rate = 500")
    (tmp_path / "other.toml").write_text(text)
    words = words_of(folder, address, "--dry-run")
    words[words.index("--gains") + 1] = str(tmp_path / "other.toml")
    with controller(folder, address):
        assert main(words) == 2
    assert "1000 readings a second, and the gains are for 500" in capsys.readouterr().err


@pytest.mark.parametrize("where", ["franka", "franka:", "franka:?force-sign=action", "franka:1.2.3.4?sign=x"])
def test_a_wrong_address_is_refused(folder, here, capsys, where):
    words = words_of(folder, "", "--dry-run")
    words[2] = where
    assert main(words) == 2
    err = capsys.readouterr().err
    assert "franka:ADDRESS" in err
    assert err.count("\n") == 1


def test_a_missing_extra_is_named(folder, here, capsys, monkeypatch):
    monkeypatch.setattr("palpate_wires.franka.find_spec", lambda _: None)
    assert main(words_of(folder, "127.0.0.1", "--dry-run")) == 2
    assert "pip install 'palpate[franka]'" in capsys.readouterr().err


def test_a_speed_changes_no_faster_than_the_controller_takes():
    """2 m/s^2, so that a reversal within a tick is a jerk of 4000 m/s^3; an FR3 takes 4500."""
    rng = np.random.default_rng(0)
    speed, before = (0.0, 0.0, 0.0), np.zeros(3)
    for wanted in rng.normal(size=(200, 3)):
        new = nearer(speed, tuple(wanted), 2e-3)
        change = np.subtract(new, speed) / 1e-3
        assert np.linalg.norm(change) <= 2.0 + 1e-9
        assert np.linalg.norm(change - before) / 1e-3 <= 4000.0 + 1e-6
        speed, before = new, change
    assert nearer((0.0, 0.0, 0.001), (0.0, 0.0, 0.0), 2e-3) == (0.0, 0.0, 0.0)


def test_a_matrix_by_columns_is_read_as_a_library_reads_it():
    from scipy.spatial.transform import Rotation

    halves = [Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3)]
    for turn in [*Rotation.random(50, rng=np.random.default_rng(0)), Rotation.identity(), *halves]:
        matrix = np.eye(4)
        matrix[:3, :3] = turn.as_matrix()
        found = Rotation.from_quat(from_matrix_by_columns(matrix.T.ravel()))
        assert (found * turn.inv()).magnitude() < 1e-7


class RestingRobot:
    """A robot of pylibfranka that is at rest and gives its states at once, and its motion under way."""

    def __init__(self):
        self.time, self.O_T_EE = SimpleNamespace(to_sec=lambda: 0.0), np.eye(4).ravel()
        self.O_F_ext_hat_K, self.commands = (0.0,) * 6, []

    def read_once(self):
        return self

    def start_cartesian_velocity_control(self, mode):
        return self

    def readOnce(self):
        return self, None

    def writeOnce(self, command):
        self.commands.append(command)


@pytest.mark.parametrize(
    ("request_", "answer"),
    [(realtime.text(realtime.TARE), realtime.TARED), (realtime.begin(0.1), realtime.BEGUN)],
)
def test_an_answer_is_kept_while_nobody_reads(request_, answer):
    """A loop that is busy for a third of a second leaves its socket full of states: what it asks then is answered."""
    modes = SimpleNamespace(JointImpedance=None)
    library = SimpleNamespace(ControllerMode=modes, CartesianVelocities=lambda speeds: SimpleNamespace())
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    theirs.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while True:
            theirs.send(bytes([realtime.STATE]))
    driver = Driver(library, RestingRobot(), theirs, 1.0)
    ours.send(request_)
    thread = threading.Thread(target=driver.run)
    thread.start()
    time.sleep(0.05)  # the request is heard while there is no room for the answer
    ours.settimeout(PATIENCE)
    kinds = [ours.recv(realtime.LARGEST)[0] for _ in range(2000)]  # more than the socket holds
    ours.close()
    thread.join(PATIENCE)
    theirs.close()
    assert kinds.count(answer) == 1
