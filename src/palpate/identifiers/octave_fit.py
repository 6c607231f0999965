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

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from statistics import NormalDist

import numpy as np

from palpate.arrays import Array
from palpate.identifiers.kernels import octave_sums as sums
from palpate.identifiers.octave_system import OTHERS, OWN, SIZE, OctaveData, System, system_of
from palpate.signals.types import NORMAL

FALSE_ALARM = 1e-3
"""Probability of a change that is none, each time one looks."""
UNEXPLAINED = 1 / 3
"""Share of the force's power beyond which a fit identifies nothing."""
_SIZES = (0.003, 0.03, 0.3)
"""Deviations of the prior of another force's size, over that of the whole force: hardly there, or of some order."""
_MASSES = (0.01, 0.1, 1.0)
"""The same of the mass, over the largest that the caller gives."""
_WINDOW = 0.02
"""Evidence over the highest below which a member is left out (Occam's window)."""
_IN_BAND = 0.3
"""Relative error of the position noise's power within the band, told from above it."""
_HIDDEN = 0.5
"""Share of the unexplained amplitude along one column: of a force in an unknown phase, half of the power."""
_DROWNED = 0.9
"""Share of the information that is noise of the position, at most; beyond, a direction is as good as unknown."""
_BORROWED = 1.0
"""Lines that the level of an octave takes from the next higher one."""
_STEPS = 8
_SUSPECTED = 0.1
"""Probability at which the scores have the fits before and after compared; it costs time alone."""
_LOOKS = 5.0
"""Independent instants among those at which a change is looked for."""
_SIDE = 2
"""Stretches on each side of a change, at least."""
_K = 2


def _supposed() -> Array:
    """Factors of the prior's weights for each combination of sizes, shape (members, 8), the largest sizes first."""
    found = []
    for mass, *others in product(_MASSES[::-1], *(_SIZES[::-1] for _ in OTHERS)):
        weight = np.ones(SIZE)
        weight[0] = mass**-2
        for places, size in zip(OTHERS, others, strict=True):
            weight[list(places)] = size**-2
        found.append(weight)
    return np.array(found)


_SUPPOSED = _supposed()


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
    system: System
    rejected: str

    def compensated(self, theta: Array, deviations: Array) -> tuple[Array, Array]:
        """Least squares of the same samples in time, noise of the position taken out, and what that leaves open.

        Args:
            theta: M, B, K and offset by plain least squares, shape (4,).
            deviations: of each before anything is known, shape (4,).
        """
        prior = deviations**-2.0
        right = (self.system.plain + np.diag(prior)) @ theta
        found, _, opened = _compensated(self.system.plain, right, self.system.in_samples, prior)
        return found, opened


def octave_fit(data: OctaveData, since: float) -> OctaveFit | None:
    """The fit of `octave_sums`; None where there are too few stretches for an interval.

    Args:
        data: the sums, and the noise in them.
        since: samples that the fit may rest on, the newest.
    """
    newer = np.cumsum(data.groups[::-1, sums.WEIGHT])[::-1]
    first, end = int(np.count_nonzero(newer > since + 0.5)), len(data.groups)
    found = _answered(data, first, end)
    while found is not None and (split := _change(data, first, end, found)):
        first = split
        found = _answered(data, first, end)
    return found


def _change(data: OctaveData, first: int, end: int, found: OctaveFit) -> int:
    """The first stretch that is all of another surface; 0 where there is none.

    Where the scores say that the stiffness changed, if at all, the fits before and after are compared, with all their
    uncertainty.
    """
    split = _likeliest(found.system, *_levels(found.system, data.deviations), data.deviations)
    if not split:
        return 0
    before, after = _answered(data, first, first + split - 1), _answered(data, first + split + 1, end)
    if before is None or after is None:
        return 0
    apart = abs(after.theta[_K] - before.theta[_K])
    apart /= np.sqrt(before.covariance[_K, _K] + after.covariance[_K, _K])
    return first + split + 1 if apart > NormalDist().inv_cdf(1 - 0.5 * FALSE_ALARM / _LOOKS) else 0


def _apart(system: System, noise: Array) -> System:
    """The same with relaxation as far as it is no mass, damping and stiffness: these are those of the motion."""
    whole = system.weighted(noise)
    turn = np.eye(SIZE + 1)
    for place in OTHERS[0]:
        turn[place, :OWN] = -_solved(whole[:OWN, :OWN], whole[:OWN, place])
    products = np.einsum("pi,goij,qj->gopq", turn, system.products, turn)
    return replace(system, products=products)


