"""Both channels behind the one filter chain, from reading to reading of the log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.contacts import Contacts
from palpate.identification.filters.filter_bank import low_passed
from palpate.identification.filters.position_noise import PositionNoise, noise_within
from palpate.identification.filters.state_variable import Chain, white_noise
from palpate.identification.models import Motion
from palpate.identification.options import Options
from palpate.identification.prior import lag_prior
from palpate.identification.problem.seen import FREE_ROWS, Rows, Seen, ends, numbered
from palpate.identification.sampling import Channels
from palpate.signals.samples import runs

_LONG = 0.05
"""Share of a contact that waiting until a filter has forgotten all may cost."""


def behind_filter(channels: Channels, chain: Chain, contacts: Contacts, options: Options) -> Seen:
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
    usable = _settled(channels.valid, memory)
    rows, spans = numbered(_rows(channels, chain, contacts, usable), channels)
    origin = _origin(chain(position, 0, lag.value), rows, contacts)
    position = position - origin
    return Seen(
        motion=Motion(
            chain, position, rows, contacts.bonded, _noise(position, rows, spans, channels.rounding[0])
        ),
        origin=origin,
        force=force,
        spans=spans,
        usable=usable,
        begins=[begin for begin, _ in contacts.spans],
        memory=memory,
        free=_free(force, channels, chain, contacts),
        lag=lag,
        read=force_raw if contacts.payload is None else None,
        filtered=filtered,
        rounding=channels.rounding[1],
    )


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


def _settled(valid: Mask, memory: int) -> Mask:
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
