"""The contact models that are fitted and compared. Each turns a position into the columns of a regression."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import accumulate
from math import isqrt

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.identification.filters import NOISELESS, Chain, PositionNoise, SensorPath, low_passed
from palpate.signals.low_pass import LowPass


@dataclass
class Motion:
    """The position of a log as the models see it: filtered on demand, and kept at the rows that are fitted.

    Args:
        chain: the filter of both channels, or the way through a force sensor that is known.
        position: raw, counted into the surface from `origin`, shape (n,).
        rows: the samples that are fitted, shape (m,): of the position behind a filter, of the force behind a sensor.
        bonded: whether the probe is fixed to the surface.
        noise: of the position; it makes every column of the regression uncertain.
        free: what the position does before it meets the surface, zero in contact, shape (n,); None in rows of contact.
        touched: 1 from the touch on, 0 before, shape (n,); None likewise.
    """

    chain: Chain | SensorPath
    position: Array
    rows: Indices
    bonded: bool
    noise: PositionNoise = NOISELESS
    free: Array | None = None
    touched: Array | None = None
    _kept: dict[tuple[int, float], Array] = field(default_factory=dict)
    _turned: dict[float, Array] = field(default_factory=dict)

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
        return self.chain.read(signal, derivative, lag, self.rows)

    def through(self, change: Callable[[Array], Array]) -> "Motion":
        """The same with its signals changed, of shape (n,) each."""
        free, touched = (own if own is None else change(own) for own in (self.free, self.touched))
        return replace(self, position=change(self.position), free=free, touched=touched, _kept={}, _turned={})

    def direction(self, least: float = 0.0) -> Array:
        """Which way friction holds the probe: 1 while it moves into the surface, -1 out of it, shape (n,).

        At rest it keeps what it has, and turns within a short way (an elastoplastic element; Dahl 1968 has it smooth):
        the shortest that the position's noise and its encoder do not turn it within, and `least` at least [m].
        """
        noise, position = self.noise, self.position
        way = max(_TURNS * noise.white, 2 * noise.jump, _SHORTEST * float(np.ptp(position)), least, 1e-300)
        if way not in self._turned:
            self._turned[way] = _clipped_sum(np.diff(position, prepend=position[:1]) / way)
        return self._turned[way]

    @property
    def instants(self) -> Array:
        """Sample of the position that each row belongs to, shape (m,)."""
        chain, rows = self.chain, self.rows
        return chain.instants[rows] if isinstance(chain, SensorPath) else rows.astype(np.float64)

    @property
    def matched(self) -> bool:
        """Whether the force sensor's own way is known, so that its readings are as white as their noise."""
        return isinstance(self.chain, SensorPath)


def from_surface(motion: Motion, inside: Mask, surface: float) -> Motion:
    """The same motion counted from a surface [m]: nothing is pressed before it is met.

    Samples `inside`, shape (n,), are in contact for sure.
    """
    depth = motion.position - surface
    pressed = np.where(inside, depth, np.maximum(depth, 0.0))
    touched = (inside | (depth > 0)).astype(np.float64)
    return replace(motion, position=pressed, free=depth - pressed, touched=touched, _kept={}, _turned={})


@dataclass(frozen=True)
class NonlinearParameter:
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
    """A contact model that is linear in all parameters but some.

    Args:
        name: the word for `--model`.
        linear: names of the parameters that its columns stand for; `offset` is the last one, if there is one.
        columns: from a motion, the nonlinear parameters and the force's lag [s] to the columns, each of shape (m,).
        nonlinear: what it is not linear in, scaled to the log at hand.
        positive: parameters that no passive surface has below zero.
        depth: penetration that the stiffnesses and the damping belong to, where they grow with it [m]; None if not.
    """

    name: str
    linear: tuple[str, ...]
    columns: Columns
    nonlinear: tuple[NonlinearParameter, ...] = ()
    positive: tuple[str, ...] = ("K", "B", "M", "Fc")
    depth: float | None = None

    @property
    def of_power(self) -> bool:
        """Whether the force goes with a power of the depth."""
        return any(parameter.name == "n" for parameter in self.nonlinear)

    @property
    def derivatives(self) -> dict[str, int]:
        """Which parameters multiply which derivative of the position."""
        return {name: k for name, k in (("K", 0), ("B", 1), ("M", 2)) if name in self.linear}


_TURNS = 6.0
"""Deviations of the position's noise within which friction does not turn: nearly none is larger."""
_SHORTEST = 1e-3
"""Share of the position's range, where it has no noise."""

NAMES = (
    "kelvin-voigt",
    "kelvin-voigt-mass",
    "standard-linear-solid",
    "hunt-crossley",
    "quasi-linear-viscoelastic",
)


def _of_derivatives(count: int) -> Columns:
    """f = K x + B v, with three M a as well."""
    return lambda motion, _, lag: [*(motion.moved(k, lag) for k in range(count)), np.ones(len(motion.rows))]


KELVIN_VOIGT = Model(NAMES[0], ("K", "B", "offset"), _of_derivatives(2))
KELVIN_VOIGT_MASS = Model(NAMES[1], ("K", "B", "M", "offset"), _of_derivatives(3))


