"""A simulated arm in a process of its own, at real time: `python tests/rehearsal/sim_arm.py --stiffness 5000`.

It moves in one direction and listens on the loopback alone. Readings go to one master; without a command for ten ticks
it rests.
"""

import socket
from dataclasses import dataclass
from typing import Any

import numpy as np
from tool_axis_arm import REST, ToolAxisArm, arm_of, ready, ticks, words_of

from palpate.wires import sim as protocol

_REST = 10
"""Ticks without a command after which it rests."""
_LEFT = 1.0
"""After which silence of a master another may come [s]."""
_SPEED_UP = 0.5
"""Highest change of the commanded speed [m/s^2] on a stop."""


@dataclass
class Master:
    """Who moves the arm."""

    address: Any
    session: int
    heard: float
    number: int = 0
    velocity: Any = REST
    ticks: int = 0
    sent: int = 0


class ArmServer:
    """The arm at a socket: each tick takes what came, moves the arm and sends a reading.

    Args:
        arm: the simulated arm.
        listening: a bound UDP socket that does not block.
    """

    def __init__(self, arm: ToolAxisArm, listening: socket.socket):
        self.arm, self._listening = arm, listening
        self._master: Master | None = None
        self._velocity = np.zeros(3)

    def tick(self) -> None:
        """Go on by one tick of the arm's own clock."""
        self._master = master = _receive(self._listening, self._master, self.arm)
        wanted = np.zeros(3)
        if master is not None:
            master.ticks += 1
            if master.ticks <= _REST:
                wanted = np.array(master.velocity)
        arm, step = self.arm, _SPEED_UP * self.arm.world.tick
        self._velocity = wanted if wanted.any() else self._velocity - np.clip(self._velocity, -step, step)
        arm.tick(self._velocity)
        if master is not None:
            body = protocol.state(master.sent, arm.time, arm.reading())
            master.sent += 1
            _send(self._listening, protocol.pack(protocol.STATE, master.session, body), master.address)


def _receive(listening: socket.socket, master: Master | None, arm: ToolAxisArm) -> Master | None:
    """Take all that came; a second master is told that the arm is busy."""
    now = arm.time
    while True:
        try:
            data, address = listening.recvfrom(512)
        except BlockingIOError:
            return master
        except OSError:  # a master that has gone
            continue
        found = protocol.unpack(data)
        if found is None:
            continue
        kind, session, body = found
        if kind == protocol.HELLO:
            if master is not None and master.session != session and now - master.heard < _LEFT:
                _send(listening, protocol.pack(protocol.BUSY, session), address)
                continue
            if master is None or master.session != session:
                master = Master(address, session, now)
            _send(
                listening, protocol.pack(protocol.WELCOME, session, protocol.welcome(arm.arm.rate)), address
            )
        elif master is not None and (address, session) == (master.address, master.session):
            master.heard = now
            _obey(master, kind, body)


def _obey(master: Master, kind: int, body: bytes) -> None:
    if kind == protocol.STOP:
        master.velocity, master.heard = REST, master.heard - _LEFT
    found = protocol.read_move(body) if kind == protocol.MOVE else None
    if found is not None and found[0] > master.number:
        master.number, master.ticks = found[0], 0
        master.velocity = found[1]


def _send(listening: socket.socket, data: bytes, address: Any) -> None:
    try:
        listening.sendto(data, address)
    except OSError:
        return


def main() -> None:
    """Read the words, bind, say where, and serve."""
    words = words_of("sim_arm", __doc__)
    words.add_argument("--bias", type=float, nargs=3, default=(1.0, -0.5, 2.0), help="of the sensor, N")
    words.add_argument("--seed", type=int, default=0, help="of the sensor's noise")
    words.add_argument("--port", type=int, default=0, help="UDP, on 127.0.0.1; 0 picks a free one")
    told = words.parse_args()
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listening.bind(("127.0.0.1", told.port))
    listening.setblocking(False)
    server = ArmServer(arm_of(told, tuple(told.bias), told.seed), listening)
    ready(f"sim:127.0.0.1:{listening.getsockname()[1]}")
    for _ in ticks(server.arm, told.seconds):
        server.tick()


if __name__ == "__main__":
    main()
