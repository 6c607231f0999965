"""A Gaussian process of two length scales through noisy values at places, averaged over its parameters' posterior.

The smooth process (Matern 5/2) carries what changes over the whole surface, the rough one (Matern 3/2) carries edges.
Equations are those of Rasmussen and Williams, Gaussian Processes for Machine Learning (2006).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cholesky, eigh
from scipy.linalg.lapack import dtrtri
from scipy.optimize import brentq, minimize
from scipy.spatial.distance import cdist, pdist, squareform
from scipy.special import ndtr, ndtri

from palpate.arrays import Array, Mask

Posterior = Callable[[Array], tuple[float, Array]]
"""Minus the logarithm of a density, and its gradient."""
SMOOTH = 5.0**0.5
ROUGH = 3.0**0.5
"""Factors of the distance in the Matern correlations (eq. 4.17)."""
BLOCK = 300
"""Presses of one likelihood: of more, random blocks are independent (composite likelihood), so that time is linear."""
CHUNK = 16_000
"""Covariances in one part of a prediction: they fit in a processor's cache, see `benchmarks/maps/coverage.py`."""
PRODUCT = 500_000
"""Multiplications in one matrix product: so few that BLAS starts no threads, which on a busy machine wait for each
other a hundred times longer than they compute."""
SMALL = 32
"""Half of the rows of a matrix that LAPACK factors at once: its threads start at 64."""
LEVEL = 0.05
"""Fraction of values outside their intervals."""
Z95 = -float(ndtri(LEVEL / 2.0))
"""Half-width of a normal distribution's central 95 % over its standard deviation."""
ROUNDING = 1e-3
"""Fraction of the variance that rounding to single precision may take: a twentieth of a per cent of an interval."""
FREEDOMS = (2.0, 3.0, 4.0, 6.0, 10.0, 30.0)
"""Degrees of freedom of Student's distributions, from tails of no variance to the normal one."""
MIN_WEIGHT = 0.02
"""Weight from which a set of parameters counts; without it `benchmarks/maps/coverage.py` prints the same coverage."""


@dataclass(frozen=True)
class Hyperparameters:
    """Standard deviations and length scales of the two processes, all above zero.

    Args:
        smooth: standard deviation of the smooth process.
        long: its length scale [m].
        rough: standard deviation of the rough process.
        short: its length scale [m].
        repeat: standard deviation from press to press at one place, beyond what each press states of itself.
        shared: standard deviation of the error that the presses of one line have in common.
    """

    smooth: float
    long: float
    rough: float
    short: float
    repeat: float
    shared: float = 0.0

    def covariance(self, distance: Array) -> Array:
        """Covariance of the field at distances [m] of any shape."""
        total = distance * (-SMOOTH / self.long)
        rough = distance * (-ROUGH / self.short)
        fall = np.exp(total)
        total -= 1.5  # 1 + s + s^2 / 3 is ((1.5 + s)^2 + .75) / 3
        total *= total
        total += 0.75
        total *= self.smooth**2 / 3.0
        total *= fall
        np.exp(rough, out=fall)
        rough -= 1.0
        rough *= -(self.rough**2)
        rough *= fall
        total += rough
        return total

    @property
    def variance(self) -> float:
        """Variance of the field at one place before any press."""
        return self.smooth**2 + self.rough**2


