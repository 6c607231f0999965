"""From channels to what the models are fitted to: filter chosen, contacts found, samples picked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.choosing import Question
from palpate.identification.contacts import Contacts, find_contacts
from palpate.identification.filters.bandwidth import FASTEST, choose_cutoff
from palpate.identification.filters.position_noise import PositionNoise, noise_within
from palpate.identification.filters.state_variable import Chain, block_means, white_noise
from palpate.identification.lagging import unknown_lag
from palpate.identification.models import Motion
from palpate.identification.prior import Lag
from palpate.identification.sampling import Channels
from palpate.identification.touch import Touch, touching
from palpate.identification.warning_codes import Code

Array = NDArray[np.float64]

_OVERSAMPLED = 32.0
_LONG = 0.05


def thinned(channels: Channels, size: int) -> Channels:
    """Average `size` neighbouring samples, in the same way on both channels."""
    if size < 2:
        return channels
    position, force = block_means(channels.position, size), block_means(channels.force, size)
    valid = block_means(channels.valid.astype(float), size) == 1
    start = channels.start + (size - 1) / 2 * channels.dt
    dt = channels.dt * size
    return Channels(start, dt, position, force, valid, min(channels.rate, 1 / dt), channels.warnings)


def filter_and_contacts(
    channels: Channels, bonded: bool | None, cutoff: float | None
) -> tuple[Channels, Chain, Contacts]:
    """Find the contacts with the widest filter, choose the filter from them, and find them again with it."""
    highest = FASTEST * channels.rate
    if cutoff is not None and cutoff > 2 * highest:
        raise InputError(
            f"the cut-off must be at most {2 * highest:.4g} Hz, a quarter of the readings per second, got {cutoff:g}"
        )
    chain = Chain(cutoff or highest, channels.dt)
    contacts = find_contacts(channels, chain, bonded)
    if not contacts.spans:
        return channels, chain, contacts
    chosen = cutoff or _chosen_cutoff(channels, contacts)
    if chosen > 0.9 * highest:
        return channels, chain, contacts
    fewer = thinned(channels, int(1 / (_OVERSAMPLED * chosen * channels.dt)))
    narrow = Chain(chosen, fewer.dt)
    again = find_contacts(fewer, narrow, bonded)
    return (fewer, narrow, again) if again.spans else (channels, chain, contacts)


def _chosen_cutoff(channels: Channels, contacts: Contacts) -> float:
    """From the longest contact with what is before and after it, so that its rise and fall are in the picture."""
    begin, end = max(contacts.spans, key=lambda span: span[1] - span[0])
    margin = (end - begin) // 2
    around = slice(max(begin - margin, 0), end + margin)
    return choose_cutoff(channels.position[around], channels.force[around], channels.dt, channels.rate)


def question_of(
    channels: Channels, chain: Chain, contacts: Contacts, known: Lag, tolerance: float
) -> Question:
    """What the models are fitted to and judged on."""
    position = contacts.position_sign * channels.position
    force = chain(contacts.force_sign * channels.force)
    rows, spans = _rows(channels, chain, contacts)
    filtered = chain(position)
    origin = _origin(filtered, rows, contacts)
    position = position - origin
    motion = Motion(chain, position, rows, contacts.bonded, _noise(position, rows, spans))
    lag = known if known.known else unknown_lag(motion, channels.rate, known.mass)
    touch = _touch(force, channels, chain, contacts, rows, spans)
    free_noise = _free_noise(force, channels, chain, contacts)
    return Question(
        motion, force[rows], spans, lag, tolerance, free_noise, touch, origin, contacts.position_sign
    )


def _noise(position: Array, rows: NDArray[np.intp], spans: NDArray[np.intp]) -> PositionNoise:
    """That of the position: white by its highest differences, and the jumps of an encoder where its counts are seen."""
    found = noise_within(position, rows, spans)
    return PositionNoise(white_noise(position), found.jump if found.count else 0.0, found.count)


def _touch(
    force: Array,
    channels: Channels,
    chain: Chain,
    contacts: Contacts,
    rows: NDArray[np.intp],
    spans: NDArray[np.intp],
) -> Touch | None:
    """The rows with those before each touch, where the log shows what the force rests at."""
    if contacts.bonded:
        return None
    margin = int(np.ceil(chain.settling / chain.dt))
    begins = [begin for begin, _ in contacts.spans]
    return touching(force, contacts.resting, rows, spans, begins, margin, _settled(channels.valid, margin))


def _origin(filtered: Array, rows: NDArray[np.intp], contacts: Contacts) -> float:
    """Where the surface is: the position at the onset; the least in contact, if no onset is in the log.

    A probe fixed to the surface counts from the middle of its motion.
    """
    if contacts.bonded:
        return float(filtered[rows].mean())
    onsets = [filtered[begin] for begin, _ in contacts.spans if begin > 0]
    return float(np.mean(onsets)) if onsets else float(filtered[rows].min())


def _rows(channels: Channels, chain: Chain, contacts: Contacts) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Samples in contact whose filter has forgotten what was before, and the number of each one's contact.

    The end is that of the raw force: a filter shows contact for a while after the probe has gone, but what it shows
    then is no contact any more.
    """
    usable = _settled(channels.valid, int(np.ceil(chain.settling / chain.dt)))
    step = max(int(1 / (8 * chain.cutoff * chain.dt)), 1)
    rows, spans = [], []
    noise = 0.0 if contacts.bonded else white_noise(channels.force)
    for number, (begin, end) in enumerate(contacts.spans):
        last = end if contacts.bonded else left_at(channels, contacts, begin, end, noise)
        own = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        own = own[usable[own]]
        rows.append(own)
        spans.append(np.full(len(own), number))
    found = np.concatenate(rows)
    if len(found) < 30:
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
    text = f"only {count} usable samples in contact; at least 30 are needed: log longer or faster"
    lost = [w.text for w in channels.warnings if w.code in (Code.SATURATED, Code.MISSING_SAMPLES)]
    return f"{text} ({'; '.join(lost)})" if lost else text


def _settled(valid: NDArray[np.bool_], memory: int) -> NDArray[np.bool_]:
    """Where nothing invalid lies within the filter's memory."""
    if valid.all():
        return valid
    bad = np.r_[0, np.cumsum(~valid)]
    index = np.arange(len(valid))
    settled: NDArray[np.bool_] = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    return settled


def _free_noise(force: Array, channels: Channels, chain: Chain, contacts: Contacts) -> float | None:
    """Deviation of the filtered force out of contact; None if too little of the log is."""
    if contacts.bonded:
        return None
    free = np.ones(len(force), bool)
    guard = int(chain.settling / chain.dt)
    for begin, end in contacts.spans:
        free[max(begin - guard, 0) : end + guard] = False
    quiet = force[free & channels.valid]
    if len(quiet) < 30:
        return None
    return float(1.4826 * np.median(np.abs(quiet - np.median(quiet))))
