"""Least squares whose regressors carry the noise of the position: the bias taken out, and what is left of it said.

White noise n of the position stands in every column as a filtered derivative of it. It adds N S to the information
Phi' Phi and nothing to Phi' f, which pulls the answer towards zero; taken out again, the answer is right on average
(bias-compensated least squares: Soderstrom, Errors-in-Variables Methods in System Identification, 2018, ch. 7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array

_LEAST = 0.1
"""Share of the information in any direction that must be left for the noise's to be taken out."""
_NOTHING = 0.05
"""Share of it under which a direction is as good as unknown."""
_ENCODERS = 2
_DOUBT = 0.3
"""Relative error of each of the noise's measured covariances."""


@dataclass(frozen=True)
class Compensation:
    """Effect of noise of the position on a least-squares answer.

    Args:
        step: to add to the answer, shape (p,).
        less: information that was the noise's and has to be taken out, shape (p, p).
        doubt: covariance of what the answer may still be off by, shape (p, p).
    """

    step: Array
    less: Array
    doubt: Array


def compensation(jacobian: Array, noisy: Array, theta: Array, spread: Array, weight: Array) -> Compensation:
    """Find it, in each direction of the parameters with its own share of noise in the information.

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
    scores = (
        rows * noisy @ spread * theta / scale[:, None]
    )  # what each derivative's noise pulls by, shape (p, k)
    root = np.linalg.cholesky(gram / np.outer(scale, scale) + 1e-13 * np.eye(len(scale)))
    inner = np.linalg.solve(root, np.linalg.solve(root, whole).T)
    noise, ways = np.linalg.eigh((inner + inner.T) / 2)
    share = np.minimum(1.0, (1 - _LEAST) / np.maximum(noise, 1e-300))
    pulls = ways.T @ np.linalg.solve(root, scores)
    # A direction that is nearly all noise is left where it is: how far to move it, nobody knows.
    step = np.where(share == 1, pulls.sum(axis=1) / np.maximum(1 - noise, _LEAST), 0.0)
    # How a pull c / (1 - n) moves with the noise's power, c and n both in proportion to it.
    doubt = _DOUBT * np.linalg.norm(pulls, axis=1) / np.maximum(1 - noise, _NOTHING) ** 2
    back = np.linalg.solve(root.T, ways) / scale[:, None]
    taken = (root @ ways) * scale[:, None]
    return Compensation(back @ step, (taken * (share * noise)) @ taken.T, (back * doubt**2) @ back.T)


def resting(jacobian: Array, position: Array, count: float, stiffness: float) -> Array:
    """Covariance of Phi' e, for the force e that a coarse position hides, shape (p, p).

    Where the position rests it errs by the same part of a count all the time, which no number of samples averages out:
    one error, even in a count (deviation count / sqrt(12)), for each place of a count's width. As the tip of an arm is
    read through several encoders, two are counted that are as coarse as the one seen.

    Args:
        jacobian: Phi, shape (n, p).
        position: shape (n,).
        count: what it moves by when its encoder counts on.
        stiffness: force per position.
    """
    if count == 0:
        return np.zeros((jacobian.shape[1], jacobian.shape[1]))
    _, place = np.unique(np.floor(position / count), return_inverse=True)
    sums = np.zeros((int(place.max()) + 1, jacobian.shape[1]))
    np.add.at(sums, place, jacobian)
    found: Array = _ENCODERS * (stiffness * count) ** 2 / 12 * sums.T @ sums
    return found
