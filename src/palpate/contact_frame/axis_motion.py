"""Motion of an axis from a log: speed and acceleration, and means over blocks of rows that slide in one direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.errors import InputError
from palpate.records import Record

MIN_ROWS = 50
"""Fewest rows of a log: ten for each term of the force, about."""
MAX_BLOCKS = 320
"""Approximate blocks of rows that are fitted by their means: many in a stroke, and few enough for 0.2 s a log."""
MIN_BLOCKS = 20
"""Fewest blocks: twice the terms of the force."""
HALF_WINDOWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Half-widths [rows] of the windows in which the speed is a local parabola's; that with the least error is taken."""
TRIED_ROWS = 50_000
"""Rows on which the windows are tried: 50 s at 1 kHz."""
MAX_NOISE_FRACTION = 0.01
"""Standard deviation of the speed, as a fraction of the fastest, that is good enough."""
NOISE_FACTOR = 5.0
"""Standard deviations of the speed below which rows are not fitted: noise would select the fast ones among them."""
MIN_SPEED_FRACTION = 0.005
"""Fraction of the fastest speed below which an axis counts as at rest."""
REVERSAL_FRACTION = 0.005
"""Fraction of a stroke after a reversal that is left out: presliding takes 0.1 to 0.5 % of usual strokes."""
TRANSIENT_FRACTIONS = (0.01, 0.04)
"""Lengths over which a change at a reversal fades, as fractions of a stroke: long presliding, a drive that yields."""
REVERSAL_TIME = 0.02
"""Time before and after each rest that is left out [s]: a force is read up to so late."""
ONE_SPEED = 1.25
"""Ratio of fast to slow speeds (90 and 10 % of the rows) below which a log has one speed."""


@dataclass(frozen=True)
class SlidingBlocks:
    """Means over blocks of rows that slide in one direction.

    Args:
        time: of the middle [s], shape (n,).
        count: rows of each block.
        force, position, speed, acceleration: means; the position from the middle of its range, over half of it.
        transients: means of what remains of a change at the last reversal, for each length, shape (n, 2).
        rows: speed of each row, and the block that it is of: a function's mean is that of its rows.
        limits: slowest, median and fastest speed without sign.
        noise: standard deviation of the speed of a row.
    """

    time: Array
    count: Array
    force: Array
    position: Array
    speed: Array
    acceleration: Array
    transients: Array
    rows: tuple[Array, Indices]
    limits: tuple[float, float, float]
    noise: float

    def mean(self, values: Array) -> Array:
        """Mean over each block of values of each row."""
        return np.asarray(np.bincount(self.rows[1], values, len(self.count)) / self.count)


def several_speeds(speed: Array) -> bool:
    """True if a direction has two speeds: one speed in each cannot separate offset, Coulomb and viscous friction."""
    sides = [abs(speed[speed < 0.0]), abs(speed[speed > 0.0])]
    ends = [np.quantile(side, (0.1, 0.9)) for side in sides if len(side)]
    return any(fast > ONE_SPEED * slow for slow, fast in ends)


def sliding_blocks(record: Record, lag: float = 0.0) -> tuple[SlidingBlocks | None, tuple[str, str]]:
    """Means over blocks of rows that slide, None where too few do; and the units of force and speed.

    Args:
        record: columns time, force (or torque), and position or velocity or both, in SI units.
        lag: of the force behind the motion [s].

    Raises:
        InputError: a column is missing, or there are too few rows.
    """
    axis = _axis(record, lag)
    blocks = _average(axis, _differentiate(axis))
    if blocks is not None and not several_speeds(blocks.speed):
        blocks = _without_ramps(blocks)
    if blocks is not None and len(blocks.count) < MIN_BLOCKS:
        blocks = None
    return blocks, (axis.force_unit, axis.speed_unit)


class _Samples(NamedTuple):
    """Equally spaced samples of an axis.

    Args:
        dt: [s].
        force: shape (n,).
        position: likewise; None where the log has a speed alone.
        velocity: likewise; None where it is derived from the position.
        present: samples that are near a row of the log.
    """

    dt: float
    force: Array
    position: Array | None
    velocity: Array | None
    present: Mask
    force_unit: str
    speed_unit: str


class _Motion(NamedTuple):
    """Position, speed, acceleration and force of each sample; noise of the speed; half-width of the window [rows]."""

    position: Array
    speed: Array
    acceleration: Array
    force: Array
    noise: float
    half_window: int


