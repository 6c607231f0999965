"""From channels and contacts to the problem: by the sensor's own way where that is known and seen, else by a filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.contacts import Contacts
from palpate.identification.filters.sensor_path import PositionNoise, SensorPath, noise_within
from palpate.identification.filters.state_variable import Chain, low_passed, white_noise
from palpate.identification.models import Motion
from palpate.identification.options import Options, lag_prior
from palpate.identification.problem import FREE_ROWS, Memory, Problem, Rows, ends, number_rows, touching
from palpate.identification.sample_clock import SampleClock, sample_clock_of
from palpate.identification.sampling import Channels
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import runs

_LONG = 0.05
"""Share of a contact that waiting until a filter has forgotten all may cost."""


def behind_filter(
    channels: Channels, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels behind the chain; a known low-pass of the force is applied to the position too.

    Raises:
        InputError: too few rows in contact.
    """
    low_pass, filtered = options.force_filter, 0.0
    position = contacts.position_sign * channels.position
    force_raw = contacts.force_sign * channels.force
    if low_pass is not None:  # the position through the same low-pass, then both through the chain
        position = contacts.position_sign * low_passed(channels.position, low_pass, channels.dt)
        filtered = low_pass.lag
        if options.lag is not None:
            options = replace(options, lag=options.lag - filtered)
    lag = lag_prior(options.lag, options.lag_std, 1 / channels.rate, 0.0, options.mass)
    force = chain(force_raw)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * chain(position, 2, lag.value)
    memory = int(np.ceil(chain.settling / chain.dt))
    usable = _settle(channels.valid, memory)
    rows, spans = number_rows(_rows(channels, chain, contacts, usable), channels)
    origin = _origin(chain(position, 0, lag.value), rows, contacts)
    position = position - origin
    problem = Problem(
        motion=Motion(
            chain, position, rows, contacts.bonded, _noise(position, rows, spans, channels.rounding[0])
        ),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=_free(force, channels, chain, contacts),
        origin=origin,
        contacts=contacts,
        read=force_raw if contacts.payload is None else None,
        rounding=channels.rounding[1],
        filtered=filtered,
    )
    return problem, Memory(force, usable, [begin for begin, _ in contacts.spans], memory)


def _rows(channels: Channels, chain: Chain, contacts: Contacts, usable: Mask) -> list[Rows]:
    """Samples of each contact whose filter has forgotten what was before."""
    step = _step(chain)
    found = []
    for (begin, end), last in zip(contacts.spans, ends(channels, contacts), strict=True):
        own = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        found.append(own[usable[own]])
    return found


def _step(chain: Chain) -> int:
    """Samples from row to row: eight rows in a period of the cut-off hold all that the chain passes."""
    return max(int(1 / (8 * chain.cutoff * chain.dt)), 1)


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


def _settle(valid: Mask, memory: int) -> Mask:
    """Where nothing invalid lies within the filter's memory."""
    if valid.all():
        return valid
    bad = np.r_[0, np.cumsum(~valid)]
    index = np.arange(len(valid))
    settled: Mask = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    return settled


def _free(force: Array, channels: Channels, chain: Chain, contacts: Contacts) -> tuple[Array, ...]:
    """The filtered force out of contact, one reading of the filter's band after the other."""
    if contacts.bonded:
        return ()
    guard = int(chain.settling / chain.dt)
    out = channels.valid.copy()
    for begin, end in contacts.spans:
        out[max(begin - guard, 0) : end + guard] = False
    step = _step(chain)
    return tuple(force[a + guard : b : step] for a, b in runs(out) if b - a - guard >= FREE_ROWS * step)


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


_COARSEST = 4.0
"""Readings in a period of a sensor's cut-off below which its own path is not used: the position would not show it."""


def shown(low_pass: LowPass, dt: float) -> bool:
    """Whether a position is read often enough to go the sensor's own way.

    Args:
        low_pass: of the sensor.
        dt: sampling period of the position [s].
    """
    return low_pass.roll_off >= 2 and _COARSEST * low_pass.cutoff * dt <= 1


def behind_sensor(
    channels: Channels, low_pass: LowPass, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels as the sensor samples them.

    Raises:
        InputError: too few samples in contact.
    """
    raw = channels.raw
    clock = sample_clock_of(raw.held_force)
    dt = raw.dt
    path = SensorPath(low_pass, raw.start, dt, clock.instants, clock.period * dt)
    time = raw.start + clock.instants * dt
    between = _between(contacts, chain, channels)
    usable = _usable(clock, raw.position, raw.valid, path)
    rows, spans = number_rows(_sensor_rows(time, path, usable, contacts, between), channels)
    position = contacts.position_sign * raw.position
    whole = clock.rows[rows]
    origin = float(position[whole].mean() if contacts.bonded else position[whole].min())
    position = position - origin
    force = contacts.force_sign * raw.held_force[clock.rows]
    known = float(np.hypot(options.lag_std, clock.spread * dt))
    lag = lag_prior(options.lag, known, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    problem = Problem(
        motion=Motion(path, position, rows, contacts.bonded, noise=noise_within(position, whole, spans)),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=_free_of_sensor(force, time, contacts, chain, channels),
        origin=origin,
        contacts=contacts,
    )
    begins = np.searchsorted(time, [begin for begin, _ in between]).tolist()
    return problem, Memory(force, usable, begins, int(np.ceil(path.settling / path.period)))


def _usable(clock: SampleClock, position: Array, valid: Mask, path: SensorPath) -> Mask:
    """Samples whose way through the sensor lies within the log, shape (m,)."""
    before, after = path.reach
    far = path.low_pass.lag / path.dt + before
    usable = (clock.instants > far) & (clock.instants < len(position) - after)
    return np.asarray(usable & valid[clock.rows])


def _sensor_rows(
    time: Array, path: SensorPath, usable: Mask, contacts: Contacts, between: list[tuple[float, float]]
) -> list[Rows]:
    """Samples of each contact that have forgotten what was before it."""
    found = []
    for span, (touched, end) in zip(contacts.spans, between, strict=True):
        begin = touched + (0.0 if contacts.bonded and span[0] == 0 else path.settling)
        first, last = np.searchsorted(time, [begin, end])
        found.append(first + np.flatnonzero(usable[first:last]))
    return found


def _between(contacts: Contacts, chain: Chain, channels: Channels) -> list[tuple[float, float]]:
    """First and last time of each contact in the raw force [s]."""
    found = []
    for (begin, _), last in zip(contacts.spans, ends(channels, contacts), strict=True):
        delay = 0.0 if contacts.bonded or begin == 0 else chain.delay
        found.append((channels.start + begin * channels.dt - delay, channels.start + last * channels.dt))
    return found


def _free_of_sensor(
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
    return tuple(force[a:b] for a, b in runs(free) if b - a >= FREE_ROWS)


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
    if low_pass is not None and shown(low_pass, channels.raw.dt):
        problem, memory = behind_sensor(channels, low_pass, chain, contacts, options)
    else:
        problem, memory = behind_filter(channels, chain, contacts, options)
    if contacts.bonded:
        return problem
    touches, approach = (touching(problem, memory, reach) for reach in (0, 1))
    return replace(problem, with_touches=touches, with_approach=approach)
