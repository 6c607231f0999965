"""What is fitted: position and force behind one and the same front end, at the rows in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.contacts import Contacts
from palpate.identification.filters.bandwidth import highest_motion
from palpate.identification.filters.filter_bank import low_passed
from palpate.identification.filters.position_noise import PositionNoise, noise_within
from palpate.identification.filters.sensor_path import SensorPath
from palpate.identification.filters.state_variable import Chain, white_noise
from palpate.identification.models import Motion
from palpate.identification.options import Options
from palpate.identification.prior import Lag, lag_prior
from palpate.identification.sample_clock import SampleClock, sample_clock_of
from palpate.identification.sampling import Channels
from palpate.identification.touch import Touch, touching
from palpate.identification.warning_codes import Code

Rows = NDArray[np.intp]

_FEWEST = 30
_COARSEST = 4.0
"""Readings in a period of a sensor's cut-off below which its own path is not used: the position would not show it."""
_LONG = 0.05
_FREE_ROWS = 64


class FrontEnd(Protocol):
    """The way of both channels into the regression."""

    @property
    def period(self) -> float:
        """From row to row [s]."""

    @property
    def dt(self) -> float:
        """Sampling period of the position [s]."""

    @property
    def cutoff(self) -> float:
        """Frequency up to which it passes [Hz]."""

    @property
    def settling(self) -> float:
        """Time after which a disturbance has left its output [s]."""

    def read(self, signal: Array, derivative: int, lag: float, rows: Rows) -> Array:
        """The filtered signal or a derivative of it at t - lag, at some rows."""

    def times(self, rows: Rows) -> Array:
        """Of rows [s] from the first sample."""

    def force_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the force's noise at frequencies [Hz]."""

    def position_gain(self, frequency: Array) -> Array:
        """Of the amplitude of the position at frequencies [Hz]."""


