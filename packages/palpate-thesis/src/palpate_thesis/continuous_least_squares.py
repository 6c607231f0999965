"""Least squares in continuous time: the identifier that the thesis names as the source of its own, its [32]."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares
from palpate.identifiers.estimator import LARGEST, NAMES, VAGUE

NODES = (0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0))[:, None]
"""Of Gauss and Legendre in a tick: with two of them the integral of a product of two straight lines is exact."""


class ContinuousLeastSquares(RecursiveLeastSquares):
    """Minimises the integral of the squared error over time, not its sum over samples (Kalaycioglu and Brown).

    theta' = P phi (f - phi . theta), P' = rate P - P phi (P phi)^T. Between two samples regressor and force are
    straight lines. There P^-1 and P^-1 theta have integrals in closed form, so that no step can make it unstable.

    When to use it: beside the thesis' source. `RecursiveLeastSquares` with `covariance` x `tick` is its integral by
    rectangles, fifty times as fast, and the same where regressors do not jump from sample to sample.

    Args:
        theta: initial estimate, shape (n,); M, B, K unless others are named.
        covariance: initial P, shape (n, n): of theta, for a force with noise of spectral density 1. As little trust as
            the bench's estimators have, if left out.
        tick: time between two samples [s].
        rate: at which the past is forgotten [1/s]; 0 forgets nothing.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: as of `RecursiveLeastSquares`; a tick that is not above 0.
    """

    def __init__(
        self,
        theta: ArrayLike = (0.0, 0.0, 0.0),
        covariance: ArrayLike | None = None,
        tick: float = 1e-3,
        rate: float = 0.0,
        names: tuple[str, ...] = NAMES,
    ):
        if not (math.isfinite(tick) and tick > 0.0 <= rate):
            raise InputError(f"tick must be above 0 and rate 0 or more, got {tick} and {rate}")
        P = np.diag(np.square(VAGUE)) / tick if covariance is None else covariance
        super().__init__(theta, P, math.exp(-rate * tick / 2.0), names)
        self.tick, self._last = tick, np.empty((0, self._n + 1))

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in, a tick after the one before; the first only begins the line to the second."""
        try:
            self.update_many([regressor], [force])  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise self._refusal(regressor, force) from None

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, all of them or, where one is not finite, none."""
        phi, y = np.array(regressors, dtype=np.float64), np.array(forces, dtype=np.float64)
        if phi.ndim != 2 or phi.shape[1] != self._n or y.shape != phi.shape[:1]:
            raise InputError(
                f"regressors must have shape (k, {self._n}), forces (k,), got {phi.shape}, {y.shape}"
            )
        samples = np.vstack([self._last, np.column_stack([phi, y])])
        if not (np.abs(samples) < LARGEST).all():
            raise InputError("every sample must be finite numbers up to 1e30; leave others out")
        self._last = samples[-1:]
        super().update_many(*at_nodes(samples, self.tick))

    def _worth(self, weight: float) -> Any:
        return weight / len(NODES)


def at_nodes(samples: Array, tick: float) -> tuple[Array, Array]:
    """Regressors, shape (2 (k - 1), n), and forces at the nodes between k samples, shape (k, n + 1), force last.

    The sum of their products is the integral of the products of the lines through the samples.
    """
    lines = samples[:-1, None] + NODES * np.diff(samples, axis=0)[:, None]
    nodes = math.sqrt(tick / len(NODES)) * lines.reshape(-1, samples.shape[1])
    return nodes[:, :-1], nodes[:, -1]
