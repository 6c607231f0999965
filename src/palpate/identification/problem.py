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
from palpate.identification.filters import Chain, PositionNoise, SensorPath
from palpate.identification.models import Motion
from palpate.identification.options import Lag, Options, lag_prior
from palpate.identification.sample_clock import sample_clock_of
from palpate.identification.sampling import Channels
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import periodogram, runs, white_noise

FREE_ROWS = 64
"""Rows of a stretch out of contact below which it tells nothing of the force's noise."""
_FEWEST = 30


def number_rows(contacts: list[Indices], channels: Channels) -> tuple[Indices, Indices]:
    """The rows of all contacts, and the number of each one's contact; an `InputError` where they are too few."""
    rows = np.concatenate(contacts)
    if len(rows) < _FEWEST:
        few = f"only {len(rows)} usable samples in contact; at least {_FEWEST} are needed"
        text = f"{few}: log longer or faster"
        lost = [w.text for w in channels.warnings if w.code in (Code.SATURATED, Code.MISSING_SAMPLES)]
        raise InputError(f"{text} ({'; '.join(lost)})" if lost else text)
    return rows, np.repeat(np.arange(len(contacts)), [len(own) for own in contacts])


def ends(channels: Channels, contacts: Contacts) -> list[int]:
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


_MOST_ROWS = 1 << 16
"""Rows that are fitted at most, in pieces spread over the log: more average noise alone, which limits nothing then."""
_PIECE = 1 << 14


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
    def band(self) -> float:
        """The frequency below which the probe moved [Hz]; infinite if all contacts are too short."""
        return highest_motion(self.motion)

    @property
    def resting(self) -> float:
        """Zero of the force: its mean out of contact, for rows that hold the touches [N]."""
        return self.contacts.resting if self.counted else 0.0

    def at(self, rows: Indices, force: Array, spans: Indices) -> Problem:
        """The same at other rows, with the force there and the number of each one's contact, all of shape (m,)."""
        return replace(self, motion=replace(self.motion, rows=rows, _kept={}), force=force, spans=spans)

    @property
    def in_contact(self) -> Mask:
        """Samples of the position between the first and the last row of a contact, shape (n,)."""
        found = np.zeros(len(self.motion.position), bool)
        instants = self.motion.instants
        for number in np.unique(self.spans):
            own = instants[self.spans == number]
            found[int(own[0]) : int(np.ceil(own[-1])) + 1] = True
        return found


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


def touching(problem: Problem, memory: Memory, reach: int = 0) -> Problem | None:
    """The problem with the rows before each touch, the force counted from its rest; None if no touch is in the log.

    As many before as the filter remembers, and `reach` times those of the contact if there are so many; fewer where the
    contact before is nearer, none where it is too near.
    """
    rows, spans, length = problem.motion.rows, problem.spans, memory.length
    before, left = [], 0
    edges = np.flatnonzero(np.diff(spans, prepend=-1))
    for number, own in zip(spans[edges], np.split(rows, edges[1:]), strict=True):
        begin, wanted = memory.begins[number], max(length, reach * int(own[-1] - own[0]))
        first = max(begin - wanted, left + length, length)
        if first < begin:
            step = int(own[1] - own[0]) if len(own) > 1 else 1
            fresh = np.arange(own[0] - step, first - 1, -step)
            before += [(row, number) for row in fresh if memory.usable[row]]
        left = int(own[-1])
    if not before:
        return None
    fresh, numbers = np.array(before, dtype=np.intp).T
    every = np.r_[rows, fresh]
    order = np.argsort(every)
    at = every[order]
    force = memory.force[at] - problem.contacts.resting
    return replace(problem.at(at, force, np.r_[spans, numbers][order]), counted=True)


