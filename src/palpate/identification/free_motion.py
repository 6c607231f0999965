"""Where the probe is in free motion: at one end of its range the position travels, and the force does not follow."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.identification.filters import Chain, position_noise
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import random_effects
from palpate.identification.sampling import Channels
from palpate.identification.uncertainty import student
from palpate.signals.samples import GAUSSIAN, block_means, runs, white_noise
from palpate.signals.types import NORMAL

FLAT = 0.4
"""Slope in free motion over that in contact, at most: a power of the depth up to n = 2 that the probe leaves with 5 %
of its force has 0.44 there. `benchmarks/identification/free_motion_constants.py` shows which values do as well, of this
and of the constants below."""
_SHARES = 0.5 ** (np.arange(2, 13) / 2)
"""Of the position's range that may lie in free motion, from a half to a sixty-fourth."""
_TWICE = 2.0
"""How much farther the position must travel at one end than at the other, if the force goes with it at neither: all of
a log in which nothing is touched is such an end, and so is a damped oscillation's turn."""
_FEWEST = 8
"""Rows of a stay in free motion: fewer have no slope."""
_MOST = 1 << 16
"""Rows that are looked at; more are averaged."""
_SEEN = 10.0
"""Power of the motion in a stay over that of the position's noise, at least: the slope would be off by a tenth."""
_OUTLYING = 5.0
"""Deviations from the middle of a stay that no noise reaches."""
_OF_MEDIAN = 2 / np.pi
"""Variance of a mean over that of a median, of normal noise."""
_MIDDLE = (0.05, 0.95)
"""Of the force's range, between which it is the surface's for sure."""
_BENDS = 3
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
        """Ways that it may bend beside straight lines from stay to stay [N], of deviation 1 each, shape (m, _BENDS).

        Those of a random walk that is seen at the stays alone (Karhunen and Loeve's modes of Brown's bridge), at times
        [s], shape (m,).
        """
        apart = np.diff(self.times)
        walk = float(np.sqrt(np.sum(np.diff(self.levels) ** 2) / np.sum(apart)))  # N over a root of time
        at = np.clip(np.searchsorted(self.times, times) - 1, 0, len(apart) - 1)
        share = np.clip((times - self.times[at]) / apart[at], 0.0, 1.0)
        order = np.pi * np.arange(1, _BENDS + 1)
        return np.asarray((walk * np.sqrt(2 * apart[at]))[:, None] * np.sin(share[:, None] * order) / order)


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