def _axis(record: Record, lag: float) -> _Samples:
    missing = [name for name in ("time", "force") if name not in record.columns]
    moved = [name for name in ("position", "velocity") if name in record.columns]
    if missing or not moved:
        lacking = " and ".join([*missing, *([] if moved else ["position or velocity"])])
        raise InputError(f"the friction of an axis needs time, force and its motion; there is no {lacking}")
    columns = {name: np.asarray(record[name], np.float64) for name in ("time", "force", *moved)}
    finite = np.all([np.isfinite(values) for values in columns.values()], axis=0)
    order = np.argsort(columns["time"][finite], kind="stable")
    columns = {name: values[finite][order] for name, values in columns.items()}
    time, first = np.unique(columns["time"], return_index=True)
    if len(time) < MIN_ROWS:
        raise InputError(f"the friction of an axis needs {MIN_ROWS} rows at least, got {len(time)}")
    steps = np.diff(time)
    dt = float(np.median(steps))
    if np.ptp(time) / dt > 20.0 * len(time):
        raise InputError(
            f"the log lasts {np.ptp(time):.3g} s and has a row each {dt:.3g} s, with gaps nearly everywhere;"
            " cut it with --start and --end"
        )
    grid = time[0] + dt * np.arange(int(np.ptp(time) / dt + 0.5) + 1)
    nearest = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    distance = np.minimum(abs(grid - time[nearest - 1]), abs(time[nearest] - grid))
    late = {"force": lag}
    sampled = {
        name: np.interp(grid + late.get(name, 0.0), time, values[first]) for name, values in columns.items()
    }
    units = record.units
    speed_unit = units["velocity"] if "velocity" in moved else _per_second(units["position"])
    return _Samples(
        dt, sampled["force"], sampled.get("position"), sampled.get("velocity"), distance < 3.0 * dt,
        units["force"], speed_unit,
    )  # fmt: skip


def _per_second(unit: str) -> str:
    return "1/s" if unit == "1" else f"{unit}/s"


def _differentiate(axis: _Samples) -> _Motion:
    """Speed by a local parabola whose window has the least error, and force by the same smoothing.

    The error is judged by the change of the speed from a window to that of twice the width: a short one shows noise, a
    long one the curvature of the motion.
    """
    order = 0 if axis.velocity is not None else 1
    signal = axis.velocity if axis.velocity is not None else axis.position
    assert signal is not None
    rows = _busiest(signal)
    widths = [width for width in HALF_WINDOWS if 24 * width <= len(signal)] or [1]
    kernels = {width: _kernel(width, order) for width in {*widths, *(2 * width for width in widths)}}
    speeds = {width: _smooth(signal[rows], kernel) / axis.dt**order for width, kernel in kernels.items()}
    errors = [np.sqrt(np.mean((speeds[w] - speeds[2 * w])[axis.present[rows]] ** 2)) for w in widths]
    best = int(np.argmin(errors))
    fastest = np.quantile(abs(speeds[widths[best]]), 0.98)
    # Noise averages out over a block, and a blurred speed does not: the shortest window that is good enough.
    enough = [k for k, error in enumerate(errors) if error < MAX_NOISE_FRACTION * fastest]
    chosen = enough[0] if enough else best
    half_window, noise = widths[chosen], float(errors[chosen])
    kernel = kernels[half_window]
    speed = _smooth(signal, kernel) / axis.dt**order
    force = _smooth(axis.force, _smoothing_of_speed(kernel, order))
    position = axis.position if axis.position is not None else axis.dt * np.cumsum(speed)
    return _Motion(position, speed, np.gradient(speed, axis.dt), force, noise, half_window)


