"""When a sensor that is slower than the log was refreshed: the even grid behind a pattern of held readings.

A fresh value shows in the first row after it came out, so each change says only within one row when it came. Together
they say more: an even grid must have one refresh in each of these rows and none in the others, which leaves a small
interval of its phase (of 1/12 row, for 480 readings a second in a log of 1000 rows).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.signals.samples import runs

_BLOCKS = 1 << 10
_EVERY_ROW = 0.9
_FEWEST = 10
_AT_FIRST = 1 << 14
"""Rows on each side of the middle in which the grid is looked for first."""
_ROOM = 1e-9
"""Of the phase, in rows: with less a pattern only just contradicts a grid."""
_PER_LINE = 8
"""Bins of the spectrum from one line to the next that the log is long enough to tell from it."""
_SHORTEST = 2.0
"""Per cent of the steps between changes that may be shorter than two samples can be apart."""


@dataclass(frozen=True)
class SampleClock:
    """The sensor's own samples.

    Args:
        instants: when each came out, in rows, shape (m,).
        rows: the first row that shows it, shape (m,).
        spread: standard deviation of what is not known of the common phase, in rows.
        period: rows between two samples.
    """

    instants: Array
    rows: Indices
    spread: float
    period: float


def sample_clock_of(values: Array) -> SampleClock:
    """The samples behind the readings `values`, shape (n,), of evenly spaced rows.

    A channel that changes in nearly every row is taken to be as fast as the log.
    """
    changed = np.flatnonzero(np.diff(values)) + 1
    every = np.arange(len(values))
    in_every_row = SampleClock(every.astype(np.float64), every, 0.0, 1.0)
    if len(changed) < _FEWEST or len(changed) > _EVERY_ROW * len(values):
        return in_every_row
    counted = [_number(changed, *beat) for beat in _beats(changed)]
    even = [grid for grid in (_even(number, changed, period) for number, period in counted) if grid]
    as_fast = np.bincount(np.diff(changed)).argmax() == 1
    if not even and as_fast:  # and often the same twice
        return in_every_row
    if not even:  # each refresh is somewhere in the row before it shows
        own = changed.astype(np.float64) - 0.5
        return SampleClock(own, changed, float(np.sqrt(1 / 12 / len(changed))), counted[0][1])
    # That with the fewest samples that no change shows.
    period, phase, room, spread = max(even, key=lambda grid: grid[0])
    first = int(np.ceil((-0.5 - phase) / period))
    last = int(np.floor((len(values) - 1 - phase) / period))
    instants = phase + np.arange(first, last + 1) * period
    rows = np.ceil(instants - room * 1e-6).astype(np.intp)
    kept = (rows >= 0) & (rows < len(values))
    return SampleClock(instants[kept], rows[kept], spread, period)


def _beats(changed: Indices) -> list[tuple[float, float]]:
    """Periods that may be meant, and a place in the middle of a sample's row for each.

    They are lines of the changes' spectrum: the strongest that the shortest steps allow, and the one at the changes'
    mean step, which is the period itself where each sample shows (the lines of a short pattern are all as strong). A
    sample that equals the one before shows no change, but that only weakens the lines. As rows are whole, a line at f
    stands at 1 - f too; from periods near 2 both may be meant.
    """
    far, reach = _reach(changed)
    own = changed[far < reach]
    least = float(np.percentile(np.diff(own), _SHORTEST))
    size = 8 << int(own[-1] - own[0]).bit_length()
    line = np.zeros(size)
    line[own - own[0]] = 1.0
    spectrum = np.fft.rfft(line)

    def strongest(first: int, last: int) -> int:
        bins = np.arange(first, last + 1)
        return int(bins[np.argmax(np.abs(spectrum[np.minimum(bins, size - bins)]))])

    first = int(np.ceil(size / (least + 1)))
    last = max(int(size / max(least - 0.2, 1 / _EVERY_ROW)), first)
    best = strongest(first, last)
    mean = round(size * (len(own) - 1) / float(own[-1] - own[0]))
    lines = {best, strongest(mean - _PER_LINE, min(mean + _PER_LINE, size - 1))}
    if first <= size - best <= last:
        lines.add(size - best)
    found = []
    for at in sorted(lines):
        angle, period = float(np.angle(spectrum[min(at, size - at)])) / (2 * np.pi), size / at
        found.append((period, own[0] + period * (angle if at > size // 2 else -angle)))
    return found


def _reach(changed: Indices) -> tuple[Indices, int]:
    """Distance of each change from the middle one, and that within which enough of them are to look for the grid."""
    far = np.abs(changed - changed[len(changed) // 2])
    return far, max(_AT_FIRST, int(np.partition(far, _FEWEST - 1)[_FEWEST - 1]) + 1)


def _number(changed: Indices, period: float, middle: float) -> tuple[Indices, float]:
    """Which sample of an even grid each change is, and the grid's period in rows.

    Counted from the middle of the log to both sides, the period made better on the way.
    """
    far, reach = _reach(changed)
    while True:
        own = changed[far < reach]
        period, middle = (float(x) for x in np.polyfit(np.round((own - middle) / period), own, 1))
        if len(own) == len(changed):
            return np.round((changed - middle) / period).astype(np.intp), period
        reach *= 2


def _even(number: Indices, changed: Indices, period: float) -> tuple[float, ...] | None:
    """Period and phase of the even grid of the samples, room and standard deviation of the phase; in rows.

    Its instants stand farthest from the ends of their rows, by the room at least; None if no grid has one in each.

    Phase and period of all that have form a polygon, whose edges are of changes on the convex hull. What is not known
    of the phase is how far the polygon reaches, where the phase is that in the middle of the log.
    """
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull

    middle, reach = float(np.mean(number)), float(np.ptp(number))
    count, left = (number - middle) / reach, changed - period * (number - middle)
    last, size = len(left) - 1, -(-len(left) // _BLOCKS)
    hulls = []
    for way in (1.0, -1.0):  # no corner lies within a line through the outermost changes of each block
        outermost = [i + int(np.argmin(way * left[i : i + size])) for i in range(0, last, size)]
        line = np.unique([0, *outermost, last])
        outside = np.flatnonzero(way * left <= way * np.interp(count, count[line], left[line]))
        points = np.column_stack([count, way * left])[outside]
        corners = ConvexHull(np.vstack([points, [0.0, points[:, 1].max() + 1]])).vertices
        hulls.append(outside[corners[corners < len(outside)]])
    own = np.union1d(*hulls)
    ahead = np.column_stack([np.ones(len(own)), count[own], np.ones(len(own))])
    sides, limits = np.vstack([ahead, ahead * [-1, -1, 1]]), np.r_[left[own], 1 - left[own]]
    every = []
    # Largest room; least and largest phase.
    for goal, least in (((0, 0, -1), None), ((1, 0, 0), 0.0), ((-1, 0, 0), 0.0)):
        found = linprog(goal, sides, limits, bounds=[(None, None), (None, None), (least, None)])
        if not found.success or (least is None and found.x[2] <= _ROOM):
            return None
        every.append(found.x)
    (phase, more, room), (low, *_), (high, *_) = every
    period += more / reach
    return period, phase - period * middle, room, (high - low) / np.sqrt(12)


_FEWEST_AT_LIMIT = 8
_RUN = 3
"""Equal readings in a row that count as standing still."""
_STEPS = 4.0
"""Steps of the reading's own resolution that the force should have changed by meanwhile, were it not at its limit."""


