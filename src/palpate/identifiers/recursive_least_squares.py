"""Recursive least squares for a loop of one's own: any number of parameters, one sample or many at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate._jit import kernel, law
from palpate._vector import Mat3, Vec3
from palpate.errors import InputError
from palpate.identifiers.least_squares import BLOCK, bounded, gathered, long_run, long_run_variance, rls
from palpate.signals.types import Estimate

_STATISTICS = 6  # the last of a state: weight, squares, products, last, blocks, filled
_HUGE = 1e300  # a sum of squares beyond it, or not a number, is no sample


class RecursiveLeastSquares:
    """Estimates theta in ``force = regressor . theta``, a sample at a time (thesis, eq. 5.7-5.10).

    When to use it: linear models, on line, each update in well under a microsecond of work; with `forgetting`
    below 1 for surfaces that change. The update is compiled in the constructor, never in the first `update`;
    `update_many`, which is for records, when it is first called.

    Args:
        theta: initial estimate, shape (n,).
        covariance: initial P, shape (n, n), symmetric and positive definite; how little `theta` is trusted.
        forgetting: in (0, 1]. Below 1 the trace of P is held under that of `covariance`, so that an estimator
            left without excitation stays finite for ever.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: shapes that do not fit, a forgetting outside (0, 1], a P that is no covariance.
    """

    def __init__(
        self,
        theta: ArrayLike,
        covariance: ArrayLike,
        forgetting: float = 1.0,
        names: tuple[str, ...] | None = None,
    ):
        start = np.array(theta, dtype=np.float64)
        P = np.array(covariance, dtype=np.float64)
        _check(start, P, forgetting)
        # To the last bit: with forgetting, what P is askew grows for ever.
        P = 0.5 * (P + P.T)
        n = self._n = len(start)
        self._shape = (n,)
        self.names = names if names is not None else tuple(f"theta{i}" for i in range(n))
        if len(self.names) != n:
            raise InputError(f"names must be as many as parameters: got {len(self.names)} names for {n}")
        self.forgetting = float(forgetting)
        self._state = np.concatenate([start, P.ravel(), np.zeros(n + n * n + _STATISTICS)])
        self._limit = float(np.trace(P))
        one, many = (_one3, _many3) if n == 3 else (_one, _many)
        self._one, self._many = one.compiled, many.compiled
        # An impossible sample compiles the update and leaves the state alone.
        self._one(self._state, np.full(n, np.nan), 0.0, self.forgetting, self._limit)

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in: regressor of shape (n,), force a number.

        Raises:
            InputError: a regressor of another shape, or a number that is not finite; the estimate is unchanged.
        """
        phi = np.asarray(regressor, dtype=np.float64)
        if phi.shape != self._shape:
            raise InputError(f"regressor must have shape ({self._n},), got {phi.shape}")
        if not self._one(self._state, phi, float(force), self.forgetting, self._limit):
            raise InputError(f"a sample must be finite, got regressor {phi}, force {force}; leave it out")

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, as k calls of `update` would: regressors of shape (k, n), forces of shape (k,)."""
        phi = np.ascontiguousarray(regressors, dtype=np.float64)
        y = np.ascontiguousarray(forces, dtype=np.float64)
        if phi.ndim != 2 or phi.shape[1] != self._n or y.shape != phi.shape[:1]:
            raise InputError(
                f"regressors must have shape (k, {self._n}) and forces (k,), got {phi.shape} and {y.shape}"
            )
        done = self._many(self._state, phi, y, self.forgetting, self._limit)
        if done < len(y):
            raise InputError(
                f"sample {done} is not finite: regressor {phi[done]}, force {y[done]}; "
                f"the {done} before it were taken in"
            )

    @property
    def theta(self) -> NDArray[np.float64]:
        """The estimate, shape (n,)."""
        return self._state[: self._n].copy()

    @property
    def covariance(self) -> NDArray[np.float64]:
        """P, shape (n, n): the covariance of theta if the force had noise of variance 1."""
        return self._state[self._n : self._n + self._n**2].reshape(self._n, self._n).copy()

    def estimate(self) -> Estimate:
        """The estimate with the covariance that the residuals' own size and correlation in time give it.

        Measured over blocks of samples: noise that stays correlated for longer than a block of 100 makes it too
        small.
        """
        n = self._n
        weight, squares, products, _, blocks, _ = (float(v) for v in self._state[-_STATISTICS:])
        noise = long_run_variance(weight, squares, products, float(n))
        scores, spread = np.split(self._state[n + n * n : -_STATISTICS], [n])
        covariance = long_run(self.covariance, noise, scores, spread.reshape(n, n), blocks)
        return Estimate(self.names, self.theta, covariance, weight)


def _check(theta: NDArray[np.float64], P: NDArray[np.float64], forgetting: float) -> None:
    n = theta.size
    if theta.ndim != 1 or n == 0:
        raise InputError(f"theta must have shape (n,) with n at least 1, got {theta.shape}")
    if P.shape != (n, n):
        raise InputError(f"covariance must have shape ({n}, {n}) as theta has {n} values, got {P.shape}")
    if not (np.isfinite(theta).all() and np.isfinite(P).all()):
        raise InputError("theta and covariance must be finite")
    if not np.allclose(P, P.T, rtol=1e-12, atol=0.0) or np.linalg.eigvalsh(P)[0] <= 0.0:
        raise InputError("covariance must be symmetric and positive definite, for example 1e6 * identity")
    if not 0.0 < forgetting <= 1.0:
        raise InputError(f"forgetting must be in (0, 1], got {forgetting}")


@law
def _count(state, keep, e):
    """Brings the statistics behind the estimate up to date, in place; whether a block of scores is full."""
    k = len(state) - _STATISTICS
    state[k] = keep * state[k] + 1.0
    state[k + 1] = keep * state[k + 1] + e * e
    state[k + 2] = keep * state[k + 2] + e * state[k + 3]
    state[k + 3] = e
    state[k + 4] *= keep * keep
    state[k + 5] += 1.0
    full = state[k + 5] >= BLOCK
    if full:
        state[k + 4] += 1.0
        state[k + 5] = 0.0
    return full


@law
def _vector(state, k):
    return Vec3(state[k], state[k + 1], state[k + 2])


@law
def _matrix(state, k):
    return Mat3(_vector(state, k), _vector(state, k + 3), _vector(state, k + 6))


@law
def _put(state, k, v):
    state[k], state[k + 1], state[k + 2] = v.x, v.y, v.z


@law
def _put_matrix(state, k, A):
    _put(state, k, A.r1)
    _put(state, k + 3, A.r2)
    _put(state, k + 6, A.r3)


@law
def _fill(state, k, values):
    for i in range(len(values)):
        state[k + i] = values[i]


@law
def _absorb3(state, phi, y, forgetting, limit):
    """One sample of three regressors, by value: no array is made. False where it is not finite."""
    p = _vector(phi, 0)
    if not abs(p @ p + y) < _HUGE:
        return False
    P = _matrix(state, 3)
    keep = bounded(forgetting, P, limit)
    theta, P, e = rls(_vector(state, 0), P, p, y, keep)
    _put(state, 0, theta)
    _put_matrix(state, 3, P)
    full = _count(state, keep, e)
    scores, spread = gathered(_vector(state, 12), _matrix(state, 15), p, e, keep, full)
    _put(state, 12, scores)
    _put_matrix(state, 15, spread)
    return True


@law
def _absorb(state, phi, y, forgetting, limit):
    """One sample of any number of regressors: the same laws on arrays. False where it is not finite."""
    if not abs(phi @ phi + y) < _HUGE:
        return False
    n = len(phi)
    known = n + n * n
    P = state[n:known].reshape(n, n)
    keep = bounded(forgetting, P, limit)
    theta, P, e = rls(state[:n], P, phi, y, keep)
    _fill(state, 0, theta)
    _fill(state, n, P.ravel())
    full = _count(state, keep, e)
    scores, spread = state[known : known + n], state[known + n : 2 * known].reshape(n, n)
    scores, spread = gathered(scores, spread, phi, e, keep, full)
    _fill(state, known, scores)
    _fill(state, known + n, spread.ravel())
    return True


@kernel
def _one3(state, phi, y, forgetting, limit):
    return _absorb3(state, phi, y, forgetting, limit)


@kernel
def _one(state, phi, y, forgetting, limit):
    return _absorb(state, phi, y, forgetting, limit)


@kernel
def _many3(state, phi, y, forgetting, limit):
    """Index of the first sample that is not finite, or how many there are."""
    for i in range(len(y)):
        if not _absorb3(state, phi[i], y[i], forgetting, limit):
            return i
    return len(y)


@kernel
def _many(state, phi, y, forgetting, limit):
    for i in range(len(y)):
        if not _absorb(state, phi[i], y[i], forgetting, limit):
            return i
    return len(y)
