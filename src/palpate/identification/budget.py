"""The uncertainty budget of a model's parameters: the error of each by each cause.

Beside its own covariance, an answer is compared with itself: without each octave, and without each stretch of the log.
Differences beyond the covariances are added. A residual beyond the sensor's noise bounds a force that may be hidden
along the parameters' own columns.

Columns of other forces: friction, hysteresis, a stiffness that changes with the depth. Where the log has the approach,
also a force that begins at the touch (adhesion, or a surface elsewhere), and the inertia of free motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.least_squares import inverse
from palpate.identification.models import Model, Motion
from palpate.identification.octaves import Segment, Solution, System, worth
from palpate.identification.problem import Problem
from palpate.identification.uncertainty import Contribution, Contributions, half_widths
from palpate.signals.octaves import hidden_variance
from palpate.signals.samples import detrend, quadrature
from palpate.signals.types import NORMAL

_MIN_OWN_SHARE = 1e-8
"""Least fraction of a direction's information beside one stretch or the noise; below it counts as none."""


@dataclass(frozen=True)
class Spread:
    """A variance of each parameter, shape (p,), and the degrees of freedom that it was estimated with, (p,) or one."""

    variance: Array
    freedom: Array | float = np.inf

    @property
    def each(self) -> Array:
        """The degrees of freedom of each parameter, shape (p,)."""
        return np.broadcast_to(self.freedom, self.variance.shape)

    def of(self, places: list[int]) -> Spread:
        """The variances of some of the parameters."""
        return Spread(self.variance[places], self.each[places])

    def at(self, place: int) -> Contribution:
        """Contribution to the uncertainty of one parameter."""
        return Contribution(float(np.sqrt(self.variance[place])), float(self.each[place]))


Budget = dict[str, Spread]


def noise_budget(
    system: System, solution: Solution, names: tuple[str, ...], model_count: int, lag: str
) -> Budget:
    """Noise, lag, and other forces beside the model: the parts of the answer's own covariance.

    The first `model_count` parameters are the model's; `lag` is the name of the lag among them.
    """
    variance = np.diag(solution.cov)
    normal = inverse(solution.cov)
    model_variance = np.zeros(len(names))
    model_variance[:model_count] = np.diag(inverse(normal[:model_count, :model_count]))
    by_lag = np.zeros(len(names))
    if lag in names:
        lag_index = names.index(lag)
        by_lag = solution.cov[:, lag_index] ** 2 / solution.cov[lag_index, lag_index]
        by_lag[lag_index] = 0.0
    others = np.maximum(variance - model_variance, 0.0)
    noise = np.maximum(variance - by_lag - others, 0.0)
    freedom = _freedom(system, solution)
    return {
        "noise": Spread(noise, freedom),
        "lag": Spread(np.minimum(by_lag, variance)),
        "other forces": Spread(others, freedom),
    }


def _freedom(system: System, solution: Solution) -> Array:
    """Degrees of freedom of each parameter's variance, shape (p,), from the noise levels of its octaves.

    A level has one for each line of its octave, less the parameters estimated from them (Satterthwaite, 1946).
    """
    weights = system.weights(solution.noise)
    normal = weights[:, None, None] * system.columns
    parameters_in_octave = np.einsum("oij,ij->o", normal, solution.cov)
    free = np.maximum(worth(system) - parameters_in_octave, 1.0)
    variance_by_octave = np.einsum("ki,oij,kj->ok", solution.cov, normal, solution.cov)
    total = variance_by_octave.sum(axis=0)
    fractions = variance_by_octave / np.where(total > 0, total, 1.0)
    fractions = np.clip(fractions, 0.0, 1.0)
    loss = (fractions**2 / free[:, None]).sum(axis=0)
    return np.asarray(1 / np.maximum(loss, 1e-9))


def position_noise_spread(system: System, solution: Solution, noise: Array) -> Spread:
    """Bias by noise of the position, and the information that is only apparent.

    The normal equations are A + P with the prior P, and N is what the noise adds to A: products of the columns' noise
    by octave, shape (octaves, p, p). In the directions in which A + P is 1 and N is diagonal, P is p and N is s, a
    solution z has the mean (1 - p - s) of the truth and the variance 1 - p (errors in variables: Fuller, 1987, ch. 1).
    With the prior, the information about the truth is p + (1 - p - s)^2/(1 - p). Where the columns differ by little
    more than noise, as those of K and M at one frequency or of a lag and a damping, only the prior informs.
    """
    weights = system.weights(solution.noise)
    noise_normal = np.tensordot(weights, noise, axes=1)
    size = np.sqrt(np.maximum(np.diag(solution.cov), 1e-300))
    value, vector = np.linalg.eigh(solution.cov / np.outer(size, size))
    half = size[:, None] * vector * np.sqrt(np.maximum(value, 0.0))  # cov = half half^T
    noise_fraction, rotation = np.linalg.eigh(half.T @ noise_normal @ half)
    directions = half @ rotation
    prior = np.minimum(system.prior_weight @ directions**2, 1 - _MIN_OWN_SHARE)
    signal = np.maximum(1 - prior - noise_fraction, 0.0) / (1 - prior)
    known = np.maximum(prior + (1 - prior) * signal**2, _MIN_OWN_SHARE)
    normal = np.tensordot(weights, system.columns, axes=1) + np.diag(system.prior_weight)
    projections = directions.T @ normal @ (solution.theta - system.prior_mean)
    bias = directions @ ((signal / known - 1) * projections)
    return Spread(bias**2 + directions**2 @ np.maximum(1 / known - 1, 0.0))


