"""Mass, damping and stiffness from sums by octave, with every cause of uncertainty as a width.

- Each octave counts by its residual: where noise of the position drowns the motion, it hardly counts. Noise of the
  position pulls least squares towards zero; its part of the information is taken out (Soderstrom, Errors-in-Variables
  Methods in System Identification, 2018, ch. 7), and the interval has a part for how well it is known.
- Other forces have columns of their own: friction, a stiffness that changes with the depth, relaxation. Nobody knows
  their size beforehand, nor that of the mass: the answer is the mean over sizes, weighted by evidence (Hoeting,
  Madigan, Raftery and Volinsky, Bayesian model averaging, 1999).
- The answer is compared with itself: without one stretch of time (the jackknife; Shao and Wu, 1989), without one
  octave. A force that no column explains widens the interval as if it lay along the parameters' own columns.
- A change of the surface is looked for in the scores (Andrews, 1993); the answer rests on the stretches since then.
"""

from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from palpate.arrays import Array
from palpate.identifiers import octave_sums as sums
from palpate.identifiers.octave_system import (
    CONTACT_SIZE,
    OTHER_FORCES,
    SIZE,
    OctaveData,
    OctaveSystem,
    build_octave_system,
    compensate,
    inverse,
    noise_levels,
    prior_weights,
    scale_columns,
    solve,
)
from palpate.signals.octaves import hidden_variance, weigh_hypotheses
from palpate.signals.types import NORMAL

FALSE_ALARM_PROBABILITY = 1e-3
"""Probability of a change that is none, each time one looks."""
MAX_UNEXPLAINED = 1 / 3
"""Share of the force's power beyond which a fit identifies nothing."""
_SCREENING_PROBABILITY = 0.1
"""Probability at which the scores have the fits before and after compared; it costs time alone."""
_INDEPENDENT_INSTANTS = 5.0
"""Independent instants among those at which a change is looked for."""
_MIN_STRETCHES_PER_SIDE = 2
"""Stretches on each side of a change, at least."""
_K = 2


@dataclass(frozen=True)
class OctaveFit:
    """A fit.

    Args:
        theta: M, B, K and offset, shape (4,).
        covariance: of theta, all causes, shape (4, 4).
        open: the part of it that is not noise of the force, shape (4, 4).
        system: that it was solved for.
        rejected: why the model is not believed; empty if nothing speaks against it.
    """

    theta: Array
    covariance: Array
    open: Array
    system: OctaveSystem
    rejected: str

    def without_position_noise(self, theta: Array, deviations: Array) -> tuple[Array, Array]:
        """Least squares of the same samples in time, noise of the position taken out, and what that leaves open.

        Args:
            theta: M, B, K and offset by plain least squares, shape (4,).
            deviations: of each before anything is known, shape (4,).
        """
        prior = deviations**-2.0
        right_side = (self.system.plain + np.diag(prior)) @ theta
        system = self.system
        corrected, _, open_covariance = compensate(system.plain, right_side, system.in_samples, prior)
        return corrected, open_covariance


def octave_fit(data: OctaveData, since: float) -> OctaveFit | None:
    """The fit of `octave_sums`; None where there are too few stretches for an interval.

    Args:
        data: the sums, and the noise in them.
        since: samples that the fit may rest on, the newest.
    """
    newer_samples = np.cumsum(data.groups[::-1, sums.WEIGHT])[::-1]
    first = int(np.count_nonzero(newer_samples > since + 0.5))
    end = len(data.groups)
    fit = _fit_stretches(data, first, end)
    while fit is not None and (split := _change(data, first, end, fit)):
        first = split
        fit = _fit_stretches(data, first, end)
    return fit


def _change(data: OctaveData, first: int, end: int, fit: OctaveFit) -> int:
    """The first stretch that lies entirely on another surface; 0 without a change.

    The fits before and after the likeliest change are compared, with all their uncertainty.
    """
    noise, theta = noise_levels(fit.system, data.deviations)
    split = _likeliest_change(fit.system, noise, theta, data.deviations)
    if not split:
        return 0
    before = _fit_stretches(data, first, first + split - 1)
    after = _fit_stretches(data, first + split + 1, end)
    if before is None or after is None:
        return 0
    difference = abs(after.theta[_K] - before.theta[_K])
    difference /= np.sqrt(before.covariance[_K, _K] + after.covariance[_K, _K])
    probability = 0.5 * FALSE_ALARM_PROBABILITY / _INDEPENDENT_INSTANTS
    limit = NormalDist().inv_cdf(1 - probability)
    return first + split + 1 if difference > limit else 0


