"""A slow simulated arm in a process of its own, gains for it, and a wire that is spoiled on the way.

Slow, so that a machine that halts for a moment is in time: 100 Hz, and a lag of some 200 ms.
"""

from __future__ import annotations

import os
import random
import re
import select
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from palpate.force import load_arm
from palpate.press.engines import press_gains
from palpate.wires import sim
from palpate.wires.outcome import UNITS

REHEARSAL = Path(__file__).resolve().parents[2] / "tests" / "rehearsal"
"""Folder of the simulated arms, each of which is a script."""
ARM = """
title = "a slow arm"
rate = 100

[inner]
kind = "position"
bandwidth = 3
damping = 1.0
delay = 0.02
stiffness = 5e4

[sensor]
sampling = 100
noise = 0.1
full_scale = 100

[limits]
speed = 0.25
stiffness = 1e4
"""
SERVO = 'kind = "servo"\nmass = 10\nstiffness = 5e3\ndamping = 1e3\ndelay = 0.15\n'
"""In place of its inner loop: a servo that yields, of a lag of 0.2 s."""
ALONE = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""Of DDS, which is kept on the loopback."""
DOMAIN = 20 + os.getpid() % 180
ADDRESSES = (f"127.{40 + os.getpid() % 200}.{os.getpid() // 200 % 250}.{last}" for last in range(1, 255))
"""Of the loopback, each given away once: a server of an earlier test may still hold its ports."""
PATIENCE = 60.0
"""For which a process may take to start, or to end [s]."""
WORDS = ("--force", "10:N", "--normal", "0,0,-1", "--force-limit", "25:N", "--speed-limit", "50:mm/s",
         "--travel-limit", "30:mm", "--time-limit", "20:s", "--free-stroke", "0:mm")  # fmt: skip


def cell(folder: Path, text: str = ARM, **changed: float) -> Path:
    """Arm and gains as files, with some numbers of the arm changed; returns the gains' path."""
    for name, value in changed.items():
        text = re.sub(rf"(?m)^{name} = .*$", f"{name} = {value}", text)
    (folder / "arm.toml").write_text(text)
    (folder / "gains.toml").write_text(_gains(text, folder / "arm.toml"))
    return folder / "gains.toml"


def own_class(folder: Path, source: Path, monkeypatch) -> str:
    """Copy a module with a wire of one's own into a folder; its name. A test's module is not the next one's."""
    (folder / source.name).write_text(source.read_text(encoding="utf-8"))
    monkeypatch.delitem(sys.modules, source.stem, raising=False)
    return source.stem


def servo_cell(folder: Path) -> Path:
    """A cell of a servo that yields."""
    return cell(folder, re.sub(r"(?s)kind = .*?(?=\n\[sensor)", SERVO, ARM))


def slower_cell(folder: Path, rate: int) -> Path:
    """A cell of a lag of 0.2 s: by its delay at 100 Hz, by its bandwidth at 1 kHz, where gains would take seconds."""
    numbers = (1.5, 0.1) if rate == 100 else (0.7, 0.02)
    return cell(folder, rate=rate, sampling=rate, bandwidth=numbers[0], delay=numbers[1])


_MADE: dict[str, str] = {}


def _gains(text: str, arm_file: Path) -> str:
    """Gains of an arm's text, made once: of a lag of hundreds of ticks that takes seconds."""
    if text not in _MADE:
        _MADE[text] = press_gains(load_arm(str(arm_file)), 10.0).to_toml()
    return _MADE[text]


@contextmanager
def child(*words: str, **environment: str):
    """A Python process of its own; yields it and its first line, and ends it."""
    command = [sys.executable, *map(str, words)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **environment}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            ready, _, _ = select.select([process.stdout], [], [], PATIENCE)
            assert ready, f"{words} says nothing"
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


KINDS = {
    "sim": ("sim_arm.py", (), "{line}"),
    "rtde": ("rtde_arm.py", ("--address", next(ADDRESSES)), "{line}"),
    "franka": ("franka_arm.py", ("--address", next(ADDRESSES)), "{line}"),
    "ros2": (
        "ros2_arm.py", ("--domain", str(DOMAIN)),
        "{line}?wrench=/ft/wrench&pose=/tcp/pose&command=/command&as=twist&wrench-frame=tool&force-sign=reaction",
    ),
}  # fmt: skip
LIBRARIES = {"rtde": "rtde_control", "franka": "franky_sim", "ros2": "cyclonedds", "sim": "numpy"}