def stretch_spread(system: System, solution: Solution) -> Spread:
    """Variance by how far each stretch of the log pulls the answer, beyond the answer's own.

    The covariance allows any correlation within a stretch (Liang and Zeger, 1986). A stretch bends the answer towards
    itself, which makes its residuals smaller: they are scaled up again. Where few stretches determine a parameter,
    there are few degrees of freedom (Bell and McCaffrey, 2002: CR2).
    """
    products = system.stretches[0]
    count = len(products)
    if count < 2:
        return Spread(np.zeros(system.size))
    weights = system.weights(solution.noise)
    summed = np.einsum("o,goij->gij", weights, products)
    normal = summed[:, :-1, :-1]
    gradient = summed[:, :-1, :] @ np.append(-solution.theta, 1.0)
    scales = np.stack([_scaling(stretch_normal, solution.cov).T for stretch_normal in normal])
    scaled = scales @ solution.cov  # from gradient to theta
    variance = (np.einsum("gi,gij->gj", gradient, scaled) ** 2).sum(axis=0)
    own_variance = np.einsum("gki,gkl,gli->gi", scaled, normal, scaled)
    cross_terms = np.einsum("gki,gkl->gil", scaled, normal)  # (g, p, p)
    correlation = np.einsum("gil,lm,him->igh", cross_terms, solution.cov, cross_terms)
    correlation = np.eye(count) * own_variance.T[:, :, None] - correlation
    trace = np.einsum("igg->i", correlation)
    square = np.einsum("igh,ihg->i", correlation, correlation)
    freedom = np.where(square > 0, trace**2 / np.maximum(square, 1e-300), count - 1.0)
    excess = np.maximum(variance - np.diag(solution.cov), 0.0)
    return Spread(excess, np.clip(freedom, 1.0, count - 1.0))


def _scaling(normal: Array, cov: Array) -> Array:
    """Scale of a stretch's influence by its normal matrix: the inverse root of I - H, shape (p, p)."""
    size = np.sqrt(np.maximum(np.diag(cov), 1e-300))
    scale = np.outer(size, size)
    value, vector = np.linalg.eigh(normal * scale)
    significant = value > 1e-10 * max(float(value[-1]), 1e-300)
    root = np.sqrt(value[significant])
    vector = vector[:, significant]
    half = vector * root
    remainder = np.eye(len(root)) - half.T @ (cov / scale) @ half
    eigenvalues, rotation = np.linalg.eigh(remainder)
    inverse_roots = 1 / np.sqrt(np.maximum(eigenvalues, _MIN_OWN_SHARE))
    inverse_roots = np.where(eigenvalues > _MIN_OWN_SHARE, inverse_roots, 0.0)
    inverse_root = rotation * inverse_roots @ rotation.T
    scaling = half @ inverse_root @ (vector / root).T
    return np.asarray(scaling * np.outer(1 / size, size))


def contradiction_spread(theta: Array, budget: Budget, other: Array, others: Budget) -> Spread:
    """Difference between an answer and one on fewer rows, beyond the 95 % interval of that difference.

    The less precise of the two has that error in addition to common ones (Hausman, 1978). Both have parameters of
    shape (p,), and a budget.
    """
    variance = sum((spread.variance for spread in budget.values()), np.zeros(len(theta)))
    other_variance = sum((spread.variance for spread in others.values()), np.zeros(len(theta)))
    half = NORMAL * np.sqrt(np.abs(other_variance - variance))
    excess = np.abs(other - theta) - half
    return Spread(np.maximum(excess, 0.0) ** 2)


