"""An answer averaged over which other forces are in a log, and of what size: nobody knows either beforehand.

Bayesian model averaging (Hoeting, Madigan, Raftery and Volinsky, 1999). A force that the log would show, and does not,
hardly counts; one that it could not show widens the interval as if it were there.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.estimators import octaves
from palpate.identification.estimators.budget import Budget, Spread, white_level
from palpate.identification.estimators.octaves import LARGEST, Octaves, Segment, Solution, System
from palpate.identification.models import Motion
from palpate.identification.problem import Problem

_SIZES = (0.001, 0.01, 0.3, LARGEST)
"""Deviations of the prior of a force's size, over that of the whole force: hardly there, or of some order of magnitude.
`make trust` measures the coverage that follows."""
_SINGULAR = 1e-12
"""Share of its columns' size below which a direction is not in the log."""
_WINDOW = 0.02
"""Probability over the highest below which a member is left out (Occam's window, Madigan and Raftery 1994)."""


@dataclass(frozen=True)
class Member:
    """One supposition of the sizes of other forces: how likely the log makes it, and the answer with it."""

    weight: float
    system: System
    solution: Solution


def members(
    system: System, noise: Array, sensor: Array, forces: list[list[int]], use: Mask | None = None
) -> list[Member]:
    """Hypotheses and their weights, which add up to one.

    What is left beyond the sensor's noise is not chance, so that it counts as that much less evidence (a likelihood
    raised to a power: Miller and Dunson, 2019). The system has each force's prior of the largest size; the variance of
    a line in each octave, the same of the sensors' own noise, no larger, and the octaves that count have the shape
    (octaves,); forces are places of columns.
    """
    weights = np.array([system.prior_weight] * len(_SIZES) ** len(forces))
    for own, sizes in zip(weights, product(_SIZES, repeat=len(forces)), strict=True):
        for places, size in zip(forces, sizes, strict=True):
            own[places] *= (LARGEST / size) ** 2
    counts = system.lines > 0 if use is None else use & (system.lines > 0)
    worth = np.where(counts, sensor / noise / noise, 0.0)
    whole = np.tensordot(worth, system.products, axes=1)
    evidence = _evidence(whole, weights, system.prior_mean)
    share = np.exp(evidence - evidence.max())
    kept = share > _WINDOW
    systems = [replace(system, prior_weight=own) for own in weights[kept]]
    found = zip((share[kept] / share[kept].sum()).tolist(), systems, strict=True)
    return [Member(weight, own, octaves.solve(own, noise, use)) for weight, own in found]


def _evidence(whole: Array, weights: Array, mean: Array) -> Array:
    """Log of the probability of the log under each prior, but for a constant, shape (priors,).

    Of the normal equations with the force in the last place, shape (p + 1, p + 1), and the priors' weights, (priors,
    p), and mean, (p,).
    """
    size = np.sqrt(np.maximum(np.diag(whole)[:-1] + weights, 1e-300))
    normal = (whole[:-1, :-1] + weights[:, :, None] * np.eye(len(mean))) / size[:, :, None] / size[:, None, :]
    right = (whole[:-1, -1] + weights * mean) / size
    value, vector = np.linalg.eigh(normal)
    value = np.maximum(value, _SINGULAR)
    along = np.einsum("mij,mi->mj", vector, right)
    explained = (np.where(value > _SINGULAR, along**2, 0.0) / value).sum(axis=1)
    spread = np.log(value).sum(axis=1) + 2 * np.log(size).sum(axis=1) - np.log(weights + 1e-300).sum(axis=1)
    return np.asarray((explained - weights @ mean**2 - spread) / 2)


def averaged(parts: list[Member]) -> Solution:
    """The answer over all members; what they differ by is in its covariance."""
    weight = np.array([part.weight for part in parts])
    thetas = np.stack([part.solution.theta for part in parts])
    theta = weight @ thetas
    cov = np.einsum("m,mij->ij", weight, np.stack([part.solution.cov for part in parts]))
    cov = cov + np.einsum("m,mi,mj->ij", weight, thetas - theta, thetas - theta)
    return Solution(theta, cov, parts[0].solution.noise)


def of_supposition(whole: Solution, parts: list[Member], system: System, place: int) -> float:
    """Variance of a parameter by the supposition that it may be small, which pulls it towards nothing.

    It counts with the prior of the largest size, which `system` has, beside the likeliest sizes of the others.
    """
    likeliest = max(parts, key=lambda part: part.weight)
    weights = likeliest.system.prior_weight.copy()
    weights[place] = system.prior_weight[place]
    free = octaves.solve(replace(system, prior_weight=weights), whole.noise)
    grown = float(free.cov[place, place] - whole.cov[place, place])
    return max(grown, 0.0) + float(free.theta[place] - whole.theta[place]) ** 2


def of_octaves(
    whole: Solution, system: System, noise: Array, sensor: Array, forces: list[list[int]]
) -> Spread:
    """Change of the answer when one octave is left out, beyond the growth of its covariance.

    The rest has to tell by itself which other forces are there; the arguments are those of `members`.
    """
    excess = np.zeros(system.size)
    for octave in np.flatnonzero(system.lines > 0):
        use = np.arange(len(system.lines)) != octave
        other = averaged(members(system, noise, sensor, forces, use))
        grown = np.maximum(np.diag(other.cov) - np.diag(whole.cov), 0.0)
        excess = np.maximum(excess, (other.theta - whole.theta) ** 2 - grown)
    return Spread(excess)


