"""Which frequencies the power of an excitation belongs to: optimal input design over a range of surfaces.

The power w_i of each frequency, together 1, minimises a convex criterion of the covariance C(w) = (prior + sum w_i
m_i)^-1, for the worst of several surfaces. The update multiplies each power by a root of its sensitivity (Titterington,
1976; Silvey, Titterington and Torsney, 1978; Yu, 2010, for its convergence), and the general equivalence theorem of
Kiefer and Wolfowitz (1960; Fedorov, 1972) says how far from the optimum it can be at most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import unknown

_SHARPNESS = 8.0  # of the norm that stands for a maximum: of 27 equal ones it makes 1.5 times as much
_ROUNDS = 1500
_CLOSE = 0.01
"""To the best design there is, as a share of its criterion: Kiefer and Wolfowitz' bound on what is left."""


@dataclass(frozen=True)
class Spectrum:
    """Powers, and how good they are.

    Args:
        powers: of the frequencies, shape (F,); their costs together are 1.
        gap: by how much the criterion may at most be above the best, as a share of it.
    """

    powers: Array
    gap: float


def optimal(
    information: Array,
    prior: Array,
    wanted: Array,
    criterion: str = "worst",
    costs: Array | None = None,
    start: Array | None = None,
) -> Spectrum:
    """The optimal powers.

    Args:
        information: about each surface by each frequency with unit power, shape (C, F, n, n).
        prior: information, shape (n, n).
        wanted: what a deviation of each parameter is measured with, shape (n,): 1.96 sigma of this size is just good
            enough; infinite for a parameter that has to be estimated but is of no interest.
        criterion: `worst` parameter, `D`eterminant, `A`verage variance or worst direction (`E`), each of the worst
            surface.
        costs: of unit power at each frequency, shape (F,); 1 when left out.
        start: powers to start from.

    Raises:
        InputError: no such criterion.
    """
    if criterion not in CRITERIA:
        raise unknown("criterion", criterion, CRITERIA)
    count = information.shape[1]
    price = np.ones(count) if costs is None else costs
    asked = np.flatnonzero(np.isfinite(wanted))
    # A little for each, so that the first information can be inverted and no power is lost for good.
    powers = np.full(count, 1.0) if start is None else start + 1e-3 * start.max()
    powers = powers / (powers @ price)
    for _ in range(_ROUNDS):
        sensitivity = sensitivity_of(information, prior, wanted, asked, powers, CRITERIA[criterion]) / price
        mean = float(powers @ (price * sensitivity))
        gap = float(sensitivity.max()) / mean - 1
        if gap < _CLOSE:
            break
        powers = powers * (sensitivity / mean) ** _ROOTS[criterion]
        powers /= powers @ price
    return Spectrum(powers, gap)


def covariance(information: Array, prior: Array) -> Array:
    """Inverse of information and prior; what nothing is known of has an enormous variance. Shapes (..., n, n)."""
    total = information + prior
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", total), 1e-30))
    scaled = total / (scale[..., :, None] * scale[..., None, :])
    inverse: Array = np.linalg.pinv(scaled + 1e-14 * np.eye(total.shape[-1]), rcond=1e-15, hermitian=True)
    return inverse / (scale[..., :, None] * scale[..., None, :])


def sensitivity_of(
    information: Array,
    prior: Array,
    wanted: Array,
    asked: NDArray[np.intp],
    powers: Array,
    criterion: Callable[[Array], tuple[Array, Array]],
) -> Array:
    """How fast the criterion falls with the power of each frequency, shape (F,)."""
    C = covariance(np.einsum("f,cfij->cij", powers, information), prior)
    unit = wanted[asked] / 1.96
    own = C[:, asked[:, None], asked] / np.outer(unit, unit)
    values, slopes = criterion(own)
    slopes = slopes / np.outer(unit, unit)
    top = values.max()
    shares = (values / top) ** (_SHARPNESS - 1)  # towards the worst surface
    reach = C[:, :, asked]
    G = np.einsum("c,cip,cpq,cjq->cij", shares, reach, slopes, reach)
    fall: Array = np.einsum("cij,cfij->f", G, information)
    return fall


def _worst(C: Array) -> tuple[Array, Array]:
    """The largest variance, as a norm, and its derivative by C. Shapes (c, k, k) to (c,) and (c, k, k)."""
    variances = np.einsum("cii->ci", C)
    values = (variances**_SHARPNESS).sum(axis=1) ** (1 / _SHARPNESS)
    slopes = (variances / values[:, None]) ** (_SHARPNESS - 1)
    return values, slopes[:, :, None] * np.eye(C.shape[-1])


def _average(C: Array) -> tuple[Array, Array]:
    """A: the sum of the variances."""
    return np.einsum("cii->c", C), np.broadcast_to(np.eye(C.shape[-1]), C.shape)


def _determinant(C: Array) -> tuple[Array, Array]:
    """D: the volume of the confidence ellipsoid, as the k-th root of the determinant."""
    size = C.shape[-1]
    values = np.exp(np.linalg.slogdet(C)[1] / size)
    return values, values[:, None, None] / size * np.linalg.inv(C)


def _longest_axis(C: Array) -> tuple[Array, Array]:
    """E: the largest eigenvalue, as a norm of them all."""
    lengths, axes = np.linalg.eigh(C)
    values = (lengths**_SHARPNESS).sum(axis=1) ** (1 / _SHARPNESS)
    shares = (lengths / values[:, None]) ** (_SHARPNESS - 1)
    return values, np.einsum("cik,ck,cjk->cij", axes, shares, axes)


CRITERIA: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    "worst": _worst,
    "D": _determinant,
    "A": _average,
    "E": _longest_axis,
}
"""By name: from covariances to their values and derivatives."""

_ROOTS = {"worst": 0.2, "D": 0.5, "A": 0.3, "E": 0.2}
