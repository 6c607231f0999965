"""Optimal powers of the frequencies of an excitation, for the worst parameter on the worst surface.

The powers w_i, together 1, minimise a convex criterion of the covariance C(w) = (prior + sum w_i m_i)^-1. Each update
multiplies a power by a root of its sensitivity (Titterington, 1976; Silvey, Titterington and Torsney, 1978; Yu, 2010,
for its convergence), and the general equivalence theorem of Kiefer and Wolfowitz (1960; Fedorov, 1972) bounds the
distance from the optimum.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.signals.types import NORMAL

_SHARPNESS = 8.0
"""Exponent of the norm that replaces a maximum; of 27 equal values the norm is 1.5 times as large."""
_EXPONENT = 0.2
"""Root of the sensitivity by which a power is multiplied; a larger one overshoots."""
_MAX_ROUNDS = 1500
_MAX_GAP = 0.01
"""Relative distance of the criterion from its optimum at which the updates stop."""


@dataclass(frozen=True)
class PowerSpectrum:
    """Powers of an excitation.

    Args:
        powers: of the frequencies, shape (F,); their costs together are 1.
        gap: upper bound of the criterion's relative distance from the optimum.
    """

    powers: Array
    gap: float


def optimal_powers(
    information: Array, prior: Array, targets: Array, costs: Array | None = None, start: Array | None = None
) -> PowerSpectrum:
    """Powers that minimise the largest half-width per target, of any parameter on any surface.

    Args:
        information: about each surface by each frequency with unit power, shape (C, F, n, n).
        prior: information, shape (n, n).
        targets: wanted 95 % half-widths of the parameters, shape (n,); infinite for a parameter that is estimated but
            of no interest.
        costs: of unit power at each frequency, shape (F,); 1 when left out.
        start: powers to start from, shape (F,).
    """
    count = information.shape[1]
    price = np.ones(count) if costs is None else costs
    # Each starts above 0: the first information can be inverted, and no frequency is lost for good.
    powers = np.full(count, 1.0) if start is None else start + 1e-3 * start.max()
    powers = powers / (powers @ price)
    for _ in range(_MAX_ROUNDS):
        sensitivity = power_sensitivity(information, prior, targets, powers) / price
        mean = float(powers @ (price * sensitivity))
        gap = float(sensitivity.max()) / mean - 1
        if gap < _MAX_GAP:
            break
        powers = powers * (sensitivity / mean) ** _EXPONENT
        powers /= powers @ price
    return PowerSpectrum(powers, gap)


def covariance(information: Array, prior: Array) -> Array:
    """Inverse of information and prior, shapes (..., n, n); an unknown direction has an enormous variance."""
    total = information + prior
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", total), 1e-30))
    scaled = total / (scale[..., :, None] * scale[..., None, :])
    inverse: Array = np.linalg.pinv(scaled + 1e-14 * np.eye(total.shape[-1]), rcond=1e-15, hermitian=True)
    return inverse / (scale[..., :, None] * scale[..., None, :])


def power_sensitivity(information: Array, prior: Array, targets: Array, powers: Array) -> Array:
    """Decrease of the criterion with the power of each frequency, shape (F,); arguments as of `optimal_powers`."""
    C = covariance(np.einsum("f,cfij->cij", powers, information), prior)
    wanted: NDArray[np.intp] = np.flatnonzero(np.isfinite(targets))
    unit = targets[wanted] / NORMAL
    values, slopes = largest_variance(C[:, wanted[:, None], wanted] / np.outer(unit, unit))
    slopes = slopes / np.outer(unit, unit)
    weights = (values / values.max()) ** (_SHARPNESS - 1)  # of the surfaces; the worst counts most
    rows = C[:, :, wanted]
    G = np.einsum("c,cip,cpq,cjq->cij", weights, rows, slopes, rows)
    sensitivity: Array = np.einsum("cij,cfij->f", G, information)
    return sensitivity


def largest_variance(C: Array) -> tuple[Array, Array]:
    """Largest variance of each covariance, as a norm, and its derivative: (c, k, k) to (c,) and (c, k, k)."""
    variances = np.einsum("cii->ci", C)
    values = (variances**_SHARPNESS).sum(axis=1) ** (1 / _SHARPNESS)
    slopes = (variances / values[:, None]) ** (_SHARPNESS - 1)
    return values, slopes[:, :, None] * np.eye(C.shape[-1])
