"""The regression problem: position and force behind the same front end, at the rows in contact.

The front end is the sensor's own low-pass where that is known and its cut-off is sampled finely enough, else a filter.

In contact, the place of the surface is only an offset, and the first depths are behind the filter's settling. But a
contact whose stiffness grows from zero shows its exponent there more than anywhere. Models that are one-sided by
themselves, with the place of the surface as a parameter, hold before the touch as after it, so nothing has to settle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.errors import InputError
from palpate.identification import filters
from palpate.identification.causes import Code
from palpate.identification.contacts import Contacts
from palpate.identification.filters import Chain, SensorPath
from palpate.identification.models import Motion
from palpate.identification.octaves import Segment, split_segments
from palpate.identification.options import Lag, Options, lag_prior
from palpate.identification.sample_clock import sample_clock_of
from palpate.identification.sampling import Channels
from palpate.signals.low_pass import LowPass
from palpate.signals.position_noise import PositionNoise, noise_in_contacts, position_noise
from palpate.signals.samples import periodogram, runs, white_noise

FREE_ROWS = 64
"""Rows of a stretch out of contact below which it tells nothing of the force's noise."""
_MIN_ROWS = 30


def number_rows(contacts: list[Indices], channels: Channels) -> tuple[Indices, Indices]:
    """The rows of all contacts, and the number of each one's contact; an `InputError` where they are too few."""
    rows = np.concatenate(contacts)
    if len(rows) < _MIN_ROWS:
        too_few = f"only {len(rows)} usable samples in contact; at least {_MIN_ROWS} are needed"
        message = f"{too_few}: log longer or faster"
        lost_rows = [
            warning.text
            for warning in channels.warnings
            if warning.code in (Code.SATURATED, Code.MISSING_SAMPLES)
        ]
        raise InputError(f"{message} ({'; '.join(lost_rows)})" if lost_rows else message)
    return rows, np.repeat(np.arange(len(contacts)), [len(contact_rows) for contact_rows in contacts])


def contact_ends(channels: Channels, contacts: Contacts) -> list[int]:
    """The sample after the last of each contact by the raw force; at least half of the filtered one.

    A filter shows contact for a while after the probe has gone, but what it shows then is no contact any more.
    """
    if contacts.bonded:
        return [end for _, end in contacts.spans]
    clear = max(contacts.threshold, contacts.resting + 4 * white_noise(channels.force))
    found = []
    for begin, end in contacts.spans:
        above = np.flatnonzero(contacts.force_sign * channels.force[begin:end] > clear)
        middle = begin + (end - begin) // 2
        found.append(max(begin + int(above[-1]) + 1, middle) if len(above) else end)
    return found


_MAX_ROWS = 1 << 16
"""Rows that are fitted at most, in pieces spread over the log: more average noise alone, which limits nothing then."""
_PIECE_ROWS = 1 << 14


@dataclass(frozen=True)
class Problem:
    """Data that the models are fitted to.

    Args:
        motion: the position, at the rows in contact.
        force: at these rows, shape (m,).
        spans: number of the contact that each belongs to, shape (m,).
        lag: prior.
        free: the force out of contact behind the same front end, in stretches of rows.
        origin: position of the surface on the log's own scale [m].
        contacts: as found.
        counted: the force is counted from where it rests out of contact, and the rows begin before the touches.
        read: the force before any filter, at the samples of the motion's position, shape (n,); None if it is another's.
        rounding: deviation of a sample of the force by the last digit of the log [N]; 0 behind a sensor, whose readings
            are as white as their noise.
        filtered: lag of the low-pass that the position was sent through, `lag` is the rest [s]; None if none is given.
        with_touches: the same over the rows from shortly before each touch, the force counted from where it rests; None
            if no touch is in the log.
        with_approach: the same from as long before each touch as the contact lasts, where there are so many rows.
    """

    motion: Motion
    force: Array
    spans: Indices
    lag: Lag
    free: tuple[Array, ...]
    origin: float
    contacts: Contacts
    counted: bool = False
    read: Array | None = None
    rounding: float = 0.0
    filtered: float | None = None
    with_touches: Problem | None = None
    with_approach: Problem | None = None

    @property
    def time(self) -> Array:
        """Of each row [s], shape (m,)."""
        return self.motion.chain.times(self.motion.rows)

    @cached_property
    def period(self) -> float:
        """From row to row [s]."""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def segments(self) -> list[Segment]:
        """Stretches of rows without a gap."""
        return split_segments(self.motion.rows, self.spans)

    @property
    def inside(self) -> Indices:
        """Places of all rows that lie in a segment."""
        return np.concatenate([np.arange(s.first, s.last) for s in self.segments])

    @cached_property
    def band(self) -> float:
        """The frequency below which the probe moved [Hz]; infinite if all contacts are too short."""
        return highest_motion(self.motion)

    @property
    def resting(self) -> float:
        """Zero of the force: its mean out of contact, for rows that hold the touches [N]."""
        return self.contacts.resting if self.counted else 0.0

    def at(self, rows: Indices, force: Array, spans: Indices) -> Problem:
        """Replace the rows, with the force there and the number of each one's contact, all of shape (m,)."""
        return replace(self, motion=replace(self.motion, rows=rows, _kept={}), force=force, spans=spans)

    @property
    def in_contact(self) -> Mask:
        """Samples of the position between the first and the last row of a contact, shape (n,)."""
        inside = np.zeros(len(self.motion.position), bool)
        instants = self.motion.instants
        for number in np.unique(self.spans):
            contact_instants = instants[self.spans == number]
            inside[int(contact_instants[0]) : int(np.ceil(contact_instants[-1])) + 1] = True
        return inside


