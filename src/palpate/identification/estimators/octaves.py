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
from palpate.identification.least_squares import solved

SHORTEST = 16
"""Rows of a segment, at least: one block."""
GROUPS = 8
"""Stretches of the log that are held against each other: enough for a variance, few enough to be quick."""
PERIODS = 4
"""Periods in a block."""
LINES = (3.0, 4.0, 5.0)
_WHOLE_LINES = (1.0, 2.0, 3.0, 4.0, 5.0)
OVERLAP = 0.75
"""Independent blocks for each of half-overlapping Hann blocks of a coherent motion: 1/(1 + 2/6) (Welch 1967)."""
TIED = 35 / 18
"""Power of white noise along a sine's own lines, over that of a line: Hann's window ties neighbouring lines, so that
three of them are worth about one and a half (n sum w^4 / (sum w^2)^2)."""
_AT_ONCE = 1 << 22
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
        """The same with some octaves alone, shape (octaves,)."""
        return Octaves(self.products * use[None, :, None, None], self.lines * use[None, :], self.frequency)


def segments_of(rows: Indices, spans: Indices) -> list[Segment]:
    """Cut rows at the ends of contacts and at gaps; too short pieces are left out.

    The sample of each row and the number of its contact have the shape (m,).
    """
    if not len(rows):
        return []
    step = int(np.median(np.diff(rows))) if len(rows) > 1 else 1
    cuts = np.flatnonzero((np.diff(rows) != step) | (np.diff(spans) != 0)) + 1
    edges = [0, *(int(cut) for cut in cuts), len(rows)]
    return [Segment(a, b) for a, b in pairwise(edges) if b - a >= SHORTEST]


def longest_of(segments: Sequence[Segment]) -> int:
    """Rows of the longest segment, from which octaves are counted."""
    return max(s.length for s in segments)


