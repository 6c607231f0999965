"""The last positions of a loop, tick by tick: missing readings keep their place, and short gaps are filled."""

from math import isnan
from typing import NamedTuple

from palpate._jit import law, part
from palpate.arrays import Array

NAN = float("nan")
ROW, RESOLVED, GOOD, RUN, LAST_SIXTH, POWER, PRODUCT, COUNT, OPEN, SQUARES, CUBES, ALONE, ACCEPTED, BEFORE = (
    range(14)
)
"""Last row; last row that is final; last row with a reading; readings in a row; of the sixth differences the last one,
the sum of squares, of products of neighbours, and how many; the row before a gap to be filled, -1 for none; of
changes with none before and none after them the sums of squares and of cubes, and how many; the
last reading that was accepted, and the last one."""
NUMBERS = 14
FASTEST = 20.0
"""No robot's tip moves faster [m/s]: delta robots reach 15."""
_FEWEST = 10.0
"""Single counts that show the encoder's step."""
_SIXTH = (1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0)


@part
class Positions(NamedTuple):
    """A ring of positions, each written twice, so that any stretch of it lies in one piece.

    Args:
        ring: relative to the first reading [m], shape (2 room,).
        numbers: see `ROW` and its like.
        room: rows kept.
        gap: ticks that may be missing in a row: of more, motion within the low-pass cannot be interpolated (Nyquist).
        reach: farthest way of a tick [m].
    """

    ring: Array
    numbers: Array
    room: int
    gap: int
    reach: float

    def put(self, row, x):
        """Writes a row."""
        slot = int(row) % self.room
        self.ring[slot] = self.ring[slot + self.room] = x

    def at(self, row):
        """The position of a row."""
        return self.ring[int(row) % self.room]


@law
def placed(positions, x):
    """Takes a tick's position in, NaN where it is missing; a gap is filled a tick after its end."""
    s = positions.numbers
    s[ROW] += 1.0
    row = s[ROW]
    x = _plausible(s, positions.reach, x)
    positions.put(row, x)
    if s[OPEN] >= 0.0:
        _fill(positions, s[OPEN], row - 1.0, x)
        s[OPEN], s[RESOLVED] = -1.0, row - 1.0
    if isnan(x):
        s[RUN] = 0.0
        if row - s[GOOD] > positions.gap or s[GOOD] < 0.0:
            s[RESOLVED] = row
        return
    s[RUN] += 1.0
    missing = row - s[GOOD] - 1.0
    if 0.0 < missing <= positions.gap and s[GOOD] > 0.0:
        s[OPEN] = s[GOOD]
    else:
        s[RESOLVED] = row
    s[GOOD] = row
    _heard(positions)


@law
def _plausible(numbers, reach, x):
    """The reading; NaN where it is farther from the last than a tip moves and the one before does not confirm it."""
    before, numbers[BEFORE] = numbers[BEFORE], x
    away = abs(x - numbers[ACCEPTED]) > reach * (numbers[ROW] - numbers[GOOD])
    if away and not abs(x - before) <= reach and numbers[GOOD] >= 0.0:
        return NAN
    if away:
        numbers[RUN], numbers[GOOD] = 0.0, -1.0
    if not isnan(x):
        numbers[ACCEPTED] = x
    return x


@law
def _fill(positions, before, after, following):
    """Fills a gap by the cubic through two readings on each side; through as many of them as there are."""
    gap = after - before
    x0, x1, x2 = positions.at(before - 1.0), positions.at(before), positions.at(after)
    slope = (x2 - x1) / gap
    bend = (slope - (x1 - x0)) / (gap + 1.0) if not isnan(x0) else 0.0
    twist = 0.0
    if not isnan(x0 + following):
        twist = ((following - x2 - slope) / (gap + 1.0) - bend) / (gap + 2.0)
    row = before + 1.0
    while row < after:
        u = row - before
        positions.put(row, x1 + u * (slope + (u - gap) * (bend + (u + 1.0) * twist)))
        row += 1.0


@law
def _heard(positions):
    """Adds to what the noise of the position is told from: its sixth differences, which hardly see a motion.

    A motion of frequency f counts as (2 pi f dt)^6 of itself: at 40 Hz in 1 kHz, 1/4000.
    """
    s = positions.numbers
    if s[RUN] >= 4.0:
        row = s[ROW]
        x3, x2, x1, x0 = (
            positions.at(row - 3.0),
            positions.at(row - 2.0),
            positions.at(row - 1.0),
            positions.at(row),
        )
        if x3 == x2 and x2 != x1 and x1 == x0:
            s[SQUARES] += (x1 - x2) ** 2
            s[CUBES] += abs(x1 - x2) ** 3
            s[ALONE] += 1.0
    if s[RUN] < 7.0:
        s[LAST_SIXTH] = NAN
        return
    sixth = 0.0
    for k in range(7):
        sixth += _SIXTH[k] * positions.at(s[ROW] - k)
    s[POWER] += sixth * sixth
    if not isnan(s[LAST_SIXTH]):
        s[PRODUCT] += sixth * s[LAST_SIXTH]
        s[COUNT] += 1.0
    else:
        s[POWER] -= sixth * sixth
    s[LAST_SIXTH] = sixth


def step_in(numbers: Array) -> float:
    """Step of the encoder [m]; 0 where too few single counts were seen."""
    return float(numbers[CUBES] / numbers[SQUARES]) if numbers[ALONE] >= _FEWEST else 0.0
