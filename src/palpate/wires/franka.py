"""The wire to a Franka, by pylibfranka in a process of its own (`python -m palpate.wires.franka ADDRESS SIGN SOCKET`).

libfranka waits up to a minute for an answer and lets no other Python thread run meanwhile. In its own process nobody
else has to wait: the wire listens to it for as long as it chooses, and may end it. A loop that is late, or has died,
costs no packet: each state is answered within the tick, with the speed that was commanded last, and after ten ticks of
silence with a speed that falls to 0.
"""

import math
import os
import select
import socket
import sys
import time
from collections import deque
from importlib.util import find_spec
from typing import Any

from palpate.errors import InputError, how_to_install
from palpate.signals.rotations import quaternion_from_columns
from palpate.wires import subprocess_wire as messages
from palpate.wires.host import line, prepare
from palpate.wires.subprocess_wire import SubprocessWire
from palpate.wires.wire import ArmReading, Triple

PORT = 1337
FORM = "franka:ADDRESS"
_SIGNS = {"": 1.0, "force-sign=action": 1.0, "force-sign=reaction": -1.0}


class FrankaWire(SubprocessWire):
    """A Franka at an address, unlocked, with its interface (FCI) activated.

    The wrench is the controller's own estimate from the joints' torques, at the stiffness frame, in the base's axes;
    the pose is that of the end effector that the controller was told of. It follows the speed under joint
    impedance.

    Args:
        where: address of the controller, and `?force-sign=reaction` if its wrench turns out to have the other sign.

    Raises:
        InputError: pylibfranka is missing, or nothing at the address speaks as a Franka does.
    """

    answer_timeout = 5.0

    def __init__(self, where: str):
        address, _, sign = where.partition("?")
        if not address or sign not in _SIGNS:
            raise InputError(
                f"--wire needs {FORM} or {FORM}?force-sign=reaction (or action), got 'franka:{where}'"
            )
        if find_spec("pylibfranka") is None:
            raise InputError(
                f"this wire needs pylibfranka: {how_to_install('palpate[franka]')}; it has wheels for Linux alone"
            )
        super().__init__(
            "franka",
            [address, str(_SIGNS[sign])],
            f"no Franka answers at {address}, port {PORT}; check the address, that FCI is activated in Desk, and that"
            " no other program is connected",
        )


_TICK = 1e-3
_ANSWER = 5e-4
"""Part of a tick in which a loop's answer is waited for [s]."""
_FAREWELL = 1.0
"""Time in which the reason of the end waits for room in the socket [s]; a loop that stands still makes none."""
_REST = 10
"""Ticks without a command after which the arm is brought to rest."""
_ACCELERATION = 2.0
"""Acceleration of the commanded speed [m/s^2]. A reversal within a tick is a jerk of 4000 m/s^3; an FR3's controller
takes 4500 (Franka Control Interface, limits in Cartesian space)."""
_ZERO = (0.0, 0.0, 0.0)
_WATCHDOG = (
    "a second process holds the connection and brings the arm to rest; if that dies too, the controller stops it when"
    " 20 commands in a row are missing (20 ms)"
)


