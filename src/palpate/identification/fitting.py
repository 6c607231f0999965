"""Fitting one model to one log: least squares inside, its knobs and the force's lag by Gauss and Newton outside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from palpate.identification.models import Knob, Model, Motion
from palpate.identification.regression import Noise, covariance, noise_of, quantile, solve

Array = NDArray[np.float64]

_ROUNDS = 30
_CONVERGED = 1e-6
_LAG = "lag"


@dataclass(frozen=True)
class Lag:
    """What is known about how much later the force is read than the position.

    Args:
        value: [s]; where the fit starts if it is not known.
        std: its standard deviation [s]; of a lag that is not known: how large it may be.
        known: calibrated beforehand, so that the log is not asked.
    """

    value: float = 0.0
    std: float = 0.0
    known: bool = True


@dataclass(frozen=True)
class Fit:
    """A model fitted to a log.

    Args:
        model: which.
        names: of the parameters: the linear ones, then the knobs, then the lag.
        theta: their values, shape (p,).
        cov: their covariance, coloured noise and the lag's uncertainty included, shape (p, p).
        fixed_cov: the same as if the lag were known exactly, shape (p, p).
        predicted, residuals: of the filtered force, shape (n,).
        r2, rmse: of the fit.
        noise: colour of the residuals.
        lag: the lag used [s].
        attenuation: how far noise of the position may have pulled each parameter, shape (p,); part of `cov`.
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
    knobs: dict[str, float]
    lag: float
    columns: Array
    theta: Array
    residuals: Array

    rss: float


def fit(model: Model, motion: Motion, force: Array, lag: Lag, free_lag: bool = False) -> Fit:
    """Fit a model.

    Args:
        model: which.
        motion: the position.
        force: filtered, at the motion's rows, shape (n,).
        lag: what is known about it; if it is not known, its uncertainty is part of every interval.
        free_lag: look for the lag in this log.
    """
    best = _best_start(model, motion, force, lag.value)
    best = _descend(model, motion, force, best, lag, free_lag)
    return _finish(model, motion, force, best, lag)


def _evaluate(model: Model, motion: Motion, force: Array, knobs: dict[str, float], lag: float) -> _Point:
    columns = np.column_stack(model.columns(motion, knobs, lag))
    theta = solve(columns, force)
    residuals = force - columns @ theta
    return _Point(knobs, lag, columns, theta, residuals, float(residuals @ residuals))


def profile(fitted: Fit, motion: Motion, force: Array, lag: float) -> float:
    """Sum of squared residuals of the same model and knobs at another lag."""
    knobs = {knob.name: fitted[knob.name] for knob in fitted.model.knobs}
    return _evaluate(fitted.model, motion, force, knobs, lag).rss


def _best_start(model: Model, motion: Motion, force: Array, lag: float) -> _Point:
    points = (
        _evaluate(model, motion, force, dict(zip([k.name for k in model.knobs], values, strict=True)), lag)
        for values in product(*(knob.starts for knob in model.knobs))
    )
    return min(points, key=lambda point: point.rss)


def _descend(model: Model, motion: Motion, force: Array, point: _Point, lag: Lag, free_lag: bool) -> _Point:
    """Levenberg and Marquardt over the knobs and the lag, the linear parameters solved for at every step."""
    outer = [*model.knobs, *([_lag_knob(motion, lag)] if free_lag else [])]
    if not outer:
        return point
    damping = 1e-3
    for _ in range(_ROUNDS):
        slopes = _slopes(model, motion, point, outer)
        jacobian = np.column_stack([point.columns, slopes])
        step = _damped(jacobian, point.residuals, len(point.theta), damping)
        trial = _moved(model, motion, force, point, outer, step[len(point.theta) :])
        if trial.rss < point.rss:
            gain = 1 - trial.rss / point.rss
            point, damping = trial, max(damping / 10, 1e-9)
            if gain < _CONVERGED:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return point


def _lag_knob(motion: Motion, lag: Lag) -> Knob:
    limit = 3 * lag.std
    return Knob(_LAG, (lag.value,), lag.value - limit, lag.value + limit, 0.02 / motion.chain.rate)


def _slopes(model: Model, motion: Motion, point: _Point, outer: list[Knob]) -> Array:
    """Derivatives of the predicted force by each knob in its own scale, shape (n, len(outer))."""
    found = []
    for knob in outer:
        if knob.name == _LAG:
            up = model.columns(motion, point.knobs, point.lag + knob.step)
            down = model.columns(motion, point.knobs, point.lag - knob.step)
            found.append((np.column_stack(up) - np.column_stack(down)) @ point.theta / (2 * knob.step))
            continue
        value = point.knobs[knob.name]
        step = knob.step * value if knob.logarithmic else knob.step
        moved = np.column_stack(model.columns(motion, {**point.knobs, knob.name: value + step}, point.lag))
        found.append((moved - point.columns) @ point.theta / knob.step)
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
    model: Model, motion: Motion, force: Array, point: _Point, outer: list[Knob], step: Array
) -> _Point:
    knobs, lag = dict(point.knobs), point.lag
    for knob, change in zip(outer, step, strict=True):
        if knob.name == _LAG:
            lag = float(np.clip(lag + change, knob.low, knob.high))
        elif knob.logarithmic:
            value = knobs[knob.name] * np.exp(np.clip(change, -1.0, 1.0))
            knobs[knob.name] = float(np.clip(value, knob.low, knob.high))
        else:
            knobs[knob.name] = float(np.clip(knobs[knob.name] + change, knob.low, knob.high))
    return _evaluate(model, motion, force, knobs, lag)


