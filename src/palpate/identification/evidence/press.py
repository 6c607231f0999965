"""The press: force over depth on the way in and out, its tangent, the work that is lost, and what a hold relaxes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.identification.estimators.budget import NORMAL
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.work import way_out
from palpate.identification.filters.state_variable import ORDER, Chain
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.result import Press, Relaxation, Tangent

UPPER = 0.4
"""Share of the force above which a way in counts for its stiffness: below, a surface is still being met."""
_MET = 0.15
"""Share of the force above which its bend over the depth is looked for: the lowest that a slope is taken of."""
_LEVELS = (0.3, 0.5, 0.7, 0.9)
_WIDE = 0.15
_FULL = 0.95
"""Share of the force at which a way in is over: what is left of it is rounding off."""
_FEWEST = 6
_LINE = 4
"""Readings that a slope with a bend and a noise of its own needs."""
_STILL = 0.02
"""Share of the highest speed below which a probe rests: encoders and loops leave a per cent or so."""
_SHOWN = 400


@dataclass(frozen=True)
class Stroke:
    """One way in: depth [m], speed [m/s], force [N] and time [s], shape (n,).

    Args:
        whole: the same with the rests before it, if the way in was made in steps.
        read: depth and force as they were read, with an advance of their own, shape (2, k): behind a filter a way in is
            as long as the filter at least.
    """

    depth: Array
    speed: Array
    force: Array
    time: Array
    whole: Stroke | None = None
    read: Array | None = None


@dataclass(frozen=True)
class Slope:
    """Slope of the upper part of all ways in.

    Args:
        stiffness, half: [N/m].
        rise: mean duration of a way in [s].
        each: slope of each way in [N/m].
        budget: half-width by cause [N/m]; their squares add up.
        force, depth: where it is, the means of the upper part [N], [m].
    """

    stiffness: float
    half: float
    rise: float
    each: tuple[float, ...]
    budget: dict[str, float]
    force: float
    depth: float


def strokes_in(problem: Problem, lag: float, segments: list[Segment]) -> list[Stroke]:
    """The way in of each contact: up to its deepest row or nearly its peak force, at least half of the range of all.

    What comes after the peak force is a hold: the probe creeps on under a constant force, or the force relaxes.
    """
    motion = problem.motion
    channels = (motion.moved(0, lag), motion.moved(1, lag), problem.force, problem.time)
    depth = channels[0]
    found = []
    reach = max((float(np.ptp(depth[s.first : s.last])) for s in segments), default=0.0)
    for s in segments:
        own = depth[s.first : s.last]
        force = problem.force[s.first : s.last]
        low, high = np.percentile(force, [2, 98])
        full = int(np.argmax(force >= low + _FULL * (high - low)))
        top = s.first + min(int(np.argmax(own)), max(full, _FEWEST))
        if top - s.first < _FEWEST or depth[top] - depth[s.first] < 0.5 * reach:
            continue
        begin = s.first + int(np.argmin(depth[s.first : top]))
        if top - begin >= _FEWEST:
            advance = slice(*_one_way(depth, channels[1], begin, top, reach))
            x, v, f, t = channels
            whole = Stroke(x[begin:top], v[begin:top], f[begin:top], t[begin:top])
            stroke = Stroke(x[advance], v[advance], f[advance], t[advance], whole)
            found.append(replace(_sharpened(stroke, motion.chain), read=_as_read(problem, lag, stroke)))
    return found


def _as_read(problem: Problem, lag: float, stroke: Stroke) -> Array | None:
    """Depth [m] and force [N] of the same way in before any filter, shape (2, k); None where they are not known."""
    chain, force = problem.motion.chain, problem.read
    if force is None or not isinstance(chain, Chain):
        return None
    first, last = (int(np.clip(t / chain.dt, 0, len(force) - 1)) for t in stroke.time[[0, -1]])
    at = np.arange(first, last + 1) - lag / chain.dt
    depth: Array = np.interp(at, np.arange(len(force), dtype=np.float64), problem.motion.position)
    top = int(np.argmax(depth)) + 1
    begin, top = _one_way(depth, np.gradient(depth), int(np.argmin(depth[:top])), top, float(np.ptp(depth)))
    steps = np.diff(depth[begin:top])
    if np.count_nonzero(steps > _STILL * steps.max(initial=0.0)) < _LINE:
        top = begin  # a jump between readings
    return np.stack([depth, force[first : last + 1]])[:, begin:top]


def _sharpened(stroke: Stroke, chain: object) -> Stroke:
    """The same without what the filter adds to a curve.

    The mean of a square is the square of the mean and the variance: behind a filter a force of bend c over the depth is
    larger by c times the way within the filter's memory squared, to the second order of that.
    """
    if not isinstance(chain, Chain):
        return stroke
    way = (chain.delay / ORDER**0.5 * stroke.speed) ** 2
    u = stroke.depth - stroke.depth[_met(stroke)].mean()
    bend = _last(np.column_stack([np.ones(len(u)), u, u**2 + way]), stroke, 1e-6)
    return replace(stroke, force=stroke.force - bend * way)


def _one_way(depth: Array, speed: Array, begin: int, top: int, reach: float) -> tuple[int, int]:
    """The advance without a rest that goes farthest; the whole, if none goes half of the range of all.

    A press in steps rests between them, and what the surface does meanwhile is no slope.
    """
    moves = speed[begin:top] > _STILL * float(np.percentile(np.abs(speed[begin:top]), 98))
    edges = np.diff(np.r_[0, moves.astype(np.int8), 0])
    runs = zip(np.flatnonzero(edges > 0) + begin, np.flatnonzero(edges < 0) + begin, strict=True)
    kept = [(int(a), int(b)) for a, b in runs if b - a >= _FEWEST]
    first, last = max(kept, key=lambda run: depth[run[1] - 1] - depth[run[0]], default=(begin, top))
    return (first, last) if depth[last - 1] - depth[first] >= 0.5 * reach else (begin, top)


def _met(stroke: Stroke) -> Mask:
    """Rows in which the surface is met."""
    low, high = np.percentile(stroke.force, [2, 98])
    rows: Mask = stroke.force >= low + _MET * (high - low)
    return rows


def _last(columns: Array, stroke: Stroke, least: float) -> float:
    """Coefficient of the last column in the force where the surface is met; 0 for directions below a share."""
    own = columns[_met(stroke)]
    size = np.sqrt((own**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(own / size, stroke.force[_met(stroke)], rcond=least)
    return float(theta[-1] / size[-1])


def slope_in(problem: Problem, segments: list[Segment]) -> Slope | None:
    """The slope of a log's ways in; with it what it moves by if the force is later than assumed.

    Args:
        problem: of the log.
        segments: of its rows.
    """
    strokes = strokes_in(problem, problem.lag.value, segments)
    return _slope(strokes, _later(problem, problem.lag.value, segments, strokes))


def _later(problem: Problem, lag: float, segments: list[Segment], strokes: list[Stroke]) -> list[Stroke]:
    """The ways in with the force later by a deviation of the lag's prior; as they are, if the lag is exact."""
    return strokes_in(problem, lag + problem.lag.std, segments) if problem.lag.std > 0 else strokes


