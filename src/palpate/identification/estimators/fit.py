"""A model fitted to a log by least squares in time, were it exactly true and its noise the force's alone.

Linear parameters inside (variable projection: Golub and Pereyra, 1973), the nonlinear by Levenberg and Marquardt
outside.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters import Chain
from palpate.identification.least_squares import covariance, noise_of, solve
from palpate.identification.models import Model, Motion
from palpate.identification.options import LAG, Lag, mass_std
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
    """A model at some nonlinear parameters, with the linear ones, shape (p,), that fit best there.

    The columns of the regression have the shape (n, p), the residuals of the force (n,); rss is the sum of their
    squares.
    """

    nonlinear: dict[str, float]
    columns: Array
    theta: Array
    residuals: Array
    rss: float


@dataclass(frozen=True)
class Descent:
    """The search for a model's parameters: the force is filtered, shape (n,), and its lag behind the motion in [s]."""

    model: Model
    motion: Motion
    force: Array
    lag: float

    def at(self, nonlinear: dict[str, float]) -> Point:
        """The linear parameters that fit best at these nonlinear ones."""
        columns = np.column_stack(self.model.columns(self.motion, nonlinear, self.lag))
        theta = solve(columns, self.force)
        residuals = self.force - columns @ theta
        return Point(nonlinear, columns, theta, residuals, float(residuals @ residuals))

    def best_start(self) -> Point:
        """The best of the start values of the nonlinear parameters."""
        names = [parameter.name for parameter in self.model.nonlinear]
        starts = product(*(parameter.starts for parameter in self.model.nonlinear))
        points = (self.at(dict(zip(names, values, strict=True))) for values in starts)
        return min(points, key=lambda point: point.rss)

    def from_point(self, point: Point) -> Point:
        """The least sum of squares near a point."""
        damping = 1e-3
        for _ in range(_ROUNDS):
            jacobian, linear = np.column_stack([point.columns, self.slopes(point)]), len(point.theta)
            step = _damped_step(jacobian, point.residuals, linear, damping)
            trial = self.at(self._move(point.nonlinear, step[linear:]))
            gain = 1 - trial.rss / point.rss if point.rss else 0.0
            if gain > -_ROUNDING:  # the gradient has more digits than the cost: its rounding is taken
                point, damping = trial, max(damping / 10, _UNDAMPED)
                if gain < _CONVERGED and damping <= _UNDAMPED:
                    break
            elif (damping := 10 * damping) > 1e6:
                break
        return point

    def slopes(self, point: Point) -> Array:
        """Derivatives of the predicted force by each nonlinear parameter, of a logarithmic one by its logarithm.

        Shape (n, parameters).
        """
        found = []
        for parameter in self.model.nonlinear:
            value = point.nonlinear[parameter.name]
            step = parameter.step * value if parameter.logarithmic else parameter.step
            beside = [(w, {**point.nonlinear, parameter.name: value + k * step}) for w, k in _FOURTH_ORDER]
            each = ((w, self.model.columns(self.motion, at, self.lag)) for w, at in beside)
            columns = (w * np.column_stack(own) for w, own in each)
            found.append(sum(columns) @ point.theta / parameter.step)
        return np.column_stack(found)

    def about(self, point: Point) -> tuple[dict[str, float], Array]:
        """All parameters by name, the lag last, and the derivatives of the predicted force by them, shape (n, p)."""
        linear = dict(zip(self.model.linear, point.theta.tolist(), strict=True))
        size = [point.nonlinear[p.name] if p.logarithmic else 1.0 for p in self.model.nonlinear]
        of_lag = slope_of_lag(self.model, self.motion, linear, self.lag, point.nonlinear)
        nonlinear = self.slopes(point) / size if size else np.empty((len(self.force), 0))
        return linear | point.nonlinear | {LAG: self.lag}, np.column_stack([point.columns, nonlinear, of_lag])

    def _move(self, nonlinear: dict[str, float], step: Array) -> dict[str, float]:
        """The nonlinear parameters after a step, within their limits."""
        found = {}
        for own, change in zip(self.model.nonlinear, step, strict=True):
            value = nonlinear[own.name]
            to = value * np.exp(np.clip(change, -1.0, 1.0)) if own.logarithmic else value + change
            found[own.name] = float(np.clip(to, own.low, own.high))
        return found


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
    step = 0.02 / motion.chain.rate
    up, down = (model.columns(motion, nonlinear or {}, at) for at in (lag + step, lag - step))
    pairs = zip(model.linear, up, down, strict=True)
    change = sum((theta.get(n, 0.0) * (u - d) for n, u, d in pairs), np.zeros(len(motion.rows)))
    return change / (2 * step)


