"""From the columns of a record to two channels on one even grid of time, with what was found on the way."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.causes import Code, Warn, from_word
from palpate.identification.sample_clock import at_limit, past_end
from palpate.records import Record
from palpate.signals.samples import block_means, fresh_rows

_MIN_ROWS = 20
_MAX_READING = 1e30
"""Of a reading in SI: further ones cannot be squared and summed without loss."""
_MAX_JITTER = 0.05
_MAX_BRIDGED_STEPS = 10.0
_MAX_GRID_RATIO, _ALLOWED_GRID_SAMPLES = 10, 1_000_000
"""Times as many samples an even grid may have as the log has rows; so many it may have in any case."""
_LOW_RATE = 50.0
_MAX_RATE = 1e7
"""Rows a second: faster no force is recorded, and a lag of some ms would be more rows than a log has."""
_LONG_STEP = 0.5
"""Between two rows [s]: so slow a log is more likely one whose time is not in seconds."""
_ROUNDING_PLACES = 1e3
"""Last places of a floating-point number below which a step is its own rounding, no log's."""
_STEP_TOLERANCE = 0.05
"""Of a step that a multiple of it may be off by: sums and units round too."""
_SPIKE_NEIGHBOURS, _SPIKE_RANGES = 4, 5.0
"""Readings on either side that one is held against, and how many times their range it lies beyond them to stand
alone."""


@dataclass(frozen=True)
class Raw:
    """The rows of a log as they stand, on its even grid.

    Args:
        start, dt: first time and period [s].
        position: shape (n,) [m].
        held_force: the force as it stands in the log, held from row to row, shape (n,) [N].
        valid: where both channels have readings near by, shape (n,).
    """

    start: float
    dt: float
    position: Array
    held_force: Array
    valid: Mask


@dataclass(frozen=True)
class Channels:
    """Position and force on one even grid of time, both sampled at the same instants before.

    Args:
        start, dt: time of the first sample, and sampling period [s].
        position, force: shape (n,), SI units.
        valid: where both channels have readings near by, shape (n,).
        rate: fresh readings per second of the slower channel [1/s].
        raw: the rows behind it.
        warnings: of this stage.
        rounding: standard deviations of what the last digits of position [m] and force [N] in the log hide in a sample.
    """

    start: float
    dt: float
    position: Array
    force: Array
    valid: Mask
    rate: float
    raw: Raw
    warnings: tuple[Warn, ...] = ()
    rounding: tuple[float, float] = (0.0, 0.0)

    @property
    def time(self) -> Array:
        """Of each sample [s], shape (n,)."""
        return np.asarray(self.start + np.arange(len(self.position), dtype=np.float64) * self.dt)


def channels_of(record: Record) -> Channels:
    """Check the time base of a record with `time`, `position` and `force`, and resample where it asks for it.

    Raises:
        InputError: too few rows, time that runs backwards, a channel that never changes.
    """
    time = record["time"]
    position = record["position"]
    force = record["force"]
    warnings = [Warn(from_word(note["code"]), note["text"]) for note in record.meta.get("notes", ())]
    _check(time, position, force)
    rounding = last_digit(position) / 12**0.5, last_digit(force) / 12**0.5
    force = _without_spikes(force, rounding[1], warnings)
    repeated = np.flatnonzero(np.diff(time) == 0)
    if len(repeated):
        first = f"first in row {repeated[0] + 2}"
        text = f"{len(repeated)} rows repeat the time of the row before ({first}); the first of each is kept"
        warnings.append(Warn(Code.IRREGULAR_TIME, text))
        time, position, force = (np.delete(column, repeated + 1) for column in (time, position, force))
        _check(time, position, force)
    dt, even = _period(time, warnings)
    use_x = _usable("position", position, dt, warnings)
    use_f = _usable("force", force, dt, warnings)
    _leave_saturated(use_x, use_f, position, force, warnings)
    rate = min(_rate(time[use_x]), _rate(time[use_f]), 1 / dt)
    if rate < _LOW_RATE:
        limit_text = f"motion faster than about {rate / 8:.2g} Hz is not seen"
        warnings.append(Warn(Code.LOW_RATE, f"only {rate:.3g} fresh readings a second: {limit_text}"))
        if dt >= _LONG_STEP and not record.meta.get("time_stated"):
            text = f"by its unit there is a row every {dt:.3g} s: is the time in ms? then say NAME:ms"
            warnings.append(Warn(Code.TIME_DOUBTFUL, text))
    grid = time if even else np.arange(time[0], time[-1] + dt / 2, dt)
    even_position, even_force, valid = _common(grid, time, (position, use_x), (force, use_f), even)
    raw_position, position_near = _bridge(grid, time[use_x], position[use_x])
    has_force = np.isfinite(force)
    rows = np.searchsorted(time[has_force], grid + dt / 4, side="right") - 1
    raw = Raw(float(time[0]), dt, raw_position, force[has_force][np.maximum(rows, 0)], position_near & valid)
    return Channels(
        float(time[0]), dt, even_position, even_force, valid, rate, raw, tuple(warnings), rounding
    )


