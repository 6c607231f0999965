"""A Kalman filter on parameters that walk at random, each at its own pace."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identifiers import estimator
from palpate.identifiers.estimator import NAMES, VAGUE, is_sample
from palpate.identifiers.kernels.dimension import AnyNumber
from palpate.identifiers.kernels.least_squares import (
    covariance_in,
    drift_axis,
    error_covariance_in,
    known_first,
    length,
    limit_root,
    measure,
    propagate_covariance,
    put,
    statistics_at,
)
from palpate.signals.types import Estimate, NotNegativeTriple

MEMORY = 10_000.0
"""Samples that the noise is estimated from, at most; at the start, the newer half of those there are."""

_GUESS = 30.0
"""Samples that the first guess of the noise is worth: what looks like little noise at first may be all in theta."""


@part
class KalmanUpdate(NamedTuple):
    """Noise of the force: its variance [N^2], or 0 where it is to be estimated."""

    variance: float

    def absorb(self, state, phi, y, size):
        """Takes a sample in; False where it is none."""
        p = size.vector(phi, 0)
        if not is_sample(p, y):
            return False
        n = size.n
        k = length(n)
        S, doubt, steps = size.matrix(state, n), error_covariance_in(state, size), k + 2 * n * n
        S = limit_root(S, size.vector(state, k - 2 * n), size.vector(state, k - n), size)
        for i in range(n):
            S = drift_axis(S, size.axis(i), state[steps + i])
        r = _variance(doubt, self.variance, n)
        theta, S, gain, e, a = measure(size.vector(state, 0), S, p, y, r)
        # A sample takes from the older ones as much as it adds, shared among the parameters.
        keep, memory = 1.0 - (1.0 - r / a) / n, 1.0 - 1.0 / min(MEMORY, 2.0 * doubt.weight)
        put(state, size, theta, S, doubt.after(p, gain, e * sqrt(r / a), keep, memory, size))
        walked = size.matrix(state, k) + size.matrix(state, k + n * n)
        size.put_matrix(state, k, propagate_covariance(walked, p, gain, 0.0))
        return True


class KalmanFilter(estimator.Streaming):
    """Estimates theta in ``force = regressor . theta`` while each parameter goes a random walk.

    When to use it: the surface changes slowly, and how fast is known for each parameter: a stiffness that drifts
    with temperature, an offset that creeps, a mass that does not change at all. What is not excited becomes less
    and less certain, at its own pace, and no variance grows far beyond the initial one.

    Args:
        theta: initial estimate, shape (n,).
        covariance: its covariance, shape (n, n), symmetric and positive definite, in the units of theta.
        drift: standard deviation of each parameter's walk after one second [unit of theta per root second], shape
            (n,); 0 for what is constant.
        period: time between samples [s].
        noise: standard deviation of the force's noise [N], by which new samples are weighed against old knowledge;
            None has it estimated from the last samples, correlation in time included, beginning with 1 N.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: shapes that do not fit, numbers out of range.
    """

    def __init__(
        self,
        theta: ArrayLike,
        covariance: ArrayLike,
        drift: ArrayLike,
        period: float = 1e-3,
        noise: float | None = None,
        names: tuple[str, ...] | None = None,
    ):
        start, P = estimator.check_start(theta, covariance)
        pace = np.array(drift, dtype=np.float64)
        if pace.shape != start.shape or not (np.isfinite(pace).all() and (pace >= 0.0).all()):
            raise InputError(
                f"drift must be {len(start)} numbers of 0 or more, one a parameter, got {drift!r}"
            )
        if not (period > 0.0 and np.isfinite(period)):
            raise InputError(f"period must be above 0 s, got {period}")
        if noise is not None and not (noise > 0.0 and np.isfinite(noise)):
            raise InputError(f"noise must be above 0 N, or None to have it estimated, got {noise}")
        self.drift, self.period = pace, float(period)
        known = KalmanUpdate(0.0 if noise is None else float(noise) ** 2)
        state = _first(start, P, pace * np.sqrt(period), 1.0 if noise is None else float(noise))
        super().__init__(state, len(start), known, names)

    @property
    def covariance(self) -> Array:
        """P, shape (n, n): the covariance of theta, were the noise white and as it is said or estimated."""
        return covariance_in(self._state, self._n)

    @property
    def noise(self) -> float:
        """Standard deviation of the force's noise [N], as given or as estimated so far."""
        doubt = error_covariance_in(self._state, AnyNumber(self._n))
        return float(np.sqrt(_variance(doubt, self._policy.variance, float(self._n))))

    def estimate(self) -> Estimate:
        """The estimate with what the initial doubt, the walk and the noise that was heard, of any colour, have left."""
        size, n = AnyNumber(self._n), self._n
        doubt, walked = error_covariance_in(self._state, size), size.matrix(self._state, length(n))
        C = doubt.covariance(float(n)).of + walked.of
        seen = max(float(doubt.weight) - _GUESS - n, 0.0)
        return estimator.as_estimate(self.names, self.theta, C, seen, self._floor)


def _first(theta: Array, P: Array, steps: Array, noise: float) -> Array:
    """The state of `flat`; then the covariance that the walk has left, that of one step, and each step's deviation.

    The noise is believed to be as given, or 1 N, as if `_GUESS` samples had said so.
    """
    n, state = len(theta), known_first(theta, P)
    state[statistics_at(n)] = _GUESS + n
    state[statistics_at(n) + 1] = _GUESS * noise**2
    return np.concatenate([state, np.zeros(n * n), np.diag(steps**2).ravel(), steps])


@law
def _variance(doubt, given, n):
    return given if given > 0.0 else doubt.noise(n)


class KalmanIdentifier(estimator.IdentifierTable, tag="kalman-filter"):
    """A Kalman filter whose parameters go a random walk."""

    drift: NotNegativeTriple = (0.0, 0.0, 0.0)
    """Of M [kg], B [N s/m] and K [N/m] per root second."""

    def build(self, tick: float) -> KalmanFilter:
        """The estimator at its start."""
        return KalmanFilter(np.zeros(3), np.diag(np.square(VAGUE)), self.drift, tick, names=NAMES)
