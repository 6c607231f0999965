"""How far each parameter may be off, cause by cause: the interval that holds whatever the model.

Beside the mixed model's own covariance, an answer is held against itself: with each octave left out, on two disjoint
parts of the log, and on strokes in and out alone. What these differ by beyond their covariances is added (a jackknife
over blocks that are alike only if the model holds). What no part can tell is bounded by what the model leaves: a force
beyond the sensor's noise that is there in an octave may as well be hidden along the parameters' own columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.least_squares import inverse
from palpate.identification.estimators.mixed import Levels, Solution, System, solve

Array = NDArray[np.float64]

HIDDEN_SHARE = 0.5
"""Share of the unexplained amplitude of an octave that may lie along a parameter's own column. One half is the mean
share of a force whose direction among (in phase, in quadrature) nobody knows, of which only the rest is seen as
unexplained; `benchmarks/identification/foreign` measures the coverage that follows."""


@dataclass(frozen=True)
class Spread:
    """A variance of each parameter, shape (p,), and the degrees of freedom that it was estimated with."""

    variance: Array
    freedom: float = np.inf


Budget = dict[str, Spread]


def of_system(system: System, levels: Levels, solution: Solution, lag: int | None) -> Budget:
    """Noise, lag and random effects: the parts of the mixed model's own covariance."""
    p = system.parameters
    weight = np.where(system.lines > 0, 1 / levels.noise, 0.0)
    normal = np.tensordot(weight, system.products, axes=1)[:p, :p] + np.diag(system.prior_weight)
    plain = inverse(normal)
    by_lag = plain[:, lag] ** 2 / plain[lag, lag] if lag is not None else np.zeros(p)
    noise = np.diag(plain) - by_lag
    if lag is not None:
        noise[lag], by_lag[lag] = plain[lag, lag], 0.0
    whole = np.diag(solution.cov)[:p]
    known = 0.0
    for name, places in system.effects.items():
        i = list(places)
        known += max(len(i) - float(np.trace(solution.cov[np.ix_(i, i)])) / levels.effects[name], 0.0)
    return {
        "noise": Spread(np.maximum(noise, 0.0)),
        "lag": Spread(np.maximum(by_lag, 0.0)),
        "other forces": Spread(np.maximum(whole - np.diag(plain), 0.0), max(known, 1.0)),
    }


def of_octaves(system: System, levels: Levels, solution: Solution) -> Spread:
    """What the answer moves by when one octave is left out, beyond what its covariance grows by."""
    p = system.parameters
    theta, var = solution.theta[:p], np.diag(solution.cov)[:p]
    excess = np.zeros(p)
    for octave in np.flatnonzero(system.lines > 0):
        use = np.ones(len(system.lines), bool)
        use[octave] = False
        other = solve(system, levels, use)
        grown = np.diag(other.cov)[:p] - var
        excess = np.maximum(excess, (other.theta[:p] - theta) ** 2 - np.maximum(grown, 0.0))
    return Spread(np.maximum(excess, 0.0))


def of_stretches(whole: Solution, parts: list[Solution], p: int) -> Spread:
    """Variance by the jackknife over stretches of the log, beyond the mixed model's own (Efron and Stein, 1981).

    Args:
        whole: of the whole log.
        parts: with one stretch left out.
        p: number of parameters.
    """
    count = len(parts)
    apart = np.array([part.theta[:p] - whole.theta[:p] for part in parts])
    variance = (count - 1) / count * (apart**2).sum(axis=0)
    return Spread(np.maximum(variance - np.diag(whole.cov)[:p], 0.0), count - 1.0)


def of_unexplained(system: System, levels: Levels, solution: Solution, sensor: Array) -> Spread:
    """What a force hidden along the parameters' columns may do, as large as what is seen beyond the sensor's noise.

    Args:
        system, levels, solution: of the mixed model.
        sensor: variance of a line by the sensor's own noise in each octave, shape (octaves,).
    """
    p = system.parameters
    beyond = np.maximum(levels.noise - sensor, 0.0)
    rows = solution.cov[:p]
    gain = np.einsum("ki,oij,kj->ok", rows, system.products[:, :-1, :-1], rows)
    weight = np.where(system.lines > 0, system.lines * beyond / levels.noise**2, 0.0)
    return Spread(HIDDEN_SHARE**2 * np.maximum(weight @ gain, 0.0))


def half_widths(budget: Budget) -> Array:
    """95 % half-widths of all causes together, shape (p,).

    Student's t with the degrees of freedom that Welch and Satterthwaite give a sum of variances.
    """
    from scipy.special import stdtrit

    variance = np.array([part.variance for part in budget.values()])
    freedom = np.array([part.freedom for part in budget.values()])
    total = variance.sum(axis=0)
    share = variance / np.where(total > 0, total, 1.0)
    loss = (share**2 / freedom[:, None]).sum(axis=0)
    found: Array = stdtrit(1 / np.clip(loss, 1e-9, 1.0), 0.975) * np.sqrt(total)
    return found
