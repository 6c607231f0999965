"""Fitting one model to one log: linear parameters inside; the nonlinear and the lag by Gauss and Newton outside."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.lag_uncertainty import bias_corrected, hidden, with_lag
from palpate.identification.filters.state_variable import Chain
from palpate.identification.least_squares import Noise, covariance, noise_of, quantile, solve
from palpate.identification.models import Model, Motion, NonlinearParameter
from palpate.identification.prior import LAG, NOTHING, Lag, Prior, prior_of

_ROUNDS = 30
_CONVERGED = 1e-6
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Fit:
    """A model fitted to a log.

    Args:
        model: which.
        names: of the parameters: the linear ones, then the nonlinear ones, then the lag.
        theta: their values, shape (p,).
        cov: their covariance, coloured noise and the lag's uncertainty included, shape (p, p).
        fixed_cov: the same as if the lag were known exactly, shape (p, p).
        predicted, residuals: of the filtered force, shape (n,).
        r2, rmse: of the fit.
        noise: colour of the residuals.
        lag: the lag used [s].
        attenuation: how far noise of the position may have pulled each parameter, shape (p,); part of `cov`.
        jacobian: of the predicted force by all of them, shape (n, p).
    """

    model: Model
    names: tuple[str, ...]
    theta: Array
    cov: Array
    fixed_cov: Array
    predicted: Array
    residuals: Array
    r2: float
    rmse: float
    noise: Noise
    lag: float
    attenuation: Array
    jacobian: Array

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    def std(self, name: str, lag_known: bool = False) -> float:
        """Standard deviation of a parameter; as if the lag were known exactly if asked so."""
        i = self.names.index(name)
        cov = self.fixed_cov if lag_known else self.cov
        return float(np.sqrt(max(cov[i, i], 0.0)))

    @property
    def t(self) -> float:
        """What a standard deviation is multiplied with for a 95 % interval."""
        return quantile(self.noise.effective, len(self.names))

    def score(self, effective: float) -> float:
        """Schwarz's criterion for a common number of effective samples: smaller is better."""
        mean_square = max(self.rmse**2, 1e-300)
        return effective * float(np.log(mean_square)) + len(self.names) * float(np.log(effective))


@dataclass
class _Point:
    nonlinear: dict[str, float]
    lag: float
    columns: Array
    theta: Array
    residuals: Array

    rss: float
    cost: float  # rss, and what the knowledge from before has against it


def fit(model: Model, motion: Motion, force: Array, lag: Lag, start: float | None = None) -> Fit:
    """Fit a model.

    Args:
        model: which.
        motion: the position.
        force: filtered, at the motion's rows, shape (n,).
        lag: what is known about it; if it is not known, it is looked for within its prior, and its uncertainty is part
            of every interval.
        start: where that search begins [s]; the prior's value if not given.
    """
    asks = lag.std > 0
    best = _best_start(model, motion, force, lag.value if start is None else start)
    known = NOTHING
    for _ in range(2 if asks or lag.mass else 1):
        best = _descend(model, motion, force, best, lag, asks, known)
        noise = float(np.sqrt(best.rss / max(len(force) - len(best.theta), 1)))
        known = prior_of(lag, noise, asks)
    if known.known:
        best = _descend(model, motion, force, best, lag, asks, known)
    return _finish(model, motion, force, best, lag, known)


@dataclass(frozen=True)
class Prediction:
    """The force that a model predicts for a log.

    Args:
        model: which.
        theta: its parameters by name.
        lag: of the force behind the position [s].
        force, residuals: predicted, and what it leaves of the measured one, shape (n,).
        r2, rmse: share of the variance that it explains, and rms of what it leaves.
    """

    model: Model
    theta: dict[str, float]
    lag: float
    force: Array
    residuals: Array
    r2: float
    rmse: float

    @classmethod
    def of(
        cls, model: Model, motion: Motion, force: Array, theta: dict[str, float], lag: float
    ) -> Prediction:
        """By a model; an offset that is not among the parameters is that of the mean.

        Args:
            model: which.
            motion: the position.
            force: measured, shape (n,).
            theta: its parameters.
            lag: of the force [s].
        """
        columns = model.columns(motion, theta, lag)
        predicted = sum(
            (theta.get(n, 0.0) * c for n, c in zip(model.linear, columns, strict=True)), np.zeros(len(force))
        )
        if "offset" in model.linear and "offset" not in theta:
            offset = float(np.mean(force - predicted))
            theta, predicted = {**theta, "offset": offset}, predicted + offset
        residuals = force - predicted
        rmse = float(np.sqrt(np.mean(residuals**2)))
        spread = float(np.mean((force - force.mean()) ** 2))
        return cls(model, theta, lag, predicted, residuals, 1 - rmse**2 / spread if spread else 0.0, rmse)

    def __getitem__(self, name: str) -> float:
        return self.theta[name]


