"""Least squares weighted by octave: each octave counts as much as what is left in it allows.

The force is a contact model's columns times theta, plus columns of other causes (friction, a stiffness that changes
with depth), plus noise with a level of its own in each octave, which is estimated with theta (iteratively reweighted
least squares; the noise model of Box and Jenkins without its parameters: Ljung 1999, ch. 7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.estimators.octaves import Octaves
from palpate.identification.least_squares import solved

_STEPS = 3
"""Of reweighting. Two are enough for the efficiency of known levels (feasible generalised least squares); until they
rest, a model that does not hold would end up fitting the octaves with the most lines and the least force."""
_NEIGHBOUR = 2.0
"""Lines that the level of an octave borrows from the next higher one: its own few may be fitted by chance."""
LARGEST = 3.0
"""Deviation of the weak prior of a term's force, over the force's. It counts only where the log says nothing of the
term, as for a damping that friction may stand for; there any number of this size does."""


@dataclass(frozen=True)
class System:
    """The normal equations by octave.

    Args:
        products: of the columns with each other, the force last, shape (octaves, p + 1, p + 1).
        lines: shape (octaves,).
        stretches: the same as products and lines for each stretch of the log, with a leading axis.
        prior_mean, prior_weight: of the parameters, shape (p,).
    """

    products: Array
    lines: Array
    stretches: tuple[Array, Array]
    prior_mean: Array
    prior_weight: Array

    @property
    def size(self) -> int:
        """Number of parameters, p."""
        return len(self.prior_mean)


@dataclass(frozen=True)
class Solution:
    """Parameters and their covariance for given noise levels.

    Args:
        theta: shape (p,).
        cov: shape (p, p).
        noise: variance of a line in each octave, shape (octaves,).
    """

    theta: Array
    cov: Array
    noise: Array


def system_of(octaves: Octaves, names: tuple[str, ...], prior: dict[str, tuple[float, float]]) -> System:
    """The normal equations of a log, or of a part of it.

    Args:
        octaves: sums over lines; the first columns are the parameters', the last is the force.
        names: of the parameters.
        prior: mean and standard deviation of what is known of some of them.
    """
    p, total = len(names), octaves.total
    power = np.diag(total.sum(axis=0))
    mean = np.zeros(p)
    weight = power[:p] / (LARGEST**2 * max(float(power[-1]), 1e-300))
    for name, (value, std) in prior.items():
        i = names.index(name)
        mean[i], weight[i] = value, 1 / std**2
    return System(total, octaves.all_lines, (octaves.products, octaves.lines), mean, weight)


def solve(system: System, noise: Array, use: Mask | None = None) -> Solution:
    """Solve for given noise levels.

    Args:
        system: of the log.
        noise: variance of a line in each octave, shape (octaves,).
        use: octaves that count, shape (octaves,); all if not given.
    """
    weight = np.where(system.lines > 0, 1 / noise, 0.0)
    if use is not None:
        weight = weight * use
    whole = np.tensordot(weight, system.products, axes=1)
    normal = whole[:-1, :-1] + np.diag(system.prior_weight)
    right = whole[:-1, -1] + system.prior_weight * system.prior_mean
    return Solution(*solved(normal, right), noise)


def held(system: System, values: dict[int, float]) -> Solution:
    """Estimate the other parameters and the noise levels with some parameters held where they are.

    Args:
        system: of the log.
        values: of the parameters that are held, by place.
    """
    places = list(values)
    free = [i for i in range(system.size) if i not in values]
    fewer = np.zeros((system.size + 1, len(free) + 1))
    fewer[[*free, -1], range(len(free) + 1)] = 1.0
    fewer[places, -1] = -np.array(list(values.values()))
    products, lines = system.stretches
    own = System(
        fewer.T @ system.products @ fewer, system.lines, (fewer.T @ products @ fewer, lines),
        system.prior_mean[free], system.prior_weight[free],
    )  # fmt: skip
    found = estimate(own)
    theta, cov = -fewer[:-1, -1], np.zeros((system.size, system.size))
    theta[free], cov[np.ix_(free, free)] = found.theta, found.cov
    return Solution(theta, cov, found.noise)


def estimate(system: System) -> Solution:
    """Estimate parameters and noise levels: least squares, then reweighted by what is left in each octave."""
    force = system.products[:, -1, -1]
    mean = float(force.sum() / max(float(system.lines.sum()), 1.0))
    noise = np.full(len(force), 1e-3 * mean + 1e-280)
    for _ in range(_STEPS):
        noise = _levels(system, solve(system, noise))
    return solve(system, noise)


def _levels(system: System, solution: Solution) -> Array:
    """Variance of a line in each octave by what is left there, degrees of freedom taken off, shape (octaves,).

    Stretches count by the power of their force: what is left while the probe rests says nothing of what is left while
    it moves, and where it rests the parameters do not show.
    """
    full = np.append(-solution.theta, 1.0)
    products, lines = system.stretches
    left = np.maximum(np.einsum("i,goij,j->go", full, products, full), 0.0) / np.maximum(lines, 1.0)
    share, count = _shares(system)
    used = np.einsum("oij,ij->o", system.products[:, :-1, :-1], solution.cov) / solution.noise
    free = np.maximum(count - used, 0.0)
    whole = (share * left).sum(axis=0) * count
    floor = 1e-12 * float(system.products[:, -1, -1].sum()) / max(float(system.lines.sum()), 1.0) + 1e-280
    noise = np.full(len(whole), floor)
    above = 0.0
    for o in range(len(whole) - 1, -1, -1):
        borrowed = _NEIGHBOUR if above else 0.0
        if system.lines[o] or above:
            own = (whole[o] + borrowed * above) / max(free[o] + borrowed, 1.0)
            above = noise[o] = max(own, floor)
    return noise


def _shares(system: System) -> tuple[Array, Array]:
    """Weight of each stretch in an octave's level, (groups, octaves), and the lines that such a mean rests on."""
    products, lines = system.stretches
    power = np.where(lines > 0, np.maximum(products[:, :, -1, -1], 0.0), 0.0)
    share = power / np.maximum(power.sum(axis=0), 1e-300)
    spread = np.sum(share**2 / np.maximum(lines, 1.0), axis=0)
    return share, np.where(spread > 0, 1 / np.maximum(spread, 1e-300), 0.0)


def worth(system: System) -> Array:
    """Lines that the noise level of each octave rests on, shape (octaves,)."""
    return np.where(system.lines > 0, _shares(system)[1], 0.0)
