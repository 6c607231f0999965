"""A model fitted to a log by least squares, and how far its parameters can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.descent import Descent, Point, names_of
from palpate.identification.estimators.lag_uncertainty import bias_corrected, hidden, with_lag
from palpate.identification.least_squares import Noise, covariance, noise_of, quantile
from palpate.identification.models import Model, Motion
from palpate.identification.prior import Lag, prior_of


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
        """Student's factor of a standard deviation for a 95 % interval."""
        return quantile(self.noise.effective, len(self.names))

    def score(self, effective: float) -> float:
        """Schwarz's criterion for a common number of effective samples: smaller is better."""
        mean_square = max(self.rmse**2, 1e-300)
        return effective * float(np.log(mean_square)) + len(self.names) * float(np.log(effective))


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
    asked = lag if lag.std > 0 else None
    descent = Descent(model, motion, force)
    best = descent.best_start(lag.value if start is None else start)
    for _ in range(2 if asked or lag.mass else 1):
        best = descent.from_point(best, asked)
        noise = float(np.sqrt(best.rss / max(len(force) - len(best.theta), 1)))
        descent = replace(descent, known=prior_of(lag, noise, asked is not None))
    if descent.known.known:
        best = descent.from_point(best, asked)
    return _finish(descent, best, lag)


def _finish(descent: Descent, point: Point, lag: Lag) -> Fit:
    model, motion, force = descent.model, descent.motion, descent.force
    jacobian = descent.jacobian(point)
    names = names_of(model)
    noise = noise_of(point.residuals, motion.rows, len(names) - int(lag.std == 0))
    theta = np.array([*point.theta, *(point.nonlinear[k.name] for k in model.nonlinear), point.lag])
    level = float(np.sqrt(point.rss / max(len(force) - len(point.theta), 1)))
    std = descent.known.std(names, level)
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
