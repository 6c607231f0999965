"""Tangents of a press at constant speed: the slope of force over position at one force, with its noise's interval.

In a window about that force the force is a smooth curve of the position. How bent it is, the log tells: curves of
several degrees are averaged by Akaike's weights, with the variance between them (Burnham and Anderson, Model selection
and multimodel inference, 2002, sec. 4.3). So curvature is in the curve, and of an error only what the noise leaves
open. A lag of the force moves it along the curve: where the speed changes, it changes the slope by that change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from palpate.arrays import Array
from palpate.identification.free_motion import Drift
from palpate.identification.least_squares import noise_of
from palpate.identification.options import Lag
from palpate.identification.pooling import random_effects
from palpate.identification.sampling import Channels
from palpate.identification.strokes import Stroke
from palpate.identification.uncertainty import Contribution, Measurement

WINDOW = (0.35, 0.97)
"""Shares of a stroke's force about the tangent that is named: below, a surface is still being met."""
LEVELS = (0.3, 0.5, 0.9)
"""Shares of the force whose tangents are listed beside it."""
_WIDE = 0.2
"""Half of the share of the force about these."""
_MOST, _FEWEST = 96, 12
"""Blocks in a window."""
_FOLLOWED = 0.5
"""Share of a stroke's force that a smooth curve of the position follows, of a contact."""
_SHOWN = 400
"""Points of a curve that are kept at most, to be drawn."""
_DEGREES = (2, 4, 6, 8)
"""Of the curves that are averaged: an odd degree moves the slope in the middle as the even one above it does."""


@dataclass(frozen=True)
class Curve:
    """Depth and force of one stroke, in the order of the depth, both counted into the surface.

    Args:
        time, depth, force: shape (n,) [s], [m], [N].
        drift: what was removed from the force, shape (n,) [N].
        loads: whether it is a loading.
        readings: fresh ones of the slower channel in a row, one at most.
    """

    time: Array
    depth: Array
    force: Array
    drift: Array
    loads: bool
    readings: float

    @property
    def reach(self) -> tuple[float, float]:
        """Lowest and highest force, outliers left aside [N]."""
        low, high = np.percentile(self.force, [1, 99])
        return float(low), float(high)


@dataclass(frozen=True)
class Slopes:
    """Stiffness of some loadings, or of an octave, and where it is.

    Args:
        force, depth: where it is [N], [m].
        stiffness: mean of the loadings [N/m].
        each: slope of each [N/m].
        again: 95 % half-width for one more; None for fewer than three [N/m].
        rise: mean duration of one [s]; of an octave, a quarter of a period.
        explained: least share of a stroke's force that its curve follows.
    """

    force: float
    depth: float
    stiffness: Measurement
    each: tuple[float, ...]
    again: float | None
    rise: float
    explained: float = 1.0


@dataclass(frozen=True)
class SteadyPress:
    """A press at constant speed.

    Args:
        headline: tangent in the middle of the upper part of the force.
        others: tangents at other forces.
        loading, unloading: depth [m] and force [N] of the longest of each, shape (2, n); empty where there is none.
    """

    headline: Slopes
    others: tuple[Slopes, ...]
    loading: Array
    unloading: Array


def steady_press(
    channels: Channels,
    strokes: Sequence[Stroke],
    signs: tuple[float, float],
    rest: float,
    lag: Lag,
    drift: Drift | None = None,
) -> SteadyPress | None:
    """The press of a log's strokes; None where the force does not follow them.

    The tangents are of the loadings; of the unloadings, where the log has no other stroke.

    Args:
        channels: as logged.
        strokes: of the log.
        signs: of position and force, to multiply the channels with.
        rest: the force out of contact, after the sign [N].
        lag: prior of the lag.
        drift: of the force, which was removed from the channels.
    """
    curves = curves_of(channels, strokes, signs, drift)
    named = [own for own in curves if own.loads] or curves
    headline = slopes_at(named, WINDOW, lag, rest)
    if headline is None or headline.explained < _FOLLOWED or not headline.stiffness.known_to(1.0):
        return None
    windows = [(level - _WIDE, min(level + _WIDE, 1.0)) for level in LEVELS]
    others = [own for window in windows if (own := slopes_at(named, window, lag, rest)) is not None]
    known = tuple(own for own in others if own.stiffness.known_to(1.0))
    pairs = [[own for own in curves if own.loads is loads] for loads in (True, False)]
    return SteadyPress(headline, known, *(_draw(own) for own in pairs))


