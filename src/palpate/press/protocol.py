"""What a force loop asks of an arm, simulated or real: to be read, and to be told how to move."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from palpate.arrays import Array


class Sense(NamedTuple):
    """What an arm says at a tick, everything in its base's axes."""

    time: float  # of the reading [s]
    force: Array  # wrench that the tip exerts on the environment: force [N], moment about the tip [N m], shape (6,)
    pose: Array  # of the tip, homogeneous, shape (4, 4)
    joints: Array  # positions [rad, m], shape (n,)


class Command(NamedTuple):
    """How the tip is to move until the next one: one of the two, the other None."""

    velocity: Array | None = None  # of the tip [m/s], and its turning [rad/s], in the base's axes, shape (6,)
    pose: Array | None = None  # of the tip, homogeneous, shape (4, 4)


class Wire(Protocol):
    """An arm on the other end of a wire, or in a simulation."""

    def read(self) -> Sense:
        """What the arm says at this tick; waits for the tick where the arm has a clock of its own."""
        ...

    def write(self, command: Command) -> None:
        """How the tip is to move from now on."""
        ...

    def close(self) -> None:
        """Leaves the arm at rest."""
        ...
