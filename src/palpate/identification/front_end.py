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
from palpate.identification.sample_clock import sample_clock_of
from palpate.identification.sampling import Channels
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import runs

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
    position, filtered, told = channels.position, 0.0, options.lag
    if options.force_filter is not None:
        position = low_passed(position, options.force_filter, channels.dt)
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
    onsets = [whole[begin] for begin, _ in contacts.spans if begin > 0]
    if contacts.bonded:
        origin = float(whole[rows].mean())
    else:  # the position at the onset; the least in contact, if no onset is in the log
        origin = float(np.mean(onsets)) if onsets else float(whole[rows].min())
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


def _behind_sensor(
    channels: Channels, low_pass: LowPass, chain: Chain, contacts: Contacts, options: Options
) -> tuple[Problem, Memory]:
    """Both channels as the sensor samples them."""
    raw = channels.raw
    clock = sample_clock_of(raw.held_force)
    path = SensorPath(low_pass, raw.start, raw.dt, clock.instants, clock.period * raw.dt)
    time = raw.start + clock.instants * raw.dt
    before, after = path.reach
    usable: Mask = (
        clock.instants > low_pass.lag / path.dt + before
    )  # the way through the sensor is in the log
    usable = usable & (clock.instants < len(raw.position) - after) & raw.valid[clock.rows]
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
    known = float(np.hypot(options.lag_std, clock.spread * raw.dt))
    lag = lag_prior(options.lag, known, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    problem = Problem(
        motion=Motion(path, position, rows, contacts.bonded, noise=noise_within(position, whole, spans)),
        force=force[rows],
        spans=spans,
        lag=lag,
        free=tuple(force[a:b] for a, b in runs(free) if b - a >= FREE_ROWS),
        origin=origin,
        contacts=contacts,
    )
    return problem, Memory(force, usable, begins, int(np.ceil(path.settling / path.period)))
