"""Normal equations by octave of frequency: all that the mixed model needs of a log, whatever its length.

In each octave every column goes through Hann blocks of four periods, half overlapping, of which the lines 3, 4, 5 are
kept; the first octave has whole contacts, with lines 1 to 5. A window multiplies both sides of a regression alike, so
the model holds among the lines as it does in time, while a disturbance stays in its own octave (a plain transform
leaks from one into all). Each block is without its mean and mean slope, so an offset and a slow drift drop out. The
products of all columns are summed over the lines of each octave and over stretches of the log.

The force is a contact model's columns times theta, plus columns of other causes (friction, a stiffness that changes
with depth), plus noise with a level of its own in each octave, which is estimated with theta (iteratively reweighted
least squares; the noise model of Box and Jenkins without its parameters: Ljung 1999, ch. 7).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.identification.least_squares import solve_normal
from palpate.signals.octaves import LINES, OVERLAP, TIED, pool_levels, stretch_shares

MIN_SEGMENT_ROWS = 16
"""Rows of a segment, at least: one block."""
GROUPS = 8
"""Stretches of the log that are held against each other: enough for a variance, few enough to be quick."""
PERIODS = 4
"""Periods in a block."""
_WHOLE_LINES = (1, 2, 3, 4, 5)
_MAX_NUMBERS_IN_MEMORY = 1 << 22
"""Numbers of one channel's blocks that are in memory at a time."""


@dataclass(frozen=True)
class Segment:
    """Evenly spaced rows without a gap: first, and past the last."""

    first: int
    last: int

    @property
    def length(self) -> int:
        """Number of rows from first to last."""
        return self.last - self.first

    @property
    def rows(self) -> slice:
        """Slice of the rows of this block."""
        return slice(self.first, self.last)


@dataclass(frozen=True)
class Octaves:
    """Sums over lines.

    Args:
        products: of the columns with each other, shape (groups, octaves, p, p).
        lines: how many independent lines each sum has, shape (groups, octaves).
        frequency: middle of each octave [Hz], shape (octaves,).
    """

    products: Array
    lines: Array
    frequency: Array

    @property
    def total(self) -> Array:
        """Sums over all groups, shape (octaves, p, p)."""
        return np.asarray(self.products.sum(axis=0))

    @property
    def all_lines(self) -> Array:
        """Lines of all groups, shape (octaves,)."""
        return np.asarray(self.lines.sum(axis=0))

    def only(self, use: Mask) -> Octaves:
        """Keep some octaves alone, shape (octaves,)."""
        return Octaves(self.products * use[None, :, None, None], self.lines * use[None, :], self.frequency)


def split_segments(rows: Indices, spans: Indices) -> list[Segment]:
    """Cut rows at the ends of contacts and at gaps; too short pieces are left out.

    The sample of each row and the number of its contact have the shape (m,).
    """
    if not len(rows):
        return []
    step = int(np.median(np.diff(rows))) if len(rows) > 1 else 1
    cuts = np.flatnonzero((np.diff(rows) != step) | (np.diff(spans) != 0)) + 1
    edges = [0, *(int(cut) for cut in cuts), len(rows)]
    return [Segment(first, last) for first, last in pairwise(edges) if last - first >= MIN_SEGMENT_ROWS]


def longest_length(segments: Sequence[Segment]) -> int:
    """Rows of the longest segment, from which octaves are counted."""
    return max(s.length for s in segments)


