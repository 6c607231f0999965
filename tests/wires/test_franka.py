"""A press with a Franka by libfranka itself, against a server of its protocol in another process."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.cli import main
from palpate.logs import read_record
from palpate.signals.rotations import quaternion_from_columns
from palpate.wires import Command, ConnectionLostError, open_wire
from palpate.wires import subprocess_wire as messages
from palpate.wires.franka import Driver, step_towards
from wires.slow_cell import PATIENCE, REHEARSAL, WORDS, child

pytest.importorskip("pylibfranka", reason="pylibfranka has no wheel for this system")
pytest.importorskip("franky_sim", reason="franky-sim is not installed")


@pytest.fixture(scope="module")
def folder(folders):
    return folders[1000]


@contextmanager
def controller(folder, address, *words):
    where = ("--address", address, "--arm", folder / "arm.toml", "--seconds", "60")
    with child(REHEARSAL / "franka_arm.py", *where, *words) as (process, line):
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


@pytest.mark.real_time
def test_it_presses_with_the_force_asked_for(folder, here, capsys, address):
    with controller(folder, address, "--stiffness", "4000"):
        code, told = pressed(capsys, folder, address, "--record", "rec", "--seconds", "3")
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["rate_Hz"] == pytest.approx(1000, rel=0.01)
    assert told["lateness"]["ticks"] > 1000
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) == told["lateness"]["ticks"]
    assert main(["identify", "rec/record.parquet", "--json"]) in {0, 1}
    assert json.loads(capsys.readouterr().out)["working_point"]["stiffness"]["value"] is not None


@pytest.mark.real_time
def test_a_dry_run_moves_nothing(folder, here, capsys, address):
    with controller(folder, address) as process:
        assert main(words_of(folder, address, "--dry-run")) == 0
        told = json.loads(capsys.readouterr().out)
        assert process.poll() is None
    assert told["noise_N"] == pytest.approx(0.1, rel=0.3)
    assert "the controller stops it" in told["plan"][3]
    assert not list(here.iterdir())


@pytest.mark.real_time
def test_a_driver_that_dies_is_told_and_the_controller_has_the_arm(folder, here, address):
    with controller(folder, address, "--gap", "0.05"):
        wire = open_wire(f"franka:{address}")
        wire.begin()
        for _ in range(50):
            wire.read(1.0)
            wire.write(Command((0.0, 0.0, -0.01), (0.0, 0.0, 0.0)))
        wire._driver.kill()
        with pytest.raises(ConnectionLostError, match="the process that held the connection"):
            for _ in range(1000):
                wire.read(1.0)
        wire.close()
        again = open_wire(f"franka:{address}")
        time.sleep(1.0)
        depth = [again.read(1.0).position[2] for _ in range(40)]
        again.close()
    assert np.ptp(depth[10:]) < 1e-5


@pytest.mark.real_time
def test_a_second_master_nothing_at_the_address_and_another_protocol_are_named(
    folder, here, capsys, address, monkeypatch
):
    monkeypatch.setattr("palpate.wires.franka.FrankaWire.answer_timeout", 1.0)
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
        monkeypatch.setattr("palpate.wires.franka.FrankaWire.answer_timeout", 1.0)
        try:
            assert main(words_of(folder, address, "--yes")) == 2
            assert "no other program is connected" in capsys.readouterr().err
        finally:
            first.close()


@pytest.mark.real_time
def test_a_slow_start_of_our_own_process_is_no_arm_that_does_not_answer(folder, here, address, monkeypatch):
    (here / "sitecustomize.py").write_text("import time\ntime.sleep(3.0)\n")
    with controller(folder, address):
        monkeypatch.setenv("PYTHONPATH", str(here))
        monkeypatch.setattr("palpate.wires.franka.FrankaWire.answer_timeout", 2.0)
        open_wire(f"franka:{address}").close()


@pytest.mark.parametrize("where", ["franka", "franka:", "franka:?force-sign=action", "franka:1.2.3.4?sign=x"])
def test_a_wrong_address_is_refused(folder, here, capsys, where):
    words = words_of(folder, "", "--dry-run")
    words[2] = where
    assert main(words) == 2
    err = capsys.readouterr().err
    assert "franka:ADDRESS" in err
    assert err.count("\n") == 1


def test_a_missing_extra_is_named(folder, here, capsys, monkeypatch):
    monkeypatch.setattr("palpate.wires.franka.find_spec", lambda _: None)
    assert main(words_of(folder, "127.0.0.1", "--dry-run")) == 2
    assert "pip install '.[franka]'" in capsys.readouterr().err


def test_a_speed_changes_no_faster_than_the_controller_takes():
    """2 m/s^2, so that a reversal within a tick is a jerk of 4000 m/s^3; an FR3 takes 4500."""
    rng = np.random.default_rng(0)
    speed, before = (0.0, 0.0, 0.0), np.zeros(3)
    for wanted in rng.normal(size=(200, 3)):
        new = step_towards(speed, tuple(wanted), 2e-3)
        change = np.subtract(new, speed) / 1e-3
        assert np.linalg.norm(change) <= 2.0 + 1e-9
        assert np.linalg.norm(change - before) / 1e-3 <= 4000.0 + 1e-6
        speed, before = new, change
    assert step_towards((0.0, 0.0, 0.001), (0.0, 0.0, 0.0), 2e-3) == (0.0, 0.0, 0.0)


def test_a_matrix_by_columns_is_read_as_a_library_reads_it():
    from scipy.spatial.transform import Rotation

    halves = [Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3)]
    for turn in [*Rotation.random(50, rng=np.random.default_rng(0)), Rotation.identity(), *halves]:
        matrix = np.eye(4)
        matrix[:3, :3] = turn.as_matrix()
        found = Rotation.from_quat(quaternion_from_columns(matrix.T.ravel()))
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


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("request_", "answer"),
    [(messages.pack_text(messages.TARE), messages.TARED), (messages.pack_begin(0.1), messages.BEGUN)],
)
def test_an_answer_is_kept_while_nobody_reads(request_, answer):
    """A loop that is busy for a third of a second leaves its socket full of states: what it asks then is answered."""
    modes = SimpleNamespace(JointImpedance=None)
    library = SimpleNamespace(ControllerMode=modes, CartesianVelocities=lambda speeds: SimpleNamespace())
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    theirs.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while True:
            theirs.send(bytes([messages.STATE]))
    driver = Driver(library, RestingRobot(), theirs, 1.0)
    ours.send(request_)
    thread = threading.Thread(target=driver.run)
    thread.start()
    time.sleep(0.05)  # the request is heard while there is no room for the answer
    ours.settimeout(PATIENCE)
    kinds = [ours.recv(messages.MAX_MESSAGE)[0] for _ in range(2000)]  # more than the socket holds
    ours.close()
    thread.join(PATIENCE)
    theirs.close()
    assert kinds.count(answer) == 1
