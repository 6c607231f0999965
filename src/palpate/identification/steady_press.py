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
from palpate.identification.least_squares import estimate_noise
from palpate.identification.options import Lag
from palpate.identification.phases import Leak
from palpate.identification.pooling import random_effects
from palpate.identification.sampling import Channels
from palpate.identification.strokes import MAX_BLOCKS, MIN_STROKE_REACH, Stroke, find_turns
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.samples import block_means, white_noise
from palpate.signals.types import NORMAL

WINDOW = (0.35, 0.97)
"""Force range, as fractions of the peak, over which the tangent is fitted; below it the contact area still grows."""
LEVELS = (0.3, 0.5, 0.9)
"""Fractions of the force at which further tangents are listed."""
HALF_WINDOW = 0.2
"""Half of the window about a level in which its tangent is fitted, as a fraction of the force."""
_MAX_BLOCKS, _MIN_BLOCKS = 96, 12
"""Blocks in a window."""
_MAX_CURVE_POINTS = 400
"""Maximum points of a curve that is drawn."""
_DEGREES = (2, 4, 6, 8)
"""Degrees of the averaged curves; an odd degree changes the slope in the middle as the next even one does."""


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
        low = float(self.depth.min())
        high = float(self.depth.max())
        middle = (low + high) / 2
        reach = (high - low) / 2
        return (self.depth - middle) / reach, middle, reach

    def crossings(self, low: float, high: float) -> tuple[int, int]:
        """First row above each of two forces, counted in the direction of loading; the length if none is."""
        force = self.force if self.loads else self.force[::-1]
        above = np.flatnonzero(force > high)
        return int(np.argmax(force > low)), int(above[0]) if len(above) else len(force)

    def secant(self, low: float, high: float) -> float:
        """Mean slope between the crossings of two forces [N/m], interpolated between rows."""
        step = 1 if self.loads else -1
        depth, force = self.depth[::step], self.force[::step]
        ends = np.clip(self.crossings(low, high), 1, len(force) - 1).tolist()
        begin, end = (
            float(np.interp(level, force[row - 1 : row + 1], depth[row - 1 : row + 1]))
            for level, row in zip((low, high), ends, strict=True)
        )
        return (high - low) / (end - begin or np.inf)

    def between(self, low: float, high: float) -> Curve | None:
        """Block means of the unbroken part between the crossings of two forces; None if there are too few."""
        force = self.force
        first, last = self.crossings(low, high)
        readings = int((last - first) * self.readings)  # rows between two readings add no information
        count = min(_MAX_BLOCKS, readings)
        if count < _MIN_BLOCKS:
            return None
        rows = slice(first, last) if self.loads else slice(len(force) - last, len(force) - first)
        edges = np.linspace(0, last - first, count + 1).astype(np.intp)
        signals = np.stack([self.time, self.depth, self.force, self.drift])[:, rows]
        means = np.add.reduceat(signals, edges[:-1], axis=1) / np.diff(edges)
        if len(np.unique(means[1])) <= _DEGREES[0]:
            return None
        time, depth, force, drift = means
        return Curve(time, depth, force, drift, self.loads, 1.0)

    def about(self, depth: float) -> Curve:
        """The half of the curve about a depth [m]; all of it if that has blocks at too few depths."""
        near = np.abs(self.depth - depth) <= self.abscissa[2] / 2
        if len(np.unique(self.depth[near])) < _MIN_BLOCKS:
            return self
        signals = np.stack([self.time, self.depth, self.force, self.drift])[:, near]
        time, x, force, drift = signals
        return Curve(time, x, force, drift, self.loads, 1.0)

    def fit(self, degree: int) -> Array:
        """Chebyshev coefficients of the force over the scaled depth, shape (degree + 1,)."""
        return np.asarray(chebyshev.chebfit(self.abscissa[0], self.force, degree), np.float64)

    def tangent(self, level: float) -> _Tangent:
        """The slope of a window at a force [N]."""
        u, middle, reach = self.abscissa
        force = self.force
        depth_count = len(np.unique(u))
        degrees = [degree for degree in _DEGREES if degree == _DEGREES[0] or 4 * degree < depth_count]
        fine = np.linspace(-1, 1, 201)
        curve = chebyshev.chebval(fine, self.fit(degrees[:2][-1]))
        place = float(fine[int(np.argmin(np.abs(curve - level)))])
        residual = force - chebyshev.chebval(u, self.fit(degrees[-1]))
        noise = estimate_noise(residual, np.arange(len(residual)), degrees[-1] + 1)
        free = len(residual) - degrees[-1] - 1
        rounding = (1e-9 * float(np.ptp(force))) ** 2
        inflation = max(len(residual) / noise.effective, 1.0)
        variance = max(float(residual @ residual) / free * inflation, rounding)
        fits = []
        for degree in degrees:
            inverse = np.linalg.pinv(chebyshev.chebvander(u, degree))
            derivative = chebyshev.chebder(inverse)
            weights = np.asarray(chebyshev.chebval(place, derivative))  # of blocks on the slope
            misfit = force - chebyshev.chebval(u, inverse @ force)
            criterion = float(misfit @ misfit) / variance + 2 * (degree + 1)
            fits.append((float(weights @ force), variance * float(weights @ weights), criterion))
        values, variances, criteria = np.array(fits).T
        probability = np.exp(-(criteria - criteria.min()) / 2)
        probability /= probability.sum()
        mean = float(probability @ values)
        spread = float(probability @ (variances + (values - mean) ** 2))
        acceleration, speed, _ = np.polyfit(self.time - self.time.mean(), u, 2)
        travel = float(self.depth[-1] - self.depth[0])
        drift = float(self.drift[-1] - self.drift[0]) / travel
        change = float(2 * acceleration / (speed or 1e-300))
        return _Tangent(mean / reach, spread / reach**2, change, drift, middle + reach * place)


