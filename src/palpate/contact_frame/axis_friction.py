"""Friction of a joint or an axis: Coulomb, viscous, offset and Stribeck, from its force or torque and its motion.

The force along the motion, over a stretch that slides without a reversal, is

    F = F0 + s (Fc + (Fs - Fc) exp(-(v / vs)^2)) + B v + M a + c1 x + c2 x^2 + e,    s = sign(v)

with the inertia M a, the terms of the position (gravity, a spring) and what remains of the last reversal (presliding)
as nuisances where the log shows them. All but vs is linear. The noise e is white and, beside it, correlated over a time
that the log shows (an Ornstein-Uhlenbeck process: drift, hum, cogging). vs, that time and the noise's ratio are
integrated over a grid by their marginal likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning,
2006, section 5.4), so that what they leave open is in every interval.

Rows about a reversal are left out: there the bodies stick, and a lag of the force is largest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.errors import InputError
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.records import Record, Result
from palpate.signals.types import NORMAL

MIN_ROWS = 50
"""Fewest rows of a log: ten for each term of the force, about."""
MAX_BLOCKS = 320
"""Approximate blocks of rows that are fitted by their means; a dense covariance of so many takes 5 ms."""
HALF_WINDOWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Half-widths [rows] of the windows in which the speed is a local parabola's; that with the least error is taken."""
NOISE_FACTOR = 3.0
"""Standard deviations of the speed below which its sign is not sure."""
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
LEVEL_SPREAD = 0.6
"""Prior standard deviation of (Fs - Fc) / Fc, which is positive: published ratios Fs / Fc are 1 to 2."""
MAX_UNEQUAL = 0.1
"""Fraction of a friction at one speed by which unequal speeds may move the offset."""
STRIBECK_SPEEDS = 9
"""Stribeck speeds of the grid, in equal ratios from the slowest speed to half of the fastest."""
REFINEMENTS = 3
"""Times that this grid is refined about its likely part; each brings its steps down to a fourth."""
UNLIKELY = 7.0
"""Logarithm of the ratio to the largest likelihood from which on a cell is left out: one in a thousand."""
STRIBECK_EVIDENCE = 3.0
"""Logarithm of the ratio of likelihoods with and without a Stribeck effect from which on it shows (20 to 1)."""
CURVED_EVIDENCE = 10.0
"""The same for a curvature of the friction over the speed, by which the model is rejected..."""
CURVED_FRACTION = 0.1
"""... where the curvature is as large a fraction of the friction at the fastest speed."""
NUISANCES = 5
"""Columns of nuisances."""
NOISE_TIMES = 6
"""Correlation times of the noise's grid, in equal ratios from a block to ten times the log."""
NOISE_POWERS = (0.05, 0.4, 3.0, 30.0, 300.0)
"""Variance of the change of the correlated noise over a block, over that of the white noise of a block's mean."""
DRAWS = 6000
"""Draws from the joint distribution of parameters, which give the intervals; an end errs by 2 % of the width."""

NAMES = {
    "Fc": "Coulomb friction",
    "B": "viscous friction",
    "F0": "offset",
    "Fs": "static friction",
    "vs": "Stribeck speed",
    "F": "friction at the usual speed",
}
"""Parameters and their names, in the order of an answer."""


