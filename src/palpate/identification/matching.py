"""What the models are fitted to where the force sensor's own low-pass is known: the sensor's samples as they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.choosing import Question
from palpate.identification.contacts import Contacts
from palpate.identification.filters.position_noise import noise_within
from palpate.identification.filters.sensor_path import SensorPath
from palpate.identification.filters.state_variable import Chain, white_noise
from palpate.identification.models import Motion
from palpate.identification.preparing import left_at
from palpate.identification.prior import Lag
from palpate.identification.sample_clock import Refreshes, refreshes_of
from palpate.identification.sampling import Channels
from palpate.identification.touch import touching
from palpate.signals.low_pass import LowPass

Array = NDArray[np.float64]

_FEWEST = 30
_PROCESSING = 0.02
"""How much longer than its low-pass and one sample a force sensor nobody has calibrated may take [s]: a deviation."""
_COARSEST = 4.0
"""Rows in a period of the low-pass's cut-off, at least: with fewer the position does not show what the force does."""


@dataclass(frozen=True)
class Samples:
    """The force sensor's own samples.

    Args:
        refreshes: when they came out, and in which rows they show.
        force: shape (m,).
        channels: the position on the log's rows.
        low_pass: that the force went through before.
    """

    refreshes: Refreshes
    force: Array
    channels: Channels
    low_pass: LowPass

    @property
    def time(self) -> Array:
        """Of each sample [s], shape (m,)."""
        time: Array = self.channels.start + self.refreshes.instants * self.channels.dt
        return time


def samples_of(channels: Channels, force: Array, low_pass: LowPass) -> Samples:
    """Find the samples behind the readings.

    Args:
        channels: the log's rows, evenly spaced.
        force: as it was read in these rows, shape (n,).
        low_pass: of the sensor.

    Raises:
        InputError: rows too rare for the low-pass.
    """
    if 1 / channels.dt < _COARSEST * low_pass.cutoff:
        raise InputError(
            f"the force filter cuts off at {low_pass.cutoff:g} Hz, which needs {_COARSEST * low_pass.cutoff:g} rows a"
            f" second of the position, got {1 / channels.dt:.4g}; leave --force-filter out"
        )
    if low_pass.roll_off < 2:
        raise InputError(
            f"a force filter of order {low_pass.roll_off} passes noise of the acceleration without end;"
            " give the whole chain, of order 2 or more, or leave --force-filter out"
        )
    found = refreshes_of(force)
    return Samples(found, force[found.rows], channels, low_pass)


def matched_question(
    samples: Samples,
    contacts: Contacts,
    chain: Chain,
    coarse: Channels,
    known: Lag,
    tolerance: float,
) -> Question:
    """What the models are fitted to and judged on.

    Args:
        samples: of the force.
        contacts: as found.
        chain: the filter that they were found behind.
        coarse: the channels that they were found on, which may be averages of the log's rows.
        known: of lag and mass.
        tolerance: largest half-width of an identified parameter's interval, as a share of its value.
    """
    channels, refreshes, low_pass = samples.channels, samples.refreshes, samples.low_pass
    path = SensorPath(
        low_pass, channels.start, channels.dt, refreshes.instants, refreshes.period * channels.dt
    )
    between = _between(contacts, chain, coarse)
    usable = _usable(samples, path)
    rows, spans = _rows(samples, path, usable, contacts, between)
    position = contacts.position_sign * channels.position
    whole = refreshes.rows[rows]
    origin = float(position[whole].mean() if contacts.bonded else position[whole].min())
    position = position - origin
    motion = Motion(path, position, rows, contacts.bonded, noise=noise_within(position, whole, spans))
    force = contacts.force_sign * samples.force
    if known.known:
        lag = replace(known, std=float(np.hypot(known.std, refreshes.spread * channels.dt)))
    else:
        lag = replace(known, value=low_pass.lag + path.period, std=_PROCESSING)
    touch = None
    if not contacts.bonded:
        begins = np.searchsorted(samples.time, [begin for begin, _ in between]).tolist()
        margin = int(np.ceil(path.settling / path.period))
        touch = touching(force, contacts.resting, rows, spans, begins, margin, usable)
    free_noise = _free_noise(samples, contacts, chain, coarse)
    return Question(
        motion, force[rows], spans, lag, tolerance, free_noise, touch, origin, contacts.position_sign
    )


def _usable(samples: Samples, path: SensorPath) -> NDArray[np.bool_]:
    """Samples whose way through the sensor lies within the log, shape (m,)."""
    refreshes, channels = samples.refreshes, samples.channels
    before, after = path.reach
    far = path.low_pass.lag / channels.dt + before
    usable = (refreshes.instants > far) & (refreshes.instants < len(channels.position) - after)
    return np.asarray(usable & channels.valid[refreshes.rows])


def _rows(
    samples: Samples,
    path: SensorPath,
    usable: NDArray[np.bool_],
    contacts: Contacts,
    between: list[tuple[float, float]],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Samples in contact that have forgotten what was before it, and the number of each one's contact."""
    time = samples.time
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


def _between(contacts: Contacts, chain: Chain, coarse: Channels) -> list[tuple[float, float]]:
    """First and last time of each contact in the raw force [s]."""
    found = []
    noise = 0.0 if contacts.bonded else white_noise(coarse.force)
    for begin, end in contacts.spans:
        last = end if contacts.bonded else left_at(coarse, contacts, begin, end, noise)
        delay = 0.0 if contacts.bonded or begin == 0 else chain.delay
        found.append((coarse.start + begin * coarse.dt - delay, coarse.start + last * coarse.dt))
    return found


def _free_noise(samples: Samples, contacts: Contacts, chain: Chain, coarse: Channels) -> float | None:
    """Deviation of the samples out of contact; None if too few of them are."""
    if contacts.bonded:
        return None
    time = samples.time
    free = np.ones(len(time), bool)
    guard = chain.settling
    for begin, end in contacts.spans:
        first = np.searchsorted(time, coarse.start + begin * coarse.dt - guard)
        free[first : np.searchsorted(time, coarse.start + end * coarse.dt + guard, side="right")] = False
    quiet = samples.force[free]
    if len(quiet) < _FEWEST:
        return None
    return float(1.4826 * np.median(np.abs(quiet - np.median(quiet))))