@dataclass(frozen=True)
class Conditioned:
    """A process with known parameters, given values at places; its mean over the surface is unknown (section 2.7).

    Args:
        places: of the values (n, d) [m].
        values: (n,).
        noise: standard deviation of each value (n,).
        parameters: of the processes.
        line: of each value, a number (n,); None where no values share an error.
    """

    places: Array
    values: Array
    noise: Array
    parameters: Hyperparameters
    line: Array | None = None

    @cached_property
    def whitening(self) -> Array:
        """Inverse of the lower Cholesky factor of the values' covariance (n, n)."""
        K = self.parameters.covariance(cdist(self.places, self.places))
        K[np.diag_indices_from(K)] += self.noise**2 + self.parameters.repeat**2
        if self.line is not None:
            K += self.parameters.shared**2 * (self.line[:, None] == self.line)
        return whiten(K)

    @cached_property
    def reduction(self) -> Reduction:
        """Linear rows over the values that give the field elsewhere."""
        W = self.whitening
        ones = W.sum(axis=1)
        unknown = 1.0 / float(np.linalg.norm(ones))
        level = unknown**2 * float(ones @ (W @ self.values))
        rows = np.vstack([W, W.T @ (W @ (self.values - level)), unknown * (ones @ W)])
        return Reduction(self.parameters, rows, level, unknown, self.parameters.variance)

    def covariance(self, places: Array) -> Array:
        """Covariance of the field at places (m, d), given the values (m, m)."""
        parameters = self.parameters
        products = _product(self.reduction.rows, parameters.covariance(cdist(self.places, places)))
        explained = products[:-2]
        level = self.reduction.unknown - products[-1]
        total = np.outer(level, level) - _product(explained.T, explained)
        total += squareform(parameters.covariance(pdist(places)))
        total[np.diag_indices_from(total)] += parameters.variance
        return total

    def leave_one_out(self) -> tuple[Array, Array]:
        """Deviation of each value from the prediction of the others, and its variance, (n,) each (section 5.4.2)."""
        inverse, _ = _without_level(self.whitening)
        variance = 1.0 / np.diag(inverse)
        return (inverse @ self.values) * variance, variance


