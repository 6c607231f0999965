"""Stability limits of a matrix that is affine in one number: every crossing of the unit circle, without a grid."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

_NEAR = 1e-4
"""Distance from the unit circle within which an eigenvalue of the pencil is taken up and polished."""
_SINGULAR = 1e-9


def crossings(start: Array, b: Array, c: Array) -> list[float]:
    """Every s > 0 for which start + s b c^T has an eigenvalue on the unit circle, in ascending order.

    Such an eigenvalue z makes G(z) = c^T (z - start)^-1 b real, 1/s; on the circle that is G(z) = G(1/z), whose
    zeros are the finite eigenvalues of a pencil of twice the size.

    Args:
        start: shape (n, n).
        b: shape (n,).
        c: shape (n,).
    """
    from scipy.linalg import eigvals

    n = len(b)
    E = np.zeros((2 * n + 1, 2 * n + 1))
    F = np.zeros((2 * n + 1, 2 * n + 1))
    E[:n, :n], E[n : 2 * n, n : 2 * n], E[n : 2 * n, 2 * n] = np.eye(n), start, b
    F[:n, :n], F[:n, 2 * n], F[n : 2 * n, n : 2 * n] = start, b, np.eye(n)
    F[2 * n, :n], F[2 * n, n : 2 * n] = c, -c
    pairs = eigvals(F, E, homogeneous_eigvals=True)
    finite = np.abs(pairs[1]) > _SINGULAR * np.abs(pairs[0])
    z = pairs[0][finite] / pairs[1][finite]
    near = z[np.abs(np.log(np.abs(z) + 1e-300)) < _NEAR]
    gains = {_refine(float(np.angle(v)), start, b, c) for v in near if v.imag >= -_SINGULAR}
    return sorted(s for s in gains if s is not None)


def _refine(angle: float, start: Array, b: Array, c: Array) -> float | None:
    """1/G at the nearest angle where G is real; None where that is no positive number."""
    eye = np.eye(len(b))
    for _ in range(8):
        z = np.exp(1j * angle)
        M = z * eye - start
        x = np.linalg.solve(M, b) if abs(np.linalg.det(M)) > 0.0 else None
        if x is None:
            return None
        G = complex(c @ x)
        slope = -1j * z * complex(c @ np.linalg.solve(M, x))
        if abs(slope.imag) < _SINGULAR * abs(slope) or not np.isfinite(G):
            break
        step = G.imag / slope.imag
        if abs(step) > 1e-2:
            return None
        angle -= step
        if abs(step) < 1e-14:
            break
    if not np.isfinite(G) or G.real <= 0.0 or abs(G.imag) > 1e-6 * abs(G):
        return None
    return float(f"{1.0 / G.real:.12g}")


def radius(matrix: Array) -> float:
    """The largest modulus of an eigenvalue."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def rank_one(difference: Array) -> tuple[Array, Array]:
    """b and c of a matrix b c^T.

    Raises:
        InputError: it has more than one direction.
    """
    U, s, Vt = np.linalg.svd(difference)
    if len(s) > 1 and s[1] > 1e-9 * s[0]:
        raise InputError("the loop does not depend on this number through one signal alone")
    return U[:, 0] * s[0], Vt[0]


def stable_between(start: Array, end: Array, high: float = np.inf) -> list[tuple[float, float]]:
    """All intervals of s in (0, high) for which start + s (end - start) is stable, the smallest first.

    Exact: between two crossings of the unit circle nothing changes, so one value of each tells.

    Args:
        start: the matrix at s = 0, shape (n, n).
        end: the matrix at s = 1, of which it differs through one signal, shape (n, n).
        high: of what is looked at.
    """
    b, c = rank_one(end - start)
    inside = [s for s in crossings(start, b, c) if s < high]
    edges = [0.0, *inside, high]
    intervals: list[tuple[float, float]] = []
    for low, top in pairwise(edges):
        middle = (
            (low * top) ** 0.5 if low > 0.0 and top < np.inf else 0.5 * top if top < np.inf else 2 * low + 1.0
        )
        if radius(start + middle * (end - start)) < 1.0:
            if intervals and intervals[-1][1] == low:
                intervals[-1] = (intervals[-1][0], top)
            else:
                intervals.append((low, top))
    return intervals
