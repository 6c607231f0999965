"""A model fitted to a log by least squares, were it exactly true and its noise the force's alone.

Linear parameters inside, the nonlinear and the lag by Levenberg and Marquardt outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters.state_variable import Chain
from palpate.identification.least_squares import Noise, covariance, noise_of, solve
from palpate.identification.models import Model, Motion, NonlinearParameter
from palpate.identification.options import LAG, NOTHING, Lag, Prior, prior_of
from palpate.identification.uncertainty import student

_ROUNDS = 30
_CONVERGED = 1e-6
_ROUNDING = 1e-9
"""Steps at most; relative gains of the cost below which the search ends, and which are rounding."""
_UNDAMPED = 1e-9
"""Damping from which a step is whole in every direction: a damped one gains little where parameters are confounded."""

_FOURTH_ORDER = ((2 / 3, 1), (-2 / 3, -1), (-1 / 12, 2), (1 / 12, -2))
"""Weights of a derivative, over the step, and their places in steps."""


@dataclass(frozen=True)
class Point:
    """A model at some nonlinear parameters and a lag [s], with the linear ones, shape (p,), that fit best there.

    The columns of the regression have the shape (n, p), the residuals of the force (n,); rss is the sum of their
    squares, cost the same with what the knowledge from before has against it.
    """

    nonlinear: dict[str, float]
    lag: float
    columns: Array
    theta: Array
    residuals: Array
    rss: float
    cost: float


@dataclass(frozen=True)
class Descent:
    """The search for the parameters of a model: of a filtered force at the motion's rows, shape (n,).

    What is known from before counts as observations beside the log's.
    """

    model: Model
    motion: Motion
    force: Array
    known: Prior = NOTHING

    def at(self, nonlinear: dict[str, float], lag: float) -> Point:
        """The linear parameters that fit best at these nonlinear ones and this lag."""
        columns = np.column_stack(self.model.columns(self.motion, nonlinear, lag))
        rows, targets = self.known.rows(self.model.linear)
        theta = solve(np.vstack([columns, rows]), np.concatenate([self.force, targets]))
        residuals = self.force - columns @ theta
        rss = float(residuals @ residuals)
        against = float(np.sum((targets - rows @ theta) ** 2))
        if LAG in self.known.known:
            value, weight = self.known.known[LAG]
            against += (weight * (lag - value)) ** 2
        return Point(nonlinear, lag, columns, theta, residuals, rss, rss + against)

    def best_start(self, lag: float) -> Point:
        """The best of the start values of the nonlinear parameters."""
        names = [parameter.name for parameter in self.model.nonlinear]
        starts = product(*(parameter.starts for parameter in self.model.nonlinear))
        points = (self.at(dict(zip(names, values, strict=True)), lag) for values in starts)
        return min(points, key=lambda point: point.rss)

    def from_point(self, point: Point, lag: Lag | None) -> Point:
        """The least cost near a point; the lag is looked for within its prior, and stays if that is None."""
        outer = [*self.model.nonlinear, *([_lag_parameter(self.motion, lag)] if lag else [])]
        point = self.at(point.nonlinear, point.lag) if self.known.known else point
        if not outer:
            return point
        damping = 1e-3
        for _ in range(_ROUNDS):
            jacobian = np.column_stack([point.columns, self._slopes(point, outer)])
            rows, targets = self.known.rows((*self.model.linear, *(own.name for own in outer)))
            now = np.array([*point.theta, *(point.nonlinear.get(own.name, point.lag) for own in outer)])
            residuals = np.concatenate([point.residuals, targets - rows @ now])
            step = _damped_step(np.vstack([jacobian, rows]), residuals, len(point.theta), damping)
            trial = self.at(*_move(point, outer, step[len(point.theta) :]))
            gain = 1 - trial.cost / point.cost if point.cost else 0.0
            if gain > -_ROUNDING:  # the gradient has more digits than the cost: its rounding is taken
                point, damping = trial, max(damping / 10, _UNDAMPED)
                if gain < _CONVERGED and damping <= _UNDAMPED:
                    break
            elif (damping := 10 * damping) > 1e6:
                break
        return point

    def jacobian(self, point: Point) -> Array:
        """Derivatives of the predicted force by all parameters and the lag, shape (n, p)."""
        slopes = self._slopes(point, [*self.model.nonlinear, _lag_parameter(self.motion, Lag(point.lag))])
        for i, own in enumerate(self.model.nonlinear):
            if own.logarithmic:
                slopes[:, i] /= point.nonlinear[own.name]
        return np.column_stack([point.columns, slopes])

    def _slopes(self, point: Point, outer: Sequence[NonlinearParameter]) -> Array:
        """Derivatives of the predicted force by each parameter in its own scale, shape (n, len(outer))."""
        found = []
        for parameter in outer:
            if parameter.name == LAG:
                theta = dict(zip(self.model.linear, point.theta.tolist(), strict=True))
                found.append(slope_of_lag(self.model, self.motion, theta, point.lag, point.nonlinear))
                continue
            value = point.nonlinear[parameter.name]
            step = parameter.step * value if parameter.logarithmic else parameter.step
            beside = [(w, {**point.nonlinear, parameter.name: value + k * step}) for w, k in _FOURTH_ORDER]
            each = ((w, self.model.columns(self.motion, at, point.lag)) for w, at in beside)
            columns = (w * np.column_stack(own) for w, own in each)
            found.append(sum(columns) @ point.theta / parameter.step)
        return np.column_stack(found)


def slope_of_lag(
    model: Model,
    motion: Motion,
    theta: dict[str, float],
    lag: float,
    nonlinear: dict[str, float] | None = None,
) -> Array:
    """Derivative of the predicted force by the lag [N/s], shape (n,): of a sum of the position's derivatives the next.

    `theta` are the model's linear parameters, `lag` is that of the force [s].
    """
    of_position = not model.nonlinear and {*model.derivatives, "offset"} == {*model.linear}
    if of_position and isinstance(motion.chain, Chain):
        parts = [theta.get(n, 0.0) * motion.moved(k + 1, lag) for n, k in model.derivatives.items()]
        return -sum(parts, np.zeros(len(motion.rows)))
    step = _lag_parameter(motion, Lag(lag)).step
    up, down = (model.columns(motion, nonlinear or {}, at) for at in (lag + step, lag - step))
    pairs = zip(model.linear, up, down, strict=True)
    change = sum((theta.get(n, 0.0) * (u - d) for n, u, d in pairs), np.zeros(len(motion.rows)))
    return change / (2 * step)


def linearise(
    model: Model, motion: Motion, force: Array, nonlinear: dict[str, float], lag: float
) -> tuple[dict[str, float], Array, Array]:
    """A model about its nonlinear parameters and a lag [s], and the linear ones that fit best there.

    Returns:
        All parameters by name, the lag last; the predicted force's derivatives by them, shape (n, p); residuals of the
        force at the motion's rows, shape (n,).
    """
    descent = Descent(model, motion, force)
    point = descent.at(nonlinear, lag)
    values = [*point.theta.tolist(), *(nonlinear[parameter.name] for parameter in model.nonlinear), lag]
    return dict(zip(names_of(model), values, strict=True)), descent.jacobian(point), point.residuals


def names_of(model: Model) -> tuple[str, ...]:
    """Of all parameters: the linear ones, the nonlinear ones, the lag."""
    return (*model.linear, *(parameter.name for parameter in model.nonlinear), LAG)


def _lag_parameter(motion: Motion, lag: Lag) -> NonlinearParameter:
    limit = 3 * lag.std
    step = 0.02 / motion.chain.rate
    return NonlinearParameter(LAG, (lag.value,), lag.value - limit, lag.value + limit, step)


def _damped_step(jacobian: Array, residuals: Array, linear: int, damping: float) -> Array:
    """One step; only the outer parameters are damped, because the linear ones are solved for exactly."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    gram[np.arange(linear, len(scale)), np.arange(linear, len(scale))] += damping
    vector = jacobian.T @ residuals / scale
    return np.asarray(np.linalg.lstsq(gram, vector, rcond=1e-13)[0] / scale)


