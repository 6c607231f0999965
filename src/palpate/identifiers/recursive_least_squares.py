"""Recursive least squares for a loop of one's own: any number of parameters, one sample or many at a time."""

from abc import abstractmethod
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate.arrays import Array
from palpate.identifiers import estimator
from palpate.identifiers.dimension import AnyNumber
from palpate.identifiers.estimator import NAMES, VAGUE, Exponential, SIFt, is_sample
from palpate.identifiers.least_squares import (
    covariance_in,
    error_covariance_in,
    known_first,
    learn_sample,
    length,
    limit_root,
    put,
)
from palpate.signals.types import Estimate


class LeastSquaresEstimator(estimator.Streaming):
    """A least-squares estimate of theta at the front of the state."""

    @property
    def covariance(self) -> Array:
        """P, shape (n, n): the covariance of theta if the force had noise of variance 1."""
        return covariance_in(self._state, self._n)

    def estimate(self) -> Estimate:
        """The estimate with the covariance that the residuals' own size and correlation in time give it.

        Measured over blocks of samples: noise that stays correlated for longer than a block of 100 makes it too
        small.
        """
        doubt = error_covariance_in(self._state, AnyNumber(self._n))
        C = doubt.covariance(float(self._n)).of
        return estimator.as_estimate(self.names, self.theta, C, self._worth(float(doubt.weight)), self._floor)

    @abstractmethod
    def _worth(self, weight: float) -> float:
        """Number of samples that the estimate is worth, if the noise was heard in so many."""


@part
class Recursion(NamedTuple):
    """The update of `RecursiveLeastSquares`, with a forgetting policy."""

    forgetting: Any

    def absorb(self, state, phi, y, size):
        """Takes a sample in; False where it is none."""
        return absorb(state, phi, y, self.forgetting, size)[1] > 0.0


class RecursiveLeastSquares(LeastSquaresEstimator):
    """Estimates theta in ``force = regressor . theta``, a sample at a time (thesis, eq. 5.7-5.10).

    When to use it: linear models, on line, each update in well under a microsecond; with `forgetting` for surfaces
    that change slowly. The square root of the covariance is what is kept. The initial covariance bounds it for
    ever, in the sum of its variances and in their sum over the initial ones, so an estimator left without
    excitation stays finite, and ready.

    Args:
        theta: initial estimate, shape (n,).
        covariance: initial P, shape (n, n), symmetric and positive definite; how little `theta` is trusted.
        forgetting: a factor in (0, 1], which is `Exponential`, or a policy, such as `SIFt`.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: shapes that do not fit, a forgetting outside (0, 1], a P that is no covariance.
    """

    def __init__(
        self,
        theta: ArrayLike,
        covariance: ArrayLike,
        forgetting: float | estimator.Forgetting = 1.0,
        names: tuple[str, ...] | None = None,
    ):
        start, P = estimator.check_start(theta, covariance)
        self.forgetting = estimator.forgetting_policy(forgetting)
        super().__init__(known_first(start, P), len(start), Recursion(self.forgetting), names)

    def _worth(self, weight: float) -> float:
        return weight


@law
def absorb(state, phi, y, forgetting, size):
    """One sample, in place: its innovation, scaled to the noise, and the variance that it had; (0, 0) if it is none."""
    p = size.vector(phi, 0)
    if not is_sample(p, y):
        return 0.0, 0.0
    n = size.n
    ends = length(n) - 2 * n
    floor = size.vector(state, ends)
    S = limit_root(size.matrix(state, n), floor, size.vector(state, ends + n), size)
    S, counts = forgetting.forget(S, p, floor)
    if not counts:
        return 0.0, 1.0
    theta, doubt = size.vector(state, 0), error_covariance_in(state, size)
    theta, S, doubt, e, a = learn_sample(theta, S, doubt, p, y, forgetting.keep, size)
    put(state, size, theta, S, doubt)
    return e, a


class LeastSquaresIdentifier(estimator.IdentifierTable, tag="least-squares"):
    """Recursive least squares that forget what is told them to forget."""

    keep: Annotated[float, Meta(gt=0, le=1)] = 1.0
    """Forgetting factor; 1 forgets nothing."""
    forgetting: Literal["exponential", "sift"] = "exponential"

    def build(self, tick: float) -> RecursiveLeastSquares:
        """The estimator at its start."""
        policy = SIFt if self.forgetting == "sift" else Exponential
        forgetting: Any = policy(self.keep) if self.keep < 1.0 else 1.0
        return RecursiveLeastSquares(np.zeros(3), np.diag(np.square(VAGUE)), forgetting, NAMES)