@dataclass(frozen=True, eq=False)
class AxisFriction(Result):
    """Friction of a joint or an axis, identified from a log.

    Args:
        parameters: Fc, B, F0, Fs, vs and F, the friction at the median speed.
        speeds: slowest, median and fastest speed of the fitted rows, without sign.
        directions: how many directions there are, 0 for no motion.
        units: of force and speed.
        rmse: root mean square of the residuals of the block means.
        r2: fraction of their variance that is explained.
        rows: fitted rows.
        notes: doubts about the log, as in a record's meta.
        points: speed, friction without nuisances of each block, shape (n, 2).
        curve: speed, friction and both ends of its interval, shape (m, 4).
    """

    parameters: dict[str, Parameter]
    speeds: tuple[float, float, float]
    directions: int
    units: tuple[str, str]
    rmse: float
    r2: float
    rows: int
    notes: Sequence[Mapping[str, str]] = ()
    points: Array = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    curve: Array = field(default_factory=lambda: np.empty((0, 4)), repr=False)

    @property
    def identified(self) -> bool:
        """True if a parameter is identified."""
        return any(p.verdict is Verdict.IDENTIFIED for p in self.parameters.values())

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        slowest, median, fastest = self.speeds
        return {
            "model": "coulomb-viscous-stribeck",
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "speeds": {
                "slowest": slowest, "median": median, "fastest": fastest, "unit": self.units[1],
                "directions": self.directions,
            },
            "fit": {"r2": self.r2, "rmse": self.rmse, "n": self.rows},
            "warnings": [dict(note) for note in self.notes],
        }  # fmt: skip


def identify_friction(record: Record, tolerance: float = 0.25) -> AxisFriction:
    """Identify the friction of a joint or an axis from its force or torque and its motion.

    Args:
        record: columns time, force (or torque), and position or velocity or both, in SI units.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a fraction of its value.

    Returns:
        The friction along the motion. The sign of the force is that by which the motion loses power.

    Raises:
        InputError: a column is missing, or there are too few rows.
    """
    axis = _axis(record)
    motion = _differentiate(axis)
    blocks = _average(axis, motion)
    units = axis.force_unit, axis.speed_unit
    notes = [dict(note) for note in record.meta.get("notes", ())]
    if blocks is None:
        reason = "the log shows no motion above the noise of its speed; move the axis back and forth"
        unknown = {name: Parameter.unknown(_unit(name, units), reason) for name in NAMES}
        return AxisFriction(unknown, (0.0, 0.0, 0.0), 0, units, 0.0, 0.0, 0, notes)
    if not _several_speeds(blocks.speed):
        blocks = _without_ramps(blocks)
    return _fit(blocks, units, tolerance, notes)


class _Axis(NamedTuple):
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
    """Position, speed and acceleration of each sample; noise of the speed; half-width of the window [rows]."""

    position: Array
    speed: Array
    acceleration: Array
    noise: float
    half_window: int


