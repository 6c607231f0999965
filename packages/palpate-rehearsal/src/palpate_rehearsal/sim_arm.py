"""A simulated arm in a process of its own, at real time: `python -m palpate_rehearsal.sim_arm --stiffness 5000`.

It moves in one direction and listens on the loopback alone. Readings go to one master; without a command for ten ticks
it rests.
"""

import socket
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate_rehearsal.rehearsal import REST, ToolAxisArm, arm_of, ready, ticks, words_of
from palpate_wires import sim as protocol

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


def serve(arm: ToolAxisArm, listening: socket.socket, seconds: float) -> None:
    """Run at real time until the seconds are over.

    Args:
        arm: the simulated arm.
        listening: a bound UDP socket.
        seconds: of the arm's time.
    """
    listening.setblocking(False)
    master, velocity = None, np.zeros(3)
    for _ in ticks(arm, seconds):
        master = _receive(listening, master, arm)
        wanted = np.zeros(3)
        if master is not None:
            master.ticks += 1
            if master.ticks <= _REST:
                wanted = np.array(master.velocity)
        step = _SPEED_UP * arm.world.tick
        velocity = wanted if wanted.any() else velocity - np.clip(velocity, -step, step)
        arm.tick(velocity)
        if master is not None:
            body = protocol.state(master.sent, arm.time, arm.reading())
            master.sent += 1
            _send(listening, protocol.pack(protocol.STATE, master.session, body), master.address)


def _receive(listening: socket.socket, master: Master | None, arm: ToolAxisArm) -> Master | None:
    """Take all that came; a second master is told that the arm is busy."""
    now = time.monotonic()
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
    arm = arm_of(told, tuple(told.bias), told.seed)
    ready(f"sim:127.0.0.1:{listening.getsockname()[1]}")
    serve(arm, listening, told.seconds)


if __name__ == "__main__":
    main()
