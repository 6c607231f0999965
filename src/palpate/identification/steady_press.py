"""Presses at constant speed: the force over the depth of their strokes, its tangents, and of these the press.

Force and position are both smooth curves of one variable, so that a tangent is the quotient of their derivatives: at
constant speed a lag of the force moves it along the curve, and does not change it; where the speed changes, it changes
the slope by that change.

In a window about one force the force is a smooth curve of the position. How bent it is, the log tells: curves of
several degrees are averaged by Akaike's weights, with the variance between them (Burnham and Anderson, Model selection
and multimodel inference, 2002, sec. 4.3). So curvature is in the curve, and of an error only what the noise leaves
open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from palpate.arrays import Array
from palpate.identification.free_motion import Drift
from palpate.identification.least_squares import noise_of
from palpate.identification.options import Lag
from palpate.identification.pooling import random_effects
from palpate.identification.sampling import Channels
from palpate.identification.strokes import BLOCKS, STROKE, Stroke, turns_of
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.samples import block_means

WINDOW = (0.35, 0.97)
"""Shares of a stroke's force about the tangent that is named: below, a surface is still being met."""
LEVELS = (0.3, 0.5, 0.9)
"""Shares of the force whose tangents are listed beside it."""
NEAR = 0.2
"""Half of the share of the force about a level in which its tangent is taken: the levels beside it lie so far off."""
_MOST, _FEWEST = 96, 12
"""Blocks in a window."""
_SHOWN = 400
"""Points of a curve that are kept at most, to be drawn."""
_DEGREES = (2, 4, 6, 8)
"""Of the curves that are averaged: an odd degree moves the slope in the middle as the even one above it does."""


class _Tangent(NamedTuple):
    """Slope of a window at a force.

    Args:
        slope, variance: [N/m], [N^2/m^2].
        change: of the speed, relative [1/s].
        drift: part of the slope that a removed drift would be [N/m].
        depth: where it is [m].
    """

    slope: float
    variance: float
    change: float
    drift: float
    depth: float


