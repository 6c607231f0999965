"""Where in a log the probe touches the surface, and which way each channel counts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.causes import BRIEF, Code, Warn
from palpate.identification.filters.state_variable import FASTEST, Chain, block_means, choose_cutoff
from palpate.identification.free_motion import FLAT, Drift, FreeMotion, MovingMass, free_motion_of, payload_of
from palpate.identification.options import NOTHING_SAID, Options, lag_prior
from palpate.identification.sampling import Channels, thinned
from palpate.identification.steady_press import SteadyPress, Stroke, steady_press, strokes_of
from palpate.signals.samples import GAUSSIAN, detrend, runs

ONSET = 0.05
"""Share of the peak force above rest at which contact is counted."""
_REACHED = 0.2
_BLOCKS = 100
_COVERED = 0.5
"""Share of the force's range that short medians must cover to stand for it: those of an oscillation do not."""
_LONGEST_BLOCK = 0.25
"""Of a median [s]: longer ones would hold whole presses of a long log."""
_CLEAR = 3.0
"""Deviations of the free force below the threshold: noise cut at its own height stays below two, however coloured."""
_SEVERAL = 3
"""Readings at rest that are a loss of contact: fewer may be a bounce of the noise."""
_FEWEST = 20
_ROUNDS = 3
_SIGNED = 0.6
"""Correlation of block means of force and position below which nobody can tell which way they count."""
_BESIDE = 0.05
"""Share of a stroke before and after it in which the probe is still speeding up or slowing down."""
_OVERSAMPLED = 16.0
"""Samples in a period of the cut-off that are kept: means of more readings droop by 0.6 % there, on both alike."""


@dataclass(frozen=True)
class Contacts:
    """The contacts of a log.

    Args:
        spans: first and past-the-last sample of each contact, in filtered samples.
        bonded: the probe never leaves the surface (or pulls on it): the whole log is one contact.
        force_sign, position_sign: +1 or -1, what to multiply the channels with so that both grow into the surface.
        resting: force without contact, after the sign [N]; 0 for a bonded contact.
        threshold: force above which contact is counted, after the sign [N].
        warnings: what was found.
        clear: whether the force out of contact keeps well below that threshold. The contacts of mere noise are its
            peaks, and what is left out of contact reaches up to them. Not for a bonded one: it has no such force.
        signed: whether it is known which way each channel counts: as told, as it is, or turned round by what a stretch
            out of contact shows.
        payload: mass that the force has in free motion, counted into the surface; None if it has none.
        drift: of the force, straight lines of which were taken out; None if the log shows none.
        press: at constant speed, of a log that is little else; None of another.
    """

    spans: tuple[tuple[int, int], ...]
    bonded: bool
    force_sign: float
    position_sign: float
    resting: float
    threshold: float
    warnings: tuple[Warn, ...]
    clear: bool = True
    signed: bool = True
    payload: MovingMass | None = None
    drift: Drift | None = None
    press: SteadyPress | None = None


