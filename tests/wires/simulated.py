"""A simulated arm in this process, in simulated time: `palpate press --wire` speaks with it, and nothing waits.

The wire, its protocol, the guard and the stop conditions are those of a press with a real arm. Time passes only while
the wire waits for a datagram, so that no machine is too slow for it and each run gives the same.
"""

from __future__ import annotations

import random
import struct
from contextlib import contextmanager
from copy import copy
from functools import partial
from unittest.mock import patch

from sim_arm import ArmServer
from tool_axis_arm import ToolAxisArm

from palpate.force import load_arm
from palpate.force.simulated_press import surface
from palpate.wires import press
from palpate.wires.realtime import realtime_priority
from palpate.wires.sim import MOVE, STATE, STOP, SimWire
from wires.slow_cell import delay_by, spoiled


class SimulatedClock:
    """Stands for a `Clock`: time that passes when it is set [s]."""

    def __init__(self, now: float = 1000.0):
        self.now = now

    def monotonic(self) -> float:
        """The simulated time [s]."""
        return self.now

    since_boot = monotonic

    def sleep(self, seconds: float) -> None:
        """Let time pass [s]."""
        self.now += seconds


class Network:
    """Datagrams between the wires of masters and an arm; the arm ticks as the clock goes on.

    Args:
        arm: the simulated one.
        fault: of datagrams from the arm, see `delay_by`.
    """

    address = "sim:simulated:1"

    def __init__(self, arm: ToolAxisArm, fault):
        self.clock = SimulatedClock()
        self.commands, self.rests = [], []
        self._fault, self._rng = fault, random.Random(0)
        self._ends, self._to_arm, self._on_the_way = [], [], []
        self._server = ArmServer(arm, self)
        self._begun = self.clock.now

    def times(self, sign: float) -> list[float]:
        """Times of the commands whose velocity along the base's third axis has a sign [s]."""
        return [time for time, data in self.commands if sign * struct.unpack_from("<3d", data, 17)[2] > 0.0]

    def open(self, address: str) -> SimWire:
        """The wire of a new master."""
        assert address == self.address
        self._ends.append(WireEnd(self, len(self._ends)))
        return SimWire("simulated", 1, self.clock, self._ends[-1])

    def stranger(self, master: SimWire) -> SimWire:
        """A wire that uses the number of the master's session, from an address of its own."""
        stranger = copy(master)
        stranger._socket = WireEnd(self, len(self._ends))
        self._ends.append(stranger._socket)
        return stranger

    def pass_time(self, end: float) -> bool:
        """Go on to what happens next, at most to this time [s]; false if nothing does."""
        tick = self._begun + self._server.arm.time
        arrival = min((due for due, *_ in self._on_the_way), default=tick)
        if min(tick, arrival) > end:
            self.clock.now = max(end, self.clock.now)
            return False
        self.clock.now = max(min(tick, arrival), self.clock.now)
        if tick <= arrival:
            self._server.tick()
        for due in [one for one in self._on_the_way if one[0] <= self.clock.now]:
            self._on_the_way.remove(due)
            _, data, number = due
            self._ends[number].arrived.append(data)
        return True

    def wait(self, seconds: float) -> None:
        """Let time pass that no wire waits for [s]."""
        end = self.clock.now + seconds
        while self.pass_time(end):
            pass

    def send_to_arm(self, data: bytes, number: int) -> None:
        """A datagram of a master."""
        if data[8] == MOVE:
            self.commands.append((self.clock.now, data))
        if data[8] == STOP:
            self.rests.append(self.clock.now)
        self._to_arm.append((data, number))

    def recvfrom(self, size: int) -> tuple[bytes, int]:
        """As the arm's socket: what has come from a master, and which."""
        if not self._to_arm:
            raise BlockingIOError
        return self._to_arm.pop(0)

    def sendto(self, data: bytes, number: int) -> None:
        """As the arm's socket: a datagram to a master, spoiled on the way once a command has gone out."""
        now, fault = self.clock.now, None
        if self.commands and data[8] == STATE:
            fault = self._fault(now - self.commands[0][0], self._rng)
        if fault != "lose":
            self._on_the_way.append((now + delay_by(fault), spoiled(data, fault, self._rng), number))


class WireEnd:
    """A master's socket: `recv` lets the time pass for which it waits."""

    def __init__(self, network: Network, number: int):
        self._network, self._number = network, number
        self._timeout, self.arrived = 0.0, []

    def connect(self, address):
        """Nothing to do: there is one arm."""

    def settimeout(self, seconds: float) -> None:
        """Seconds for which `recv` waits."""
        self._timeout = seconds

    def send(self, data: bytes) -> None:
        """A datagram to the arm."""
        self._network.send_to_arm(data, self._number)

    def recv(self, size: int) -> bytes:
        """The next datagram; TimeoutError if none comes in time."""
        end = self._network.clock.now + self._timeout
        while not self.arrived:
            if not self._network.pass_time(end):
                raise TimeoutError
        return self.arrived.pop(0)

    def close(self) -> None:
        """Nothing is held."""


@contextmanager
def simulated_arm(
    folder, fault=lambda *_: None, stiffness=5000.0, damping=20.0, gap=0.002, bias=(1.0, -0.5, 2.0)
):
    """A simulated arm for the commands of this process; yields its network, at whose `address` it is.

    Args:
        folder: of a cell.
        fault: of datagrams from the arm, see `delay_by`.
        stiffness: of the surface [N/m].
        damping: of the surface [N s/m].
        gap: between tool and surface at the start [m].
        bias: of the force sensor [N].
    """
    arm = ToolAxisArm(load_arm(str(folder / "arm.toml")), surface(stiffness, damping), gap, bias, 0)
    network = Network(arm, fault)
    with (
        patch("palpate.cli._press_over_wire.open_wire", network.open),
        patch("palpate.cli._press_over_wire.press", partial(press, clock=network.clock)),
        # No priority before the other tests, which run at the same time.
        patch("palpate.cli._press_over_wire.realtime_priority", lambda wanted: realtime_priority(False)),
    ):
        yield network
