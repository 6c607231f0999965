"""A model's parameters, and how far each may be off, cause by cause: the interval that holds whatever the model.

Beside its own covariance, an answer is held against itself: with each octave left out, and with each stretch of the
log left out. What these differ by beyond their covariances is added. What no part can tell is bounded by what the
model leaves: a force beyond the sensor's noise that is there in an octave may as well be hidden along the parameters'
own columns.

Friction, hysteresis, a stiffness that goes with depth; where the log holds the approach, a force that is there at once
with the touch (adhesion, or a surface that is met elsewhere), and the inertia of what moves before it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.estimators.octaves import Segment, Solution, System, worth
from palpate.identification.least_squares import inverse
from palpate.identification.models import Model, Motion
from palpate.identification.problem import Problem
from palpate.identification.uncertainty import Contribution, Contributions, half_widths
from palpate.signals.samples import detrend, quadrature
from palpate.signals.types import NORMAL

HIDDEN_SHARE = 0.5
"""Share of the unexplained amplitude of an octave that may lie along a parameter's own column: of a force in an
unknown phase, in phase and in quadrature, half of the power is along either. `make trust` measures the coverage that
follows."""
_ALONE = 1e-8
"""Share of a direction that is told by other than one stretch, or by other than noise: below it, by nothing else."""


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
        """Of some of the parameters."""
        return Spread(self.variance[places], self.each[places])

    def at(self, place: int) -> Contribution:
        """Contribution to the uncertainty of one parameter."""
        return Contribution(float(np.sqrt(self.variance[place])), float(self.each[place]))


Budget = dict[str, Spread]


def of_noise(system: System, solution: Solution, names: tuple[str, ...], own: int, lag: str) -> Budget:
    """Noise, lag, and other forces beside the model: the parts of the answer's own covariance.

    Of the parameters, the first `own` are the model's; `lag` is the name of the lag among them.
    """
    whole = np.diag(solution.cov)
    normal = inverse(solution.cov)
    alone = np.zeros(len(names))
    alone[:own] = np.diag(inverse(normal[:own, :own]))
    by_lag = np.zeros(len(names))
    if lag in names:
        i = names.index(lag)
        by_lag = solution.cov[:, i] ** 2 / solution.cov[i, i]
        by_lag[i] = 0.0
    others = np.maximum(whole - alone, 0.0)
    noise = np.maximum(whole - by_lag - others, 0.0)
    freedom = _freedom(system, solution)
    return {
        "noise": Spread(noise, freedom),
        "lag": Spread(np.minimum(by_lag, whole)),
        "other forces": Spread(others, freedom),
    }


def _freedom(system: System, solution: Solution) -> Array:
    """Degrees of freedom of each parameter's variance, shape (p,): of the noise levels of the octaves that it rests on.

    Each level has as many as its octave has lines that no parameter takes (Satterthwaite, 1946).
    """
    weight = np.where(system.lines > 0, 1 / solution.noise, 0.0)
    normal = weight[:, None, None] * system.products[:, :-1, :-1]
    used = np.einsum("oij,ij->o", normal, solution.cov)
    free = np.maximum(worth(system) - used, 1.0)
    rests = np.einsum("ki,oij,kj->ok", solution.cov, normal, solution.cov)
    whole = rests.sum(axis=0)
    share = np.clip(rests / np.where(whole > 0, whole, 1.0), 0.0, 1.0)
    return np.asarray(1 / np.maximum((share**2 / free[:, None]).sum(axis=0), 1e-9))


def of_position_noise(system: System, solution: Solution, noise: Array) -> Spread:
    """Bias by noise of the position, and the information that is only apparent.

    The normal equations are A + P with the prior P, and N is what the noise adds to A: products of the columns' noise
    by octave, shape (octaves, p, p). In the directions in which A + P is 1 and N is diagonal, P is p and N is s, a
    solution z has the mean (1 - p - s) of the truth and the variance 1 - p (errors in variables: Fuller, 1987, ch. 1).
    With the prior the truth has so the information p + (1 - p - s)^2/(1 - p): what the columns tell by little more than
    their noise, as K from M at one frequency or a lag from a damping, only the prior tells.
    """
    weight = np.where(system.lines > 0, 1 / solution.noise, 0.0)
    added = np.tensordot(weight, noise, axes=1)
    size = np.sqrt(np.maximum(np.diag(solution.cov), 1e-300))
    value, vector = np.linalg.eigh(solution.cov / np.outer(size, size))
    half = size[:, None] * vector * np.sqrt(np.maximum(value, 0.0))  # cov = half half^T
    share, turn = np.linalg.eigh(half.T @ added @ half)
    own = half @ turn
    prior = np.minimum(system.prior_weight @ own**2, 1 - _ALONE)
    told = np.maximum(1 - prior - share, 0.0) / (1 - prior)
    known = np.maximum(prior + (1 - prior) * told**2, _ALONE)
    normal = np.tensordot(weight, system.products[:, :-1, :-1], axes=1) + np.diag(system.prior_weight)
    pulled = own @ ((told / known - 1) * (own.T @ normal @ (solution.theta - system.prior_mean)))
    return Spread(pulled**2 + own**2 @ np.maximum(1 / known - 1, 0.0))


def of_stretches(system: System, solution: Solution) -> Spread:
    """Variance by how far each stretch of the log pulls the answer, beyond the answer's own.

    The covariance that holds for stretches of any correlation within (Liang and Zeger, 1986). What an answer is bent by
    one stretch, that stretch does not show: its residuals are scaled by how much they were so made smaller, and where
    few stretches have what tells a parameter, there are few degrees of freedom (Bell and McCaffrey, 2002: CR2).
    """
    products = system.stretches[0]
    count = len(products)
    if count < 2:
        return Spread(np.zeros(system.size))
    weight = np.where(system.lines > 0, 1 / solution.noise, 0.0)
    summed = np.einsum("o,goij->gij", weight, products)
    normal, pull = summed[:, :-1, :-1], summed[:, :-1, :] @ np.append(-solution.theta, 1.0)
    scaled = np.stack([_scaling(own, solution.cov).T for own in normal]) @ solution.cov  # from pull to theta
    variance = (np.einsum("gi,gij->gj", pull, scaled) ** 2).sum(axis=0)
    seen = np.einsum("gki,gkl,gli->gi", scaled, normal, scaled)
    crossed = np.einsum("gki,gkl->gil", scaled, normal)  # (g, p, p)
    tied = np.einsum("gil,lm,him->igh", crossed, solution.cov, crossed)
    tied = np.eye(count) * seen.T[:, :, None] - tied
    trace, square = np.einsum("igg->i", tied), np.einsum("igh,ihg->i", tied, tied)
    freedom = np.where(square > 0, trace**2 / np.maximum(square, 1e-300), count - 1.0)
    return Spread(np.maximum(variance - np.diag(solution.cov), 0.0), np.clip(freedom, 1.0, count - 1.0))


def _scaling(normal: Array, cov: Array) -> Array:
    """Scale of a stretch's influence with such a normal matrix: the inverse root of I - H, shape (p, p)."""
    size = np.sqrt(np.maximum(np.diag(cov), 1e-300))
    own = normal * np.outer(size, size)
    value, vector = np.linalg.eigh(own)
    kept = value > 1e-10 * max(float(value[-1]), 1e-300)
    root, vector = np.sqrt(value[kept]), vector[:, kept]
    half = vector * root
    left = np.eye(len(root)) - half.T @ (cov / np.outer(size, size)) @ half
    less, turn = np.linalg.eigh(left)
    scale = turn * np.where(less > _ALONE, 1 / np.sqrt(np.maximum(less, _ALONE)), 0.0) @ turn.T
    return np.asarray((half @ scale @ (vector / root).T) * np.outer(1 / size, size))