def _relaxing(motion: Motion, u: Array, tau: float, lag: float) -> list[Array]:
    """f = K u + B u' + K1 y, shape (n,), where the spring K1 of a Maxwell branch is stretched by y: y' + y/tau = u'."""
    branch = u - low_passed(u, LowPass.of_first_order(tau), motion.chain.dt)
    columns = [motion.filtered(u, k, lag) for k in (0, 1)]
    return [*columns, motion.filtered(branch, 0, lag), np.ones(len(motion.rows))]


_RELAXING = ("K", "B", "K1", "offset")
_PASSIVE = ("K", "B", "K1", "Fc")
_POWER = NonlinearParameter("n", (1.5,), 0.5, 5.0, 1e-3)


def _time(motion: Motion) -> NonlinearParameter:
    """A relaxation time that this log can show: between the filter's and the log's."""
    shortest, longest = 2 / motion.chain.rate, len(motion.rows) * motion.chain.period
    starts = tuple(np.geomspace(3 * shortest, longest / 3, 4))
    return NonlinearParameter("tau", starts, shortest, 3 * longest, 0.01, logarithmic=True)


def _touch(motion: Motion) -> NonlinearParameter:
    """Where the surface is, about the position at which the force was first seen, and on the way there at the least."""
    depth = float(np.max(motion.position)) or 1.0
    least = min(-depth, float(np.min(motion.position)))
    return NonlinearParameter("x0", (-0.02 * depth,), least, 0.5 * depth, 1e-4 * depth)


def standard_linear_solid(motion: Motion) -> Model:
    """The standard linear solid, stretched by the depth beyond the surface; a probe fixed to it is always in it."""

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        x = motion.position
        depth = x if motion.bonded else np.maximum(x - nonlinear["x0"], 0.0)
        return _relaxing(motion, depth, nonlinear["tau"], lag)

    nonlinear = (_time(motion),) if motion.bonded else (_time(motion), _touch(motion))
    return Model(NAMES[2], _RELAXING, columns, nonlinear, _PASSIVE)


def quasi_linear(motion: Motion) -> Model:
    """Tissue that stiffens and relaxes: f = K u + B u' + K1 y with u = D/n (d/D)^n, and y' + y/tau = u'.

    The elastic force is a power of the depth, and a share of it relaxes. At the penetration D, near the deepest of the
    log, u' is d': K, B and K1 are what a straight spring, damper and branch have there.

    Source: Y. C. Fung, Biomechanics: Mechanical Properties of Living Tissues, 1993, ch. 7, with one relaxation time.
    """
    deepest = float(motion.moved(0, 0.0).max())

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        n = nonlinear["n"]
        u = deepest / n * (np.maximum(motion.position - nonlinear["x0"], 0.0) / deepest) ** n
        return _relaxing(motion, u, nonlinear["tau"], lag)

    nonlinear = (_POWER, _time(motion), _touch(motion))
    return Model(NAMES[4], _RELAXING, columns, nonlinear, _PASSIVE, deepest)


def hunt_crossley(motion: Motion) -> Model:
    """Hunt and Crossley's contact (1975): f = K d^n + B d^n v; both grow with the depth, so the force starts from zero.

    The damping's column is the derivative of d^(n+1)/(n+1), so that v is never formed.
    """

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        n, d = nonlinear["n"], np.maximum(motion.position - nonlinear["x0"], 0.0)
        power = d**n
        return [
            motion.filtered(power, 0, lag),
            motion.filtered(power * d / (n + 1), 1, lag),
            np.ones(len(motion.rows)),
        ]

    return Model(NAMES[3], ("K", "B", "offset"), columns, (_POWER, _touch(motion)), ("K", "B", "Fc"))


def at_rest_before(model: Model) -> Model:
    """The same where the log shows what the force rests at before the touch, so that no offset is left to find.

    An offset and the place of the surface do the same to a straight spring, and nearly the same to a curved one.
    """
    return replace(model, linear=model.linear[:-1], columns=lambda *at: model.columns(*at)[:-1])


def begun_before(model: Model) -> Model:
    """The same in a log that begins in contact: what the Maxwell branch was stretched by then dies out with tau."""

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        own = model.columns(motion, nonlinear, lag)
        since = np.arange(len(motion.position)) * motion.chain.dt
        return [*own[:-1], motion.filtered(np.exp(-since / nonlinear["tau"]), 0, lag), own[-1]]

    return replace(model, linear=(*model.linear[:-1], "y0", model.linear[-1]), columns=columns)


def _clipped_sum(steps: Array) -> Array:
    """z of every step, shape (n,), with z + step cut off at -1 and 1, from 0 on.

    So many steps from any z end at z + a, cut off where the ways from -1 and from 1 end: stretches go side by side.
    """
    width = isqrt(len(steps)) + 1
    table = np.concatenate([steps, np.zeros(width**2 - len(steps))]).reshape(width, width).T
    along = np.cumsum(table, axis=0)
    ends = np.empty((width, 2, width))
    state = np.repeat([[-1.0], [1.0]], width, axis=1)
    for i, step in enumerate(table):
        state = np.minimum(np.maximum(state + step, -1.0, out=ends[i]), 1.0, out=ends[i])
    last = zip(along[-1].tolist(), *ends[-1].tolist(), strict=True)
    z = list(accumulate(last, lambda z, way: min(max(z + way[0], way[1]), way[2]), initial=0.0))
    found: Array = np.minimum(np.maximum(np.array(z[:-1]) + along, ends[:, 0]), ends[:, 1])
    return found.T.ravel()[: len(steps)]
