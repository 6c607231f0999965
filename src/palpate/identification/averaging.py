"""An answer averaged over hypotheses: which other forces are in a log, and of what size.

Bayesian model averaging (Hoeting, Madigan, Raftery and Volinsky, 1999). A force that the log would show, and does not,
hardly counts; one that it could not show widens the interval as if it were there.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification import octaves
from palpate.identification.budget import Budget, Spread, white_level
from palpate.identification.models import Motion
from palpate.identification.octaves import MAX_TERM_RATIO, Octaves, Segment, Solution, System
from palpate.identification.problem import Problem
from palpate.signals.octaves import MIN_MOTION, weigh_hypotheses

_FORCE_SIZES = (0.001, 0.01, 0.3, MAX_TERM_RATIO)
"""Standard deviations of the prior of a force's size, over that of the whole force: negligible to dominant.
`make trust` measures the coverage that follows."""
_MIN_EIGENVALUE = 1e-12
"""Eigenvalue of the scaled normal equations below which the log does not show a direction."""


@dataclass(frozen=True)
class Member:
    """A hypothesis of the sizes of other forces: its probability given the log, its equations, and their solution."""

    weight: float
    system: System
    solution: Solution


def members(
    system: System, noise: Array, sensor: Array, forces: list[list[int]], use: Mask | None = None
) -> list[Member]:
    """Hypotheses and their weights, which add up to one.

    A residual beyond the sensor's noise is not chance, so the evidence is reduced in proportion (a likelihood raised to
    a power: Miller and Dunson, 2019).

    Args:
        system: with the prior of the largest size for each force.
        noise: variance of a line in each octave, shape (octaves,).
        sensor: part of that by the sensors' own noise, shape (octaves,).
        forces: places of the columns of each force.
        use: octaves that count, shape (octaves,).
    """
    weights = np.array([system.prior_weight] * len(_FORCE_SIZES) ** len(forces))
    for prior_weight, sizes in zip(weights, product(_FORCE_SIZES, repeat=len(forces)), strict=True):
        for places, size in zip(forces, sizes, strict=True):
            prior_weight[places] *= (MAX_TERM_RATIO / size) ** 2
    counts = system.lines > 0 if use is None else use & (system.lines > 0)
    precision = np.where(counts, sensor / noise / noise, 0.0)
    normal = np.tensordot(precision, system.products, axes=1)
    evidence = _evidence(normal, weights, system.prior_mean)
    places_kept, probabilities = weigh_hypotheses(evidence)
    hypotheses = []
    for probability, prior_weight in zip(probabilities.tolist(), weights[places_kept], strict=True):
        hypothesis = replace(system, prior_weight=prior_weight)
        solution = octaves.solve(hypothesis, noise, use)
        hypotheses.append(Member(probability, hypothesis, solution))
    return hypotheses


def _evidence(equations: Array, weights: Array, mean: Array) -> Array:
    """Logarithm of the probability of the log under each prior, but for a constant, shape (priors,).

    Args:
        equations: normal equations with the force in the last place, shape (p + 1, p + 1).
        weights: of the priors, shape (priors, p).
        mean: of the priors, shape (p,).
    """
    size = np.sqrt(np.maximum(np.diag(equations)[:-1] + weights, 1e-300))
    normal = equations[:-1, :-1] + weights[:, :, None] * np.eye(len(mean))
    right = (equations[:-1, -1] + weights * mean) / size
    value, vector = np.linalg.eigh(normal / size[:, :, None] / size[:, None, :])
    value = np.maximum(value, _MIN_EIGENVALUE)
    projections = np.einsum("mij,mi->mj", vector, right)
    powers = np.where(value > _MIN_EIGENVALUE, projections**2, 0.0)
    explained = (powers / value).sum(axis=1)
    log_posterior = np.log(value).sum(axis=1) + 2 * np.log(size).sum(axis=1)
    log_prior = np.log(weights + 1e-300).sum(axis=1)
    log_determinant = log_posterior - log_prior
    return np.asarray((explained - weights @ mean**2 - log_determinant) / 2)


def average_members(hypotheses: list[Member]) -> Solution:
    """The answer over all members; its covariance includes their differences."""
    weights = np.array([member.weight for member in hypotheses])
    thetas = np.stack([member.solution.theta for member in hypotheses])
    theta = weights @ thetas
    covariances = np.stack([member.solution.cov for member in hypotheses])
    differences = thetas - theta
    within = np.einsum("m,mij->ij", weights, covariances)
    between = np.einsum("m,mi,mj->ij", weights, differences, differences)
    return Solution(theta, within + between, hypotheses[0].solution.noise)


def supposition_variance(average: Solution, hypotheses: list[Member], system: System, index: int) -> float:
    """Variance of a parameter because hypotheses of a small size pull it towards zero.

    The comparison is with the prior of the largest size, which `system` has, and the likeliest sizes of the others.
    """
    likeliest = max(hypotheses, key=lambda member: member.weight)
    weights = likeliest.system.prior_weight.copy()
    weights[index] = system.prior_weight[index]
    free = octaves.solve(replace(system, prior_weight=weights), average.noise)
    added_variance = float(free.cov[index, index] - average.cov[index, index])
    change = float(free.theta[index] - average.theta[index])
    return max(added_variance, 0.0) + change**2


def octave_spread(
    average: Solution, system: System, noise: Array, sensor: Array, forces: list[list[int]]
) -> Spread:
    """Change of the answer when one octave is left out, beyond the growth of its covariance.

    The other octaves alone then weigh the hypotheses; the arguments are those of `members`.
    """
    excess = np.zeros(system.size)
    for octave in np.flatnonzero(system.lines > 0):
        use = np.arange(len(system.lines)) != octave
        without = average_members(members(system, noise, sensor, forces, use))
        added_variance = np.maximum(np.diag(without.cov) - np.diag(average.cov), 0.0)
        squared_change = (without.theta - average.theta) ** 2
        excess = np.maximum(excess, squared_change - added_variance)
    return Spread(excess)


def average_budgets(hypotheses: list[Member], budgets: list[Budget], theta: Array) -> Budget:
    """The mean of the members' budgets; their differences about theta count as other forces."""
    weights = np.array([member.weight for member in hypotheses])
    differences = np.stack([member.solution.theta for member in hypotheses]) - theta
    mean = {}
    for cause in budgets[0]:
        mean[cause] = _mean(weights, [budget[cause] for budget in budgets])
    others = mean["other forces"]
    variance = others.variance + weights @ differences**2
    return mean | {"other forces": Spread(variance, others.freedom)}