def _damped_step(jacobian: Array, residuals: Array, linear: int, damping: float) -> Array:
    """One step; only the outer parameters are damped, because the linear ones are solved for exactly."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    gram[np.arange(linear, len(scale)), np.arange(linear, len(scale))] += damping
    vector = jacobian.T @ residuals / scale
    return np.asarray(np.linalg.lstsq(gram, vector, rcond=1e-13)[0] / scale)


@dataclass(frozen=True)
class Fit:
    """A model fitted to a log.

    Args:
        names: of the parameters: the linear ones, then the nonlinear ones, then the lag.
        theta: their values, shape (p,).
        cov: their covariance, coloured noise and the lag's uncertainty included, shape (p, p).
        effective: number of independent samples that the residuals are worth.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    effective: float

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    def half_of(self, name: str) -> float:
        """Half-width of a parameter's 95 % interval."""
        i = self.names.index(name)
        return student(self.effective - len(self.names)) * float(np.sqrt(max(self.cov[i, i], 0.0)))

    def with_cause(self, cause: str, effect: Array) -> Fit:
        """The same with one more cause of error, as of an `Answer`; a covariance keeps no names of causes."""
        return replace(self, cov=self.cov + np.outer(effect, effect))

    def through(self, jacobian: Array, theta: Array) -> Fit:
        """Functions of the parameters instead, as of an `Answer`."""
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T)


def fit(descent: Descent, nonlinear: dict[str, float], prior: Lag) -> Fit:
    """Least squares about known nonlinear parameters and a lag: one step from consistent ones is as efficient as many.

    The priors of the lag and the mass count as observations beside the log's. Source: Le Cam, 1956.
    """
    point = descent.at(nonlinear)
    values, jacobian = descent.about(point)
    names, rows, at = tuple(values), descent.motion.rows, np.array([*values.values()])
    mean, std = at.copy(), np.full(len(at), np.inf)
    mean[-1], std[-1] = prior.value, prior.std
    if prior.mass is not None and "M" in names:
        i = names.index("M")
        mean[i], std[i] = prior.mass[0], mass_std(prior.mass)
    noise = noise_of(point.residuals, rows, len(names) - int(prior.std == 0))
    weight = float(np.sqrt(max(noise.variance, 1e-300))) / np.maximum(std, 1e-300)
    free = slice(None if prior.std > 0 else -1)
    both = np.vstack([jacobian, np.diag(weight)])[:, free]
    step = solve(both, np.concatenate([point.residuals, weight * (mean - at)]))
    theta, cov = at.copy(), np.zeros((len(at), len(at)))
    theta[free] += step
    outer = slice(len(point.theta), -1)
    each = zip(theta[outer], descent.model.nonlinear, strict=True)
    within = [float(np.clip(value, parameter.low, parameter.high)) for value, parameter in each]
    if within != theta[outer].tolist():  # a step beyond a limit ends there
        theta[:-1] = [*descent.at(dict(zip(names[outer], within, strict=True))).theta, *within]
    cov[free, free] = covariance(jacobian[:, free], rows, noise, std[free])
    return Fit(names, theta, cov, noise.effective)