def stroke_curves(
    channels: Channels,
    strokes: Sequence[Stroke],
    signs: tuple[float, float],
    drift: Drift | None,
    leak: Leak | None,
) -> list[Curve]:
    """The force of each stroke over its depth."""
    curves = []
    for rows in (stroke.rows(channels) for stroke in strokes):
        valid_rows = np.flatnonzero(channels.valid[rows]) + rows.start
        if len(valid_rows) < 2 * _MIN_BLOCKS:
            continue
        time = channels.time[valid_rows]
        force = signs[1] * channels.force[valid_rows]
        begin, *_, end = (float(np.median(part)) for part in np.array_split(force, 5))
        removed_drift = np.zeros(len(time))
        if drift is not None:
            removed_drift = np.interp(time - channels.start, drift.times, drift.levels)
        if leak is not None:
            removed_drift += NORMAL * leak.column(time)
        readings = min(channels.rate * channels.dt, 1.0)
        depth = signs[0] * channels.position[valid_rows]
        curves.append(Curve(time, depth, force, removed_drift, end > begin, readings))
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

    def with_cause(self, cause: str, contribution: Contribution) -> Slopes:
        """Add one more cause of error to the stiffness."""
        return replace(self, stiffness=self.stiffness.with_cause(cause, contribution))

    def spread_as(self, wider: Slopes | None) -> Slopes:
        """Take over the relative spread of more presses, if it is larger, as of one on another surface."""
        if wider is None or not wider.stiffness.value:
            return self
        gain = self.stiffness.value / wider.stiffness.value
        spread = wider.stiffness.contributions["repetition"].times(gain)
        if spread.half <= self.stiffness.contributions["repetition"].half:
            return self
        return replace(self.with_cause("repetition", spread), each=wider.each, again=None)


