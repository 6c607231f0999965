"""Normal equations by stretch of time and octave, from the sums of `octave_sums`, with the noise that is in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identifiers.kernels import octave_sums as sums
from palpate.identifiers.line_noise import LineNoise, PositionNoise

SEEN = 10.0
"""Power of a column over that of the position's noise in it, below which an octave is left out: its parameter would be
off by a tenth."""
TIED = 35 / 18
"""Power of white noise along a sine's lines, over that of a line: Hann's window ties neighbours."""
OVERLAP = 0.75
"""Independent blocks for each of half-overlapping ones (Welch, 1967)."""
FEWEST = 4
"""Stretches that make a covariance."""
_ROUNDING = 1e-22
"""Power over that of all octaves below which a column is rounding of the computation."""
_SHORTEST = 6
"""Rows that show a line slower than all blocks."""
OWN, SIZE = 3, 8
"""Parameters of the contact, M, B and K; with those of other forces."""
OTHERS = ((3, 4), (5, 6), (7,))
"""Places of each other force: relaxation, depth, friction."""
_COLUMNS = [sums.A, sums.V, sums.X, sums.FAST, sums.SLOW, sums.SQUARE, sums.CROSS, sums.RUB]


@dataclass(frozen=True)
class OctaveData:
    """Everything that a fit is made of.

    Args:
        state: the sums.
        lines: noise in the octaves.
        sensor: variance of the force sensor's noise [N^2].
        step: of the encoder [m]; 0 for none.
        deviations: of M, B, K and offset before anything is known, shape (4,).
        lag_std: standard deviation of the lag between force and position [s].
        contacts: that the samples are of.
    """

    state: Array
    lines: LineNoise
    sensor: float
    step: float
    deviations: Array
    lag_std: float
    contacts: float

    @property
    def groups(self) -> Array:
        """Sums by stretch of time, shape (groups, GROUP), the newest last."""
        groups = self.state[sums.HEADER : sums.AT_RINGS].reshape(sums.GROUPS, sums.GROUP)
        return groups[: int(self.state[sums.FILLED]) + 1]


@dataclass(frozen=True)
class System:
    """Normal equations by stretch and octave.

    Args:
        products: of the parameters' columns and the force, shape (groups, octaves, 9, 9).
        noisy: part of them that is noise of the position, shape (octaves, 8, 8).
        lines: independent ones, shape (groups, octaves).
        sensor: variance of a line by the force sensor's noise, shape (octaves,).
        frequency: middle of each octave [Hz], shape (octaves,).
        means: mean a, v, x, 1 and force of the samples, shape (5,).
        plain: products of a, v, x and 1 over the samples, shape (4, 4).
        in_samples: products that noise of the position adds to these, shape (4, 4).
    """

    products: Array
    noisy: Array
    lines: Array
    sensor: Array
    frequency: Array
    means: Array
    plain: Array
    in_samples: Array

    @cached_property
    def total(self) -> Array:
        """Products of all stretches, shape (octaves, 9, 9)."""
        return np.asarray(self.products.sum(axis=0))

    @cached_property
    def count(self) -> Array:
        """Lines of all stretches, shape (octaves,)."""
        return np.asarray(self.lines.sum(axis=0))

    @property
    def samples(self) -> float:
        """Samples that it rests on."""
        return float(self.plain[3, 3])

    def only(self, use: NDArray[np.bool_]) -> System:
        """The same with some octaves, shape (octaves,)."""
        return replace(
            self,
            products=self.products[:, use],
            noisy=self.noisy[use],
            lines=self.lines[:, use],
            sensor=self.sensor[use],
            frequency=self.frequency[use],
        )

    def weighted(self, noise: Array) -> Array:
        """Products over all octaves, each over its noise, shape (9, 9)."""
        return np.asarray(np.tensordot(1 / noise, self.total, axes=1))


def system_of(data: OctaveData, first: int, end: int) -> System | None:
    """The normal equations of the stretches from first to before end; None where they are too few, or drowned."""
    kept = data.groups[first:end]
    kept = kept[kept[:, sums.WEIGHT] > 0]
    if np.count_nonzero(kept[:, sums.WEIGHT] >= 0.5 * data.state[sums.SIZE]) < FEWEST:
        return None
    noise, sensor = _position_noise(kept, data.step), data.lines.force * data.sensor
    products, count = _products(kept, data.state[sums.SIZE] if first else 0.0)
    position, frequency = data.lines.positions(noise), data.lines.frequency
    if first == 0 and end == len(data.groups) and (whole := _whole(data.state)) is not None:
        products, count = _before(products, whole[0] / TIED), _before(count, whole[1] / TIED)
        level, ratio = whole[2], np.array([whole[3] ** 2, whole[3], 1.0])
        position = np.concatenate([(position[level] * np.outer(ratio, ratio))[None], position])
        frequency, sensor = (
            np.append(whole[3] * frequency[level], frequency),
            np.append(sensor[level], sensor),
        )
    plain = kept[:, sums.SUMS : sums.AT_LEVELS].sum(axis=0)
    means = plain[: sums.MEANS] / plain[3]
    turn = _turn(float(means[2]))
    noisy = np.zeros((len(frequency), SIZE, SIZE))
    noisy[:, :OWN, :OWN] = position * count.sum(axis=0)[:, None, None]
    found = System(
        np.einsum("pi,goij,qj->gopq", turn, products, turn),
        noisy,
        count,
        sensor,
        frequency,
        means,
        _symmetric(plain[sums.MEANS :]),
        plain[3] * data.lines.in_samples(noise),
    )
    use = _used(found, data)
    return found.only(use) if use.any() else None


def _used(system: System, data: OctaveData) -> NDArray[np.bool_]:
    """Octaves that count, shape (octaves,): with more motion than noise, and no slower than a contact lasts.

    A line slower than its contacts would be made of their edges.
    """
    power = np.einsum("oii->oi", system.total)[:, :OWN]
    noise = np.einsum("oii->oi", system.noisy)[:, :OWN]
    use = (system.count > 0) & np.all(power > SEEN * noise + _ROUNDING * power.sum(axis=0), axis=1)
    if data.contacts > 1:
        use &= system.frequency * system.samples / data.contacts / data.lines.rate >= 1
    return np.asarray(use)


def _products(groups: Array, size: float) -> tuple[Array, Array]:
    """Products of the columns of rows, shape (groups, levels, 9, 9), and independent lines, shape (groups, levels).

    Args:
        groups: stretches.
        size: samples of each, where blocks that began before the first stretch are left out; else 0.
    """
    levels = groups[:, sums.AT_LEVELS :].reshape(len(groups), sums.LEVELS, sums.LEVEL)
    if size:
        long = sums.ROWS * 2.0 ** np.arange(sums.LEVELS)
        levels = levels * (np.arange(len(groups))[:, None] * size >= long)[:, :, None]
    products = np.zeros((len(groups), sums.LEVELS, sums.COLUMNS, sums.COLUMNS))
    rows, columns = np.triu_indices(sums.COLUMNS)
    products[:, :, rows, columns] = products[:, :, columns, rows] = levels[:, :, 1:]
    blocks = levels[:, :, 0]
    share = np.where(blocks.sum(axis=0) > 1, OVERLAP, 1.0) / TIED
    return products * share[:, None, None], sums.LINES * share * blocks


def _position_noise(groups: Array, step: float) -> PositionNoise:
    power, product, number = groups[:, [sums.NOISE_POWER, sums.NOISE_PRODUCT, sums.NOISE_COUNT]].sum(axis=0)
    if not number > 0:
        return PositionNoise(0.0, 0.0, 0.0)
    return PositionNoise.of(float(power / number), float(product / number), step)


def _whole(state: Array) -> tuple[Array, float, int, float] | None:
    """Lines slower than every block: products, real lines, the level whose rows they are, their frequency over its."""
    rings = state[sums.AT_RINGS : sums.AT_BLOCK].reshape(sums.LEVELS, sums.RING)
    short = rings[:, 0] < sums.ROWS
    level = int(np.argmax(short))
    rows = int(rings[level, 0])
    if not short[level] or rows < _SHORTEST:
        return None
    numbers = tuple(range(1, rows // 3 + 1))
    own = rings[level, 1 : 1 + rows * sums.COLUMNS].reshape(rows, sums.COLUMNS)
    lines = sums.transform(rows, numbers).T @ own
    return lines.T @ lines, float(len(lines)), level, 4.0 * float(np.mean(numbers)) / rows


def _before(of_levels: Array, own: Array | float) -> Array:
    """An octave before those of the levels, that the last stretch has."""
    first = np.zeros((len(of_levels), 1, *of_levels.shape[2:]))
    first[-1, 0] = own
    return np.concatenate([first, of_levels], axis=1)


def _turn(mean: float) -> Array:
    """From the columns of a row to parameters and force: depth counts from the mean, relaxation from the position."""
    turn = np.zeros((SIZE + 1, sums.COLUMNS))
    turn[range(SIZE), _COLUMNS] = 1.0
    turn[SIZE, sums.FORCE] = 1.0
    turn[5, sums.X], turn[6, sums.V] = -2 * mean, -mean
    turn[3, sums.X] = turn[4, sums.X] = 1.0
    turn[3, sums.FAST] = turn[4, sums.SLOW] = -1.0
    return turn


def _symmetric(upper: Array) -> Array:
    found = np.zeros((4, 4))
    found[np.triu_indices(4)] = upper
    return found + np.triu(found, 1).T
