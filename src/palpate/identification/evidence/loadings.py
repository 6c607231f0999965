"""The loadings of a log: what of each contact is an advance, before and behind the filter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.estimators.octaves import Segment
from palpate.identification.filters.state_variable import ORDER, Chain
from palpate.identification.problem import Problem
from palpate.signals.samples import runs

_MET = 0.15
"""Share of the force above which its bend over the depth is looked for: the lowest that a slope is taken of."""

_FULL = 0.95
"""Share of the force at which a loading is over: what is left of it is rounding off."""

FEWEST = 6

LINE = 4
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
        top = s.first + min(int(np.argmax(own)), max(full, FEWEST))
        if top - s.first < FEWEST or depth[top] - depth[s.first] < 0.5 * reach:
            continue
        begin = s.first + int(np.argmin(depth[s.first : top]))
        if top - begin >= FEWEST:
            advance = slice(*_one_way(depth, channels[1], begin, top, reach))
            x, v, f, t = channels
            whole = Loading(x[begin:top], v[begin:top], f[begin:top], t[begin:top])
            loading = Loading(x[advance], v[advance], f[advance], t[advance], whole)
            found.append(replace(_sharpened(loading, motion.chain), read=_as_read(problem, lag, loading)))
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
    if np.count_nonzero(steps > STILL * steps.max(initial=0.0)) < LINE:
        top = begin  # a jump between readings
    return np.stack([depth, force[first : last + 1]])[:, begin:top]


def _sharpened(loading: Loading, chain: object) -> Loading:
    """The same without what the filter adds to a curve.

    The mean of a square is the square of the mean and the variance: behind a filter a force of bend c over the depth is
    larger by c times the way within the filter's memory squared, to the second order of that.
    """
    if not isinstance(chain, Chain):
        return loading
    way = (chain.delay / ORDER**0.5 * loading.speed) ** 2
    u = loading.depth - loading.depth[_met(loading)].mean()
    bend = _last(np.column_stack([np.ones(len(u)), u, u**2 + way]), loading, 1e-6)
    return replace(loading, force=loading.force - bend * way)


def _one_way(depth: Array, speed: Array, begin: int, top: int, reach: float) -> tuple[int, int]:
    """The advance without a rest that goes farthest; the whole, if none goes half of the range of all.

    A press in steps rests between them, and what the surface does meanwhile is no slope.
    """
    moves = speed[begin:top] > STILL * float(np.percentile(np.abs(speed[begin:top]), 98))
    kept = [(begin + a, begin + b) for a, b in runs(moves) if b - a >= FEWEST]
    first, last = max(kept, key=lambda run: depth[run[1] - 1] - depth[run[0]], default=(begin, top))
    return (first, last) if depth[last - 1] - depth[first] >= 0.5 * reach else (begin, top)


def _met(loading: Loading) -> Mask:
    """Rows in which the surface is met."""
    low, high = np.percentile(loading.force, [2, 98])
    rows: Mask = loading.force >= low + _MET * (high - low)
    return rows


def _last(columns: Array, loading: Loading, least: float) -> float:
    """Coefficient of the last column in the force where the surface is met; 0 for directions below a share."""
    own = columns[_met(loading)]
    size = np.sqrt((own**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(own / size, loading.force[_met(loading)], rcond=least)
    return float(theta[-1] / size[-1])


def of_speed(loading: Loading) -> float:
    """Dependence of the force on the speed over a whole loading, beside a spring that may curve [N s/m]."""
    u = loading.depth - loading.depth[_met(loading)].mean()
    return _last(np.column_stack([np.ones(len(u)), u, u**2, loading.speed]), loading, 1e-3)