@dataclass(frozen=True)
class Problem:
    """What the models are fitted to.

    Args:
        motion: the position, at the rows in contact.
        force: at these rows, shape (m,).
        spans: number of the contact that each belongs to, shape (m,).
        lag: prior.
        free: the force out of contact behind the same front end, in stretches of rows.
        touch: the rows with those shortly before each touch; None if no touch is in the log.
        approach: the same with as many rows before a touch as the contact has, where there are so many.
        origin: position of the surface on the log's own scale [m].
        contacts: as found.
        counted: the force is counted from where it rests out of contact, and the rows begin before the touches.
        read: the force before any filter, at the samples of the motion's position, shape (n,); None if it is another's.
        rounding: deviation of a sample of the force by the last digit of the log [N].
        filtered: part of the force's lag that the position was sent through beforehand, so that `lag` is the rest [s].
    """

    motion: Motion
    force: Array
    spans: Rows
    lag: Lag
    free: tuple[Array, ...]
    touch: Touch | None
    approach: Touch | None
    origin: float
    contacts: Contacts
    counted: bool = False
    read: Array | None = None
    rounding: float = 0.0
    filtered: float = 0.0

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
        """What the force was counted from: out of contact, for rows that hold the touches [N]."""
        return self.contacts.resting if self.counted else 0.0

    @property
    def free_noise(self) -> float | None:
        """Deviation of the force out of contact; None if too little of the log is."""
        if not self.free:
            return None
        return float(1.4826 * np.median(np.abs(np.concatenate([f - np.median(f) for f in self.free]))))

    @property
    def with_touches(self) -> Problem | None:
        """The same over the rows from before each touch, the force counted from where it rests; None if unknown."""
        return self._at(self.touch)

    @property
    def with_approach(self) -> Problem | None:
        """The same over the rows from as long before each touch as the contact lasts; None without a touch."""
        return self._at(self.approach)

    def _at(self, touch: Touch | None) -> Problem | None:
        if touch is None:
            return None
        motion = replace(self.motion, rows=touch.rows, _kept={})
        return replace(
            self, motion=motion, force=touch.force, spans=touch.spans, touch=None, approach=None, counted=True
        )

    @property
    def in_contact(self) -> Mask:
        """Samples of the position between the first and the last row of a contact, shape (n,)."""
        found = np.zeros(len(self.motion.position), bool)
        instants = self.motion.instants
        for number in np.unique(self.spans):
            own = instants[self.spans == number]
            found[int(own[0]) : int(np.ceil(own[-1])) + 1] = True
        return found


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
    low_pass, filtered = options.force_filter, 0.0
    if low_pass is not None and low_pass.roll_off >= 2 and _COARSEST * low_pass.cutoff * channels.raw.dt <= 1:
        return _of_sensor_path(channels, chain, contacts, options)
    position = contacts.position_sign * channels.position
    force_raw = contacts.force_sign * channels.force
    if low_pass is not None:  # the position through the same low-pass, then both through the chain
        position = contacts.position_sign * low_passed(channels.position, low_pass, channels.dt)
        filtered = low_pass.lag
        if options.lag is not None:
            options = replace(options, lag=options.lag - filtered)
    period = 1 / channels.rate
    lag = lag_prior(options.lag, options.lag_std, period, 0.0, options.mass)
    force = chain(force_raw)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * chain(position, 2, lag.value)
    rows, spans = _rows(channels, chain, contacts)
    origin = _origin(chain(position, 0, lag.value), rows, contacts)
    position = position - origin
    noise = _noise(position, rows, spans, channels.rounding[0])
    motion = Motion(chain, position, rows, contacts.bonded, noise)
    touch = approach = None
    if not contacts.bonded:
        margin = int(np.ceil(chain.settling / chain.dt))
        begins = [begin for begin, _ in contacts.spans]
        usable = _settled(channels.valid, margin)
        touch = touching(force, contacts.resting, rows, spans, begins, margin, usable)
        approach = touching(force, contacts.resting, rows, spans, begins, margin, usable, reach=1)
    free = _free(force, channels, chain, contacts)
    read = force_raw if contacts.payload is None else None
    return Problem(
        motion, force[rows], spans, lag, free, touch, approach, origin, contacts,
        read=read, rounding=channels.rounding[1], filtered=filtered,
    )  # fmt: skip


MOST_ROWS = 1 << 16
"""Rows that are fitted at most, in pieces spread over the log: more average noise alone, which limits nothing then."""
_PIECE = 1 << 14


def reduced(problem: Problem) -> Problem:
    """The same with so many rows at most, in evenly spaced unbroken pieces."""
    rows = problem.motion.rows
    if len(rows) <= MOST_ROWS:
        return problem
    kept = _pieces(len(rows))
    motion = replace(problem.motion, rows=rows[kept], _kept={})
    fewer = replace(problem, motion=motion, force=problem.force[kept], spans=problem.spans[kept])
    return replace(fewer, touch=_fewer(problem.touch), approach=_fewer(problem.approach))


def _fewer(touch: Touch | None) -> Touch | None:
    if touch is None or len(touch.rows) <= MOST_ROWS:
        return touch
    kept = _pieces(len(touch.rows))
    return Touch(touch.rows[kept], touch.spans[kept], touch.force[kept])


