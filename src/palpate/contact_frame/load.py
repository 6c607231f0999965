"""Readings of a force sensor in free motion: the tool's weight, and the sensor's bias.

The weight w keeps its direction in the base, the bias b in the sensor: f = R^T w + b with the tool's rotation R. Only a
tool that turns tells the two apart. Least squares over all orientations: with R' the mean of R,

    (1 - R' R'^T) w = mean(R f) - R' mean(f),    b = mean(f) - R'^T w

whose matrix has an eigenvalue of about the square of the angle for each direction that the tool turns w in, and 0 for
one that it leaves as it is. What of w cannot be told is left to b: their sum is right where the tool stands so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.free_motion.inertia import BLOCKS

if TYPE_CHECKING:
    from palpate.contact_frame.payload import Payload


_TOLD = np.radians(3.0) ** 2
"""Least eigenvalue for which a weight is told from a bias: by a smaller turn, a pose that errs by 0.3 deg makes a tenth
of the weight."""
_ROUNDS = 30
"""Of reweighting. The load that they find only begins the search for the free rows, which finds it anew."""
_ENOUGH = 20_000
"""Mask that are looked at, of a longer log evenly: that is a matter of time, not of what is found."""


@dataclass(frozen=True)
class Load:
    """Weight and bias of a force sensor.

    Args:
        weight: in the base's axes, as the sensor shows it [N], shape (3,).
        bias: in the tool's axes [N], shape (3,).
        std: standard deviation of an axis of their sum [N].
        separable: whether the log separates the whole weight from the bias.
        weight_std: standard deviation of an axis of the weight [N]; infinite if it is not separable.
    """

    weight: Array
    bias: Array
    std: float
    separable: bool
    weight_std: float

    def taken_off(self, force: Array, rotations: Array) -> Array:
        """The force in the base's axes without weight and bias, of one in the tool's axes, shape (n, 3)."""
        return np.einsum("nij,nj->ni", rotations, force - self.bias) - self.weight


def no_load() -> Load:
    """Where nothing is known."""
    return Load(np.zeros(3), np.zeros(3), 0.0, False, np.inf)


def turns(rotations: Array) -> bool:
    """Whether rotations, shape (n, 3, 3), differ by enough to tell a weight from a bias, at least in part."""
    mean = rotations.mean(axis=0)
    return bool(np.linalg.eigvalsh(np.eye(3) - mean @ mean.T)[-1] > _TOLD)


def known_load(force: Array, rotations: Array, payload: Payload) -> Load:
    """The bias by least squares over free rows, shape (n, 3), with the weight known; the payload's where n is 0."""
    weight = np.array(payload.weight)
    if not len(force):
        return Load(weight, np.array(payload.bias), payload.bias_std, True, payload.weight_std)
    left = force - np.einsum("nji,j->ni", rotations, weight)
    bias = left.mean(axis=0)
    return Load(weight, bias, _std_of_mean(left - bias), True, payload.weight_std)


def load_of(force: Array, rotations: Array, *, weighs: bool, weights: Array | None = None) -> Load:
    """Weight and bias by least squares over free rows.

    Args:
        force: in the tool's axes [N], shape (n, 3).
        rotations: of the tool, shape (n, 3, 3).
        weighs: whether the tool's weight is in it.
        weights: of the rows, shape (n,).
    """
    share = np.full(len(force), 1 / len(force)) if weights is None else weights / weights.sum()
    mean_turn, mean_force = np.einsum("n,nij->ij", share, rotations), share @ force
    in_base = share @ np.einsum("nij,nj->ni", rotations, force)
    values, axes = np.linalg.eigh(np.eye(3) - mean_turn @ mean_turn.T)
    told = (values > _TOLD) & weighs
    weight = axes[:, told] @ ((axes[:, told].T @ (in_base - mean_turn @ mean_force)) / values[told])
    bias = mean_force - mean_turn.T @ weight
    std = _std_of_mean(force - np.einsum("nji,j->ni", rotations, weight) - bias)
    whole = bool(told.all())
    return Load(weight, bias, std, whole, std / float(np.sqrt(values[0])) if whole else np.inf)


def robust_load(force: Array, rotations: Array, *, weighs: bool) -> Load:
    """Weight and bias where rows in contact are among the others, the fewer: by least absolute deviations."""
    every = slice(None, None, -(-len(force) // _ENOUGH))
    force, rotations = force[every], rotations[every]
    load = load_of(force, rotations, weighs=weighs)
    for _ in range(_ROUNDS):
        far = np.linalg.norm(load.taken_off(force, rotations), axis=1)
        weights = 1 / np.maximum(far, 1e-3 * float(np.median(far)) + 1e-12)
        load = load_of(force, rotations, weighs=weighs, weights=weights)
    return load


def _std_of_mean(residual: Array) -> float:
    """Of the mean of an axis of coloured noise, shape (n, 3), by the means of blocks."""
    blocks = [block.mean(axis=0) for block in np.array_split(residual, min(BLOCKS, len(residual)))]
    return float(np.sqrt(np.mean(np.var(blocks, axis=0, ddof=1)) / len(blocks))) if len(blocks) > 1 else 0.0