def _mean(weights: Array, spreads: list[Spread]) -> Spread:
    """Weighted mean of variances, with the degrees of freedom of their sum."""
    variance = np.stack([spread.variance for spread in spreads]) * weights[:, None]
    total = variance.sum(axis=0)
    loss = np.zeros(len(total))
    for part, spread in zip(variance, spreads, strict=True):
        loss = loss + part / spread.each
    known = np.where(loss > 0, loss, 1.0)
    return Spread(total, np.where(loss > 0, total / known, np.inf))


_ROUNDED_DIGITS = 100.0
"""Last digits of a position that the filters may round."""


def position_noise_lines(
    motion: Motion, dt: float, longest: int, count: int, highest: int
) -> dict[int, Array]:
    """Power of the position's noise times omega^k in a line of each octave, shape (count,), by even k.

    `dt` is from row to row [s], `longest` the rows of the block of the first octave; k goes up to twice the highest
    derivative, `highest`.
    """
    chain = motion.chain

    def power(k: int, f: Array) -> Array:
        spectrum = motion.noise.power(f, chain.dt) * chain.position_gain(f) ** 2
        return spectrum * (2 * np.pi * f) ** k * chain.dt / dt

    exponents = range(0, 2 * highest + 1, 2)
    return {k: octaves.line_variance(partial(power, k), dt, longest, count) for k in exponents}