def _pieces(count: int) -> Mask:
    pieces = -(-count // _PIECE)
    every = -(-pieces // (MOST_ROWS // _PIECE))
    kept: Mask = (np.arange(count) // _PIECE) % every == 0
    return kept


def _free(force: Array, channels: Channels, chain: Chain, contacts: Contacts) -> tuple[Array, ...]:
    """The filtered force out of contact, one reading of the filter's band after the other."""
    if contacts.bonded:
        return ()
    guard = int(chain.settling / chain.dt)
    out = channels.valid.copy()
    for begin, end in contacts.spans:
        out[max(begin - guard, 0) : end + guard] = False
    step = _step(chain)
    edges = np.diff(np.r_[0, out.astype(np.int8), 0])
    stretches = zip(np.flatnonzero(edges > 0) + guard, np.flatnonzero(edges < 0), strict=True)
    return tuple(force[a:b:step] for a, b in stretches if b - a >= _FREE_ROWS * step)


def _step(chain: Chain) -> int:
    """Samples from row to row: eight rows in a period of the cut-off hold all that the chain passes."""
    return max(int(1 / (8 * chain.cutoff * chain.dt)), 1)


def _noise(position: Array, rows: Rows, spans: Rows, rounding: float) -> PositionNoise:
    """That of the position: white by its highest differences, and the jumps of an encoder where its counts are seen.

    No less than what the log's last digit hides, which does not show where the probe rests; nor than what counts are
    seen to hide in contact, which is all of them where each reading is counts away from the one before.
    """
    found = noise_within(position, rows, spans)
    if found.count:
        counts = min(found.white, found.count / 12**0.5)
        return PositionNoise(max(white_noise(position), counts), found.jump, found.count)
    return PositionNoise(max(white_noise(position), rounding), 0.0, 0.0)


def _origin(filtered: Array, rows: Rows, contacts: Contacts) -> float:
    """Where the surface is: the position at the onset; the least in contact, if no onset is in the log.

    A probe fixed to the surface counts from the middle of its motion.
    """
    if contacts.bonded:
        return float(filtered[rows].mean())
    onsets = [filtered[begin] for begin, _ in contacts.spans if begin > 0]
    return float(np.mean(onsets)) if onsets else float(filtered[rows].min())


def _rows(channels: Channels, chain: Chain, contacts: Contacts) -> tuple[Rows, Rows]:
    """Samples in contact whose filter has forgotten what was before, and the number of each one's contact.

    The end is that of the raw force: a filter shows contact for a while after the probe has gone, but what it shows
    then is no contact any more.
    """
    usable = _settled(channels.valid, int(np.ceil(chain.settling / chain.dt)))
    step = _step(chain)
    rows, spans = [], []
    noise = 0.0 if contacts.bonded else white_noise(channels.force)
    for number, (begin, end) in enumerate(contacts.spans):
        last = end if contacts.bonded else left_at(channels, contacts, begin, end, noise)
        own = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        own = own[usable[own]]
        rows.append(own)
        spans.append(np.full(len(own), number))
    found = np.concatenate(rows)
    if len(found) < _FEWEST:
        raise InputError(_too_few(len(found), channels))
    return found, np.concatenate(spans)


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


def left_at(channels: Channels, contacts: Contacts, begin: int, end: int, noise: float) -> int:
    """The sample after the last in contact by the raw force, its noise [N]; at least half of the filtered one."""
    force = contacts.force_sign * channels.force[begin:end]
    clear = max(contacts.threshold, contacts.resting + 4 * noise)
    above = np.flatnonzero(force > clear)
    middle = begin + (end - begin) // 2
    return max(begin + int(above[-1]) + 1, middle) if len(above) else end


def _too_few(count: int, channels: Channels) -> str:
    text = f"only {count} usable samples in contact; at least {_FEWEST} are needed: log longer or faster"
    lost = [w.text for w in channels.warnings if w.code in (Code.SATURATED, Code.MISSING_SAMPLES)]
    return f"{text} ({'; '.join(lost)})" if lost else text


def _settled(valid: Mask, memory: int) -> Mask:
    """Where nothing invalid lies within the filter's memory."""
    if valid.all():
        return valid
    bad = np.r_[0, np.cumsum(~valid)]
    index = np.arange(len(valid))
    settled: Mask = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    return settled


def _of_sensor_path(channels: Channels, chain: Chain, contacts: Contacts, options: Options) -> Problem:
    """The force sensor's own samples as they are, and the position through the sensor's low-pass."""
    low_pass = options.force_filter
    assert low_pass is not None
    raw = channels.raw
    clock = sample_clock_of(raw.held_force)
    dt = raw.dt
    path = SensorPath(low_pass, raw.start, dt, clock.instants, clock.period * dt)
    time = raw.start + clock.instants * dt
    between = _between(contacts, chain, channels)
    usable = _path_usable(clock, raw.position, raw.valid, path)
    rows, spans = _path_rows(time, path, usable, contacts, between)
    position = contacts.position_sign * raw.position
    whole = clock.rows[rows]
    origin = float(position[whole].mean() if contacts.bonded else position[whole].min())
    position = position - origin
    motion = Motion(path, position, rows, contacts.bonded, noise=noise_within(position, whole, spans))
    force = contacts.force_sign * raw.held_force[clock.rows]
    known = float(np.hypot(options.lag_std, clock.spread * dt))
    lag = lag_prior(options.lag, known, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    touch = approach = None
    if not contacts.bonded:
        begins = np.searchsorted(time, [begin for begin, _ in between]).tolist()
        margin = int(np.ceil(path.settling / path.period))
        touch = touching(force, contacts.resting, rows, spans, begins, margin, usable)
        approach = touching(force, contacts.resting, rows, spans, begins, margin, usable, reach=1)
    free = _path_free(force, time, contacts, chain, channels)
    return Problem(motion, force[rows], spans, lag, free, touch, approach, origin, contacts)


def _path_usable(clock: SampleClock, position: Array, valid: Mask, path: SensorPath) -> Mask:
    """Samples whose way through the sensor lies within the log, shape (m,)."""
    before, after = path.reach
    far = path.low_pass.lag / path.dt + before
    usable = (clock.instants > far) & (clock.instants < len(position) - after)
    return np.asarray(usable & valid[clock.rows])


def _path_rows(
    time: Array,
    path: SensorPath,
    usable: Mask,
    contacts: Contacts,
    between: list[tuple[float, float]],
) -> tuple[Rows, Rows]:
    """Samples in contact that have forgotten what was before it, and the number of each one's contact."""
    rows, spans = [], []
    for number, (span, (touched, end)) in enumerate(zip(contacts.spans, between, strict=True)):
        begin = touched + (0.0 if contacts.bonded and span[0] == 0 else path.settling)
        first, last = np.searchsorted(time, [begin, end])
        own = first + np.flatnonzero(usable[first:last])
        rows.append(own)
        spans.append(np.full(len(own), number))
    found = np.concatenate(rows)
    if len(found) < _FEWEST:
        raise InputError(
            f"only {len(found)} samples of the force in contact; at least {_FEWEST} are needed: log longer or faster"
        )
    return found, np.concatenate(spans)


def _between(contacts: Contacts, chain: Chain, channels: Channels) -> list[tuple[float, float]]:
    """First and last time of each contact in the raw force [s]."""
    found = []
    noise = 0.0 if contacts.bonded else white_noise(channels.force)
    for begin, end in contacts.spans:
        last = end if contacts.bonded else left_at(channels, contacts, begin, end, noise)
        delay = 0.0 if contacts.bonded or begin == 0 else chain.delay
        found.append((channels.start + begin * channels.dt - delay, channels.start + last * channels.dt))
    return found


def _path_free(
    force: Array, time: Array, contacts: Contacts, chain: Chain, channels: Channels
) -> tuple[Array, ...]:
    """The sensor's samples out of contact, in stretches."""
    if contacts.bonded:
        return ()
    free = np.ones(len(time), bool)
    guard = chain.settling
    for begin, end in contacts.spans:
        first = np.searchsorted(time, channels.start + begin * channels.dt - guard)
        free[first : np.searchsorted(time, channels.start + end * channels.dt + guard, side="right")] = False
    edges = np.diff(np.r_[0, free.astype(np.int8), 0])
    stretches = zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True)
    return tuple(force[a:b] for a, b in stretches if b - a >= _FREE_ROWS)
