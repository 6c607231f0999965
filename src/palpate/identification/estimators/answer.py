"""A model's parameters, and by cause how far each may be off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.budget import Budget, Spread
from palpate.identification.models import Model, Motion
from palpate.identification.problem import Problem
from palpate.identification.uncertainty import Contributions, half_widths


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
        """By a model, of a force, shape (n,); an offset that is not among the parameters is that of the mean."""
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

    def in_time(self, motion: Motion, force: Array) -> Prediction:
        """The same model, its linear parameters by least squares in time, which see a motion that no octave has."""
        columns = np.column_stack(self.model.columns(motion, self.theta, self.lag))
        size = np.abs(columns).max(axis=0)
        scaled, *_ = np.linalg.lstsq(columns / np.where(size > 0, size, 1.0), force, rcond=1e-9)
        theta = dict(zip(self.model.linear, (scaled / np.where(size > 0, size, 1.0)).tolist(), strict=True))
        return Prediction.of(self.model, motion, force, self.theta | theta, self.lag)

    def __getitem__(self, name: str) -> float:
        return self.theta[name]


@dataclass(frozen=True)
class Answer:
    """The parameters of a model.

    Args:
        names: of the parameters, the lag last if it is not known exactly.
        theta: shape (p,).
        cov: of the mixed model, shape (p, p).
        budget: by cause.
        fit: what the model predicts with them.
        explained: share of the force's variance in contact that the model alone accounts for.
        unexplained: rms of what is left beyond the sensor's noise [N].
        hidden: share of the force's amplitude in contact that the other forces beside the model do not explain either.
        noise: mean square of what both channels' own noise leaves of the force [N^2].
        friction: forces whose squares add up to the mean square of what may be friction, shape (m, f) [N].
        problem: the rows that it was fitted to.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    budget: Budget
    fit: Prediction
    explained: float
    unexplained: float
    hidden: float
    noise: float
    friction: Array
    problem: Problem

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    @property
    def half(self) -> Array:
        """95 % half-widths of all causes together, shape (p,)."""
        parts = self.budget.values()
        return half_widths([part.variance for part in parts], [part.each for part in parts])

    def half_of(self, name: str) -> float:
        """The same of one parameter."""
        return float(self.half[self.names.index(name)])

    def with_cause(self, cause: str, effect: Array) -> Answer:
        """The same with one more cause of error: the standard deviation of each parameter by it, shape (p,)."""
        return replace(self, budget={**self.budget, cause: Spread(effect**2)})

    def through(self, jacobian: Array, theta: Array) -> Answer:
        """Functions of the parameters instead, shape (p,): covariance and budget through their derivatives, (p, p)."""
        budget = {
            cause: Spread(np.einsum("ij,j->i", jacobian**2, part.variance), part.freedom)
            for cause, part in self.budget.items()
        }
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T, budget=budget)

    def contributions(self, name: str) -> Contributions:
        """Contribution of each cause to the uncertainty of one parameter."""
        place = self.names.index(name)
        return {cause: part.at(place) for cause, part in self.budget.items()}