def slopes_at(
    curves: Sequence[Curve], shares: tuple[float, float], lag: Lag, rest: float = 0.0
) -> Slopes | None:
    """The tangent in the middle of a window of the force that all curves pass; None if it is too short.

    If strokes differ by more than their noise, the interval includes the variance between them. The curves have one
    direction, and the window lies between fractions `shares` of their common force range; `rest` is the force out of
    contact [N].
    """
    low = max(curve.reach[0] for curve in curves)
    high = min(curve.reach[1] for curve in curves)
    begin, end = (low + share * (high - low) for share in shares)
    passes = [(curve, curve.between(begin, end)) for curve in curves]
    windows = [window for _, window in passes if window is not None]
    if not windows or high <= low:
        return None
    level = float(np.mean([chebyshev.chebval(0.0, window.fit(2)) for window in windows]))
    tangents = [window.tangent(level) for window in windows]
    slopes, variances, bends, drifts, depths = np.array(tangents).T
    # A bend that no smooth curve follows, such as a second layer, biases the slope, and less in half of the window. The
    # two slopes differ by that bias and the noise of the narrower window (James and Stein's shrinkage).
    halves = [window.about(depth) for window, depth in zip(windows, depths, strict=True)]
    near_tangents = [half.tangent(level) for half in halves]
    differences = np.array([tangent.slope for tangent in near_tangents]) - slopes
    noises = np.array([tangent.variance for tangent in near_tangents])
    shrinkage = np.maximum(1 - noises / np.maximum(differences**2, 1e-300), 0.0)
    slopes = slopes + shrinkage * differences
    bias_variances = shrinkage * noises
    brief, errors = _brief_slopes(passes, begin, end, float(slopes.mean()))
    slopes, variances = np.r_[slopes, brief], np.r_[variances, errors]
    rows = np.r_[np.arange(len(windows)), np.zeros(len(brief), np.intp)]
    bends, drifts, depths, bias_variances = (
        values[rows] for values in (bends, drifts, depths, bias_variances)
    )
    mean = random_effects(slopes, variances + bias_variances)
    n = len(slopes)
    weight = 1 / np.maximum(variances + mean.between**2, 1e-300)
    weight /= weight.sum()
    noise = float(np.sqrt(weight**2 @ variances))
    scatter = mean.between * float(np.sqrt(weight @ weight))
    # Satterthwaite: the noise is known, the differences by n - 1.
    scatter_fraction = scatter**2 / max(noise**2 + scatter**2, 1e-300)
    freedom = (n - 1) / scatter_fraction**2 if scatter_fraction else np.inf
    bend = float(weight @ bends)
    value = float(weight @ slopes) * (1 + lag.value * bend)
    parts = {
        "repetition": Contribution(scatter, freedom),
        "noise": Contribution(noise, freedom),
        "lag": Contribution(lag.std * abs(value * bend)),
        "curvature": Contribution(float(np.sqrt(weight**2 @ bias_variances))),
        # Known where the probe is free, not in between.
        "other forces": Contribution.within(float(weight @ np.abs(drifts))),
    }
    rise = float(np.mean([curve.time[-1] - curve.time[0] for curve in curves]))
    depth = float(weight @ depths)
    stiffness = Measurement(value, parts)
    return Slopes(level - rest, depth, stiffness, tuple(slopes.tolist()), mean.next_half, rise)


def _brief_slopes(
    passes: Sequence[tuple[Curve, Curve | None]], begin: float, end: float, slope: float
) -> tuple[Array, Array]:
    """Slopes [N/m] and their variances of strokes that pass a window of the force [N] too fast for a curve, shape (k,).

    Each has a secant, and so have the others, whose mean slope is given: a stiffer surface is passed in fewer rows, and
    must not be left out for that.
    """
    usual = np.mean([curve.secant(begin, end) for curve, window in passes if window is not None])
    brief = [curve for curve, window in passes if window is None]
    slopes = np.array([curve.secant(begin, end) for curve in brief]) * slope / usual
    noise = np.array([white_noise(curve.force) for curve in brief])
    return slopes, 2 * (slopes * noise / (end - begin)) ** 2