def _finish(model: Model, motion: Motion, force: Array, point: _Point, lag: Lag) -> Fit:
    knob = _lag_knob(motion, lag)
    outer = [*model.knobs, knob]
    slopes = _slopes(model, motion, point, outer)
    for i, own in enumerate(model.knobs):
        if own.logarithmic:
            slopes[:, i] /= point.knobs[own.name]
    jacobian = np.column_stack([point.columns, slopes])
    names = (*model.linear, *(k.name for k in model.knobs), _LAG)
    noise = noise_of(point.residuals, motion.rows, len(names) - int(lag.known))
    fixed = np.zeros((len(names), len(names)))
    pulled = _attenuation(model, motion, jacobian[:, :-1], point.theta)
    fixed[:-1, :-1] = covariance(jacobian[:, :-1], motion.rows, noise) + np.outer(pulled, pulled)
    theta = np.array([*point.theta, *(point.knobs[k.name] for k in model.knobs), point.lag])
    spread = float(np.mean((force - force.mean()) ** 2))
    rmse = float(np.sqrt(point.rss / len(force)))
    return Fit(
        model=model,
        names=names,
        theta=theta,
        cov=_with_lag(jacobian, fixed, motion, noise, lag, pulled),
        fixed_cov=fixed,
        predicted=force - point.residuals,
        residuals=point.residuals,
        r2=1 - rmse**2 / spread if spread else 0.0,
        rmse=rmse,
        noise=noise,
        lag=point.lag,
        attenuation=np.append(pulled, 0.0),
    )


def _attenuation(model: Model, motion: Motion, jacobian: Array, theta: Array) -> Array:
    """How far white noise of the position pulls the parameters: (Phi' Phi)^-1 n S theta, S the noise of the columns."""
    shift = np.zeros(jacobian.shape[1])
    if motion.noise == 0:
        return shift
    places = [model.linear.index(name) for name in model.derivatives]
    spread = motion.chain.noise_gain(tuple(model.derivatives.values())) * motion.noise**2
    shift[places] = len(motion.rows) * spread @ theta[places]
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    pulled: Array = np.linalg.lstsq(gram, shift / scale, rcond=1e-12)[0] / scale
    return pulled


def _with_lag(jacobian: Array, fixed: Array, motion: Motion, noise: Noise, lag: Lag, pulled: Array) -> Array:
    """The covariance with the lag's own uncertainty, be it calibrated (the log is not asked) or found in the log."""
    if lag.std == 0:
        return fixed
    if not lag.known:
        prior = np.full(jacobian.shape[1], np.inf)
        prior[-1] = lag.std
        found = covariance(jacobian, motion.rows, noise, prior)
        found[:-1, :-1] += np.outer(pulled, pulled)
        return found
    shift = -solve(jacobian[:, :-1], jacobian[:, -1])  # how the answer moves with the lag
    grown = fixed + np.pad(np.outer(shift, shift), (0, 1)) * lag.std**2
    grown[-1, :-1] = grown[:-1, -1] = shift * lag.std**2
    grown[-1, -1] = lag.std**2
    return grown


def part_of(fitted: Fit, motion: Motion, force: Array, inside: NDArray[np.bool_]) -> tuple[Fit, Array]:
    """Refit only the linear parameters on some of the rows, knobs and lag left as they are.

    Returns:
        The fit with parameters and covariance of this part, and its residuals.
    """
    knobs = {k.name: fitted[k.name] for k in fitted.model.knobs}
    columns = np.column_stack(fitted.model.columns(motion, knobs, fitted.lag))[inside]
    theta = solve(columns, force[inside])
    residuals = force[inside] - columns @ theta
    noise = noise_of(residuals, motion.rows[inside], len(theta))
    cov = covariance(columns, motion.rows[inside], noise)
    names = fitted.model.linear
    rmse = float(np.sqrt(np.mean(residuals**2)))
    spread = float(np.var(force[inside])) or 1.0
    part = replace(
        fitted, names=names, theta=theta, cov=cov, fixed_cov=cov, residuals=residuals, noise=noise,
        predicted=columns @ theta, rmse=rmse, r2=1 - rmse**2 / spread,
    )  # fmt: skip
    return part, residuals
