"""The wire to a Universal Robots arm, by ur-rtde: it reads over RTDE, and moves the tool by speedL or servoL.

ur-rtde waits for a controller for as long as it chooses, and mostly lets no other Python thread run meanwhile: it runs
in a process of its own.
"""

import socket
import time
from importlib.util import find_spec
from typing import Any

from palpate.errors import InputError, how_to_install
from palpate.signals.rotations import quaternion_from_vector
from palpate.wires.subprocess_wire import SubprocessWire
from palpate.wires.wire import (
    SILENCE,
    ArmReading,
    Command,
    ConnectionLostError,
    NoReadingError,
    WatchdogStopError,
)

_READ = ["timestamp", "actual_TCP_pose", "actual_TCP_force", "robot_status_bits", "safety_status_bits"]
_POLL = 2e-4
_PORT = 30004
_CONNECT_TIMEOUT = 2.0
"""Longest time until the first answer [s]."""
_ACCELERATION = 1.0
"""Acceleration of the tool towards a commanded speed, and of the stop [m/s^2]."""
_LOOKAHEAD, _GAIN = 0.03, 300.0
"""Parameters of servoL: the shortest lookahead that the controller takes [s], and URScript's default gain."""
_WAYS = ("", "as=speed", "as=servo")
FORM = "rtde:ADDRESS"


class UrWire(SubprocessWire):
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
        address, _, mode = where.partition("?")
        if not address or mode not in _WAYS:
            raise InputError(f"--wire needs {FORM} or {FORM}?as=servo (or speed), got 'rtde:{where}'")
        if find_spec("rtde_receive") is None:
            raise InputError(
                f"this wire needs ur-rtde: {how_to_install('palpate[ur]')}; it has no wheel for some systems"
            )
        _check_protocol(address)
        super().__init__(
            "host", ["rtde", where], f"no UR answers at {address}, port {_PORT}; check the address"
        )


class RtdeWire:
    """A UR over RTDE in the process of the library.

    Args:
        where: as of `UrWire`.
    """

    source = ""

    def __init__(self, where: str):
        from rtde_receive import RTDEReceiveInterface

        self._address, _, mode = where.partition("?")
        self._servo = mode == "as=servo"
        self._control: Any = None
        self._ended = False
        self._last, self._tick = -1.0, 0.008
        self._turn: list[float] = []
        self._receive: Any = RTDEReceiveInterface(self._address, -1.0, _READ)

    @property
    def title(self) -> str:
        """Name of the far end."""
        return f"a UR at {self._address}, over RTDE, moved by {'servoL' if self._servo else 'speedL'}"

    @property
    def watchdog(self) -> str:
        """The arm's stop if the loop's process dies."""
        return (
            "a second process holds the connection and brings the arm to rest; if that dies too, the controller stops"
            f" it when no command came for {1e3 * SILENCE:g} ms or less (RTDE's watchdog)"
        )

    def read(self, timeout: float) -> ArmReading:
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
                if not receive.isConnected():
                    raise ConnectionLostError("the controller has closed the connection")
                raise NoReadingError(self.source, timeout)
            time.sleep(_POLL)
        received = time.monotonic()
        if receive.isProtectiveStopped() or receive.isEmergencyStopped():
            raise ConnectionLostError("the controller has stopped the arm (protective or emergency stop)")
        if 0.0 < stamp - self._last < 0.1:
            self._tick = stamp - self._last
        self._last, self._turn = stamp, self._turn or list(pose[3:])
        x, y, z = pose[:3]
        # The controller gives what the surface exerts on the tool.
        a, b, c, d, e, f = (-value for value in force)
        return ArmReading(received, stamp, (a, b, c), (d, e, f), (x, y, z), quaternion_from_vector(pose[3:]))

    def tare(self) -> None:
        """zero_ftsensor of the controller."""
        self._take().zeroFtSensor()
        time.sleep(0.05)

    def begin(self, silence: float = SILENCE) -> None:
        """Upload the control script, and let the controller watch over the commands: RTDE's watchdog stops the arm.

        A script that the watchdog has ended is uploaded again.
        """
        if self._ended:
            self.stop()
        self._ended = False
        self._take().setWatchdog(1.0 / min(silence, SILENCE))

    def _take(self) -> Any:
        if self._control is None:
            from rtde_control import RTDEControlInterface

            try:
                self._control = RTDEControlInterface(self._address)
            except RuntimeError as error:
                raise InputError(
                    f"the UR at {self._address} takes no control script (is it in remote control, with no other"
                    f" master?): {error}"
                ) from None
        return self._control

    def write(self, command: Command) -> None:
        """speedL, or servoL with the orientation that the tool had at first.

        Neither where the connection is lost: ur-rtde would wait for the controller to start again, and send it this.
        """
        if not self._control.isConnected():
            raise ConnectionLostError("the controller has closed the connection")
        if self._servo:
            pose = [*command.position, *self._turn]
            sent = self._control.servoL(pose, 0.0, 0.0, self._tick, _LOOKAHEAD, _GAIN)
        else:
            sent = self._control.speedL([*command.velocity, 0.0, 0.0, 0.0], _ACCELERATION, 0.0)
        if not sent:
            self._ended = True
            raise WatchdogStopError(
                "the controller takes no command: is the arm stopped, or its script ended?"
            )

    def stop(self) -> None:
        """Speed 0, then the script's end."""
        control, self._control = self._control, None
        if control is None:
            return
        if control.isConnected():
            control.servoStop(_ACCELERATION) if self._servo else control.speedStop(_ACCELERATION)
            control.stopScript()
        control.disconnect()

    def close(self) -> None:
        """Disconnect from the controller."""
        self.stop()
        self._receive.disconnect()


def _check_protocol(address: str) -> None:
    """Ask for RTDE's second protocol, before a library that would wait for ever for another one's answer."""
    try:
        with socket.create_connection((address, _PORT), _CONNECT_TIMEOUT) as knock:
            knock.settimeout(_CONNECT_TIMEOUT)
            knock.sendall(b"\x00\x05V\x00\x02")
            answer = knock.recv(4)
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        raise InputError(f"no UR answers at {address}, port {_PORT} ({reason}); check the address") from None
    if answer[:3] != b"\x00\x04V":
        raise InputError(f"no UR answers at {address}, port {_PORT}: what is there speaks another protocol")