@dataclass(frozen=True)
class _Blocks:
    """Means over blocks of rows that slide in one direction.

    Args:
        time: of the middle [s], shape (n,).
        count: rows of each block.
        force, position, speed, acceleration: means; the position from the middle of its range, over half of it.
        transients: means of what remains of a change at the last reversal, for each length, shape (n, 2).
        rows: speed of each row, and the block that it is of: a function's mean is that of its rows.
        limits: slowest, median and fastest speed without sign.
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

    def mean(self, values: Array) -> Array:
        """Mean over each block of values of each row."""
        return np.asarray(np.bincount(self.rows[1], values, len(self.count)) / self.count)


def _axis(record: Record) -> _Axis:
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
    sampled = {name: np.interp(grid, time, values[first]) for name, values in columns.items()}
    units = record.units
    speed_unit = units["velocity"] if "velocity" in moved else _per_second(units["position"])
    return _Axis(
        dt, sampled["force"], sampled.get("position"), sampled.get("velocity"), distance < 3.0 * dt,
        units["force"], speed_unit,
    )  # fmt: skip


def _per_second(unit: str) -> str:
    return "1/s" if unit == "1" else f"{unit}/s"


def _differentiate(axis: _Axis) -> _Motion:
    """Speed and acceleration by a local parabola whose window has the least error.

    The error is judged by the change of the speed from a window to that of twice the width: a short one shows noise, a
    long one the curvature of the motion.
    """
    order = 0 if axis.velocity is not None else 1
    signal = axis.velocity if axis.velocity is not None else axis.position
    assert signal is not None
    longest = max(len(signal) // 12, 1)
    widths = [width for width in HALF_WINDOWS if 2 * width <= longest] or [1]
    speeds = [_local(signal, 2 * width, order, axis.dt) for width in widths]
    before = [_local(signal, widths[0], order, axis.dt), *speeds[:-1]]
    errors = [
        float(np.sqrt(np.mean((a - b)[axis.present] ** 2))) for a, b in zip(before, speeds, strict=True)
    ]
    best = int(np.argmin(errors))
    half_window = widths[best]
    speed = _local(signal, half_window, order, axis.dt)
    acceleration = _local(signal, 2 * half_window, order + 1, axis.dt)
    position = axis.position if axis.position is not None else axis.dt * np.cumsum(speed)
    return _Motion(position, speed, acceleration, errors[best], half_window)


def _local(signal: Array, half_width: int, order: int, dt: float) -> Array:
    """A derivative of the parabola through the samples of a window, at its middle (Savitzky and Golay, 1964)."""
    places = np.arange(-half_width, half_width + 1.0)
    weights = np.linalg.pinv(np.vander(places, 3, increasing=True))[order]
    scale = (1.0, 1.0, 2.0)[order] / dt**order
    ends = np.arange(half_width, 0, -1)
    ends = ends[ends < len(signal)]
    # Beyond the ends the signal goes on as its mirror image through the last point.
    begin, end = 2 * signal[0] - signal[ends], 2 * signal[-1] - signal[-1 - ends[::-1]]
    padded = np.concatenate([begin, signal, end])
    middle = np.convolve(padded, scale * weights[::-1], "same")
    return np.asarray(middle[len(begin) : len(begin) + len(signal)])


def _average(axis: _Axis, motion: _Motion) -> _Blocks | None:
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
    return _Blocks(
        axis.dt * (begins + ends) / 2, count, mean(axis.force), mean(position), mean(speed),
        mean(motion.acceleration), transients, (speed[index], block), limits,
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
    """What remains of a change at the last reversal, for each length over which it fades; one of each row."""
    since = np.full(len(motion.speed), np.inf)
    for begin, end in strokes:
        if begin > 0:
            since[begin:end] = abs(motion.position[begin:end] - motion.position[begin])
    length = max(_stroke_length(strokes, motion.position), 1e-300)
    return [np.exp(-since / (fraction * length)) for fraction in TRANSIENT_FRACTIONS]


def _trimmed(runs: list[tuple[int, int]], axis: _Axis, motion: _Motion) -> list[tuple[int, int]]:
    """Runs without the rows near a rest, by time and by distance."""
    if not runs:
        return []
    presliding = REVERSAL_FRACTION * _stroke_length(runs, motion.position)
    typical = float(np.quantile([e - b for b, e in runs], 0.75))
    margin = motion.half_window + int(min(REVERSAL_TIME / axis.dt, 0.1 * typical))
    kept = []
    for begin, end in runs:
        at_begin, at_end = begin > 0, end < len(axis.force)  # the log's own ends are no reversals
        moved = abs(motion.position[begin:end] - motion.position[begin])
        first = begin + max(margin, int(np.searchsorted(moved, presliding))) * at_begin
        last = end - margin * at_end
        if last - first >= 2:
            kept.append((first, last))
    return kept


class _Terms(NamedTuple):
    """Columns of the linear model, divided by their root mean squares.

    Args:
        names: of the parameters, which come first: F0, Fc where both directions are there, B where two speeds are.
        design: parameters, nuisances (acceleration, position, its square, two transients), Stribeck effects,
            curvature, shape (n, p).
        scale: root mean square of each column, shape (p,).
        grid: Stribeck speeds, shape (k,); empty where one speed shows none.
    """

    names: list[str]
    design: Array
    scale: Array
    grid: Array

    @property
    def base(self) -> list[int]:
        """Columns of the parameters."""
        return list(range(len(self.names)))

    @property
    def nuisances(self) -> list[list[int]]:
        """Choices of nuisances: inertia or none, terms of the position or none, a transient or none."""
        first = len(self.names)
        inertias: list[list[int]] = [[], [first]]
        positions: list[list[int]] = [[], [first + 1, first + 2]]
        transients: list[list[int]] = [[], [first + 3], [first + 4]]
        return [a + b + c for a in inertias for b in positions for c in transients]

    @property
    def effects(self) -> list[int]:
        """Columns of the Stribeck effects."""
        first = len(self.names) + NUISANCES
        return list(range(first, first + len(self.grid)))


def _without_ramps(blocks: _Blocks) -> _Blocks:
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


def _several_speeds(speed: Array) -> bool:
    """True if a direction has two speeds: one speed in each cannot separate offset, Coulomb and viscous friction."""
    sides = [abs(speed[speed < 0.0]), abs(speed[speed > 0.0])]
    ends = [np.quantile(side, (0.1, 0.9)) for side in sides if len(side)]
    return any(fast > ONE_SPEED * slow for slow, fast in ends)


def _terms(blocks: _Blocks, grid: Array) -> _Terms:
    """Columns of the linear model, for Stribeck speeds of shape (k,)."""
    speed, sign = blocks.speed, np.sign(blocks.speed)
    names, columns = ["F0"], [np.ones(len(speed))]
    if len(set(sign)) == 2:
        names, columns = [*names, "Fc"], [*columns, sign]
    if _several_speeds(speed):
        names, columns = [*names, "B"], [*columns, speed]
    else:
        grid = np.empty(0)
    rows = blocks.rows[0]
    effects = [blocks.mean(np.sign(rows) * np.exp(-((rows / vs) ** 2))) for vs in grid]
    nuisances = [blocks.acceleration, blocks.position, blocks.position**2, *blocks.transients.T]
    design = np.column_stack([*columns, *nuisances, *effects, blocks.mean(np.sign(rows) * rows**2)])
    scale = np.maximum(np.sqrt(np.mean(design**2, axis=0)), 1e-300)
    return _Terms(names, design / scale, scale, grid)


class _Whitened(NamedTuple):
    """Products of the columns and the force under one covariance of the noise.

    Args:
        gram: of columns and force, the force last, shape (p + 1, p + 1).
        log_det: logarithm of the covariance's determinant.
        plain: products of the columns without the covariance, over the blocks, shape (p, p).
        blocks: how many there are.
    """

    gram: Array
    log_det: float
    plain: Array
    blocks: int


class _Noise(NamedTuple):
    """A covariance of the noise: correlation time [s], and variance of the correlated part over the white one's."""

    memory: float
    power: float