@contextmanager
def standing(kind: str, folders: dict[int, Path], *words: str, task: tuple[str, ...] = WORDS):
    """An arm of a kind in a process of its own; yields the process, and the words of a press with the arm."""
    if find_spec(LIBRARIES[kind]) is None:
        pytest.skip(f"{LIBRARIES[kind]} is not installed")
    module, where, address = KINDS[kind]
    folder = folders[1000 if kind == "franka" else 100]
    options = ("--arm", folder / "arm.toml", "--seconds", "90", *where, *words)
    with child(REHEARSAL / module, *options, CYCLONEDDS_URI=ALONE) as (process, line):
        at = ["--wire", address.format(line=line), "--gains", str(folder / "gains.toml")]
        yield process, ["press", *at, *task, "--json"]


def address_in(words: list[str]) -> str:
    """Address of the arm in the words of a press."""
    return words[words.index("--wire") + 1]


def arm(folder: Path, *words: str):
    """The arm's process and its address."""
    return child(REHEARSAL / "sim_arm.py", "--arm", str(folder / "arm.toml"), "--seconds", "60", *words)


def rows_came(path, rows=40) -> bool:
    """Whether a press has kept so many, as soon as it has."""
    for _ in range(round(2.0 * PATIENCE / 0.02)):
        if path.exists():
            numbers = np.fromfile(path)
            if np.count_nonzero(numbers[1 :: len(UNITS)]) >= rows:
                return True
        time.sleep(0.02)
    return False


def wait_for_rows(path) -> None:
    """Until a press has kept some."""
    assert rows_came(path), "the press keeps no rows"


def while_it_presses(rows: Path, act) -> list[float]:
    """Do something as soon as a press keeps rows; what is returned then has the time of it."""
    begun: list[float] = []

    def run():
        if rows_came(rows):  # else the press has failed before, and says so itself
            begun.append(time.monotonic())
            act()

    threading.Thread(target=run, daemon=True).start()
    return begun


def delay_by(fault) -> float:
    """Seconds for which a fault holds a datagram back.

    A fault is `None`, a number of seconds, `lose`, `garble`, or a function of the reading's thirteen values. Those who
    spoil datagrams are given a function that chooses one, of the seconds since the first command and a generator.
    """
    return fault if isinstance(fault, float) else 0.0


def spoiled(data: bytes, fault, rng: random.Random) -> bytes:
    """A datagram of the arm after a fault."""
    if fault == "garble":
        return bytes(rng.randrange(256) for _ in range(len(data)))
    if callable(fault):
        kind, session, body = sim.unpack(data)
        number, stamp, values = sim.read_state(body)
        return sim.pack(kind, session, sim.state(number, stamp, fault(values)))
    return data


class Relay(threading.Thread):
    """Hands datagrams on between a master and an arm, and spoils those that come from the arm.

    Args:
        address: of the arm, `sim:HOST:PORT`.
        fault: of datagrams from the arm, see `delay_by`.
    """

    def __init__(self, address: str, fault):
        super().__init__(daemon=True)
        self._to = ("127.0.0.1", int(address.rpartition(":")[2]))
        self._fault, self._rng = fault, random.Random(0)
        self._near, self._far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self._near.bind(("127.0.0.1", 0))
        self._far.bind(("127.0.0.1", 0))
        self.address = f"sim:127.0.0.1:{self._near.getsockname()[1]}"
        self.commands, self.rests, self.done = [], [], threading.Event()

    @property
    def inwards(self) -> list[float]:
        """Times of the commands into the surface."""
        return [t for t, speed in self._speeds if speed < 0.0]

    @property
    def outwards(self) -> list[float]:
        """Times of the commands out of the surface."""
        return [t for t, speed in self._speeds if speed > 0.0]

    @property
    def _speeds(self) -> list[tuple[float, float]]:
        return [(t, sim.read_move(sim.unpack(data)[2])[1][2]) for t, data in self.commands]

    def run(self):
        master, begun, held = None, None, []
        while not self.done.is_set():
            ready, _, _ = select.select([self._near, self._far], [], [], 0.002)
            now = time.monotonic()
            if self._near in ready:
                data, master = self._near.recvfrom(512)
                if data[8] == 4:
                    begun = begun or now
                    self.commands.append((now, data))
                if data[8] == 5:
                    self.rests.append(now)
                self._far.sendto(data, self._to)
            if self._far in ready:
                data = self._far.recv(512)
                fault = None if begun is None or data[8] != 3 else self._fault(now - begun, self._rng)
                if fault != "lose":
                    held.append((now + delay_by(fault), spoiled(data, fault, self._rng)))
            for due in [one for one in held if one[0] <= now]:
                held.remove(due)
                if master is not None:
                    self._near.sendto(due[1], master)
        self._near.close()
        self._far.close()


@contextmanager
def relayed(address: str, fault):
    """A relay in front of an arm."""
    relay = Relay(address, fault)
    relay.start()
    try:
        yield relay
    finally:
        relay.done.set()
        relay.join(PATIENCE)