_WINDOWS = (WINDOW, *((level - HALF_WINDOW, min(level + HALF_WINDOW, 1.0)) for level in LEVELS))
"""Windows of the headline and of the further tangents, as fractions of the force."""


def change_with_time(loading: Curve, back: Curve) -> float:
    """Standard deviation of the tangents of one press by a force that changes meanwhile [N/m].

    A surface makes the difference between loading and return 0, or, if it relaxes, a smooth function of the force. How
    the differences scatter about a parabola over the force, beyond their noise, is no surface's. Noise alone would be
    taken for it in one of twenty logs: the scatter is 0 below the 95 % quantile of chi squared.
    """
    from scipy.special import chdtri

    low, high = max(loading.reach[0], back.reach[0]), min(loading.reach[1], back.reach[1])
    powers, difference, variance = [], [], []
    for window in _WINDOWS:
        begin, end = (low + share * (high - low) for share in window)
        halves = [curve.between(begin, end) for curve in (loading, back)]
        tangents = [half.tangent((begin + end) / 2) for half in halves if half is not None]
        if len(tangents) < len(halves):
            return 0.0
        powers.append([sum(window), sum(window) ** 2])
        difference.append(tangents[1].slope - tangents[0].slope)
        variance.append(tangents[1].variance + tangents[0].variance)
    freedom = len(_WINDOWS) - 3
    variances = np.array(variance) * chdtri(freedom, 0.05) / freedom
    return random_effects(np.array(difference), variances, np.array(powers)).between


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
    leak: Leak | None = None,
) -> SteadyPress | None:
    """The press of a log's strokes; None where the force does not follow them.

    The tangents belong to the loadings, or to the unloadings if the log has no other stroke. The channels are as
    logged, less a drift of the force; `signs` multiply position and force, and `rest` is the force out of contact after
    its sign [N].
    """
    all_curves = stroke_curves(channels, strokes, signs, drift, leak)
    largest_span = max((curve.span for curve in all_curves), default=0.0)
    curves = [curve for curve in all_curves if curve.span > largest_span / 2]
    loadings = [curve for curve in curves if curve.loads]
    if not loadings:
        block = -(-len(channels.force) // MAX_BLOCKS)
        force = block_means(signs[1] * channels.force[channels.valid], block)
        turning_forces = force[find_turns(force, largest_span / 2)]
        if (np.diff(turning_forces) > largest_span / 2).any():
            return None
    loadings = loadings or curves
    headline = slopes_at(loadings, WINDOW, lag, rest)
    if headline is None:
        return None
    long_curves = [curve for curve in all_curves if curve.span > MIN_STROKE_REACH * largest_span]
    similar = [curve for curve in long_curves if curve.loads is loadings[0].loads]
    if len(similar) > len(loadings):  # at a force that all reach
        headline = headline.spread_as(slopes_at(similar, WINDOW, lag, rest))
    if not headline.stiffness.with_cause("repetition", Contribution(0.0)).known_to(1.0):
        return None
    others = [slopes_at(loadings, window, lag, rest) for window in _WINDOWS[1:]]
    returns = [curve for curve in curves if curve.loads is not loadings[0].loads]
    if len(loadings) == 1 and returns:
        change = Contribution(change_with_time(loadings[0], returns[0]))
        headline = headline.with_cause("time", change)
        others = [slopes and slopes.with_cause("time", change) for slopes in others]
    known = tuple(slopes for slopes in others if slopes and slopes.stiffness.known_to(1.0))
    drawn_curves = []
    for loads in (True, False):
        of_direction = [curve for curve in curves if curve.loads is loads]
        longest = max(of_direction, key=lambda curve: curve.span, default=None)
        drawn_curves.append(np.stack([longest.depth, longest.force]) if longest else np.empty((2, 0)))
    return SteadyPress(headline, known, *map(thin_curve, drawn_curves))


def thin_curve(curve: Array) -> Array:
    """A curve, shape (2, n), with so few points that it is drawn."""
    return curve[:, :: max(curve.shape[1] // _MAX_CURVE_POINTS, 1)]