def unexplained_spread(system: System, solution: Solution, sensor: Array, sensor_line_count: Array) -> Spread:
    """Possible effect of a force hidden along the parameters' columns, as large as the residual beyond the noise.

    A residual counts if chance would show it in one of twenty logs at most, in any of their octaves: a level from n
    lines has a relative standard deviation of 1/sqrt(n). The sensor's variance of a line in each octave rests on
    `sensor_line_count` lines, both of shape (octaves,).
    """
    from scipy.special import ndtri

    relative_variance = 1 / np.maximum(worth(system), 1.0) + 1 / np.maximum(sensor_line_count, 1.0)
    octave_count = max(int(np.count_nonzero(system.lines)), 1)
    limit = float(ndtri(1 - 0.05 / octave_count)) * np.sqrt(relative_variance)
    variance = hidden_variance(system.columns, solution.cov, system.lines, solution.noise, sensor, limit)
    return Spread(variance)


def white_level(level: Array, lines: Array) -> float:
    """Level of white noise: the mean of as many of the quietest octaves as differ by chance alone; 0 without lines.

    Args:
        level: variance of a line in each octave, over that of white noise of variance 1, shape (octaves,).
        lines: number of lines behind each level, shape (octaves,).

    Source: Bartlett's test of equal variances, at 95 %.
    """
    from scipy.special import chdtri

    order = np.argsort(level)
    order = order[lines[order] > 0]
    pooled = 0.0
    for size in range(len(order), 0, -1):
        levels = np.maximum(level[order[:size]], 1e-300)
        count = lines[order[:size]]
        pooled = float(levels @ count / count.sum())
        statistic = float(count.sum() * np.log(pooled) - count @ np.log(levels))
        correction = float((1 / count).sum() - 1 / count.sum())
        scale = 1 + correction / (3 * max(size - 1, 1))
        if size == 1 or statistic / scale <= float(chdtri(size - 1, 0.05)):
            break
    return pooled


FRICTION = "Fc"
TOUCH = "touch"
_BREAKAWAY_FRACTIONS = (0.03, 0.1, 0.3)
"""Displacements before friction slips, as fractions of the reach in contact, half a decade apart. Without them K took
the spring that friction is before it slips: `make trust`, surface friction."""


def effect_columns(motion: Motion, model: Model, lag: float, segments: list[Segment]) -> dict[str, Array]:
    """Columns of forces that a model lacks, by name, each of shape (m,); the lag is that of the force [s]."""
    position = motion.moved(0, lag)
    places = np.concatenate([np.arange(segment.first, segment.last) for segment in segments])
    reach = float(np.ptp(position[places])) or 1.0
    effects = _friction(motion, lag, places)
    if model.nonlinear:
        return effects
    if motion.free is not None and motion.touched is not None:
        effects[TOUCH] = motion.filtered(motion.touched, 0, lag)
        effects["free inertia"] = motion.filtered(motion.free, 2, lag)
    depth = (position - float(position[places].mean())) / reach
    effects["depth^2"] = depth**2
    effects["depth^3"] = depth**3
    effects["hysteresis"] = _in_quadrature(position, segments)
    relaxation = _relaxation(depth, motion, segments)
    if relaxation.any():
        effects["hysteresis, slow"] = relaxation
    return effects


def _friction(motion: Motion, lag: float, places: Indices) -> dict[str, Array]:
    """Columns of friction: elements that hold as springs and slip one after the other.

    In parallel they follow any curve from sticking to slipping (Iwan 1966; the Maxwell-slip model). Displacements
    shorter than the step from sample to sample are left out.
    """
    reach = float(np.ptp(motion.moved(0, 0.0)[places]))
    instants = motion.instants[places].astype(np.intp)
    steps = np.diff(motion.position, append=motion.position[-1])[instants]
    step = float(np.sqrt(np.mean(steps**2)))
    distances = (fraction * reach for fraction in _BREAKAWAY_FRACTIONS)
    slip_distances = [0.0, *(distance for distance in distances if distance >= step)]
    frictions = [motion.filtered(motion.direction(distance), 0, lag) for distance in slip_distances]
    columns = {FRICTION: frictions[-1]}
    for number, (short, long) in enumerate(pairwise(frictions)):
        difference = short - long
        if difference.any():
            columns[f"{FRICTION} {number}"] = difference
    return columns


_MIN_RELAXATION_SECONDS = 1.0
"""Shortest contact with a slow force [s]: in a tap such a force looks like a damping or a lag. Charge amplifiers and
load cells take seconds. Without this limit K of taps with an unknown lag is missed:
tests/identification/test_strangers.py, a spring that is tapped."""


def _relaxation(depth: Array, motion: Motion, segments: list[Segment]) -> Array:
    """Integral of the depth, shape (m,): the slow beginning of any relaxation or creep at a constant position.

    The surface, a creeping load cell, or an amplifier that loses its charge may cause it.
    """
    relaxation = np.zeros(len(depth))
    time = motion.instants * motion.chain.dt
    for segment in segments:
        if time[segment.last - 1] - time[segment.first] >= _MIN_RELAXATION_SECONDS:
            relaxation[segment.rows] = np.cumsum(depth[segment.rows])
    return relaxation


