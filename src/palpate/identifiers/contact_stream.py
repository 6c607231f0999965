"""From ticks of position and force to samples of a contact: regressor and force, in order, a little late.

A flat array holds all of it: settings, the sensor's clock, the contact, the last positions, the samples on their way
and the sums of those that came through. Missing readings of the position keep their place, and short gaps are filled.

The clock gives the instants at which a force sensor slower than the loop puts out its samples, from the rows that
change. A change seen in a row says that a sample came out since the row before it; the rows seen so far leave the phase
of an even grid in a small interval, whose middle is taken.
"""

from math import floor, inf, isnan
from typing import NamedTuple

from palpate._jit import law, part
from palpate.arrays import Array
from palpate.identifiers.contact_state import (
    CONTACTS,
    FIELDS,
    SAMPLE,
    TOUCHING,
    decide_contact,
    find_contact,
    follow_saturation,
    hear_noise,
    is_outlier,
    learn_in_contact,
    pending,
)
from palpate.identifiers.octave_sums import LENGTH, add_sample
from palpate.signals.low_pass import FRACTIONS

NAN = float("nan")
(
    ROW,
    RESOLVED,
    GOOD,
    RUN,
    LAST_SIXTH,
    POWER,
    PRODUCT,
    COUNT,
    OPEN,
    SQUARES,
    CUBES,
    ALONE,
    ACCEPTED,
    BEFORE_POSITION,
) = range(14)
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
        """Writes a row into the ring."""
        slot = int(row) % self.room
        self.ring[slot] = self.ring[slot + self.room] = x

    def at(self, row):
        """The position of a row."""
        return self.ring[int(row) % self.room]


@law
def take_position(positions, x):
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
    _add_differences(positions)


@law
def _plausible(numbers, reach, x):
    """The reading; NaN where it is farther from the last than a tip moves and the one before does not confirm it."""
    before, numbers[BEFORE_POSITION] = numbers[BEFORE_POSITION], x
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
def _add_differences(positions):
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


LOW, HIGH, LAST = 0, 1, 2
"""Where the phase's interval and the number of the last sample stand in a clock."""
CLOCK_FIELDS = 3
UNSET = (-inf, inf, -1.0)
"""A clock that no sample was seen of."""
_ROOM = 1e-9
"""Of a period, for the rounding of an instant that falls on a row."""


@law
def sampled_at(clock, row, changed, certain, period):
    """The instant of the sample that this row shows for the first time, in rows; infinite if it shows none.

    Args:
        clock: changed in place.
        row: number of the row.
        changed: whether its reading is another than the one before.
        certain: whether the row before had a reading, so that a change happened between the two.
        period: rows between two samples, at least 1.
    """
    if changed and certain:
        _narrow(clock, row, period)
    elif not clock[HIGH] < inf:
        return inf
    else:
        number = clock[LAST] + 1.0 if certain else floor((row - clock[HIGH]) / period + _ROOM)
        if number <= clock[LAST] or clock[HIGH] + number * period > row:
            return inf
        clock[LAST] = number
    return 0.5 * (clock[LOW] + clock[HIGH]) + clock[LAST] * period


@law
def _narrow(clock, row, period):
    low, high = clock[LOW], clock[HIGH]
    if not high < inf:
        clock[LOW], clock[HIGH], clock[LAST] = row - 1.0, row, 0.0
        return
    number = floor((row - 1.0 - high) / period + _ROOM) + 1.0  # the first that may have come out since
    if low + number * period > row:  # the clock drifts: the nearest
        number = floor((row - 0.5 - 0.5 * (low + high)) / period + 0.5)
    clock[LAST] = max(number, clock[LAST])
    start = clock[LAST] * period
    low, high = max(low, row - 1.0 - start), min(high, row - start)
    if low >= high - _ROOM:  # it comes after `low`, and no later than `high`
        low, high = row - 1.0 - start, row - start
    clock[LOW], clock[HIGH] = low, high


AHEAD = 2.0
"""Samples after one, by which it is judged whether it is an outlier."""
_EVEN = 6.0
"""Periods within which five samples lie that are not apart by a gap."""
ROOM, GAP, QUEUE, PERIOD, LATE, BEFORE, AFTER, SETTLING, HOLD, TOUCH, AVERAGED, DT = range(12)
"""Rows kept of the position; ticks of a gap that is filled; samples on their way at most; rows between two samples, 0
where each row has one; lag beyond the low-pass [rows]; taps; rows until the low-pass has forgotten; rows that a
sample waits; force of a touch [N], 0 for always, -1 to be found; samples averaged for it; a row [s]."""
SETTINGS = 12
ORIGIN, FORCE, HEAD, READ, TAIL, FRESH = 0, 1, 2, 3, 4, 5
"""First position [m]; last force [N]; samples released, with a regressor, and begun; the row of the last force."""
OWN = 6
AT_OWN = SETTINGS
AT_CLOCK = AT_OWN + OWN
AT_POSITIONS = AT_CLOCK + 3
AT_CONTACT = AT_POSITIONS + NUMBERS
AT_SUMS = AT_CONTACT + FIELDS
AT_RING = AT_SUMS + LENGTH


