"""The linear model of bench and control law about a state of rest: does it come back to it, how, and how fast?

A loop's motion is a map of flat vectors, and its derivative is that of the bench's own tick, as it stands. Constant
modes are separated from the moving ones.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.bench.force_input import COLUMNS
from palpate.bench.plant import Loop, LoopState, compiled_march
from palpate.controllers.controller import AnyController


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a tree with its path: ("plant.q.x", 0.1); the elements of arrays are leaves of their own."""
    for name, branch in _branches(tree):
        inside = f"{path}.{name}" if path else name
        if isinstance(branch, tuple | np.ndarray):
            yield from leaves(branch, inside)
        else:
            yield inside, float(branch)


def rebuilt(tree: Any, numbers: Iterator[float]) -> Any:
    """A tree of the same shape with other numbers, in the order of `leaves`; its arrays are new ones."""
    if isinstance(tree, np.ndarray):
        return np.array([next(numbers) for _ in range(tree.size)]).reshape(tree.shape)
    if not isinstance(tree, tuple):
        return next(numbers)
    parts = [rebuilt(branch, numbers) for _, branch in _branches(tree)]
    return tree._make(parts) if hasattr(tree, "_make") else tuple(parts)


def vector(tree: Any) -> Array:
    """The numbers of a tree in the order of `leaves`, shape (n,)."""
    numbers: list[float] = []
    _gather(tree, numbers)
    return np.array(numbers)


def _gather(tree: Any, numbers: list[float]) -> None:
    for branch in tree:
        if isinstance(branch, tuple):
            _gather(branch, numbers)
        elif isinstance(branch, np.ndarray):
            numbers.extend(branch.ravel().tolist())
        else:
            numbers.append(branch)


def _branches(tree: Any) -> list[tuple[str, Any]]:
    if isinstance(tree, np.ndarray):
        return [(str(i), number) for i, number in enumerate(tree.ravel())]
    return list(zip(getattr(tree, "_fields", map(str, range(len(tree)))), tree, strict=True))


FLAGS = ("plant.surface.contact",)
"""Numbers that are yes or no: they are not differentiated."""
PLACE, RATE, ACCELERATION, FORCE = 1e-9, 1e-6, 1e-3, 1e-4
"""Steps of the central differences, by kind of number [m or rad; the same per tick, and per tick squared; N].

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
"""Step by the beginning of a number's path; all others are places."""
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


class LoopMotion:
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
        """The derivative by central differences."""
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
    """True if a number belongs to a controller that does not act."""
    return name.startswith("controller") and name != acts and not name.startswith(f"{acts}.")


def _step(name: str) -> float:
    """Step of the central difference for a number."""
    return next((step for path, step in STEPS.items() if name == path or name.startswith(f"{path}.")), PLACE)


def _moving(state: LoopState) -> Moving:
    return Moving._make(getattr(state, field) for field in Moving._fields)


CONSTANT = 1e-5
"""Change in a period, in steps of `Motion`, under which a combination of the state is taken for one that never changes.

Above what differences leave of an exact zero, below what an integrator of a minute's time constant does.
"""


def change(scaled: Array) -> tuple[Array, Array, Array]:
    """transition - 1 in units of the steps, by its singular values, those of constants left out: U, s, V^T.

    Where the tip stuck to the surface, an integral that nothing feeds, weights that make no difference: such a
    combination of the state has the eigenvalue 1, which says nothing of stability. The range of transition - 1 is
    an invariant subspace without them.
    """
    U, s, Vt = np.linalg.svd(scaled - np.eye(len(scaled)))
    moves = s > CONSTANT
    return U[:, moves], s[moves], Vt[moves]


def moving(transition: Array, steps: Array) -> tuple[Complex, Complex]:
    """Eigenvalues of all that moves, shape (m,), and their vectors, shape (m, n).

    Args:
        transition: of the state over a period, shape (n, n).
        steps: units of the state's elements that make it well scaled, shape (n,).
    """
    states = effective_states(transition)
    scaled = (transition / steps[:, None] * steps)[np.ix_(states, states)]
    into, _, _ = change(scaled)
    values, inside = np.linalg.eig(into.T @ scaled @ into)
    vectors = np.zeros((len(values), len(steps)), complex)
    vectors[:, states] = (steps[states, None] * (into @ inside)).T
    return values.astype(complex), vectors


def effective_states(transition: Array) -> NDArray[np.intp]:
    """Indices of states that affect others or decay alone: not of integrals without effect."""
    others = transition - np.diag(np.diag(transition))
    return np.flatnonzero(others.any(axis=0) | (np.abs(np.diag(transition) - 1.0) > CONSTANT))