def slope_of_lag(
    model: Model,
    motion: Motion,
    theta: dict[str, float],
    lag: float,
    nonlinear: dict[str, float] | None = None,
) -> Array:
    """Derivative of the predicted force by the lag [N/s], shape (n,): of a sum of the position's derivatives the next.

    Args:
        model: which.
        motion: the position.
        theta: its linear parameters.
        lag: of the force [s].
        nonlinear: its nonlinear parameters, if it has any.
    """
    if model.of_position and isinstance(motion.chain, Chain):
        parts = [theta.get(n, 0.0) * motion.moved(k + 1, lag) for n, k in model.derivatives.items()]
        return -sum(parts, np.zeros(len(motion.rows)))
    step = _lag_parameter(motion, Lag(lag)).step
    up, down = (model.columns(motion, nonlinear or {}, at) for at in (lag + step, lag - step))
    pairs = zip(model.linear, up, down, strict=True)
    change = sum((theta.get(n, 0.0) * (u - d) for n, u, d in pairs), np.zeros(len(motion.rows)))
    return change / (2 * step)


def _evaluate(
    model: Model, motion: Motion, force: Array, nonlinear: dict[str, float], lag: float, known: Prior
) -> _Point:
    columns = np.column_stack(model.columns(motion, nonlinear, lag))
    rows, targets = known.rows(model.linear)
    theta = (
        solve(np.vstack([columns, rows]), np.concatenate([force, targets]))
        if len(rows)
        else solve(columns, force)
    )
    residuals = force - columns @ theta
    rss = float(residuals @ residuals)
    against = float(np.sum((targets - rows @ theta) ** 2)) if len(rows) else 0.0
    if LAG in known.known:
        value, weight = known.known[LAG]
        against += (weight * (lag - value)) ** 2
    return _Point(nonlinear, lag, columns, theta, residuals, rss, rss + against)


def _best_start(model: Model, motion: Motion, force: Array, lag: float) -> _Point:
    points = (
        _evaluate(
            model,
            motion,
            force,
            dict(zip([k.name for k in model.nonlinear], values, strict=True)),
            lag,
            NOTHING,
        )
        for values in product(*(parameter.starts for parameter in model.nonlinear))
    )
    return min(points, key=lambda point: point.rss)


def _descend(
    model: Model,
    motion: Motion,
    force: Array,
    point: _Point,
    lag: Lag,
    free_lag: bool,
    known: Prior,
) -> _Point:
    """Levenberg and Marquardt over the nonlinear parameters and the lag; each step solves for the linear ones."""
    outer = [*model.nonlinear, *([_lag_parameter(motion, lag)] if free_lag else [])]
    point = _evaluate(model, motion, force, point.nonlinear, point.lag, known) if known.known else point
    if not outer:
        return point
    damping = 1e-3
    for _ in range(_ROUNDS):
        slopes = _slopes(model, motion, point, outer)
        jacobian, residuals = _with_rows(np.column_stack([point.columns, slopes]), point, model, outer, known)
        step = _damped(jacobian, residuals, len(point.theta), damping)
        trial = _moved(model, motion, force, point, outer, step[len(point.theta) :], known)
        gain = 1 - trial.cost / point.cost if point.cost else 0.0
        if gain > -_ROUNDING:
            point, damping = (trial if gain > 0 else point), max(damping / 10, 1e-9)
            if gain < _CONVERGED:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return point


def _with_rows(
    jacobian: Array, point: _Point, model: Model, outer: list[NonlinearParameter], known: Prior
) -> tuple[Array, Array]:
    """The rows of what is known beforehand under those of the log."""
    names = (*model.linear, *(parameter.name for parameter in outer))
    rows, targets = known.rows(names)
    if not len(rows):
        return jacobian, point.residuals
    now = np.array([*point.theta, *(point.nonlinear.get(parameter.name, point.lag) for parameter in outer)])
    return np.vstack([jacobian, rows]), np.concatenate([point.residuals, targets - rows @ now])


def _lag_parameter(motion: Motion, lag: Lag) -> NonlinearParameter:
    limit = 3 * lag.std
    return NonlinearParameter(
        LAG, (lag.value,), lag.value - limit, lag.value + limit, 0.02 / motion.chain.rate
    )


def _slopes(model: Model, motion: Motion, point: _Point, outer: list[NonlinearParameter]) -> Array:
    """Derivatives of the predicted force by each parameter in its own scale, shape (n, len(outer))."""
    found = []
    for parameter in outer:
        if parameter.name == LAG:
            theta = dict(zip(model.linear, point.theta.tolist(), strict=True))
            found.append(slope_of_lag(model, motion, theta, point.lag, point.nonlinear))
            continue
        value = point.nonlinear[parameter.name]
        step = parameter.step * value if parameter.logarithmic else parameter.step
        moved = np.column_stack(
            model.columns(motion, {**point.nonlinear, parameter.name: value + step}, point.lag)
        )
        found.append((moved - point.columns) @ point.theta / parameter.step)
    return np.column_stack(found)