def _in_quadrature(position: Array, segments: list[Segment]) -> Array:
    """Force a quarter of a period ahead of the position at every frequency, shape (m,): hysteresis.

    Foam, rubber and friction lose energy so (structural damping, Myklestad 1952). At one frequency it looks like
    damping; only a loss that grows with the frequency is a B.
    """
    loss = np.zeros(len(position))
    for segment in segments:
        loss[segment.rows] = quadrature(detrend(position[segment.rows]))
    return loss


@dataclass(frozen=True)
class Prediction:
    """The force that a model predicts for a log.

    Args:
        model: that predicts.
        theta: its parameters by name.
        lag: of the force behind the position [s].
        force, residuals: predicted force, and measured minus predicted force, shape (n,).
        r2, rmse: explained fraction of the variance, and rms residual.
    """

    model: Model
    theta: dict[str, float]
    lag: float
    force: Array
    residuals: Array
    r2: float
    rmse: float

    @classmethod
    def of(
        cls, model: Model, motion: Motion, force: Array, theta: dict[str, float], lag: float
    ) -> Prediction:
        """Predict a force, shape (n,); an offset that is not among the parameters makes the mean residual zero."""
        columns = model.columns(motion, theta, lag)
        predicted = np.zeros(len(force))
        for name, column in zip(model.linear, columns, strict=True):
            predicted = predicted + theta.get(name, 0.0) * column
        if "offset" in model.linear and "offset" not in theta:
            offset = float(np.mean(force - predicted))
            theta = {**theta, "offset": offset}
            predicted = predicted + offset
        residuals = force - predicted
        rmse = float(np.sqrt(np.mean(residuals**2)))
        variance = float(np.mean((force - force.mean()) ** 2))
        r2 = 1 - rmse**2 / variance if variance else 0.0
        return cls(model, theta, lag, predicted, residuals, r2, rmse)

    def in_time(self, motion: Motion, force: Array) -> Prediction:
        """Fit the linear parameters by least squares in time, which uses motion outside all octaves too."""
        columns = np.column_stack(self.model.columns(motion, self.theta, self.lag))
        size = np.abs(columns).max(axis=0)
        size[size == 0] = 1.0
        scaled, *_ = np.linalg.lstsq(columns / size, force, rcond=1e-9)
        theta = dict(zip(self.model.linear, (scaled / size).tolist(), strict=True))
        return Prediction.of(self.model, motion, force, self.theta | theta, self.lag)

    def __getitem__(self, name: str) -> float:
        return self.theta[name]


@dataclass(frozen=True)
class FittedParameters:
    """The parameters of a model.

    Args:
        names: of the parameters, the lag last if it is not known exactly.
        theta: shape (p,).
        cov: of the mixed model, shape (p, p).
        budget: by cause.
        fit: what the model predicts with them.
        explained: fraction of the force's variance in contact that the model alone explains.
        unexplained: rms residual beyond the sensor's noise [N].
        hidden: fraction of the force's amplitude in contact that neither the model nor other forces explain.
        noise: mean square of what both channels' own noise leaves of the force [N^2].
        friction: forces whose squares add up to the mean square of what may be friction, shape (m, f) [N].
        problem: the rows that it was fitted to.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    budget: Budget
    fit: Prediction
    explained: float
    unexplained: float
    hidden: float
    noise: float
    friction: Array
    problem: Problem

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    @property
    def half(self) -> Array:
        """95 % half-widths of all causes together, shape (p,)."""
        parts = self.budget.values()
        return half_widths([part.variance for part in parts], [part.each for part in parts])

    def half_of(self, name: str) -> float:
        """95 % half-width of one parameter."""
        return float(self.half[self.names.index(name)])

    def with_cause(self, cause: str, effect: Array) -> FittedParameters:
        """Add one more cause of error: the standard deviation of each parameter by it, shape (p,)."""
        return replace(self, budget={**self.budget, cause: Spread(effect**2)})

    def through(self, jacobian: Array, theta: Array) -> FittedParameters:
        """Replace the parameters by functions of them, shape (p,), with the jacobian, shape (p, p)."""
        budget = {
            cause: Spread(np.einsum("ij,j->i", jacobian**2, part.variance), part.freedom)
            for cause, part in self.budget.items()
        }
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T, budget=budget)

    def contributions(self, name: str) -> Contributions:
        """Contribution of each cause to the uncertainty of one parameter."""
        place = self.names.index(name)
        return {cause: part.at(place) for cause, part in self.budget.items()}