def _separate_relaxation(system: OctaveSystem, noise: Array) -> OctaveSystem:
    """Remove from the relaxation columns the part that mass, damping and stiffness explain."""
    normal = system.weighted_products(noise)
    contact = normal[:CONTACT_SIZE]
    elimination = np.eye(SIZE + 1)
    for place in OTHER_FORCES[0]:
        elimination[place, :CONTACT_SIZE] = -solve(contact[:, :CONTACT_SIZE], contact[:, place])
    products = np.einsum("pi,goij,qj->gopq", elimination, system.products, elimination)
    return replace(system, products=products)


@dataclass(frozen=True)
class _Mean:
    """The mean over sizes of other forces: theta, covariances and weights of the likeliest member's prior."""

    theta: Array
    noise: Array
    open: Array
    spread: Array
    prior: Array


def _average_sizes(system: OctaveSystem, noise: Array, sensor: Array, deviations: Array) -> _Mean:
    """Average over the sizes of the mass and of other forces, by evidence.

    A residual beyond the sensor's noise is not chance, so the evidence is reduced in proportion (a likelihood raised to
    a power: Miller and Dunson, 2019).
    """
    priors = prior_weights(system, deviations)
    reduced = np.tensordot(sensor / noise**2, system.total, axes=1)
    selected, weight = weigh_hypotheses(_evidence(reduced, priors))
    priors = priors[selected]
    normal, right_side = system.equations(noise)
    position_noise = np.tensordot(1 / noise, system.noisy, axes=1)
    thetas, noises, opens = compensate(normal, right_side, position_noise, priors)
    theta = weight @ thetas
    differences = thetas - theta
    return _Mean(
        theta,
        np.tensordot(weight, noises, axes=1),
        np.tensordot(weight, opens, axes=1),
        np.einsum("m,mi,mj->ij", weight, differences, differences),
        priors[int(np.argmax(weight))],
    )


def _evidence(equations: Array, priors: Array) -> Array:
    """Logarithm of the probability of the data under each prior, but for a constant, shape (members,)."""
    normal = equations[:-1, :-1] + priors[:, :, None] * np.eye(SIZE)
    scaled, size = scale_columns(normal)
    projections = equations[:-1, -1] / size
    solutions = np.linalg.solve(scaled, projections[..., None])[..., 0]
    explained = np.einsum("mi,mi->m", projections, solutions)
    log_posterior = np.linalg.slogdet(scaled)[1] + 2 * np.log(size).sum(axis=1)
    log_determinant = log_posterior - np.log(priors).sum(axis=1)
    return np.asarray((explained - log_determinant) / 2)


def _fit_stretches(data: OctaveData, first: int, end: int) -> OctaveFit | None:
    """The fit of the stretches from first to before end, with all causes of uncertainty; None if they are too few."""
    system = build_octave_system(data, first, end)
    if system is None:
        return None
    deviations = data.deviations
    noise, theta = noise_levels(system, deviations)
    by_position = np.einsum("i,oij,j->o", theta, system.noisy, theta) / system.count
    sensor = np.minimum(system.sensor + by_position, noise)
    separated = _separate_relaxation(system, noise)
    mean = _average_sizes(separated, noise, sensor, deviations)
    lag_errors = data.lag_std * _lag_derivative(separated, noise, mean.theta)
    hidden = _hidden_variances(separated, noise, sensor, mean.noise)
    between_octaves = _octave_variances(separated, noise, sensor, deviations, mean)
    variances = hidden + between_octaves
    variances[0] += _relaxation_variance(system, noise, deviations, mean)
    by_lag = np.outer(lag_errors, lag_errors)
    open_covariance = mean.open + mean.spread + by_lag + np.diag(variances)
    repetition = _repetition_variances(separated, noise, mean) - np.diag(mean.noise)
    covariance = mean.noise + open_covariance + np.diag(np.maximum(repetition, 0.0))
    level = float(noise.max())
    estimates = _with_offset(system, mean.theta, covariance, open_covariance, level)
    return OctaveFit(*estimates, system, _refusal(separated, noise, sensor, mean.theta))