@dataclass(frozen=True)
class Mode:
    """A mode of the loop.

    Args:
        growth: factor from tick to tick; below 1 it dies away.
        frequency: [Hz]; 0 where it does not swing.
        rate: of growth [1/s]; negative where it dies away.
    """

    growth: float
    frequency: float
    rate: float

    @property
    def damping(self) -> float:
        """Damping ratio: 1 where it does not swing, negative where it grows."""
        return -self.rate / math.hypot(self.rate, 2.0 * math.pi * self.frequency)


@dataclass(frozen=True)
class LinearLoop:
    """The loop about a state of rest, to first order; `linearise` makes it.

    The force sensor samples at its own rate, so the loop is periodic in time: it repeats itself after `period` ticks
    (25 at 480 Hz against 1 kHz). Its eigenvalues are those of a whole period (Floquet's), exact but for the rounding
    of differences; `margins` takes the average over a period.

    Args:
        motion: the loop as a map of vectors.
        x: the state of rest, shape (n,), as `motion.names` has it.
        period: in ticks.
        transition: d x(a period later)/d x, shape (n, n).
        outputs: d `SHOWN`/d x at each tick of a period, shape (period, len(SHOWN), n).
        pose: of the tip at rest [m, m, rad], shape (3,).
        force: on the surface at rest [N].
        torque: of the motors at rest [N m], shape (3,).
    """

    motion: LoopMotion
    x: Array
    period: int
    transition: Array
    outputs: Array
    pose: Array
    force: float
    torque: Array

    @property
    def tick(self) -> float:
        """Time between ticks [s]."""
        return float(self.motion.loop.tick)

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The loop's own motions, the one that grows fastest first; a swing is one mode."""
        modes = []
        for value, v in zip(*self._floquet, strict=True):
            if value.imag >= 0.0 and abs(value) > 0.0:
                growth = float(abs(value)) ** (1.0 / self.period)
                modes.append(Mode(growth, self._frequency(value, v), math.log(growth) / self.tick))
        return tuple(sorted(modes, key=lambda mode: -mode.growth))

    @cached_property
    def eigenvalues(self) -> Complex:
        """Eigenvalues per tick, averaged over a period, shape (m,), the largest first; an oscillation has two.

        Constant modes (the tip's contact point, an integral without input) are left out.
        """
        z = [m.growth * np.exp(2j * math.pi * m.frequency * self.tick) for m in self.modes]
        return np.array([w for v in z for w in ([v, v.conjugate()] if abs(v.imag) > 1e-9 * abs(v) else [v])])

    @property
    def growth(self) -> float:
        """Factor per tick of the fastest mode: the spectral radius."""
        return float(np.abs(self._floquet[0]).max()) ** (1.0 / self.period)

    @property
    def stable(self) -> bool:
        """True if every small disturbance decays."""
        return self.growth**self.period <= 1.0 + CONSTANT

    @cached_property
    def ticks(self) -> tuple[Array, ...]:
        """d x(a tick later)/d x at each tick of a period, each of shape (n, n); `transition` is their product.

        Ticks with the same sampling moment of the sensor are equal and differentiated once.
        """
        sensor: Any = self.motion.loop.force.sensor
        steps = self.motion.loop.steps
        known: dict[tuple[bool, ...], Array] = {}
        ticks = []
        for k in range(self.period):
            alike = tuple(bool(sensor.samples_at(k * steps + j)) for j in range(steps))
            if alike not in known:
                known[alike] = self.motion.derivative(self.x, k, 1)[0]
            ticks.append(known[alike])
        return tuple(ticks)

    @cached_property
    def _floquet(self) -> tuple[Complex, Complex]:
        """Eigenvalues of a period, shape (m,), and their vectors, shape (m, n)."""
        return moving(self.transition, self.motion.steps)

    def _frequency(self, value: complex, v: Complex) -> float:
        """Frequency of a mode [Hz]: a period gives its phase modulo whole turns; the ticks within it give the turns."""
        exponent = np.log(value) / self.period
        outputs = (self.outputs @ v) / np.array(list(SHOWN.values()))
        outputs *= np.exp(-exponent * np.arange(self.period))[:, None]
        power = (np.abs(np.fft.fft(outputs, axis=0)) ** 2).sum(axis=1)
        cycles = exponent.imag / (2.0 * math.pi) + np.fft.fftfreq(self.period)[int(np.argmax(power))]
        return float(abs((cycles + 0.5) % 1.0 - 0.5)) / self.tick
