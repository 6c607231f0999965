"""Normal equations by stretch of time and octave, from the sums of `octave_sums`, with the noise that is in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identifiers.kernels import octave_sums as sums
from palpate.identifiers.kernels.octave_sums import LineNoise, OctavePositionNoise

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

_SIZES = (0.003, 0.03, 0.3)
"""Deviations of the prior of another force's size, over that of the whole force: hardly there, or of some order."""
_MASSES = (0.01, 0.1, 1.0)
"""The same of the mass, over the largest that the caller gives."""
_IN_BAND = 0.3
"""Relative error of the position noise's power within the band, told from above it."""
_DROWNED = 0.9
"""Share of the information that is noise of the position, at most; beyond, a direction is as good as unknown."""
_BORROWED = 1.0
"""Lines that the level of an octave takes from the next higher one."""
_STEPS = 8


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
class OctaveSystem:
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

    def only(self, use: Mask) -> OctaveSystem:
        """The same with some octaves, shape (octaves,)."""
        return replace(
            self,
            products=self.products[:, use],
            noisy=self.noisy[use],
            lines=self.lines[:, use],
            sensor=self.sensor[use],
            frequency=self.frequency[use],
        )

    def weighted_products(self, noise: Array) -> Array:
        """Products over all octaves, each over its noise, shape (9, 9)."""
        return np.asarray(np.tensordot(1 / noise, self.total, axes=1))


def system_of(data: OctaveData, first: int, end: int) -> OctaveSystem | None:
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
    found = OctaveSystem(
        np.einsum("pi,goij,qj->gopq", turn, products, turn),
        noisy,
        count,
        sensor,
        frequency,
        means,
        _symmetric(plain[sums.MEANS :]),
        plain[3] * data.lines.in_samples(noise),
    )
    use = _usable_octaves(found, data)
    return found.only(use) if use.any() else None


def _usable_octaves(system: OctaveSystem, data: OctaveData) -> Mask:
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


def _position_noise(groups: Array, step: float) -> OctavePositionNoise:
    power, product, number = groups[:, [sums.NOISE_POWER, sums.NOISE_PRODUCT, sums.NOISE_COUNT]].sum(axis=0)
    if not number > 0:
        return OctavePositionNoise(0.0, 0.0, 0.0)
    return OctavePositionNoise.of(float(power / number), float(product / number), step)


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


def _prior_weights() -> Array:
    """Factors of the prior's weights for each combination of sizes, shape (members, 8), the largest sizes first."""
    found = []
    for mass, *others in product(_MASSES[::-1], *(_SIZES[::-1] for _ in OTHERS)):
        weight = np.ones(SIZE)
        weight[0] = mass**-2
        for places, size in zip(OTHERS, others, strict=True):
            weight[list(places)] = size**-2
        found.append(weight)
    return np.array(found)


_WEIGHTS = _prior_weights()


def prior_of(system: OctaveSystem, deviations: Array) -> Array:
    """Weights of the priors, each supposing a size of the mass and of every other force, shape (members, 8).

    The first supposes the largest of all.
    """
    power = np.einsum("oii->i", system.total)
    own = deviations[:OWN] ** -2.0
    return np.concatenate([own, power[OWN:SIZE] / max(float(power[SIZE]), 1e-300)]) * _WEIGHTS


def scale_columns(normal: Array) -> tuple[Array, Array]:
    """A matrix scaled to a unit diagonal, and the sizes of its columns; shapes (..., n, n), (..., n)."""
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", normal), 1e-300))
    return normal / (size[..., :, None] * size[..., None, :]) + 1e-12 * np.eye(normal.shape[-1]), size


def solve(normal: Array, right: Array) -> Array:
    """normal^-1 right, right of shape (..., n)."""
    scaled, size = scale_columns(normal)
    return np.asarray(np.linalg.solve(scaled, (right / size)[..., None])[..., 0] / size)


