"""Find the sampling times of a sensor that is slower than the log, from the pattern of held readings.

A fresh value appears in the first row after it, so one change gives its time to within a row. An even grid must have
one refresh in each row of a change and none in the others, which leaves a small interval of its phase (1/12 row, for
480 readings a second in a log of 1000 rows).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.signals.samples import runs

_HULL_BLOCKS = 1 << 10
_FRESH_FRACTION = 0.9
_MIN_CHANGES = 10
_FIRST_REACH = 1 << 14
"""Rows on each side of the middle in which the search for the grid begins."""
_MIN_ROOM = 1e-9
"""Least room of the phase, in rows; with less the pattern contradicts a grid."""
_BINS_PER_LINE = 8
"""Bins of the spectrum between lines that the log's length separates."""
_SHORT_STEP_PERCENT = 2.0
"""Percentage of the steps between changes that may be shorter than the period."""


@dataclass(frozen=True)
class SampleClock:
    """The sensor's own samples.

    Args:
        instants: time of each sample, in rows, shape (m,).
        rows: the first row that has it, shape (m,).
        spread: standard deviation of the common phase, in rows.
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
    all_rows = np.arange(len(values))
    in_every_row = SampleClock(all_rows.astype(np.float64), all_rows, 0.0, 1.0)
    if len(changed) < _MIN_CHANGES or len(changed) > _FRESH_FRACTION * len(values):
        return in_every_row
    numbered = [_number(changed, *beat) for beat in _beats(changed)]
    candidates = [_even_grid(number, changed, period) for number, period in numbered]
    grids = [grid for grid in candidates if grid]
    changes_every_row = np.bincount(np.diff(changed)).argmax() == 1
    if not grids and changes_every_row:  # and often the same twice
        return in_every_row
    if not grids:  # each refresh is somewhere in the row before it shows
        middles = changed.astype(np.float64) - 0.5
        spread = float(np.sqrt(1 / 12 / len(changed)))
        _, period = numbered[0]
        return SampleClock(middles, changed, spread, period)
    # The grid with the fewest samples without a change.
    period, phase, room, spread = max(grids, key=lambda grid: grid[0])
    first = int(np.ceil((-0.5 - phase) / period))
    last = int(np.floor((len(values) - 1 - phase) / period))
    instants = phase + np.arange(first, last + 1) * period
    rows = np.ceil(instants - room * 1e-6).astype(np.intp)
    in_log = (rows >= 0) & (rows < len(values))
    return SampleClock(instants[in_log], rows[in_log], spread, period)


def _beats(changed: Indices) -> list[tuple[float, float]]:
    """Candidates of the sampling period, each with the middle of a sample's row.

    They are lines of the changes' spectrum: the strongest that the shortest steps allow, and the line at the mean step,
    which is the period if each sample changes (the lines of a short pattern are equally strong). Equal successive
    samples only weaken the lines. Rows are whole, so a line at f has an image at 1 - f; near period 2 both count.
    """
    distance, reach = _reach(changed)
    near_changes = changed[distance < reach]
    shortest_step = float(np.percentile(np.diff(near_changes), _SHORT_STEP_PERCENT))
    size = 8 << int(near_changes[-1] - near_changes[0]).bit_length()
    pulses = np.zeros(size)
    pulses[near_changes - near_changes[0]] = 1.0
    spectrum = np.fft.rfft(pulses)

    def strongest(first: int, last: int) -> int:
        bins = np.arange(first, last + 1)
        folded = np.minimum(bins, size - bins)
        return int(bins[np.argmax(np.abs(spectrum[folded]))])

    first = int(np.ceil(size / (shortest_step + 1)))
    shortest_period = max(shortest_step - 0.2, 1 / _FRESH_FRACTION)
    last = max(int(size / shortest_period), first)
    best = strongest(first, last)
    duration = float(near_changes[-1] - near_changes[0])
    mean = round(size * (len(near_changes) - 1) / duration)
    lines = {best, strongest(mean - _BINS_PER_LINE, min(mean + _BINS_PER_LINE, size - 1))}
    if first <= size - best <= last:
        lines.add(size - best)
    beats = []
    for line_place in sorted(lines):
        phase = float(np.angle(spectrum[min(line_place, size - line_place)])) / (2 * np.pi)
        if line_place <= size // 2:
            phase = -phase
        period = size / line_place
        beats.append((period, near_changes[0] + period * phase))
    return beats


def _reach(changed: Indices) -> tuple[Indices, int]:
    """Distance of each change from the middle one, and a distance with enough changes to search for the grid."""
    distance = np.abs(changed - changed[len(changed) // 2])
    nearest = np.partition(distance, _MIN_CHANGES - 1)[:_MIN_CHANGES]
    return distance, max(_FIRST_REACH, int(nearest[-1]) + 1)


def _number(changed: Indices, period: float, middle: float) -> tuple[Indices, float]:
    """Number of the even grid's sample at each change, and the grid's period in rows.

    The count goes from the middle of the log to both sides, and refines the period on the way.
    """
    distance, reach = _reach(changed)
    while True:
        near_changes = changed[distance < reach]
        numbers = np.round((near_changes - middle) / period)
        period, middle = np.polyfit(numbers, near_changes, 1).tolist()
        if len(near_changes) == len(changed):
            return np.round((changed - middle) / period).astype(np.intp), period
        reach *= 2


def _even_grid(number: Indices, changed: Indices, period: float) -> tuple[float, ...] | None:
    """Period and phase of the even grid of the samples, room and standard deviation of the phase; in rows.

    The grid's instants are as far as possible from the ends of their rows, at least by the room. None if no grid has
    one instant in each row.

    Phase and period of the possible grids form a polygon, whose edges belong to changes on the convex hull. The
    standard deviation follows from the polygon's range of the phase in the middle of the log.
    """
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull

    middle = float(np.mean(number))
    reach = float(np.ptp(number))
    count = (number - middle) / reach
    residual = changed - period * (number - middle)
    last = len(residual) - 1
    size = -(-len(residual) // _HULL_BLOCKS)
    hulls = []
    for side in (1.0, -1.0):  # no corner lies within a line through the outermost changes of each block
        outermost = [i + int(np.argmin(side * residual[i : i + size])) for i in range(0, last, size)]
        line = np.unique([0, *outermost, last])
        outside = np.flatnonzero(side * residual <= side * np.interp(count, count[line], residual[line]))
        points = np.column_stack([count, side * residual])[outside]
        corners = ConvexHull(np.vstack([points, [0.0, points[:, 1].max() + 1]])).vertices
        hulls.append(outside[corners[corners < len(outside)]])
    corners_used = np.union1d(*hulls)
    ones = np.ones(len(corners_used))
    constraint = np.column_stack([ones, count[corners_used], ones])
    sides = np.vstack([constraint, constraint * [-1, -1, 1]])
    limits = np.r_[residual[corners_used], 1 - residual[corners_used]]
    largest_room = (0, 0, -1), None
    least_phase = (1, 0, 0), 0.0
    largest_phase = (-1, 0, 0), 0.0
    solutions = []
    for goal, min_room in (largest_room, least_phase, largest_phase):
        result = linprog(goal, sides, limits, bounds=[(None, None), (None, None), (min_room, None)])
        if not result.success or (min_room is None and result.x[2] <= _MIN_ROOM):
            return None
        solutions.append(result.x)
    (phase, period_change, room), (low, *_), (high, *_) = solutions
    period += period_change / reach
    return period, phase - period * middle, room, (high - low) / np.sqrt(12)


_MIN_ROWS_AT_LIMIT = 8
_MIN_RUN_AT_LIMIT = 3
"""Equal readings in a row that count as one value."""
_MIN_FORCE_STEPS = 4.0
"""Expected change of the force meanwhile, in steps of its resolution, from which the force is at its limit."""


def at_limit(force: Array, place: Array, levels: Iterable[float], among: Mask | None = None) -> Mask:
    """Rows in unbroken stretches of exactly one force while the probe moves on, shape (n,), `among` those that count.

    The probe moves on if, at the slope of the whole log, the force should have changed by more than its resolution. The
    force of one axis [N] has the shape (n,), the place of the probe [m] (n,) or (n, 3), NaN where there is no reading;
    `levels` are the forces that may be an end of the range [N].
    """
    stuck = np.zeros(len(force), bool)
    rows = np.arange(len(force)) if among is None else np.flatnonzero(among)
    steps = np.abs(np.diff(force[rows]))
    if not steps.any():
        return stuck
    resolution = float(np.percentile(steps[steps > 0], 5))
    force_range = max(float(np.ptp(force[rows])), 1e-300)
    min_travel = _MIN_FORCE_STEPS * resolution * _travel(place) / force_range
    for level in levels:
        for begin, end in runs(force[rows] == level):
            stretch = rows[begin:end]
            if len(stretch) < _MIN_RUN_AT_LIMIT:
                continue
            travel = _travel(place[stretch[0] : stretch[-1] + 1])
            if travel > min_travel:
                stuck[stretch] = True
    return stuck if stuck.sum() >= _MIN_ROWS_AT_LIMIT else np.zeros(len(force), bool)


_MAX_FLANK_RATIO = 0.25 / 0.625
"""Mean of the force in the quarter next to either end, beyond that end and by its mean in the whole stretch: 1/(4 s)
where it rises in a straight line for a fraction s of the stretch and then falls; s is 3/8 to 5/8, so that the peak
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
    for level, sign in ((position.max(), rise), (position.min(), -rise)):
        for begin, end in runs(at_limit(position, force, (level,))):
            first, *inner, last = sign * force[begin:end]
            inside = np.array(inner)
            quarter = (end - begin + 3) // 4
            mean = float(inside.mean())
            heights = mean - first, mean - last
            rise_flank = float(inside[:quarter].mean()) - first
            fall_flank = float(inside[-quarter:].mean()) - last
            is_clear = min(heights) > largest * (1 + 1 / len(inner)) ** 0.5
            rises = rise_flank > _MAX_FLANK_RATIO * heights[0]
            falls = fall_flank > _MAX_FLANK_RATIO * heights[1]
            past[begin:end] = is_clear and rises and falls
    return past


def _travel(place: Array) -> float:
    """Distance that the probe covers [m]."""
    place = place.reshape(len(place), -1)
    known_places = place[np.isfinite(place).all(axis=1)]
    return float(np.linalg.norm(np.ptp(known_places, axis=0))) if len(known_places) else 0.0