def _noises(blocks: _Blocks) -> list[_Noise]:
    """The grid of covariances; the first is that of white noise."""
    step, length = float(np.median(np.diff(blocks.time))), float(np.ptp(blocks.time))
    noises = [_Noise(step, 0.0)]
    for memory in np.geomspace(step, 10.0 * length, NOISE_TIMES):
        # A slow noise is seen by its change between blocks: the grid is of that, not of its variance.
        change = min(1.0, 2.0 * step / memory)
        noises += [_Noise(float(memory), power / change) for power in NOISE_POWERS]
    return noises


def _whiten(blocks: _Blocks, noise: _Noise, design: Array, force: Array) -> _Whitened:
    from scipy.linalg import solve_triangular

    covariance = np.diag(blocks.count.mean() / blocks.count)
    if noise.power:
        distance = abs(blocks.time[:, None] - blocks.time)
        covariance += noise.power * np.exp(-distance / noise.memory)
    factor = np.linalg.cholesky(covariance)
    columns = solve_triangular(factor, np.column_stack([design, force]), lower=True, check_finite=False)
    log_det = 2.0 * float(np.log(np.diag(factor)).sum())
    return _Whitened(columns.T @ columns, log_det, design.T @ design / len(force), len(force))


class _Cell(NamedTuple):
    """The fit of one point of the grid.

    Args:
        likelihood: logarithm of its marginal likelihood.
        columns: that are fitted; the Stribeck effect last, if there is one.
        theta: their coefficients.
        cov: covariance of these over the noise's variance.
        rss: squared residuals over that.
        freedom: degrees of freedom.
        effect: index of the Stribeck speed; -1 without that effect.
        noise: covariance of the noise.
    """

    likelihood: float
    columns: list[int]
    theta: Array
    cov: Array
    rss: float
    freedom: int
    effect: int = -1
    noise: _Noise | None = None