def octaves_of(columns: Array, segments: Sequence[Segment], dt: float, longest: int) -> Octaves:
    """Sum the products of columns, shape (m, p), by octave.

    The columns are at the rows that the segments count, one at least, `dt` from row to row [s]; `longest` is the rows
    of the block of the first octave.
    """
    count, p = int(np.log2(longest / SHORTEST)) + 2, columns.shape[1]  # until a block has its fewest rows
    products, lines = np.zeros((GROUPS, count, p, p)), np.zeros((GROUPS, count))
    begins = np.cumsum([0, *(s.length for s in segments)])
    for number, segment in enumerate(segments):
        own = columns[segment.first : segment.last]
        for octave in range(count):
            length, numbers = _block(segment.length, octave, longest)
            if not numbers:
                continue
            starts = np.arange(0, segment.length - length + 1, max(length // 2, 1))
            group = (begins[number] + starts + length // 2) * GROUPS // max(int(begins[-1]), 1)
            for g, part in _sums(own, starts, group, length, numbers):
                share = (OVERLAP if len(starts) > 1 else 1.0) / TIED
                products[g, octave] += share * part[0]
                lines[g, octave] += share * part[1]
    lengths = longest / 2.0 ** np.maximum(np.arange(count) - 1, 0)
    frequency = PERIODS / (lengths * dt)
    frequency[0] = 2 / (longest * dt)
    seen = products.any(axis=(1, 2, 3))
    seen |= not seen.any()
    return Octaves(products[seen], lines[seen], frequency)


def _block(own: int, octave: int, longest: int) -> tuple[int, tuple[float, ...]]:
    """Rows of a segment's blocks in an octave, and their lines; no line where the octave has none of it.

    A segment that is shorter than the octave's blocks is one itself, with those of its lines that lie in the octave: a
    tap beside a long contact is seen at the frequencies that it has.
    """
    length = longest >> max(octave - 1, 0)
    if 2 * own >= longest:
        length, numbers = (own, _WHOLE_LINES) if octave == 0 else (length, LINES)
        return length, numbers if length <= own else ()
    if octave == 0 or length <= own:
        return length, LINES if octave else ()
    middle = PERIODS * own / length
    return own, tuple(n for n in _WHOLE_LINES if 0.5 < (n / middle) ** 2 <= 2)


def lines_of(power: Callable[[Array], Array], dt: float, longest: int, count: int) -> Array:
    """Variance that a stationary noise has in a line of each octave, shape (count,).

    What a block's window leaks from where the noise is largest is in it: of a noise of accelerations, little else.
    The power is that of the noise at frequencies [Hz], over that of white noise of variance 1; `dt` is from row to row
    [s], `longest` the rows of the block of the first octave.
    """
    found = np.empty(count)
    for o in range(count):
        length = longest if o == 0 else longest >> (o - 1)
        window = _window(length, _WHOLE_LINES if o == 0 else LINES)
        found[o] = window @ power(np.asarray(np.fft.rfftfreq(2 * length, dt), np.float64))
    return found


@lru_cache(maxsize=64)
def _window(length: int, numbers: tuple[float, ...]) -> Array:
    """Response of a spectral line to each frequency, the mean of all lines of a block, shape (length + 1,)."""
    spectra = np.abs(np.fft.rfft(transform_of(length, numbers), 2 * length, axis=0)) ** 2
    found: Array = spectra.mean(axis=1) / (2 * length)
    found[1:-1] *= 2
    return found


def _sums(
    own: Array, starts: Indices, group: Indices, length: int, numbers: tuple[float, ...]
) -> list[tuple[int, tuple[Array, int]]]:
    """Products and lines of the blocks of each group."""
    seen, width = transform_of(length, numbers), own.shape[1]
    found: dict[int, tuple[Array, int]] = {}
    some = max(_AT_ONCE // (length * width), 1)
    views = np.lib.stride_tricks.sliding_window_view(own, length, axis=0)
    for first in range(0, len(starts), some):
        block = views[starts[first : first + some]]  # (blocks, p, length)
        real = block @ seen  # (blocks, p, 2 lines)
        mine = group[first : first + some]
        begins = np.flatnonzero(np.diff(mine, prepend=-1))  # blocks of a group follow one another
        for g, those in zip(mine[begins].tolist(), np.split(real, begins[1:]), strict=True):
            flat = those.transpose(0, 2, 1).reshape(-1, width)
            products, count = found.get(g, (np.zeros((width, width)), 0))
            found[g] = products + flat.T @ flat, count + len(flat)
    return list(found.items())


@lru_cache(maxsize=64)
def transform_of(length: int, numbers: tuple[float, ...]) -> Array:
    """The transform of a block without its mean and slope, real parts and then imaginary ones, shape (length, 2 lines).

    The power of white noise stays what it is.
    """
    time = np.arange(length)
    window = np.hanning(length + 2)[1:-1]
    window /= np.sqrt(window @ window / 2)
    phase = np.exp(-2j * np.pi * np.outer(time, numbers) / length) * window[:, None]
    plain = np.column_stack([np.ones(length), 2 * time / (length - 1) - 1])
    weighted = window[:, None] * plain
    fitted = np.linalg.solve(weighted.T @ plain, weighted.T)  # (2, length)
    found = phase - fitted.T @ (plain.T @ phase)
    return np.concatenate([found.real, found.imag], axis=1)


_STEPS = 3
"""Of reweighting. Two are enough for the efficiency of known levels (feasible generalised least squares); until they
rest, a model that does not hold would end up fitting the octaves with the most lines and the least force."""
_NEIGHBOUR = 2.0
"""Lines that the level of an octave borrows from the next higher one: its own few may be fitted by chance."""
LARGEST = 3.0
"""Deviation of the weak prior of a term's force, over the force's. It counts only where the log says nothing of the
term, as for a damping that friction may stand for; there any number of this size does."""


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


def system_of(octaves: Octaves, names: tuple[str, ...], prior: dict[str, tuple[float, float]]) -> System:
    """The normal equations of a log, or of a part of it.

    The first columns of the sums are the named parameters', the last is the force; the prior is mean and standard
    deviation of what is known of some of them.
    """
    p, total = len(names), octaves.total
    power = np.diag(total.sum(axis=0))
    mean = np.zeros(p)
    weight = power[:p] / (LARGEST**2 * max(float(power[-1]), 1e-300))
    for name, (value, std) in prior.items():
        i = names.index(name)
        mean[i], weight[i] = value, 1 / std**2
    return System(total, octaves.all_lines, (octaves.products, octaves.lines), mean, weight)


def solve(system: System, noise: Array, use: Mask | None = None) -> Solution:
    """Solve for given variances of a line in each octave; `use` are those that count, all if not given; (octaves,)."""
    weight = np.where(system.lines > 0, 1 / noise, 0.0)
    if use is not None:
        weight = weight * use
    whole = np.tensordot(weight, system.products, axes=1)
    normal = whole[:-1, :-1] + np.diag(system.prior_weight)
    right = whole[:-1, -1] + system.prior_weight * system.prior_mean
    return Solution(*solved(normal, right), noise)


def held(system: System, values: dict[int, float]) -> Solution:
    """Estimate the other parameters and the noise levels with some parameters held at values, by place."""
    places = list(values)
    free = [i for i in range(system.size) if i not in values]
    fewer = np.zeros((system.size + 1, len(free) + 1))
    fewer[[*free, -1], range(len(free) + 1)] = 1.0
    fewer[places, -1] = -np.array(list(values.values()))
    products, lines = system.stretches
    own = System(
        fewer.T @ system.products @ fewer, system.lines, (fewer.T @ products @ fewer, lines),
        system.prior_mean[free], system.prior_weight[free],
    )  # fmt: skip
    found = estimate(own)
    theta, cov = -fewer[:-1, -1], np.zeros((system.size, system.size))
    theta[free], cov[np.ix_(free, free)] = found.theta, found.cov
    return Solution(theta, cov, found.noise)


def estimate(system: System) -> Solution:
    """Estimate parameters and noise levels: least squares, then reweighted by what is left in each octave."""
    force = system.products[:, -1, -1]
    mean = float(force.sum() / max(float(system.lines.sum()), 1.0))
    noise = np.full(len(force), 1e-3 * mean + 1e-280)
    for _ in range(_STEPS):
        noise = _levels(system, solve(system, noise))
    return solve(system, noise)


def _levels(system: System, solution: Solution) -> Array:
    """Variance of a line in each octave by what is left there, degrees of freedom taken off, shape (octaves,).

    Stretches count by the power of their force: what is left while the probe rests says nothing of what is left while
    it moves, and where it rests the parameters do not show.
    """
    full = np.append(-solution.theta, 1.0)
    products, lines = system.stretches
    left = np.maximum(np.einsum("i,goij,j->go", full, products, full), 0.0) / np.maximum(lines, 1.0)
    share, count = _shares(system)
    used = np.einsum("oij,ij->o", system.products[:, :-1, :-1], solution.cov) / solution.noise
    free = np.maximum(count - used, 0.0)
    whole = (share * left).sum(axis=0) * count
    floor = 1e-12 * float(system.products[:, -1, -1].sum()) / max(float(system.lines.sum()), 1.0) + 1e-280
    noise = np.full(len(whole), floor)
    above = 0.0
    for o in range(len(whole) - 1, -1, -1):
        borrowed = _NEIGHBOUR if above else 0.0
        if system.lines[o] or above:
            own = (whole[o] + borrowed * above) / max(free[o] + borrowed, 1.0)
            above = noise[o] = max(own, floor)
    return noise


def _shares(system: System) -> tuple[Array, Array]:
    """Weight of each stretch in an octave's level, (groups, octaves), and the lines that such a mean rests on."""
    products, lines = system.stretches
    power = np.where(lines > 0, np.maximum(products[:, :, -1, -1], 0.0), 0.0)
    share = power / np.maximum(power.sum(axis=0), 1e-300)
    spread = np.sum(share**2 / np.maximum(lines, 1.0), axis=0)
    return share, np.where(spread > 0, 1 / np.maximum(spread, 1e-300), 0.0)


def worth(system: System) -> Array:
    """Lines that the noise level of each octave rests on, shape (octaves,)."""
    return np.where(system.lines > 0, _shares(system)[1], 0.0)
