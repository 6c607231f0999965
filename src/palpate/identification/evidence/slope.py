"""The slope of the loadings: of the upper part of the force, at rest, and what contradicts it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.estimators.octaves import Segment
from palpate.identification.filters import Chain
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import Mean, random_effects
from palpate.identification.problem import Problem
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.samples import runs
from palpate.signals.types import NORMAL

_MET = 0.15
"""Share of the force above which its bend over the depth is looked for: the lowest that a slope is taken of."""
_FULL = 0.95
"""Share of the force at which a loading is over: what is left of it is rounding off."""
FEWEST = 6
_LINE = 4
"""Readings that a slope with a bend and a noise of its own needs."""
STILL = 0.02
"""Share of the highest speed below which a probe rests: encoders and loops leave a per cent or so."""


@dataclass(frozen=True)
class Loading:
    """One loading: depth [m], speed [m/s], force [N] and time [s], shape (n,).

    Args:
        whole: the same with the rests before it, if the loading was made in steps.
        read: depth and force as they were read, with an advance of their own, shape (2, k): behind a filter a loading
            is at least as long as the filter.
    """

    depth: Array
    speed: Array
    force: Array
    time: Array
    whole: Loading | None = None
    read: Array | None = None


def loadings_in(problem: Problem, lag: float, segments: list[Segment]) -> list[Loading]:
    """The loading of each contact: up to its deepest row or nearly its peak force, at least half of the range of all.

    What comes after the peak force is a hold: the probe creeps on under a constant force, or the force relaxes.
    """
    x, v, f, t = problem.motion.moved(0, lag), problem.motion.moved(1, lag), problem.force, problem.time
    found = []
    reach = max((float(np.ptp(x[s.first : s.last])) for s in segments), default=0.0)
    for s in segments:
        force = f[s.first : s.last]
        low, high = np.percentile(force, [2, 98])
        full = int(np.argmax(force >= low + _FULL * (high - low)))
        top = s.first + min(int(np.argmax(x[s.first : s.last])), max(full, FEWEST))
        if top - s.first < FEWEST or x[top] - x[s.first] < 0.5 * reach:
            continue
        begin = s.first + int(np.argmin(x[s.first : top]))
        if top - begin >= FEWEST:
            advance = slice(*_one_way(x, v, begin, top, reach))
            whole = Loading(x[begin:top], v[begin:top], f[begin:top], t[begin:top])
            loading = Loading(x[advance], v[advance], f[advance], t[advance], whole)
            found.append(replace(loading, read=_as_read(problem, lag, loading)))
    return found


def read_later(
    problem: Problem, lag: float, segments: list[Segment], loadings: list[Loading]
) -> list[Loading]:
    """The loadings with the force later by a deviation of the lag's prior; as they are, if the lag is exact."""
    return loadings_in(problem, lag + problem.lag.std, segments) if problem.lag.std > 0 else loadings


def _as_read(problem: Problem, lag: float, loading: Loading) -> Array | None:
    """Depth [m] and force [N] of the same loading before any filter, shape (2, k); None where they are not known."""
    chain, force = problem.motion.chain, problem.read
    if force is None or not isinstance(chain, Chain):
        return None
    first, last = (int(np.clip(t / chain.dt, 0, len(force) - 1)) for t in loading.time[[0, -1]])
    at = np.arange(first, last + 1) - lag / chain.dt
    depth: Array = np.interp(at, np.arange(len(force), dtype=np.float64), problem.motion.position)
    top = int(np.argmax(depth)) + 1
    begin, top = _one_way(depth, np.gradient(depth), int(np.argmin(depth[:top])), top, float(np.ptp(depth)))
    steps = np.diff(depth[begin:top])
    if np.count_nonzero(steps > STILL * steps.max(initial=0.0)) < _LINE:
        top = begin  # a jump between readings
    return np.stack([depth, force[first : last + 1]])[:, begin:top]


