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
_NEIGHBOUR = 2.0
"""Lines that the level of an octave borrows from the next higher one: its own few may be fitted by chance."""


@dataclass(frozen=True)
class Design:
    """How the columns of a log stand to each other.

    Args:
        names: of the parameters, whose columns come first; the force is the last column.
        prior: mean and standard deviation of what is known of some parameters.
        effects: group of random effects -> its columns.
        local: columns whose parameter may differ between octaves and between contacts.
    """

    names: tuple[str, ...]
    prior: dict[str, tuple[float, float]]
    effects: dict[str, tuple[int, ...]]
    local: tuple[int, ...]


@dataclass(frozen=True)
class System:
    """The expanded normal equations: parameters, effects, effects by octave, effects by group; last the force.

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
    """Add the columns that stand for one octave or one group of contacts only."""
    groups, count, width, _ = octaves.products.shape
    p = len(design.names)
    own = [*range(p), *(c for cols in design.effects.values() for c in cols)]
    base = [*own, width - 1]
    by_group = groups if groups > 1 else 0
    local = len(design.local)
    d = len(own) + local * (count + by_group)
    products = np.zeros((count, d + 1, d + 1))
    place = np.r_[np.arange(len(own)), d]
    total = octaves.total
    for o in range(count):
        products[o][np.ix_(place, place)] = total[o][np.ix_(base, base)]
        for i, c in enumerate(design.local):
            at = len(own) + i * count + o
            products[o][at, place] = products[o][place, at] = total[o][c, base]
            for j, other in enumerate(design.local):
                products[o][at, len(own) + j * count + o] = total[o][c, other]
            for g in range(by_group):
                at_g = len(own) + local * count + i * by_group + g
                part = octaves.products[g, o]
                products[o][at_g, place] = products[o][place, at_g] = part[c, base]
                for j, other in enumerate(design.local):
                    at_o = len(own) + j * count + o
                    products[o][at_g, at_o] = products[o][at_o, at_g] = part[c, other]
                    products[o][at_g, len(own) + local * count + j * by_group + g] = part[c, other]
    # An effect of an octave is a force of one size in each: what is unexplained there does not grow with the motion.
    for i, c in enumerate(design.local):
        for o in range(count):
            at = len(own) + i * count + o
            size = float(np.sqrt(total[o][c, c])) or 1.0
            products[o][at, :] /= size
            products[o][:, at] /= size
    effects: dict[str, tuple[int, ...]] = {}
    at = p
    for name, columns in design.effects.items():
        effects[name] = tuple(range(at, at + len(columns)))
        at += len(columns)
    for i in range(local):
        effects[f"octave {design.names[design.local[i]]}"] = tuple(range(at, at + count))
        at += count
    for i in range(local if by_group else 0):
        effects[f"contact {design.names[design.local[i]]}"] = tuple(range(at, at + by_group))
        at += by_group
    mean, weight = np.zeros(p), np.zeros(p)
    for name, (value, std) in design.prior.items():
        i = design.names.index(name)
        mean[i], weight[i] = value, 1 / std**2
    return System(products, octaves.lines.sum(axis=0), effects, p, mean, weight)


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
        normal[places, places] += 1 / max(variance, 1e-280)
    return Solution(*solved(normal, right))


def estimate(system: System, begin: Levels | None = None) -> tuple[Solution, Levels]:
    """Estimate variances and parameters together, from a guess of the variances if there is one."""
    force = system.products[:, -1, -1]
    mean = float(force.sum() / max(system.lines.sum(), 1))
    start = 0.01 * mean
    noise = np.maximum(0.1 * force / np.maximum(system.lines, 1), 1e-6 * mean) + 1e-280
    effects = {name: start / max(_power(system, places), 1e-300) for name, places in system.effects.items()}
    levels = begin or Levels(noise, effects)
    solution = solve(system, levels)
    for _ in range(_ROUNDS):
        new = _updated(system, levels, solution)
        change = np.abs(np.log(new.noise / levels.noise)).max()
        levels, solution = new, solve(system, new)
        if change < _SETTLED:
            break
    return solution, levels


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
        effects[name] = float(np.clip(square / known, 1e-10 * was, 1e4 * was)) + 1e-280
    return Levels(noise, effects)
