"""The wire to a Universal Robots arm, by ur-rtde: it reads over RTDE, and moves the tool by speedL or servoL."""

from __future__ import annotations

import queue
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

from palpate.errors import InputError
from palpate.wires.aside import libraries_aside
from palpate.wires.protocol import Command, LostError, Sense
from palpate.wires.turns import from_rotation_vector

_READ = ["timestamp", "actual_TCP_pose", "actual_TCP_force", "robot_status_bits", "safety_status_bits"]
_POLL = 2e-4
_PORT = 30004
_KNOCK = 2.0
"""For which the first answer may take [s]."""
_ACCELERATION = 1.0
"""Of the tool towards a commanded speed, and of the stop [m/s^2]."""
_WATCHDOG = 10.0
"""Commands a second below which the controller stops the arm by itself [Hz]."""
_LOOKAHEAD, _GAIN = 0.03, 300.0
"""Of servoL: the shortest lookahead that the controller takes [s], and the gain of URScript where none is said."""
_WAYS = ("", "as=speed", "as=servo")
FORM = "rtde:ADDRESS"
_PATIENCE = 2.0
"""For which a call to stop may take [s]."""
_HANGS = 0.5
"""For which a command may take [s]: five times the controller's watchdog, which has stopped the arm by then."""
_ANSWER = 8.0
"""For which opening may take [s]."""


class UrWire:
    """A UR at an address, switched on and in remote control.

    Wrench and pose are the controller's: at the tool centre point, in the base's axes, less the payload that it was
    told of. `begin` and `tare` upload ur-rtde's control script, which ends whatever program ran.

    Args:
        where: address of the controller; with `?as=servo` behind it the tool follows a place by servoL, and not a speed
            by speedL.

    Raises:
        InputError: ur-rtde is missing, or nothing at the address speaks RTDE.
    """

    def __init__(self, where: str):
        address, _, way = where.partition("?")
        if not address or way not in _WAYS:
            raise InputError(f"--wire needs {FORM} or {FORM}?as=servo (or speed), got 'rtde:{where}'")
        try:
            from rtde_receive import RTDEReceiveInterface
        except ImportError:
            raise InputError(
                "this wire needs ur-rtde: pip install 'palpate[ur]' (it has no wheel for some systems)"
            ) from None
        self._address = address
        self._control: Any = None
        self._servo = way == "as=servo"
        self._last, self._tick, self._calls = -1.0, 0.008, _Calls()
        self._turn: list[float] = []
        _check_protocol(address)
        self._receive: Any = _in_time(
            lambda: RTDEReceiveInterface(address, -1.0, _READ),
            f"no UR answers at {address}, port 30004",
            _ANSWER,
        )

    @property
    def title(self) -> str:
        """Its far end."""
        return f"a UR at {self._address}, over RTDE, moved by {'servoL' if self._servo else 'speedL'}"

    @property
    def watchdog(self) -> str:
        """Its stop if this process dies."""
        return f"the controller stops it when no command came for {1e3 / _WATCHDOG:g} ms (ur-rtde's watchdog)"

    def read(self, timeout: float) -> Sense:
        """The next packet of the controller."""
        end = time.monotonic() + timeout
        receive = self._receive
        while True:
            stamp = receive.getTimestamp()
            if stamp != self._last:
                force, pose = receive.getActualTCPForce(), receive.getActualTCPPose()
                if (
                    receive.getTimestamp() == stamp
                ):  # otherwise a packet came between, and this would be of two
                    break
                continue
            if time.monotonic() > end:
                state = "" if receive.isConnected() else "; the controller has closed the connection"
                raise LostError(f"no reading for {1e3 * timeout:.3g} ms{state}")
            time.sleep(_POLL)
        received = time.monotonic()
        if receive.isProtectiveStopped() or receive.isEmergencyStopped():
            raise LostError("the controller has stopped the arm (protective or emergency stop)")
        if 0.0 < stamp - self._last < 0.1:
            self._tick = stamp - self._last
        self._last, self._turn = stamp, self._turn or list(pose[3:])
        x, y, z = pose[:3]
        # The controller gives what the surface exerts on the tool.
        a, b, c, d, e, f = (-value for value in force)
        return Sense(received, stamp, (a, b, c), (d, e, f), (x, y, z), from_rotation_vector(pose[3:]))

    def tare(self) -> None:
        """zero_ftsensor of the controller."""
        self._taken().zeroFtSensor()
        time.sleep(0.05)

    def begin(self) -> None:
        """Upload the control script, and let the controller watch over this process."""
        self._taken().setWatchdog(_WATCHDOG)

    def _taken(self) -> Any:
        if self._control is None:
            from rtde_control import RTDEControlInterface

            libraries_aside()  # of a controller that it has lost, it speaks there
            self._control = _in_time(
                lambda: RTDEControlInterface(self._address),
                f"the UR at {self._address} takes no control script (is it in remote control, with no other master?)",
                _ANSWER,
            )
        return self._control

    def write(self, command: Command) -> None:
        """speedL, or servoL with the orientation that the tool had at first.

        Neither where the connection is lost: ur-rtde would wait for the controller to start again, and send it this.
        """
        if not self._control.isConnected():
            raise LostError("the controller has closed the connection")
        control = self._control
        if self._servo:
            pose = [*command.position, *self._turn]
            sent = self._calls.do(lambda: control.servoL(pose, 0.0, 0.0, self._tick, _LOOKAHEAD, _GAIN))
        else:
            speed = [*command.velocity, 0.0, 0.0, 0.0]
            sent = self._calls.do(lambda: control.speedL(speed, _ACCELERATION, 0.0))
        if isinstance(sent, Exception):
            raise LostError(f"a command could not be sent: {sent}")
        if not sent:
            raise LostError("the controller takes no command: is the arm stopped, or its script ended?")

    def stop(self) -> None:
        """Speed 0, then the script's end."""
        control, self._control = self._control, None
        if (
            control is None or self._calls.stuck
        ):  # a lost connection, and the controller's watchdog has the arm
            return

        def rest() -> None:
            if control.isConnected():
                control.servoStop(_ACCELERATION) if self._servo else control.speedStop(_ACCELERATION)
                control.stopScript()
            control.disconnect()

        _quietly(rest)

    def close(self) -> None:
        """Disconnect."""
        self.stop()
        _quietly(self._receive.disconnect)


