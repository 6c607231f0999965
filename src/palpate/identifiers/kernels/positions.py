"""The last positions of a loop, tick by tick: missing readings keep their place, and short gaps are filled."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._jit import law, part

NAN = float("nan")
ROW, RESOLVED, GOOD, RUN, LAST_SIXTH, POWER, PRODUCT, COUNT = range(8)
"""Last row; last row that is final; last row with a reading; readings in a row; and of the sixth differences the last
one, the sum of squares, of products of neighbours, and how many."""
_SIXTH = (1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0)


@part
class Positions(NamedTuple):
    """A ring of positions, each written twice, so that any stretch of it lies in one piece.

    Args:
        ring: relative to the first reading [m], shape (2 room,).
        numbers: see `ROW` and its like.
        room: rows kept.
        gap: ticks that may be missing in a row: more leave motion within the low-pass untold (Nyquist).
    """

    ring: NDArray[np.float64]
    numbers: NDArray[np.float64]
    room: int
    gap: int

    def put(self, row, x):
        """Writes a row."""
        slot = int(row) % self.room
        self.ring[slot] = self.ring[slot + self.room] = x

    def at(self, row):
        """The position of a row."""
        return self.ring[int(row) % self.room]


@law
def placed(positions, x):
    """Takes a tick's position in, NaN where it is missing, and fills what a gap before it has left open."""
    s = positions.numbers
    s[ROW] += 1.0
    row = s[ROW]
    positions.put(row, x)
    if x != x:
        s[RUN] = 0.0
        if row - s[GOOD] > positions.gap or s[GOOD] < 0.0:
            s[RESOLVED] = row
        return
    s[RUN] += 1.0
    missing = row - s[GOOD] - 1.0
    if 0.0 < missing <= positions.gap and s[GOOD] > 0.0:
        _fill(positions, s[GOOD], row)
    s[GOOD], s[RESOLVED] = row, row
    _heard(positions)


@law
def _fill(positions, before, after):
    """Fills a gap by the parabola through its ends and the reading before it; a line where there is none."""
    x0, x1, x2 = positions.at(before - 1.0), positions.at(before), positions.at(after)
    gap = after - before
    bend = 0.0
    if before >= 1.0 and x0 == x0:
        bend = ((x2 - x1) / gap - (x1 - x0)) / (gap + 1.0)
    row = before + 1.0
    while row < after:
        u = row - before
        positions.put(row, x1 + u * (x2 - x1) / gap + bend * u * (u - gap))
        row += 1.0


@law
def _heard(positions):
    """Adds to what the noise of the position is told from: its sixth differences, which hardly see a motion.

    A motion of frequency f counts as (2 pi f dt)^6 of itself: at 40 Hz in 1 kHz, 1/4000.
    """
    s = positions.numbers
    if s[RUN] < 7.0:
        s[LAST_SIXTH] = NAN
        return
    sixth = 0.0
    for k in range(7):
        sixth += _SIXTH[k] * positions.at(s[ROW] - k)
    s[POWER] += sixth * sixth
    if s[LAST_SIXTH] == s[LAST_SIXTH]:
        s[PRODUCT] += sixth * s[LAST_SIXTH]
        s[COUNT] += 1.0
    else:
        s[POWER] -= sixth * sixth
    s[LAST_SIXTH] = sixth
