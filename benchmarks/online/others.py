"""Other people's estimators, and the thesis' two, with the one interface: what stands beside ours in the tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.identifiers import NeuralProbe

Array = NDArray[np.float64]


class Other:
    """An estimator that takes a sample at a time."""

    theta: Array

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in."""
        raise NotImplementedError

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, one at a time."""
        for regressor, force in zip(np.asarray(regressors), np.asarray(forces).tolist(), strict=True):
            self.update(regressor, force)


class Padasip(Other):
    """padasip's recursive least squares; it starts from a multiple of the identity."""

    def __init__(self, theta: Array, covariance: Array, forgetting: float):
        import padasip

        start = 1.0 / float(np.diag(covariance).max())
        self._filter = padasip.filters.FilterRLS(len(theta), mu=forgetting, eps=start, w=theta.copy())

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in."""
        self._filter.adapt(force, regressor)

    @property
    def theta(self) -> Array:  # type: ignore[override]
        """The estimate."""
        return np.asarray(self._filter.w)


class Filterpy(Other):
    """filterpy's Kalman filter on parameters that walk at random."""

    def __init__(self, theta: Array, covariance: Array, drift: ArrayLike, period: float, noise: float):
        from filterpy.kalman import KalmanFilter

        n = len(theta)
        self._filter: Any = KalmanFilter(dim_x=n, dim_z=1)
        self._filter.x, self._filter.P = theta.copy()[:, None], covariance.copy()
        self._filter.F, self._filter.Q = np.eye(n), np.diag(np.square(drift)) * period
        self._filter.R *= noise**2

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in: a prediction and a correction."""
        self._filter.H = np.asarray(regressor)[None]
        self._filter.predict()
        self._filter.update(force)

    @property
    def theta(self) -> Array:  # type: ignore[override]
        """The estimate."""
        return np.asarray(self._filter.x[:, 0])


class Thesis(Other):
    """The thesis' recursive least squares as it stands in eq. 5.7-5.10, on arrays."""

    def __init__(self, theta: Array, covariance: Array, forgetting: float):
        self.theta, self._P, self._forgetting = theta.copy(), covariance.copy(), forgetting

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in."""
        phi = np.asarray(regressor)
        seen = self._P @ phi
        scale = 1.0 / (self._forgetting + phi @ seen)
        self.theta = self.theta + seen * (scale * (force - phi @ self.theta))
        self._P = (self._P - scale * np.outer(seen, seen)) / self._forgetting


class Network(Other):
    """The thesis' neural identifier for foam, in the order acceleration, velocity, position."""

    def __init__(self) -> None:
        self._probe = NeuralProbe.thesis("foam", learning_rate=1e-3)

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in."""
        self._probe.update(np.asarray(regressor)[::-1], force)

    @property
    def theta(self) -> Array:  # type: ignore[override]
        """M, B and K, as the network answers its probe."""
        return self._probe.estimate().theta[::-1]
