"""Interface between a force loop and an arm, simulated or real: readings and commands."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from palpate.arrays import Array


class Sense(NamedTuple):
    """Readings of an arm at a tick, all in its base's axes."""

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
        """The readings at this tick; waits for the tick if the arm has its own clock."""
        ...

    def write(self, command: Command) -> None:
        """How the tip is to move from now on."""
        ...

    def close(self) -> None:
        """Leaves the arm at rest."""
        ...
