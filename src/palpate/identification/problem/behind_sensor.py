"""The force sensor's own samples as they are, and the position through the sensor's low-pass."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.contacts import Contacts
from palpate.identification.filters.position_noise import noise_within
from palpate.identification.filters.sensor_path import SensorPath
from palpate.identification.filters.state_variable import Chain
from palpate.identification.models import Motion
from palpate.identification.options import Options
from palpate.identification.prior import lag_prior
from palpate.identification.problem.seen import FREE_ROWS, Rows, Seen, ends, numbered
from palpate.identification.sample_clock import SampleClock, sample_clock_of
from palpate.identification.sampling import Channels
from palpate.signals.low_pass import LowPass
from palpate.signals.samples import runs

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
) -> Seen:
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
    rows, spans = numbered(_rows(time, path, usable, contacts, between), channels)
    position = contacts.position_sign * raw.position
    whole = clock.rows[rows]
    origin = float(position[whole].mean() if contacts.bonded else position[whole].min())
    position = position - origin
    force = contacts.force_sign * raw.held_force[clock.rows]
    known = float(np.hypot(options.lag_std, clock.spread * dt))
    lag = lag_prior(options.lag, known, path.period, low_pass.lag, options.mass)
    if contacts.payload is not None:
        force = force - contacts.payload.mass * path.read(position, 2, lag.value, np.arange(len(time)))
    return Seen(
        motion=Motion(path, position, rows, contacts.bonded, noise=noise_within(position, whole, spans)),
        origin=origin,
        force=force,
        spans=spans,
        usable=usable,
        begins=np.searchsorted(time, [begin for begin, _ in between]).tolist(),
        memory=int(np.ceil(path.settling / path.period)),
        free=_free(force, time, contacts, chain, channels),
        lag=lag,
    )


def _usable(clock: SampleClock, position: Array, valid: Mask, path: SensorPath) -> Mask:
    """Samples whose way through the sensor lies within the log, shape (m,)."""
    before, after = path.reach
    far = path.low_pass.lag / path.dt + before
    usable = (clock.instants > far) & (clock.instants < len(position) - after)
    return np.asarray(usable & valid[clock.rows])


def _rows(
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


def _free(
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
