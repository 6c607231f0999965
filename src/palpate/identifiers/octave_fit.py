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
from palpate.identifiers.kernels import octave_sums as sums
from palpate.identifiers.octave_system import (
    OTHERS,
    OWN,
    SIZE,
    OctaveData,
    OctaveSystem,
    compensate,
    inverse,
    noise_levels,
    prior_of,
    scale_columns,
    solve,
    system_of,
)
from palpate.signals.types import NORMAL

FALSE_ALARM = 1e-3
"""Probability of a change that is none, each time one looks."""
UNEXPLAINED = 1 / 3
"""Share of the force's power beyond which a fit identifies nothing."""
_WINDOW = 0.02
"""Evidence over the highest below which a member is left out (Occam's window)."""
_HIDDEN = 0.5
"""Share of the unexplained amplitude along one column: of a force in an unknown phase, half of the power."""
_SUSPECTED = 0.1
"""Probability at which the scores have the fits before and after compared; it costs time alone."""
_LOOKS = 5.0
"""Independent instants among those at which a change is looked for."""
_SIDE = 2
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
        right = (self.system.plain + np.diag(prior)) @ theta
        found, _, opened = compensate(self.system.plain, right, self.system.in_samples, prior)
        return found, opened


def octave_fit(data: OctaveData, since: float) -> OctaveFit | None:
    """The fit of `octave_sums`; None where there are too few stretches for an interval.

    Args:
        data: the sums, and the noise in them.
        since: samples that the fit may rest on, the newest.
    """
    newer = np.cumsum(data.groups[::-1, sums.WEIGHT])[::-1]
    first, end = int(np.count_nonzero(newer > since + 0.5)), len(data.groups)
    found = _fit_stretches(data, first, end)
    while found is not None and (split := _change(data, first, end, found)):
        first = split
        found = _fit_stretches(data, first, end)
    return found


def _change(data: OctaveData, first: int, end: int, found: OctaveFit) -> int:
    """The first stretch that is all of another surface; 0 where there is none.

    Where the scores say that the stiffness changed, if at all, the fits before and after are compared, with all their
    uncertainty.
    """
    split = _likeliest(found.system, *noise_levels(found.system, data.deviations), data.deviations)
    if not split:
        return 0
    before, after = (
        _fit_stretches(data, first, first + split - 1),
        _fit_stretches(data, first + split + 1, end),
    )
    if before is None or after is None:
        return 0
    apart = abs(after.theta[_K] - before.theta[_K])
    apart /= np.sqrt(before.covariance[_K, _K] + after.covariance[_K, _K])
    return first + split + 1 if apart > NormalDist().inv_cdf(1 - 0.5 * FALSE_ALARM / _LOOKS) else 0


def _apart(system: OctaveSystem, noise: Array) -> OctaveSystem:
    """The same with relaxation as far as it is no mass, damping and stiffness: these are those of the motion."""
    whole = system.weighted_products(noise)
    turn = np.eye(SIZE + 1)
    for place in OTHERS[0]:
        turn[place, :OWN] = -solve(whole[:OWN, :OWN], whole[:OWN, place])
    products = np.einsum("pi,goij,qj->gopq", turn, system.products, turn)
    return replace(system, products=products)


@dataclass(frozen=True)
class _Mean:
    """The mean over sizes of other forces: theta, covariances and weights of the likeliest member's prior."""

    theta: Array
    noise: Array
    open: Array
    spread: Array
    prior: Array


def _mean(system: OctaveSystem, noise: Array, sensor: Array, deviations: Array) -> _Mean:
    """Over the sizes of the mass and of other forces, by evidence.

    A residual beyond the sensor's noise is not chance, so it counts as that much less evidence (a likelihood raised to
    a power: Miller and Dunson, 2019).
    """
    priors = prior_of(system, deviations)
    whole = np.tensordot(sensor / noise**2, system.total, axes=1)
    evidence = _evidence(whole, priors)
    weight = np.exp(evidence - evidence.max())
    kept = weight > _WINDOW
    weight, priors = weight[kept] / weight[kept].sum(), priors[kept]
    whole = system.weighted_products(noise)
    noisy = np.tensordot(1 / noise, system.noisy, axes=1)
    thetas, noises, opens = compensate(whole[:-1, :-1], whole[:-1, -1], noisy, priors)
    theta = weight @ thetas
    apart = thetas - theta
    return _Mean(
        theta,
        np.tensordot(weight, noises, axes=1),
        np.tensordot(weight, opens, axes=1),
        np.einsum("m,mi,mj->ij", weight, apart, apart),
        priors[int(np.argmax(weight))],
    )