def contacts_of(channels: Channels, options: Options = NOTHING_SAID) -> tuple[Channels, Chain, Contacts]:
    """Find the contacts with the widest filter, choose the filter from them, and find them again with it.

    A cut-off that the readings are too rare for is an `InputError`.
    """
    cutoff, highest = options.cutoff, FASTEST * channels.rate
    if cutoff is not None and cutoff > 2 * highest:
        raise InputError(
            f"the cut-off must be at most {2 * highest:.4g} Hz, a quarter of the readings per second, got {cutoff:g}"
        )
    chain = Chain(cutoff or highest, channels.dt)
    strokes, drift, press = strokes_of(channels), None, None
    air = None if options.bonded else _air(channels, chain, options.assumed_lag)
    if air is not None and strokes and not _crossed(channels, air, strokes):
        air = None
    if air is not None and air.drifts:
        drift, channels = Drift(air.stays * channels.dt, air.levels), _without_drift(channels, air)
    contacts = _find_contacts(channels, chain, air, options, strokes)
    if strokes:
        seen = contacts  # a press whose contact no threshold shows is in contact from end to end
        if not contacts.spans:
            seen = _never_left(channels, channels.force, channels.position, options, strokes)
        lag = lag_prior(options.lag, options.lag_std, 1 / channels.rate, 0.0, None)
        signs = seen.position_sign, seen.force_sign
        press = steady_press(channels, strokes, signs, seen.resting, lag, drift)
        if press is None or press.headline.stiffness.value <= 0:
            strokes, press = (), None
            contacts = _find_contacts(channels, chain, air, options, strokes)
        else:
            contacts = seen
    contacts = replace(contacts, drift=drift, press=press)
    if not contacts.spans:
        return channels, chain, contacts
    begin, end = max(contacts.spans, key=lambda span: span[1] - span[0])
    around = slice(max(begin - (end - begin) // 2, 0), end + (end - begin) // 2)  # its rise and fall, too
    own = channels.position[around], channels.force[around]
    chosen = cutoff or choose_cutoff(*own, channels.dt, channels.rate)
    if chosen > 0.9 * highest:
        return channels, chain, contacts
    size = int(1 / (_OVERSAMPLED * chosen * channels.dt))
    fewer = thinned(channels, min(size, len(channels.force) // _FEWEST))
    narrow = Chain(chosen, fewer.dt)
    again = replace(_find_contacts(fewer, narrow, air, options, strokes), drift=drift, press=press)
    return (fewer, narrow, again) if again.spans else (channels, chain, contacts)


def _crossed(channels: Channels, air: FreeMotion, strokes: tuple[Stroke, ...]) -> bool:
    """Whether the strokes pass the air of a press and the force stays: places at rest have no slope to tell."""

    def rise(x: Array, f: Array) -> float:
        u = x - x.mean()
        return abs(float(u @ f)) / max(float(u @ u), 1e-300)

    for stroke in strokes:
        more = _BESIDE * (stroke.end - stroke.begin)
        rows = replace(stroke, begin=stroke.begin - more, end=stroke.end + more).rows(channels)
        x, f = air.way * channels.position[rows], channels.force[rows]
        inside = x < air.way * air.limit
        if np.count_nonzero(inside) >= _SEVERAL and rise(x[inside], f[inside]) < FLAT * rise(x, f):
            return True
    return False


def _find_contacts(
    channels: Channels, chain: Chain, air: FreeMotion | None, options: Options, strokes: tuple[Stroke, ...]
) -> Contacts:
    """Find the stretches in contact.

    Free space is where the position travels and the force does not. A force that follows the position at both ends of
    its range never leaves the surface: the whole log is one contact, and nothing tells what the force rests at.

    `chain` is the filter that the fit will use, so that the spans count its delay; `air` is of the log, if it shows
    any, and `strokes` of a press at constant speed.
    """
    force, position = chain(channels.force), chain(channels.position)
    payload = payload_of(channels, chain, air, options.assumed_lag) if air else None
    if payload is not None:
        force = force - payload.mass * chain(channels.position, 2, options.assumed_lag)
    low, high = _ends(_calm(force, channels.dt))
    if air is None and options.bonded is not False:
        return _never_left(channels, force, position, options, strokes)
    rest = air.rest if air else low if abs(low) <= abs(high) else high
    peak = max(low, high, key=lambda end: abs(end - rest))
    sign = 1.0 if peak > rest else -1.0
    top = sign * peak
    level = _resting(sign * force, sign * rest, top)
    onset = ONSET * (
        top - level
    )  # the threshold is clear of this share of the peak, and of the noise at rest
    low_force = np.abs(sign * force[sign * force < level + onset] - level)
    noise = GAUSSIAN * float(np.median(low_force)) if len(low_force) else 0.0
    threshold = level + max(onset, 5 * noise)
    touches = _touches(sign * force, level, top, threshold)
    least = max(_FEWEST, int(2 * chain.settling / chain.dt))  # longer than the filter needs to settle
    spans = [(b, e) for b, e in touches if e - b >= least]
    text, rows = "press longer, or log faster", ""
    if air is not None and payload is None and spans:
        touches = _between_losses(channels, sign, (level, top), air, spans, chain)
        spans = [(b, e) for b, e in touches if e - b >= least]
        text, rows = "press deeper, move slower or log faster", " until the probe leaves the surface again"
    longest = max((e - b for b, e in touches), default=0)
    text = f"{BRIEF} {longest} rows{rows}, and {least} are needed: {text}"
    if not touches:
        text = f"the force stays between {force.min():.4g} and {force.max():.4g}: there is no contact"
    if not spans:
        return Contacts((), False, sign, 1.0, level, threshold, (Warn(Code.NO_CONTACT, text),))
    found = _orient(force, position, spans, (sign, air.way if air else 0.0, level, threshold), options)
    free = sign * force[_outside(len(force), spans, int(chain.settling / chain.dt))]
    clear = len(free) >= _FEWEST
    if clear:
        middle = float(np.median(free))
        clear = threshold - middle > _CLEAR * GAUSSIAN * float(np.median(np.abs(free - middle)))
    found = replace(found, clear=clear)
    if payload is None:
        return found
    own = replace(payload, mass=found.force_sign * found.position_sign * payload.mass)
    return replace(found, payload=own, warnings=(*found.warnings, Warn(Code.TOOL_INERTIA, own.text)))


def _air(channels: Channels, chain: Chain, lag: float) -> FreeMotion | None:
    """Where the probe is in free motion; by the force without an inertia, if that shows more of it."""
    force, position = chain(channels.force), chain(channels.position)
    ends = _ends(_calm(force, channels.dt))
    perhaps = free_motion_of(channels.force, channels.position, ends, none=False)
    payload = payload_of(channels, chain, perhaps, lag, alone=True) if perhaps else None
    without = None
    if payload is not None:
        without = free_motion_of(force - payload.mass * chain(channels.position, 2, lag), position, ends)
    return without or free_motion_of(channels.force, channels.position, ends)


def _without_drift(channels: Channels, air: FreeMotion) -> Channels:
    """The same with the force in free motion level from one stay to the next."""
    raw, rows = channels.raw, np.arange(len(channels.force), dtype=np.float64)
    first, held = (raw.start - channels.start) / channels.dt, raw.held_force
    at: Array = first + np.arange(len(held), dtype=np.float64) * (raw.dt / channels.dt)
    raw = replace(raw, held_force=held - air.drift(at))
    warnings, moved = channels.warnings, float(np.ptp(air.levels))
    if moved > air.noise:  # less is not seen in the log
        text = f"in free motion the force changes by {moved:.3g} N during the log; the change is removed as a drift"
        warnings = (*warnings, Warn(Code.FORCE_DRIFTS, text))
    return replace(channels, force=channels.force - air.drift(rows), raw=raw, warnings=warnings)


def _never_left(
    channels: Channels, force: Array, position: Array, options: Options, strokes: tuple[Stroke, ...]
) -> Contacts:
    """The whole log as one contact. Its channels count as they stand, or as told; of a press so that both grow."""
    sign = float(options.force_sign or 1)
    if strokes and not options.force_sign:
        low, high = _ends(channels.force)
        sign = 1.0 if abs(high) >= abs(low) else -1.0
    rows = [stroke.rows(channels) for stroke in strokes]
    rises = sum(float(np.cov(sign * channels.force[own], channels.position[own])[0, 1]) for own in rows)
    way = -1.0 if rises < 0 else 1.0
    told = _reversed_signs(sign < 0 and options.force_sign is None, way < 0)
    found = Contacts(((0, len(force)),), True, sign, way, 0.0, -np.inf, told, clear=False)
    if options.bonded:
        return found
    width = max(len(force) // _BLOCKS, 1)
    f, x = (detrend(block_means(values, width)) for values in (sign * force, way * position))
    along = float(f @ x) / (float(np.sqrt((f @ f) * (x @ x))) or np.inf)
    text = "the probe never leaves the surface: the force at rest is not known and is estimated as an offset"
    told = (Warn(Code.CONTACT_AT_START, text), *told)
    return replace(found, warnings=told, signed=bool(strokes) or along > _SIGNED)


def _reversed_signs(force: bool, position: bool) -> tuple[Warn, ...]:
    """Channels whose signs were reversed."""
    text = "the force goes to negative values in contact; its sign was reversed"
    warnings = (Warn(Code.FORCE_SIGN_REVERSED, text),) if force else ()
    text = "the position falls as the force grows; its sign was reversed"
    return (*warnings, Warn(Code.POSITION_SIGN_REVERSED, text)) if position else warnings


def _outside(count: int, spans: list[tuple[int, int]], begin: int) -> Mask:
    out = np.arange(count) >= begin
    for first, last in spans:
        out[first:last] = False
    return out


def _orient(
    force: Array,
    position: Array,
    spans: list[tuple[int, int]],
    levels: tuple[float, float, float, float],
    options: Options,
) -> Contacts:
    """Which way the channels count: into the surface is where the probe is in contact and not out of it."""
    sign, way, level, threshold = levels
    signed = options.force_sign in (None, int(sign))
    if not way:
        out = _outside(len(position), spans, 0)
        inside = ~out
        reach = float(np.ptp(position[inside])) or 1.0
        deep = inside & (sign * force > np.median(sign * force[inside]))
        apart = float(np.median(position[deep]) - np.median(position[out])) if out.sum() >= _FEWEST else 0.0
        if abs(apart) < ONSET * reach:
            apart = float(np.corrcoef(position[inside], sign * force[inside])[0, 1])
        way = 1.0 if apart >= 0 else -1.0
    told = _reversed_signs(sign < 0, way < 0)
    if not signed:
        side = "in contact it goes to the other side of its rest"
        text = f"the sign of the force contradicts --force-sign: {side}"
        told = (*told, Warn(Code.NEGATIVE_STIFFNESS, text))
    if spans[0][0] == 0:
        text = "the log begins in contact: the depth of that contact is not known"
        told = (*told, Warn(Code.CONTACT_AT_START, text))
    return Contacts(tuple(spans), False, sign, way, level, threshold, told, signed=signed)


def _calm(force: Array, dt: float) -> Array:
    """Short medians, which a chattering probe does not reach; the force as it is if it is all oscillation."""
    width = min(len(force) // _BLOCKS, int(_LONGEST_BLOCK / dt))
    if width < 4:
        return force
    views = np.lib.stride_tricks.sliding_window_view(force, width)[:: max(width // 4, 1)]
    calm: Array = np.median(views, axis=1)
    low, high = _ends(force)
    return force if np.ptp(calm) <= _COVERED * (high - low) else calm


def _ends(force: Array) -> tuple[float, float]:
    """The two ends of the force's range."""
    low, high = np.percentile(force, [0.1, 99.9])
    return float(low), float(high)


def _resting(force: Array, rest: float, peak: float) -> float:
    """The middle of the force near its resting end: the least of many medians is below it by their noise."""
    for _ in range(_ROUNDS):
        free = force[force < rest + ONSET * (peak - rest)]
        if not len(free):
            break
        rest = float(np.median(free))
    return rest


def _touches(force: Array, rest: float, peak: float, threshold: float) -> list[tuple[int, int]]:
    """Stretches above the onset that reach well above it.

    Two are one if the force between them stays above half of the onset.
    """
    spans: list[tuple[int, int]] = []
    for begin, end in runs(force > threshold):
        if spans and force[spans[-1][1] : begin].mean() > (rest + threshold) / 2:
            spans[-1] = (spans[-1][0], end)
        else:
            spans.append((begin, end))
    return [(b, e) for b, e in spans if force[b:e].max() > rest + _REACHED * (peak - rest)]


def _between_losses(
    channels: Channels,
    sign: float,
    levels: tuple[float, float],
    air: FreeMotion,
    spans: list[tuple[int, int]],
    chain: Chain,
) -> list[tuple[int, int]]:
    """The spans without what the readings before any filter show as air: the position moves and the force does not.

    A filter joins what a probe that bounces does between two touches. `levels` are the force at rest and at its peak
    [N], with its sign; a span begins with the chain's delay.
    """
    rest, peak = levels
    force, position = sign * channels.force, channels.position
    free = force[air.way * position < air.way * air.limit] - rest
    noise = GAUSSIAN * float(np.median(np.abs(free))) if len(free) else 0.0
    delay, found = round(chain.delay / chain.dt), []
    for begin, end in spans:
        slope = (peak - rest) / (float(np.ptp(position[begin:end])) or np.inf)
        first = begin
        for a, b in runs(force[begin:end] < rest + _CLEAR * noise):
            off, on = begin + a, begin + b
            moved = float(np.ptp(position[off:on]))
            if begin < off and on < end and on - off >= _SEVERAL and moved * slope > 2 * _CLEAR * noise:
                found.append((first, off))
                first = on + delay
        found.append((first, end))
    return found