def _prior(system: System, deviations: Array) -> Array:
    """Weights of the priors, each supposing a size of the mass and of every other force, shape (members, 8).

    The first supposes the largest of all.
    """
    power = np.einsum("oii->i", system.total)
    own = deviations[:OWN] ** -2.0
    return np.concatenate([own, power[OWN:SIZE] / max(float(power[SIZE]), 1e-300)]) * _SUPPOSED


def _scaled(normal: Array) -> tuple[Array, Array]:
    """A matrix scaled to a unit diagonal, and the sizes of its columns; shapes (..., n, n), (..., n)."""
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", normal), 1e-300))
    return normal / (size[..., :, None] * size[..., None, :]) + 1e-12 * np.eye(normal.shape[-1]), size


def _solved(normal: Array, right: Array) -> Array:
    """normal^-1 right, right of shape (..., n)."""
    scaled, size = _scaled(normal)
    return np.asarray(np.linalg.solve(scaled, (right / size)[..., None])[..., 0] / size)


def _inverse(normal: Array) -> Array:
    scaled, size = _scaled(normal)
    return np.asarray(np.linalg.inv(scaled) / (size[..., :, None] * size[..., None, :]))


def _levels(system: System, deviations: Array) -> tuple[Array, Array]:
    """Variance of a line in each octave by the residual there, shape (octaves,), and the fit with it.

    Degrees of freedom are taken off. Stretches count by the power of their force: the residual of a tip at rest says
    nothing of that of one that moves.
    """
    total, count = system.total, system.count
    prior = _prior(system, deviations)[0]
    force = np.where(system.lines > 0, np.maximum(system.products[:, :, -1, -1], 0.0), 0.0)
    share = force / np.maximum(force.sum(axis=0), 1e-300)
    rests = 1 / np.maximum(np.sum(share**2 / np.maximum(system.lines, 1.0), axis=0), 1e-300)
    rests = np.where(force.sum(axis=0) > 0, rests, count)
    mean = float(total[:, -1, -1].sum() / count.sum())
    noise = np.full(len(count), 1e-3 * mean + 1e-280)
    theta = np.zeros(SIZE)
    for _ in range(_STEPS):
        whole = np.tensordot(1 / noise, total, axes=1)
        normal = whole[:-1, :-1] + np.diag(prior)
        noisy = np.tensordot(1 / noise, system.noisy, axes=1)
        theta = _compensated(whole[:-1, :-1], whole[:-1, -1], noisy, prior)[0]
        full = np.append(-theta, 1.0)
        left = np.maximum(np.einsum("i,goij,j->go", full, system.products, full), 0.0)
        left = (share * left / np.maximum(system.lines, 1.0)).sum(axis=0)
        used = np.einsum("oij,ij->o", total[:, :-1, :-1], _inverse(normal)) / noise
        free = np.maximum(rests - used, 0.0)
        above, noise = 0.0, noise.copy()
        for o in np.argsort(-system.frequency):
            borrowed = _BORROWED if above else 0.0
            above = (left[o] * rests[o] + borrowed * above) / max(free[o] + borrowed, 1.0)
            noise[o] = above = max(above, float(system.sensor[o]), 1e-12 * mean + 1e-280)
    return noise, theta


def _compensated(known: Array, right: Array, noisy: Array, prior: Array) -> tuple[Array, Array, Array]:
    """theta with the noise of the position taken out, its covariance, and that of what the noise leaves open.

    In each direction of the parameters with its own share of noise: least squares give 1 - share of what is true. In a
    direction that is nearly all noise nothing is taken out, and the prior alone says how far it may reach.

    Args:
        known: normal equations of the data, shape (8, 8).
        right: their right-hand side, shape (8,).
        noisy: part of them that is noise of the position, shape (8, 8).
        prior: weights of the prior, shape (..., 8).
    """
    scaled, size = _scaled(known + prior[..., None] * np.eye(len(right)))
    root = np.linalg.cholesky(scaled)
    inner = np.linalg.solve(root, noisy / (size[..., :, None] * size[..., None, :]))
    inner = np.linalg.solve(root, np.swapaxes(inner, -1, -2))
    share, ways = np.linalg.eigh((inner + np.swapaxes(inner, -1, -2)) / 2)
    seen = (1 + _IN_BAND) * share < _DROWNED
    share = np.clip(np.where(seen, share, 0.0), 0.0, None)
    back = np.linalg.solve(np.swapaxes(root, -1, -2), ways) / size[..., :, None]
    pull = np.einsum("...ij,i->...j", back, right)
    kept = 1 - share
    further = pull * (1 / (1 - (1 + _IN_BAND) * share) - 1 / kept)
    further = np.where(seen, further, np.einsum("...ij,...i->...j", back**2, prior) ** -0.5)
    turned = np.swapaxes(back, -1, -2)
    theta = np.einsum("...ij,...j->...i", back, pull / kept)
    return theta, (back / kept[..., None, :] ** 2) @ turned, (back * further[..., None, :] ** 2) @ turned


