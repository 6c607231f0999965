"""From the columns of a record to two channels on one even grid of time, with what was found on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.held import fresh_rows
from palpate.identification.saturation import at_limit
from palpate.identification.warning_codes import Code, Warn, from_word
from palpate.records import Record

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FEWEST = 20
_JITTER = 0.05
_GAP = 10.0
_SLOW = 50.0
_LONG_STEP = 0.5
"""Between two rows [s]: so slow a log is more likely one whose time is not in seconds."""


@dataclass
class Channels:
    """Position and force on an even grid.

    Args:
        start: time of the first sample [s].
        dt: sampling period [s].
        position, force: shape (n,), in the record's SI units.
        valid: where both channels have readings near by, shape (n,).
        rate: fresh readings per second of the slower channel [1/s].
        warnings: what was found and done.
    """

    start: float
    dt: float
    position: Array
    force: Array
    valid: Mask
    rate: float
    warnings: list[Warn] = field(default_factory=list)

    @property
    def time(self) -> Array:
        """Of each sample [s], shape (n,)."""
        time: Array = self.start + np.arange(len(self.position), dtype=np.float64) * self.dt
        return time


def channels_of(record: Record) -> Channels:
    """Check the time base of a record with `time`, `position` and `force`, and resample where it asks for it.

    Raises:
        InputError: too few rows, time that runs backwards, a channel that never changes.
    """
    time, position, force = record["time"], record["position"], record["force"]
    warnings = [Warn(from_word(note["code"]), note["text"]) for note in record.meta.get("notes", ())]
    _check(time, position, force)
    step = np.diff(time)
    twice = int((step == 0).sum())
    if twice:
        row = int(np.flatnonzero(step == 0)[0]) + 2
        text = (
            f"{twice} rows repeat the time of the row before (first in row {row}); the first of each is kept"
        )
        warnings.append(Warn(Code.IRREGULAR_TIME, text))
        keep = np.r_[True, step > 0]
        time, position, force = time[keep], position[keep], force[keep]
        step = np.diff(time)
        _check(time, position, force)
    dt, even = _period(time, step, warnings)
    use_x = _usable("position", position, dt, warnings)
    use_f = _usable("force", force, dt, warnings)
    _leave_saturated(use_f & use_x, use_f, position, force, warnings)
    rate = min(_rate(time[use_x]), _rate(time[use_f]), 1 / dt)
    if rate < _SLOW:
        text = f"only {rate:.3g} fresh readings a second: behaviour faster than about {rate / 8:.2g} Hz is not seen"
        text += "; or is the time in ms? then say NAME:ms" if dt >= _LONG_STEP else ""
        warnings.append(Warn(Code.LOW_RATE, text))
    if even and use_x.all() and use_f.all():
        return Channels(float(time[0]), dt, position, force, np.ones(len(time), bool), rate, warnings)
    grid = np.arange(time[0], time[-1] + dt / 2, dt)
    x, near_x = _bridge(grid, time[use_x], position[use_x])
    f, near_f = _bridge(grid, time[use_f], force[use_f])
    return Channels(float(time[0]), dt, x, f, near_x & near_f, rate, warnings)


def held_force(record: Record, channels: Channels) -> Array:
    """The force as it stood in the log at the channels' times, held from row to row, shape (n,)."""
    time, force = record["time"], record["force"]
    there = np.isfinite(force)
    rows = np.searchsorted(time[there], channels.time + channels.dt / 4, side="right") - 1
    held: Array = force[there][np.maximum(rows, 0)]
    return held


def _check(time: Array, position: Array, force: Array) -> None:
    if len(time) < _FEWEST:
        count = f"{len(time)} row{'s' * (len(time) != 1)} with a time of {'their' if len(time) != 1 else 'its'} own"
        raise InputError(
            f"the log has {count}; at least {_FEWEST} are needed: log longer, or check --time, --start and --end"
        )
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        row = int(back[0]) + 2
        text = f"time runs backwards at row {row} (from {time[row - 2]:.6g} to {time[row - 1]:.6g} s)"
        raise InputError(f"{text}; sort the log or cut it there with --start and --end")
    for name, values in (("position", position), ("force", force)):
        seen = values[np.isfinite(values)]
        if len(seen) < _FEWEST:
            raise InputError(f"the {name} has {len(seen)} readings; at least {_FEWEST} are needed")
        if np.ptp(seen) == 0:
            raise InputError(
                f"the {name} is {seen[0]:.6g} in every row; is it the right column, did anything move?"
            )


def _period(time: Array, step: Array, warnings: list[Warn]) -> tuple[float, bool]:
    """The grid's period, and whether the rows lie on it."""
    middle = float(np.median(step))
    gaps = step > 3 * middle
    dt = float(step[~gaps].mean())
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
        count = int((~usable).sum())
        first = int(np.argmin(usable)) + 1
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
    both: Mask, use_force: Mask, position: Array, force: Array, warnings: list[Warn]
) -> None:
    rows = np.flatnonzero(both)
    stuck = at_limit(force[rows], position[rows], _far_end(force[rows]))
    if not stuck.any():
        return
    level = force[rows[stuck]][0]
    text = f"the force rests at its extreme value {level:.6g} for {int(stuck.sum())} rows; they are left out"
    warnings.append(Warn(Code.SATURATED, text))
    use_force[rows[stuck]] = False


def _far_end(force: Array) -> list[float]:
    """The end of the range that is further from the usual force; none if that is zero: so rests a force in the air."""
    middle = float(np.median(force))
    level = max((float(force.max()), float(force.min())), key=lambda extreme: abs(extreme - middle))
    return [level] if level else []


def _rate(time: Array) -> float:
    """Readings per second, long gaps left aside."""
    step = np.diff(time)
    usual = step[step <= 3 * np.median(step)]
    return float(1 / usual.mean())


def _bridge(grid: Array, time: Array, values: Array) -> tuple[Array, Mask]:
    """Straight lines between readings; not valid within gaps longer than ten usual steps."""
    usual = float(np.median(np.diff(time)))
    after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    near = (time[after] - time[after - 1]) <= _GAP * usual
    return np.interp(grid, time, values), near & (grid >= time[0]) & (grid <= time[-1])
