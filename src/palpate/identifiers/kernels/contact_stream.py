"""From ticks of position and force to samples of a contact: regressor and force, in order, a little late.

A flat array holds all of it: settings, the sensor's clock, the contact, the last positions, the samples on their way
and the sums of those that came through.
"""

from math import floor, inf, isnan

from palpate._jit import law
from palpate.identifiers.kernels.contact_state import (
    CONTACTS,
    FIELDS,
    SAMPLE,
    TOUCHING,
    decide_contact,
    found,
    hear_noise,
    learned,
    limited,
    pending,
)
from palpate.identifiers.kernels.octave_sums import LENGTH, added
from palpate.identifiers.kernels.positions import (
    COUNT,
    FASTEST,
    NUMBERS,
    POWER,
    PRODUCT,
    RESOLVED,
    ROW,
    Positions,
    placed,
)
from palpate.identifiers.kernels.sample_clock import sampled_at
from palpate.signals.low_pass import FRACTIONS

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
def ticked(state, weights, x, force, out):
    """Takes a tick in; writes the samples that are ready to `out`, rows of a, v, x, 1, force, and counts them."""
    room, own = int(state[ROOM]), state[AT_OWN:AT_CLOCK]
    ring = state[AT_RING : AT_RING + 2 * room]
    track = Positions(ring, state[AT_POSITIONS:AT_CONTACT], room, int(state[GAP]), FASTEST * state[DT])
    if isnan(own[ORIGIN]):
        own[ORIGIN] = x
    placed(track, x - own[ORIGIN])
    row = track.numbers[ROW]
    _begun(state, own, row, force)
    queue = state[AT_RING + 2 * room :]
    while own[READ] < own[TAIL] and _regressed(state, weights, track, queue, own):
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
            _released(state, track, queue, k, out, taken)
            taken += 1
    return taken


@law
def _begun(state, own, row, force):
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
def _regressed(state, weights, track, queue, own):
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
    limited(contact, queue[k + 1], queue[k + 4])
    hear_noise(contact, queue[k + 1])
    if state[TOUCH] < 0.0:
        found(contact, queue, state[QUEUE], own[READ], state[SETTLING])
    elif state[TOUCH] > 0.0:
        decide_contact(
            contact, queue, state[QUEUE], own[READ], state[SETTLING], state[TOUCH], state[AVERAGED]
        )
    elif queue[k] >= state[SETTLING]:
        contact[TOUCHING] = contact[CONTACTS] = queue[k + 5] = 1.0


@law
def _released(state, track, queue, k, out, taken):
    """Hands a sample out, and adds it to the sums."""
    n = track.numbers
    out[taken, 0], out[taken, 1], out[taken, 2] = queue[k + 2], queue[k + 3], queue[k + 4]
    out[taken, 3], out[taken, 4] = 1.0, queue[k + 1]
    learned(state[AT_CONTACT:AT_SUMS], queue[k + 2], queue[k + 3], queue[k + 4], queue[k + 1])
    added(
        state[AT_SUMS:AT_RING],
        queue[k + 2],
        queue[k + 3],
        queue[k + 4],
        queue[k + 1],
        queue[k + 5],
        queue[k],
        state[DT],
        n[POWER],
        n[PRODUCT],
        n[COUNT],
    )