@dataclass(frozen=True)
class _Mean:
    """The mean over sizes of other forces: theta, covariances and weights of the likeliest member's prior."""

    theta: Array
    noise: Array
    open: Array
    spread: Array
    prior: Array


def _mean(system: System, noise: Array, sensor: Array, deviations: Array) -> _Mean:
    """Over the sizes of the mass and of other forces, by evidence.

    A residual beyond the sensor's noise is not chance, so it counts as that much less evidence (a likelihood raised to
    a power: Miller and Dunson, 2019).
    """
    priors = _prior(system, deviations)
    whole = np.tensordot(sensor / noise**2, system.total, axes=1)
    evidence = _evidence(whole, priors)
    weight = np.exp(evidence - evidence.max())
    kept = weight > _WINDOW
    weight, priors = weight[kept] / weight[kept].sum(), priors[kept]
    whole = system.weighted(noise)
    noisy = np.tensordot(1 / noise, system.noisy, axes=1)
    thetas, noises, opens = _compensated(whole[:-1, :-1], whole[:-1, -1], noisy, priors)
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
    scaled, size = _scaled(normal)
    along = whole[:-1, -1] / size
    explained = np.einsum("mi,mi->m", along, np.linalg.solve(scaled, along[..., None])[..., 0])
    spread = np.linalg.slogdet(scaled)[1] + 2 * np.log(size).sum(axis=1) - np.log(priors).sum(axis=1)
    return np.asarray((explained - spread) / 2)


def _answered(data: OctaveData, first: int, end: int) -> OctaveFit | None:
    """The fit of the stretches from first to before end, with all causes of uncertainty; None if they are too few."""
    given = system_of(data, first, end)
    if given is None:
        return None
    deviations = data.deviations
    noise, theta = _levels(given, deviations)
    by_position = np.einsum("i,oij,j->o", theta, given.noisy, theta) / given.count
    sensor = np.minimum(given.sensor + by_position, noise)
    system = _apart(given, noise)
    mean = _mean(system, noise, sensor, deviations)
    late = data.lag_std * _by_lag(system, noise, mean.theta)
    beyond = _hidden(system, noise, sensor, mean.noise) + _by_octave(system, noise, sensor, deviations, mean)
    beyond[0] += _beside_relaxation(given, noise, deviations, mean)
    opened = mean.open + mean.spread + np.outer(late, late) + np.diag(beyond)
    repeated = np.maximum(_repetition(system, noise, mean) - np.diag(mean.noise), 0.0)
    found = _with_offset(
        given, mean.theta, mean.noise + opened + np.diag(repeated), opened, float(noise.max())
    )
    return OctaveFit(*found, given, _refusal(system, noise, sensor, mean.theta))


def _with_offset(
    system: System, theta: Array, covariance: Array, opened: Array, level: float
) -> tuple[Array, Array, Array]:
    """M, B, K and the offset, their covariance, and the part of it that is not noise of the force."""
    own, means = np.eye(4, SIZE), system.means
    own[3, :OWN] = -means[:OWN]
    own[3, OWN] = 0.0
    values = np.append(theta[:OWN], means[4] - means[:OWN] @ theta[:OWN])
    of_mean = np.diag([0.0, 0.0, 0.0, level / system.samples])
    return values, own @ covariance @ own.T + of_mean, own @ opened @ own.T


def _beside_relaxation(system: System, noise: Array, deviations: Array, mean: _Mean) -> float:
    """Variance of the mass by how far relaxation of any size moves it, beyond its noise (Hausman, 1978).

    A stiffness that grows with the frequency is no mass below zero.
    """
    whole = system.weighted(noise)
    normal = whole[:-1, :-1] + np.diag(_prior(system, deviations)[0])
    apart = abs(float(_solved(normal, whole[:-1, -1])[0]) - mean.theta[0])
    grown = max(float(_inverse(normal)[0, 0]) - mean.noise[0, 0], 0.0)
    return float(max(apart - NORMAL * np.sqrt(grown), 0.0) ** 2)