def of_another(theta: Array, budget: Budget, other: Array, others: Budget) -> Spread:
    """By how much an answer contradicts one that rests on fewer rows: beyond their difference's 95 % interval.

    The less precise of the two errs by the difference beside what both err by (Hausman, 1978). Both have parameters of
    shape (p,), and a budget.
    """
    own, less = (sum((part.variance for part in b.values()), np.zeros(len(theta))) for b in (budget, others))
    apart = np.abs(other - theta) - NORMAL * np.sqrt(np.abs(less - own))
    return Spread(np.maximum(apart, 0.0) ** 2)


def of_unexplained(system: System, solution: Solution, sensor: Array, told: Array) -> Spread:
    """Possible effect of a force hidden along the parameters' columns, as large as the residual beyond the noise.

    Seen is what chance would show in one of twenty logs at most, in any of their octaves: a level that n lines tell has
    a relative deviation of 1/sqrt(n). The variance of a line by the sensor's own noise in each octave rests on the
    lines `told`, both of shape (octaves,).
    """
    from scipy.special import ndtri

    apart = 1 / np.maximum(worth(system), 1.0) + 1 / np.maximum(told, 1.0)
    beyond = solution.noise - sensor
    chance = float(ndtri(1 - 0.05 / max(int(np.count_nonzero(system.lines)), 1)))
    beyond = np.where(beyond > chance * np.sqrt(apart) * sensor, beyond, 0.0)
    gain = np.einsum("ki,oij,kj->ok", solution.cov, system.products[:, :-1, :-1], solution.cov)
    weight = np.where(system.lines > 0, system.lines * (beyond / solution.noise) / solution.noise, 0.0)
    return Spread(HIDDEN_SHARE**2 * np.maximum(weight @ gain, 0.0))