def inverse(normal: Array) -> Array:
    """normal^-1, of shape (..., n, n)."""
    scaled, size = scale_columns(normal)
    return np.asarray(np.linalg.inv(scaled) / (size[..., :, None] * size[..., None, :]))


def noise_levels(system: OctaveSystem, deviations: Array) -> tuple[Array, Array]:
    """Variance of a line in each octave by the residual there, shape (octaves,), and the fit with it.

    Degrees of freedom are taken off. Stretches count by the power of their force: the residual of a tip at rest says
    nothing of that of one that moves.
    """
    total, count = system.total, system.count
    prior = prior_of(system, deviations)[0]
    force = np.where(system.lines > 0, np.maximum(system.products[:, :, -1, -1], 0.0), 0.0)
    share = force / np.maximum(force.sum(axis=0), 1e-300)
    rests = 1 / np.maximum(np.sum(share**2 / np.maximum(system.lines, 1.0), axis=0), 1e-300)
    rests = np.where(force.sum(axis=0) > 0, rests, count)
    mean = float(total[:, -1, -1].sum() / count.sum())
    noise = np.full(len(count), 1e-3 * mean + 1e-280)
    theta = np.zeros(SIZE)
    for _ in range(_STEPS):
        whole = np.tensordot(1 / noise, total, axes=1)
        normal = whole[:-1, :-1] + np.diag(prior)
        noisy = np.tensordot(1 / noise, system.noisy, axes=1)
        theta = compensate(whole[:-1, :-1], whole[:-1, -1], noisy, prior)[0]
        full = np.append(-theta, 1.0)
        left = np.maximum(np.einsum("i,goij,j->go", full, system.products, full), 0.0)
        left = (share * left / np.maximum(system.lines, 1.0)).sum(axis=0)
        used = np.einsum("oij,ij->o", total[:, :-1, :-1], inverse(normal)) / noise
        free = np.maximum(rests - used, 0.0)
        above, noise = 0.0, noise.copy()
        for o in np.argsort(-system.frequency):
            borrowed = _BORROWED if above else 0.0
            above = (left[o] * rests[o] + borrowed * above) / max(free[o] + borrowed, 1.0)
            noise[o] = above = max(above, float(system.sensor[o]), 1e-12 * mean + 1e-280)
    return noise, theta


def compensate(known: Array, right: Array, noisy: Array, prior: Array) -> tuple[Array, Array, Array]:
    """theta with the noise of the position taken out, its covariance, and that of what the noise leaves open.

    In each direction of the parameters with its own share of noise: least squares give 1 - share of what is true. In a
    direction that is nearly all noise nothing is taken out, and the prior alone says how far it may reach.

    Args:
        known: normal equations of the data, shape (8, 8).
        right: their right-hand side, shape (8,).
        noisy: part of them that is noise of the position, shape (8, 8).
        prior: weights of the prior, shape (..., 8).
    """
    scaled, size = scale_columns(known + prior[..., None] * np.eye(len(right)))
    root = np.linalg.cholesky(scaled)
    inner = np.linalg.solve(root, noisy / (size[..., :, None] * size[..., None, :]))
    inner = np.linalg.solve(root, np.swapaxes(inner, -1, -2))
    share, ways = np.linalg.eigh((inner + np.swapaxes(inner, -1, -2)) / 2)
    seen = (1 + _IN_BAND) * share < _DROWNED
    share = np.clip(np.where(seen, share, 0.0), 0.0, None)
    back = np.linalg.solve(np.swapaxes(root, -1, -2), ways) / size[..., :, None]
    pull = np.einsum("...ij,i->...j", back, right)
    kept = 1 - share
    further = pull * (1 / (1 - (1 + _IN_BAND) * share) - 1 / kept)
    further = np.where(seen, further, np.einsum("...ij,...i->...j", back**2, prior) ** -0.5)
    turned = np.swapaxes(back, -1, -2)
    theta = np.einsum("...ij,...j->...i", back, pull / kept)
    return theta, (back / kept[..., None, :] ** 2) @ turned, (back * further[..., None, :] ** 2) @ turned
