"""A loop's motion as a map of vectors, and its derivative: the bench's own tick, differentiated as it stands."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from palpate.analysis.flatten import leaves, rebuilt, vector
from palpate.arrays import Array
from palpate.bench.row import COLUMNS
from palpate.bench.tick import Loop, LoopState, compiled_march
from palpate.controllers.any_controller import AnyController

FLAGS = ("plant.surface.contact",)
"""Leaves that are yes or no: they stand still."""
PLACE, RATE, ACCELERATION, FORCE = 1e-9, 1e-6, 1e-3, 1e-4
"""How far a leaf is moved to either side [m or rad; the same a tick, and a tick squared; N].

Small enough that a surface of 1e6 N/m stays in contact while an unstable loop enlarges it, and large enough to
outdo the rounding of a place that it changes within a step of the physics. FORCE is also for what controllers remember.
"""
STEPS = {
    "plant.qd": RATE,
    "plant.surface.rate": RATE,
    "force": FORCE,
    "conditioning.velocity": RATE,
    "conditioning.rate": RATE,
    "conditioning.twist": RATE,
    "conditioning.acceleration": ACCELERATION,
    "conditioning.force": FORCE,
    "controller": FORCE,
}
"""By the path that a leaf's begins with; all others are places."""
SHOWN = {"q1": PLACE, "q2": PLACE, "q3": PLACE, "force": FORCE, "force_measured": FORCE}
"""Columns of the record that are differentiated too, each with the step that it is measured in."""
CHUNK, LARGE = 25, 1e4
"""Ticks that are differentiated at once, and steps that a step may grow to in them."""


class Moving(NamedTuple):
    """The fields of a loop's state that affect its motion; the others observe, or are constant in force control."""

    plant: Any
    force: Any
    conditioning: Any
    controller: Any


class Motion:
    """The motion of a loop around a state.

    Args:
        loop: as `still` leaves it.
        state: source of the fields that do not move.
    """

    def __init__(self, loop: Loop, state: LoopState):
        self.loop, self._base = loop, state
        self._tree = _moving(state)
        names, numbers = zip(*leaves(self._tree), strict=True)
        self._all = np.array(numbers)
        acts = acting(loop.controller)
        rigid = loop.plant.mode.frequency == 0.0
        still = [*FLAGS, *(name for name in names if rigid and name.startswith("plant.bent."))]
        live = [i for i, name in enumerate(names) if name not in still and not _idle(name, acts)]
        self._live = np.array(live)
        self.names = tuple(names[i] for i in live)
        self.steps = np.array([_step(name) for name in self.names])

    @property
    def start(self) -> Array:
        """The vector of the state itself, shape (n,)."""
        return np.array(self._all[self._live])

    def state(self, x: Array) -> LoopState:
        """The loop's state for a vector of shape (n,)."""
        numbers = self._all.copy()
        numbers[self._live] = x
        moved = rebuilt(self._tree, iter(numbers.tolist()))
        return self._base._replace(**moved._asdict())

    def after(self, x: Array, first: int, ticks: int) -> tuple[Array, Array]:
        """The vector so many ticks later, and their rows, shape (ticks, columns); the first is tick number `first`."""
        out = np.empty((ticks, len(COLUMNS)))
        state = compiled_march(self.loop, self.state(x), first, np.zeros(ticks), out)
        return vector(_moving(state))[self._live], out

    def derivative(self, x: Array, first: int, ticks: int) -> tuple[Array, Array]:
        """d x(later)/d x, shape (n, n), and d `SHOWN`/d x of each tick, shape (ticks, len(SHOWN), n).

        Over many ticks, or where a step grows too far to be small, it is the product over two spans.
        """
        if ticks <= CHUNK:
            A, C = self._differences(x, first, ticks)
            if ticks == 1 or np.abs(A / self.steps[:, None] * self.steps).max() < LARGE:
                return A, C
        half = ticks // 2
        (A, C), (B, D) = (self.derivative(x, first, half), self.derivative(x, first + half, ticks - half))
        return B @ A, np.concatenate([C, D @ A])

    def _differences(self, x: Array, first: int, ticks: int) -> tuple[Array, Array]:
        """The same by central differences."""
        shown = [list(COLUMNS).index(name) for name in SHOWN]
        A, C = np.empty((len(x), len(x))), np.empty((ticks, len(shown), len(x)))
        for i, step in enumerate(self.steps):
            moved = np.zeros(len(x))
            moved[i] = step
            (ahead, rows), (behind, others) = (self.after(x + d, first, ticks) for d in (moved, -moved))
            A[:, i] = (ahead - behind) / (2.0 * step)
            C[:, :, i] = (rows[:, shown] - others[:, shown]) / (2.0 * step)
        return A, C


def acting(controller: Any, path: str = "controller") -> str:
    """Path of the state of the controller that acts, where several share one type."""
    if not isinstance(controller, AnyController):
        return path
    if controller.chosen == 1:
        return acting(controller.first, f"{path}.0")
    return acting(controller.second, f"{path}.1")


def _idle(name: str, acts: str) -> bool:
    """Whether a leaf belongs to a controller beside the one that acts."""
    return name.startswith("controller") and name != acts and not name.startswith(f"{acts}.")


def _step(name: str) -> float:
    """How far a leaf is moved."""
    return next((step for path, step in STEPS.items() if name == path or name.startswith(f"{path}.")), PLACE)


def _moving(state: LoopState) -> Moving:
    return Moving._make(getattr(state, field) for field in Moving._fields)