def at_limit(force: Array, place: Array, levels: Iterable[float], among: Mask | None = None) -> Mask:
    """Rows in unbroken stretches of exactly one force while the probe moves on, shape (n,), `among` those that count.

    The probe moves on if, at the slope of the whole log, the force should have changed by more than its resolution. The
    force of one axis [N] has the shape (n,), the place of the probe [m] (n,) or (n, 3), NaN where there is no reading;
    `levels` are the forces that may be an end of the range [N].
    """
    stuck = np.zeros(len(force), bool)
    rows = np.arange(len(force)) if among is None else np.flatnonzero(among)
    step = np.abs(np.diff(force[rows]))
    if not step.any():
        return stuck
    resolution = float(np.percentile(step[step > 0], 5))
    far = _STEPS * resolution * _travel(place) / max(float(np.ptp(force[rows])), 1e-300)
    for level in levels:
        for begin, end in runs(force[rows] == level):
            own = rows[begin:end]
            if len(own) >= _RUN and _travel(place[own[0] : own[-1] + 1]) > far:
                stuck[own] = True
    return stuck if stuck.sum() >= _FEWEST_AT_LIMIT else np.zeros(len(force), bool)


_FLANK = 0.25 / 0.625
"""Mean of the force in the quarter next to either end, beyond that end and by its mean in the whole stretch: 1/(4 s)
where it rises in a straight line for a share s of the stretch and falls in the other; s is 3/8 to 5/8, so that the peak
is in the middle quarter. Half a sine has 0.6, a force that goes one way 0.25."""


def past_end(position: Array, force: Array) -> Mask:
    """Rows in unbroken stretches of exactly the lowest or highest position within which the force rises and falls back.

    A probe that rests has a force that stays, or goes one way as the surface relaxes; one beyond the end of its sensor
    goes on and comes back: on the mean by more than the largest of n normal deviates, sqrt(2 ln n). Position [m] and
    force [N] have the shape (n,).
    """
    rise = np.sign(float(np.cov(position, force)[0, 1]))
    noise = float(np.median(np.abs(np.diff(force, 2)))) / 1.65  # of a normal distribution: 6^0.5 times 0.674
    largest = noise * (2 * np.log(len(force))) ** 0.5
    past = np.zeros(len(force), bool)
    for level, way in ((position.max(), rise), (position.min(), -rise)):
        for begin, end in runs(at_limit(position, force, (level,))):
            first, *own, last = way * force[begin:end]
            inside, quarter = np.array(own), (end - begin + 3) // 4
            beyond = [float(inside.mean()) - at for at in (first, last)]
            near = float(inside[:quarter].mean()) - first, float(inside[-quarter:].mean()) - last
            clear = min(beyond) > largest * (1 + 1 / len(own)) ** 0.5
            past[begin:end] = clear and all(n > _FLANK * b for n, b in zip(near, beyond, strict=True))
    return past


def _travel(place: Array) -> float:
    """How far the probe gets [m]."""
    place = place.reshape(len(place), -1)
    there = place[np.isfinite(place).all(axis=1)]
    return float(np.linalg.norm(np.ptp(there, axis=0))) if len(there) else 0.0
