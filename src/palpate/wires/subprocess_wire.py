"""A wire whose library runs in a process of its own: whatever that library does, this process goes on and may end it.

Makers' libraries wait for answers for as long as they choose, and some let no other Python thread run meanwhile. The
process that holds one also outlives this one: it brings the arm to rest when this process has gone or stands still.
"""

import os
import select
import socket
import struct
import subprocess
import sys
import time

from palpate.errors import InputError
from palpate.wires.realtime import schedule
from palpate.wires.wire import (
    SILENCE,
    ArmReading,
    Command,
    ConnectionLostError,
    NoReadingError,
    WatchdogStopError,
)

STARTED, READY, STATE, FAILED, REFUSED, BEGUN, TARED, RESTED, UNSENT, LAPSED = b"arsfxbtqul"
"""First byte of each message from the process that holds the arm."""
TARE, BEGIN, MOVE, REST = b"TBMR"
"""First byte of each message to that process."""
MAX_MESSAGE = 4096
"""Largest message [bytes]."""

_STATE = struct.Struct("<B16d")
_MOVE = struct.Struct("<B6d")
_BEGIN = struct.Struct("<Bd")


def pack_reading(sense: ArmReading) -> bytes:
    """Message that carries a reading."""
    s = sense
    return _STATE.pack(
        STATE, s.received, s.stamp, *s.force, *s.torque, *s.position, *s.quaternion, s.position_lag
    )


def unpack_reading(message: bytes) -> ArmReading:
    """The reading of a message of that kind."""
    _, received, stamp, *v = _STATE.unpack(message)
    return ArmReading(received, stamp, tuple(v[0:3]), tuple(v[3:6]), tuple(v[6:9]), tuple(v[9:13]), v[13])


def pack_command(command: Command) -> bytes:
    """Message that carries a command."""
    return _MOVE.pack(MOVE, *command.velocity, *command.position)


def unpack_command(message: bytes) -> Command:
    """The command of a message of that kind."""
    _, a, b, c, x, y, z = _MOVE.unpack(message)
    return Command((a, b, c), (x, y, z))


def pack_begin(silence: float) -> bytes:
    """Message that takes the arm over, with the silence after which it is to stop by itself [s]."""
    return _BEGIN.pack(BEGIN, silence)


def unpack_begin(message: bytes) -> float:
    """The silence of a message of that kind [s]."""
    return float(_BEGIN.unpack(message)[1])


def pack_text(kind: int, words: str = "") -> bytes:
    """Message of a kind with some words."""
    return bytes([kind]) + words.encode(errors="replace")[: MAX_MESSAGE - 1]


def unpack_text(message: bytes) -> str:
    """The words of a message."""
    return message[1:].decode(errors="replace")


START_TIMEOUT = 60.0
"""Time for the start of the process on a busy computer [s]; the arm is not asked before."""
ANSWER_TIMEOUT = 12.0
"""Time to open, tare and take over an arm [s]; a UR uploads and starts its script within eight."""
SHUTDOWN_TIMEOUT = 2.0
"""Time to rest and to end [s]; then the process is killed, and the arm's own watchdog stops it."""


_DEAF_AFTER = {UNSENT: ConnectionLostError, LAPSED: WatchdogStopError}
"""Messages after which no command is taken until the next `begin`."""


class SubprocessWire:
    """A wire to an arm, held by another process.

    Args:
        module: of that process, started with the words and the number of a socket.
        words: that name the arm.
        no_answer: error message if nothing answers.

    Raises:
        InputError: the arm does not answer, or its library is missing.
    """

    answer_timeout = ANSWER_TIMEOUT
    """Time to open, tare and take over this arm [s]."""

    def __init__(self, module: str, words: list[str], no_answer: str):
        self._begun = False
        self._deaf: ConnectionLostError | None = None
        """Why commands are not taken any more; None while they are."""
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        command = [sys.executable, "-m", f"palpate.wires.{module}", *words, str(theirs.fileno())]
        # A session of its own: the keys of a terminal reach this process alone, which tells the other.
        self._driver = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            command, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, start_new_session=True
        )
        theirs.close()
        self._link.setblocking(False)
        try:
            self._wait_for(STARTED, START_TIMEOUT)
            about = self._wait_for(READY, self.answer_timeout)
        except BaseException as error:
            self._driver.kill()  # nothing moves yet
            self.close()
            if isinstance(error, ConnectionLostError):
                raise InputError(f"{no_answer} ({error})") from None
            raise
        self.title, self.watchdog, self._source = about.split("\n")

    def read(self, timeout: float) -> ArmReading:
        """The newest reading of the arm."""
        end, reading = time.monotonic() + timeout, None
        while True:
            message = self._next(0.0 if reading is not None else end - time.monotonic())
            if message is None:
                if reading is not None:
                    return reading
                raise NoReadingError(self._source, timeout)
            if message[0] == STATE:
                reading = unpack_reading(message)

    def tare(self) -> None:
        """Tare by the arm's driver."""
        self._ask(pack_text(TARE), TARED)

    def begin(self, silence: float = SILENCE) -> None:
        """Take the arm over; all threads of the library's process get this thread's priority."""
        policy = os.sched_getscheduler(0)
        if policy != os.SCHED_OTHER:
            schedule(self._driver.pid, policy, os.sched_getparam(0).sched_priority)
        self._begun, self._deaf = True, None
        self._ask(pack_begin(silence), BEGUN)

    def write(self, command: Command) -> None:
        """Hand on a command, unless one before was not taken."""
        if self._deaf is not None:
            raise self._deaf
        self._send(pack_command(command))

    def stop(self) -> None:
        """Bring the arm to rest; where that is not answered, end the process, and the arm's own watchdog stops it."""
        if not self._begun:
            return
        self._begun = False
        try:
            self._send(pack_text(REST))
            self._wait_for(RESTED, SHUTDOWN_TIMEOUT)
        except (ConnectionLostError, InputError):
            self._driver.kill()

    def close(self) -> None:
        """Let go, and end the process."""
        self.stop()
        self._link.close()
        try:
            self._driver.wait(SHUTDOWN_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._driver.kill()
            self._driver.wait()

    def _ask(self, message: bytes, answer: int) -> None:
        try:
            self._send(message)
            self._wait_for(answer, self.answer_timeout)
        except ConnectionLostError as error:
            raise InputError(f"{self.title} does not answer: {error}") from None

    def _send(self, message: bytes) -> None:
        try:
            self._link.send(message)
        except OSError as error:
            raise ConnectionLostError(f"a command could not be sent: {error.strerror or error}") from None

    def _wait_for(self, kind: int, timeout: float) -> str:
        """The words of the next message of a kind."""
        end = time.monotonic() + timeout
        while (remaining := end - time.monotonic()) > 0.0:
            message = self._next(remaining)
            if message is None:
                break
            if message[0] == kind:
                return unpack_text(message)
        raise ConnectionLostError(f"nothing came within {timeout:g} s")

    def _next(self, timeout: float) -> bytes | None:
        """The next message; None if none comes in time."""
        if not select.select([self._link], [], [], max(timeout, 0.0))[0]:
            return None
        try:
            message = self._link.recv(MAX_MESSAGE)
        except OSError:
            message = b""
        if not message:
            raise ConnectionLostError("the process that held the connection to the controller has ended")
        if message[0] == FAILED:
            raise ConnectionLostError(unpack_text(message))
        if message[0] in _DEAF_AFTER:
            self._deaf = _DEAF_AFTER[message[0]](unpack_text(message))
            raise self._deaf
        if message[0] == REFUSED:
            raise InputError(unpack_text(message))
        return message
