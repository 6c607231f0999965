"""Find the contacts of a log, and the signs of its force and position."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.causes import BRIEF_CONTACT, Code, Warn
from palpate.identification.filters import MAX_CUTOFF_RATIO, MIN_SPECTRUM_SAMPLES, Chain, choose_cutoff
from palpate.identification.free_motion import (
    MAX_SLOPE_RATIO,
    Drift,
    FreeMotion,
    MovingMass,
    find_free_motion,
    find_moving_mass,
)
from palpate.identification.options import DEFAULT_OPTIONS, Options, lag_prior
from palpate.identification.phases import Leak, remove_leak
from palpate.identification.ripple import Ripple, find_ripple
from palpate.identification.sampling import Channels, thinned
from palpate.identification.steady_press import SteadyPress, steady_press
from palpate.identification.strokes import Stroke, find_strokes
from palpate.signals.samples import block_means, detrend, outer_range, robust_std, runs

ONSET = 0.05
"""Fraction of the peak force above rest at which contact begins."""
_MIN_PEAK_FRACTION = 0.2
_MEDIAN_BLOCKS = 100
_MIN_RANGE_COVERED = 0.5
"""Fraction of the force's range that short medians must cover to represent it; an oscillation's do not."""
_MAX_BLOCK_SECONDS = 0.25
"""Longest block of a median [s]: a longer one would hold whole presses of a long log."""
_CLEAR_STDS = 3.0
"""Deviations of the free force below the threshold: noise cut at its own height stays below two, however coloured."""
_MIN_LOSS_READINGS = 3
"""Readings at rest that are a loss of contact: fewer may be a bounce of the noise."""
_MIN_ROWS = 20
_LEVEL_ITERATIONS = 3
_MIN_SIGN_CORRELATION = 0.6
"""Least correlation of block means of force and position that shows their signs."""
_STROKE_MARGIN = 0.05
"""Fraction of a stroke's duration added before and after it, in which the probe speeds up or slows down."""
_LOADED = 0.9
"""Fraction of the peak force at which a loading is over, and a hold may follow."""
_SAMPLES_PER_PERIOD = 16.0
"""Samples in a period of the cut-off after thinning: means of more readings lose 0.6 % there, in both channels."""


