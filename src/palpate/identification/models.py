"""The contact models that are fitted and compared. Each turns a position into the columns of a regression."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import isqrt

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.identification.filters import Chain, SensorPath, low_passed
from palpate.signals.low_pass import LowPass
from palpate.signals.position_noise import NOISELESS, PositionNoise


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

    def direction(self, least: float = 0.0) -> Array:
        """Direction of friction: 1 while the probe moves into the surface, -1 out of it, shape (n,).

        At rest it keeps what it has, and turns within a short way (an elastoplastic element; Dahl 1968 has it smooth):
        the shortest that the position's noise and its encoder do not turn it within, and `least` at least [m].
        """
        noise = self.noise
        position = self.position
        min_distance = _MIN_FRICTION_TRAVEL * float(np.ptp(position))
        by_noise = max(_FRICTION_NOISE_STDS * noise.white, 2 * noise.jump)
        distance = max(by_noise, min_distance, least, 1e-300)
        if distance not in self._turned:
            steps = np.diff(position, prepend=position[:1])
            self._turned[distance] = _clipped_sum(steps / distance)
        return self._turned[distance]

    @property
    def instants(self) -> Array:
        """Sample of the position that each row belongs to, shape (m,)."""
        chain = self.chain
        rows = self.rows
        return chain.instants[rows] if isinstance(chain, SensorPath) else rows.astype(np.float64)

    @property
    def matched(self) -> bool:
        """True if the force sensor's low-pass is known, so that its readings are as white as their noise."""
        return isinstance(self.chain, SensorPath)


def from_surface(motion: Motion, inside: Mask, surface: float) -> Motion:
    """Count the motion from a surface [m]: nothing is pressed before it is met.

    Samples `inside`, shape (n,), are in contact for sure.
    """
    depth = motion.position - surface
    penetration = np.where(inside, depth, np.maximum(depth, 0.0))
    touched = (inside | (depth > 0)).astype(np.float64)
    return replace(
        motion, position=penetration, free=depth - penetration, touched=touched, _kept={}, _turned={}
    )


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
        """True if the force is a power of the depth."""
        return any(parameter.name == "n" for parameter in self.nonlinear)

    @property
    def derivatives(self) -> dict[str, int]:
        """Order of the position's derivative that each parameter multiplies."""
        return {name: k for name, k in (("K", 0), ("B", 1), ("M", 2)) if name in self.linear}


_FRICTION_NOISE_STDS = 6.0
"""Standard deviations of the position's noise within which friction does not turn; hardly any noise is larger."""
_MIN_FRICTION_TRAVEL = 1e-3
"""Least distance of turning, as a fraction of the position's range, for a position without noise."""

NAMES = (
    "kelvin-voigt",
    "kelvin-voigt-mass",
    "standard-linear-solid",
    "hunt-crossley",
    "quasi-linear-viscoelastic",
)


def _derivative_columns(count: int) -> Columns:
    """Columns of f = K x + B v, and M a if the count is three."""

    def columns(motion: Motion, _: dict[str, float], lag: float) -> list[Array]:
        derivatives = [motion.moved(order, lag) for order in range(count)]
        return [*derivatives, np.ones(len(motion.rows))]

    return columns


KELVIN_VOIGT = Model(NAMES[0], ("K", "B", "offset"), _derivative_columns(2))
KELVIN_VOIGT_MASS = Model(NAMES[1], ("K", "B", "M", "offset"), _derivative_columns(3))


def _relaxing(motion: Motion, u: Array, tau: float, lag: float) -> list[Array]:
    """Columns of f = K u + B u' + K1 y, where y stretches the spring K1 of a Maxwell branch: y' + y/tau = u'."""
    branch = u - low_passed(u, LowPass.of_first_order(tau), motion.chain.dt)
    columns = [motion.filtered(u, k, lag) for k in (0, 1)]
    return [*columns, motion.filtered(branch, 0, lag), np.ones(len(motion.rows))]


_RELAXING_PARAMETERS = ("K", "B", "K1", "offset")
_PASSIVE = ("K", "B", "K1", "Fc")
_EXPONENT = NonlinearParameter("n", (1.5,), 0.5, 5.0, 1e-3)


def _relaxation_time(motion: Motion) -> NonlinearParameter:
    """A relaxation time that a log can show: between the filter's time constant and the log's duration."""
    shortest = 2 / motion.chain.rate
    longest = len(motion.rows) * motion.chain.period
    starts = tuple(np.geomspace(3 * shortest, longest / 3, 4))
    return NonlinearParameter("tau", starts, shortest, 3 * longest, 0.01, logarithmic=True)