def _slope(strokes: list[Stroke], later: list[Stroke]) -> Slope | None:
    found = slope_of(strokes)
    other = slope_of(later) if found is not None and later is not strokes else None
    if found is None or other is None:
        return found
    by_lag = NORMAL * abs(other.stiffness - found.stiffness)
    return replace(found, half=float(np.hypot(found.half, by_lag)), budget=found.budget | {"lag": by_lag})


def slope_of(strokes: list[Stroke]) -> Slope | None:
    """Slope in the upper part of the force; None without a way in that rises.

    Half way between the slope as it is and the slope at rest, less what the force has of the speed: both are told, and
    the interval reaches both. Beyond them it has the scatter of each way in, the change of the slope over the range,
    what it differs by from the slope of the channels as they were read, and the variance between ways in (a random
    effect, Student's t).
    """
    slopes, variances, rises, changes, speeds, filters, levels = [], [], [], [], [], [], []
    for stroke in strokes:
        rows = _upper(stroke.force)
        if len(rows) < _FEWEST or np.ptp(stroke.depth[rows]) <= 0:
            continue
        slope, variance, change = _line(stroke.depth[rows], stroke.force[rows])
        at_rest = _at_rest(stroke.whole or stroke)
        slopes.append((slope + at_rest) / 2)
        variances.append(variance)
        changes.append(change)
        speeds.append(abs(slope - at_rest) / 2)
        filters.append(_by_filter(stroke, slope, variance))
        rises.append(float(stroke.time[-1] - stroke.time[0]))
        levels.append((stroke.force[rows].mean(), stroke.depth[rows].mean()))
    if not slopes:
        return None
    mean = random_effects(np.array(slopes), np.array(variances))
    curvature, reach, by_filter = (float(np.mean(own)) for own in (changes, speeds, filters))
    others = float(np.sqrt(mean.half**2 + curvature**2 + by_filter**2))
    causes = {
        "repetition" if len(slopes) > 1 else "noise": mean.half,
        "curvature": curvature,
        "filter": by_filter,
        "speed": float(np.sqrt((others + reach) ** 2 - others**2)),
    }
    where = (float(own) for own in np.mean(levels, axis=0))
    return Slope(mean.value, others + reach, float(np.mean(rises)), tuple(slopes), causes, *where)