def _by_lag(system: System, noise: Array, theta: Array) -> Array:
    """How theta moves with the lag, shape (8,): the force's rate is B a + K v and M times the rate of a, -w^2 v."""
    rate = np.zeros((len(noise), SIZE))
    rate[:, 0], rate[:, 1] = theta[1], theta[2] - theta[0] * (2 * np.pi * system.frequency) ** 2
    whole = system.weighted(noise)[:-1, :-1]
    right = np.einsum("o,oij,oj->i", 1 / noise, system.total[:, :-1, :-1], rate)
    return _solved(whole, right)


def _hidden(system: System, noise: Array, sensor: Array, covariance: Array) -> Array:
    """Variances by a force that lies along the parameters' columns, as large as the residual beyond the sensors' noise.

    Seen is what chance would show in one of twenty presses at most, in any octave.
    """
    chance = NormalDist().inv_cdf(1 - 0.05 / len(noise))
    beyond = noise - sensor
    beyond = np.where(beyond > chance * sensor * np.sqrt(2 / np.maximum(system.count, 1.0)), beyond, 0.0)
    gain = np.einsum("ki,oij,kj->ok", covariance, system.total[:, :-1, :-1], covariance)
    return np.asarray(_HIDDEN**2 * np.maximum((system.count * beyond / noise**2) @ gain, 0.0))


def _by_octave(system: System, noise: Array, sensor: Array, deviations: Array, mean: _Mean) -> Array:
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


def _repetition(system: System, noise: Array, mean: _Mean) -> Array:
    """Variances by what leaving each stretch of time out moves, shape (8,), for Student's degrees of freedom.

    Of so many degrees of freedom f, Student's interval of 95 % is about f / (f - 2.4) times Gauss', squared.
    """
    whole, own = system.weighted(noise), np.tensordot(system.products, 1 / noise, axes=((1,), (0,)))
    normal = whole[:-1, :-1] + np.diag(mean.prior)
    theta = _solved(normal, whole[:-1, -1])
    rest = normal - own[:, :-1, :-1]
    moves = _solved(rest, whole[:-1, -1] - own[:, :-1, -1]) - theta
    C = _inverse(normal)
    share = np.abs(np.einsum("ij,gjk,ki->gi", C, own[:, :-1, :-1], C)) / np.diag(C)
    share /= np.maximum(share.sum(axis=0), 1e-300)
    free = np.maximum(1 / np.maximum(np.sum(share**2, axis=0), 1e-300) - 1, 1.0)
    student = np.where(free > 4.8, free / np.maximum(free - 2.4, 1.0), (1 + 2 / free) ** 2)
    return np.asarray(student * (free / (free + 1)) * np.sum(moves**2, axis=0))


def _refusal(system: System, noise: Array, sensor: Array, theta: Array) -> str:
    """Why nothing is identified, or nothing."""
    beyond = float(np.maximum(noise - sensor, 0.0) @ system.count)
    power = float(system.total[:, -1, -1].sum())
    if beyond > UNEXPLAINED * power:
        return f"{100 * beyond / power:.0f} % of the force is not explained"
    # The dynamic stiffness at the ends of a sine of this size: that of no contact changes by as much as itself.
    whole = system.weighted(noise)[:-1, :-1]
    tangent = float(whole[_K, :OWN] @ theta[:OWN]) / float(whole[_K, _K])
    spread = float(system.plain[2, 2] / system.samples - system.means[2] ** 2)
    bend = np.hypot(2 * theta[5], theta[6] * np.sqrt(whole[1, 1] / whole[_K, _K]))
    if 0 < tangent < bend * np.sqrt(2 * max(spread, 0.0)):
        return "the force stops following the position within the motion: contact is lost"
    return ""


def _likeliest(system: System, noise: Array, theta: Array, deviations: Array) -> int:
    """How many stretches are before the likeliest change of the stiffness; 0 if nothing speaks for one.

    Each stretch has a stiffness of its own, as far as its scores go; those before an instant are compared with those
    after it, weighted by their information, in units of their spread about the mean of their side (Andrews, 1993).
    """
    own = np.tensordot(system.products, 1 / noise, axes=((1,), (0,)))
    count = len(own)
    if count < 2 * _SIDE:
        return 0
    row = _inverse(own[:, :-1, :-1].sum(axis=0) + np.diag(_prior(system, deviations)[0]))[_K]
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