def derivative_products(noisy: dict[int, Array]) -> Array:
    """Products of the noise of derivative i with that of j by octave, shape (octaves, d, d).

    The powers are those of `position_noise_lines`; derivatives of odd distance are in quadrature.
    """
    order = np.arange(1 + max(noisy) // 2)
    order_sums = np.add.outer(order, order)
    order_differences = np.abs(np.subtract.outer(order, order))
    products = np.zeros((len(noisy[0]), *order_sums.shape))
    for k, power in noisy.items():
        sign = np.where(order_sums == k, 1 - order_differences % 4, 0)
        products += sign * power[:, None, None]
    return products


def motion_octaves(
    motion: Motion, noise_lines: dict[int, Array], octave_sums: Octaves, derivatives: dict[int, int]
) -> Mask:
    """Octaves in which no column is mostly the position's noise, which pulls its parameter to zero.

    `noise_lines` are those of `position_noise_lines`; `derivatives` has the order of each column's derivative by place.
    """
    last_digit = np.finfo(float).eps * float(np.abs(motion.position).max())
    rounding = (_ROUNDED_DIGITS * last_digit) ** 2
    omega2 = (2 * np.pi * octave_sums.frequency) ** 2
    power = np.stack([octave_sums.total[:, place, place] for place in derivatives])
    noise = []
    for k in derivatives.values():
        by_noise = octave_sums.all_lines * noise_lines[2 * k]
        noise.append(np.maximum(by_noise, rounding * omega2**k))
    return np.all(power >= MIN_MOTION * np.stack(noise), axis=0)


def sensor_lines(
    problem: Problem, sums: Octaves, use: Mask, system: System, solution: Solution
) -> tuple[Array, Array]:
    """Variance of a line by the sensor's own noise in each octave, and the lines behind it, shape (octaves,).

    The force out of contact shows it; without such a stretch, the quietest octaves do. The sums have the force last;
    the octaves that count are in `use`, and the normal equations are theirs.
    """
    longest = octaves.longest_length(problem.segments)
    dt = problem.period
    force_gain = problem.motion.chain.force_gain
    gain = octaves.line_variance(lambda f: force_gain(f) ** 2, dt, longest, len(sums.frequency))
    gain = np.maximum(gain, np.finfo(float).eps)
    free = _rest(problem, dt, longest)
    if free is None:
        total_level = sums.total[:, -1, -1] / np.maximum(sums.all_lines, 1.0)
        level = np.where(use, solution.noise, total_level)
        lines = np.where(use, octaves.worth(system), sums.all_lines)
    else:
        lines = free.all_lines
        level = free.total[:, 0, 0] / np.maximum(lines, 1.0)
    digits = problem.rounding**2 * problem.motion.chain.dt / dt
    sensor = max(white_level(level / gain, lines), digits) * gain
    reliable_lines = np.full(len(sensor), float(lines.sum()))
    if free is not None:
        louder = (lines > 0) & (level > sensor)
        sensor = np.where(louder, level, sensor)
        reliable_lines = np.where(louder, lines, reliable_lines)
    return np.minimum(sensor, solution.noise), reliable_lines


def _rest(problem: Problem, dt: float, longest: int) -> Octaves | None:
    """The force out of contact by the octaves of the contacts; None if there is too little of it."""
    if not problem.free:
        return None
    edges = np.cumsum([0, *(len(f) for f in problem.free)])
    stretches = [Segment(int(a), int(b)) for a, b in pairwise(edges)]
    octave_sums = octaves.sum_octaves(np.concatenate(problem.free)[:, None], stretches, dt, longest)
    return octave_sums if octave_sums.lines.any() else None