class _Calls:
    """Calls of a library that may hang, one at a time in a thread of their own; a daemon, which no exit waits for."""

    def __init__(self) -> None:
        self._asked: queue.SimpleQueue[Callable[[], Any]] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.stuck = False
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            act = self._asked.get()
            try:
                self._answers.put(act())
            except Exception as error:  # noqa: BLE001 - whatever the library throws is the wire's fault
                self._answers.put(error)

    def do(self, act: Callable[[], Any]) -> Any:
        """Result of the call, or its error.

        Raises:
            LostError: it hangs, as ur-rtde does while it waits for a controller that has gone.
        """
        self._asked.put(act)
        try:
            return self._answers.get(timeout=_HANGS)
        except queue.Empty:
            self.stuck = True
            raise LostError(f"the controller takes no command for {1e3 * _HANGS:g} ms") from None


def _check_protocol(address: str) -> None:
    """Ask for RTDE's second protocol, before a library that would wait for ever for another one's answer."""
    try:
        with socket.create_connection((address, _PORT), _KNOCK) as knock:
            knock.settimeout(_KNOCK)
            knock.sendall(b"\x00\x05V\x00\x02")
            answer = knock.recv(4)
    except OSError as error:
        why = error.strerror or str(error) or type(error).__name__
        raise InputError(f"no UR answers at {address}, port {_PORT} ({why}); check the address") from None
    if answer[:3] != b"\x00\x04V":
        raise InputError(f"no UR answers at {address}, port {_PORT}: what is there speaks another protocol")


def _in_time(made: Callable[[], Any], what: str, seconds: float) -> Any:
    """Connection of a library that may wait for ever on a wrong protocol; an InputError then."""
    found: list[Any] = []

    def run() -> None:
        try:
            found.append(made())
        except Exception as error:  # noqa: BLE001 - whatever the library throws is the wire's fault
            found.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    if not found:
        raise InputError(f"{what}: nothing came within {seconds:g} s; check address, port and protocol")
    if isinstance(found[0], Exception):
        raise InputError(f"{what}: {found[0]}")
    return found[0]


def _quietly(act: Callable[[], Any]) -> None:
    """Do what may fail or hang on a wire that is broken."""

    def run() -> None:
        try:
            act()
        except Exception:  # noqa: BLE001 - the wire is gone, and the arm's own watchdog has it
            return

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(_PATIENCE)
