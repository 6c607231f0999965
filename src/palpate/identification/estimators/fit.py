"""A model fitted to a log by least squares, were it exactly true and its noise the force's alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.descent import Descent, Point, names_of
from palpate.identification.least_squares import Noise, covariance, noise_of
from palpate.identification.models import Model, Motion
from palpate.identification.options import Lag, prior_of
from palpate.identification.uncertainty import student


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