def mean_budget(parts: list[Member], budgets: list[Budget], theta: Array) -> Budget:
    """The budget over all members, of those of each: what they differ by, about theta, is of the other forces."""
    weight = np.array([part.weight for part in parts])
    apart = np.stack([part.solution.theta for part in parts]) - theta
    budget = {cause: _mean(weight, [own[cause] for own in budgets]) for cause in budgets[0]}
    others = budget["other forces"]
    return budget | {"other forces": Spread(others.variance + weight @ apart**2, others.freedom)}


def _mean(weight: Array, spreads: list[Spread]) -> Spread:
    """Of the variances, and of their degrees of freedom as each adds to it."""
    variance = np.stack([own.variance for own in spreads]) * weight[:, None]
    whole = variance.sum(axis=0)
    losses = (own / spread.each for own, spread in zip(variance, spreads, strict=True))
    loss = sum(losses, np.zeros(len(whole)))
    return Spread(whole, np.where(loss > 0, whole / np.where(loss > 0, loss, 1.0), np.inf))


_SEEN = 10.0
"""Power of a column over that of the position's noise in it, below which an octave is left out: its parameter would be
off by a tenth."""
_ROUNDED = 100.0
"""Last digits of a position that its way through the filters may round."""


def position_lines(motion: Motion, dt: float, longest: int, count: int, most: int) -> dict[int, Array]:
    """Power of the position's noise times omega^k in a line of each octave, shape (count,), by even k.

    `dt` is from row to row [s], `longest` the rows of the block of the first octave; k goes up to twice the highest
    derivative, `most`.
    """
    chain = motion.chain

    def power(k: int, f: Array) -> Array:
        passed = motion.noise.power(f, chain.dt) * chain.position_gain(f) ** 2
        return passed * (2 * np.pi * f) ** k * chain.dt / dt

    return {k: octaves.lines_of(partial(power, k), dt, longest, count) for k in range(0, 2 * most + 1, 2)}


def derivative_products(noisy: dict[int, Array]) -> Array:
    """Products of the noise of derivative i with that of j by octave, shape (octaves, d, d); others are in quadrature.

    Of the powers that `position_lines` gives.
    """
    order = np.arange(1 + max(noisy) // 2)
    both, apart = np.add.outer(order, order), np.abs(np.subtract.outer(order, order))
    found = np.zeros((len(noisy[0]), *both.shape))
    for k, power in noisy.items():
        found += np.where(both == k, 1 - apart % 4, 0) * power[:, None, None]
    return found


def seen(motion: Motion, noisy: dict[int, Array], sums: Octaves, derivatives: dict[int, int]) -> Mask:
    """Octaves but those in which a column is mostly the position's noise, which pulls its parameter to zero.

    `noisy` is as `position_lines` has it; `derivatives` has the place of a column, and which derivative it is.
    """
    rounding = (_ROUNDED * np.finfo(float).eps * float(np.abs(motion.position).max())) ** 2
    omega2 = (2 * np.pi * sums.frequency) ** 2
    power = np.stack([sums.total[:, place, place] for place in derivatives])
    noise = [np.maximum(sums.all_lines * noisy[2 * k], rounding * omega2**k) for k in derivatives.values()]
    return np.all(power >= _SEEN * np.stack(noise), axis=0)


def sensor_lines(
    problem: Problem, segments: list[Segment], sums: Octaves, use: Mask, system: System, solution: Solution
) -> tuple[Array, Array]:
    """Variance of a line by the sensor's own noise in each octave, and the lines that tell it, shape (octaves,).

    Out of contact it is seen; where the log has no such stretch, it is what the quietest octaves have in common.
    The sums have the force last; the octaves that count are in `use`, and the normal equations are theirs.
    """
    longest, dt = octaves.longest_of(segments), float(np.median(np.diff(problem.time)))
    passed = problem.motion.chain.force_gain
    gain = octaves.lines_of(lambda f: passed(f) ** 2, dt, longest, len(sums.frequency))
    gain = np.maximum(gain, np.finfo(float).eps)
    rest = _rest(problem, dt, longest)
    if rest is None:
        own = sums.total[:, -1, -1] / np.maximum(sums.all_lines, 1.0)
        level = np.where(use, solution.noise, own)
        lines = np.where(use, octaves.worth(system), sums.all_lines)
    else:
        lines = rest.all_lines
        level = rest.total[:, 0, 0] / np.maximum(lines, 1.0)
    digits = problem.rounding**2 * problem.motion.chain.dt / dt
    sensor = max(white_level(level / gain, lines), digits) * gain
    told = np.full(len(sensor), float(lines.sum()))
    if rest is not None:
        louder = (lines > 0) & (level > sensor)
        sensor, told = np.where(louder, level, sensor), np.where(louder, lines, told)
    return np.minimum(sensor, solution.noise), told


def _rest(problem: Problem, dt: float, longest: int) -> Octaves | None:
    """The force out of contact by the octaves of the contacts; None if there is too little of it."""
    if not problem.free:
        return None
    edges = np.cumsum([0, *(len(f) for f in problem.free)])
    stretches = [Segment(int(a), int(b)) for a, b in pairwise(edges)]
    found = octaves.octaves_of(np.concatenate(problem.free)[:, None], stretches, dt, longest)
    return found if found.lines.any() else None