def _upper(force: Array) -> NDArray[np.intp]:
    """Rows of a way in after the last that was below the share: a force may fall before it rises for good."""
    low, high = np.percentile(force, [2, 98])
    below = np.flatnonzero(force <= low + UPPER * (high - low))
    return np.arange(int(below[-1]) + 1 if len(below) else 0, len(force))


def _by_filter(stroke: Stroke, slope: float, variance: float) -> float:
    """By how much a slope contradicts that of the same way in before any filter [N/m]: beyond their 95 % interval.

    All of it, if the way in has too few readings for a slope of its own: its shape is then the filter's.
    """
    if stroke.read is None:
        return 0.0
    depth, force = stroke.read
    if len(depth) < _LINE:
        return abs(slope)
    return _apart(depth, force, _upper(force), slope, variance)


def _apart(depth: Array, force: Array, rows: NDArray[np.intp], slope: float, variance: float) -> float:
    """By how much a slope contradicts that of some readings [N/m]; all of it, if they are too few for one."""
    if len(rows) < _LINE or np.ptp(depth[rows]) <= 0:
        return abs(slope)
    own, doubt, _ = _line(depth[rows], force[rows])
    return max(abs(own - slope) - NORMAL * float(np.sqrt(max(variance + doubt, 0.0))), 0.0)


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


def _line(x: Array, f: Array) -> tuple[float, float, float]:
    """Slope, its variance under coloured noise, and half of what the slope changes by over the range."""
    middle, reach = float(x.mean()), float(np.ptp(x))
    u = (x - middle) / reach
    columns = np.column_stack([np.ones_like(u), u, u**2 - (u**2).mean()])
    theta, *_ = np.linalg.lstsq(columns, f, rcond=None)
    left = f - columns @ theta
    noise = noise_of(left, np.arange(len(f)), 3)
    gram = np.linalg.pinv(columns.T @ columns)
    variance = noise.variance * len(f) / max(noise.effective, 4.0) * np.diag(gram)
    curve = abs(float(theta[2]))
    return float(theta[1] / reach), float(variance[1] / reach**2), curve / reach


