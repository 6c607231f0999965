"""Least squares whose intervals stay honest when the noise is coloured."""

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices

_LONGEST = 20_000  # lags of the autocovariance that are ever looked at


@dataclass(frozen=True)
class Noise:
    """The noise, as estimated from the residuals.

    Args:
        autocovariance: of the residuals, tapered, shape (n_lags,).
        effective: number of independent samples that the residuals are worth.
        variance: of one residual.
    """

    autocovariance: Array
    effective: float
    variance: float


_BEYOND = 1e6
"""Variance of a direction without information, over that of the least that rounding lets one see."""
_SINGULAR = 1e-13
"""Eigenvalue of a scaled normal matrix, over the largest, below which rounding alone makes it."""


def solve(columns: Array, target: Array) -> Array:
    """Least squares for columns, shape (n, p), of very different size. Returns shape (p,)."""
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0] = 1.0
    gram = columns.T @ columns / np.outer(scale, scale)
    if np.linalg.cond(gram) > 1e10:
        return np.asarray(np.linalg.lstsq(columns / scale, target, rcond=1e-12)[0] / scale)
    return np.linalg.solve(gram, (columns.T @ target) / scale) / scale


def noise_of(residuals: Array, place: Indices, parameters: int) -> Noise:
    """Measure the colour of the noise from residuals at the rows `place` of an even grid, both of shape (n,).

    The autocovariance is tapered (Parzen), which keeps it a valid one, over eight times the residuals' own correlation
    time; it is raised by what the fit has taken out of it.
    """
    place = _closed_up(place)
    line = _spread(residuals, place)
    there = _spread(np.ones_like(residuals), place)
    most = int(min(len(line) // 3, _LONGEST)) + 1
    raw = _autocorrelation(line, most)
    pairs = np.maximum(_autocorrelation(there, most), 1.0)
    variance = float(raw[0] / pairs[0])
    if variance <= 0:
        return Noise(np.zeros(1), float(len(residuals)), 0.0)
    shape = raw / pairs / variance
    below = np.flatnonzero(np.abs(shape) < 0.1)  # the correlation time: the first to come down to a tenth
    width = int(np.clip(8 * (int(below[0]) if len(below) else most), 4, most))
    u = np.arange(width) / width
    taper = np.where(u < 0.5, 1 - 6 * u**2 + 6 * u**3, 2 * (1 - u) ** 3)  # Parzen
    curve = variance * shape[: len(taper)] * taper
    inflation = max(1.0, float(1 + 2 * (shape[1 : len(taper)] * taper[1:]).sum()))
    effective = max(len(residuals) / inflation, parameters + 2.0)
    return Noise(curve * effective / (effective - parameters), effective, variance)


def covariance(columns: Array, place: Indices, noise: Noise, prior: Array | None = None) -> Array:
    """Covariance of the least-squares answer under coloured noise, shape (p, p).

    (A + L)^-1 (Phi' Gamma Phi + prior part) (A + L)^-1 with A = Phi' Phi: the sandwich with the noise's own Gamma. Phi,
    shape (n, p), is at rows of an even grid, shape (n,); the prior is the standard deviation of each parameter known
    beforehand, infinite where nothing is; shape (p,).
    """
    place = _closed_up(place)
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0] = 1.0
    scaled = columns / scale
    gram = scaled.T @ scaled
    meat = scaled.T @ _smooth(scaled, place, noise.autocovariance)
    if prior is not None:
        curve = noise.autocovariance
        level = max(float(curve[0] + 2 * curve[1:].sum()), noise.variance)  # n times that of a mean of n
        weight = level / (prior * scale) ** 2
        gram = gram + np.diag(weight)
        meat = meat + level * np.diag(weight)
    bread = inverse(gram)
    return np.asarray(bread @ ((meat + meat.T) / 2) @ bread / np.outer(scale, scale))


def inverse(normal: Array) -> Array:
    """Of a symmetric matrix; a direction that it says nothing of has a variance beyond all bounds, not none."""
    return solved(normal, np.zeros(len(normal)))[1]


def solved(normal: Array, right: Array) -> tuple[Array, Array]:
    """Solution of normal equations, shape (p,), and the inverse, shape (p, p).

    A direction that the equations say nothing of has a variance beyond all bounds; the solution is 0 along it, where
    rounding alone would give any number.
    """
    size = np.sqrt(np.abs(np.diag(normal)))
    size[size == 0] = 1.0
    scaled = normal / np.outer(size, size)
    try:
        root = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        root = None
    if root is not None and float(np.diag(root).min()) ** 2 > 10 * _SINGULAR:
        half = np.linalg.inv(root)
        found: Array = half.T @ half / np.outer(size, size)
        return found @ right, found
    values, vectors = np.linalg.eigh((scaled + scaled.T) / 2)
    floor = _SINGULAR * max(float(values[-1]), 1e-280)
    known = values > floor
    gain = np.where(known, 1 / np.maximum(values, floor), _BEYOND / floor)
    wide: Array = (vectors * gain) @ vectors.T / np.outer(size, size)
    theta: Array = vectors @ (np.where(known, gain, 0.0) * (vectors.T @ (right / size))) / size
    return theta, wide


def _closed_up(place: Indices) -> Indices:
    """Rows counted in steps of the finest spacing between them, so that a thinned grid has no holes.

    Nor gaps longer than any lag that is looked at.
    """
    jumps = np.diff(place)
    step = max(int(np.gcd.reduce(jumps)), 1)
    return np.asarray(np.r_[0, np.cumsum(np.minimum(jumps // step, _LONGEST + 1))])


def _spread(values: Array, place: Indices) -> Array:
    first = int(place[0])
    line = np.zeros(int(place[-1]) - first + 1)
    line[place - first] = values
    return line


def _autocorrelation(line: Array, count: int) -> Array:
    size = 1 << (len(line) + count).bit_length()
    power = np.abs(np.fft.rfft(line, size)) ** 2
    return np.fft.irfft(power, size)[:count]


def _smooth(columns: Array, place: Indices, autocovariance: Array) -> Array:
    """Gamma times each column."""
    from scipy.signal import oaconvolve

    line = np.zeros((int(place[-1] - place[0]) + 1, columns.shape[1]))
    line[place - place[0]] = columns
    kernel = np.concatenate([autocovariance[:0:-1], autocovariance])
    reach = len(autocovariance) - 1
    return np.asarray(oaconvolve(line, kernel[:, None], axes=0)[reach + place - place[0]])
