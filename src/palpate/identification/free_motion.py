"""Find free motion: at one end of its range the position moves, and the force does not follow."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.identification.filters import Chain
from palpate.identification.least_squares import estimate_noise
from palpate.identification.pooling import random_effects
from palpate.identification.sampling import Channels
from palpate.identification.uncertainty import student
from palpate.signals.position_noise import position_noise
from palpate.signals.samples import block_means, outer_range, robust_std, runs, white_noise
from palpate.signals.types import NORMAL

MAX_SLOPE_RATIO = 0.4
"""Slope in free motion over that in contact, at most: a power of the depth up to n = 2 that the probe leaves with 5 %
of its force has 0.44 there. `benchmarks/identification/free_motion_constants.py` shows which values do as well, of this
and of the constants below."""
RANGE_FRACTIONS = 0.5 ** (np.arange(2, 13) / 2)
"""Of the position's range that may lie in free motion, from a half to a sixty-fourth."""
_MIN_FRACTION_RATIO = 2.0
"""How much farther the position must travel at one end than at the other, if the force goes with it at neither: all of
a log in which nothing is touched is such an end, and so is a damped oscillation's turn."""
MIN_STAY_ROWS = 8
"""Rows of a stay in free motion: fewer have no slope."""
_MAX_ROWS = 1 << 16
"""Rows that are looked at; more are averaged."""
_MIN_MOTION_POWER = 10.0
"""Power of the motion in a stay over that of the position's noise, at least: the slope would be off by a tenth."""
_MAX_NOISE_STDS = 5.0
"""Deviations from the middle of a stay that no noise reaches."""
_MEAN_OVER_MEDIAN_VARIANCE = 2 / np.pi
"""Variance of a mean over that of a median, of normal noise."""
_CONTACT_FORCE_RANGE = (0.05, 0.95)
"""Of the force's range, between which it is the surface's for sure."""
_DRIFT_MODES = 3
"""Ways of a drift to bend between stays in free motion: the first three have five sixths of a random walk's power."""


@dataclass(frozen=True)
class Drift:
    """Drift of the force in free motion, and its uncertainty in between.

    Args:
        times: of the stays in free motion [s], shape (s,), two at least.
        levels: of the force there [N], shape (s,).
    """

    times: Array
    levels: Array

    def bends(self, times: Array) -> Array:
        """Modes of the drift between stays, about the straight lines that join them [N], shape (m, _DRIFT_MODES).

        Each mode has a coefficient of standard deviation 1. The drift is a random walk that is known at the stays alone
        (Karhunen and Loeve's modes of the Brownian bridge); `times` [s] have the shape (m,).
        """
        intervals = np.diff(self.times)
        walk = float(np.sqrt(np.sum(np.diff(self.levels) ** 2) / np.sum(intervals)))  # N over a root of time
        stay = np.clip(np.searchsorted(self.times, times) - 1, 0, len(intervals) - 1)
        fraction = np.clip((times - self.times[stay]) / intervals[stay], 0.0, 1.0)
        order = np.pi * np.arange(1, _DRIFT_MODES + 1)
        return np.asarray(
            (walk * np.sqrt(2 * intervals[stay]))[:, None] * np.sin(fraction[:, None] * order) / order
        )


@dataclass(frozen=True)
class FreeMotion:
    """A stretch of positions without a surface.

    Args:
        way: 1 if the surface lies towards higher positions, -1 if towards lower.
        limit: position at which it may begin, at the earliest [m].
        rest: the force there [N], in the middle.
        stays: middle row of each stay in free motion, shape (s,).
        levels: middle force in each [N], shape (s,).
        drifts: they differ by more than their noise.
        noise: deviation of the force in a stay [N].
    """

    way: float
    limit: float
    rest: float
    stays: Array
    levels: Array
    drifts: bool
    noise: float

    def drift(self, rows: Array) -> Array:
        """Drift of the free-motion force at some rows, relative to its middle [N]: straight lines between stays."""
        return np.asarray(np.interp(rows, self.stays, self.levels) - self.rest)

    def among(self, position: Array) -> list[tuple[int, int]]:
        """First and past-the-last row of each stay in it, of a position of shape (n,)."""
        return _stays_in(self.way * position < self.way * self.limit)