def with_fewer_rows(problem: Problem) -> Problem:
    """The same with so many rows at most, in evenly spaced unbroken pieces."""
    wider = problem.with_touches, problem.with_approach
    touches, approach = (own and with_fewer_rows(own) for own in wider)
    rows, fewer = problem.motion.rows, problem
    if len(rows) > _MOST_ROWS:
        pieces = -(-len(rows) // _PIECE)
        every = -(-pieces * _PIECE // _MOST_ROWS)
        kept = (np.arange(len(rows)) // _PIECE) % every == 0
        fewer = problem.at(rows[kept], problem.force[kept], problem.spans[kept])
    return replace(fewer, with_touches=touches, with_approach=approach)


_CONTACTS = 32
"""Contacts at most whose spectra are summed: their mean has then a relative deviation of 1/sqrt(32), a sixth."""
_APART = 3.0
"""Usual steps between two rows from which they are of two contacts: one or two lost readings are no end."""
_MOST = 0.99
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
    step = np.diff(rows)
    contacts = np.split(rows, np.flatnonzero(step > _APART * np.median(step)) + 1)
    stretches = [motion.position[own[0] : own[-1] + 1] for own in contacts]
    told = [
        stretch
        for stretch in sorted(stretches, key=len)[-_CONTACTS:]
        if len(stretch) >= filters.FEWEST_SEGMENT
    ]
    if not told:
        return float("inf")
    spectra = []
    for stretch in told:
        speed = np.diff(stretch)
        frequency, power = periodogram(speed, _TAPER)
        noise = filters.position_noise([stretch])
        floor = 2 * (noise.jump**2 + noise.white**2 * 4 * np.sin(np.pi * frequency) ** 2)
        seen = np.where(power > filters.ABOVE_FLOOR * floor, power, 0.0)
        spectra.append((frequency, seen * len(speed) / len(frequency)))
    frequency, energy = (np.concatenate(parts) for parts in zip(*spectra, strict=True))
    order = np.argsort(frequency, kind="stable")
    below = np.cumsum(energy[order])
    least = 1 / max(map(len, told))
    return max(float(frequency[order][np.searchsorted(below, _MOST * below[-1])]), least) / motion.chain.dt


_LONG = 0.05
"""Share of a contact that waiting until a filter has forgotten all may cost."""
_COARSEST = 4.0
"""Readings in a period of a sensor's cut-off below which its own path is not used: the position would not show it."""


def problem_of(channels: Channels, chain: Chain, contacts: Contacts, options: Options) -> Problem:
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
    if low_pass is not None and low_pass.roll_off >= 2 and _COARSEST * low_pass.cutoff * channels.raw.dt <= 1:
        problem, memory = _behind_sensor(channels, low_pass, chain, contacts, options)
    else:
        problem, memory = _behind_filter(channels, chain, contacts, options)
    if contacts.bonded:
        return problem
    touches, approach = (touching(problem, memory, reach) for reach in (0, 1))
    return replace(problem, with_touches=touches, with_approach=approach)


def _behind_filter(
    channels: Channels, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels behind the chain; a known low-pass of the force is applied to the position too."""
    position, filtered, told = channels.position, None, options.lag
    if options.force_filter is not None:
        position = filters.low_passed(position, options.force_filter, channels.dt)
        filtered = options.force_filter.lag
        told = None if told is None else told - filtered
    position, read = contacts.position_sign * position, contacts.force_sign * channels.force
    lag = lag_prior(told, options.lag_std, 1 / channels.rate, 0.0, options.mass)
    force = chain(read)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * chain(position, 2, lag.value)
    memory = int(np.ceil(chain.settling / chain.dt))
    usable = channels.valid  # where nothing invalid lies within the filter's memory
    if not usable.all():
        bad, index = np.r_[0, np.cumsum(~usable)], np.arange(len(usable))
        usable = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    step = max(int(1 / (8 * chain.cutoff * chain.dt)), 1)  # eight rows in a period of the cut-off hold all
    inside = []
    for (begin, end), last in zip(contacts.spans, ends(channels, contacts), strict=True):
        own = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        inside.append(own[usable[own]])
    rows, spans = number_rows(inside, channels)
    whole = chain(position, 0, lag.value)
    # The position at the onset; the least in contact, if no onset is in the log.
    onsets = [whole[begin] for begin, _ in contacts.spans if begin > 0] or [whole[rows].min()]
    origin = float(np.mean(whole[rows] if contacts.bonded else onsets))
    position = position - origin
    guard, out = int(chain.settling / chain.dt), channels.valid.copy()
    for begin, end in contacts.spans:
        out[max(begin - guard, 0) : end + guard] = False
    stretches = [] if contacts.bonded else runs(out)
    problem = Problem(
        motion=Motion(
            chain, position, rows, contacts.bonded, _noise(position, rows, spans, channels.rounding[0])
        ),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=tuple(force[a + guard : b : step] for a, b in stretches if b - a - guard >= FREE_ROWS * step),
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
    eaten = chain.delay if begin > 0 else 0.0
    thorough = int(np.ceil((chain.thorough_settling - eaten) / chain.dt))
    if thorough < _LONG * length:
        return thorough
    return min(int(np.ceil((chain.settling - eaten) / chain.dt)), length // 4)


def _noise(position: Array, rows: Indices, spans: Indices, rounding: float) -> PositionNoise:
    """That of the position: white by its highest differences, and the jumps of an encoder where its counts are seen.

    No less than what the log's last digit hides, which does not show where the probe rests; nor than what counts are
    seen to hide in contact, which is all of them where each reading is counts away from the one before.
    """
    found = filters.noise_within(position, rows, spans)
    least = min(found.white, found.count / 12**0.5) if found.count else rounding
    return PositionNoise(max(white_noise(position), least), found.jump if found.count else 0.0, found.count)


def _behind_sensor(
    channels: Channels, low_pass: LowPass, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels as the sensor samples them."""
    raw = channels.raw
    clock = sample_clock_of(raw.held_force)
    path = SensorPath(low_pass, raw.start, raw.dt, clock.instants, clock.period * raw.dt)
    time = raw.start + clock.instants * raw.dt
    before, after = path.reach
    known = clock.instants > low_pass.lag / path.dt + before  # the way through the sensor is in the log
    usable: Mask = known & (clock.instants < len(raw.position) - after) & raw.valid[clock.rows]
    inside, begins, free = [], [], np.full(len(time), not contacts.bonded)
    for (begin, end), last in zip(contacts.spans, ends(channels, contacts), strict=True):
        first, past = (channels.start + i * channels.dt for i in (begin, end))
        touched = first - (0.0 if contacts.bonded or begin == 0 else chain.delay)
        begins.append(int(np.searchsorted(time, touched)))
        settled = touched + (0.0 if contacts.bonded and begin == 0 else path.settling)
        a, b = np.searchsorted(time, [settled, channels.start + last * channels.dt])
        inside.append(a + np.flatnonzero(usable[a:b]))
        out = np.searchsorted(time, past + chain.settling, side="right")
        free[np.searchsorted(time, first - chain.settling) : out] = False
    rows, spans = number_rows(inside, channels)
    position = contacts.position_sign * raw.position
    whole = clock.rows[rows]
    origin = float(position[whole].mean() if contacts.bonded else position[whole].min())
    position = position - origin
    force = contacts.force_sign * raw.held_force[clock.rows]
    spread = float(np.hypot(options.lag_std, clock.spread * raw.dt))
    lag = lag_prior(options.lag, spread, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    problem = Problem(
        motion=Motion(
            path, position, rows, contacts.bonded, noise=filters.noise_within(position, whole, spans)
        ),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=tuple(force[a:b] for a, b in runs(free) if b - a >= FREE_ROWS),
        origin=origin,
        contacts=contacts,
        filtered=0.0,
    )
    return problem, Memory(force, usable, begins, int(np.ceil(path.settling / path.period)))
