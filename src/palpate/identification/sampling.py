"""From the columns of a record to two channels on one even grid of time, with what was found on the way."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.identification.causes import Code, Warn, from_word
from palpate.identification.sample_clock import at_limit, past_end
from palpate.records import Record
from palpate.signals.samples import block_means, fresh_rows

_FEWEST = 20
_LARGEST = 1e30
"""Of a reading in SI: further ones cannot be squared and summed without loss."""
_JITTER = 0.05
_GAP = 10.0
_BRIDGED, _FEW = 10, 1_000_000
"""Times as many samples an even grid may have as the log has rows; so many it may have in any case."""
_SLOW = 50.0
_FASTEST = 1e7
"""Rows a second: faster no force is recorded, and a lag of some ms would be more rows than a log has."""
_LONG_STEP = 0.5
"""Between two rows [s]: so slow a log is more likely one whose time is not in seconds."""
_ROUNDED = 1e3
"""Last places of a floating-point number below which a step is its own rounding, no log's."""
_WHOLE = 0.05
"""Of a step that a multiple of it may be off by: sums and units round too."""
_BESIDE, _ALONE = 4, 5.0
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
    time, position, force = record["time"], record["position"], record["force"]
    warnings = [Warn(from_word(note["code"]), note["text"]) for note in record.meta.get("notes", ())]
    _check(time, position, force)
    rounding = last_digit(position) / 12**0.5, last_digit(force) / 12**0.5
    force = _without_spikes(force, rounding[1], warnings)
    twice = np.flatnonzero(np.diff(time) == 0)
    if len(twice):
        first = f"first in row {twice[0] + 2}"
        text = f"{len(twice)} rows repeat the time of the row before ({first}); the first of each is kept"
        warnings.append(Warn(Code.IRREGULAR_TIME, text))
        time, position, force = (np.delete(own, twice + 1) for own in (time, position, force))
        _check(time, position, force)
    dt, even = _period(time, warnings)
    use_x = _usable("position", position, dt, warnings)
    use_f = _usable("force", force, dt, warnings)
    _leave_saturated(use_x, use_f, position, force, warnings)
    rate = min(_rate(time[use_x]), _rate(time[use_f]), 1 / dt)
    if rate < _SLOW:
        seen = f"motion faster than about {rate / 8:.2g} Hz is not seen"
        warnings.append(Warn(Code.LOW_RATE, f"only {rate:.3g} fresh readings a second: {seen}"))
        if dt >= _LONG_STEP:
            text = f"by its unit there is a row every {dt:.3g} s: is the time in ms? then say NAME:ms"
            warnings.append(Warn(Code.TIME_DOUBTFUL, text))
    grid = time if even else np.arange(time[0], time[-1] + dt / 2, dt)
    x, f, valid = _common(grid, time, (position, use_x), (force, use_f), even)
    own_x, near_x = _bridge(grid, time[use_x], position[use_x])
    there = np.isfinite(force)
    rows = np.searchsorted(time[there], grid + dt / 4, side="right") - 1
    raw = Raw(float(time[0]), dt, own_x, force[there][np.maximum(rows, 0)], near_x & valid)
    return Channels(float(time[0]), dt, x, f, valid, rate, raw, tuple(warnings), rounding)


def _without_spikes(force: Array, rounding: float, warnings: list[Warn]) -> Array:
    """The force, shape (n,), without readings that stand alone: far beyond all others beside them but one at each end.

    No filtered sensor returns from such a force within a row.
    """
    rows = np.flatnonzero(np.isfinite(force))
    own = force[rows]
    bend = np.abs(own[1:-1] - (own[:-2] + own[2:]) / 2)
    usual = max(float(np.median(bend)), rounding)
    at = 1 + np.flatnonzero(bend > _ALONE * usual)
    at = at[(at >= _BESIDE) & (at < len(own) - _BESIDE)]
    beside = np.delete(np.arange(-_BESIDE, _BESIDE + 1), _BESIDE)
    near = np.sort(own[at[:, None] + beside], axis=1)[:, 1:-1]
    beyond = np.maximum(own[at] - near[:, -1], near[:, 0] - own[at])
    spikes = rows[at[beyond > _ALONE * np.maximum(np.ptp(near, axis=1), 2 * usual)]]
    if not len(spikes):
        return force
    far = f"{len(spikes)} readings of the force stand alone, far from those beside them"
    warnings.append(Warn(Code.MISSING_SAMPLES, f"{far} (first: row {spikes[0] + 1}); they are bridged"))
    force = force.copy()
    force[spikes] = np.nan
    return force


def last_digit(values: Array) -> float:
    """The step whose multiples all readings are: what a log of few digits was rounded to; 0 if there is none."""
    seen = values[np.isfinite(values)]
    least = _ROUNDED * float(np.spacing(np.abs(seen).max()))
    for some in (seen[: 50 * _FEWEST], seen):  # a log of all digits is told by its first rows
        found = np.unique(some)
        step = float(np.diff(found).min(initial=np.inf))
        if step <= least:
            return 0.0
    if len(found) < _FEWEST:
        return 0.0
    whole = np.rint((found - found[0]) / step)
    step = float((found[-1] - found[0]) / whole[-1])  # the mean of many is finer than one
    return step if float(np.abs(found - found[0] - whole * step).max()) < _WHOLE * step else 0.0