@dataclass(frozen=True)
class Memory:
    """Rows that a front end has, and how long it remembers what was before.

    Args:
        force: at every row of the front end, shape (n,).
        usable: rows that remember valid readings alone, shape (n,).
        begins: first row behind the touch of each contact.
        length: rows that a disturbance is remembered for.
    """

    force: Array
    usable: Mask
    begins: list[int]
    length: int


def with_rows_before_touch(problem: Problem, memory: Memory, reach: int = 0) -> Problem | None:
    """The problem with the rows before each touch, the force counted from its rest; None if no touch is in the log.

    As many before as the filter remembers, and `reach` times those of the contact if there are so many; fewer where the
    contact before is nearer, none where it is too near.
    """
    rows = problem.motion.rows
    spans = problem.spans
    length = memory.length
    added = []
    last_row = 0
    edges = np.flatnonzero(np.diff(spans, prepend=-1))
    for number, contact_rows in zip(spans[edges], np.split(rows, edges[1:]), strict=True):
        begin = memory.begins[number]
        wanted_rows = max(length, reach * int(contact_rows[-1] - contact_rows[0]))
        first = max(begin - wanted_rows, last_row + length, length)
        if first < begin:
            step = int(contact_rows[1] - contact_rows[0]) if len(contact_rows) > 1 else 1
            added_rows = np.arange(contact_rows[0] - step, first - 1, -step)
            added += [(row, number) for row in added_rows if memory.usable[row]]
        last_row = int(contact_rows[-1])
    if not added:
        return None
    added_rows, added_numbers = np.array(added, dtype=np.intp).T
    all_rows = np.r_[rows, added_rows]
    order = np.argsort(all_rows)
    ordered_rows = all_rows[order]
    force = memory.force[ordered_rows] - problem.contacts.resting
    return replace(problem.at(ordered_rows, force, np.r_[spans, added_numbers][order]), counted=True)


