"""A norm in which matrices contract: of one from Lyapunov's equation, of several at once by an interior point.

What these functions find is not trusted: `cells` checks it by norms alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STEPS = 60
_MARGIN = 1e-9
_HEAVIER, _HEAVIEST = 8.0, 1e13
_ROWS = 64
"""Of a product at a time: below the size from which BLAS starts threads, which cost more than they bring here."""


def single(Phi: Array) -> Array | None:
    """L with |L^T Phi L^-T| < 1, shape (n, n); None if Phi is not stable.

    Lyapunov's equation of Phi over a rate between its spectral radius and 1, so that what is near Phi contracts too.
    """
    from scipy.linalg import solve_discrete_lyapunov

    radius = float(np.abs(np.linalg.eigvals(Phi)).max())
    if not radius < 1.0:
        return None
    rate = 0.5 * (1.0 + radius)
    scale = _balanced(Phi)
    scaled = Phi / scale[:, None] * scale
    P = solve_discrete_lyapunov(scaled.T / rate, np.eye(len(Phi)))
    return _root(P / np.outer(scale, scale))


def common(matrices: Sequence[Array], near: Array) -> Array | None:
    """L with |L^T Phi L^-T| < 1 for all of these matrices, shape (n, n); None if none is found.

    Newton's method on the barrier -log det of P - Phi_i^T P Phi_i + s W, of P and of 1 - P, s being made small; W is
    what `near` contracts by in its own norm, so that a slow direction is asked for no more than it can.

    Args:
        matrices: each of shape (n, n).
        near: of which the search takes its coordinates: one of them, or of their mean; stable.
    """
    start = single(near)
    if start is None:
        return None
    back = np.linalg.inv(start.T)
    inside = [start.T @ Phi @ back for Phi in matrices]
    middle = start.T @ near @ back
    P = _interior(inside, np.eye(len(middle)) - middle.T @ middle)
    if P is None:
        return None
    return start @ _chol(P)


def common_beside(matrices: Sequence[Array], still: Array) -> Array | None:
    """The same where all of these come near to a matrix that keeps one combination of the state for ever.

    With a gain, or a stiffness, of next to nothing the integrator stands still: P - Phi^T P Phi has to vanish in its
    direction r, so that P r is the left eigenvector l. P is then a block for all that l leaves out, and one number.

    Args:
        matrices: each of shape (n, n).
        still: with one eigenvalue 1, all others inside the unit circle, shape (n, n).
    """
    U, _, Vt = np.linalg.svd(still - np.eye(len(still)))
    left, right = U[:, -1], Vt[-1]
    S = np.column_stack([U[:, :-1], right / (left @ right)])
    into = np.asarray(np.linalg.inv(S))
    start = single((into @ still @ S)[:-1, :-1])
    if start is None:
        return None
    T = np.eye(len(S))
    T[:-1, :-1] = start.T
    back = np.asarray(np.linalg.inv(T))
    inside = [T @ into @ Phi @ S @ back for Phi in matrices]
    apart = max(inside, key=lambda M: float(np.linalg.norm(M[:-1, -1])))
    T[-1, -1] = np.sqrt(np.linalg.norm(apart[:-1, -1]) / max(float(np.linalg.norm(apart[-1, :-1])), 1e-300))
    back = np.asarray(np.linalg.inv(T))
    inside = [T @ into @ Phi @ S @ back for Phi in matrices]
    P = _interior(inside, np.eye(len(S)), apart=1)
    return None if P is None else (T @ into).T @ _chol(P)


def _interior(matrices: Sequence[Array], slack: Array, apart: int = 0) -> Array | None:
    """P, 0 < P < 1, with Phi^T P Phi < P for all.

    Args:
        matrices: each of shape (n, n).
        slack: W > 0 in P - Phi^T P Phi + s W, of which s is brought below 0, shape (n, n).
        apart: rows of P, the last ones, that have nothing beside the diagonal.
    """
    Phi = np.array(matrices)
    n = Phi.shape[1]
    pairs = _pairs(n, apart)
    P, unit = 0.5 * np.eye(n), np.linalg.inv(np.linalg.cholesky(slack))
    s = 2.0 * float(np.linalg.eigvalsh(unit @ (_turned(P, Phi) - P) @ unit.T).max()) + 1.0
    weight = 1.0
    for _ in range(_STEPS):
        for _ in range(4):
            gradient, hessian = _barrier(P, s, Phi, slack, pairs)
            gradient[-1] += weight
            step = _newton(hessian, gradient)
            if step is None:
                return P if _contracts(P, Phi) else None
            decrement = float(-gradient @ step)
            P, s = _along(P, s, step, Phi, slack, pairs)
            if s < 0.0 and _contracts(P, Phi):
                return P
            if decrement < 0.3:
                break
        # On the central path s is within (sum of all sizes)/weight of the least there is.
        if s > 2.0 * n * (len(Phi) + 2) / weight or weight > _HEAVIEST:
            return None
        weight *= _HEAVIER
    return None


def _barrier(P: Array, s: float, Phi: Array, W: Array, pairs: Pairs) -> tuple[Array, Array]:
    """Gradient and Hessian, by P's free elements and s, of -log det of P, 1 - P and all P - Phi^T P Phi + s W.

    With F^-1 = G: tr(G dF G dF) for dF = D - Phi^T D Phi is the quadratic form of G x G, -(G Phi^T) x (G Phi^T) and its
    transpose, and (Phi G Phi^T) x (Phi G Phi^T) in D, x being Kronecker's product: sums of outer products.
    """
    n, eye = len(P), np.eye(len(P))
    inverses = np.linalg.inv(np.concatenate([[P, eye - P], _constraints(P, s, Phi, W)]))
    G, back = inverses[2:], Phi.transpose(0, 2, 1)
    across, through = G @ back, Phi @ G @ back
    slid = G @ W
    square = slid @ G
    gradient = inverses[1] - inverses[0] + (through - G).sum(axis=0)
    beside = (square - Phi @ square @ back).sum(axis=0)
    hessian = np.empty((len(pairs) + 1, len(pairs) + 1))
    mixed = _products(across)
    hessian[:-1, :-1] = pairs.folded(_products(np.concatenate([inverses, through])) - mixed - mixed.T)
    hessian[-1, :-1] = hessian[:-1, -1] = pairs.of(beside)
    hessian[-1, -1] = float((slid * slid.transpose(0, 2, 1)).sum())
    return np.append(pairs.of(gradient), -float(np.trace(slid.sum(axis=0)))), hessian


def _products(matrices: Array) -> Array:
    """Sum of Kronecker's products of each with itself, shape (n n, n n)."""
    n = matrices.shape[1]
    flat = matrices.reshape(len(matrices), n * n)
    outer = np.empty((n * n, n * n))
    for row in range(0, n * n, _ROWS):
        outer[row : row + _ROWS] = flat[:, row : row + _ROWS].T @ flat
    return outer.reshape(n, n, n, n).transpose(0, 2, 1, 3).reshape(n * n, n * n)