def _with_offset(
    system: OctaveSystem, theta: Array, covariance: Array, open_covariance: Array, level: float
) -> tuple[Array, Array, Array]:
    """M, B, K and the offset, their covariance, and its part by other causes than noise of the force."""
    transform = np.eye(4, SIZE)
    means = system.means
    transform[3, :CONTACT_SIZE] = -means[:CONTACT_SIZE]
    transform[3, CONTACT_SIZE] = 0.0
    contact = theta[:CONTACT_SIZE]
    offset = means[4] - means[:CONTACT_SIZE] @ contact
    values = np.append(contact, offset)
    mean_variance = np.diag([0.0, 0.0, 0.0, level / system.samples])
    covariance = transform @ covariance @ transform.T + mean_variance
    return values, covariance, transform @ open_covariance @ transform.T


def _relaxation_variance(system: OctaveSystem, noise: Array, deviations: Array, mean: _Mean) -> float:
    """Variance of the mass by its change under relaxation of any size, beyond its noise (Hausman, 1978).

    A stiffness that grows with the frequency is no negative mass.
    """
    normal, right_side = system.equations(noise)
    normal = normal + np.diag(prior_weights(system, deviations)[0])
    mass = float(solve(normal, right_side)[0])
    difference = abs(mass - mean.theta[0])
    added_variance = max(float(inverse(normal)[0, 0]) - mean.noise[0, 0], 0.0)
    excess = max(difference - NORMAL * np.sqrt(added_variance), 0.0)
    return float(excess**2)


def _lag_derivative(system: OctaveSystem, noise: Array, theta: Array) -> Array:
    """Derivative of theta by the lag, shape (8,): the force's rate is B a + K v and M times the rate of a, -w^2 v."""
    omega = 2 * np.pi * system.frequency
    rate = np.zeros((len(noise), SIZE))
    rate[:, 0] = theta[1]
    rate[:, 1] = theta[2] - theta[0] * omega**2
    normal, _ = system.equations(noise)
    right_side = np.einsum("o,oij,oj->i", 1 / noise, system.total[:, :-1, :-1], rate)
    return solve(normal, right_side)


def _hidden_variances(system: OctaveSystem, noise: Array, sensor: Array, covariance: Array) -> Array:
    """Variances by a force that lies along the parameters' columns, as large as the residual beyond the sensors' noise.

    A residual counts if chance would show it in one of twenty presses at most, in any octave.
    """
    quantile = NormalDist().inv_cdf(1 - 0.05 / len(noise))
    limit = quantile * np.sqrt(2 / np.maximum(system.count, 1.0))
    columns = system.total[:, :-1, :-1]
    return hidden_variance(columns, covariance, system.count, noise, sensor, limit)


def _octave_variances(
    system: OctaveSystem, noise: Array, sensor: Array, deviations: Array, mean: _Mean
) -> Array:
    """Variances by the change of the answer without one octave, beyond the growth of its covariance."""
    excess = np.zeros(SIZE)
    if len(noise) < 2:
        return excess
    variances = np.diag(mean.noise + mean.spread + mean.open)
    for octave in range(len(noise)):
        use = np.arange(len(noise)) != octave
        without = _average_sizes(system.only(use), noise[use], sensor[use], deviations)
        total = np.diag(without.noise + without.spread + without.open)
        added_variances = np.maximum(total - variances, 0.0)
        squared_change = (without.theta - mean.theta) ** 2
        excess = np.maximum(excess, squared_change - added_variances)
    return excess


