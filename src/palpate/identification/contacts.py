"""Where in a log the probe touches the surface, and which way each channel counts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.filters.bandwidth import FASTEST, choose_cutoff
from palpate.identification.filters.state_variable import Chain
from palpate.identification.options import NOTHING_SAID, Options
from palpate.identification.sampling import Channels, thinned
from palpate.identification.warning_codes import Code, Warn

Array = NDArray[np.float64]

ONSET = 0.05
"""Share of the peak force above rest at which contact is counted."""
_REACHED = 0.2
_BLOCKS = 100
_WIDER = 4.0
_OVERSAMPLED = 32.0
"""Samples in a period of the cut-off that are kept: what lies between straight lines is then nothing."""
_CLEAR = 3.0
"""Deviations of the free force below the threshold: noise cut at its own height stays below two, however coloured."""
_FEWEST = 20
_MOVED = 0.1
"""Share of the position's range below which the place at one end of the force says nothing: few samples of noise."""
_FREE = 0.25
"""Share of the position's range that must be travelled without any force for contact to be sure to begin and end."""


@dataclass(frozen=True)
class Contacts:
    """What was found.

    Args:
        spans: first and past-the-last sample of each contact, in filtered samples.
        bonded: the probe never leaves the surface (or pulls on it): the whole log is one contact.
        force_sign, position_sign: +1 or -1, what to multiply the channels with so that both grow into the surface.
        resting: force without contact, after the sign [N]; 0 for a bonded contact.
        threshold: force above which contact is counted, after the sign [N].
        warnings: what was found.
        clear: whether the force out of contact keeps well below that threshold. The contacts of mere noise are its
            peaks, and what is left out of contact reaches up to them. Not for a bonded one: it has no such force.
    """

    spans: tuple[tuple[int, int], ...]
    bonded: bool
    force_sign: float
    position_sign: float
    resting: float
    threshold: float
    warnings: tuple[Warn, ...]
    clear: bool = True


def contacts_of(channels: Channels, options: Options = NOTHING_SAID) -> tuple[Channels, Chain, Contacts]:
    """Find the contacts with the widest filter, choose the filter from them, and find them again with it.

    Raises:
        InputError: a cut-off that the readings are too rare for.
    """
    bonded, cutoff = options.bonded, options.cutoff
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


def find_contacts(channels: Channels, chain: Chain, bonded: bool | None = None) -> Contacts:
    """Find the stretches in contact.

    The force rests near zero out of contact and departs to one side in it; a force that goes to both sides by
    comparable amounts is that of a probe fixed to the surface.

    Args:
        channels: evenly sampled.
        chain: the filter that the fit will use, so that the spans count its delay.
        bonded: True if the probe is fixed to the surface, False if not, None to find out.
    """
    force = chain(channels.force)
    rest, peak, sure = _extremes(force, channels.position)
    if bonded or (bonded is None and not sure and _never_free(rest, peak)):
        return Contacts(((0, len(force)),), True, 1.0, 1.0, 0.0, -np.inf, (), clear=False)
    sign = 1.0 if peak > rest else -1.0
    level, top = sign * rest, sign * peak
    threshold = _threshold(sign * force, level, top)
    spans = _spans(sign * force, level, top, threshold, chain)
    if not spans:
        text = f"the force stays between {force.min():.4g} and {force.max():.4g}: no stretch in contact is long enough"
        return Contacts((), False, sign, 1.0, level, threshold, (Warn(Code.NO_CONTACT, text),))
    clear = _clear(sign * force, spans, threshold, int(chain.settling / chain.dt))
    return replace(_oriented(channels, chain, spans, sign, level, threshold), clear=clear)


def _clear(force: Array, spans: list[tuple[int, int]], threshold: float, settling: int) -> bool:
    out = np.ones(len(force), bool)
    out[:settling] = False
    for begin, end in spans:
        out[begin:end] = False
    free = force[out]
    if len(free) < _FEWEST:
        return False
    middle = float(np.median(free))
    return threshold - middle > _CLEAR * 1.4826 * float(np.median(np.abs(free - middle)))


