"""The wire to a Franka, by pylibfranka in a process of its own: the controller's state in, speeds of the tool out."""

from __future__ import annotations

import os
import select
import socket
import subprocess
import sys
import time
from importlib.util import find_spec

from palpate.errors import InputError
from palpate.wires import franka_link as link
from palpate.wires.protocol import Command, LostError, Sense

PORT = 1337
FORM = "franka:ADDRESS"
_SIGNS = {"": 1.0, "force-sign=action": 1.0, "force-sign=reaction": -1.0}
_ANSWER = 5.0
"""For which connecting may take [s]."""
_PATIENCE = 1.0
"""For which coming to rest, and ending, may take [s]."""


class FrankaWire:
    """A Franka at an address, unlocked, with its interface (FCI) activated.

    The wrench is the controller's own estimate from the joints' torques, at the stiffness frame, in the base's axes;
    the pose is that of the end effector that the controller was told of. It follows the speed under joint
    impedance.

    Args:
        where: address of the controller, and `?force-sign=reaction` if its wrench turns out to have the other sign.

    Raises:
        InputError: pylibfranka is missing, or nothing at the address speaks as a Franka does.
    """

    def __init__(self, where: str):
        self._address, _, sign = where.partition("?")
        if not self._address or sign not in _SIGNS:
            raise InputError(
                f"--wire needs {FORM} or {FORM}?force-sign=reaction (or action), got 'franka:{where}'"
            )
        if find_spec("pylibfranka") is None:
            raise InputError(
                "this wire needs pylibfranka: pip install 'palpate[franka]' (it has wheels for Linux alone)"
            )
        self._begun = False
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        words = [self._address, str(theirs.fileno()), str(_SIGNS[sign])]
        command = [sys.executable, "-m", "palpate.wires.franka_driver", *words]
        self._driver = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            command, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, start_new_session=True
        )
        theirs.close()
        self._link.setblocking(False)
        try:
            self._answered(link.READY, _ANSWER)
        except LostError as error:
            self.close()
            raise InputError(
                f"no Franka answers at {self._address}, port {PORT} ({error}); check the address, that FCI is activated"
                " in Desk, and that no other program is connected"
            ) from None
        except BaseException:
            self.close()
            raise

    @property
    def title(self) -> str:
        """Its far end."""
        return f"a Franka at {self._address}, over its control interface"

    @property
    def watchdog(self) -> str:
        """Its stop if this process dies."""
        return (
            "a second process holds the connection and brings the arm to rest; if that dies too, the controller stops"
            " it when 20 commands in a row are missing (20 ms)"
        )

    def read(self, timeout: float) -> Sense:
        """The newest state."""
        end = time.monotonic() + timeout
        found = None
        while True:
            message = self._next(0.0 if found is not None else end - time.monotonic())
            if message is None:
                if found is not None:
                    return found
                raise LostError(f"no reading for {1e3 * timeout:.3g} ms")
            if message[0] == link.STATE:
                found = link.read_state(message)

    def _next(self, timeout: float) -> bytes | None:
        """The next message; None if none comes in time."""
        if not select.select([self._link], [], [], max(timeout, 0.0))[0]:
            return None
        try:
            message = self._link.recv(link.LARGEST)
        except OSError:
            message = b""
        if not message:
            raise LostError("the process that held the connection to the controller has ended")
        if message[0] == link.FAILED:
            raise LostError(f"the controller: {link.read_text(message)}")
        return message

    def _answered(self, kind: int, timeout: float) -> None:
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            message = self._next(left)
            if message is None:
                break
            if message[0] == link.REFUSED:
                raise InputError(f"the Franka at {self._address} may not be moved: {link.read_text(message)}")
            if message[0] == kind:
                return
        raise LostError(f"nothing came within {timeout:g} s")

    def tare(self) -> None:
        """The estimate has no zero that could be set."""

    def begin(self) -> None:
        """Start a motion by speeds of the tool, with this process's own priority."""
        policy = os.sched_getscheduler(0)
        if policy != os.SCHED_OTHER:
            os.sched_setscheduler(self._driver.pid, policy, os.sched_getparam(0))
        self._send(link.text(link.BEGIN, ""))
        self._begun = True
        try:
            self._answered(link.BEGUN, _ANSWER)
        except LostError as error:
            raise InputError(f"the Franka at {self._address} does not begin to move: {error}") from None

    def write(self, command: Command) -> None:
        """A speed, no faster reached than the controller takes."""
        self._send(link.move(command.velocity))

    def _send(self, message: bytes) -> None:
        try:
            self._link.send(message)
        except OSError as error:
            raise LostError(f"a command could not be sent: {error.strerror or error}") from None

    def stop(self) -> None:
        """Slow down, then end the motion; where that is not answered, end the process, and the controller stops."""
        if not self._begun:
            return
        self._begun = False
        try:
            self._send(link.text(link.REST, ""))
            self._answered(link.RESTED, _PATIENCE)
        except (LostError, InputError):
            self._driver.kill()

    def close(self) -> None:
        """Disconnect."""
        self.stop()
        self._link.close()
        try:
            self._driver.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._driver.kill()
            self._driver.wait(_PATIENCE)
