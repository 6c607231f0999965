"""Least squares whose regressors carry the noise of the position: the bias taken out, and what is left of it said.

White noise n of the position stands in every column as a filtered derivative of it. It adds N S to the information
Phi' Phi and nothing to Phi' f, which pulls the answer towards zero; taken out again, the answer is right on average
(bias-compensated least squares: Soderstrom, Errors-in-Variables Methods in System Identification, 2018, ch. 7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST = 0.1
"""Share of the information in any direction that must be left when the noise's is taken out."""
_DOUBT = 0.3
"""Relative error of the noise's measured power, and of its whiteness."""


@dataclass(frozen=True)
class Compensation:
    """What noise of the position did to a least-squares answer.

    Args:
        step: to add to the answer, shape (p,).
        less: information that was the noise's and has to be taken out, shape (p, p).
        doubt: how far the answer may still be off, shape (p,).
    """

    step: Array
    less: Array
    doubt: Array


def compensation(jacobian: Array, noisy: Array, theta: Array, spread: Array, weight: Array) -> Compensation:
    """Find it.

    Args:
        jacobian: derivatives of the prediction by the parameters, shape (n, p).
        noisy: how the columns' noise is made of that of the position's derivatives, shape (p, k).
        theta: how the force's noise is made of them, shape (k,).
        spread: covariance of the derivatives' noise in one row, shape (k, k).
        weight: of what is known of each parameter beforehand, shape (p,).
    """
    gram = jacobian.T @ jacobian + np.diag(weight)
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0] = 1.0
    rows = len(jacobian)
    whole = rows * noisy @ spread @ noisy.T / np.outer(scale, scale)
    score = rows * noisy @ spread @ theta / scale
    root = np.linalg.cholesky(gram / np.outer(scale, scale) + 1e-13 * np.eye(len(scale)))
    inner = np.linalg.solve(root, np.linalg.solve(root, whole).T)
    most = float(np.linalg.eigvalsh((inner + inner.T) / 2)[-1])
    share = min(1.0, (1 - _LEAST) / most) if most > 0 else 1.0
    left = root @ (np.eye(len(scale)) - share * inner) @ root.T
    step = np.linalg.solve(left, score) / scale
    return Compensation(
        share * step, share * whole * np.outer(scale, scale), np.abs(step) * (1 - share + share * _DOUBT)
    )
