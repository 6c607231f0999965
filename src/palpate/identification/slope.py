"""The slope of the loadings: of the upper part of the force, at rest, and what contradicts it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.filters import Chain
from palpate.identification.least_squares import estimate_noise
from palpate.identification.pooling import Mean, random_effects
from palpate.identification.problem import Problem
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.samples import runs
from palpate.signals.types import NORMAL

_MIN_BEND_FORCE = 0.15
"""Fraction of the force above which its curvature over the depth is fitted."""
_LOADING_END = 0.95
"""Fraction of the force at which a loading ends; beyond it the press slows down."""
MIN_LOADING_ROWS = 6
_MIN_LINE_READINGS = 4
"""Readings that a slope with a bend and a noise of its own needs."""
REST_SPEED_RATIO = 0.02
"""Fraction of the highest speed below which a probe rests: encoders and loops leave about one per cent."""


@dataclass(frozen=True)
class Loading:
    """One loading: depth [m], speed [m/s], force [N] and time [s], shape (n,).

    Args:
        whole: the loading with the rests before it, if it was made in steps.
        read: unfiltered depth and force of their own advance, shape (2, k), because a filtered loading is at least as
            long as the filter.
    """

    depth: Array
    speed: Array
    force: Array
    time: Array
    whole: Loading | None = None
    read: Array | None = None

    def part(self, rows: slice) -> Loading:
        """The loading at some rows only."""
        return Loading(self.depth[rows], self.speed[rows], self.force[rows], self.time[rows])


def loadings_in(problem: Problem, lag: float) -> list[Loading]:
    """The loading of each contact: up to its deepest row or nearly its peak force, at least half of the largest range.

    A hold follows the peak force: the probe creeps on under a constant force, or the force relaxes.
    """
    depth = problem.motion.moved(0, lag)
    speed = problem.motion.moved(1, lag)
    log = Loading(depth, speed, problem.force, problem.time)
    reach = max((float(np.ptp(depth[segment.rows])) for segment in problem.segments), default=0.0)
    loadings = []
    for segment in problem.segments:
        first = segment.first
        force = problem.force[segment.rows]
        low, high = np.percentile(force, [2, 98])
        full = int(np.argmax(force >= low + _LOADING_END * (high - low)))
        deepest = int(np.argmax(depth[segment.rows]))
        top = first + min(deepest, max(full, MIN_LOADING_ROWS))
        if top - first < MIN_LOADING_ROWS or depth[top] - depth[first] < 0.5 * reach:
            continue
        begin = first + int(np.argmin(depth[first:top]))
        if top - begin >= MIN_LOADING_ROWS:
            advance = slice(*_longest_advance(depth, speed, begin, top, reach))
            loading = replace(log.part(advance), whole=log.part(slice(begin, top)))
            loadings.append(replace(loading, read=_as_read(problem, lag, loading)))
    return loadings


def loadings_read_later(problem: Problem, loadings: list[Loading]) -> list[Loading]:
    """The loadings with the lag larger by its standard deviation; the same list if the lag is exact."""
    lag = problem.lag
    return loadings_in(problem, lag.value + lag.std) if lag.std > 0 else loadings


def _as_read(problem: Problem, lag: float, loading: Loading) -> Array | None:
    """Unfiltered depth [m] and force [N] of a loading, shape (2, k); None if they are not known."""
    chain = problem.motion.chain
    force = problem.read
    if force is None or not isinstance(chain, Chain):
        return None
    ends = np.clip(loading.time[[0, -1]] / chain.dt, 0, len(force) - 1)
    first, last = (int(end) for end in ends)
    rows = np.arange(len(force), dtype=np.float64)
    positions_read = np.arange(first, last + 1) - lag / chain.dt
    depth: Array = np.interp(positions_read, rows, problem.motion.position)
    top = int(np.argmax(depth)) + 1
    begin = int(np.argmin(depth[:top]))
    reach = float(np.ptp(depth))
    begin, top = _longest_advance(depth, np.gradient(depth), begin, top, reach)
    steps = np.diff(depth[begin:top])
    if np.count_nonzero(steps > REST_SPEED_RATIO * steps.max(initial=0.0)) < _MIN_LINE_READINGS:
        top = begin  # a jump between readings
    return np.stack([depth, force[first : last + 1]])[:, begin:top]


def _longest_advance(depth: Array, speed: Array, begin: int, top: int, reach: float) -> tuple[int, int]:
    """The longest advance without a rest; all rows, if none goes half of the reach.

    A press in steps rests between them, and the relaxation meanwhile is no slope.
    """
    advances = [(begin + first, begin + last) for first, last in _advances(speed[begin:top])]
    if not advances:
        return begin, top
    lengths = [depth[last - 1] - depth[first] for first, last in advances]
    longest = int(np.argmax(lengths))
    return advances[longest] if lengths[longest] >= 0.5 * reach else (begin, top)


def _advances(speed: Array) -> list[tuple[int, int]]:
    """First and past-the-last row of each advance without a rest."""
    moves = speed > REST_SPEED_RATIO * float(np.percentile(np.abs(speed), 98))
    return [(first, last) for first, last in runs(moves) if last - first >= MIN_LOADING_ROWS]


def _last_coefficient(columns: Array, force: Array) -> float:
    """Coefficient of the last column in a force; directions below a thousandth of the columns are left out."""
    size = np.sqrt((columns**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(columns / size, force, rcond=1e-3)
    return float(theta[-1] / size[-1])


_UPPER_FORCE = 0.4
"""Fraction of the force above which the slope is fitted; below it the contact area is still growing."""


def slope_in(problem: Problem) -> Slopes | None:
    """The slope of a log's loadings, and its change if the lag is larger than assumed."""
    loadings = loadings_in(problem, problem.lag.value)
    return slope_between(loadings, loadings_read_later(problem, loadings))