def _oriented(
    channels: Channels,
    chain: Chain,
    spans: list[tuple[int, int]],
    sign: float,
    level: float,
    threshold: float,
) -> Contacts:
    warnings = []
    if sign < 0:
        text = "the force goes to negative values in contact; its sign was turned round"
        warnings.append(Warn(Code.FORCE_SIGN_REVERSED, text))
    way = 1.0 if _together(channels, chain, spans, sign) >= 0 else -1.0
    if way < 0:
        text = "the position falls as the probe goes in; its sign was turned round"
        warnings.append(Warn(Code.POSITION_SIGN_REVERSED, text))
    if spans[0][0] == 0:
        text = "the log begins in contact: the force at rest is not known and is estimated as an offset"
        warnings.append(Warn(Code.CONTACT_AT_START, text))
    return Contacts(tuple(spans), False, sign, way, level, threshold, tuple(warnings))


def _extremes(force: Array, position: Array) -> tuple[float, float, bool]:
    """The force at rest and at its peak, the two ends of its range; and whether the position leaves no doubt of it.

    Out of contact the position may go anywhere without any force, in contact it may not: so rest is the end at which
    the position spreads wider by far, and if it hardly does, the end nearer to zero. The ends are those of medians over
    a hundredth of the log, which a chattering probe does not reach.
    """
    width = len(force) // _BLOCKS
    low, high = np.percentile(force, [0.1, 99.9])
    ratio, travelled = 1.0, 0.0
    if width >= 4:
        step = max(width // 4, 1)
        middle, place = (
            np.median(np.lib.stride_tricks.sliding_window_view(values, width)[::step], axis=1)
            for values in (force, position)
        )
        if np.ptp(middle) > 0.2 * (high - low):
            low, high = middle.min(), middle.max()
            near = ONSET * (high - low)
            below, above = (_spread(place[end]) for end in (middle < low + near, middle > high - near))
            ratio, travelled = below / max(above, 1e-300), max(below, above) / max(_spread(place), 1e-300)
    told = travelled > _MOVED and not 1 / _WIDER < ratio < _WIDER
    from_low = ratio > 1 if told else abs(low) <= abs(high)
    rest, peak = (low, high) if from_low else (high, low)
    return float(rest), float(peak), told and travelled > _FREE


def _spread(values: Array) -> float:
    return float(np.ptp(values)) if len(values) else 0.0


def _never_free(rest: float, peak: float) -> bool:
    """Whether the force goes to both sides of zero by comparable amounts, or stays far from zero all the time."""
    return (rest * peak < 0 and abs(rest) > abs(peak) / 2) or (
        rest * peak > 0 and abs(rest) > 0.8 * abs(peak)
    )


def _threshold(force: Array, rest: float, peak: float) -> float:
    """Clear of the noise at rest, and of a share of the peak."""
    height = peak - rest
    free = force[force < rest + ONSET * height]
    noise = 1.4826 * float(np.median(np.abs(free - np.median(free)))) if len(free) else 0.0
    return rest + max(ONSET * height, 5 * noise)


def _spans(force: Array, rest: float, peak: float, threshold: float, chain: Chain) -> list[tuple[int, int]]:
    """Stretches above the onset that reach well above it and last longer than the filter needs to settle."""
    above = force > threshold
    edges = np.diff(np.r_[0, above.astype(np.int8), 0])
    spans: list[tuple[int, int]] = []
    for begin, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        if spans and (begin - spans[-1][1]) * chain.dt < chain.delay:
            spans[-1] = (spans[-1][0], int(end))
        else:
            spans.append((int(begin), int(end)))
    least = max(20, int(2 * chain.settling / chain.dt))
    return [(b, e) for b, e in spans if e - b >= least and force[b:e].max() > rest + _REACHED * (peak - rest)]


def _together(channels: Channels, chain: Chain, spans: list[tuple[int, int]], sign: float) -> float:
    position, force = chain(channels.position), sign * chain(channels.force)
    inside = np.concatenate([np.arange(b, e) for b, e in spans])
    x, f = position[inside], force[inside]
    return float((x - x.mean()) @ (f - f.mean()))