def _evidence(whole: Array, priors: Array) -> Array:
    """Log of the probability of the data under each prior, but for a constant, shape (members,)."""
    normal = whole[:-1, :-1] + priors[:, :, None] * np.eye(SIZE)
    scaled, size = scale_columns(normal)
    along = whole[:-1, -1] / size
    explained = np.einsum("mi,mi->m", along, np.linalg.solve(scaled, along[..., None])[..., 0])
    spread = np.linalg.slogdet(scaled)[1] + 2 * np.log(size).sum(axis=1) - np.log(priors).sum(axis=1)
    return np.asarray((explained - spread) / 2)


def _fit_stretches(data: OctaveData, first: int, end: int) -> OctaveFit | None:
    """The fit of the stretches from first to before end, with all causes of uncertainty; None if they are too few."""
    given = system_of(data, first, end)
    if given is None:
        return None
    deviations = data.deviations
    noise, theta = noise_levels(given, deviations)
    by_position = np.einsum("i,oij,j->o", theta, given.noisy, theta) / given.count
    sensor = np.minimum(given.sensor + by_position, noise)
    system = _apart(given, noise)
    mean = _mean(system, noise, sensor, deviations)
    late = data.lag_std * _by_lag(system, noise, mean.theta)
    beyond = _hidden_force(system, noise, sensor, mean.noise) + _by_octave(
        system, noise, sensor, deviations, mean
    )
    beyond[0] += _beside_relaxation(given, noise, deviations, mean)
    opened = mean.open + mean.spread + np.outer(late, late) + np.diag(beyond)
    repeated = np.maximum(_repetition(system, noise, mean) - np.diag(mean.noise), 0.0)
    found = _with_offset(
        given, mean.theta, mean.noise + opened + np.diag(repeated), opened, float(noise.max())
    )
    return OctaveFit(*found, given, _refusal(system, noise, sensor, mean.theta))


def _with_offset(
    system: OctaveSystem, theta: Array, covariance: Array, opened: Array, level: float
) -> tuple[Array, Array, Array]:
    """M, B, K and the offset, their covariance, and the part of it that is not noise of the force."""
    own, means = np.eye(4, SIZE), system.means
    own[3, :OWN] = -means[:OWN]
    own[3, OWN] = 0.0
    values = np.append(theta[:OWN], means[4] - means[:OWN] @ theta[:OWN])
    of_mean = np.diag([0.0, 0.0, 0.0, level / system.samples])
    return values, own @ covariance @ own.T + of_mean, own @ opened @ own.T


def _beside_relaxation(system: OctaveSystem, noise: Array, deviations: Array, mean: _Mean) -> float:
    """Variance of the mass by how far relaxation of any size moves it, beyond its noise (Hausman, 1978).

    A stiffness that grows with the frequency is no mass below zero.
    """
    whole = system.weighted_products(noise)
    normal = whole[:-1, :-1] + np.diag(prior_of(system, deviations)[0])
    apart = abs(float(solve(normal, whole[:-1, -1])[0]) - mean.theta[0])
    grown = max(float(inverse(normal)[0, 0]) - mean.noise[0, 0], 0.0)
    return float(max(apart - NORMAL * np.sqrt(grown), 0.0) ** 2)


def _by_lag(system: OctaveSystem, noise: Array, theta: Array) -> Array:
    """How theta moves with the lag, shape (8,): the force's rate is B a + K v and M times the rate of a, -w^2 v."""
    rate = np.zeros((len(noise), SIZE))
    rate[:, 0], rate[:, 1] = theta[1], theta[2] - theta[0] * (2 * np.pi * system.frequency) ** 2
    whole = system.weighted_products(noise)[:-1, :-1]
    right = np.einsum("o,oij,oj->i", 1 / noise, system.total[:, :-1, :-1], rate)
    return solve(whole, right)


def _hidden_force(system: OctaveSystem, noise: Array, sensor: Array, covariance: Array) -> Array:
    """Variances by a force that lies along the parameters' columns, as large as the residual beyond the sensors' noise.

    Seen is what chance would show in one of twenty presses at most, in any octave.
    """
    chance = NormalDist().inv_cdf(1 - 0.05 / len(noise))
    beyond = noise - sensor
    beyond = np.where(beyond > chance * sensor * np.sqrt(2 / np.maximum(system.count, 1.0)), beyond, 0.0)
    gain = np.einsum("ki,oij,kj->ok", covariance, system.total[:, :-1, :-1], covariance)
    return np.asarray(_HIDDEN**2 * np.maximum((system.count * beyond / noise**2) @ gain, 0.0))


def _by_octave(system: OctaveSystem, noise: Array, sensor: Array, deviations: Array, mean: _Mean) -> Array:
    """Variances by how far the answer moves without one octave, beyond the growth of its covariance."""
    excess = np.zeros(SIZE)
    if len(noise) < 2:
        return excess
    own = np.diag(mean.noise + mean.spread + mean.open)
    for octave in range(len(noise)):
        use = np.arange(len(noise)) != octave
        other = _mean(system.only(use), noise[use], sensor[use], deviations)
        grown = np.maximum(np.diag(other.noise + other.spread + other.open) - own, 0.0)
        excess = np.maximum(excess, (other.theta - mean.theta) ** 2 - grown)
    return excess