def slope_between(loadings: list[Loading], later: list[Loading]) -> Slopes | None:
    """The slope of some loadings; its interval includes the slope with a larger lag, where the lag is not exact."""
    slope = upper_slope(loadings)
    later_slope = upper_slope(later) if slope is not None and later is not loadings else None
    if slope is None or later_slope is None:
        return slope
    by_lag = Contribution(abs(later_slope.stiffness.value - slope.stiffness.value))
    return replace(slope, stiffness=slope.stiffness.with_cause("lag", by_lag))


def upper_slope(loadings: list[Loading]) -> Slopes | None:
    """Slope in the upper part of the force; None without a loading that rises.

    The value is the mean of the slope and the slope without the effect of the speed; the interval reaches both. It
    includes the scatter of each loading, the difference from the unfiltered slope, the change of the slope over the
    upper part, and the variance between loadings (a random effect, Student's t).
    """
    estimates = [slope for slope in map(_slope_in, loadings) if slope is not None]
    if not estimates:
        return None
    slopes, variances, changes, filters, speeds, forces, depths, rises = np.array(estimates).T
    mean = random_effects(slopes, variances)
    bounds = {"curvature": changes, "filter": filters, "speed": speeds}
    measurement = _mean_slope(mean, bounds, len(slopes))
    return Slopes(
        force=float(forces.mean()),
        depth=float(depths.mean()),
        stiffness=measurement,
        each=tuple(slopes.tolist()),
        again=mean.next_half,
        rise=float(rises.mean()),
    )


def _mean_slope(mean: Mean, bounds: dict[str, Array], count: int) -> Measurement:
    """The mean of some slopes with its causes: bounds of each slope, shape (n,), and their scatter."""
    causes = {cause: Contribution.within(float(halves.mean())) for cause, halves in bounds.items()}
    causes["repetition" if count > 1 else "noise"] = Contribution(mean.std, mean.freedom)
    return Measurement(mean.value, causes)


def _slope_in(loading: Loading) -> tuple[float, ...] | None:
    """Slope of one loading, its variance and change, effects of filter and speed, force, depth and duration."""
    rows = _upper_rows(loading.force)
    depth = loading.depth[rows]
    force = loading.force[rows]
    if len(rows) < MIN_LOADING_ROWS or np.ptp(depth) <= 0:
        return None
    slope, variance, change = _line(depth, force)
    at_rest = _slope_at_rest(loading.whole or loading)
    by_filter = 0.0
    if loading.read is not None:
        upper = loading.read[:, _upper_rows(loading.read[1])]
        by_filter = _contradiction(upper, slope, variance)
    rise = float(loading.time[-1] - loading.time[0])
    value = (slope + at_rest) / 2
    by_speed = abs(slope - at_rest) / 2
    return value, variance, change, by_filter, by_speed, float(force.mean()), float(depth.mean()), rise