def free_motion_of(
    force: Array, position: Array, ends: tuple[float, float], *, none: bool = True
) -> FreeMotion | None:
    """The free motion of a log; None if the force goes with the position at both ends of its range, or at neither.

    The slope of force over position, with its interval under coloured noise, is not above none (that of an inertia is
    below, and may do where `none` is not asked for) and far below that of the contact. Rows are chosen by position:
    chosen by force, they would follow its noise. Both are as they stand in the log, shape (n,): behind a filter a fast
    touch is a slow one. The ends are of the force's range, outliers left aside [N].
    """
    size = max(len(force) // _MOST, 1)
    force, position = block_means(force, size), block_means(position, size)
    search = _Search(force, position, _in_contact(force, position, ends), white_noise(position), none)
    shares = [0.0, 0.0]
    for bound in (np.inf, _OUTLYING):
        if search.slope and not any(shares):
            shares = [search.share_from(way, bound) for way in (1.0, -1.0)]
    if max(shares) == 0 or max(shares) < _TWICE * min(shares):
        return None
    return _beyond(force, position, 1.0 if shares[0] >= shares[1] else -1.0, max(shares), size)


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

    def share_from(self, way: float, bound: float) -> float:
        """The largest share from the lower (1) or upper (-1) end in which the force stays; 0 if there is none.

        Its slope is clearly below that of the contact. It is so over that share or over the next larger one, which may
        hold a touch. That of an inertia is held against the steepest that an interval leaves at either end: it is in
        the force over the whole range, and takes from the contact's.
        """
        clear = False
        for share in _SHARES:
            if (found := self._slope_over(way, share, bound)) is None:
                continue
            own, half = float(np.sign(self.slope)) * found[0], found[1]
            before, clear = clear, own + half < FLAT * abs(self.slope)
            if not (clear or before) or (self.none and own > half):
                continue
            least = abs(own - half if self.none else own)
            every = (self._slope_over(end, other, np.inf) for end in (1.0, -1.0) for other in _SHARES)
            steepest = (abs(k) - h for k, h in filter(None, every))
            if least < FLAT * abs(self.slope) or any(least < FLAT * steep for steep in steepest):
                return float(share) * _quiet(self.force, way * self.position, share)
        return 0.0

    def _slope_over(self, way: float, share: float, bound: float) -> tuple[float, float] | None:
        """Slope over a share of the position's range from an end, and its half-width; None if none is seen."""
        question = way, share, bound
        if question not in self._slopes:
            stays = _stays_in(way * self.position < _limit(way * self.position, share))
            found = _slope(self.force, self.position, stays, self.white, bound) if stays else None
            self._slopes[question] = found
        return self._slopes[question]


def _beyond(force: Array, position: Array, way: float, share: float, size: int) -> FreeMotion:
    """Free motion over a share of the position's range; of means of so many rows of the log."""
    from scipy.special import chdtri

    limit = _limit(way * position, share)
    stays = _stays_in(way * position < limit)
    middle = np.array([(a + b - 1) / 2 for a, b in stays]) * size + (size - 1) / 2
    rows, stay = _rows_of(stays)
    levels = _medians(force[rows], stay)
    noise = noise_of(force[rows] - levels[stay], np.arange(len(rows)), len(stays))
    # The medians differ if they do so by more than chance would have them in one of twenty logs.
    length = np.bincount(stay).astype(float)
    weight = _OF_MEDIAN * length * noise.effective / max(noise.variance * length.sum(), 1e-300)
    apart = float(weight @ (levels - float(weight @ levels) / float(weight.sum())) ** 2)
    differ = len(stays) > 1 and apart > chdtri(len(stays) - 1, 0.05)
    rest, deviation = float(np.median(force[rows])), float(np.sqrt(noise.variance))
    return FreeMotion(way, way * limit, rest, middle, levels, differ, deviation)


def _in_contact(force: Array, position: Array, ends: tuple[float, float]) -> float:
    """Slope of force over position between the ends of the force's range [N/m]; 0 if there is none."""
    low, high = ends
    inner = (force > low + _MIDDLE[0] * (high - low)) & (force < low + _MIDDLE[1] * (high - low))
    reach = float(np.ptp(position[inner])) if inner.any() else 0.0
    rises = float((force - force.mean()) @ (position - position.mean())) >= 0
    return (1.0 if rises else -1.0) * (high - low) / reach if reach > 0 else 0.0


def _limit(position: Array, share: float) -> float:
    bottom, top = np.percentile(position, [0.1, 99.9])
    return float(bottom + share * (top - bottom))


def _quiet(force: Array, position: Array, share: float) -> bool:
    """Whether the force has no clearly larger range at the lower end of the position's than at the upper one.

    Steps that a damper ends leave no slope of force over position at the deep end either.
    """
    low, high = (force[way * position <= _limit(way * position, share)] for way in (1.0, -1.0))
    own, other = (float(np.ptp(np.percentile(end, [0.1, 99.9]))) for end in (low, high))
    return FLAT * own <= other


def _stays_in(inside: Mask) -> list[tuple[int, int]]:
    """First and past-the-last row of each unbroken stretch that is long enough."""
    return [(a, b) for a, b in runs(inside) if b - a >= _FEWEST]


def _rows_of(stays: list[tuple[int, int]]) -> tuple[Indices, Indices]:
    """Rows of all stays, and the number of each one's stay."""
    rows = [np.arange(a, b) for a, b in stays]
    return np.concatenate(rows), np.repeat(np.arange(len(rows)), [len(own) for own in rows])


def _medians(values: Array, number: Indices) -> Array:
    """Of the values of each number, which only grows."""
    ordered = [np.sort(own) for own in np.split(values, np.flatnonzero(np.diff(number)) + 1)]
    return np.array([(own[(len(own) - 1) // 2] + own[len(own) // 2]) / 2 for own in ordered])


def _slope(
    force: Array, position: Array, stays: list[tuple[int, int]], white: float, bound: float
) -> tuple[float, float] | None:
    """Slope of force over position within stays, and its half-width [N/m]; None if the position hardly moves.

    What is more than a bound of deviations from the middle of its stay may be left out: a force that is read late has
    a touch in it that the position no longer shows.
    """
    at, stay = _rows_of(stays)
    x = position[at] - (np.bincount(stay, position[at]) / np.bincount(stay))[stay]
    f = force[at] - _medians(force[at], stay)[stay]
    near = np.abs(f) <= bound * GAUSSIAN * float(np.median(np.abs(f)))
    rows = np.flatnonzero(near | np.isinf(bound))
    x, f = x[rows] - x[rows].mean(), f[rows] - f[rows].mean()
    size = float(x @ x)
    if len(rows) < _FEWEST or size <= _SEEN * len(x) * white**2:
        return None
    own = float(x @ f) / size
    noise = noise_of(f - own * x, rows, len(stays) + 1)
    std = float(np.sqrt(noise.variance * len(f) / noise.effective / size))
    return own, student(noise.effective - 2) * std


_ACCELERATED = 10.0
"""Power of the acceleration over that of the position's noise in it, at least: the mass would be off by a tenth."""
_FEWEST_LEVEL = 20
"""Rows of a stay in free motion that its own level is taken from."""
_LEAST = 0.05
"""Of the sum of squares of the acceleration in the part that has most, what a part needs to tell the mass again."""
_EXPLAINED = 0.5
_OTHERS = 2.0
"""Share of the force's power that the acceleration accounts for at least, and over that of speed or place: as measured
by `benchmarks/identification/free_motion_constants.py`."""


@dataclass(frozen=True)
class MovingMass:
    """A mass seen in free motion, and its deviation [kg]: negative if too much inertia was taken out before."""

    mass: float
    std: float

    @property
    def text(self) -> str:
        """Its meaning, as a sentence."""
        seen = f"in free motion the force follows a mass of {self.mass:.3g} kg (std {self.std:.2g})"
        if self.mass > 0:
            return f"{seen}: it moves beyond the force sensor, and its inertia is removed"
        return f"{seen}: a tool's inertia was compensated with the wrong sign, or too much; it is restored"


def payload_of(
    channels: Channels, chain: Chain, air: FreeMotion, lag: float, *, alone: bool = False
) -> MovingMass | None:
    """The mass that the force in free motion tells, both channels as they count in the log; None if it tells none.

    Least squares of the filtered force on the filtered acceleration, in each stay on its own level. The acceleration
    accounts for more of the force than all else, and for twice what others do: a force that is read late (by `lag`
    [s]), or that sinks after a contact, goes with the speed as well. With `alone` it is told from a soft spring too,
    which one frequency does not do.
    """
    memory = int(np.ceil((chain.settling + abs(lag)) / chain.dt))
    stays = [(a + memory, b) for a, b in air.among(channels.position) if b - a - memory >= _FEWEST_LEVEL]
    if not stays:
        return None

    def own(filtered: Array) -> Array:
        return np.concatenate([filtered[i:j] - filtered[i:j].mean() for i, j in stays])

    force, motion = own(chain(channels.force)), own(chain(channels.position, 2, lag))
    size = float(motion @ motion)
    spread = chain.acceleration_noise(position_noise([channels.position[i:j] for i, j in stays]))
    others = (own(chain(channels.position, k, lag)) for k in ((1, 0) if alone else (1,)))
    if size <= _ACCELERATED * len(motion) * spread:
        return None
    by_motion = _accounts(motion, force)
    if by_motion <= _EXPLAINED or any(by_motion <= _OTHERS * _accounts(column, force) for column in others):
        return None
    noise = noise_of(force - float(motion @ force) / size * motion, np.arange(len(force)), len(stays) + 1)
    # Both halves of each stay tell the mass: a tone in the force goes with some of the motion, not with all.
    ends = np.cumsum([0, *(b - a for a, b in stays)])
    edges = np.sort(np.concatenate([ends, (ends[:-1] + ends[1:]) // 2]))
    parts = [(motion[a:b] - motion[a:b].mean(), force[a:b]) for a, b in pairwise(edges.tolist())]
    sizes = np.array([float(part @ part) for part, _ in parts])
    told = sizes > _LEAST * sizes.max()
    masses = np.array([float(part @ f) for part, f in parts])[told] / sizes[told]
    mean = random_effects(masses, noise.variance * len(force) / noise.effective / sizes[told])
    return MovingMass(mean.value, mean.half / NORMAL) if abs(mean.value) > mean.half else None


def _accounts(column: Array, force: Array) -> float:
    """Share of the force's power that a column accounts for."""
    return float(column @ force) ** 2 / max(float(column @ column) * float(force @ force), 1e-300)