def _without_spikes(force: Array, rounding: float, warnings: list[Warn]) -> Array:
    """The force, shape (n,), without readings that stand alone: far beyond all others beside them but one at each end.

    No filtered sensor returns from such a force within a row.
    """
    rows = np.flatnonzero(np.isfinite(force))
    readings = force[rows]
    bends = np.abs(readings[1:-1] - (readings[:-2] + readings[2:]) / 2)
    usual_bend = max(float(np.median(bends)), rounding)
    candidates = 1 + np.flatnonzero(bends > _SPIKE_RANGES * usual_bend)
    candidates = candidates[
        (candidates >= _SPIKE_NEIGHBOURS) & (candidates < len(readings) - _SPIKE_NEIGHBOURS)
    ]
    offsets = np.delete(np.arange(-_SPIKE_NEIGHBOURS, _SPIKE_NEIGHBOURS + 1), _SPIKE_NEIGHBOURS)
    neighbours = np.sort(readings[candidates[:, None] + offsets], axis=1)[:, 1:-1]
    excess = np.maximum(readings[candidates] - neighbours[:, -1], neighbours[:, 0] - readings[candidates])
    spikes = rows[candidates[excess > _SPIKE_RANGES * np.maximum(np.ptp(neighbours, axis=1), 2 * usual_bend)]]
    if not len(spikes):
        return force
    message = f"{len(spikes)} readings of the force stand alone, far from those beside them"
    warnings.append(Warn(Code.MISSING_SAMPLES, f"{message} (first: row {spikes[0] + 1}); they are bridged"))
    force = force.copy()
    force[spikes] = np.nan
    return force


def last_digit(values: Array) -> float:
    """The step whose multiples all readings are: what a log of few digits was rounded to; 0 if there is none."""
    known = values[np.isfinite(values)]
    min_step = _ROUNDING_PLACES * float(np.spacing(np.abs(known).max()))
    for readings in (known[: 50 * _MIN_ROWS], known):  # a log of all digits is told by its first rows
        levels = np.unique(readings)
        step = float(np.diff(levels).min(initial=np.inf))
        if step <= min_step:
            return 0.0
    if len(levels) < _MIN_ROWS:
        return 0.0
    multiples = np.rint((levels - levels[0]) / step)
    step = float((levels[-1] - levels[0]) / multiples[-1])  # the mean of many is finer than one
    return (
        step if float(np.abs(levels - levels[0] - multiples * step).max()) < _STEP_TOLERANCE * step else 0.0
    )


def thinned(channels: Channels, size: int) -> Channels:
    """Average `size` neighbouring samples, in the same way on both channels."""
    if size < 2:
        return channels
    position, force = (block_means(signal, size) for signal in (channels.position, channels.force))
    valid = block_means(channels.valid.astype(float), size) == 1
    start = channels.start + (size - 1) / 2 * channels.dt
    dt = channels.dt * size
    signal, force_rounding = (rounding / size**0.5 for rounding in channels.rounding)
    return replace(
        channels,
        start=start,
        dt=dt,
        position=position,
        force=force,
        valid=valid,
        rate=min(channels.rate, 1 / dt),
        rounding=(signal, force_rounding),
    )


def _common(
    grid: Array, time: Array, position: tuple[Array, Mask], force: tuple[Array, Mask], even: bool
) -> tuple[Array, Array, Mask]:
    """Both channels at the instants of the slower one, joined by straight lines at the grid.

    A force of 125 Hz joined by straight lines beside a position of 500 Hz looks like a mass of -K T^2/12. Read at the
    same instants, both lose the same to the lines between them.
    """
    (x, use_x), (f, use_f) = position, force
    if even and use_x.all() and use_f.all():
        return x, f, np.ones(len(grid), bool)
    force_is_slow = use_f.sum() < use_x.sum()
    (slow, use_slow), (fast, use_fast) = (force, position) if force_is_slow else (position, force)
    instants = time[use_slow]
    slow_signal, slow_near = _bridge(grid, instants, slow[use_slow])
    fast_signal, read = _bridge(instants, time[use_fast], fast[use_fast])
    fast_signal, fast_near = _bridge(grid, instants[read], fast_signal[read])
    return *(
        (fast_signal, slow_signal) if force_is_slow else (slow_signal, fast_signal)
    ), slow_near & fast_near