def _upper_rows(force: Array) -> Indices:
    """Rows after the last one below the upper part of the force, shape (k,); the force has the shape (n,)."""
    if not len(force):
        return np.empty(0, np.intp)
    low, high = np.percentile(force, [2, 98])
    below = np.flatnonzero(force - low <= _UPPER_FORCE * (high - low or 1.0))
    first = int(below[-1]) + 1 if len(below) else 0
    return np.arange(first, len(force))


def _contradiction(read: Array, slope: float, variance: float) -> float:
    """Difference between a slope and the slope of unfiltered channels, shape (2, k), beyond their 95 % interval [N/m].

    With too few readings for a slope of their own it is the whole slope, because the filter then shapes the loading.
    """
    if read.shape[1] < _MIN_LINE_READINGS or np.ptp(read[0]) <= 0:
        return abs(slope)
    read_slope, read_variance, _ = _line(*read)
    half = NORMAL * float(np.sqrt(max(variance + read_variance, 0.0)))
    return max(abs(read_slope - slope) - half, 0.0)


@dataclass(frozen=True)
class Drag:
    """Force over speed [N s/m] and its 95 % half-width: a damping as a tangent needs it."""

    value: float
    half: float

    @classmethod
    def up_to(cls, damping: float) -> Drag:
        """A damping between 0 and the given one [N s/m]."""
        return cls(damping / 2, abs(damping) / 2)


def tangent_at(
    problem: Problem, lag: float, loadings: list[Loading], force: float, within: float, drag: Drag | None
) -> Measurement | None:
    """Slope of force over depth in loading at a force [N], less the drag, from rows `within` a distance of it [N].

    Each contact counts by its longest advance through that force. If the drag is unknown, the interval reaches from the
    slope to the slope without the effect of the speed. None if no advance goes through the force.
    """
    estimates = []
    for loading in loadings:
        whole = loading.whole or loading
        advance = _advance_through(whole, force)
        if advance is None:
            continue
        advance = replace(advance, read=_as_read(problem, lag, advance))
        damping = drag or Drag.up_to(_speed_dependence(whole))
        tangent = _tangent_in(advance, force, within, damping)
        if tangent is not None:
            estimates.append(tangent)
    if not estimates:
        return None
    slopes, variances, changes, filters, speeds = np.array(estimates).T
    bounds = {"curvature": changes, "filter": filters, "speed": speeds}
    return _mean_slope(random_effects(slopes, variances), bounds, len(slopes))


def _advance_through(whole: Loading, force: float) -> Loading | None:
    """The longest advance without a rest through a force [N]; None if there is none."""
    through = [
        whole.part(slice(first, last))
        for first, last in _advances(whole.speed)
        if whole.force[first] <= force <= whole.force[last - 1]
    ]
    return max(through, key=lambda advance: advance.depth[-1] - advance.depth[0], default=None)


def _tangent_in(advance: Loading, force: float, within: float, drag: Drag) -> tuple[float, ...] | None:
    """Slope of one advance at a force, its variance and change, and the effects of filter and speed."""
    rows = np.flatnonzero(np.abs(advance.force - force) < within)
    depth = advance.depth[rows]
    if len(rows) < MIN_LOADING_ROWS or np.ptp(depth) <= 0:
        return None
    curve = Parabola.of(depth, advance.force[rows])
    place = curve.where(force)
    slope, variance = curve.slope_at(place)
    nearer = rows[np.abs(advance.force[rows] - force) < within / 2]
    if len(nearer) < MIN_LOADING_ROWS:
        change = curve.change
    else:
        nearer_curve = Parabola.of(advance.depth[nearer], advance.force[nearer])
        nearer_slope, _ = nearer_curve.slope_at(nearer_curve.where(force))
        change = abs(nearer_slope - slope)
    by_filter = 0.0
    if advance.read is not None:
        is_near = np.abs(advance.read[1] - force) < within
        by_filter = _contradiction(advance.read[:, is_near], slope, variance)
    speed_slope = Parabola.of(depth, advance.speed[rows]).slope_at(place)[0]
    return slope - drag.value * speed_slope, variance, change, by_filter, drag.half * abs(speed_slope)