def _surface_position(motion: Motion) -> NonlinearParameter:
    """Position of the surface, as a parameter: near or before the first force."""
    depth = float(np.max(motion.position)) or 1.0
    least = min(-depth, float(np.min(motion.position)))
    return NonlinearParameter("x0", (-0.02 * depth,), least, 0.5 * depth, 1e-4 * depth)


def standard_linear_solid(motion: Motion) -> Model:
    """The standard linear solid, stretched by the depth beyond the surface, or by the position of a bonded probe."""

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        x = motion.position
        depth = x if motion.bonded else np.maximum(x - nonlinear["x0"], 0.0)
        return _relaxing(motion, depth, nonlinear["tau"], lag)

    nonlinear: tuple[NonlinearParameter, ...] = (_relaxation_time(motion),)
    if not motion.bonded:
        nonlinear += (_surface_position(motion),)
    return Model(NAMES[2], _RELAXING_PARAMETERS, columns, nonlinear, _PASSIVE)


def quasi_linear(motion: Motion) -> Model:
    """Tissue that stiffens and relaxes: f = K u + B u' + K1 y with u = D/n (d/D)^n, and y' + y/tau = u'.

    The elastic force is a power of the depth, and a fraction of it relaxes. At the penetration D, near the deepest of
    the log, u' is d': K, B and K1 are those of a linear spring, damper and branch there.

    Source: Y. C. Fung, Biomechanics: Mechanical Properties of Living Tissues, 1993, ch. 7, with one relaxation time.
    """
    deepest = float(motion.moved(0, 0.0).max())

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        n = nonlinear["n"]
        depth = np.maximum(motion.position - nonlinear["x0"], 0.0)
        u = deepest / n * (depth / deepest) ** n
        return _relaxing(motion, u, nonlinear["tau"], lag)

    nonlinear = (_EXPONENT, _relaxation_time(motion), _surface_position(motion))
    return Model(NAMES[4], _RELAXING_PARAMETERS, columns, nonlinear, _PASSIVE, deepest)


def hunt_crossley(motion: Motion) -> Model:
    """Hunt and Crossley's contact (1975): f = K d^n + B d^n v; both grow with the depth, so the force starts from zero.

    The damping's column is the derivative of d^(n+1)/(n+1), so that v is never formed.
    """

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        n = nonlinear["n"]
        d = np.maximum(motion.position - nonlinear["x0"], 0.0)
        power = d**n
        return [
            motion.filtered(power, 0, lag),
            motion.filtered(power * d / (n + 1), 1, lag),
            np.ones(len(motion.rows)),
        ]

    nonlinear = (_EXPONENT, _surface_position(motion))
    return Model(NAMES[3], ("K", "B", "offset"), columns, nonlinear, positive=("K", "B", "Fc"))


def at_rest_before(model: Model) -> Model:
    """Remove the offset from a model, for a log that shows the force at rest before the touch.

    An offset and the position of the surface have the same effect on a linear spring, and nearly so on a curved one.
    """
    return replace(model, linear=model.linear[:-1], columns=lambda *at: model.columns(*at)[:-1])


def begun_before(model: Model) -> Model:
    """Add the stretch of the Maxwell branch at the start of a log that begins in contact; it decays with tau."""

    def columns(motion: Motion, nonlinear: dict[str, float], lag: float) -> list[Array]:
        model_columns = model.columns(motion, nonlinear, lag)
        time = np.arange(len(motion.position)) * motion.chain.dt
        decay = motion.filtered(np.exp(-time / nonlinear["tau"]), 0, lag)
        return [*model_columns[:-1], decay, model_columns[-1]]

    return replace(model, linear=(*model.linear[:-1], "y0", model.linear[-1]), columns=columns)


def _clipped_sum(steps: Array) -> Array:
    """Running sum of steps from 0, clipped to -1 and 1 after each step, shape (n,).

    Several steps from any z end at z + a, clipped to the ends from -1 and from 1. So stretches are summed in parallel.
    """
    width = isqrt(len(steps)) + 1
    padded = np.concatenate([steps, np.zeros(width**2 - len(steps))])
    table = padded.reshape(width, width).T
    partial_sums = np.cumsum(table, axis=0)
    ends = np.empty((width, 2, width))
    state = np.repeat([[-1.0], [1.0]], width, axis=1)
    for row, step in enumerate(table):
        state = np.clip(state + step, -1.0, 1.0, out=ends[row])
    starts = [0.0]
    for total, low, high in zip(partial_sums[-1].tolist(), *ends[-1].tolist(), strict=True):
        starts.append(min(max(starts[-1] + total, low), high))
    sums = np.array(starts[:-1]) + partial_sums
    clipped: Array = np.minimum(np.maximum(sums, ends[:, 0]), ends[:, 1])
    return clipped.T.ravel()[: len(steps)]
