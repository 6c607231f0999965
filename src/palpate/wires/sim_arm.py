"""A simulated arm in a process of its own, at real time: `python -m palpate.wires.sim_arm --stiffness 5000`.

It moves in one direction and listens on the loopback alone. Readings go to one master; without a command for ten ticks
it rests.
"""

from __future__ import annotations

import argparse
import socket
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate._vector import ZERO3
from palpate.force.arm import Arm, load_arm
from palpate.force.touching import BodyState, Surface, World, moved
from palpate.force.worlds import surface, world_of
from palpate.wires import sim_protocol as protocol

START = 0.3
"""Height of the surface in the base [m]."""
_REST = 10
"""Ticks without a command after which it rests."""
_LEFT = 1.0
"""After which silence of a master another may come [s]."""
_SPEED_UP = 0.5
"""Highest change of the commanded speed [m/s^2] on a stop."""


class OneDirection:
    """An arm that moves along its tool's axis, -z of the base, towards a surface.

    Args:
        arm: how it moves and senses.
        touched: the surface.
        gap: between tool and surface at the start [m].
        bias: of the force sensor, in the base [N].
        seed: of the sensor's noise.
    """

    def __init__(self, arm: Arm, touched: Surface, gap: float, bias: tuple[float, float, float], seed: int):
        self.arm, self.surface = arm, touched
        self.world: World = world_of(arm, noise=arm.sensor.noise)
        self.bias = bias
        self._rng = np.random.default_rng(seed)
        self.body: Any = BodyState(-gap, 0.0, 0.0, 0.0, ZERO3, 0.0, 0.0)
        self.command, self.time = -gap, 0.0
        self._line = [-gap if self.world.torque == 0.0 else 0.0] * max(self.world.delay, 1)

    def tick(self, speed: float) -> None:
        """Go on by one tick of the arm's own clock with this commanded speed [m/s]."""
        world = self.world
        self.command += world.tick * min(max(speed, -world.speed), world.speed)
        into = self.command
        if world.torque > 0.0:
            into = world.stiffness * (self.command - self.body.x) - world.second * self.body.v
        held = self._line[0] if world.delay > 0 else into
        self._line = [*self._line[1:], into]
        noise, h = self._rng.standard_normal(8), world.tick / world.steps
        for j in range(world.steps):
            self.body = moved(world, self.surface, self.body, held, self.time + j * h, h, noise, 0)
        self.time += world.tick

    def reading(self) -> tuple[float, ...]:
        """Force, torque, position, quaternion: the tool points down."""
        force = (self.bias[0], self.bias[1], self.bias[2] - self.body.reading)
        return (*force, 0.0, 0.0, 0.0, 0.4, 0.0, START - self.body.x, 1.0, 0.0, 0.0, 0.0)


@dataclass
class Master:
    """Who moves the arm."""

    address: Any
    session: int
    heard: float
    number: int = 0
    speed: float = 0.0
    ticks: int = 0
    sent: int = 0


def serve(arm: OneDirection, listening: socket.socket, seconds: float) -> None:
    """Run at real time until the seconds are over.

    Args:
        arm: the simulated arm.
        listening: a bound UDP socket.
        seconds: of the arm's time.
    """
    listening.setblocking(False)
    begun, master, speed = time.monotonic(), None, 0.0
    while arm.time < seconds:
        wait = begun + arm.time - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        elif wait < -1.0:  # this process was stopped: time is not made up for in a hurry
            begun -= wait
        master = _heard(listening, master, arm.arm.rate)
        wanted = 0.0
        if master is not None:
            master.ticks += 1
            wanted = master.speed if master.ticks <= _REST else 0.0
        step = _SPEED_UP * arm.world.tick
        speed = wanted if wanted else speed - min(max(speed, -step), step)
        arm.tick(speed)
        if master is not None:
            body = protocol.state(master.sent, arm.time, arm.reading())
            master.sent += 1
            _send(listening, protocol.packed(protocol.STATE, master.session, body), master.address)


def _heard(listening: socket.socket, master: Master | None, rate: float) -> Master | None:
    """Take all that came; a second master is told that the arm is busy."""
    now = time.monotonic()
    while True:
        try:
            data, address = listening.recvfrom(512)
        except BlockingIOError:
            return master
        except OSError:  # a master that has gone
            continue
        found = protocol.unpacked(data)
        if found is None:
            continue
        kind, session, body = found
        if kind == protocol.HELLO:
            if master is not None and master.session != session and now - master.heard < _LEFT:
                _send(listening, protocol.packed(protocol.BUSY, session), address)
                continue
            if master is None or master.session != session:
                master = Master(address, session, now)
            _send(listening, protocol.packed(protocol.WELCOME, session, protocol.welcome(rate)), address)
        elif master is not None and session == master.session:
            master.heard = now
            _obeyed(master, kind, body)


def _obeyed(master: Master, kind: int, body: bytes) -> None:
    if kind == protocol.STOP:
        master.speed, master.heard = 0.0, master.heard - _LEFT
    found = protocol.read_move(body) if kind == protocol.MOVE else None
    if found is not None and found[0] > master.number:
        master.number, master.speed, master.ticks = found[0], -found[1][2], 0


def _send(listening: socket.socket, data: bytes, address: Any) -> None:
    try:
        listening.sendto(data, address)
    except OSError:
        return


def main() -> None:
    """Read the words, bind, say where, and serve."""
    words = argparse.ArgumentParser(prog="python -m palpate.wires.sim_arm", description=__doc__)
    words.add_argument("--arm", default="ur5e", help="ur5e, fr3, panda, iiwa14 or a TOML file")
    words.add_argument("--stiffness", type=float, default=5000.0, help="of the surface, N/m")
    words.add_argument("--damping", type=float, default=20.0, help="of the surface, N s/m")
    words.add_argument("--gap", type=float, default=0.002, help="between tool and surface, m")
    words.add_argument("--bias", type=float, nargs=3, default=(1.0, -0.5, 2.0), help="of the sensor, N")
    words.add_argument("--seed", type=int, default=0, help="of the sensor's noise")
    words.add_argument("--port", type=int, default=0, help="UDP, on 127.0.0.1; 0 picks a free one")
    words.add_argument("--seconds", type=float, default=600.0, help="after which it ends")
    told = words.parse_args()
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listening.bind(("127.0.0.1", told.port))
    touched = surface(told.stiffness, told.damping)
    arm = OneDirection(load_arm(told.arm), touched, told.gap, tuple(told.bias), told.seed)
    sys.stdout.write(f"sim:127.0.0.1:{listening.getsockname()[1]}\n")
    sys.stdout.flush()
    serve(arm, listening, told.seconds)


if __name__ == "__main__":
    main()