@law
def take_tick(state, weights, x, force, out):
    """Takes a tick in; writes the samples that are ready to `out`, rows of a, v, x, 1, force, and counts them."""
    room, own = int(state[ROOM]), state[AT_OWN:AT_CLOCK]
    ring = state[AT_RING : AT_RING + 2 * room]
    track = Positions(ring, state[AT_POSITIONS:AT_CONTACT], room, int(state[GAP]), FASTEST * state[DT])
    if isnan(own[ORIGIN]):
        own[ORIGIN] = x
    take_position(track, x - own[ORIGIN])
    row = track.numbers[ROW]
    _begin(state, own, row, force)
    queue = state[AT_RING + 2 * room :]
    period = max(state[PERIOD], 1.0)
    while own[READ] < own[TAIL] and not _awaits(state, queue, own, row, period):
        if not _regress(state, weights, track, queue, own):
            break
        if is_outlier(state[AT_CONTACT:AT_SUMS], queue, state[QUEUE], own[READ], _EVEN * period):
            _leave_out(state, queue, own)
        own[READ] += 1.0
        _in_contact(state, queue, own)
    taken, contact, most = 0, state[AT_CONTACT:AT_SUMS], state[QUEUE] - 2.0
    longest = 0.5 * state[QUEUE]
    while own[HEAD] < own[READ]:
        k = int(own[HEAD] % state[QUEUE]) * SAMPLE
        waits = row - queue[k] < longest and own[TAIL] - own[HEAD] < most
        if queue[k] + state[HOLD] > row or (waits and pending(contact, queue[k])):
            break
        own[HEAD] += 1.0
        if queue[k + 5] > 0.0:
            _release(state, track, queue, k, out, taken)
            taken += 1
    return taken


@law
def _awaits(state, queue, own, row, period):
    """True while the samples after the next one, by which it is judged, are still to come."""
    sampled = queue[int(own[READ] % state[QUEUE]) * SAMPLE]
    return own[TAIL] - own[READ] <= AHEAD and row - sampled <= (AHEAD + 0.5) * period


@law
def _leave_out(state, queue, own):
    """Makes the next sample one without a regressor, its force the mean of its neighbours'."""
    before = int((own[READ] - 1.0) % state[QUEUE]) * SAMPLE
    k = int(own[READ] % state[QUEUE]) * SAMPLE
    after = int((own[READ] + 1.0) % state[QUEUE]) * SAMPLE
    queue[k + 1], queue[k + 2] = 0.5 * (queue[before + 1] + queue[after + 1]), NAN


@law
def _begin(state, own, row, force):
    """Sends a sample on its way, if this row shows one."""
    if isnan(force):
        return
    certain = own[FRESH] == row - 1.0
    changed = force != own[FORCE]
    own[FORCE], own[FRESH] = force, row
    instant = row
    if state[PERIOD] > 0.0:
        instant = sampled_at(state[AT_CLOCK:AT_POSITIONS], row, changed, certain, state[PERIOD])
    if instant < inf:
        queue = state[AT_RING + 2 * int(state[ROOM]) :]
        k = int(own[TAIL] % state[QUEUE]) * SAMPLE
        own[TAIL] += 1.0
        queue[k], queue[k + 1], queue[k + 5] = instant, force, 0.0


@law
def _regress(state, weights, track, queue, own):
    """Reads the position through the low-pass at the next sample's instant; False while a row of it is missing."""
    k = int(own[READ] % state[QUEUE]) * SAMPLE
    late = queue[k] - state[LATE]
    whole = floor(late)
    if whole + state[AFTER] > track.numbers[RESOLVED] or late > track.numbers[ROW]:
        return False
    place = floor((late - whole) * FRACTIONS + 0.5)
    first = whole - state[BEFORE]
    if first < 0.0:
        queue[k + 2] = queue[k + 3] = queue[k + 4] = track.ring[0] * inf
        return True
    start, part = int(first) % track.room, int(place)
    a = v = x = 0.0
    for i in range(weights.shape[2]):
        position = track.ring[start + i]
        a += weights[part, 0, i] * position
        v += weights[part, 1, i] * position
        x += weights[part, 2, i] * position
    queue[k + 2], queue[k + 3], queue[k + 4] = a, v, x
    return True


@law
def _in_contact(state, queue, own):
    """Decides whether the sample whose regressor was just read belongs to a contact."""
    contact = state[AT_CONTACT:AT_SUMS]
    k = int((own[READ] - 1.0) % state[QUEUE]) * SAMPLE
    if not abs(queue[k + 2] + queue[k + 3] + queue[k + 4]) < inf:
        return
    follow_saturation(contact, queue[k + 1], queue[k + 4])
    hear_noise(contact, queue[k + 1])
    if state[TOUCH] < 0.0:
        find_contact(contact, queue, state[QUEUE], own[READ], state[SETTLING])
    elif state[TOUCH] > 0.0:
        decide_contact(
            contact, queue, state[QUEUE], own[READ], state[SETTLING], state[TOUCH], state[AVERAGED]
        )
    elif queue[k] >= state[SETTLING]:
        contact[TOUCHING] = contact[CONTACTS] = queue[k + 5] = 1.0


@law
def _release(state, track, queue, k, out, taken):
    """Hands a sample out, and adds it to the sums."""
    n = track.numbers
    out[taken, 0], out[taken, 1], out[taken, 2] = queue[k + 2], queue[k + 3], queue[k + 4]
    out[taken, 3], out[taken, 4] = 1.0, queue[k + 1]
    learn_in_contact(state[AT_CONTACT:AT_SUMS], queue[k + 2], queue[k + 3], queue[k + 4], queue[k + 1])
    add_sample(
        state[AT_SUMS:AT_RING],
        queue[k + 2],
        queue[k + 3],
        queue[k + 4],
        queue[k + 1],
        queue[k + 5],
        queue[k],
        state[DT],
        (n[POWER], n[PRODUCT], n[COUNT]),
    )