def _one_way(depth: Array, speed: Array, begin: int, top: int, reach: float) -> tuple[int, int]:
    """The advance without a rest that goes farthest; the whole, if none goes half of the range of all.

    A press in steps rests between them, and what the surface does meanwhile is no slope.
    """
    moves = speed[begin:top] > STILL * float(np.percentile(np.abs(speed[begin:top]), 98))
    kept = [(begin + a, begin + b) for a, b in runs(moves) if b - a >= FEWEST]
    first, last = max(kept, key=lambda run: depth[run[1] - 1] - depth[run[0]], default=(begin, top))
    return (first, last) if depth[last - 1] - depth[first] >= 0.5 * reach else (begin, top)


def _last_of(columns: Array, force: Array) -> float:
    """Coefficient of the last column in a force; nothing of directions below a thousandth of the columns."""
    size = np.sqrt((columns**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(columns / size, force, rcond=1e-3)
    return float(theta[-1] / size[-1])


_UPPER = 0.4
"""Share of the force above which a loading counts for its stiffness: below, a surface is still being met."""


def slope_in(problem: Problem, segments: list[Segment]) -> Slopes | None:
    """The slope of a log's loadings; with it what it moves by if the force is later than assumed."""
    loadings = loadings_in(problem, problem.lag.value, segments)
    return slope_between(loadings, read_later(problem, problem.lag.value, segments, loadings))


def slope_between(loadings: list[Loading], later: list[Loading]) -> Slopes | None:
    """The slope of some loadings; its interval reaches that with the force later, where the lag is not exact."""
    found = slope_of(loadings)
    other = slope_of(later) if found is not None and later is not loadings else None
    if found is None or other is None:
        return found
    by_lag = Contribution(abs(other.stiffness.value - found.stiffness.value))
    return replace(found, stiffness=found.stiffness.with_cause("lag", by_lag))


def slope_of(loadings: list[Loading]) -> Slopes | None:
    """Slope in the upper part of the force; None without a loading that rises.

    Half way between the slope as it is and the slope at rest, less what the force has of the speed: both are told, and
    the interval reaches both. It has the scatter of each loading, what it differs by from the slope of the channels as
    they were read, the change of the slope over the upper part, and the variance between loadings (a random effect,
    Student's t).
    """
    every = [own for loading in loadings if (own := _slope_in(loading)) is not None]
    if not every:
        return None
    slopes, variances, changes, filters, speeds, forces, depths, rises = np.array(every).T
    mean = random_effects(slopes, variances)
    bounds = {"curvature": changes, "filter": filters, "speed": speeds}
    found = _mean_slope(mean, bounds, len(slopes))
    at = float(forces.mean()), float(depths.mean())
    return Slopes(*at, found, tuple(slopes.tolist()), mean.next_half, float(rises.mean()))


def _mean_slope(mean: Mean, bounds: dict[str, Array], count: int) -> Measurement:
    """The mean of some slopes with its causes: bounds of each, shape (n,), and what they scatter by."""
    causes = {cause: Contribution.within(float(own.mean())) for cause, own in bounds.items()}
    causes["repetition" if count > 1 else "noise"] = Contribution(mean.std, mean.freedom)
    return Measurement(mean.value, causes)


def _slope_in(loading: Loading) -> tuple[float, ...] | None:
    """Of one loading: slope, its variance, its change; by how much filter and speed move it; force, depth, duration."""
    rows = _upper(loading.force)
    depth, force = loading.depth[rows], loading.force[rows]
    if len(rows) < FEWEST or np.ptp(depth) <= 0:
        return None
    slope, variance, change = _line(depth, force)
    at_rest = _at_rest(loading.whole or loading)
    by_filter = 0.0
    if loading.read is not None:
        by_filter = _apart(loading.read[:, _upper(loading.read[1])], slope, variance)
    rise = float(loading.time[-1] - loading.time[0])
    value, by_speed = (slope + at_rest) / 2, abs(slope - at_rest) / 2
    return value, variance, change, by_filter, by_speed, float(force.mean()), float(depth.mean()), rise


def _upper(force: Array) -> Indices:
    """All rows after the last below the upper part of the force, as a force may fall once; shape (n,) to (k,)."""
    if not len(force):
        return np.empty(0, np.intp)
    low, high = np.percentile(force, [2, 98])
    below = np.flatnonzero(force - low <= _UPPER * (high - low or 1.0))
    return np.arange(int(below[-1]) + 1 if len(below) else 0, len(force))


def _apart(read: Array, slope: float, variance: float) -> float:
    """By how much a slope contradicts that of depth and force as read, shape (2, k), beyond their 95 % interval [N/m].

    All of it, if there are too few readings for a slope of their own: the loading's shape is then the filter's.
    """
    if read.shape[1] < _LINE or np.ptp(read[0]) <= 0:
        return abs(slope)
    own, doubt, _ = _line(*read)
    return max(abs(own - slope) - NORMAL * float(np.sqrt(max(variance + doubt, 0.0))), 0.0)


@dataclass(frozen=True)
class Drag:
    """Force over speed [N s/m] and its 95 % half-width: a damping as a tangent needs it."""

    value: float
    half: float

    @classmethod
    def up_to(cls, most: float) -> Drag:
        """From nothing to that [N s/m]."""
        return cls(most / 2, abs(most) / 2)


def tangent_at(
    problem: Problem, lag: float, loadings: list[Loading], force: float, within: float, drag: Drag | None
) -> Measurement | None:
    """Slope of force over depth in loading at a force [N], less the drag, of the rows within so much of it [N].

    Of each contact by the advance through that force that goes farthest. Where the drag is not known, the interval
    reaches from the slope as it is to that less what the loading shows of the speed. None where no advance goes through
    the force.
    """
    every = []
    for loading in loadings:
        whole = loading.whole or loading
        advance = _advance_through(whole, force)
        if advance is None:
            continue
        own = replace(advance, read=_as_read(problem, lag, advance))
        every.append(_tangent_in(own, force, within, drag or Drag.up_to(_of_speed(whole))))
    found = [own for own in every if own is not None]
    if not found:
        return None
    slopes, variances, changes, filters, speeds = np.array(found).T
    bounds = {"curvature": changes, "filter": filters, "speed": speeds}
    return _mean_slope(random_effects(slopes, variances), bounds, len(slopes))


def _advance_through(whole: Loading, force: float) -> Loading | None:
    """The advance without a rest through a force [N] that goes farthest; None if there is none."""
    moves = whole.speed > STILL * float(np.percentile(np.abs(whole.speed), 98))
    through = [
        (a, b) for a, b in runs(moves) if b - a >= FEWEST and whole.force[a] <= force <= whole.force[b - 1]
    ]
    if not through:
        return None
    first, last = max(through, key=lambda run: whole.depth[run[1] - 1] - whole.depth[run[0]])
    rows = slice(first, last)
    return Loading(whole.depth[rows], whole.speed[rows], whole.force[rows], whole.time[rows])


def _tangent_in(advance: Loading, force: float, within: float, drag: Drag) -> tuple[float, ...] | None:
    """Of one advance: slope at a force, its variance, its change; by how much filter and speed move it."""
    rows = np.flatnonzero(np.abs(advance.force - force) < within)
    depth = advance.depth[rows]
    if len(rows) < FEWEST or np.ptp(depth) <= 0:
        return None
    curve = Parabola.of(depth, advance.force[rows])
    at = curve.where(force)
    slope, variance = curve.slope_at(at)
    nearer = rows[np.abs(advance.force[rows] - force) < within / 2]
    if len(nearer) < FEWEST:
        change = curve.change
    else:
        half = Parabola.of(advance.depth[nearer], advance.force[nearer])
        change = abs(half.slope_at(half.where(force))[0] - slope)
    by_filter = 0.0
    if advance.read is not None:
        by_filter = _apart(advance.read[:, np.abs(advance.read[1] - force) < within], slope, variance)
    turn = Parabola.of(depth, advance.speed[rows]).slope_at(at)[0]
    return slope - drag.value * turn, variance, change, by_filter, drag.half * abs(turn)


def unseen(problem: Problem) -> float:
    """How far a stiffness may be off, relative, because the touch lies in a jump of the position between readings.

    Of the range g / (R - g), where no reading was taken in the part g of it; as far as the stiffness rests on the two
    sides of the jump rather than on what moves on either: by the share of the position's variance between them.
    """
    position = np.sort(problem.motion.position[problem.in_contact])
    gaps = np.diff(position)
    if not gaps.any():
        return 0.0
    below, above = np.split(position, [int(np.argmax(gaps)) + 1])
    gap = max(float(gaps.max()) - problem.motion.noise.count, 0.0)
    apart = len(below) * len(above) * float(above.mean() - below.mean()) ** 2 / len(position) ** 2
    rest = max(float(np.ptp(position)) - gap, 1e-3 * gap)
    return apart / float(position.var()) * gap / rest if rest else 0.0


@dataclass(frozen=True)
class Parabola:
    """Force over depth in least squares: of u, the depth from its middle [m] over its reach [m], to the second power.

    Args:
        middle, reach: mean and range of the depth [m].
        theta: coefficients [N], shape (3,), of 1, u and u^2 less its mean.
        square: the mean of u^2.
        cov: of the coefficients, under coloured noise, shape (3, 3).
    """

    middle: float
    reach: float
    theta: Array
    square: float
    cov: Array

    @classmethod
    def of(cls, depth: Array, force: Array) -> Parabola:
        """Through some points, each of shape (n,)."""
        middle, reach = float(depth.mean()), float(np.ptp(depth))
        u = (depth - middle) / reach
        square = float((u**2).mean())
        columns = np.column_stack([np.ones_like(u), u, u**2 - square])
        theta = np.asarray(np.linalg.lstsq(columns, force, rcond=None)[0], np.float64)
        noise = noise_of(force - columns @ theta, np.arange(len(force)), 3)
        gram = np.asarray(np.linalg.pinv(columns.T @ columns), np.float64)
        scale = noise.variance * len(force) / max(noise.effective, 4.0)
        return cls(middle, reach, theta, square, scale * gram)

    @property
    def change(self) -> float:
        """Half of what the slope changes by over the range [N/m]."""
        return abs(float(self.theta[2])) / self.reach

    def where(self, force: float) -> float:
        """Depth of a force, over the reach from the middle: the root next to that of the line, within the range."""
        offset, slope, bend = self.theta - np.array([force + self.theta[2] * self.square, 0.0, 0.0])
        root = np.sqrt(max(slope**2 - 4 * bend * offset, 0.0))
        return float(np.clip(-2 * offset / (slope + np.copysign(root, slope) or np.inf), -1.0, 1.0))

    def slope_at(self, u: float) -> tuple[float, float]:
        """Slope [N/m] and its variance at a depth over the reach from the middle."""
        gradient = np.array([0.0, 1.0, 2 * u]) / self.reach
        return float(gradient @ self.theta), float(gradient @ self.cov @ gradient)


def _line(depth: Array, force: Array) -> tuple[float, float, float]:
    """Slope in the middle, its variance under coloured noise, and half of what it changes by over the range."""
    curve = Parabola.of(depth, force)
    return *curve.slope_at(0.0), curve.change


def _at_rest(loading: Loading) -> float:
    """Slope of the upper part less what the force has of the speed.

    Of the whole loading: within one advance that dies out the speed is the depth over again, and only rests between
    advances tell the two apart.
    """
    rows = _upper(loading.force)
    columns = np.column_stack([np.ones(len(rows)), loading.speed[rows], loading.depth[rows]])
    return _last_of(columns, loading.force[rows])


def _of_speed(loading: Loading) -> float:
    """Dependence of the force on the speed over a whole loading, beside a spring that may curve [N s/m]."""
    low, high = np.percentile(loading.force, [2, 98])
    met = loading.force >= low + _MET * (high - low)
    u = loading.depth - loading.depth[met].mean()
    return _last_of(np.column_stack([np.ones(len(u)), u, u**2, loading.speed])[met], loading.force[met])
