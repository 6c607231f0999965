"""A lag that nobody knows beside a mass that nobody knows: what the log says of each, over all lags it allows.

(M s^2 + B s + K) e^(-sT) is nearly the same for many T with a B and an M of their own, so the likelihood is a long
bent valley and its curvature at one point says nothing of its length. Given the lag the model is linear; so
what is known is a mixture over a grid of lags, each weighted by how well it fits, by what is known of it beforehand,
and by how likely its mass is one at all (a sum over a grid: Gelman et al., Bayesian Data Analysis, 3rd ed., sec. 3.7).
Of all that fit alike, the answer with the least mass stands, and the mixture's spread about it is its covariance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.errors_in_variables import compensation
from palpate.identification.estimators.fit import Fit
from palpate.identification.estimators.lag_uncertainty import of_derivatives
from palpate.identification.estimators.least_squares import solve
from palpate.identification.filters.sensor_path import SensorPath
from palpate.identification.models import Model, Motion
from palpate.identification.prior import Lag

Array = NDArray[np.float64]

_POINTS = 33
_REACH = 4.0
_DOUBT = 3.0
_NOTHING = 1e-5
"""Weight under which a lag is not looked at again, as a share of the best one's."""


def over_all_lags(fitted: Fit, motion: Motion, force: Array, lag: Lag) -> Fit:
    """The same fit with what its parameters are over all lags.

    Args:
        fitted: with a mass and a lag that were both looked for.
        motion: of the log, behind a known sensor: no lag is shorter than its low-pass's.
        force: at the motion's rows, shape (n,).
        lag: what is known of it.
    """
    chain = motion.chain
    if not isinstance(chain, SensorPath):
        return fitted
    first = max(chain.low_pass.lag, lag.value - _REACH * lag.std)
    lags = np.linspace(first, lag.value + _REACH * lag.std, _POINTS)
    mixture = _Mixture.over(lags, fitted, motion, chain, force, lag)
    inside = lags[mixture.weights > _NOTHING * mixture.weights.max()]
    step = lags[1] - lags[0]
    lags = np.linspace(max(inside[0] - step, first), inside[-1] + step, _POINTS)
    mixture = _Mixture.over(lags, fitted, motion, chain, force, lag)
    theta = mixture.lightest(fitted.names.index("M"))
    known, whole = mixture.spread_about(theta)
    return replace(fitted, theta=theta, cov=whole, fixed_cov=known)


class _Mixture:
    """Estimates at several lags: weights (k,), means (k, p) and covariances (k, p, p), the lag the last parameter."""

    def __init__(self, weights: Array, means: Array, covs: Array):
        self.weights, self.means, self.covs = weights, means, covs

    @classmethod
    def over(
        cls, lags: Array, fitted: Fit, motion: Motion, chain: SensorPath, force: Array, lag: Lag
    ) -> _Mixture:
        from scipy.special import log_ndtr

        p = len(fitted.names)
        logs, misfits, doubts = np.empty((3, len(lags)))
        means, covs = np.empty((len(lags), p)), np.zeros((len(lags), p, p))
        power = fitted.noise.variance
        place = fitted.names.index("M")
        for i, own in enumerate(lags):
            columns = np.column_stack(fitted.model.columns(motion, {}, float(own)))
            theta, covs[i, :-1, :-1], misfits[i], doubts[i] = _given_lag(
                columns, force, fitted.model, chain, motion, power
            )
            means[i] = [*theta, own]
            mass = theta[place] / np.sqrt(covs[i, place, place])
            logs[i] = log_ndtr(mass) - 0.5 * ((own - lag.value) / lag.std) ** 2
        logs -= 0.5 * np.maximum(misfits - misfits.min() - doubts, 0.0) / power
        return cls(np.exp(logs - logs.max()), means, covs)

    def lightest(self, place: int) -> Array:
        """Of the means that count, the one with the least mass that is one, shape (p,)."""
        counts = self.weights > _NOTHING * self.weights.max()
        mass = np.where(counts & (self.means[:, place] >= 0), self.means[:, place], np.inf)
        best = int(np.argmin(mass)) if np.isfinite(mass).any() else int(np.argmax(self.weights))
        theta: Array = self.means[best]
        return theta

    def spread_about(self, theta: Array) -> tuple[Array, Array]:
        """Mean square deviations from theta, both (p, p): as if the lag were known, and over all lags."""
        weights = self.weights / self.weights.sum()
        off = self.means - theta
        known = np.einsum("k,kij->ij", weights, self.covs)
        return known, known + np.einsum("k,ki,kj->ij", weights, off, off)


def _given_lag(
    columns: Array, force: Array, model: Model, chain: SensorPath, motion: Motion, power: float
) -> tuple[Array, Array, float, float]:
    """Answer, covariance and sum of squared misfits at one lag, without what noise of the position does to them.

    Otherwise that noise, which a large mass multiplies, would speak against every large mass. How large it is, is
    known to a part only; the last number is how much of a misfit may be its doing.
    """
    theta = solve(columns, force)
    noisy, of_force = of_derivatives(model, theta)
    spread = chain.noise_spread(motion.noise)
    undone = compensation(columns, noisy, of_force, spread, np.zeros(len(theta)))
    theta = theta + undone.step
    gram = columns.T @ columns - undone.less
    misfit = float(force @ force - (columns.T @ force) @ theta)
    doubt = _DOUBT * len(force) * float(of_force @ spread @ of_force)
    covariance = np.asarray(power * np.linalg.inv(gram), dtype=np.float64)
    return theta, covariance, misfit, doubt