def _move(point: Point, outer: Sequence[NonlinearParameter], step: Array) -> tuple[dict[str, float], float]:
    """The nonlinear parameters and the lag after a step, within their limits."""
    nonlinear, lag = dict(point.nonlinear), point.lag
    for own, change in zip(outer, step, strict=True):
        if own.name == LAG:
            lag = float(np.clip(lag + change, own.low, own.high))
            continue
        value = nonlinear[own.name]
        to = value * np.exp(np.clip(change, -1.0, 1.0)) if own.logarithmic else value + change
        nonlinear[own.name] = float(np.clip(to, own.low, own.high))
    return nonlinear, lag


@dataclass(frozen=True)
class Fit:
    """A model fitted to a log.

    Args:
        names: of the parameters: the linear ones, then the nonlinear ones, then the lag.
        theta: their values, shape (p,).
        cov: their covariance, coloured noise and the lag's uncertainty included, shape (p, p).
        r2: share of the force's variance that it explains.
        noise: colour of the residuals.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    r2: float
    noise: Noise

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    def std(self, name: str) -> float:
        """Standard deviation of a parameter."""
        i = self.names.index(name)
        return float(np.sqrt(max(self.cov[i, i], 0.0)))

    @property
    def t(self) -> float:
        """Student's factor of a standard deviation for a 95 % interval."""
        return student(self.noise.effective - len(self.names))

    def with_cause(self, cause: str, effect: Array) -> Fit:
        """The same with one more cause of error, as of an `Answer`; a covariance keeps no names of causes."""
        return replace(self, cov=self.cov + np.outer(effect, effect))

    def through(self, jacobian: Array, theta: Array) -> Fit:
        """Functions of the parameters instead, as of an `Answer`."""
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T)


