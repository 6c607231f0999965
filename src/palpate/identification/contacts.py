"""Where in a log the probe touches the surface, and which way each channel counts."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.causes import BRIEF, Code, Warn
from palpate.identification.filters import FASTEST, Chain, choose_cutoff
from palpate.identification.free_motion import FLAT, Drift, FreeMotion, MovingMass, free_motion_of, payload_of
from palpate.identification.options import NOTHING_SAID, Options, lag_prior
from palpate.identification.sampling import Channels, thinned
from palpate.identification.steady_press import SteadyPress, steady_press
from palpate.identification.strokes import Stroke, strokes_of
from palpate.signals.samples import GAUSSIAN, block_means, detrend, runs

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
    levels = rest, top, threshold = _levels(sign * force, sign * rest, sign * peak)
    touches = _touches(sign * force, *levels)
    least = max(_FEWEST, int(2 * chain.settling / chain.dt))  # longer than the filter needs to settle
    spans = [(b, e) for b, e in touches if e - b >= least]
    text, rows = "press longer, or log faster", ""
    if air is not None and payload is None and spans:
        touches = _between_losses(channels, sign, (rest, top), air, spans, chain)
        spans = [(b, e) for b, e in touches if e - b >= least]
        text, rows = "press deeper, move slower or log faster", " until the probe leaves the surface again"
    if not spans:
        longest = max((e - b for b, e in touches), default=0)
        text = f"{BRIEF} {longest} rows{rows}, and {least} are needed: {text}"
        if not touches:
            text = f"the force stays between {force.min():.4g} and {force.max():.4g}: there is no contact"
        return Contacts((), False, sign, 1.0, rest, threshold, (Warn(Code.NO_CONTACT, text),))
    way = air.way if air else 1.0 if float(np.cov(sign * force, position)[0, 1]) >= 0 else -1.0
    told, signed = _reversed_signs(sign < 0, way < 0), options.force_sign in (None, int(sign))
    if not signed:
        side = "in contact it goes to the other side of its rest"
        told.append(Warn(Code.NEGATIVE_STIFFNESS, f"the sign of the force contradicts --force-sign: {side}"))
    if spans[0][0] == 0:
        text = "the log begins in contact: the depth of that contact is not known"
        told.append(Warn(Code.CONTACT_AT_START, text))
    if payload is not None:
        payload = replace(payload, mass=sign * way * payload.mass)
        told.append(Warn(Code.TOOL_INERTIA, payload.text))
    clear = _clear(sign * force, spans, int(chain.settling / chain.dt), threshold)
    return Contacts(tuple(spans), False, sign, way, rest, threshold, tuple(told), clear, signed, payload)


def _levels(force: Array, rest: float, peak: float) -> tuple[float, float, float]:
    """Force at rest, at its peak and of the threshold of a contact [N], after the sign.

    Rest is the middle of the force near its resting end: the least of many medians is below it by their noise. The
    threshold is clear of a share of the peak, and of the noise at rest.
    """
    for _ in range(_ROUNDS):
        free = force[force < rest + ONSET * (peak - rest)]
        if not len(free):
            break
        rest = float(np.median(free))
    onset = ONSET * (peak - rest)
    low = np.abs(force[force < rest + onset] - rest)
    noise = GAUSSIAN * float(np.median(low)) if len(low) else 0.0
    return rest, peak, rest + max(onset, 5 * noise)


def _clear(force: Array, spans: list[tuple[int, int]], begin: int, threshold: float) -> bool:
    """Whether the force out of contact, from a row on, keeps well below the threshold [N]."""
    out = np.arange(len(force)) >= begin
    for first, last in spans:
        out[first:last] = False
    free = force[out]
    if len(free) < _FEWEST:
        return False
    middle = float(np.median(free))
    return threshold - middle > _CLEAR * GAUSSIAN * float(np.median(np.abs(free - middle)))


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
    told = tuple(_reversed_signs(sign < 0 and options.force_sign is None, way < 0))
    found = Contacts(((0, len(force)),), True, sign, way, 0.0, -np.inf, told, clear=False)
    if options.bonded:
        return found
    width = max(len(force) // _BLOCKS, 1)
    f, x = (detrend(block_means(values, width)) for values in (sign * force, way * position))
    along = float(f @ x) / (float(np.sqrt((f @ f) * (x @ x))) or np.inf)
    text = "the probe never leaves the surface: the force at rest is not known and is estimated as an offset"
    told = (Warn(Code.CONTACT_AT_START, text), *told)
    return replace(found, warnings=told, signed=bool(strokes) or along > _SIGNED)


def _reversed_signs(force: bool, position: bool) -> list[Warn]:
    """Channels whose signs were reversed."""
    text = "the force goes to negative values in contact; its sign was reversed"
    warnings = [Warn(Code.FORCE_SIGN_REVERSED, text)] if force else []
    text = "the position falls as the force grows; its sign was reversed"
    return [*warnings, Warn(Code.POSITION_SIGN_REVERSED, text)] if position else warnings


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