def find_free_motion(
    force: Array, position: Array, ends: tuple[float, float], *, none: bool = True
) -> FreeMotion | None:
    """The free motion of a log; None if the force goes with the position at both ends of its range, or at neither.

    The slope of force over position, with its interval under coloured noise, is not above none (that of an inertia is
    below, and may do where `none` is not asked for) and far below that of the contact. Rows are chosen by position:
    chosen by force, they would follow its noise. Both are as they stand in the log, shape (n,): behind a filter a fast
    touch is a slow one. The ends are of the force's range, outliers left aside [N].
    """
    size = max(len(force) // _MAX_ROWS, 1)
    force = block_means(force, size)
    position = block_means(position, size)
    search = _Search(force, position, _contact_slope(force, position, ends), white_noise(position), none)
    fractions = [0.0, 0.0]
    for bound in (np.inf, _MAX_NOISE_STDS):
        if search.slope and not any(fractions):
            fractions = [search.share_from(direction, bound) for direction in (1.0, -1.0)]
    if max(fractions) == 0 or max(fractions) < _MIN_FRACTION_RATIO * min(fractions):
        return None
    return _free_motion_over(
        force, position, 1.0 if fractions[0] >= fractions[1] else -1.0, max(fractions), size
    )


@dataclass(frozen=True)
class _Search:
    """Search for free motion from both ends of the position's range.

    Args:
        force, position: shape (n,) [N], [m].
        slope: of force over position in contact [N/m].
        white: deviation of the position's noise [m].
        none: whether a slope below none will not do.
    """

    force: Array
    position: Array
    slope: float
    white: float
    none: bool
    _slopes: dict[tuple[float, float, float], tuple[float, float] | None] = field(default_factory=dict)

    def share_from(self, direction: float, bound: float) -> float:
        """The largest share from the lower (1) or upper (-1) end in which the force stays; 0 if there is none.

        Its slope is clearly below that of the contact. It is so over that share or over the next larger one, which may
        hold a touch. That of an inertia is held against the steepest that an interval leaves at either end: it is in
        the force over the whole range, and takes from the contact's.
        """
        clear = False
        for fraction in RANGE_FRACTIONS:
            if (estimate := self._slope_over(direction, fraction, bound)) is None:
                continue
            slope = float(np.sign(self.slope)) * estimate[0]
            half_width = estimate[1]
            was_clear = clear
            clear = slope + half_width < MAX_SLOPE_RATIO * abs(self.slope)
            if not (clear or was_clear) or (self.none and slope > half_width):
                continue
            bound_below = abs(slope - half_width if self.none else slope)
            estimates = (
                self._slope_over(other_direction, other_fraction, np.inf)
                for other_direction in (1.0, -1.0)
                for other_fraction in RANGE_FRACTIONS
            )
            steepest = (abs(k) - h for k, h in filter(None, estimates))
            if bound_below < MAX_SLOPE_RATIO * abs(self.slope) or any(
                bound_below < MAX_SLOPE_RATIO * steep for steep in steepest
            ):
                return float(fraction) * _is_quiet(self.force, direction * self.position, fraction)
        return 0.0

    def _slope_over(self, direction: float, fraction: float, bound: float) -> tuple[float, float] | None:
        """Slope over a share of the position's range from an end, and its half-width; None if none is seen."""
        key = direction, fraction, bound
        if key not in self._slopes:
            _, stays = stays_at_end(direction * self.position, fraction)
            estimate = _free_slope(self.force, self.position, stays, self.white, bound) if stays else None
            self._slopes[key] = estimate
        return self._slopes[key]


def _free_motion_over(
    force: Array, position: Array, direction: float, fraction: float, size: int
) -> FreeMotion:
    """Free motion over a share of the position's range; of means of so many rows of the log."""
    from scipy.special import chdtri

    limit, stays = stays_at_end(direction * position, fraction)
    middle = np.array([(first + last - 1) / 2 for first, last in stays]) * size + (size - 1) / 2
    rows, stay = _stay_rows(stays)
    levels = _medians(force[rows], stay)
    noise = estimate_noise(force[rows] - levels[stay], np.arange(len(rows)), len(stays))
    # The medians differ if they do so by more than chance would have them in one of twenty logs.
    length = np.bincount(stay).astype(float)
    weight = (
        _MEAN_OVER_MEDIAN_VARIANCE * length * noise.effective / max(noise.variance * length.sum(), 1e-300)
    )
    statistic = float(weight @ (levels - float(weight @ levels) / float(weight.sum())) ** 2)
    drifts = len(stays) > 1 and statistic > chdtri(len(stays) - 1, 0.05)
    rest = float(np.median(force[rows]))
    noise_std = float(np.sqrt(noise.variance))
    return FreeMotion(direction, direction * limit, rest, middle, levels, drifts, noise_std)


def _contact_slope(force: Array, position: Array, ends: tuple[float, float]) -> float:
    """Slope of force over position between the ends of the force's range [N/m]; 0 if there is none."""
    low, high = ends
    inner = (force > low + _CONTACT_FORCE_RANGE[0] * (high - low)) & (
        force < low + _CONTACT_FORCE_RANGE[1] * (high - low)
    )
    reach = float(np.ptp(position[inner])) if inner.any() else 0.0
    rising = float((force - force.mean()) @ (position - position.mean())) >= 0
    return (1.0 if rising else -1.0) * (high - low) / reach if reach > 0 else 0.0


def stays_at_end(position: Array, fraction: float) -> tuple[float, list[tuple[int, int]]]:
    """Limit [m] of a fraction of the position's range from its lower end, and first and past-the-last row of each stay.

    The position has the shape (n,).
    """
    bottom, top = outer_range(position)
    limit = bottom + fraction * (top - bottom)
    return limit, _stays_in(position < limit)


def _is_quiet(force: Array, position: Array, fraction: float) -> bool:
    """True unless the force has a clearly larger range at the lower end of the positions than at the upper one.

    Steps that a damper ends leave no slope of force over position at the deep end either.
    """
    low, high = (
        force[direction * position <= stays_at_end(direction * position, fraction)[0]]
        for direction in (1.0, -1.0)
    )
    low_range, high_range = (float(np.ptp(outer_range(end))) for end in (low, high))
    return MAX_SLOPE_RATIO * low_range <= high_range


def _stays_in(inside: Mask) -> list[tuple[int, int]]:
    """First and past-the-last row of each unbroken stretch that is long enough."""
    return [(a, b) for a, b in runs(inside) if b - a >= MIN_STAY_ROWS]


def _stay_rows(stays: list[tuple[int, int]]) -> tuple[Indices, Indices]:
    """Rows of all stays, and the number of each one's stay."""
    rows = [np.arange(first, last) for first, last in stays]
    return np.concatenate(rows), np.repeat(np.arange(len(rows)), [len(stay_rows) for stay_rows in rows])


def _medians(values: Array, numbers: Indices) -> Array:
    """Median of the values of each number; the numbers only grow."""
    ordered = [np.sort(group) for group in np.split(values, np.flatnonzero(np.diff(numbers)) + 1)]
    return np.array([(group[(len(group) - 1) // 2] + group[len(group) // 2]) / 2 for group in ordered])


def _free_slope(
    force: Array, position: Array, stays: list[tuple[int, int]], white: float, bound: float
) -> tuple[float, float] | None:
    """Slope of force over position within stays, and its half-width [N/m]; None if the position hardly moves.

    What is more than a bound of deviations from the middle of its stay may be left out: a force that is read late has
    a touch in it that the position no longer shows.
    """
    stay_places, stay = _stay_rows(stays)
    position_change = (
        position[stay_places] - (np.bincount(stay, position[stay_places]) / np.bincount(stay))[stay]
    )
    force_change = force[stay_places] - _medians(force[stay_places], stay)[stay]
    inliers = np.abs(force_change) <= bound * robust_std(force_change)
    rows = np.flatnonzero(inliers | np.isinf(bound))
    position_change = position_change[rows] - position_change[rows].mean()
    force_change = force_change[rows] - force_change[rows].mean()
    size = float(position_change @ position_change)
    if len(rows) < MIN_STAY_ROWS or size <= _MIN_MOTION_POWER * len(position_change) * white**2:
        return None
    slope = float(position_change @ force_change) / size
    noise = estimate_noise(force_change - slope * position_change, rows, len(stays) + 1)
    std = float(np.sqrt(noise.variance * len(force_change) / noise.effective / size))
    return slope, student(noise.effective - 2) * std


_MIN_ACCELERATION_POWER = 10.0
"""Power of the acceleration over that of the position's noise in it, at least: the mass would be off by a tenth."""
_MIN_LEVEL_ROWS = 20
"""Rows of a stay in free motion that its own level is taken from."""
_MIN_PART_POWER = 0.05
"""Of the sum of squares of the acceleration in the part that has most, what a part needs to tell the mass again."""
_MIN_EXPLAINED_POWER = 0.5
_MIN_ADVANTAGE = 2.0
"""Share of the force's power that the acceleration accounts for at least, and over that of speed or place: as measured
by `benchmarks/identification/free_motion_constants.py`."""


@dataclass(frozen=True)
class MovingMass:
    """A mass seen in free motion, and its deviation [kg]: negative if too much inertia was taken out before."""

    mass: float
    std: float

    @property
    def text(self) -> str:
        """Meaning of the mass, as a sentence."""
        seen = f"in free motion the force follows a mass of {self.mass:.3g} kg (std {self.std:.2g})"
        if self.mass > 0:
            return f"{seen}: it moves beyond the force sensor, and its inertia is removed"
        return f"{seen}: a tool's inertia was compensated with the wrong sign, or too much; it is restored"


def find_moving_mass(
    channels: Channels, chain: Chain, free_motion: FreeMotion, lag: float, *, alone: bool = False
) -> MovingMass | None:
    """The mass that the force in free motion tells, both channels as they count in the log; None if it tells none.

    Least squares of the filtered force on the filtered acceleration, in each stay on its own level. The acceleration
    accounts for more of the force than all else, and for twice what others do: a force that is read late (by `lag`
    [s]), or that sinks after a contact, goes with the speed as well. With `alone` it is told from a soft spring too,
    which one frequency does not do.
    """
    memory = int(np.ceil((chain.settling + abs(lag)) / chain.dt))
    stays = [
        (first + memory, last)
        for first, last in free_motion.among(channels.position)
        if last - first - memory >= _MIN_LEVEL_ROWS
    ]
    if not stays:
        return None

    def own(signal: Array) -> Array:
        return np.concatenate([signal[i:j] - signal[i:j].mean() for i, j in stays])

    force = own(chain(channels.force))
    motion = own(chain(channels.position, 2, lag))
    size = float(motion @ motion)
    spread = chain.acceleration_noise(position_noise([channels.position[i:j] for i, j in stays]))
    other_columns = (own(chain(channels.position, k, lag)) for k in ((1, 0) if alone else (1,)))
    if size <= _MIN_ACCELERATION_POWER * len(motion) * spread:
        return None
    by_motion = _explained_power(motion, force)
    if by_motion <= _MIN_EXPLAINED_POWER or any(
        by_motion <= _MIN_ADVANTAGE * _explained_power(column, force) for column in other_columns
    ):
        return None
    noise = estimate_noise(
        force - float(motion @ force) / size * motion, np.arange(len(force)), len(stays) + 1
    )
    # Both halves of each stay tell the mass: a tone in the force goes with some of the motion, not with all.
    ends = np.cumsum([0, *(last - first for first, last in stays)])
    edges = np.sort(np.concatenate([ends, (ends[:-1] + ends[1:]) // 2]))
    parts = [
        (motion[first:last] - motion[first:last].mean(), force[first:last])
        for first, last in pairwise(edges.tolist())
    ]
    sizes = np.array([float(motion_part @ motion_part) for motion_part, _ in parts])
    reliable = sizes > _MIN_PART_POWER * sizes.max()
    masses = (
        np.array([float(motion_part @ force_part) for motion_part, force_part in parts])[reliable]
        / sizes[reliable]
    )
    mean = random_effects(masses, noise.variance * len(force) / noise.effective / sizes[reliable])
    return MovingMass(mean.value, mean.half / NORMAL) if abs(mean.value) > mean.half else None


def _explained_power(regressor: Array, force: Array) -> float:
    """Share of the force's power that a column accounts for."""
    return float(regressor @ force) ** 2 / max(float(regressor @ regressor) * float(force @ force), 1e-300)