def _busiest(signal: Array) -> slice:
    """The stretch of a long signal that varies most: windows are tried on it."""
    begins = range(0, max(len(signal) - TRIED_ROWS // 2, 1), TRIED_ROWS // 2)
    begin = max(begins, key=lambda begin: float(np.std(signal[begin : begin + TRIED_ROWS])))
    return slice(begin, begin + TRIED_ROWS)


def _kernel(half_width: int, order: int) -> Array:
    """Weights of a derivative of the parabola through samples, at their middle (Savitzky and Golay, 1964)."""
    places = np.arange(-half_width, half_width + 1.0)
    return np.asarray(np.linalg.pinv(np.vander(places, 3, increasing=True))[order])


def _smoothing_of_speed(kernel: Array, order: int) -> Array:
    """Weights by which a kernel averages the speed: those of the position are for its differences, summed up.

    A force that is averaged likewise stays linear in speed and acceleration, whatever the window.
    """
    if order == 0:
        return kernel
    between = np.cumsum(kernel[::-1])[::-1][1:]
    return np.asarray((np.append(0.0, between) + np.append(between, 0.0)) / 2.0)


def _smooth(signal: Array, kernel: Array) -> Array:
    """Weighted sums about each sample; beyond its ends the signal is mirrored through its last point."""
    width = min(len(kernel) // 2, len(signal) - 1)
    begin, end = 2 * signal[0] - signal[width:0:-1], 2 * signal[-1] - signal[-2 : -2 - width : -1]
    return np.asarray(
        np.convolve(np.concatenate([begin, signal, end]), kernel[::-1], "same")[width : width + len(signal)]
    )


def _average(axis: _Samples, motion: _Motion) -> SlidingBlocks | None:
    """Means over blocks of rows that slide; None if the axis does not move."""
    speed = motion.speed
    fastest = float(np.quantile(abs(speed[axis.present]), 0.98))
    at_rest = max(NOISE_FACTOR * motion.noise, MIN_SPEED_FRACTION * fastest)
    if not at_rest < 0.5 * fastest:
        return None
    sliding = axis.present & (abs(speed) > at_rest)
    strokes = _runs(sliding, np.sign(speed))
    runs = _trimmed(strokes, axis, motion)
    if not runs:
        return None
    decays = _decays(strokes, motion)
    rows = sum(end - begin for begin, end in runs)
    length = max(rows / MAX_BLOCKS, 1.0)
    if len(runs) > MAX_BLOCKS:
        runs = runs[:: -(-len(runs) // MAX_BLOCKS)]
    edges = [np.linspace(b, e, max(round((e - b) / length), 1) + 1).astype(int) for b, e in runs]
    begins, ends = np.concatenate([e[:-1] for e in edges]), np.concatenate([e[1:] for e in edges])
    count = (ends - begins).astype(float)
    index = np.concatenate([np.arange(b, e) for b, e in zip(begins, ends, strict=True)])
    block = np.repeat(np.arange(len(count)), ends - begins)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(block, values[index]) / count)

    slid = abs(speed[index])
    limits = float(np.quantile(slid, 0.02)), float(np.median(slid)), float(np.quantile(slid, 0.98))
    place = motion.position[index]
    low, high = place.min(), place.max()
    position = (motion.position - (low + high) / 2) / max((high - low) / 2, 1e-300)
    transients = np.column_stack([mean(np.sign(speed) * decay) for decay in decays])
    return SlidingBlocks(
        axis.dt * (begins + ends) / 2, count, mean(motion.force), mean(position), mean(speed),
        mean(motion.acceleration), transients, (speed[index], block), limits, motion.noise,
    )  # fmt: skip


def _runs(sliding: Mask, direction: Array) -> list[tuple[int, int]]:
    """Begin and end of each run of rows that slide in one direction."""
    kind = np.where(sliding, direction, 0.0)
    edges = np.flatnonzero(np.diff(kind)) + 1
    begins, ends = np.concatenate([[0], edges]), np.concatenate([edges, [len(kind)]])
    return [(int(b), int(e)) for b, e in zip(begins, ends, strict=True) if kind[b] != 0.0]


def _stroke_length(strokes: list[tuple[int, int]], position: Array) -> float:
    """Length of the longer strokes."""
    return float(np.quantile([abs(position[end - 1] - position[begin]) for begin, end in strokes], 0.75))


def _decays(strokes: list[tuple[int, int]], motion: _Motion) -> list[Array]:
    """Remainder of a change at the last reversal, of each row, for each length over which it fades."""
    since = np.full(len(motion.speed), np.inf)
    for begin, end in strokes:
        if begin > 0:
            since[begin:end] = abs(motion.position[begin:end] - motion.position[begin])
    length = max(_stroke_length(strokes, motion.position), 1e-300)
    return [np.exp(-since / (fraction * length)) for fraction in TRANSIENT_FRACTIONS]


def _trimmed(runs: list[tuple[int, int]], axis: _Samples, motion: _Motion) -> list[tuple[int, int]]:
    """Runs without the rows near a rest, by time and by distance."""
    if not runs:
        return []
    presliding = REVERSAL_FRACTION * _stroke_length(runs, motion.position)
    typical = float(np.quantile([e - b for b, e in runs], 0.75))
    margin = motion.half_window + int(min(REVERSAL_TIME / axis.dt, 0.1 * typical))
    inner = []
    for begin, end in runs:
        moved = abs(motion.position[begin:end] - motion.position[begin])
        # The begin of the log is no reversal.
        slid = int(np.searchsorted(moved, presliding)) if begin > 0 else 0
        first, last = begin + max(margin, slid), end - margin
        if last - first >= 2:
            inner.append((first, last))
    return inner


def _without_ramps(blocks: SlidingBlocks) -> SlidingBlocks:
    """Blocks of one speed in each direction, without those in which the axis still gains that speed.

    The limits are the speeds of both directions and their mean, for which half of the difference between the forces is
    the friction.
    """
    usual, speeds = np.zeros(len(blocks.speed)), []
    for side in (blocks.speed < 0.0, blocks.speed > 0.0):
        if side.any():
            usual[side] = np.median(blocks.speed[side])
            speeds.append(abs(float(usual[side][0])))
    ratio = blocks.speed / usual
    inside = (ratio * ONE_SPEED > 1.0) & (ratio < ONE_SPEED)
    rows, block = blocks.rows
    row_inside = inside[block]
    names = ("time", "count", "force", "position", "speed", "acceleration", "transients")
    return replace(
        blocks,
        rows=(rows[row_inside], (np.cumsum(inside) - 1)[block[row_inside]]),
        limits=(min(speeds), float(np.mean(speeds)), max(speeds)),
        **{name: getattr(blocks, name)[inside] for name in names},
    )