def _check(time: Array, position: Array, force: Array) -> None:
    if len(time) < _MIN_ROWS:
        count = "1 row with a time of its" if len(time) == 1 else f"{len(time)} rows with a time of their"
        advice = "log longer, or check --time, --start and --end"
        raise InputError(f"the log has {count} own; at least {_MIN_ROWS} are needed: {advice}")
    backwards = np.flatnonzero(np.diff(time) < 0)
    if len(backwards):
        row = int(backwards[0]) + 2
        text = f"time runs backwards at row {row} (from {time[row - 2]:.6g} to {time[row - 1]:.6g} s)"
        raise InputError(f"{text}; sort the log or cut it there with --start and --end")
    if (rate := _rate(time)) > _MAX_RATE:
        text = f"there are {rate:.3g} rows a second, faster than any sensor"
        raise InputError(f"{text}; is the unit of time right?")
    for name, values in (("position", position), ("force", force)):
        known = values[np.isfinite(values)]
        if len(known) < _MIN_ROWS:
            raise InputError(f"the {name} has {len(known)} readings; at least {_MIN_ROWS} are needed")
        largest = float(np.abs(known).max())
        if largest > _MAX_READING or 0 < largest < 1 / _MAX_READING:
            text = f"the {name} reaches {largest:.3g}, beyond any sensor"
            raise InputError(f"{text}; is it the right column and unit?")
        if np.ptp(known) == 0:
            constant = f"the {name} is {known[0]:.6g} in every row"
            raise InputError(f"{constant}; is it the right column, and did anything move?")


def _period(time: Array, warnings: list[Warn]) -> tuple[float, bool]:
    """The grid's period, and whether the rows lie on it."""
    step = np.diff(time)
    gaps = step > 3 * np.median(step)
    dt = float(step[~gaps].mean())
    samples = (time[-1] - time[0]) / dt
    widest = int(np.argmax(step))
    if samples > max(
        _MAX_GRID_RATIO * len(time), _ALLOWED_GRID_SAMPLES
    ):  # its even grid would fill the memory
        raise InputError(
            f"the time jumps by {step[widest]:.6g} s at row {widest + 2}, and {len(time)} rows would become"
            f" {samples:.3g} samples; cut the log there with --start and --end"
        )
    even = not gaps.any() and abs(time[-1] - time[0] - dt * len(step)) < dt
    even = even and float(np.abs(step - dt).max()) <= _MAX_JITTER * dt
    if not even:
        text = f"steps of time between {step.min():.4g} and {step.max():.4g} s; resampled every {dt:.4g} s"
        if gaps.any():
            text += f"; {int(gaps.sum())} gaps longer than three steps"
        warnings.append(Warn(Code.IRREGULAR_TIME, text))
    return dt, even


def _usable(name: str, values: Array, dt: float, warnings: list[Warn]) -> Mask:
    """Rows whose reading is there and is fresh."""
    usable = np.isfinite(values)
    if not usable.all() and not any(w.code is Code.MISSING_SAMPLES for w in warnings):
        count = int((~usable).sum())
        first = int(np.argmin(usable)) + 1
        text = f"{count} of {len(values)} rows have no {name} (first: row {first}); they are bridged"
        warnings.append(Warn(Code.MISSING_SAMPLES, text))
    rows = np.flatnonzero(usable)
    fresh = fresh_rows(values[rows])
    if fresh is not None:
        stride = len(fresh) / max(int(fresh.sum()), 1)
        text = f"the {name} is fresh in one of {stride:.3g} rows, every {stride * dt:.4g} s; the others are left out"
        warnings.append(Warn(Code.HELD_SAMPLES, text))
        usable[rows[~fresh]] = False
    return usable


def _leave_saturated(
    use_position: Mask, use_force: Mask, position: Array, force: Array, warnings: list[Warn]
) -> None:
    """Take rows out in which a channel stands at the end of its range."""
    rows = np.flatnonzero(use_force & use_position)
    x = position[rows]
    f = force[rows]
    ends = float(f.max()), float(f.min())  # near zero rests a force in free motion
    far_ends = [end for end in ends if abs(end) > max(map(abs, ends)) / 2]
    stuck = at_limit(f, x, far_ends)
    beyond_range = past_end(x, f)
    for name, values, is_stuck, is_used in (
        ("force", f, stuck, use_force),
        ("position", x, beyond_range, use_position),
    ):
        if is_stuck.any():
            where = f"the {name} rests at its extreme value {values[is_stuck][0]:.6g}"
            warnings.append(
                Warn(Code.SATURATED, f"{where} for {int(is_stuck.sum())} rows; they are left out")
            )
            is_used[rows[is_stuck]] = False


def _rate(time: Array) -> float:
    """Readings per second, long gaps left aside."""
    step = np.diff(time)
    step = step[step > 0]
    usual = step[step <= 3 * np.median(step)]
    return float(1 / usual.mean())


def _bridge(grid: Array, time: Array, values: Array) -> tuple[Array, Mask]:
    """Straight lines between readings; not valid within gaps longer than ten usual steps."""
    usual_step = float(np.median(np.diff(time)))
    after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    is_near = (time[after] - time[after - 1]) <= _MAX_BRIDGED_STEPS * usual_step
    return np.interp(grid, time, values), is_near & (grid >= time[0]) & (grid <= time[-1])