def _draw(curves: Sequence[Curve]) -> Array:
    if not curves:
        return np.empty((2, 0))
    curve = max(curves, key=lambda own: own.reach[1] - own.reach[0])
    step = max(len(curve.depth) // _SHOWN, 1)
    return np.stack([curve.depth, curve.force])[:, ::step]


def curves_of(
    channels: Channels, strokes: Sequence[Stroke], signs: tuple[float, float], drift: Drift | None
) -> list[Curve]:
    """The strokes through more than half of the force's range."""
    curves = []
    for stroke in strokes:
        rows = stroke.rows(channels)
        there = np.flatnonzero(channels.valid[rows]) + rows.start
        if len(there) >= 2 * _FEWEST:
            position, force = signs[0] * channels.position[there], signs[1] * channels.force[there]
            ends = [float(np.median(own)) for own in np.array_split(force, 5)]
            time = channels.time[there]
            gone = np.zeros(len(time)) if drift is None else np.interp(time, drift.times, drift.levels)
            curves.append(
                Curve(time, position, force, gone, ends[-1] > ends[0], min(channels.rate * channels.dt, 1.0))
            )
    whole = max((own.reach[1] - own.reach[0] for own in curves), default=0.0)
    return [own for own in curves if own.reach[1] - own.reach[0] > whole / 2]


def slopes_at(
    curves: Sequence[Curve], shares: tuple[float, float], lag: Lag, rest: float = 0.0
) -> Slopes | None:
    """The tangent in the middle of a window of the force that all curves pass; None if it is too short.

    Where strokes differ by more than their noise, the variance between them is in the interval.

    Args:
        curves: of one direction.
        shares: of the force that they have in common, between which the window lies.
        lag: prior of the lag.
        rest: the force out of contact [N].
    """
    low, high = max(own.reach[0] for own in curves), min(own.reach[1] for own in curves)
    ends = low + shares[0] * (high - low), low + shares[1] * (high - low)
    windows = [own for curve in curves if (own := _within(curve, *ends)) is not None]
    if not windows or high <= low:
        return None
    level = float(np.mean([chebyshev.chebval(0.0, _fit(own, 2)) for own in windows]))
    every = [_tangent(own, level) for own in windows]
    values, variances, bends, drifts, depths, follows = (np.array(part) for part in zip(*every, strict=True))
    mean = random_effects(values, variances)
    n, weight = len(values), 1 / np.maximum(variances + mean.between**2, 1e-300)
    weight /= weight.sum()
    noise, differ = float(np.sqrt(weight**2 @ variances)), mean.between * float(np.sqrt(weight @ weight))
    share = differ**2 / max(
        noise**2 + differ**2, 1e-300
    )  # Satterthwaite: the noise is known, the differences by n - 1
    freedom = (n - 1) / share**2 if share else np.inf
    bend = float(weight @ bends)
    value = float(weight @ values) * (1 + lag.value * bend)
    drift = float(weight @ np.abs(drifts))  # known where the probe is free, not in between
    parts = {
        "repetition": Contribution(differ, freedom),
        "noise": Contribution(noise, freedom),
        "lag": Contribution(lag.std * abs(value * bend)),
        "other forces": Contribution.within(drift),
    }
    rise = float(np.mean([own.time[-1] - own.time[0] for own in curves]))
    return Slopes(
        level - rest, float(weight @ depths), Measurement(value, parts), tuple(values.tolist()), mean.next_half,
        rise, float(follows.min()),
    )  # fmt: skip


@dataclass(frozen=True)
class _Window:
    """Block means of a stroke about a force, the depth scaled to -1 to 1."""

    time: Array
    scaled: Array
    force: Array
    drift: Array
    middle: float
    reach: float


def _within(curve: Curve, low: float, high: float) -> _Window | None:
    """The unbroken part of a stroke between its first and last crossing of two forces, as block means."""
    force = curve.force if curve.loads else curve.force[::-1]
    first = int(np.argmax(force > low))
    above = np.flatnonzero(force > high)
    last = int(above[0]) if len(above) else len(force)
    count = min(_MOST, int((last - first) * curve.readings))  # rows between two readings tell nothing more
    if count < _FEWEST:
        return None
    rows = slice(first, last) if curve.loads else slice(len(force) - last, len(force) - first)
    edges = np.linspace(0, last - first, count + 1).astype(np.intp)
    parts = curve.time, curve.depth, curve.force, curve.drift
    time, x, f, gone = (np.add.reduceat(part[rows], edges[:-1]) / np.diff(edges) for part in parts)
    middle, reach = float(x.max() + x.min()) / 2, float(np.ptp(x)) / 2
    return _Window(time, (x - middle) / reach, f, gone, middle, reach) if reach > 0 else None


def _fit(window: _Window, degree: int) -> Array:
    return np.asarray(chebyshev.chebfit(window.scaled, window.force, degree), np.float64)


def _tangent(window: _Window, level: float) -> tuple[float, ...]:
    """The slope of a window at a force.

    Returns:
        Slope [N/m] and its variance; relative change of the speed [1/s]; part of the slope that a removed drift would
        be [N/m]; depth [m]; share of the force that the curve follows.
    """
    degrees = [own for own in _DEGREES if own == _DEGREES[0] or 4 * own < len(window.force)]
    fine = np.linspace(-1, 1, 201)
    curve = chebyshev.chebval(fine, _fit(window, degrees[min(1, len(degrees) - 1)]))
    at = float(fine[int(np.argmin(np.abs(curve - level)))])
    left = window.force - chebyshev.chebval(window.scaled, _fit(window, degrees[-1]))
    noise = noise_of(left, np.arange(len(left)), degrees[-1] + 1)
    free = len(left) - degrees[-1] - 1
    rounding = (1e-9 * float(np.ptp(window.force))) ** 2
    variance = max(float(left @ left) / free * max(len(left) / noise.effective, 1.0), rounding)
    values, own, weights = [], [], []
    for degree in degrees:
        columns = chebyshev.chebvander(window.scaled, degree)
        theta, *_ = np.linalg.lstsq(columns, window.force, rcond=None)
        slope = np.array([chebyshev.chebval(at, chebyshev.chebder(unit)) for unit in np.eye(degree + 1)])
        misfit = window.force - columns @ theta
        values.append(float(slope @ theta))
        own.append(variance * float(slope @ np.linalg.pinv(columns.T @ columns) @ slope))
        weights.append(float(misfit @ misfit) / variance + 2 * (degree + 1))
    share = np.exp(-(np.array(weights) - min(weights)) / 2)
    share /= share.sum()
    mean = float(share @ values)
    spread = float(share @ (np.array(own) + (np.array(values) - mean) ** 2))
    path = chebyshev.chebfit(window.time - window.time.mean(), window.scaled, 2)
    change = 4 * path[2] / (path[1] or 1e-300)  # of T2, whose second derivative is 4
    depth = window.middle + window.reach * at
    explained = 1 - float(left @ left) / max(float(np.var(window.force)) * len(left), 1e-300)
    drift = float(window.drift[-1] - window.drift[0]) / float(window.scaled[-1] - window.scaled[0])
    reach = window.reach
    return mean / reach, spread / reach**2, change, drift / reach, depth, explained