def _cell(products: _Whitened, columns: list[int], common: int, prior: float = 0.0) -> _Cell:
    """Fit columns by least squares; nuisances have a prior of unit information.

    Args:
        products: of columns and force.
        columns: fitted.
        common: how many of them every cell has.
        prior: precision of the last coefficient, which is positive, over that of the noise; 0 for no such prior.
    """
    from scipy.special import log_ndtr

    gram = products.gram
    normal = gram[np.ix_(columns, columns)].copy()
    flat = len(columns) - bool(prior)
    normal[np.diag_indices(len(columns))] *= 1.0 + 1e-9
    normal[-1, -1] += prior
    cov = np.linalg.inv(normal)
    theta = cov @ gram[columns, -1]
    rss = max(float(gram[-1, -1] - theta @ gram[columns, -1]), 1e-300)
    freedom = products.blocks - flat
    plain = products.plain[np.ix_(columns[:flat], columns[:flat])] + 1e-9 * np.eye(flat)
    determinants = np.linalg.slogdet(normal)[1] - np.linalg.slogdet(plain)[1]
    likelihood = -0.5 * (products.log_det + determinants + (products.blocks - common) * np.log(rss))
    if prior:
        std = np.sqrt(cov[-1, -1] * rss / freedom)
        likelihood += 0.5 * np.log(prior) + np.log(2.0) + log_ndtr(theta[-1] / std)
    return _Cell(float(likelihood), columns, theta, cov, rss, freedom)


def _cells(terms: _Terms, whitened: dict[_Noise, _Whitened], level: float) -> tuple[list[_Cell], list[_Cell]]:
    """Cells without and with a Stribeck effect, of each covariance and each choice of nuisances."""
    plain, effects = [], []
    for noise, products in whitened.items():
        for nuisances in terms.nuisances:
            columns = terms.base + nuisances
            cell = _cell(products, columns, len(terms.base))._replace(noise=noise)
            plain.append(cell)
            variance = cell.rss / cell.freedom
            for index, effect in enumerate(terms.effects):
                std = LEVEL_SPREAD * level * terms.scale[effect]
                fitted = _cell(products, [*columns, effect], len(terms.base), variance / std**2)
                effects.append(fitted._replace(effect=index, noise=noise))
    return plain, effects


def _refine(grid: Array, cells: list[_Cell]) -> Array:
    """Stribeck speeds over the range that is likely by the cells, one step of the grid wider."""
    best = max(cell.likelihood for cell in cells)
    likely = [cell.effect for cell in cells if cell.likelihood > best - UNLIKELY]
    low, high = grid[max(min(likely) - 1, 0)], grid[min(max(likely) + 1, len(grid) - 1)]
    return np.asarray(np.geomspace(float(low), float(high), STRIBECK_SPEEDS))


def _evidence(cells: list[_Cell]) -> float:
    """Logarithm of the mean marginal likelihood."""
    values = np.array([cell.likelihood for cell in cells])
    return float(values.max() + np.log(np.mean(np.exp(values - values.max()))))