def _repetition(system: OctaveSystem, noise: Array, mean: _Mean) -> Array:
    """Variances by what leaving each stretch of time out moves, shape (8,), for Student's degrees of freedom.

    Of so many degrees of freedom f, Student's interval of 95 % is about f / (f - 2.4) times Gauss', squared.
    """
    whole, own = system.weighted_products(noise), np.tensordot(system.products, 1 / noise, axes=((1,), (0,)))
    normal = whole[:-1, :-1] + np.diag(mean.prior)
    theta = solve(normal, whole[:-1, -1])
    rest = normal - own[:, :-1, :-1]
    moves = solve(rest, whole[:-1, -1] - own[:, :-1, -1]) - theta
    C = inverse(normal)
    share = np.abs(np.einsum("ij,gjk,ki->gi", C, own[:, :-1, :-1], C)) / np.diag(C)
    share /= np.maximum(share.sum(axis=0), 1e-300)
    free = np.maximum(1 / np.maximum(np.sum(share**2, axis=0), 1e-300) - 1, 1.0)
    student = np.where(free > 4.8, free / np.maximum(free - 2.4, 1.0), (1 + 2 / free) ** 2)
    return np.asarray(student * (free / (free + 1)) * np.sum(moves**2, axis=0))


def _refusal(system: OctaveSystem, noise: Array, sensor: Array, theta: Array) -> str:
    """Why nothing is identified, or nothing."""
    beyond = float(np.maximum(noise - sensor, 0.0) @ system.count)
    power = float(system.total[:, -1, -1].sum())
    if beyond > UNEXPLAINED * power:
        return f"{100 * beyond / power:.0f} % of the force is not explained"
    # The dynamic stiffness at the ends of a sine of this size: that of no contact changes by as much as itself.
    whole = system.weighted_products(noise)[:-1, :-1]
    tangent = float(whole[_K, :OWN] @ theta[:OWN]) / float(whole[_K, _K])
    spread = float(system.plain[2, 2] / system.samples - system.means[2] ** 2)
    bend = np.hypot(2 * theta[5], theta[6] * np.sqrt(whole[1, 1] / whole[_K, _K]))
    if 0 < tangent < bend * np.sqrt(2 * max(spread, 0.0)):
        return "the force stops following the position within the motion: contact is lost"
    return ""


def _likeliest(system: OctaveSystem, noise: Array, theta: Array, deviations: Array) -> int:
    """How many stretches are before the likeliest change of the stiffness; 0 if nothing speaks for one.

    Each stretch has a stiffness of its own, as far as its scores go; those before an instant are compared with those
    after it, weighted by their information, in units of their spread about the mean of their side (Andrews, 1993).
    """
    own = np.tensordot(system.products, 1 / noise, axes=((1,), (0,)))
    count = len(own)
    if count < 2 * _SIDE:
        return 0
    row = inverse(own[:, :-1, :-1].sum(axis=0) + np.diag(prior_of(system, deviations)[0]))[_K]
    noisy = np.einsum("go,oij,j->gi", system.lines / system.count / noise, system.noisy, theta)
    pull = (own[:, :-1, -1] - own[:, :-1, :-1] @ theta + noisy) @ row
    weight = np.einsum("i,gij,j->g", row, own[:, :-1, :-1], row)
    weight = np.maximum(weight, 1e-12 * weight.sum() + 1e-300)
    sizes = np.arange(_SIDE, count - _SIDE + 1)
    inside = np.cumsum(weight)[sizes - 1]
    beyond = np.cumsum(weight[::-1])[::-1][sizes]
    before, after = np.cumsum(pull)[sizes - 1] / inside, np.cumsum(pull[::-1])[::-1][sizes] / beyond
    first = np.arange(count) < sizes[:, None]
    apart = pull / weight - np.where(first, before[:, None], after[:, None])
    variance = (weight * apart**2).sum(axis=1) / (count - 2) * (1 / inside + 1 / beyond)
    square = (after - before) ** 2 / np.maximum(variance, 1e-300)
    best = int(np.argmax(square))
    chance = NormalDist().inv_cdf(1 - _SUSPECTED)
    return int(sizes[best]) if _normal_of_f(float(square[best]), 1, count - 2) > chance else 0


def _normal_of_f(f: float, k: int, free: int) -> float:
    """The standard normal number as improbable as an F of k and `free` degrees of freedom (Paulson, 1942)."""
    u, w = 2 / (9 * k), 2 / (9 * free)
    root = float(np.cbrt(f))
    return ((1 - w) * root - (1 - u)) / float(np.sqrt(w * root**2 + u))
