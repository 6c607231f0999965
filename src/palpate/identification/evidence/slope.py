"""The slope of the loadings: of the upper part of the force, at rest, and what contradicts it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Indices
from palpate.identification.estimators.octaves import Segment
from palpate.identification.filters import Chain
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.steady_press import NEAR, Slopes
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


def slope_between(loadings: list[Loading], later: list[Loading], level: float | None = None) -> Slopes | None:
    """The slope of some loadings; its interval reaches that with the force later, where the lag is not exact."""
    found = slope_of(loadings, level)
    other = slope_of(later, level) if found is not None and later is not loadings else None
    if found is None or other is None:
        return found
    by_lag = Contribution(abs(other.stiffness.value - found.stiffness.value))
    return replace(found, stiffness=found.stiffness.with_cause("lag", by_lag))


def slope_of(loadings: list[Loading], level: float | None = None) -> Slopes | None:
    """Slope in the upper part of the force, or about a share of it (`level`); None without a loading that rises.

    Half way between the slope as it is and the slope at rest, less what the force has of the speed: both are told, and
    the interval reaches both. It has the scatter of each loading, what it differs by from the slope of the channels as
    they were read, and the variance between loadings (a random effect, Student's t); of the upper part, the change of
    the slope over it.
    """
    every = [own for loading in loadings if (own := _slope_in(loading, level)) is not None]
    if not every:
        return None
    slopes, variances, changes, filters, speeds, forces, depths, rises = np.array(every).T
    mean = random_effects(slopes, variances)
    bounds = zip(("curvature", "filter", "speed"), (changes, filters, speeds), strict=True)
    causes = {cause: Contribution.within(float(own.mean())) for cause, own in bounds}
    if level is not None:
        del causes["curvature"]
    causes["repetition" if len(slopes) > 1 else "noise"] = Contribution(mean.std, mean.freedom)
    at, found = (float(forces.mean()), float(depths.mean())), Measurement(mean.value, causes)
    return Slopes(*at, found, tuple(slopes.tolist()), mean.next_half, float(rises.mean()))


def _slope_in(loading: Loading, level: float | None) -> tuple[float, ...] | None:
    """Of one loading: slope, its variance, its change; by how much filter and speed move it; force, depth, duration."""
    rows = _rows(loading.force, level)
    depth, force = loading.depth[rows], loading.force[rows]
    if len(rows) < FEWEST or np.ptp(depth) <= 0:
        return None
    slope, variance, change = _line(depth, force)
    if level is None:
        at_rest, at = _at_rest(loading.whole or loading), float(force.mean())
    else:
        at_rest, *_ = _line(depth, force - _of_speed(loading) * loading.speed[rows])
        low, high = np.percentile(loading.force, [2, 98])
        at = float(low + level * (high - low))
    by_filter = 0.0 if loading.read is None else _apart(loading.read, level, slope, variance)
    rise = float(loading.time[-1] - loading.time[0])
    value, by_speed = (slope + at_rest) / 2, abs(slope - at_rest) / 2
    return value, variance, change, by_filter, by_speed, at, float(depth.mean()), rise


def _rows(force: Array, level: float | None) -> Indices:
    """Rows about a share of the force; or all after the last below the upper part, as a force may fall once."""
    low, high = np.percentile(force, [2, 98])
    share = (force - low) / (high - low or 1.0)
    if level is not None:
        return np.flatnonzero(np.abs(share - level) < NEAR)
    below = np.flatnonzero(share <= _UPPER)
    return np.arange(int(below[-1]) + 1 if len(below) else 0, len(force))


def _apart(read: Array, level: float | None, slope: float, variance: float) -> float:
    """By how much a slope contradicts that of the channels as read [N/m], beyond their 95 % interval.

    All of it, if there are too few readings for a slope of their own: the loading's shape is then the filter's.
    """
    depth, force = read
    rows = _rows(force, level) if len(force) else np.empty(0, np.intp)
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


def _at_rest(loading: Loading) -> float:
    """Slope of the upper part less what the force has of the speed.

    Of the whole loading: within one advance that dies out the speed is the depth over again, and only rests between
    advances tell the two apart.
    """
    rows = _rows(loading.force, None)
    columns = np.column_stack([np.ones(len(rows)), loading.speed[rows], loading.depth[rows]])
    return _last_of(columns, loading.force[rows])


def _of_speed(loading: Loading) -> float:
    """Dependence of the force on the speed over a whole loading, beside a spring that may curve [N s/m]."""
    low, high = np.percentile(loading.force, [2, 98])
    met = loading.force >= low + _MET * (high - low)
    u = loading.depth - loading.depth[met].mean()
    return _last_of(np.column_stack([np.ones(len(u)), u, u**2, loading.speed])[met], loading.force[met])