def sum_octaves(columns: Array, segments: Sequence[Segment], dt: float, longest: int) -> Octaves:
    """Sum the products of columns, shape (m, p), by octave.

    The columns are at the rows that the segments count, one at least, `dt` from row to row [s]; `longest` is the rows
    of the block of the first octave.
    """
    count = int(np.log2(longest / MIN_SEGMENT_ROWS)) + 2  # until a block has its fewest rows
    p = columns.shape[1]
    products = np.zeros((GROUPS, count, p, p))
    lines = np.zeros((GROUPS, count))
    begins = np.cumsum([0, *(s.length for s in segments)])
    for number, segment in enumerate(segments):
        segment_columns = columns[segment.first : segment.last]
        for octave in range(count):
            length, numbers = _block(segment.length, octave, longest)
            if not numbers:
                continue
            starts = np.arange(0, segment.length - length + 1, max(length // 2, 1))
            middles = begins[number] + starts + length // 2
            group = middles * GROUPS // max(int(begins[-1]), 1)
            weight = (OVERLAP if len(starts) > 1 else 1.0) / TIED
            sums = _sums(segment_columns, starts, group, length, numbers)
            for group_number, (product, line_count) in sums.items():
                products[group_number, octave] += weight * product
                lines[group_number, octave] += weight * line_count
    lengths = longest / 2.0 ** np.maximum(np.arange(count) - 1, 0)
    frequency = PERIODS / (lengths * dt)
    frequency[0] = 2 / (longest * dt)
    nonempty = products.any(axis=(1, 2, 3))
    nonempty |= not nonempty.any()
    return Octaves(products[nonempty], lines[nonempty], frequency)


def _block(segment_rows: int, octave: int, longest: int) -> tuple[int, tuple[float, ...]]:
    """Length of a segment's blocks in an octave, and their lines; no line if the segment has none in the octave.

    A segment shorter than the octave's blocks is one block, with those of its lines that lie in the octave: a tap
    beside a long contact counts at its own frequencies.
    """
    length = longest >> max(octave - 1, 0)
    if 2 * segment_rows >= longest:
        if octave == 0:
            return segment_rows, _WHOLE_LINES
        return length, LINES if length <= segment_rows else ()
    if octave == 0 or length <= segment_rows:
        return length, LINES if octave else ()
    middle = PERIODS * segment_rows / length
    return segment_rows, tuple(n for n in _WHOLE_LINES if 0.5 < (n / middle) ** 2 <= 2)


def line_variance(power: Callable[[Array], Array], dt: float, longest: int, count: int) -> Array:
    """Variance that a stationary noise has in a line of each octave, shape (count,).

    It includes the leakage of a block's window from where the noise is largest, which is most of a noise of
    accelerations.

    Args:
        power: of the noise at frequencies [Hz], over that of white noise of variance 1.
        dt: time from row to row [s].
        longest: rows of the block of the first octave.
        count: number of octaves.
    """
    variances = np.empty(count)
    for octave in range(count):
        length = longest if octave == 0 else longest >> (octave - 1)
        window = _window(length, _WHOLE_LINES if octave == 0 else LINES)
        frequency = np.asarray(np.fft.rfftfreq(2 * length, dt), np.float64)
        variances[octave] = window @ power(frequency)
    return variances


@lru_cache(maxsize=64)
def _window(length: int, numbers: tuple[float, ...]) -> Array:
    """Response of a spectral line to each frequency, the mean of all lines of a block, shape (length + 1,)."""
    transform = block_transform(length, numbers)
    spectra = np.abs(np.fft.rfft(transform, 2 * length, axis=0)) ** 2
    response: Array = spectra.mean(axis=1) / (2 * length)
    response[1:-1] *= 2
    return response


def _sums(
    segment_columns: Array, starts: Indices, group: Indices, length: int, numbers: tuple[float, ...]
) -> dict[int, tuple[Array, int]]:
    """Products and number of lines of the blocks of each group."""
    transform = block_transform(length, numbers)
    width = segment_columns.shape[1]
    sums: dict[int, tuple[Array, int]] = {}
    blocks_at_once = max(_MAX_NUMBERS_IN_MEMORY // (length * width), 1)
    views = np.lib.stride_tricks.sliding_window_view(segment_columns, length, axis=0)
    for first in range(0, len(starts), blocks_at_once):
        block = views[starts[first : first + blocks_at_once]]  # (blocks, p, length)
        real = block @ transform  # (blocks, p, 2 lines)
        block_groups = group[first : first + blocks_at_once]
        begins = np.flatnonzero(np.diff(block_groups, prepend=-1))  # blocks of a group follow one another
        groups = block_groups[begins].tolist()
        parts = np.split(real, begins[1:])
        for number, group_blocks in zip(groups, parts, strict=True):
            flat = group_blocks.transpose(0, 2, 1).reshape(-1, width)
            products, count = sums.get(number, (np.zeros((width, width)), 0))
            sums[number] = products + flat.T @ flat, count + len(flat)
    return sums


@lru_cache(maxsize=64)
def block_transform(length: int, numbers: tuple[float, ...]) -> Array:
    """The transform of a block without its mean and slope, real parts and then imaginary ones, shape (length, 2 lines).

    It preserves the power of white noise.
    """
    time = np.arange(length)
    window = np.hanning(length + 2)[1:-1]
    window /= np.sqrt(window @ window / 2)
    angle = -2j * np.pi * np.outer(time, numbers) / length
    phase = np.exp(angle) * window[:, None]
    slope = 2 * time / (length - 1) - 1
    plain = np.column_stack([np.ones(length), slope])
    weighted = window[:, None] * plain
    fitted = np.linalg.solve(weighted.T @ plain, weighted.T)  # (2, length)
    transform = phase - fitted.T @ (plain.T @ phase)
    return np.concatenate([transform.real, transform.imag], axis=1)


_REWEIGHTINGS = 3
"""Number of reweightings. Two reach the efficiency of known levels (feasible generalised least squares); repeated until
convergence, a wrong model would fit the octaves with the most lines and the least force."""
_BORROWED_LINES = 2.0
"""Lines that the level of an octave borrows from the next higher one: its own few may be fitted by chance."""
MAX_TERM_RATIO = 3.0
"""Standard deviation of the weak prior of a term's force, over the force's. It matters only where the log does not show
the term, as for a damping beside friction; there any number of this size does."""


@dataclass(frozen=True)
class System:
    """The normal equations by octave.

    Args:
        products: of the columns with each other, the force last, shape (octaves, p + 1, p + 1).
        lines: shape (octaves,).
        stretches: the same as products and lines for each stretch of the log, with a leading axis.
        prior_mean, prior_weight: of the parameters, shape (p,).
    """

    products: Array
    lines: Array
    stretches: tuple[Array, Array]
    prior_mean: Array
    prior_weight: Array

    @property
    def size(self) -> int:
        """Number of parameters, p."""
        return len(self.prior_mean)

    @property
    def columns(self) -> Array:
        """Products of the parameters' columns with each other, shape (octaves, p, p)."""
        return self.products[:, :-1, :-1]

    def weights(self, noise: Array) -> Array:
        """Weight of each octave by the variance of a line, 0 without lines, shape (octaves,)."""
        return np.where(self.lines > 0, 1 / noise, 0.0)


@dataclass(frozen=True)
class Solution:
    """Parameters and their covariance for given noise levels.

    Args:
        theta: shape (p,).
        cov: shape (p, p).
        noise: variance of a line in each octave, shape (octaves,).
    """

    theta: Array
    cov: Array
    noise: Array


def build_system(octaves: Octaves, names: tuple[str, ...], prior: dict[str, tuple[float, float]]) -> System:
    """The normal equations of a log, or of a part of it.

    The first columns of the sums are the named parameters', the last is the force; the prior is mean and standard
    deviation of what is known of some of them.
    """
    p = len(names)
    total = octaves.total
    power = np.diag(total.sum(axis=0))
    mean = np.zeros(p)
    weight = power[:p] / (MAX_TERM_RATIO**2 * max(float(power[-1]), 1e-300))
    for name, (value, std) in prior.items():
        place = names.index(name)
        mean[place] = value
        weight[place] = 1 / std**2
    return System(total, octaves.all_lines, (octaves.products, octaves.lines), mean, weight)


def solve(system: System, noise: Array, use: Mask | None = None) -> Solution:
    """Solve for given variances of a line in each octave; `use` are those that count, all if not given; (octaves,)."""
    weight = system.weights(noise)
    if use is not None:
        weight = weight * use
    equations = np.tensordot(weight, system.products, axes=1)
    normal = equations[:-1, :-1] + np.diag(system.prior_weight)
    right_side = equations[:-1, -1] + system.prior_weight * system.prior_mean
    return Solution(*solve_normal(normal, right_side), noise)


def estimate_with_fixed(system: System, values: dict[int, float]) -> Solution:
    """Estimate the other parameters and the noise levels with some parameters held at values, by place."""
    places = list(values)
    free = [i for i in range(system.size) if i not in values]
    elimination = np.zeros((system.size + 1, len(free) + 1))
    elimination[[*free, -1], range(len(free) + 1)] = 1.0
    elimination[places, -1] = -np.array(list(values.values()))
    products, lines = system.stretches
    stretch_products = elimination.T @ products @ elimination
    reduced = System(
        elimination.T @ system.products @ elimination,
        system.lines,
        (stretch_products, lines),
        system.prior_mean[free],
        system.prior_weight[free],
    )
    reduced_solution = estimate(reduced)
    theta = -elimination[:-1, -1]
    cov = np.zeros((system.size, system.size))
    theta[free] = reduced_solution.theta
    cov[np.ix_(free, free)] = reduced_solution.cov
    return Solution(theta, cov, reduced_solution.noise)


def estimate(system: System) -> Solution:
    """Estimate parameters and noise levels: least squares, then reweighted by the residual in each octave."""
    force = system.products[:, -1, -1]
    mean = float(force.sum() / max(float(system.lines.sum()), 1.0))
    noise = np.full(len(force), 1e-3 * mean + 1e-280)
    for _ in range(_REWEIGHTINGS):
        noise = _levels(system, solve(system, noise))
    return solve(system, noise)


def _levels(system: System, solution: Solution) -> Array:
    """Variance of a line in each octave by its residual and degrees of freedom, shape (octaves,)."""
    residual_vector = np.append(-solution.theta, 1.0)
    products, lines = system.stretches
    power = np.einsum("i,goij,j->go", residual_vector, products, residual_vector)
    residual_level = np.maximum(power, 0.0) / np.maximum(lines, 1.0)
    fractions, count = _shares(system)
    degrees_used = np.einsum("oij,ij->o", system.columns, solution.cov) / solution.noise
    free = np.maximum(count - degrees_used, 0.0)
    residual_sum = (fractions * residual_level).sum(axis=0) * count
    floor = 1e-12 * float(system.products[:, -1, -1].sum()) / max(float(system.lines.sum()), 1.0) + 1e-280
    highest = int(np.flatnonzero(system.lines).max(initial=-1))
    downwards = np.arange(highest, -1, -1)
    return pool_levels(residual_sum, free, downwards, _BORROWED_LINES, np.full(len(residual_sum), floor))


def worth(system: System) -> Array:
    """Lines that the noise level of each octave rests on, shape (octaves,)."""
    return np.where(system.lines > 0, _shares(system)[1], 0.0)


def _shares(system: System) -> tuple[Array, Array]:
    products, lines = system.stretches
    return stretch_shares(products[:, :, -1, -1], lines)