def thin_rows(problem: Problem) -> Problem:
    """Limit the number of rows, in evenly spaced unbroken pieces."""
    wider_problems = problem.with_touches, problem.with_approach
    touches, approach = (wider_problem and thin_rows(wider_problem) for wider_problem in wider_problems)
    rows = problem.motion.rows
    thinned = problem
    if len(rows) > _MAX_ROWS:
        pieces = -(-len(rows) // _PIECE_ROWS)
        stride = -(-pieces * _PIECE_ROWS // _MAX_ROWS)
        is_kept = (np.arange(len(rows)) // _PIECE_ROWS) % stride == 0
        thinned = problem.at(rows[is_kept], problem.force[is_kept], problem.spans[is_kept])
    return replace(thinned, with_touches=touches, with_approach=approach)


_MAX_SPECTRA = 32
"""Contacts at most whose spectra are summed: their mean has then a relative deviation of 1/sqrt(32), a sixth."""
_MAX_CONTACT_STEP = 3.0
"""Usual steps between two rows from which they are of two contacts: one or two lost readings are no end."""
_MOTION_ENERGY = 0.99
"""Share of the speed's energy that lies below the highest frequency of a motion."""
_TAPER = 0.1
"""Share of a stretch in the cosine ends of its window, which cost half of that: a twentieth of the stretch."""


def highest_motion(motion: Motion) -> float:
    """The frequency below which the position moved while it was fitted [Hz]; infinite if all contacts are too short.

    Below it lies 99 % of the energy of the probe's speed in the contacts (the longest, where they are many), as far as
    that stands above the position's own noise. Where a clean spectrum at last meets its floor is far above that, and no
    motion.
    """
    rows = motion.instants.astype(np.intp)
    steps = np.diff(rows)
    contacts = np.split(rows, np.flatnonzero(steps > _MAX_CONTACT_STEP * np.median(steps)) + 1)
    stretches = [motion.position[contact[0] : contact[-1] + 1] for contact in contacts]
    long_enough = [
        stretch
        for stretch in sorted(stretches, key=len)[-_MAX_SPECTRA:]
        if len(stretch) >= filters.MIN_SPECTRUM_SAMPLES
    ]
    if not long_enough:
        return float("inf")
    spectra = []
    for stretch in long_enough:
        speed = np.diff(stretch)
        frequency, power = periodogram(speed, _TAPER)
        noise = position_noise([stretch])
        floor = 2 * (noise.jump**2 + noise.white**2 * 4 * np.sin(np.pi * frequency) ** 2)
        motion_power = np.where(power > filters.MIN_POWER_OVER_NOISE * floor, power, 0.0)
        spectra.append((frequency, motion_power * len(speed) / len(frequency)))
    frequency, energy = (np.concatenate(parts) for parts in zip(*spectra, strict=True))
    order = np.argsort(frequency, kind="stable")
    below = np.cumsum(energy[order])
    lowest = 1 / max(map(len, long_enough))
    return (
        max(float(frequency[order][np.searchsorted(below, _MOTION_ENERGY * below[-1])]), lowest)
        / motion.chain.dt
    )


_MAX_SETTLING_FRACTION = 0.05
"""Share of a contact that waiting until a filter has forgotten all may cost."""
_MIN_READINGS_PER_PERIOD = 4.0
"""Readings in a period of a sensor's cut-off below which its own path is not used: the position would not show it."""


def build_problem(channels: Channels, chain: Chain, contacts: Contacts, options: Options) -> Problem:
    """Build the problem of a log.

    Args:
        channels: as the contacts were found in.
        chain: behind which they were found.
        contacts: at least one.
        options: what is known of lag, mass and the sensor's low-pass.

    Raises:
        InputError: too few rows in contact.
    """
    low_pass = options.force_filter
    slowest = _MIN_READINGS_PER_PERIOD * channels.raw.dt
    if low_pass is not None and low_pass.roll_off >= 2 and slowest * low_pass.cutoff <= 1:
        problem, memory = _behind_sensor(channels, low_pass, chain, contacts, options)
    else:
        problem, memory = _behind_filter(channels, chain, contacts, options)
    if contacts.bonded:
        return problem
    touches, approach = (with_rows_before_touch(problem, memory, reach) for reach in (0, 1))
    return replace(problem, with_touches=touches, with_approach=approach)


def _behind_filter(
    channels: Channels, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels behind the chain; a known low-pass of the force is applied to the position too."""
    position = channels.position
    filtered = None
    lag_given = options.lag
    if options.force_filter is not None:
        position = filters.low_passed(position, options.force_filter, channels.dt)
        filtered = options.force_filter.lag
        lag_given = None if lag_given is None else lag_given - filtered
    position = contacts.position_sign * position
    read = contacts.force_sign * channels.force
    lag = lag_prior(lag_given, options.lag_std, 1 / channels.rate, 0.0, options.mass)
    force = chain(read)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * chain(position, 2, lag.value)
    memory = int(np.ceil(chain.settling / chain.dt))
    usable = channels.valid  # where nothing invalid lies within the filter's memory
    if not usable.all():
        bad = np.r_[0, np.cumsum(~usable)]
        index = np.arange(len(usable))
        usable = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    step = max(int(1 / (8 * chain.cutoff * chain.dt)), 1)  # eight rows in a period of the cut-off hold all
    inside = []
    for (begin, end), last in zip(contacts.spans, contact_ends(channels, contacts), strict=True):
        contact_rows = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        inside.append(contact_rows[usable[contact_rows]])
    rows, spans = number_rows(inside, channels)
    delayed_position = chain(position, 0, lag.value)
    # The position at the onset; the least in contact, if no onset is in the log.
    onsets = [delayed_position[begin] for begin, _ in contacts.spans if begin > 0] or [
        delayed_position[rows].min()
    ]
    origin = float(np.mean(delayed_position[rows] if contacts.bonded else onsets))
    position = position - origin
    settling_rows = int(chain.settling / chain.dt)
    is_free = channels.valid.copy()
    for begin, end in contacts.spans:
        is_free[max(begin - settling_rows, 0) : end + settling_rows] = False
    stretches = [] if contacts.bonded else runs(is_free)
    problem = Problem(
        motion=Motion(
            chain, position, rows, contacts.bonded, _noise(position, rows, spans, channels.rounding[0])
        ),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=tuple(
            force[first + settling_rows : past : step]
            for first, past in stretches
            if past - first - settling_rows >= FREE_ROWS * step
        ),
        origin=origin,
        contacts=contacts,
        read=read if contacts.payload is None else None,
        rounding=channels.rounding[1],
        filtered=filtered,
    )
    return problem, Memory(force, usable, [begin for begin, _ in contacts.spans], memory)


def _settling(chain: Chain, begin: int, length: int) -> int:
    """Samples to leave out after a touch, which the filter's own delay has already eaten some of.

    Until a disturbance has decayed to 1 %, or to nothing where that costs little of the contact. At the first sample
    of a log there has been no delay: the filter has yet to learn how the probe was moving.
    """
    elapsed = chain.delay if begin > 0 else 0.0
    thorough = int(np.ceil((chain.thorough_settling - elapsed) / chain.dt))
    if thorough < _MAX_SETTLING_FRACTION * length:
        return thorough
    return min(int(np.ceil((chain.settling - elapsed) / chain.dt)), length // 4)


def _noise(position: Array, rows: Indices, spans: Indices, rounding: float) -> PositionNoise:
    """Noise of the position: white by its highest differences, and the jumps of an encoder where its counts are seen.

    No less than what the log's last digit hides, which does not show where the probe rests; nor than what counts are
    seen to hide in contact, which is all of them where each reading is counts away from the one before.
    """
    estimate = noise_in_contacts(position, rows, spans)
    min_white = min(estimate.white, estimate.count / 12**0.5) if estimate.count else rounding
    return PositionNoise(
        max(white_noise(position), min_white), estimate.jump if estimate.count else 0.0, estimate.count
    )


def _behind_sensor(
    channels: Channels, low_pass: LowPass, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels as the sensor samples them."""
    raw = channels.raw
    clock = sample_clock_of(raw.held_force)
    path = SensorPath(low_pass, raw.start, raw.dt, clock.instants, clock.period * raw.dt)
    time = raw.start + clock.instants * raw.dt
    before, after = path.reach
    path_in_log = clock.instants > low_pass.lag / path.dt + before  # the way through the sensor is in the log
    usable: Mask = path_in_log & (clock.instants < len(raw.position) - after) & raw.valid[clock.rows]
    inside = []
    begins = []
    free = np.full(len(time), not contacts.bonded)
    for (begin, end), last in zip(contacts.spans, contact_ends(channels, contacts), strict=True):
        first, end_time = (channels.start + i * channels.dt for i in (begin, end))
        touch_time = first - (0.0 if contacts.bonded or begin == 0 else chain.delay)
        begins.append(int(np.searchsorted(time, touch_time)))
        settled_time = touch_time + (0.0 if contacts.bonded and begin == 0 else path.settling)
        first_row, past_row = np.searchsorted(time, [settled_time, channels.start + last * channels.dt])
        inside.append(first_row + np.flatnonzero(usable[first_row:past_row]))
        free_again = np.searchsorted(time, end_time + chain.settling, side="right")
        free[np.searchsorted(time, first - chain.settling) : free_again] = False
    rows, spans = number_rows(inside, channels)
    position = contacts.position_sign * raw.position
    log_rows = clock.rows[rows]
    origin = float(position[log_rows].mean() if contacts.bonded else position[log_rows].min())
    position = position - origin
    force = contacts.force_sign * raw.held_force[clock.rows]
    spread = float(np.hypot(options.lag_std, clock.spread * raw.dt))
    lag = lag_prior(options.lag, spread, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    problem = Problem(
        motion=Motion(
            path, position, rows, contacts.bonded, noise=noise_in_contacts(position, log_rows, spans)
        ),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=tuple(
            force[first_row:past_row]
            for first_row, past_row in runs(free)
            if past_row - first_row >= FREE_ROWS
        ),
        origin=origin,
        contacts=contacts,
        filtered=0.0,
    )
    return problem, Memory(force, usable, begins, int(np.ceil(path.settling / path.period)))