def ripple_error(problem: Problem) -> Contribution | None:
    """Error of a slope that the removed ripple may leave, the largest of all loadings; None without a ripple."""
    ripple = problem.contacts.ripple
    if ripple is None:
        return None
    loadings = loadings_in(problem, problem.lag.value)
    upper = (loading.part(slice(_upper_rows(loading.force)[0], None)) for loading in loadings)
    return Contribution(max((ripple.slope_std(part.time, part.depth) for part in upper), default=0.0))


def jump_uncertainty(problem: Problem) -> float:
    """Relative error of a stiffness because the touch lies in a jump of the position between readings.

    With a jump g in the range R it is g / (R - g), times the fraction of the position's variance between both sides of
    the jump, on which the stiffness rests.
    """
    position = np.sort(problem.motion.position[problem.in_contact])
    gaps = np.diff(position)
    if not gaps.any():
        return 0.0
    below, above = np.split(position, [int(np.argmax(gaps)) + 1])
    gap = max(float(gaps.max()) - problem.motion.noise.count, 0.0)
    distance = float(above.mean() - below.mean())
    variance_between = len(below) * len(above) * distance**2 / len(position) ** 2
    travel = max(float(np.ptp(position)) - gap, 1e-3 * gap)
    if not travel:
        return 0.0
    return variance_between / float(position.var()) * gap / travel


@dataclass(frozen=True)
class Parabola:
    """Least-squares parabola of force over u, the depth from its middle [m] over its reach [m].

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
        """Fit some points, each of shape (n,)."""
        middle = float(depth.mean())
        reach = float(np.ptp(depth))
        u = (depth - middle) / reach
        square = float((u**2).mean())
        columns = np.column_stack([np.ones_like(u), u, u**2 - square])
        theta = np.asarray(np.linalg.lstsq(columns, force, rcond=None)[0], np.float64)
        noise = estimate_noise(force - columns @ theta, np.arange(len(force)), 3)
        gram = np.asarray(np.linalg.pinv(columns.T @ columns), np.float64)
        scale = noise.variance * len(force) / max(noise.effective, 4.0)
        return cls(middle, reach, theta, square, scale * gram)

    @property
    def change(self) -> float:
        """Half of the change of the slope over the range [N/m]."""
        return abs(float(self.theta[2])) / self.reach

    def where(self, force: float) -> float:
        """Depth of a force, over the reach from the middle: the root next to that of the line, within the range."""
        mean, slope, curvature = self.theta
        offset = mean - (force + curvature * self.square)
        root = np.sqrt(max(slope**2 - 4 * curvature * offset, 0.0))
        divisor = slope + np.copysign(root, slope) or np.inf
        return float(np.clip(-2 * offset / divisor, -1.0, 1.0))

    def slope_at(self, u: float) -> tuple[float, float]:
        """Slope [N/m] and its variance at a depth over the reach from the middle."""
        gradient = np.array([0.0, 1.0, 2 * u]) / self.reach
        slope = float(gradient @ self.theta)
        return slope, float(gradient @ self.cov @ gradient)


def _line(depth: Array, force: Array) -> tuple[float, float, float]:
    """Slope in the middle, its variance under coloured noise, and half of its change over the range."""
    curve = Parabola.of(depth, force)
    return *curve.slope_at(0.0), curve.change


def _slope_at_rest(loading: Loading) -> float:
    """Slope of the upper part without the effect of the speed.

    It needs the whole loading: within one advance that dies out the speed is proportional to the depth, and only rests
    between advances separate the two.
    """
    rows = _upper_rows(loading.force)
    columns = np.column_stack([np.ones(len(rows)), loading.speed[rows], loading.depth[rows]])
    return _last_coefficient(columns, loading.force[rows])


def _speed_dependence(loading: Loading) -> float:
    """Dependence of the force on the speed over a whole loading, beside a spring that may curve [N s/m]."""
    low, high = np.percentile(loading.force, [2, 98])
    in_contact = loading.force >= low + _MIN_BEND_FORCE * (high - low)
    depth_from_mean = loading.depth - loading.depth[in_contact].mean()
    return _last_coefficient(
        np.column_stack([np.ones(len(depth_from_mean)), depth_from_mean, depth_from_mean**2, loading.speed])[
            in_contact
        ],
        loading.force[in_contact],
    )