@dataclass(frozen=True)
class Contacts:
    """The contacts of a log.

    Args:
        spans: first and past-the-last sample of each contact, in filtered samples.
        bonded: the probe never leaves the surface (or pulls on it): the whole log is one contact.
        force_sign, position_sign: +1 or -1, factors with which both channels grow into the surface.
        resting: force without contact, after the sign [N]; 0 for a bonded contact.
        threshold: force above which contact is counted, after the sign [N].
        warnings: of this stage.
        clear: True if the force out of contact stays well below the threshold. Peaks of mere noise would leave the
            rest of the noise just below it. False for a bonded contact, which has no such force.
        signed: True if the signs of both channels are known: given, unchanged, or shown by free motion.
        payload: mass whose inertia the force shows in free motion, after the signs; None if it shows none.
        drift: of the force, removed as straight lines; None if the log shows none.
        press: at constant speed, of a log that has little else; None for another log.
        ripple: of the force, removed as a sine; None if free motion shows none.
        leak: of the force sensor, removed; None if free motion shows none.
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
    ripple: Ripple | None = None
    leak: Leak | None = None


def contacts_of(channels: Channels, options: Options = DEFAULT_OPTIONS) -> tuple[Channels, Chain, Contacts]:
    """Find the contacts with the widest filter, choose the filter from them, and find them again with it.

    A cut-off that the readings are too rare for is an `InputError`.
    """
    cutoff = options.cutoff
    highest = MAX_CUTOFF_RATIO * channels.rate
    if cutoff is not None and cutoff > 2 * highest:
        raise InputError(
            f"the cut-off must be at most {2 * highest:.4g} Hz, a quarter of the readings per second, got {cutoff:g}"
        )
    leak = None
    if not options.bonded:
        channels, leak = remove_leak(channels)
    chain = Chain(cutoff or highest, channels.dt)
    strokes = find_strokes(channels)
    drift = None
    press = None
    free_motion = None if options.bonded else _detect_free_motion(channels, chain, options.assumed_lag)
    channels, free_motion, ripple = _without_ripple(channels, chain, free_motion, options)
    if free_motion is not None and strokes and not _has_free_approach(channels, free_motion, strokes):
        free_motion = None
    if free_motion is not None and free_motion.drifts:
        drift = Drift(free_motion.stays * channels.dt, free_motion.levels)
        channels = _without_drift(channels, free_motion)
    contacts = _find_contacts(channels, chain, free_motion, options, strokes)
    if strokes:
        candidate = contacts  # a press whose contact no threshold shows is in contact from end to end
        if not contacts.spans:
            candidate = _whole_log_in_contact(channels, channels.force, channels.position, options, strokes)
        lag = lag_prior(options.lag, options.lag_std, 1 / channels.rate, 0.0, None)
        signs = candidate.position_sign, candidate.force_sign
        press = steady_press(channels, strokes, signs, candidate.resting, lag, drift, leak)
        if press is None or press.headline.stiffness.value <= 0:
            strokes = ()
            press = None
            contacts = _find_contacts(channels, chain, free_motion, options, strokes)
        else:
            contacts = candidate
    contacts = replace(contacts, drift=drift, press=press, ripple=ripple, leak=leak)
    chosen = cutoff or _cutoff_of_longest(channels, contacts)
    if not contacts.spans or chosen > 0.9 * highest:
        return channels, chain, contacts
    block = int(1 / (_SAMPLES_PER_PERIOD * chosen * channels.dt))
    thinned_channels = thinned(channels, min(block, len(channels.force) // _MIN_ROWS))
    narrow = Chain(chosen, thinned_channels.dt)
    again = _find_contacts(thinned_channels, narrow, free_motion, options, strokes)
    again = replace(again, drift=drift, press=press, ripple=ripple, leak=leak)
    return (thinned_channels, narrow, again) if again.spans else (channels, chain, contacts)


def _cutoff_of_longest(channels: Channels, contacts: Contacts) -> float:
    """Cut-off that the longest contact needs, its rise and fall included [Hz]; infinite if none narrows it.

    A creep test rises at once, and then holds for minutes: a loading that is over in fewer rows than show how fast it
    is needs the widest filter.
    """
    begin, end = max(contacts.spans, key=lambda span: span[1] - span[0], default=(0, 0))
    if begin == end:
        return np.inf
    load = contacts.force_sign * channels.force[begin:end] - contacts.resting
    peak = float(np.percentile(load, 98))
    first = int(np.argmax(load > _LOADED * peak))
    if first < MIN_SPECTRUM_SAMPLES and np.percentile(load[first:], 5) > peak / 2:
        return np.inf
    rows = slice(max(begin - (end - begin) // 2, 0), end + (end - begin) // 2)
    return choose_cutoff(channels.position[rows], channels.force[rows], channels.dt, channels.rate)


def _without_ripple(
    channels: Channels, chain: Chain, free_motion: FreeMotion | None, options: Options
) -> tuple[Channels, FreeMotion | None, Ripple | None]:
    """Channels and free motion less a ripple, and the ripple; as they are without one, or if a mass explains the force.

    A ripple hides where free motion ends: it is fitted again in the free motion that shows without it.
    """
    lag = options.assumed_lag
    unchanged = channels, free_motion, None
    if options.bonded or (free_motion and find_moving_mass(channels, chain, free_motion, lag) is not None):
        return unchanged
    shown = free_motion
    for _ in range(2):
        ripple = find_ripple(channels, shown)
        if ripple is None:
            return unchanged
        without = ripple.subtract(channels)
        shown = _detect_free_motion(without, chain, lag)
        if shown is None:
            return unchanged
    return without, shown, ripple


def _has_free_approach(channels: Channels, free_motion: FreeMotion, strokes: tuple[Stroke, ...]) -> bool:
    """True if a stroke crosses free motion, where the force stays constant."""

    def rise(x: Array, f: Array) -> float:
        u = x - x.mean()
        return abs(float(u @ f)) / max(float(u @ u), 1e-300)

    for stroke in strokes:
        margin = _STROKE_MARGIN * (stroke.end - stroke.begin)
        rows = replace(stroke, begin=stroke.begin - margin, end=stroke.end + margin).rows(channels)
        x = free_motion.way * channels.position[rows]
        f = channels.force[rows]
        before_contact = x < free_motion.way * free_motion.limit
        if np.count_nonzero(before_contact) >= _MIN_LOSS_READINGS and rise(
            x[before_contact], f[before_contact]
        ) < MAX_SLOPE_RATIO * rise(x, f):
            return True
    return False


def _find_contacts(
    channels: Channels,
    chain: Chain,
    free_motion: FreeMotion | None,
    options: Options,
    strokes: tuple[Stroke, ...],
) -> Contacts:
    """Find the stretches in contact.

    In free motion the position moves and the force does not. If the force follows the position at both ends of its
    range, the probe never leaves the surface: the whole log is one contact, and the force at rest is unknown.

    `chain` is the filter of the fit, so that the spans include its delay; `free_motion` is None if the log shows none,
    and `strokes` are those of a press at constant speed.
    """
    force = chain(channels.force)
    position = chain(channels.position)
    payload = find_moving_mass(channels, chain, free_motion, options.assumed_lag) if free_motion else None
    if payload is not None:
        force = force - payload.mass * chain(channels.position, 2, options.assumed_lag)
    low, high = outer_range(_block_medians(force, channels.dt))
    if free_motion is None and options.bonded is not False:
        return _whole_log_in_contact(channels, force, position, options, strokes)
    rest = free_motion.rest if free_motion else low if abs(low) <= abs(high) else high
    peak = max(low, high, key=lambda end: abs(end - rest))
    sign = 1.0 if peak > rest else -1.0
    levels = rest, top, threshold = _levels(sign * force, sign * rest, sign * peak)
    stretches = _touches(sign * force, *levels)
    min_rows = max(_MIN_ROWS, int(2 * chain.settling / chain.dt))  # longer than the filter needs to settle
    spans = [(first, last) for first, last in stretches if last - first >= min_rows]
    advice, rows = "press longer, or log faster", ""
    if free_motion is not None and payload is None and spans:
        stretches = _without_losses(channels, sign, (rest, top), free_motion, spans, chain)
        spans = [(first, last) for first, last in stretches if last - first >= min_rows]
        advice, rows = "press deeper, move slower or log faster", " until the probe leaves the surface again"
    if not spans:
        longest = max((last - first for first, last in stretches), default=0)
        advice = f"{BRIEF_CONTACT} {longest} rows{rows}, and {min_rows} are needed: {advice}"
        if not stretches:
            advice = f"the force stays between {force.min():.4g} and {force.max():.4g}: there is no contact"
        return Contacts((), False, sign, 1.0, rest, threshold, (Warn(Code.NO_CONTACT, advice),))
    direction = (
        free_motion.way if free_motion else 1.0 if float(np.cov(sign * force, position)[0, 1]) >= 0 else -1.0
    )
    warnings = _reversed_signs(sign < 0, direction < 0)
    signed = options.force_sign in (None, int(sign))
    if not signed:
        side = "in contact it goes to the other side of its rest"
        warnings.append(
            Warn(Code.NEGATIVE_STIFFNESS, f"the sign of the force contradicts --force-sign: {side}")
        )
    if spans[0][0] == 0:
        advice = "the log begins in contact: the depth of that contact is not known"
        warnings.append(Warn(Code.CONTACT_AT_START, advice))
    if payload is not None:
        payload = replace(payload, mass=sign * direction * payload.mass)
        warnings.append(Warn(Code.TOOL_INERTIA, payload.text))
    clear = _is_clear(sign * force, spans, int(chain.settling / chain.dt), threshold)
    return Contacts(
        tuple(spans), False, sign, direction, rest, threshold, tuple(warnings), clear, signed, payload
    )


def _levels(force: Array, rest: float, peak: float) -> tuple[float, float, float]:
    """Force at rest, at its peak and of the threshold of a contact [N], after the sign.

    Rest is the median of the force near its resting end, because the least of many medians is below it by their noise.
    The threshold lies above a fraction of the peak, and above the noise at rest.
    """
    for _ in range(_LEVEL_ITERATIONS):
        free = force[force < rest + ONSET * (peak - rest)]
        if not len(free):
            break
        rest = float(np.median(free))
    onset = ONSET * (peak - rest)
    noise = robust_std(force[force < rest + onset] - rest)
    return rest, peak, rest + max(onset, 5 * noise)


def _is_clear(force: Array, spans: list[tuple[int, int]], begin: int, threshold: float) -> bool:
    """True if the force out of contact, from a row on, stays well below the threshold [N]."""
    outside = np.arange(len(force)) >= begin
    for first, last in spans:
        outside[first:last] = False
    free = force[outside]
    if len(free) < _MIN_ROWS:
        return False
    middle = float(np.median(free))
    return threshold - middle > _CLEAR_STDS * robust_std(free - middle)


def _detect_free_motion(channels: Channels, chain: Chain, lag: float) -> FreeMotion | None:
    """Find free motion in a log; with a tool's inertia removed from the force, if the force shows one."""
    force = chain(channels.force)
    position = chain(channels.position)
    ends = outer_range(_block_medians(force, channels.dt))
    candidate = find_free_motion(channels.force, channels.position, ends, none=False)
    payload = find_moving_mass(channels, chain, candidate, lag, alone=True) if candidate else None
    without_inertia = None
    if payload is not None:
        without_inertia = find_free_motion(
            force - payload.mass * chain(channels.position, 2, lag), position, ends
        )
    return without_inertia or find_free_motion(channels.force, channels.position, ends)


