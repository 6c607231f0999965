"""The contact models that are fitted and compared. Each turns a position into the columns of a regression."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.identification.filters import Chain, low_pass_once

Array = NDArray[np.float64]


@dataclass
class Motion:
    """The position of a log as the models see it: filtered on demand, and kept at the rows that are fitted.

    Args:
        chain: the filter.
        position: raw, counted into the surface from `origin`, shape (n,).
        rows: the samples that are fitted, shape (m,).
        bonded: whether the probe is fixed to the surface.
        noise: standard deviation of the position's own white noise; it makes every column of the regression uncertain.
    """

    chain: Chain
    position: Array
    rows: NDArray[np.intp]
    bonded: bool
    noise: float = 0.0
    _kept: dict[tuple[int, float], Array] = field(default_factory=dict)
    _powers: dict[int, Array] = field(default_factory=dict)

    def moved(self, derivative: int, lag: float) -> Array:
        """Filtered position or a derivative of it at t - lag, shape (m,)."""
        key = (derivative, lag)
        if key not in self._kept:
            if len(self._kept) > 24:
                self._kept.clear()
            self._kept[key] = self.filtered(self.position, derivative, lag)
        return self._kept[key]

    def filtered(self, signal: Array, derivative: int, lag: float) -> Array:
        """Any raw signal through the same chain, at t - lag, shape (m,)."""
        return self.chain(signal, derivative, lag)[self.rows]

    def power(self, n: int, lag: float) -> Array:
        """The position squared or cubed, filtered, at t - lag, shape (m,)."""
        if n not in self._powers:
            self._powers[n] = self.position * self.position * (self.position if n == 3 else 1.0)
        return self.filtered(self._powers[n], 0, lag)

    @property
    def ones(self) -> Array:
        """The column of the offset, shape (m,)."""
        return np.ones(len(self.rows))


@dataclass(frozen=True)
class Knob:
    """A parameter that a model is not linear in: its start values, its limits and how it is stepped."""

    name: str
    starts: tuple[float, ...]
    low: float
    high: float
    step: float
    logarithmic: bool = False


Columns = Callable[[Motion, dict[str, float], float], list[Array]]


@dataclass(frozen=True)
class Model:
    """A contact model that is linear in all parameters but its knobs.

    Args:
        name: the word for `--model`.
        linear: names of the parameters that its columns stand for; `offset` is the last one.
        columns: from a motion, the knobs and the force's lag [s] to the columns, each of shape (m,).
        knobs: what it is not linear in, scaled to the log at hand.
        positive: parameters that no passive surface has below zero.
    """

    name: str
    linear: tuple[str, ...]
    columns: Columns
    knobs: tuple[Knob, ...] = ()
    positive: tuple[str, ...] = ("K", "B", "M")

    @property
    def derivatives(self) -> dict[str, int]:
        """Which parameters multiply which derivative of the position."""
        return {name: k for name, k in (("K", 0), ("B", 1), ("M", 2)) if name in self.linear}


def _kelvin_voigt(motion: Motion, _knobs: dict[str, float], lag: float) -> list[Array]:
    """f = K x + B v."""
    return [motion.moved(0, lag), motion.moved(1, lag), motion.ones]


def _kelvin_voigt_mass(motion: Motion, _knobs: dict[str, float], lag: float) -> list[Array]:
    """f = K x + B v + M a."""
    return [motion.moved(0, lag), motion.moved(1, lag), motion.moved(2, lag), motion.ones]


def _with_curve(columns: Columns) -> Columns:
    """The same with K2 x^2 + K3 x^3 beside K x, so that K is the slope at the origin."""

    def curved(motion: Motion, knobs: dict[str, float], lag: float) -> list[Array]:
        powers = [motion.power(n, lag) for n in (2, 3)]
        own = columns(motion, knobs, lag)
        return [*own[:-1], *powers, own[-1]]

    return curved


def _standard_linear_solid(motion: Motion, knobs: dict[str, float], lag: float) -> list[Array]:
    """f = K x + B v + K1 y, where the spring K1 of the Maxwell branch is stretched by y: y' + y/tau = x'."""
    d = motion.position if motion.bonded else np.maximum(motion.position - knobs["x0"], 0.0)
    branch = d - d[0] - low_pass_once(d - d[0], knobs["tau"], motion.chain.dt)
    columns = [motion.filtered(d, k, lag) for k in (0, 1)]
    return [*columns, motion.filtered(branch, 0, lag), motion.ones]


def _hunt_crossley(motion: Motion, knobs: dict[str, float], lag: float) -> list[Array]:
    """f = K d^n + B d^n v. The damping's column is the derivative of d^(n+1)/(n+1), so that v is never formed."""
    n = knobs["n"]
    d = np.maximum(motion.position - knobs["x0"], 0.0)
    power = d**n
    return [motion.filtered(power, 0, lag), motion.filtered(power * d / (n + 1), 1, lag), motion.ones]


KELVIN_VOIGT = Model("kelvin-voigt", ("K", "B", "offset"), _kelvin_voigt)
KELVIN_VOIGT_MASS = Model("kelvin-voigt-mass", ("K", "B", "M", "offset"), _kelvin_voigt_mass)
CURVED = Model("kelvin-voigt", ("K", "B", "K2", "K3", "offset"), _with_curve(_kelvin_voigt))
CURVED_MASS = Model(
    "kelvin-voigt-mass", ("K", "B", "M", "K2", "K3", "offset"), _with_curve(_kelvin_voigt_mass)
)

NAMES = ("kelvin-voigt", "kelvin-voigt-mass", "standard-linear-solid", "hunt-crossley")


def standard_linear_solid(motion: Motion) -> Model:
    """The standard linear solid with a relaxation time that this log can show: between the filter's and the log's."""
    dt = motion.chain.dt
    shortest, longest = 2 / motion.chain.rate, len(motion.rows) * dt
    starts = tuple(np.geomspace(3 * shortest, longest / 3, 4))
    tau = Knob("tau", starts, shortest, 3 * longest, 0.01, logarithmic=True)
    knobs = (tau,) if motion.bonded else (tau, _touch(motion))
    linear = ("K", "B", "K1", "offset")
    return Model("standard-linear-solid", linear, _standard_linear_solid, knobs, ("K", "B", "K1"))


def _touch(motion: Motion) -> Knob:
    """Where the surface is, about the position at which the force was first seen."""
    depth = float(np.max(motion.position)) or 1.0
    return Knob("x0", (-0.02 * depth,), -1.0 * depth, 0.5 * depth, 1e-4 * depth)


def hunt_crossley(motion: Motion) -> Model:
    """Hunt and Crossley's contact (1975): stiffness and damping both grow with d^n, so the force starts from zero."""
    n = Knob("n", (1.5,), 0.5, 5.0, 1e-3)
    return Model("hunt-crossley", ("K", "B", "offset"), _hunt_crossley, (n, _touch(motion)), ("K", "B"))
