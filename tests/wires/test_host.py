"""The process that holds a maker's library: it outlives its loop, and brings the arm to rest by itself."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.wires import ArmReading, Command, ConnectionLostError, NoReadingError
from palpate.wires import subprocess_wire as messages
from palpate.wires.host import Host
from wires.slow_cell import ADDRESSES, PATIENCE, WORDS, cell

SENSE = ArmReading(1.0, 2.0, (3.0, 4.0, 5.0), (6.0, 7.0, 8.0), (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0), 0.5)
DOWN = Command((0.0, 0.0, -0.01), (0.1, 0.2, 0.3))


class Arm:
    """Keeps what it is told."""

    title, watchdog, source = "an arm", "none", ""

    def __init__(self):
        self.did, self.lost = [], None
        self.stopped = threading.Event()

    def read(self, timeout):
        time.sleep(timeout)
        if self.lost is not None:
            raise self.lost
        raise NoReadingError("", timeout)

    def tare(self):
        self.did.append("tare")

    def begin(self, silence):
        if silence > 1.0:
            raise InputError("it has another master")
        self.did.append("begin")

    def write(self, command):
        if command.velocity[0] > 0.0:
            raise RuntimeError("a library's error\nin two lines")
        self.did.append(command)

    def stop(self):
        self.did.append("stop")
        self.stopped.set()

    def close(self):
        self.did.append("close")


@contextmanager
def hosted():
    """An arm, and the loop's end of the socket."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.settimeout(5.0)
    arm = Arm()
    thread = threading.Thread(target=Host(arm, theirs).run, daemon=True)
    thread.start()
    try:
        yield arm, ours
    finally:
        ours.close()
        thread.join(5.0)
        theirs.close()
        assert not thread.is_alive()


def begun(ours, silence=0.05):
    ours.send(messages.pack_begin(silence))
    assert ours.recv(messages.MAX_MESSAGE)[0] == messages.BEGUN


def test_messages_carry_what_was_said():
    assert messages.unpack_reading(messages.pack_reading(SENSE)) == SENSE
    assert messages.unpack_command(messages.pack_command(DOWN)) == DOWN
    assert messages.unpack_begin(messages.pack_begin(0.25)) == 0.25


@pytest.mark.real_time
def test_an_arm_without_commands_rests_and_the_loop_is_told():
    with hosted() as (arm, ours):
        begun(ours)
        ours.send(messages.pack_command(DOWN))
        sent = time.monotonic()
        assert arm.stopped.wait(5.0)
        assert time.monotonic() - sent > 0.09
        assert arm.did == ["begin", DOWN, "stop"]
        message = ours.recv(messages.MAX_MESSAGE)
        assert message[0] == messages.LAPSED
        assert messages.unpack_text(message) == "no command came for 100 ms, and the arm was brought to rest"
        ours.send(messages.pack_command(DOWN))  # a loop that wakes up again moves nothing
        time.sleep(0.05)
        assert arm.did == ["begin", DOWN, "stop"]


@pytest.mark.real_time
def test_an_arm_whose_loop_has_died_rests():
    with hosted() as (arm, ours):
        begun(ours, 0.9)
        ours.send(messages.pack_command(DOWN))
        ours.close()
        assert arm.stopped.wait(0.5)


@pytest.mark.real_time
def test_nothing_moves_before_it_began_and_each_wish_is_answered():
    with hosted() as (arm, ours):
        ours.send(messages.pack_command(DOWN))
        ours.send(messages.pack_text(messages.TARE))
        assert ours.recv(messages.MAX_MESSAGE)[0] == messages.TARED
        begun(ours, 0.9)
        ours.send(messages.pack_text(messages.REST))
        assert ours.recv(messages.MAX_MESSAGE)[0] == messages.RESTED
        assert arm.did == ["tare", "begin", "stop"]


@pytest.mark.real_time
@pytest.mark.parametrize(
    ("message", "kind", "says"),
    [
        (messages.pack_begin(2.0), messages.REFUSED, "it has another master"),
        (
            messages.pack_command(DOWN._replace(velocity=(1.0, 0.0, 0.0))),
            messages.UNSENT,
            "a library's error",
        ),
    ],
)
def test_a_librarys_error_is_one_line(message, kind, says):
    with hosted() as (_, ours):
        if message[0] == messages.MOVE:
            begun(ours, 0.9)
        ours.send(message)
        answer = ours.recv(messages.MAX_MESSAGE)
        assert (answer[0], messages.unpack_text(answer)) == (kind, says)


@pytest.mark.real_time
def test_a_wire_that_is_lost_is_told():
    with hosted() as (arm, ours):
        arm.lost = ConnectionLostError("the controller has closed the connection")
        message = ours.recv(messages.MAX_MESSAGE)
        assert (message[0], messages.unpack_text(message)) == (
            messages.FAILED,
            "the controller has closed the connection",
        )


@contextmanager
def mute(address, answers):
    """A controller that accepts, answers the first question and then nothing; yields its sockets."""
    kept = [socket.create_server((address, port)) for port in (30004, 30003, 29999)]

    def run():
        for _ in range(4):
            one, _ = kept[0].accept()
            kept.append(one)
            one.recv(100)
            if answers:
                one.sendall(b"\x00\x04V\x01")

    threading.Thread(target=run, daemon=True).start()
    try:
        yield kept
    finally:
        for one in kept:
            one.close()


@pytest.mark.real_time
@pytest.mark.parametrize("answers", [True, False])
def test_ctrl_c_ends_it_at_once_though_a_ur_accepts_and_never_answers(tmp_path, answers):
    """ur-rtde itself would hold the interpreter, and no Ctrl-C would be heard."""
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this system")
    address = next(ADDRESSES)
    cell(tmp_path)
    words = ["press", "--wire", f"rtde:{address}", "--gains", "gains.toml", *WORDS, "--dry-run"]
    command = [sys.executable, "-m", "palpate", *words]
    with (
        mute(address, answers) as kept,
        subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as press,
    ):
        deadline = time.monotonic() + PATIENCE
        while len(kept) < (5 if answers else 4) and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.5)
        helpers = Path(f"/proc/{press.pid}/task/{press.pid}/children").read_text().split()
        sent = time.monotonic()
        press.send_signal(signal.SIGINT)
        _, err = press.communicate(timeout=PATIENCE)
        took = time.monotonic() - sent
    assert press.returncode == 130, err
    assert (
        took < 3.0
    )  # the end of the interpreter, on a busy machine; ur-rtde itself is waited for without an end
    assert all(not Path(f"/proc/{pid}").exists() for pid in helpers)