def _without_drift(channels: Channels, free_motion: FreeMotion) -> Channels:
    """Remove the drift, so that the force in free motion is the same in every stay."""
    raw = channels.raw
    rows = np.arange(len(channels.force), dtype=np.float64)
    first = (raw.start - channels.start) / channels.dt
    held_force = raw.held_force
    places: Array = first + np.arange(len(held_force), dtype=np.float64) * (raw.dt / channels.dt)
    raw = replace(raw, held_force=held_force - free_motion.drift(places))
    warnings = channels.warnings
    drift_range = float(np.ptp(free_motion.levels))
    if drift_range > free_motion.noise:  # less is not seen in the log
        change = f"in free motion the force changes by {drift_range:.3g} N during the log"
        text = f"{change}; the change is removed as a drift"
        warnings = (*warnings, Warn(Code.FORCE_DRIFTS, text))
    return replace(channels, force=channels.force - free_motion.drift(rows), raw=raw, warnings=warnings)


def _whole_log_in_contact(
    channels: Channels, force: Array, position: Array, options: Options, strokes: tuple[Stroke, ...]
) -> Contacts:
    """The whole log as one contact. Signs stay as logged or given; in a press both channels grow."""
    sign = float(options.force_sign or 1)
    if strokes and not options.force_sign:
        low, high = outer_range(channels.force)
        sign = 1.0 if abs(high) >= abs(low) else -1.0
    rows = [stroke.rows(channels) for stroke in strokes]
    rises = sum(
        float(np.cov(sign * channels.force[stroke_rows], channels.position[stroke_rows])[0, 1])
        for stroke_rows in rows
    )
    direction = -1.0 if rises < 0 else 1.0
    warnings = tuple(_reversed_signs(sign < 0 and options.force_sign is None, direction < 0))
    contacts = Contacts(((0, len(force)),), True, sign, direction, 0.0, -np.inf, warnings, clear=False)
    if options.bonded:
        return contacts
    width = max(len(force) // _MEDIAN_BLOCKS, 1)
    f, x = (detrend(block_means(values, width)) for values in (sign * force, direction * position))
    correlation = float(f @ x) / (float(np.sqrt((f @ f) * (x @ x))) or np.inf)
    text = "the probe never leaves the surface: the force at rest is not known and is estimated as an offset"
    warnings = (Warn(Code.CONTACT_AT_START, text), *warnings)
    return replace(contacts, warnings=warnings, signed=bool(strokes) or correlation > _MIN_SIGN_CORRELATION)


def _reversed_signs(force: bool, position: bool) -> list[Warn]:
    """Warnings about channels whose signs were reversed."""
    text = "the force goes to negative values in contact; its sign was reversed"
    warnings = [Warn(Code.FORCE_SIGN_REVERSED, text)] if force else []
    text = "the position falls as the force grows; its sign was reversed"
    return [*warnings, Warn(Code.POSITION_SIGN_REVERSED, text)] if position else warnings


def _block_medians(force: Array, dt: float) -> Array:
    """Medians of short blocks, which a chattering probe does not affect; the force itself if it only oscillates."""
    width = min(len(force) // _MEDIAN_BLOCKS, int(_MAX_BLOCK_SECONDS / dt))
    if width < 4:
        return force
    views = np.lib.stride_tricks.sliding_window_view(force, width)[:: max(width // 4, 1)]
    medians: Array = np.median(views, axis=1)
    low, high = outer_range(force)
    return force if np.ptp(medians) <= _MIN_RANGE_COVERED * (high - low) else medians


def _touches(force: Array, rest: float, peak: float, threshold: float) -> list[tuple[int, int]]:
    """Stretches above the threshold that reach well above it.

    Two stretches are joined if the mean force between them is above half of the threshold.
    """
    spans: list[tuple[int, int]] = []
    for first, last in runs(force > threshold):
        if spans and force[spans[-1][1] : first].mean() > (rest + threshold) / 2:
            spans[-1] = (spans[-1][0], last)
        else:
            spans.append((first, last))
    return [
        (begin, end)
        for begin, end in spans
        if force[begin:end].max() > rest + _MIN_PEAK_FRACTION * (peak - rest)
    ]


def _without_losses(
    channels: Channels,
    sign: float,
    levels: tuple[float, float],
    free_motion: FreeMotion,
    spans: list[tuple[int, int]],
    chain: Chain,
) -> list[tuple[int, int]]:
    """Split spans where the unfiltered readings show free motion: the position moves and the force does not.

    A filter joins the touches of a bouncing probe. `levels` are the force at rest and at its peak [N], after the sign;
    a span begins with the chain's delay.
    """
    rest, peak = levels
    force = sign * channels.force
    position = channels.position
    noise = robust_std(force[free_motion.way * position < free_motion.way * free_motion.limit] - rest)
    delay = round(chain.delay / chain.dt)
    pieces = []
    for begin, end in spans:
        slope = (peak - rest) / (float(np.ptp(position[begin:end])) or np.inf)
        piece_begin = begin
        for lost_from, lost_to in runs(force[begin:end] < rest + _CLEAR_STDS * noise):
            off = begin + lost_from
            on = begin + lost_to
            travel = float(np.ptp(position[off:on]))
            if (
                begin < off
                and on < end
                and on - off >= _MIN_LOSS_READINGS
                and travel * slope > 2 * _CLEAR_STDS * noise
            ):
                pieces.append((piece_begin, off))
                piece_begin = on + delay
        pieces.append((piece_begin, end))
    return pieces