def fit(model: Model, motion: Motion, force: Array, lag: Lag, start: float | None = None) -> Fit:
    """Fit a model to a filtered force, at the motion's rows, shape (n,).

    A lag that is not known is looked for within its prior from `start` [s] on (the prior's value if not given), and its
    uncertainty is part of every interval.
    """
    descent, point = _search(model, motion, force, lag, start)
    jacobian = descent.jacobian(point)
    names = names_of(model)
    noise = noise_of(point.residuals, motion.rows, len(names) - int(lag.std == 0))
    theta = np.array([*point.theta, *(point.nonlinear[k.name] for k in model.nonlinear), point.lag])
    level = float(np.sqrt(point.rss / max(len(force) - len(point.theta), 1)))
    std = descent.known.std(names, level)
    prior = np.full(len(names), np.inf) if std is None else std
    prior[-1] = lag.std
    cov, own = np.zeros((len(names), len(names))), slice(None if lag.std > 0 else -1)
    cov[own, own] = covariance(jacobian[:, own], motion.rows, noise, prior[own])
    spread = float(np.mean((force - force.mean()) ** 2))
    return Fit(names, theta, cov, 1 - point.rss / len(force) / spread if spread else 0.0, noise)


def nonlinear_fit(model: Model, motion: Motion, force: Array, lag: Lag) -> dict[str, float]:
    """The nonlinear parameters of a model, by name, by least squares on a filtered force, shape (n,)."""
    return _search(model, motion, force, lag)[1].nonlinear


def _search(
    model: Model, motion: Motion, force: Array, lag: Lag, start: float | None = None
) -> tuple[Descent, Point]:
    """The least cost, and the search with what is known beside the log against its noise."""
    asked = lag if lag.std > 0 else None
    descent = Descent(model, motion, force)
    best = descent.best_start(lag.value if start is None else start)
    for _ in range(2 if asked or lag.mass else 1):
        best = descent.from_point(best, asked)
        noise = float(np.sqrt(best.rss / max(len(force) - len(best.theta), 1)))
        descent = replace(descent, known=prior_of(lag, noise, asked is not None))
    return descent, descent.from_point(best, asked) if descent.known.known else best
