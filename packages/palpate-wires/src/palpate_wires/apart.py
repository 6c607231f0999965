"""A wire whose library runs in a process of its own: whatever that library does, this process goes on and may end it.

Makers' libraries wait for answers for as long as they choose, and some let no other Python thread run meanwhile. The
process that holds one also outlives this one: it brings the arm to rest when this process has gone or stands still.
"""

import os
import select
import socket
import subprocess
import sys
import time

from palpate.errors import InputError
from palpate.wires import SILENCE, ArmReading, Command, LostError, SilentError
from palpate_wires import realtime
from palpate_wires.realtime import schedule

_START = 60.0
"""For which the start of our own process may take on a busy computer [s]: the arm has not been asked yet."""
_ANSWER = 12.0
"""For which opening, taring and beginning may take: a script of a UR is uploaded and started within eight [s]."""
_PATIENCE = 2.0
"""For which coming to rest, and ending, may take [s]; then the process is killed, and the arm's own watchdog has it."""


class ApartWire:
    """A wire to an arm, held by another process.

    Args:
        module: of that process, started with the words and the number of a socket.
        words: that name the arm.
        lacking: the remedy if nothing answers, for an error message.

    Raises:
        InputError: the arm does not answer, or its library is missing.
    """

    answer = _ANSWER
    """For which opening may take [s]."""

    def __init__(self, module: str, words: list[str], lacking: str):
        self._begun = False
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        command = [sys.executable, "-m", f"palpate_wires.{module}", *words, str(theirs.fileno())]
        # A session of its own: the keys of a terminal reach this process alone, which tells the other.
        self._driver = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            command, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, start_new_session=True
        )
        theirs.close()
        self._link.setblocking(False)
        try:
            self._answer(realtime.STARTED, _START)
            about = self._answer(realtime.READY, self.answer)
        except BaseException as error:
            self._driver.kill()  # nothing moves yet
            self.close()
            if isinstance(error, LostError):
                raise InputError(f"{lacking} ({error})") from None
            raise
        self.title, self.watchdog, self._source = about.split("\n")

    def read(self, timeout: float) -> ArmReading:
        """The newest reading of the arm."""
        end, found = time.monotonic() + timeout, None
        while True:
            message = self._next(0.0 if found is not None else end - time.monotonic())
            if message is None:
                if found is not None:
                    return found
                raise SilentError(self._source, timeout)
            if message[0] == realtime.STATE:
                found = realtime.read_state(message)

    def tare(self) -> None:
        """As the arm's driver does it."""
        self._ask(realtime.text(realtime.TARE), realtime.TARED)

    def begin(self, silence: float = SILENCE) -> None:
        """Take the arm over; all threads of the library's process get this thread's priority."""
        policy = os.sched_getscheduler(0)
        if policy != os.SCHED_OTHER:
            schedule(self._driver.pid, policy, os.sched_getparam(0).sched_priority)
        self._begun = True
        self._ask(realtime.begin(silence), realtime.BEGUN)

    def write(self, command: Command) -> None:
        """Hand on a command."""
        self._send(realtime.move(command))

    def stop(self) -> None:
        """Bring the arm to rest; where that is not answered, end the process, and the arm's own watchdog stops it."""
        if not self._begun:
            return
        self._begun = False
        try:
            self._send(realtime.text(realtime.REST))
            self._answer(realtime.RESTED, _PATIENCE)
        except (LostError, InputError):
            self._driver.kill()

    def close(self) -> None:
        """Let go, and end the process."""
        self.stop()
        self._link.close()
        try:
            self._driver.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._driver.kill()
            self._driver.wait()

    def _ask(self, message: bytes, answer: int) -> None:
        try:
            self._send(message)
            self._answer(answer, self.answer)
        except LostError as error:
            raise InputError(f"{self.title} does not answer: {error}") from None

    def _send(self, message: bytes) -> None:
        try:
            self._link.send(message)
        except OSError as error:
            raise LostError(f"a command could not be sent: {error.strerror or error}") from None

    def _answer(self, kind: int, timeout: float) -> str:
        """The words of the next message of a kind."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            message = self._next(left)
            if message is None:
                break
            if message[0] == kind:
                return realtime.read_text(message)
        raise LostError(f"nothing came within {timeout:g} s")

    def _next(self, timeout: float) -> bytes | None:
        """The next message; None if none comes in time."""
        if not select.select([self._link], [], [], max(timeout, 0.0))[0]:
            return None
        try:
            message = self._link.recv(realtime.LARGEST)
        except OSError:
            message = b""
        if not message:
            raise LostError("the process that held the connection to the controller has ended")
        if message[0] == realtime.FAILED:
            raise LostError(realtime.read_text(message))
        if message[0] == realtime.REFUSED:
            raise InputError(realtime.read_text(message))
        return message