def _repetition_variances(system: OctaveSystem, noise: Array, mean: _Mean) -> Array:
    """Variances by the change of the answer without each stretch of time (jackknife), shape (8,), in Student's scale.

    With f degrees of freedom, Student's 95 % interval is about f / (f - 2.4) times the normal one, squared.
    """
    normal, right_side = system.equations(noise)
    normal = normal + np.diag(mean.prior)
    stretch_normals, stretch_right_sides = system.stretch_equations(noise)
    theta = solve(normal, right_side)
    without_stretch = normal - stretch_normals
    changes = solve(without_stretch, right_side - stretch_right_sides) - theta
    C = inverse(normal)
    contributions = np.abs(np.einsum("ij,gjk,ki->gi", C, stretch_normals, C))
    fractions = contributions / np.diag(C)
    fractions /= np.maximum(fractions.sum(axis=0), 1e-300)
    squares = np.maximum(np.sum(fractions**2, axis=0), 1e-300)
    free = np.maximum(1 / squares - 1, 1.0)
    many = free / np.maximum(free - 2.4, 1.0)
    student = np.where(free > 4.8, many, (1 + 2 / free) ** 2)
    return np.asarray(student * (free / (free + 1)) * np.sum(changes**2, axis=0))


def _refusal(system: OctaveSystem, noise: Array, sensor: Array, theta: Array) -> str:
    """Reason to reject the fit; empty without one."""
    excess = float(np.maximum(noise - sensor, 0.0) @ system.count)
    power = float(system.total[:, -1, -1].sum())
    if excess > MAX_UNEXPLAINED * power:
        return f"{100 * excess / power:.0f} % of the force is not explained"
    # No contact's dynamic stiffness changes by as much as itself from end to end of a sine of this size.
    normal, _ = system.equations(noise)
    contact_force = float(normal[_K, :CONTACT_SIZE] @ theta[:CONTACT_SIZE])
    tangent = contact_force / float(normal[_K, _K])
    variance = float(system.plain[2, 2] / system.samples - system.means[2] ** 2)
    omega = np.sqrt(normal[1, 1] / normal[_K, _K])
    curvature = np.hypot(2 * theta[5], theta[6] * omega)
    if 0 < tangent < curvature * np.sqrt(2 * max(variance, 0.0)):
        return "the force stops following the position within the motion: contact is lost"
    return ""


def _likeliest_change(system: OctaveSystem, noise: Array, theta: Array, deviations: Array) -> int:
    """Number of stretches before the likeliest change of the stiffness; 0 without evidence of one.

    The scores give each stretch a stiffness. Those before an instant are compared with those after it, weighted by
    their information, in units of their scatter about the mean of their side (Andrews, 1993).
    """
    normals, right_sides = system.stretch_equations(noise)
    count = len(normals)
    if count < 2 * _MIN_STRETCHES_PER_SIDE:
        return 0
    prior = np.diag(prior_weights(system, deviations)[0])
    stiffness_row = inverse(normals.sum(axis=0) + prior)[_K]
    position_noise = np.einsum("go,oij,j->gi", system.lines / system.count / noise, system.noisy, theta)
    residuals = right_sides - normals @ theta + position_noise
    scores = residuals @ stiffness_row
    weight = np.einsum("i,gij,j->g", stiffness_row, normals, stiffness_row)
    weight = np.maximum(weight, 1e-12 * weight.sum() + 1e-300)
    sizes = np.arange(_MIN_STRETCHES_PER_SIDE, count - _MIN_STRETCHES_PER_SIDE + 1)
    weight_before = np.cumsum(weight)[sizes - 1]
    weight_after = np.cumsum(weight[::-1])[::-1][sizes]
    before = np.cumsum(scores)[sizes - 1] / weight_before
    after = np.cumsum(scores[::-1])[::-1][sizes] / weight_after
    is_before = np.arange(count) < sizes[:, None]
    deviations_from_side = scores / weight - np.where(is_before, before[:, None], after[:, None])
    variance = (
        (weight * deviations_from_side**2).sum(axis=1) / (count - 2) * (1 / weight_before + 1 / weight_after)
    )
    statistics = (after - before) ** 2 / np.maximum(variance, 1e-300)
    best = int(np.argmax(statistics))
    chance = NormalDist().inv_cdf(1 - _SCREENING_PROBABILITY)
    return int(sizes[best]) if _normal_quantile_of_f(float(statistics[best]), 1, count - 2) > chance else 0


def _normal_quantile_of_f(f: float, k: int, free: int) -> float:
    """The standard normal number as improbable as an F of k and `free` degrees of freedom (Paulson, 1942)."""
    u = 2 / (9 * k)
    w = 2 / (9 * free)
    root = float(np.cbrt(f))
    return ((1 - w) * root - (1 - u)) / float(np.sqrt(w * root**2 + u))