def _draw(terms: _Terms, cells: list[_Cell]) -> dict[str, Array]:
    """Draws from the joint distribution: parameters by name, Fs - Fc as `rise`, and vs, each of shape (d,)."""
    from scipy.special import ndtr, ndtri

    random = np.random.default_rng(1)
    likelihood = np.array([cell.likelihood for cell in cells])
    weights = np.exp(likelihood - likelihood.max())
    drawn: dict[str, list[Array]] = {name: [] for name in (*terms.names, "rise", "vs")}
    for cell, many in zip(cells, random.multinomial(DRAWS, weights / weights.sum()), strict=True):
        if not many:
            continue
        std = np.sqrt(cell.rss / random.chisquare(cell.freedom, many))
        factor = np.linalg.cholesky(cell.cov)
        theta = cell.theta + std[:, None] * (random.standard_normal((many, len(cell.theta))) @ factor.T)
        if cell.effect >= 0:
            # The effect is positive: draw it from its truncated distribution, and move the others along with it.
            middle, spread = cell.theta[-1], std * np.sqrt(cell.cov[-1, -1])
            above = ndtr(middle / spread)
            uniform = np.maximum(random.random(many) * above, 1e-300)
            effect = np.maximum(middle - spread * ndtri(uniform), 0.0)
            theta += np.outer(effect - theta[:, -1], cell.cov[-1] / cell.cov[-1, -1])
        scaled = theta / terms.scale[cell.columns]
        for index, name in enumerate(terms.names):
            drawn[name].append(scaled[:, index])
        drawn["rise"].append(scaled[:, -1] if cell.effect >= 0 else np.zeros(many))
        drawn["vs"].append(np.full(many, terms.grid[cell.effect] if cell.effect >= 0 else np.inf))
    return {name: np.concatenate(parts) for name, parts in drawn.items()}


# One fit from the blocks to the answer: its steps share the terms and the grid.
def _fit(
    blocks: _Blocks, units: tuple[str, str], tolerance: float, notes: list[dict[str, str]]
) -> AxisFriction:
    slowest, median, fastest = blocks.limits
    grid = np.geomspace(max(slowest, 0.01 * fastest), 0.5 * fastest, STRIBECK_SPEEDS)
    terms = _terms(blocks, grid)
    columns = terms.base + list(range(len(terms.names), len(terms.names) + 3))
    first = np.linalg.lstsq(terms.design[:, columns], blocks.force, rcond=1e-10)[0] / terms.scale[columns]
    by_name = dict(zip(terms.names, first, strict=False))
    at_median = by_name.get("Fc", 0.0) + median * by_name.get("B", 0.0)
    if at_median < 0.0:
        text = "the force acts against the motion that it drives, so its sign is turned"
        notes.append({"code": "force-sign-turned", "text": text})
    force = -blocks.force if at_median < 0.0 else blocks.force
    level = abs(by_name["Fc"]) if "Fc" in by_name else float(np.ptp(force))
    noises = _noises(blocks)
    evidence = 0.0
    for attempt in range(REFINEMENTS + 1):
        whitened = {noise: _whiten(blocks, noise, terms.design, force) for noise in noises}
        plain, effects = _cells(terms, whitened, level)
        if attempt == 0 and effects:
            evidence = _evidence(effects) - _evidence(plain)
        if not effects or attempt == REFINEMENTS:
            break
        least = max(cell.likelihood for cell in effects) - UNLIKELY
        noises = list({c.noise: 0 for c in effects if c.likelihood > least and c.noise})
        terms = _terms(blocks, grid := _refine(grid, effects))
    shows = evidence > STRIBECK_EVIDENCE
    draws = _draw(terms, effects or plain)
    curvature = _curvature(terms, whitened, effects or plain, blocks.limits[2])
    judged = _Judge(blocks.limits, units, tolerance, "" if curvature is None else curvature)
    parameters = judged.parameters(draws, terms, shows)
    if curvature is not None:
        notes.append({"code": "model-rejected", "text": curvature})
    best = max(effects or plain, key=lambda cell: cell.likelihood)
    fitted = terms.design[:, best.columns] @ best.theta
    friction = [k for k, c in enumerate(best.columns) if c in (*terms.base[1:], *terms.effects)]
    shown = force - fitted + terms.design[:, np.array(best.columns)[friction]] @ best.theta[friction]
    residual = np.average((force - fitted) ** 2, weights=blocks.count)
    variance = np.average((force - np.average(force, weights=blocks.count)) ** 2, weights=blocks.count)
    return AxisFriction(
        parameters, blocks.limits, len(set(np.sign(blocks.speed))), units, float(np.sqrt(residual)),
        float(1.0 - residual / max(variance, 1e-300)), int(blocks.count.sum()), notes,
        np.column_stack([blocks.speed, shown]), _curve(draws, blocks),
    )  # fmt: skip