def _at_rest(stroke: Stroke) -> float:
    """Slope of the upper part less what the force has of the speed.

    Of the whole way in: within one advance that dies out the speed is the depth over again, and only rests between
    advances tell the two apart.
    """
    rows = _upper(stroke.force)
    columns = np.column_stack([np.ones(len(rows)), stroke.depth[rows], stroke.speed[rows]])
    size = np.sqrt((columns**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(columns / size, stroke.force[rows], rcond=1e-3)
    return float(theta[1] / size[1])


def press_of(problem: Problem, lag: float, segments: list[Segment]) -> Press | None:
    """The press of a log; None without a way in."""
    strokes = strokes_in(problem, lag, segments)
    if not strokes:
        return None
    loading = max(strokes, key=lambda stroke: len(stroke.depth))
    later = _later(problem, lag, segments, strokes)
    tangent = [t for level in _LEVELS if (t := _tangent(strokes, later, level)) is not None]
    back = way_out(problem, lag, segments)
    return Press(
        tuple(t for t in tangent if t.half < abs(t.stiffness)),
        _thin(loading.depth, loading.force),
        _thin(*back.curve),
        back.loss,
        _relaxation(problem, lag, segments, _slope(strokes, later)),
        back.late,
    )


def _tangent(strokes: list[Stroke], later: list[Stroke], level: float) -> Tangent | None:
    """Slope of the ways in about a share of the force; with it what it moves by if the force is later than assumed.

    Args:
        strokes: the ways in.
        later: the same, the force later by a deviation of the lag's prior.
        level: the share.
    """
    found, other = _tangent_of(strokes, level), _tangent_of(later, level)
    if found is None or other is None:
        return None
    by_lag = NORMAL * (other.stiffness - found.stiffness)
    return replace(found, half=float(np.hypot(found.half, by_lag)))


def _tangent_of(strokes: list[Stroke], level: float) -> Tangent | None:
    slopes, variances, forces, by_speed, by_filter = [], [], [], [], []
    for stroke in strokes:
        loss = _of_speed(stroke)
        low, high = np.percentile(stroke.force, [2, 98])
        rows = _about(stroke.force, low, high, level)
        if len(rows) < _FEWEST or np.ptp(stroke.depth[rows]) <= 0:
            continue
        slope, variance, _ = _line(stroke.depth[rows], stroke.force[rows])
        at_rest, *_ = _line(stroke.depth[rows], stroke.force[rows] - loss * stroke.speed[rows])
        slopes.append((slope + at_rest) / 2)
        variances.append(variance)
        by_speed.append((slope - at_rest) / 2)
        forces.append(float(low + level * (high - low)))
        if stroke.read is not None:
            depth, force = stroke.read
            by_filter.append(_apart(depth, force, _about(force, low, high, level), slope, variance))
    if not slopes:
        return None
    mean = random_effects(np.array(slopes), np.array(variances))
    others = np.mean(by_speed), np.mean(by_filter) if by_filter else 0.0
    return Tangent(
        float(np.mean(forces)), mean.value, float(np.sqrt(mean.half**2 + sum(o**2 for o in others)))
    )


def _about(force: Array, low: float, high: float, level: float) -> NDArray[np.intp]:
    """Rows about a share of the force between two ends."""
    return np.flatnonzero(np.abs((force - low) / (high - low or 1.0) - level) < _WIDE)


def _of_speed(stroke: Stroke) -> float:
    """What the force has of the speed over a whole way in, beside a spring that may curve [N s/m]."""
    u = stroke.depth - stroke.depth[_met(stroke)].mean()
    return _last(np.column_stack([np.ones(len(u)), u, u**2, stroke.speed]), stroke, 1e-3)


def _relaxation(
    problem: Problem, lag: float, segments: list[Segment], slope: Slope | None
) -> Relaxation | None:
    """Of the longest hold after a way in, what the position gives back by its slope left aside."""
    depth = problem.motion.moved(0, lag)
    speed, force, time = problem.motion.moved(1, lag), problem.force, problem.time
    still = np.abs(speed) < _STILL * float(np.percentile(np.abs(speed), 98))
    best: tuple[int, int] | None = None
    for s in segments:
        edges = np.diff(np.r_[0, still[s.first : s.last].astype(np.int8), 0])
        for a, b in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
            if b - a >= 4 * _FEWEST and a > 0 and (best is None or b - a > best[1] - best[0]):
                best = (s.first + int(a), s.first + int(b))
    if best is None:
        return None
    rows = slice(*best)
    moved = depth[rows] - depth[best[1] - 1]
    given, doubt = (0.0 * moved, 0.0) if slope is None else (slope.stiffness * moved, slope.half)
    return _relaxed(force[rows] - given, doubt * float(np.ptp(moved)), time[rows])


def _relaxed(force: Array, doubt: float, time: Array) -> Relaxation | None:
    """What a force loses in a hold, as one that only falls; None if that is within its noise and doubt.

    Args:
        force: less what the position gives back meanwhile, shape (n,) [N].
        doubt: what is not known of that [N].
        time: shape (n,) [s].
    """
    from scipy.optimize import isotonic_regression

    falls = np.asarray(isotonic_regression(force, increasing=False).x)
    noise = noise_of(force - falls, np.arange(len(force)), 2)
    few = max(len(force) // 20, 2)
    begin, end = float(np.median(falls[:few])), float(np.median(falls[-few:]))
    least = np.hypot(2 * np.sqrt(2 * noise.variance * len(force) / noise.effective / few), doubt)
    if begin <= 0 or begin - end <= least:
        return None
    half = int(np.argmax(falls <= (begin + end) / 2))
    return Relaxation((begin - end) / begin, float(time[half] - time[0]), float(time[-1] - time[0]))


def _thin(x: Array, f: Array) -> Array:
    step = max(len(x) // _SHOWN, 1)
    return np.stack([x[::step], f[::step]])