def white_level(level: Array, lines: Array) -> float:
    """Level of white noise: that of as many of the quietest octaves as differ by chance alone.

    Of the variance of a line in each octave, over that of white noise of variance 1, and the lines that each rests on,
    shape (octaves,); one is not 0 at least.

    Source: Bartlett's test of equal variances, at 95 %.
    """
    from scipy.special import chdtri

    order = np.argsort(level)
    order = order[lines[order] > 0]
    for last in range(len(order), 0, -1):
        own, count = np.maximum(level[order[:last]], 1e-300), lines[order[:last]]
        pooled = float(own @ count / count.sum())
        apart = float(count.sum() * np.log(pooled) - count @ np.log(own))
        scale = 1 + float((1 / count).sum() - 1 / count.sum()) / (3 * max(last - 1, 1))
        if last == 1 or apart / scale <= float(chdtri(last - 1, 0.05)):
            break
    return pooled


FRICTION = "Fc"
TOUCH = "touch"
_BREAKAWAY = (0.03, 0.1, 0.3)
"""Ways that friction turns within, of the reach in contact, half a decade apart from the longest that is no matter of
the stiffness on. Without them K took the spring that friction is before it slips: `make trust`, surface friction."""


def effect_columns(motion: Motion, model: Model, lag: float, segments: list[Segment]) -> dict[str, Array]:
    """Columns by name, each of shape (m,), of what a model has not got itself; the lag is that of the force [s]."""
    x = motion.moved(0, lag)
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    reach = float(np.ptp(x[inside])) or 1.0
    found = _friction(motion, lag, inside)
    if model.nonlinear:
        return found
    if motion.free is not None and motion.touched is not None:
        found[TOUCH] = motion.filtered(motion.touched, 0, lag)
        found["free inertia"] = motion.filtered(motion.free, 2, lag)
    depth = (x - float(x[inside].mean())) / reach
    shapes = {"depth^2": depth**2, "depth^3": depth**3, "hysteresis": _in_quadrature(x, segments)}
    slow = _relaxation(depth, motion, segments)
    return found | shapes | ({"hysteresis, slow": slow} if slow.any() else {})


def _friction(motion: Motion, lag: float, inside: Indices) -> dict[str, Array]:
    """Friction, and what of it turns within a shorter way: elements that hold as springs and slip one after the other.

    Side by side they follow any curve from sticking to slipping (Iwan 1966; the Maxwell-slip model). What the probe
    passes from one sample to the next is not seen to turn.
    """
    reach = float(np.ptp(motion.moved(0, 0.0)[inside]))
    at = motion.instants[inside].astype(np.intp)
    step = float(np.sqrt(np.mean(np.diff(motion.position, append=motion.position[-1])[at] ** 2)))
    ways = (0.0, *(way * reach for way in _BREAKAWAY if way * reach >= step))
    turned = [motion.filtered(motion.direction(way), 0, lag) for way in ways]
    sooner = {f"{FRICTION} {i}": short - long for i, (short, long) in enumerate(pairwise(turned))}
    return {FRICTION: turned[-1]} | {name: column for name, column in sooner.items() if column.any()}