def _curvature(
    terms: _Terms, whitened: dict[_Noise, _Whitened], cells: list[_Cell], fastest: float
) -> str | None:
    """A sentence where the friction is certainly no straight line over the speed; else None."""
    if "B" not in terms.names or "Fc" not in terms.names:
        return None
    best = max(cells, key=lambda cell: cell.likelihood)
    assert best.noise is not None
    products = whitened[best.noise]
    first = [c for c in best.columns if c not in terms.effects]
    curved = len(terms.scale) - 1
    straight = _cell(products, first, len(terms.base))
    # The Stribeck effect stays as it was fitted: what it explains is no curvature.
    columns = [*best.columns[: len(first)], curved, *best.columns[len(first) :]]
    prior = 0.0
    if best.effect >= 0:
        level = abs(best.theta[1] / terms.scale[1])
        prior = straight.rss / straight.freedom / (LEVEL_SPREAD * level * terms.scale[best.columns[-1]]) ** 2
    fitted = _cell(products, columns, len(terms.base), prior)
    theta = fitted.theta / terms.scale[columns]
    bent = theta[len(first)] * fastest**2
    whole = theta[1] + theta[2] * fastest + bent
    if fitted.likelihood - best.likelihood < CURVED_EVIDENCE or abs(bent) < CURVED_FRACTION * abs(whole):
        return None
    slope = theta[2] + 2.0 * theta[len(first)] * fastest
    return (
        f"the friction is no straight line over the speed: its slope is {theta[2]:.3g} at slow speeds and {slope:.3g}"
        f" at {fastest:.3g}; fit a narrower range of speeds with --start and --end"
    )


def _curve(draws: dict[str, Array], blocks: _Blocks) -> Array:
    """Speed, friction and both ends of its interval over the speeds of the log, in each direction."""
    slowest, _, fastest = blocks.limits
    speeds = np.geomspace(slowest, fastest, 40)
    rows = []
    for speed in speeds:
        friction = _at(draws, float(speed))
        rows.append([speed, *np.quantile(friction, (0.5, 0.025, 0.975))])
    curve = np.array(rows)
    mirrored = -curve[::-1][:, [0, 1, 3, 2]]
    sides = [mirrored] * bool((blocks.speed < 0).any()) + [curve] * bool((blocks.speed > 0).any())
    return np.concatenate(sides)


def _at(draws: dict[str, Array], speed: float) -> Array:
    """Friction at a speed, for each draw; without the Coulomb friction where one direction does not show it."""
    level = draws.get("Fc", 0.0) + draws.get("B", 0.0) * speed
    return np.asarray(level + draws["rise"] * np.exp(-((speed / draws["vs"]) ** 2)))