class Driver:
    """Between the controller and the wire.

    Args:
        library: pylibfranka.
        robot: of it, connected.
        wire: the socket of the wire.
        sign: 1 where the controller's wrench is what the tool exerts, -1 where it is the reaction.
    """

    def __init__(self, library: Any, robot: Any, wire: socket.socket, sign: float):
        self._library, self._robot, self._wire, self._sign = library, robot, wire, sign
        self._control: Any = None
        self._wanted, self._speed, self._silent = _ZERO, _ZERO, 0
        self._ending, self._left = False, False
        self._answers: deque[bytes] = deque()

    def run(self) -> None:
        """Until the wire has gone; what libfranka throws ends it."""
        while not self._left or self._control is not None:
            state = self._robot.read_once() if self._control is None else self._control.readOnce()[0]
            self._send(messages.pack_reading(self._sense(state)))
            self._listen()
            if self._control is not None:
                self._write()

    def _sense(self, state: Any) -> ArmReading:
        received, m = time.monotonic(), state.O_T_EE
        a, b, c, d, e, f = (self._sign * float(value) for value in state.O_F_ext_hat_K)
        place = (float(m[12]), float(m[13]), float(m[14]))
        return ArmReading(
            received, state.time.to_sec(), (a, b, c), (d, e, f), place, quaternion_from_columns(m)
        )

    def _answer(self, kind: int, words: str = "") -> None:
        """Answer a request. The wire waits for that answer: it is kept until there is room for it."""
        self._answers.append(messages.pack_text(kind, words))
        self._send()

    def _send(self, *readings: bytes) -> None:
        """Send the answers that are kept, then readings; a reading for which there is no room is dropped."""
        try:
            while self._answers:
                self._wire.send(self._answers[0])
                self._answers.popleft()
            for reading in readings:
                self._wire.send(reading)
        except BlockingIOError:  # nobody has read for a while
            return
        except OSError:
            self._lose()

    def _lose(self) -> None:
        self._left = self._ending = True

    def _listen(self) -> None:
        """Take everything that came; while the arm moves, wait a part of the tick for an answer."""
        self._silent += 1
        due = time.monotonic() + (_ANSWER if self._control is not None and not self._ending else 0.0)
        while not self._left:
            remaining = due - time.monotonic() if self._silent else 0.0
            if not select.select([self._wire], [], [], max(remaining, 0.0))[0]:
                return
            try:
                message = self._wire.recv(messages.MAX_MESSAGE)
            except OSError:
                message = b""
            if message:
                self._obey(message)
            else:
                self._lose()

    def _obey(self, message: bytes) -> None:
        if message[0] == messages.MOVE:
            self._wanted, self._silent = messages.unpack_command(message).velocity, 0
        elif message[0] == messages.REST:
            self._ending = True
            if self._control is None:
                self._answer(messages.RESTED)
        elif message[0] == messages.BEGIN:
            self._begin()
        elif message[0] == messages.TARE:  # the estimate has no zero that could be set
            self._answer(messages.TARED)

    def _begin(self) -> None:
        mode = self._library.ControllerMode.JointImpedance
        try:
            self._control = self._robot.start_cartesian_velocity_control(mode)
        except Exception as error:  # noqa: BLE001 - libfranka throws kinds of no common base
            self._answer(messages.REFUSED, f"the Franka may not be moved: {line(error)}")
            return
        self._wanted, self._speed, self._silent, self._ending = _ZERO, _ZERO, 0, False
        self._answer(messages.BEGUN)

    def _write(self) -> None:
        if self._ending or self._silent > _REST:
            self._wanted = _ZERO
        self._speed = step_towards(self._speed, self._wanted, _ACCELERATION * _TICK)
        x, y, z = self._speed
        command = self._library.CartesianVelocities([x, y, z, 0.0, 0.0, 0.0])
        last = self._ending and self._speed == _ZERO
        command.motion_finished = last
        self._control.writeOnce(command)
        if last:
            self._control = None
            self._answer(messages.RESTED)


def step_towards(old: Triple, new: Triple, step: float) -> Triple:
    """Change a speed towards another, by a step of limited size."""
    change = [b - a for a, b in zip(old, new, strict=True)]
    size = math.sqrt(sum(part * part for part in change))
    if size <= step:
        return new
    x, y, z = (a + step / size * part for a, part in zip(old, change, strict=True))
    return x, y, z


def main() -> None:
    """Connect, say so, and go on until the wire has gone."""
    import pylibfranka

    prepare()
    address, sign, number = sys.argv[1:4]
    wire = socket.socket(fileno=int(number))
    wire.setblocking(False)
    wire.send(messages.pack_text(messages.STARTED))
    try:
        robot = pylibfranka.Robot(address, pylibfranka.RealtimeConfig.kIgnore)
        title = f"a Franka at {address}, over its control interface"
        wire.send(messages.pack_text(messages.READY, f"{title}\n{_WATCHDOG}\n"))
        Driver(pylibfranka, robot, wire, float(sign)).run()
    except Exception as error:  # noqa: BLE001 - likewise
        wire.settimeout(_FAREWELL)
        try:
            wire.send(messages.pack_text(messages.FAILED, f"the controller: {line(error)}"))
        except OSError:
            os._exit(1)
    os._exit(0)  # libfranka's destructors may wait for a controller that has gone


if __name__ == "__main__":
    main()
