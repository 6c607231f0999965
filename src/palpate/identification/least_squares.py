"""Linear least squares, and the noise that its residuals show."""

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices

_MAX_LAGS = 20_000  # maximum lags of the autocovariance


@dataclass(frozen=True)
class Noise:
    """The noise, as estimated from the residuals.

    Args:
        effective: number of independent samples that the residuals are worth.
        variance: of one residual.
    """

    effective: float
    variance: float


_UNKNOWN_VARIANCE = 1e6
"""Variance of a direction without information, over the largest variance that rounding can resolve."""
_MIN_EIGENVALUE = 1e-13
"""Eigenvalue of a scaled normal matrix, over the largest, below which it is rounding."""


def solve(columns: Array, target: Array) -> Array:
    """Least squares for columns, shape (n, p), of very different size. Returns shape (p,)."""
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0] = 1.0
    gram = columns.T @ columns / np.outer(scale, scale)
    if np.linalg.cond(gram) > 1e10:
        return np.asarray(np.linalg.lstsq(columns / scale, target, rcond=1e-12)[0] / scale)
    return np.linalg.solve(gram, (columns.T @ target) / scale) / scale


def estimate_noise(residuals: Array, places: Indices, parameters: int) -> Noise:
    """Measure size and colour of the noise from residuals at the rows `place` of an even grid, both of shape (n,).

    The autocorrelation is tapered over eight times the residuals' correlation time (Parzen), which keeps it positive
    definite.
    """
    places = _closed_up(places)
    residual_line = _spread(residuals, places)
    presence_line = _spread(np.ones_like(residuals), places)
    lag_count = int(min(len(residual_line) // 3, _MAX_LAGS)) + 1
    raw = _autocorrelation(residual_line, lag_count)
    pairs = np.maximum(_autocorrelation(presence_line, lag_count), 1.0)
    variance = float(raw[0] / pairs[0])
    if variance <= 0:
        return Noise(float(len(residuals)), 0.0)
    shape = raw / pairs / variance
    decorrelated = np.flatnonzero(
        np.abs(shape) < 0.1
    )  # the correlation time: the first to come down to a tenth
    correlation_time = int(decorrelated[0]) if len(decorrelated) else lag_count
    width = int(np.clip(8 * correlation_time, 4, lag_count))
    u = np.arange(width) / width
    inner = 1 - 6 * u**2 + 6 * u**3
    outer = 2 * (1 - u) ** 3
    taper = np.where(u < 0.5, inner, outer)  # Parzen
    correlations = shape[1:width] * taper[1:]
    inflation = max(1.0, float(1 + 2 * correlations.sum()))
    return Noise(max(len(residuals) / inflation, parameters + 2.0), variance)


def inverse(normal: Array) -> Array:
    """Invert a symmetric matrix; a direction without information gets a nearly infinite variance."""
    return solve_normal(normal, np.zeros(len(normal)))[1]


def solve_normal(normal: Array, right_side: Array) -> tuple[Array, Array]:
    """Solution of normal equations, shape (p,), and the inverse, shape (p, p).

    A direction without information has a nearly infinite variance, and the solution is 0 along it, where rounding alone
    would give any number.
    """
    size = np.sqrt(np.abs(np.diag(normal)))
    size[size == 0] = 1.0
    scaled = normal / np.outer(size, size)
    try:
        root = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        root = None
    if root is not None and float(np.diag(root).min()) ** 2 > 10 * _MIN_EIGENVALUE:
        half = np.linalg.inv(root)
        inverse_matrix: Array = half.T @ half / np.outer(size, size)
        return inverse_matrix @ right_side, inverse_matrix
    values, vectors = np.linalg.eigh((scaled + scaled.T) / 2)
    floor = _MIN_EIGENVALUE * max(float(values[-1]), 1e-280)
    known = values > floor
    gain = np.where(known, 1 / np.maximum(values, floor), _UNKNOWN_VARIANCE / floor)
    covariance: Array = (vectors * gain) @ vectors.T / np.outer(size, size)
    projections = vectors.T @ (right_side / size)
    theta: Array = vectors @ (np.where(known, gain, 0.0) * projections) / size
    return theta, covariance


def _closed_up(places: Indices) -> Indices:
    """Rows counted in steps of the finest spacing between them, so that a thinned grid has no holes.

    Nor gaps longer than any lag that is looked at.
    """
    differences = np.diff(places)
    step = max(int(np.gcd.reduce(differences)), 1)
    return np.asarray(np.r_[0, np.cumsum(np.minimum(differences // step, _MAX_LAGS + 1))])


def _spread(values: Array, places: Indices) -> Array:
    first = int(places[0])
    grid = np.zeros(int(places[-1]) - first + 1)
    grid[places - first] = values
    return grid


def _autocorrelation(line: Array, count: int) -> Array:
    size = 1 << (len(line) + count).bit_length()
    power = np.abs(np.fft.rfft(line, size)) ** 2
    return np.fft.irfft(power, size)[:count]