class _Judge(NamedTuple):
    """Verdicts on the parameters.

    Args:
        limits: slowest, median and fastest speed.
        units: of force and speed.
        tolerance: largest half-width of an identified parameter, as a fraction of its value.
        rejected: why the model does not hold; empty if it does.
    """

    limits: tuple[float, float, float]
    units: tuple[str, str]
    tolerance: float
    rejected: str

    def parameters(self, draws: dict[str, Array], terms: _Terms, shows: bool) -> dict[str, Parameter]:
        """All parameters, by name in the order of `NAMES`."""
        one_speed = "B" not in terms.names
        parameters = {name: self._unknown(name, _ONE_DIRECTION) for name in NAMES}
        if not one_speed:
            parameters["B"] = self._judge("B", draws["B"], positive=True)
        if "Fc" not in terms.names:
            return parameters
        parameters["F0"] = self._judge("F0", draws["F0"])
        parameters["F"] = self._judge("F", _at(draws, self.limits[1]), positive=True)
        if one_speed:
            return parameters | self._of_one_speed(draws)
        parameters["Fc"] = self._judge("Fc", draws["Fc"], positive=True)
        parameters |= self._stribeck(draws, terms, shows)
        if self.rejected:
            parameters |= {
                name: parameters[name].without_number(self.rejected, Verdict.REJECTED)
                for name in ("Fc", "B", "Fs", "vs")
            }
        return parameters

    def _stribeck(self, draws: dict[str, Array], terms: _Terms, shows: bool) -> dict[str, Parameter]:
        if not shows:
            slowest = f"{self.limits[0]:.3g} {self.units[1]}"
            reason = f"no Stribeck effect shows at {slowest} and above; move more slowly, too"
            return {name: self._unknown(name, reason) for name in ("Fs", "vs")}
        step = np.log(terms.grid[1] / terms.grid[0])
        within = np.random.default_rng(2).uniform(-0.5, 0.5, len(draws["vs"]))
        return {
            "Fs": self._judge("Fs", draws["Fc"] + draws["rise"], positive=True),
            "vs": self._judge("vs", draws["vs"] * np.exp(step * within), positive=True),
        }

    def _of_one_speed(self, draws: dict[str, Array]) -> dict[str, Parameter]:
        """Bounds by a friction that is passive: neither Coulomb nor viscous friction is below zero."""
        slowest, median, fastest = self.limits
        high = max(float(np.quantile(_at(draws, median), 0.975)), 0.0)
        bounds = {"Fc": (0.0, high), "B": (0.0, high / median), "Fs": None, "vs": None}
        reason = (
            f"the log has one speed of {median:.3g} {self.units[1]} in a direction, where Fc + B v is one number, F;"
            " add strokes at half and at twice the speed"
        )
        parameters = {name: self._unknown(name, reason, ends) for name, ends in bounds.items()}
        # B v of unequal speeds is in the mean of both directions.
        unequal = high / median * (fastest - slowest) / 2
        if unequal > MAX_UNEQUAL * high:
            low, top = (float(end) for end in np.quantile(draws["F0"], (0.025, 0.975)))
            reason = "the speeds of the two directions differ, and viscous friction is in the mean of both"
            parameters["F0"] = self._unknown("F0", reason, (low - unequal, top + unequal))
        return parameters

    def _unknown(self, name: str, reason: str, ci95: tuple[float, float] | None = None) -> Parameter:
        return Parameter(None, None, ci95, _unit(name, self.units), Verdict.NOT_IDENTIFIABLE, reason)

    def _judge(self, name: str, draws: Array, *, positive: bool = False) -> Parameter:
        unit = _unit(name, self.units)
        low, value, high = (float(q) for q in np.quantile(draws, (0.025, 0.5, 0.975)))
        half = (high - low) / 2
        parameter = Parameter(
            value, half / NORMAL, (low, high), unit, Verdict.NOT_IDENTIFIABLE, "", {"noise": half}
        )
        bounds = f"95 %: {low:.3g} to {high:.3g} {unit}"
        if positive and high < 0.0:
            reason = f"{bounds}: below zero, which no passive friction is; is another force in the log?"
            return parameter.without_number(reason, Verdict.REJECTED)
        if low <= 0.0 <= high:
            return parameter.without_number(f"{bounds}; zero is within it", ci95=(low, high))
        if half > self.tolerance * abs(value):
            reason = f"{bounds}; wider than {self.tolerance:.0%}: move longer, and at more speeds in both directions"
            return replace(parameter, reason=reason)
        reason = f"known to {100 * half / abs(value):.2g} % (95 %)"
        return replace(parameter, verdict=Verdict.IDENTIFIED, reason=reason)


_ONE_DIRECTION = (
    "the axis moves in one direction, where Coulomb friction and offset are one number; move it back, too"
)


def _unit(name: str, units: tuple[str, str]) -> str:
    """Unit of a parameter, from those of force and speed."""
    force, speed = units
    if name == "vs":
        return speed
    if name != "B":
        return force
    length = speed.removesuffix("/s")
    known = {("N", "m"): "N s/m", ("N m", "rad"): "N m s/rad"}
    return known.get((force, length), f"{force}/({speed})")