def _damped(jacobian: Array, residuals: Array, linear: int, damping: float) -> Array:
    """One step; only the outer parameters are damped, because the linear ones are solved for exactly."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    gram[np.arange(linear, len(scale)), np.arange(linear, len(scale))] += damping
    vector = jacobian.T @ residuals / scale
    step: Array = np.linalg.lstsq(gram, vector, rcond=1e-13)[0] / scale
    return step


def _moved(
    model: Model,
    motion: Motion,
    force: Array,
    point: _Point,
    outer: list[NonlinearParameter],
    step: Array,
    known: Prior,
) -> _Point:
    nonlinear, lag = dict(point.nonlinear), point.lag
    for parameter, change in zip(outer, step, strict=True):
        if parameter.name == LAG:
            lag = float(np.clip(lag + change, parameter.low, parameter.high))
        elif parameter.logarithmic:
            value = nonlinear[parameter.name] * np.exp(np.clip(change, -1.0, 1.0))
            nonlinear[parameter.name] = float(np.clip(value, parameter.low, parameter.high))
        else:
            nonlinear[parameter.name] = float(
                np.clip(nonlinear[parameter.name] + change, parameter.low, parameter.high)
            )
    return _evaluate(model, motion, force, nonlinear, lag, known)


def linearised(
    model: Model, motion: Motion, force: Array, nonlinear: dict[str, float], lag: float
) -> tuple[dict[str, float], Array, Array]:
    """A model about its nonlinear parameters and a lag, and the linear ones that fit best there.

    Args:
        model: which.
        motion: the position.
        force: filtered, at the motion's rows, shape (n,).
        nonlinear: parameters, by name.
        lag: of the force [s].

    Returns:
        All parameters by name, the lag last; the predicted force's derivatives by them, shape (n, p); what the model
        leaves of the force, shape (n,).
    """
    point = _evaluate(model, motion, force, nonlinear, lag, NOTHING)
    values = [*point.theta.tolist(), *(nonlinear[parameter.name] for parameter in model.nonlinear), lag]
    return dict(zip(_names(model), values, strict=True)), _jacobian(model, motion, point), point.residuals


def _names(model: Model) -> tuple[str, ...]:
    return (*model.linear, *(parameter.name for parameter in model.nonlinear), LAG)


def _jacobian(model: Model, motion: Motion, point: _Point) -> Array:
    """Derivatives of the predicted force by all parameters and the lag, shape (n, p)."""
    slopes = _slopes(model, motion, point, [*model.nonlinear, _lag_parameter(motion, Lag(point.lag))])
    for i, own in enumerate(model.nonlinear):
        if own.logarithmic:
            slopes[:, i] /= point.nonlinear[own.name]
    return np.column_stack([point.columns, slopes])


def _finish(model: Model, motion: Motion, force: Array, point: _Point, lag: Lag, known: Prior) -> Fit:
    jacobian = _jacobian(model, motion, point)
    names = _names(model)
    noise = noise_of(point.residuals, motion.rows, len(names) - int(lag.std == 0))
    theta = np.array([*point.theta, *(point.nonlinear[k.name] for k in model.nonlinear), point.lag])
    level = float(np.sqrt(point.rss / max(len(force) - len(point.theta), 1)))
    std = known.std(names, level)
    fixed = np.zeros((len(names), len(names)))
    if model.of_position:
        by_noise = bias_corrected(model, motion, jacobian, theta, level, lag, std)
        theta, pulled, less = theta + by_noise.step, by_noise.doubt, by_noise.less
        more = hidden(model, motion, jacobian, theta)
    else:
        pulled, less = np.zeros_like(fixed), None
        more = None
    fixed[:-1, :-1] = (
        covariance(
            jacobian[:, :-1],
            motion.rows,
            noise,
            None if std is None else std[:-1],
            None if less is None else less[:-1, :-1],
            None if more is None else more[:-1, :-1],
        )
        + pulled[:-1, :-1]
    )
    residuals = point.residuals - jacobian @ (theta - [*point.theta, *point.nonlinear.values(), point.lag])
    spread = float(np.mean((force - force.mean()) ** 2))
    rmse = float(np.sqrt(np.mean(residuals**2)))
    return Fit(
        model=model,
        names=names,
        theta=theta,
        cov=with_lag(jacobian, fixed, motion, noise, lag, pulled, std, less, more),
        fixed_cov=fixed,
        predicted=force - residuals,
        residuals=residuals,
        r2=1 - rmse**2 / spread if spread else 0.0,
        rmse=rmse,
        noise=noise,
        lag=float(theta[-1]),
        attenuation=np.sqrt(np.diag(pulled)),
        jacobian=jacobian,
    )