def thinned(channels: Channels, size: int) -> Channels:
    """Average `size` neighbouring samples, in the same way on both channels."""
    if size < 2:
        return channels
    position, force = (block_means(own, size) for own in (channels.position, channels.force))
    valid = block_means(channels.valid.astype(float), size) == 1
    start, dt = channels.start + (size - 1) / 2 * channels.dt, channels.dt * size
    own, other = (rounding / size**0.5 for rounding in channels.rounding)
    return replace(
        channels, start=start, dt=dt, position=position, force=force, valid=valid, rate=min(channels.rate, 1 / dt),
        rounding=(own, other),
    )  # fmt: skip


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
    of_force = use_f.sum() < use_x.sum()
    (slow, use_slow), (fast, use_fast) = (force, position) if of_force else (position, force)
    instants = time[use_slow]
    own, near = _bridge(grid, instants, slow[use_slow])
    other, near_other = _bridge(instants, time[use_fast], fast[use_fast])
    other, near_fast = _bridge(grid, instants[near_other], other[near_other])
    return *((other, own) if of_force else (own, other)), near & near_fast


def _check(time: Array, position: Array, force: Array) -> None:
    if len(time) < _FEWEST:
        count = "1 row with a time of its" if len(time) == 1 else f"{len(time)} rows with a time of their"
        advice = "log longer, or check --time, --start and --end"
        raise InputError(f"the log has {count} own; at least {_FEWEST} are needed: {advice}")
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        row = int(back[0]) + 2
        text = f"time runs backwards at row {row} (from {time[row - 2]:.6g} to {time[row - 1]:.6g} s)"
        raise InputError(f"{text}; sort the log or cut it there with --start and --end")
    if (rate := _rate(time)) > _FASTEST:
        text = f"there are {rate:.3g} rows a second, faster than any sensor"
        raise InputError(f"{text}; is the unit of time right?")
    for name, values in (("position", position), ("force", force)):
        seen = values[np.isfinite(values)]
        if len(seen) < _FEWEST:
            raise InputError(f"the {name} has {len(seen)} readings; at least {_FEWEST} are needed")
        reach = float(np.abs(seen).max())
        if reach > _LARGEST or 0 < reach < 1 / _LARGEST:
            text = f"the {name} reaches {reach:.3g}, beyond any sensor"
            raise InputError(f"{text}; is it the right column and unit?")
        if np.ptp(seen) == 0:
            always = f"the {name} is {seen[0]:.6g} in every row"
            raise InputError(f"{always}; is it the right column, and did anything move?")


def _period(time: Array, warnings: list[Warn]) -> tuple[float, bool]:
    """The grid's period, and whether the rows lie on it."""
    step = np.diff(time)
    gaps = step > 3 * np.median(step)
    dt = float(step[~gaps].mean())
    samples, widest = (time[-1] - time[0]) / dt, int(np.argmax(step))
    if samples > max(_BRIDGED * len(time), _FEW):  # its even grid would fill the memory
        raise InputError(
            f"the time jumps by {step[widest]:.6g} s at row {widest + 2}, and {len(time)} rows would become"
            f" {samples:.3g} samples; cut the log there with --start and --end"
        )
    even = not gaps.any() and abs(time[-1] - time[0] - dt * len(step)) < dt
    even = even and float(np.abs(step - dt).max()) <= _JITTER * dt
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
        count, first = int((~usable).sum()), int(np.argmin(usable)) + 1
        text = f"{count} of {len(values)} rows have no {name} (first: row {first}); they are bridged"
        warnings.append(Warn(Code.MISSING_SAMPLES, text))
    rows = np.flatnonzero(usable)
    fresh = fresh_rows(values[rows])
    if fresh is not None:
        every = len(fresh) / max(int(fresh.sum()), 1)
        text = f"the {name} is fresh in one of {every:.3g} rows, every {every * dt:.4g} s; the others are left out"
        warnings.append(Warn(Code.HELD_SAMPLES, text))
        usable[rows[~fresh]] = False
    return usable


def _leave_saturated(
    use_position: Mask, use_force: Mask, position: Array, force: Array, warnings: list[Warn]
) -> None:
    """Take rows out in which a channel stands at the end of its range."""
    rows = np.flatnonzero(use_force & use_position)
    x, f = position[rows], force[rows]
    ends = float(f.max()), float(f.min())  # near zero rests a force in free motion
    far = [end for end in ends if abs(end) > max(map(abs, ends)) / 2]
    stuck, past = at_limit(f, x, far), past_end(x, f)
    for name, values, at, use in (("force", f, stuck, use_force), ("position", x, past, use_position)):
        if at.any():
            rests = f"the {name} rests at its extreme value {values[at][0]:.6g}"
            warnings.append(Warn(Code.SATURATED, f"{rests} for {int(at.sum())} rows; they are left out"))
            use[rows[at]] = False


def _rate(time: Array) -> float:
    """Readings per second, long gaps left aside."""
    step = np.diff(time)
    step = step[step > 0]
    usual = step[step <= 3 * np.median(step)]
    return float(1 / usual.mean())


def _bridge(grid: Array, time: Array, values: Array) -> tuple[Array, Mask]:
    """Straight lines between readings; not valid within gaps longer than ten usual steps."""
    usual = float(np.median(np.diff(time)))
    after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    near = (time[after] - time[after - 1]) <= _GAP * usual
    return np.interp(grid, time, values), near & (grid >= time[0]) & (grid <= time[-1])