@dataclass(frozen=True)
class Reduction:
    """The field elsewhere by linear rows over the values: for one set of parameters, or for k sets at once.

    Args:
        parameters: of the processes, each a number or (k, 1, 1).
        rows: over the covariances with the values (..., n + 2, n): the inverse of the factor, the weights of the mean,
            and those of the unknown level.
        level: mean over the surface by generalised least squares, a number or (k, 1).
        unknown: its standard deviation, alike.
        prior: variance of the field before any value, alike.
    """

    parameters: Hyperparameters
    rows: Array
    level: Any
    unknown: Any
    prior: Any

    def predict(self, distance: Array) -> tuple[Array, Array]:
        """Mean and variance (..., m) of the field at distances (n, m) [m] from the values' places (eq. 2.42)."""
        k = self.parameters.covariance(distance.astype(self.rows.dtype))
        n, m = distance.shape
        height = max(PRODUCT // (n * max(m, 1)), 1)
        variance = self.prior
        for first in range(0, n, height):  # bands of rows: the inverse of the factor is triangular
            last = min(first + height, n)
            explained = self.rows[..., first:last, :last] @ k[..., :last, :]
            variance = variance - np.einsum("...ij,...ij->...j", explained, explained)
        rise, level = np.moveaxis(self.rows[..., n:, :] @ k, -2, 0)
        return self.level + rise, np.maximum(variance + (self.unknown - level) ** 2, 0.0)


def _product(rows: Array, right: Array) -> Array:
    """The product of two matrices by parts of the left one's rows, each so small that BLAS starts no threads."""
    height = max(PRODUCT // max(right.size, 1), 1)
    return np.concatenate([rows[first : first + height] @ right for first in range(0, len(rows), height)])


def _without_level(W: Array) -> tuple[Array, float]:
    """Inverse of a covariance (n, n) without the unknown level of the values, and the precision of that level.

    Args:
        W: `whiten` of the covariance (n, n).
    """
    ones = W.sum(axis=1)
    precision = float(ones @ ones)  # a sum of squares, which rounding does not make negative
    w = W.T @ ones
    return _product(W.T, W) - np.outer(w, w) / precision, precision


def whiten(covariance: Array) -> Array:
    """Inverse of the lower Cholesky factor (n, n), by halves so small that LAPACK starts no threads, see `PRODUCT`.

    Raises:
        LinAlgError: the covariance is not positive definite.
    """
    half = len(covariance) // 2
    if half < SMALL:
        return np.asarray(dtrtri(cholesky(covariance, lower=True, check_finite=False), lower=1)[0])
    upper = whiten(covariance[:half, :half])
    beside = _product(covariance[half:, :half], upper.T)
    lower = whiten(covariance[half:, half:] - _product(beside, beside.T))
    return np.block([[upper, np.zeros_like(beside.T)], [-_product(lower, _product(beside, upper)), lower]])


@dataclass(frozen=True)
class LogPrior:
    """Normal prior of the logarithms of the parameters.

    Args:
        mean: of the logarithms, in the order of `Hyperparameters` (d,).
        std: (d,).
    """

    mean: Array
    std: Array


def prior_of(distance: Array, values: Array, noise: Array) -> LogPrior:
    """A prior from the scales of the data: a factor of e or more either way about what the presses themselves show.

    The field varies as the values do; the long scale is half the region, the short one twice the spacing of presses;
    presses repeat as they say or, where they say nothing, to a fifth of the values' spread.
    """
    rounding = 1e-9 * float(np.abs(values).max())
    spread = max(float(np.std(values)), float(np.median(noise)), rounding, 1e-300)
    nearest = np.where(distance > 0.0, distance, np.inf).min(axis=1)
    region = float(distance.max())
    spacing = float(np.median(nearest))
    repeat = float(np.median(noise)) or spread / 5.0
    middle = (spread, region / 2.0, spread / 2.0, min(2.0 * spacing, region / 2.0), repeat)
    return LogPrior(np.log(middle), np.array([1.0, 0.7, 1.0, 0.7, 1.5]))


def loss(
    theta: Array, distance: Array, values: Array, noise: Array, same: Mask | None = None
) -> tuple[float, Array]:
    """Minus the restricted log likelihood, and its gradient by the logarithms theta (eqs. 5.8, 5.9).

    Args:
        theta: logarithms of the parameters, of five or, with `same`, of all six.
        distance: of each two places [m], as `scipy.spatial.distance.pdist` lists them.
        values: (n,).
        noise: standard deviation that each value states of itself (n,).
        same: whether two values are of one line, listed as the distances.
    """
    p = Hyperparameters(*np.exp(theta))
    s = SMOOTH / p.long * distance
    fall_s = p.smooth**2 * np.exp(-s)
    smooth = (1.0 + s + s * s / 3.0) * fall_s
    r = ROUGH / p.short * distance
    fall_r = p.rough**2 * np.exp(-r)
    rough = (1.0 + r) * fall_r
    slopes: list[Any] = [2.0 * smooth, s * s * (1.0 + s) / 3.0 * fall_s, 2.0 * rough, r * r * fall_r]
    covariance = smooth + rough
    if same is not None:
        covariance += p.shared**2 * same
        slopes.append(2.0 * p.shared**2 * same)
    K = squareform(covariance)
    K[np.diag_indices_from(K)] = p.variance + noise**2 + p.repeat**2 + p.shared**2
    W = whiten(K)
    P, precision = _without_level(W)
    a = np.einsum("ij,j", P, values)
    G = P - np.outer(a, a)  # G / 2 is the derivative by the covariance, which holds each pair twice
    pairs = squareform(G, checks=False)
    gradient = [np.einsum("i,i", pairs, slope) for slope in slopes]
    gradient.insert(4, 0.0)  # the repetition adds no covariance between different values
    variances = np.array([p.smooth**2, 0.0, p.rough**2, 0.0, p.repeat**2, p.shared**2])
    diagonal = np.trace(G) * variances
    value = 0.5 * values @ a - np.log(np.diag(W)).sum() + 0.5 * np.log(precision)
    return float(value), np.array(gradient) + diagonal[: len(gradient)]


@dataclass(frozen=True)
class GaussianProcess:
    """A field given noisy values at places, averaged over the posterior of the processes' parameters.

    Args:
        nodes: the process at points of the posterior, the most likely one first.
        weights: of the nodes (k,), of sum 1.
    """

    nodes: tuple[Conditioned, ...]
    weights: Array

    @property
    def likeliest(self) -> Conditioned:
        """The process at the mode of the posterior."""
        return self.nodes[0]

    @property
    def repeat(self) -> float:
        """Standard deviation from press to press at one place, beyond what each press states."""
        return float(np.sqrt(self.weights @ [node.parameters.repeat**2 for node in self.nodes]))

    @property
    def shared(self) -> float:
        """Standard deviation of the error that the presses of one line have in common."""
        return float(np.sqrt(self.weights @ [node.parameters.shared**2 for node in self.nodes]))

    @cached_property
    def next_z95(self) -> float:
        """Half-width of a next value's central 95 % over its standard deviation, for fields that are not normal.

        The quantile of the deviations of values left out and of one unseen (conformal prediction; Vovk et al. 2005),
        among which the normal distribution counts as so many values as have one outside; at least that of the normal
        distribution, since values that scatter less than they state tell nothing of the field between them.
        """
        errors, variance = self.likeliest.leave_one_out()
        deviations = np.abs(errors) / np.sqrt(variance)
        normal = 1.0 / LEVEL
        allowed = LEVEL * (normal + len(deviations) + 1.0) - 1.0

        def excess(z: float) -> float:
            return float(2.0 * normal * ndtr(-z) + np.sum(deviations > z)) - allowed

        return max(Z95, float(brentq(excess, 0.0, max(5.0, *deviations))))

    @cached_property
    def z95(self) -> float:
        """Half-width of the field's own central 95 % over its standard deviation; many presses' noise hides it."""
        node = self.likeliest
        errors, variance = node.leave_one_out()
        p = node.parameters
        noise = node.noise**2 + p.repeat**2 + p.shared**2
        return max(self.next_z95, student95(errors, np.maximum(variance - noise, 0.0), noise))

    @cached_property
    def _reduction(self) -> Reduction:
        """Reductions of all nodes, stacked; in single precision where rounding does not show.

        Rounding is largest relative to the variance where that is least, at the values' own places.
        """
        parts = [node.reduction for node in self.nodes]
        parameters = np.array([astuple(part.parameters) for part in parts]).T[:, :, None, None]
        scalars = np.array([(part.level, part.unknown, part.prior) for part in parts]).T[:, :, None]
        exact = Reduction(Hyperparameters(*parameters), np.array([part.rows for part in parts]), *scalars)
        distance = cdist(self.likeliest.places, self.likeliest.places)
        with np.errstate(all="ignore"):  # what does not fit into single precision fails the comparison
            rows: Any = exact.rows.astype(np.float32)
            single = replace(exact, parameters=Hyperparameters(*parameters.astype(np.float32)), rows=rows)
            mean, variance = exact.predict(distance)
            rounded_mean, rounded_variance = single.predict(distance)
            shift = np.maximum(np.abs(rounded_variance - variance), (rounded_mean - mean) ** 2)
            return single if np.all(shift <= ROUNDING * variance) else exact

    def predict(self, places: Array) -> tuple[Array, Array]:
        """Mean (m,) and variance (m,) of the field at places (m, d): the moments of the mixture."""

        def moments(part: Array) -> Array:
            means, variances = self._reduction.predict(cdist(self.likeliest.places, part))
            mean = self.weights @ means
            return np.array([mean, self.weights @ (variances + (means - mean) ** 2)])

        size = max(CHUNK // len(self.likeliest.values), 16)
        parts = [places[first : first + size] for first in range(0, len(places), size)]
        mean, variance = np.concatenate([np.empty((2, 0)), *map(moments, parts)], axis=1)
        return mean, variance


def student95(errors: Array, field: Array, noise: Array) -> float:
    """Half-width of a field's central 95 % over its standard deviation, if its deviations are Student's.

    A deviation has the variance s field + t noise, where s and t are of the inverse gamma distributions of two Student
    distributions. Their degrees of freedom, of prior alike at `FREEDOMS`, and the scale of s, whose logarithm has a
    normal prior of standard deviation .5, are averaged over their posterior; the mean of t is 1.

    Args:
        errors: deviations of values left out (n,).
        field: variance of the field in each (n,).
        noise: variance of the noise in each (n,).
    """
    s = np.exp(np.linspace(-4.0, 6.0, 31))
    scales = np.exp(np.linspace(-1.5, 1.5, 13))[:, None]
    shape = np.array(FREEDOMS)[:, None, None] / 2.0
    of_field = _mixing_weights(s, shape, shape * scales)
    of_noise = _mixing_weights(s, shape[1:], shape[1:] - 1.0)
    variance = field[:, None, None] * s[:, None] + noise[:, None, None] * s
    density = np.exp(-0.5 * errors[:, None, None] ** 2 / variance) / np.sqrt(variance)
    evidence = np.log(of_field @ density @ of_noise.T + 1e-300).sum(axis=0)
    evidence -= 0.5 * np.tile(np.log(scales) / 0.5, (len(FREEDOMS), 1)) ** 2
    posterior = np.exp(evidence - evidence.max()).sum(axis=1)
    mixture = posterior / posterior.sum() @ of_field
    return float(brentq(lambda z: 2.0 * mixture @ ndtr(-z / np.sqrt(s)) - LEVEL, 0.0, 100.0))


def _mixing_weights(s: Array, shape: Array, scale: Array) -> Array:
    """Weights of the factors s under inverse gamma distributions, a row of sum 1 each."""
    exponent = -shape * np.log(s) - scale / s
    weights = np.exp(exponent - exponent.max(axis=-1, keepdims=True))
    return np.asarray(weights.reshape(-1, len(s)) / weights.sum(axis=-1).reshape(-1, 1))


def fit(places: Array, values: Array, noise: Array, line: Array | None = None) -> GaussianProcess:
    """The process given values at places, with the posterior of its parameters by points about its mode.

    The points are those of a cubature of third degree of the normal distribution that the curvature at the mode gives;
    each weighs by the true posterior over that normal one, at most as much as the normal one says.

    Args:
        places: (n, d) [m], at least three different ones.
        values: (n,).
        noise: standard deviation that each value states of itself (n,).
        line: of each value, a number (n,), of which all share an error; None without lines.
    """
    prior = prior_of(cdist(places, places), values, noise)
    if line is not None:  # a line errs as presses repeat
        prior = LogPrior(np.append(prior.mean, prior.mean[-1]), np.append(prior.std, prior.std[-1]))
    noise = np.maximum(noise, 1e-4 * np.std(values))  # else rounding decides between presses at one place
    order = np.random.default_rng(0).permutation(len(values))
    blocks = []
    for b in np.array_split(order, -(-len(values) // BLOCK)):
        same_line = None if line is None else pdist(line[b][:, None]) == 0.0
        blocks.append((pdist(places[b]), values[b], noise[b], same_line))

    def posterior(theta: Array) -> tuple[float, Array]:
        z = (theta - prior.mean) / prior.std
        losses, gradients = zip(*(loss(theta, *block) for block in blocks), strict=True)
        return float(0.5 * z @ z + sum(losses)), z / prior.std + np.sum(gradients, axis=0)

    # The short scale may stand for the whole field or for its edges: the likelihood has a mode for each.
    edges = prior.mean + np.array([-1.0, 0.0, 0.7, 0.5, 0.0, 0.0])[: len(prior.mean)]
    bounds = [(m - 6.0 * s, m + 6.0 * s) for m, s in zip(prior.mean, prior.std, strict=True)]
    modes = [
        minimize(posterior, start, jac=True, method="L-BFGS-B", bounds=bounds)
        for start in (prior.mean, edges)
    ]
    mode = min(modes, key=lambda result: result.fun)
    points, weights = _cubature(posterior, mode.x, float(mode.fun), float(prior.std.max()) ** -2)
    significant = weights >= MIN_WEIGHT
    nodes = tuple(
        Conditioned(places, values, noise, Hyperparameters(*np.exp(point)), line)
        for point in points[significant]
    )
    return GaussianProcess(nodes, weights[significant] / weights[significant].sum())


def _cubature(posterior: Posterior, mode: Array, minimum: float, flattest: float) -> tuple[Array, Array]:
    """Points (k, d) and weights (k,), the mode first; no curvature counts below the flattest, the prior's."""
    d, step = len(mode), 1e-3
    differences = [posterior(mode + step * e)[1] - posterior(mode - step * e)[1] for e in np.eye(d)]
    hessian = np.array(differences) / (2.0 * step)
    curvature, axes = eigh(0.5 * (hessian + hessian.T))
    scale = np.sqrt(1.5 * d / np.maximum(curvature, flattest))
    points = [mode]
    for i in range(d):
        points += [mode + scale[i] * axes[:, i], mode - scale[i] * axes[:, i]]
    weights = [1.0 / 3.0]
    for point in points[1:]:
        try:
            excess = posterior(point)[0] - minimum - 0.75 * d
        except LinAlgError:
            excess = np.inf
        weights.append(float(np.exp(min(0.0, -excess))) / (3.0 * d))
    return np.array(points), np.array(weights) / np.sum(weights)