_SLOW = 1.0
"""Shortest contact with a slow force [s]: in a tap it is no other than its damping, or a lag. Amplifiers of charge and
load cells take seconds and more. Without it K of taps behind an unknown lag is missed: tests/identification/
test_strangers.py, a spring that is tapped."""


def _relaxation(x: Array, motion: Motion, segments: list[Segment]) -> Array:
    """A force that goes on under a position that stays, shape (m,): the slow beginning of any relaxation or creep.

    Of the surface, or of a load cell that creeps or whose amplifier lets its charge go.
    """
    found, time = np.zeros(len(x)), motion.instants * motion.chain.dt
    for s in segments:
        if time[s.last - 1] - time[s.first] >= _SLOW:
            found[s.first : s.last] = np.cumsum(x[s.first : s.last])
    return found


def _in_quadrature(x: Array, segments: list[Segment]) -> Array:
    """A force a quarter of a period ahead of the position at every frequency, shape (m,): the loss goes with the way.

    Foam, rubber and friction lose so; over one frequency it is no other than damping (structural damping, Myklestad
    1952), and only a loss that grows with the frequency is a B.
    """
    found = np.zeros(len(x))
    for s in segments:
        found[s.first : s.last] = quadrature(detrend(x[s.first : s.last]))
    return found


@dataclass(frozen=True)
class Prediction:
    """The force that a model predicts for a log.

    Args:
        model: which.
        theta: its parameters by name.
        lag: of the force behind the position [s].
        force, residuals: predicted, and what it leaves of the measured one, shape (n,).
        r2, rmse: share of the variance that it explains, and rms of what it leaves.
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
        """By a model, of a force, shape (n,); an offset that is not among the parameters is that of the mean."""
        columns = model.columns(motion, theta, lag)
        predicted = sum(
            (theta.get(n, 0.0) * c for n, c in zip(model.linear, columns, strict=True)), np.zeros(len(force))
        )
        if "offset" in model.linear and "offset" not in theta:
            offset = float(np.mean(force - predicted))
            theta, predicted = {**theta, "offset": offset}, predicted + offset
        residuals = force - predicted
        rmse = float(np.sqrt(np.mean(residuals**2)))
        spread = float(np.mean((force - force.mean()) ** 2))
        return cls(model, theta, lag, predicted, residuals, 1 - rmse**2 / spread if spread else 0.0, rmse)

    def in_time(self, motion: Motion, force: Array) -> Prediction:
        """The same model, its linear parameters by least squares in time, which see a motion that no octave has."""
        columns = np.column_stack(self.model.columns(motion, self.theta, self.lag))
        size = np.abs(columns).max(axis=0)
        scaled, *_ = np.linalg.lstsq(columns / np.where(size > 0, size, 1.0), force, rcond=1e-9)
        theta = dict(zip(self.model.linear, (scaled / np.where(size > 0, size, 1.0)).tolist(), strict=True))
        return Prediction.of(self.model, motion, force, self.theta | theta, self.lag)

    def __getitem__(self, name: str) -> float:
        return self.theta[name]


@dataclass(frozen=True)
class Answer:
    """The parameters of a model.

    Args:
        names: of the parameters, the lag last if it is not known exactly.
        theta: shape (p,).
        cov: of the mixed model, shape (p, p).
        budget: by cause.
        fit: what the model predicts with them.
        explained: share of the force's variance in contact that the model alone accounts for.
        unexplained: rms of what is left beyond the sensor's noise [N].
        hidden: share of the force's amplitude in contact that the other forces beside the model do not explain either.
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
        """The same of one parameter."""
        return float(self.half[self.names.index(name)])

    def with_cause(self, cause: str, effect: Array) -> Answer:
        """The same with one more cause of error: the standard deviation of each parameter by it, shape (p,)."""
        return replace(self, budget={**self.budget, cause: Spread(effect**2)})

    def through(self, jacobian: Array, theta: Array) -> Answer:
        """Functions of the parameters instead, shape (p,): covariance and budget through their derivatives, (p, p)."""
        budget = {
            cause: Spread(np.einsum("ij,j->i", jacobian**2, part.variance), part.freedom)
            for cause, part in self.budget.items()
        }
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T, budget=budget)

    def contributions(self, name: str) -> Contributions:
        """Contribution of each cause to the uncertainty of one parameter."""
        place = self.names.index(name)
        return {cause: part.at(place) for cause, part in self.budget.items()}
