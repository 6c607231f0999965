"""The mixed model: what the contact's parameters are when other causes of force may be at work too.

The force is a contact model's columns times theta, plus effects of zero mean whose variances are estimated from the
log: drift, friction, relaxation, a change with time and with depth, and a stiffness and a damping that differ from
octave to octave and from contact to contact. The noise has its own level in each octave. On a log that holds none of
these, their variances come to zero and the estimate is weighted least squares.

Henderson's mixed-model equations; variances by MacKay's fixed point, which is restricted maximum likelihood
(MacKay 1992; Harville 1977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.least_squares import solved
from palpate.identification.estimators.octaves import Octaves

Array = NDArray[np.float64]

_ROUNDS = 60
_SETTLED = 1e-4
_LARGEST = 3.0
"""Deviation of the weak prior of a term's force, over the force's: a term is known to be no larger than that by itself
only where the log does not tell it, and there any number of this size does."""
_NEIGHBOUR = 2.0
"""Lines that the level of an octave borrows from the next higher one: its own few may be fitted by chance."""


@dataclass(frozen=True)
class Design:
    """How the columns of a log stand to each other.

    Args:
        names: of the parameters, whose columns come first; the force is the last column.
        prior: mean and standard deviation of what is known of some parameters.
        effects: group of random effects -> its columns.
    """

    names: tuple[str, ...]
    prior: dict[str, tuple[float, float]]
    effects: dict[str, tuple[int, ...]]


@dataclass(frozen=True)
class System:
    """The normal equations by octave: parameters, effects, last the force.

    Args:
        products: shape (octaves, d + 1, d + 1).
        lines: shape (octaves,).
        effects: group of random effects -> its places among the d.
        parameters: how many of the d are parameters.
        prior_mean, prior_weight: shape (parameters,).
    """

    products: Array
    lines: Array
    effects: dict[str, tuple[int, ...]]
    parameters: int
    prior_mean: Array
    prior_weight: Array

    @property
    def size(self) -> int:
        """d."""
        return self.products.shape[1] - 1


@dataclass(frozen=True)
class Levels:
    """What is estimated beside the parameters.

    Args:
        noise: variance of a line in each octave, shape (octaves,).
        effects: variance of each group of random effects.
    """

    noise: Array
    effects: dict[str, float]


@dataclass(frozen=True)
class Solution:
    """Parameters and effects.

    Args:
        theta: shape (d,).
        cov: shape (d, d).
    """

    theta: Array
    cov: Array


def expanded(octaves: Octaves, design: Design) -> System:
    """The normal equations of a log, or of a part of it."""
    p = len(design.names)
    mean = np.zeros(p)
    weight = _weak(octaves.total.sum(axis=0), p)
    for name, (value, std) in design.prior.items():
        i = design.names.index(name)
        mean[i], weight[i] = value, 1 / std**2
    return System(octaves.total, octaves.all_lines, design.effects, p, mean, weight)


def _weak(products: Array, p: int) -> Array:
    """Weights of a weak prior: no term of a model is many times the force itself, shape (p,).

    It counts only for what the log says nothing of, as for a damping that friction may stand for.
    """
    power = np.diag(products)
    found: Array = np.where(power[:p] > 0, power[:p] / (_LARGEST**2 * max(float(power[-1]), 1e-300)), 0.0)
    return found


def solve(system: System, levels: Levels, use: NDArray[np.bool_] | None = None) -> Solution:
    """Solve the mixed-model equations for given variances.

    Args:
        system: of the log.
        levels: variances.
        use: octaves that count, shape (octaves,); all if not given.
    """
    weight = np.where(system.lines > 0, 1 / levels.noise, 0.0)
    if use is not None:
        weight = weight * use
    whole = np.tensordot(weight, system.products, axes=1)
    normal, right = whole[:-1, :-1].copy(), whole[:-1, -1].copy()
    p = system.parameters
    normal[np.arange(p), np.arange(p)] += system.prior_weight
    right[:p] += system.prior_weight * system.prior_mean
    for name, places in system.effects.items():
        variance = levels.effects[name]
        normal[places, places] += 1 / max(variance, 1e-200)
    return Solution(*solved(normal, right))


def estimate(system: System, begin: Levels | None = None) -> tuple[Solution, Levels]:
    """Estimate variances and parameters together, from a guess of the variances if there is one."""
    begin = begin or _least_squares(system)
    levels = begin
    solution = solve(system, levels)
    for _ in range(_ROUNDS):
        new = _updated(system, levels, solution)
        change = np.abs(np.log(new.noise / levels.noise)).max()
        levels, solution = new, solve(system, new)
        if change < _SETTLED:
            break
    return solution, levels


def _least_squares(system: System) -> Levels:
    """Where the search begins: what least squares leave is the noise, and each cause may be as large as a part of it."""
    force = system.products[:, -1, -1]
    mean = float(force.sum() / max(system.lines.sum(), 1))
    noise = np.full(len(force), 1e-3 * mean) + 1e-280
    none = dict.fromkeys(system.effects, 1e-200)
    for _ in range(3):
        plain = solve(system, Levels(noise, none))
        noise = _updated(system, Levels(noise, none), plain).noise
    left = float(noise @ system.lines) / max(float(system.lines.sum()), 1.0)
    size = {name: max(_power(system, places), 1e-300) for name, places in system.effects.items()}
    return Levels(noise, {name: max(left / own, 1e-200) for name, own in size.items()})


def _power(system: System, places: tuple[int, ...]) -> float:
    """Mean square of the effects' columns per line."""
    total = sum(float(system.products[:, i, i].sum()) for i in places)
    return total / max(float(system.lines.sum()), 1.0)


def _updated(system: System, levels: Levels, solution: Solution) -> Levels:
    theta, cov = solution.theta, solution.cov
    full = np.append(-theta, 1.0)
    left = np.maximum(np.einsum("i,oij,j->o", full, system.products, full), 0.0)
    used = np.einsum("oij,ij->o", system.products[:, :-1, :-1], cov) / levels.noise
    free = np.maximum(system.lines - used, 0.0)
    noise = np.empty_like(left)
    floor = 1e-12 * float(system.products[:, -1, -1].sum()) / max(float(system.lines.sum()), 1.0) + 1e-280
    above = None
    for o in range(len(left) - 1, -1, -1):
        if system.lines[o] == 0 and above is None:
            noise[o] = max(levels.noise[o], floor)
            continue
        borrowed = 0.0 if above is None else _NEIGHBOUR
        own = (left[o] + borrowed * (above or 0.0)) / max(free[o] + borrowed, 1.0)
        above = noise[o] = max(own, floor)
    effects = {}
    for name, places in system.effects.items():
        i = list(places)
        square = float(theta[i] @ theta[i])
        was = levels.effects[name]
        known = max(len(i) - float(np.trace(cov[np.ix_(i, i)])) / was, 1e-6)
        effects[name] = max(float(np.clip(square / known, 1e-10 * was, 1e4 * was)), 1e-200)
    return Levels(noise, effects)
