"""A model's parameters, and by cause how far each may be off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators import budget as causes
from palpate.identification.estimators.budget import Budget
from palpate.identification.estimators.prediction import Prediction
from palpate.identification.problem import Problem


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
    problem: Problem

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    @property
    def half(self) -> Array:
        """95 % half-widths of all causes together, shape (p,)."""
        return causes.half_widths(self.budget)

    def half_of(self, name: str) -> float:
        """The same of one parameter."""
        return float(self.half[self.names.index(name)])

    def parts(self, name: str) -> dict[str, float]:
        """Half-width of one parameter by cause, largest first; their squares add up to that of the whole."""
        i = self.names.index(name)
        total = sum(float(part.variance[i]) for part in self.budget.values()) or 1.0
        whole = float(self.half[i])
        found = {
            cause: whole * float(np.sqrt(part.variance[i] / total)) for cause, part in self.budget.items()
        }
        return dict(sorted(found.items(), key=lambda item: -item[1]))