def _newton(hessian: Array, gradient: Array) -> Array | None:
    """The step, by Cholesky; None where rounding won.

    `numpy.linalg.solve` starts threads for a matrix of this size.
    """
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    scale = 1.0 / np.sqrt(np.diag(hessian))
    try:
        factor = cho_factor(hessian * np.outer(scale, scale), check_finite=False)
    except LinAlgError:
        return None
    step = -scale * cho_solve(factor, scale * gradient, check_finite=False)
    return step if np.isfinite(step).all() else None


def _turned(P: Array, Phi: Array) -> Array:
    return Phi.transpose(0, 2, 1) @ P @ Phi


def _constraints(P: Array, s: float, Phi: Array, W: Array) -> Array:
    return P - _turned(P, Phi) + s * W


def _along(P: Array, s: float, step: Array, Phi: Array, W: Array, pairs: Pairs) -> tuple[Array, float]:
    """As far along a step as all constraints stay met."""
    dP, ds = pairs.matrix(step[:-1]), float(step[-1])
    length = 1.0
    for _ in range(40):
        Q, t = P + length * dP, s + length * ds
        if _positive(np.concatenate([[Q, np.eye(len(P)) - Q], _constraints(Q, t, Phi, W)])):
            return (Q, t) if length == 1.0 else (P + 0.9 * length * dP, s + 0.9 * length * ds)
        length *= 0.7
    return P, s


def _contracts(P: Array, Phi: Array) -> bool:
    return _positive(P) and _positive((1.0 - _MARGIN) * P - _turned(P, Phi))


def _positive(F: Array) -> bool:
    """Whether all of these matrices are positive definite, shape (..., n, n)."""
    try:
        np.linalg.cholesky(F)
    except np.linalg.LinAlgError:
        return False
    return True


@dataclass(frozen=True)
class Pairs:
    """The free elements of a symmetric matrix, as coordinates of length 1.

    Args:
        size: n of the matrix.
        upper: number of (i, j) in it, row by row, i <= j.
        lower: of (j, i).
        weight: 1/sqrt(2); 1/2 on the diagonal.
    """

    size: int
    upper: Array
    lower: Array
    weight: Array

    def __len__(self) -> int:
        return len(self.upper)

    def of(self, M: Array) -> Array:
        """<M, D> for each coordinate's matrix D, M being symmetric."""
        return 2.0 * self.weight * M.ravel()[self.upper]

    def matrix(self, coordinates: Array) -> Array:
        """The symmetric matrix."""
        flat = np.zeros(self.size * self.size)
        flat[self.upper] += self.weight * coordinates
        flat[self.lower] += self.weight * coordinates
        return flat.reshape(self.size, self.size)

    def folded(self, form: Array) -> Array:
        """A quadratic form of all elements, by coordinates."""
        rows = self.weight[:, None] * (form[self.upper] + form[self.lower])
        return (rows[:, self.upper] + rows[:, self.lower]) * self.weight


def _pairs(n: int, apart: int) -> Pairs:
    rows, columns = np.triu_indices(n)
    free = (columns < n - apart) | (rows == columns)
    rows, columns = rows[free], columns[free]
    weight = np.where(rows == columns, 0.5, np.sqrt(0.5))
    return Pairs(n, rows * n + columns, columns * n + rows, weight)


def _balanced(Phi: Array) -> Array:
    """Units in which rows and columns are of one size, shape (n,)."""
    scale = np.ones(len(Phi))
    for _ in range(20):
        sized = np.abs(Phi / scale[:, None] * scale)
        np.fill_diagonal(sized, 0.0)
        rows, columns = sized.sum(axis=1), sized.sum(axis=0)
        both = (rows > 0.0) & (columns > 0.0)
        scale[both] *= np.sqrt(rows[both] / columns[both])
    return scale


def _root(P: Array) -> Array | None:
    try:
        return _chol(0.5 * (P + P.T))
    except np.linalg.LinAlgError:
        return None


def _chol(P: Array) -> Array:
    return np.asarray(np.linalg.cholesky(P))