@dataclass(frozen=True)
class Curve:
    """Depth and force of one stroke or a window of it in the order of time, both counted into the surface.

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

    @property
    def span(self) -> float:
        """Range of the force [N]."""
        return self.reach[1] - self.reach[0]

    @property
    def abscissa(self) -> tuple[Array, float, float]:
        """Depth from -1 to 1, shape (n,), about its middle [m], over half of its range [m]."""
        low, high = float(self.depth.min()), float(self.depth.max())
        return (self.depth - (low + high) / 2) / ((high - low) / 2), (low + high) / 2, (high - low) / 2

    def between(self, low: float, high: float) -> Curve | None:
        """Block means of the unbroken part between the first and last crossing of two forces; None of too few."""
        force = self.force if self.loads else self.force[::-1]
        first = int(np.argmax(force > low))
        above = np.flatnonzero(force > high)
        last = int(above[0]) if len(above) else len(force)
        count = min(_MOST, int((last - first) * self.readings))  # rows between two readings tell nothing more
        if count < _FEWEST:
            return None
        rows = slice(first, last) if self.loads else slice(len(force) - last, len(force) - first)
        edges = np.linspace(0, last - first, count + 1).astype(np.intp)
        every = np.stack([self.time, self.depth, self.force, self.drift])[:, rows]
        time, x, f, drift = np.add.reduceat(every, edges[:-1], axis=1) / np.diff(edges)
        return Curve(time, x, f, drift, self.loads, 1.0) if len(np.unique(x)) > _DEGREES[0] else None

    def about(self, depth: float) -> Curve:
        """The half of it about a depth [m]; the whole where that has blocks at too few depths."""
        near = np.abs(self.depth - depth) <= self.abscissa[2] / 2
        if len(np.unique(self.depth[near])) < _FEWEST:
            return self
        time, x, force, drift = (own[near] for own in (self.time, self.depth, self.force, self.drift))
        return Curve(time, x, force, drift, self.loads, 1.0)

    def fit(self, degree: int) -> Array:
        """Chebyshev coefficients of the force over the scaled depth, shape (degree + 1,)."""
        return np.asarray(chebyshev.chebfit(self.abscissa[0], self.force, degree), np.float64)

    def tangent(self, level: float) -> _Tangent:
        """The slope of a window at a force [N]."""
        (u, middle, reach), force = self.abscissa, self.force
        degrees = [own for own in _DEGREES if own == _DEGREES[0] or 4 * own < len(np.unique(u))]
        fine = np.linspace(-1, 1, 201)
        curve = chebyshev.chebval(fine, self.fit(degrees[:2][-1]))
        at = float(fine[int(np.argmin(np.abs(curve - level)))])
        left = force - chebyshev.chebval(u, self.fit(degrees[-1]))
        noise, free = noise_of(left, np.arange(len(left)), degrees[-1] + 1), len(left) - degrees[-1] - 1
        rounding = (1e-9 * float(np.ptp(force))) ** 2
        variance = max(float(left @ left) / free * max(len(left) / noise.effective, 1.0), rounding)
        every = []
        for degree in degrees:
            inverse = np.linalg.pinv(chebyshev.chebvander(u, degree))
            weights = np.asarray(chebyshev.chebval(at, chebyshev.chebder(inverse)))  # of blocks on the slope
            misfit = force - chebyshev.chebval(u, inverse @ force)
            criterion = float(misfit @ misfit) / variance + 2 * (degree + 1)
            every.append((float(weights @ force), variance * float(weights @ weights), criterion))
        values, own, criteria = np.array(every).T
        share = np.exp(-(criteria - criteria.min()) / 2)
        share /= share.sum()
        mean = float(share @ values)
        spread = float(share @ (own + (values - mean) ** 2))
        acceleration, speed, _ = np.polyfit(self.time - self.time.mean(), u, 2)
        drift = float(self.drift[-1] - self.drift[0]) / float(self.depth[-1] - self.depth[0])
        change = float(2 * acceleration / (speed or 1e-300))
        return _Tangent(mean / reach, spread / reach**2, change, drift, middle + reach * at)


def curves_of(
    channels: Channels, strokes: Sequence[Stroke], signs: tuple[float, float], drift: Drift | None
) -> list[Curve]:
    """The force of each stroke over its depth."""
    curves = []
    for rows in (stroke.rows(channels) for stroke in strokes):
        there = np.flatnonzero(channels.valid[rows]) + rows.start
        if len(there) < 2 * _FEWEST:
            continue
        time, force = channels.time[there], signs[1] * channels.force[there]
        begin, *_, end = (float(np.median(own)) for own in np.array_split(force, 5))
        gone = np.zeros(len(time))
        if drift is not None:
            gone = np.interp(time - channels.start, drift.times, drift.levels)
        readings = min(channels.rate * channels.dt, 1.0)
        curves.append(Curve(time, signs[0] * channels.position[there], force, gone, end > begin, readings))
    return curves


@dataclass(frozen=True)
class Slopes:
    """Stiffness of some loadings, or of an octave, and where it is.

    Args:
        force, depth: where it is [N], [m].
        stiffness: mean of the loadings [N/m].
        each: slope of each [N/m].
        again: 95 % half-width for one more; None for fewer than three [N/m].
        rise: mean duration of one [s]; of an octave, a quarter of a period.
    """

    force: float
    depth: float
    stiffness: Measurement
    each: tuple[float, ...]
    again: float | None
    rise: float

    def spread_as(self, wider: Slopes | None) -> Slopes:
        """The same with the relative spread of more presses, if that is larger, as of one on another surface."""
        if wider is None or not wider.stiffness.value:
            return self
        gain = self.stiffness.value / wider.stiffness.value
        spread = wider.stiffness.contributions["repetition"].times(gain)
        if spread.half <= self.stiffness.contributions["repetition"].half:
            return self
        stiffness = self.stiffness.with_cause("repetition", spread)
        return replace(self, stiffness=stiffness, each=wider.each, again=None)


def slopes_at(
    curves: Sequence[Curve], shares: tuple[float, float], lag: Lag, rest: float = 0.0
) -> Slopes | None:
    """The tangent in the middle of a window of the force that all curves pass; None if it is too short.

    Where strokes differ by more than their noise, the variance between them is in the interval. The curves are of one
    direction, and the window lies between shares of the force that they have in common; `rest` is the force out of
    contact [N].
    """
    low, high = max(own.reach[0] for own in curves), min(own.reach[1] for own in curves)
    ends = low + shares[0] * (high - low), low + shares[1] * (high - low)
    windows = [own for curve in curves if (own := curve.between(*ends)) is not None]
    if not windows or high <= low:
        return None
    level = float(np.mean([chebyshev.chebval(0.0, own.fit(2)) for own in windows]))
    every = [own.tangent(level) for own in windows]
    values, variances, bends, drifts, depths = np.array(every).T
    # A bend that no smooth curve follows, as a second layer, biases the slope, in half of the window less. The slopes
    # differ by that bias and the noise of the narrower: it is known as well as its excess over the noise (James and
    # Stein's shrinkage).
    nearer = [own.about(depth).tangent(level) for own, depth in zip(windows, depths, strict=True)]
    apart = np.array([own.slope for own in nearer]) - values
    noises = np.array([own.variance for own in nearer])
    share = np.maximum(1 - noises / np.maximum(apart**2, 1e-300), 0.0)
    values, bent = values + share * apart, share * noises
    mean = random_effects(values, variances + bent)
    n, weight = len(values), 1 / np.maximum(variances + mean.between**2, 1e-300)
    weight /= weight.sum()
    noise, differ = float(np.sqrt(weight**2 @ variances)), mean.between * float(np.sqrt(weight @ weight))
    # Satterthwaite: the noise is known, the differences by n - 1.
    part = differ**2 / max(noise**2 + differ**2, 1e-300)
    freedom = (n - 1) / part**2 if part else np.inf
    bend = float(weight @ bends)
    value = float(weight @ values) * (1 + lag.value * bend)
    parts = {
        "repetition": Contribution(differ, freedom),
        "noise": Contribution(noise, freedom),
        "lag": Contribution(lag.std * abs(value * bend)),
        "curvature": Contribution(float(np.sqrt(weight**2 @ bent))),
        # Known where the probe is free, not in between.
        "other forces": Contribution.within(float(weight @ np.abs(drifts))),
    }
    rise = float(np.mean([own.time[-1] - own.time[0] for own in curves]))
    at, stiffness = (level - rest, float(weight @ depths)), Measurement(value, parts)
    return Slopes(*at, stiffness, tuple(values.tolist()), mean.next_half, rise)


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

    The tangents are of the loadings; of the unloadings, where the log has no other stroke. The channels are as logged,
    less a drift of the force; signs of position and force are those to multiply them with, and the force out of contact
    is after the sign [N].
    """
    every = curves_of(channels, strokes, signs, drift)
    deepest = max((own.span for own in every), default=0.0)
    curves = [own for own in every if own.span > deepest / 2]
    named = [own for own in curves if own.loads]
    force = block_means(signs[1] * channels.force[channels.valid], -(-len(channels.force) // BLOCKS))
    if not named and (np.diff(force[turns_of(force, deepest / 2)]) > deepest / 2).any():
        return None
    named = named or curves
    headline = slopes_at(named, WINDOW, lag, rest)
    if headline is None:
        return None
    beside = [own for own in every if own.loads is named[0].loads and own.span > STROKE * deepest]
    if len(beside) > len(named):  # at a force that all reach
        headline = headline.spread_as(slopes_at(beside, WINDOW, lag, rest))
    if not headline.stiffness.with_cause("repetition", Contribution(0.0)).known_to(1.0):
        return None
    windows = [(level - NEAR, min(level + NEAR, 1.0)) for level in LEVELS]
    others = [own for window in windows if (own := slopes_at(named, window, lag, rest)) is not None]
    known = tuple(own for own in others if own.stiffness.known_to(1.0))
    drawn = []
    for loads in (True, False):
        longest = max((own for own in curves if own.loads is loads), key=lambda own: own.span, default=None)
        drawn.append(np.stack([longest.depth, longest.force]) if longest else np.empty((2, 0)))
    return SteadyPress(headline, known, *map(few_points, drawn))


def few_points(curve: Array) -> Array:
    """A curve, shape (2, n), with so few points that it is drawn."""
    return curve[:, :: max(curve.shape[1] // _SHOWN, 1)]
