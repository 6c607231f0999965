"""Normal equations by stretch of time and octave, from the sums of `octave_sums`, with the noise that is in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identifiers import octave_sums as sums
from palpate.identifiers.octave_sums import LineNoise
from palpate.signals.octaves import MIN_MOTION, OVERLAP, TIED, pool_levels, stretch_shares
from palpate.signals.position_noise import NOISELESS, PositionNoise

MIN_STRETCHES = 4
"""Stretches that make a covariance."""
_ROUNDING_POWER = 1e-22
"""Power over that of all octaves below which a column is rounding of the computation."""
_MIN_ROWS = 6
"""Rows that show a line slower than all blocks."""
CONTACT_SIZE, SIZE = 3, 8
"""Parameters of the contact, M, B and K; with those of other forces."""
OTHER_FORCES = ((3, 4), (5, 6), (7,))
"""Places of each other force: relaxation, depth, friction."""
_COLUMNS = [sums.A, sums.V, sums.X, sums.FAST, sums.SLOW, sums.SQUARE, sums.CROSS, sums.RUB]

_FORCE_SIZES = (0.003, 0.03, 0.3)
"""Deviations of the prior of another force's size, over that of the whole force: hardly there, or of some order."""
_MASS_SIZES = (0.01, 0.1, 1.0)
"""The same of the mass, over the largest that the caller gives."""
_BAND_POWER_ERROR = 0.3
"""Relative error of the position noise's power within the band, told from above it."""
_MAX_NOISE_FRACTION = 0.9
"""Share of the information that is noise of the position, at most; beyond, a direction is as good as unknown."""
_BORROWED_LINES = 1.0
"""Lines that the level of an octave takes from the next higher one."""
_REWEIGHTINGS = 8


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
        """Keep some octaves, shape (octaves,)."""
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

    def equations(self, noise: Array) -> tuple[Array, Array]:
        """Normal matrix over all octaves, shape (8, 8), and right-hand side, shape (8,)."""
        products = self.weighted_products(noise)
        return products[:-1, :-1], products[:-1, -1]

    def stretch_equations(self, noise: Array) -> tuple[Array, Array]:
        """Normal matrices and right-hand sides of each stretch, shapes (groups, 8, 8) and (groups, 8)."""
        products = np.tensordot(self.products, 1 / noise, axes=((1,), (0,)))
        return products[:, :-1, :-1], products[:, :-1, -1]


def build_octave_system(data: OctaveData, first: int, end: int) -> OctaveSystem | None:
    """The normal equations of the stretches from first to before end; None if they are too few, or mostly noise."""
    stretches = data.groups[first:end]
    stretches = stretches[stretches[:, sums.WEIGHT] > 0]
    is_full = stretches[:, sums.WEIGHT] >= 0.5 * data.state[sums.SIZE]
    if np.count_nonzero(is_full) < MIN_STRETCHES:
        return None
    noise = _position_noise(stretches, data.step)
    sensor = data.lines.force * data.sensor
    products, count = _products(stretches, data.state[sums.SIZE] if first else 0.0)
    position = data.lines.positions(noise)
    frequency = data.lines.frequency
    is_whole = first == 0 and end == len(data.groups)
    if is_whole and (slow_lines := _slowest_lines(data.state)) is not None:
        slow_products, line_count, level, ratio = slow_lines
        products = _with_slow_octave(products, slow_products / TIED)
        count = _with_slow_octave(count, line_count / TIED)
        ratios = np.array([ratio**2, ratio, 1.0])
        slow_position = position[level] * np.outer(ratios, ratios)
        position = np.concatenate([slow_position[None], position])
        frequency = np.append(ratio * frequency[level], frequency)
        sensor = np.append(sensor[level], sensor)
    plain = stretches[:, sums.SUMS : sums.AT_LEVELS].sum(axis=0)
    means = plain[: sums.MEANS] / plain[3]
    transform = _row_transform(float(means[2]))
    position_noise = np.zeros((len(frequency), SIZE, SIZE))
    position_noise[:, :CONTACT_SIZE, :CONTACT_SIZE] = position * count.sum(axis=0)[:, None, None]
    system = OctaveSystem(
        np.einsum("pi,goij,qj->gopq", transform, products, transform),
        position_noise,
        count,
        sensor,
        frequency,
        means,
        _symmetric(plain[sums.MEANS :]),
        plain[3] * noise.in_samples(data.lines.weights),
    )
    use = _usable_octaves(system, data)
    return system.only(use) if use.any() else None


def _usable_octaves(system: OctaveSystem, data: OctaveData) -> Mask:
    """Octaves that count, shape (octaves,): with more motion than noise, and no slower than a contact lasts.

    A line slower than its contacts would be made of their edges.
    """
    power = np.einsum("oii->oi", system.total)[:, :CONTACT_SIZE]
    noise = np.einsum("oii->oi", system.noisy)[:, :CONTACT_SIZE]
    floor = MIN_MOTION * noise + _ROUNDING_POWER * power.sum(axis=0)
    use = (system.count > 0) & np.all(power > floor, axis=1)
    if data.contacts > 1:
        periods = system.frequency * system.samples / data.contacts / data.lines.rate
        use &= periods >= 1
    return np.asarray(use)


def _products(groups: Array, size: float) -> tuple[Array, Array]:
    """Products of the columns of rows, shape (groups, levels, 9, 9), and independent lines, shape (groups, levels).

    Args:
        groups: stretches.
        size: samples of each, where blocks that began before the first stretch are left out; else 0.
    """
    count = len(groups)
    levels = groups[:, sums.AT_LEVELS :].reshape(count, sums.LEVELS, sums.LEVEL)
    if size:
        block_rows = sums.ROWS * 2.0 ** np.arange(sums.LEVELS)
        begun = np.arange(count)[:, None] * size >= block_rows
        levels = levels * begun[:, :, None]
    products = np.zeros((count, sums.LEVELS, sums.COLUMNS, sums.COLUMNS))
    rows, columns = np.triu_indices(sums.COLUMNS)
    products[:, :, rows, columns] = products[:, :, columns, rows] = levels[:, :, 1:]
    blocks = levels[:, :, 0]
    line_weight = np.where(blocks.sum(axis=0) > 1, OVERLAP, 1.0) / TIED
    return products * line_weight[:, None, None], sums.LINES * line_weight * blocks


def _position_noise(groups: Array, step: float) -> PositionNoise:
    columns = [sums.NOISE_POWER, sums.NOISE_PRODUCT, sums.NOISE_COUNT]
    power, product, number = groups[:, columns].sum(axis=0)
    if not number > 0:
        return NOISELESS
    return PositionNoise.of_differences(float(power / number), float(product / number), step)


def _slowest_lines(state: Array) -> tuple[Array, float, int, float] | None:
    """Lines slower than every block: products, real lines, the level whose rows they are, their frequency over its."""
    rings = state[sums.AT_RINGS : sums.AT_BLOCK].reshape(sums.LEVELS, sums.RING)
    is_short = rings[:, 0] < sums.ROWS
    level = int(np.argmax(is_short))
    rows = int(rings[level, 0])
    if not is_short[level] or rows < _MIN_ROWS:
        return None
    numbers = tuple(range(1, rows // 3 + 1))
    ring_rows = rings[level, 1 : 1 + rows * sums.COLUMNS].reshape(rows, sums.COLUMNS)
    lines = sums.transform(rows, numbers).T @ ring_rows
    return lines.T @ lines, float(len(lines)), level, 4.0 * float(np.mean(numbers)) / rows


def _with_slow_octave(level_octaves: Array, slow_octave: Array | float) -> Array:
    """An octave before those of the levels, that the last stretch has."""
    octave = np.zeros((len(level_octaves), 1, *level_octaves.shape[2:]))
    octave[-1, 0] = slow_octave
    return np.concatenate([octave, level_octaves], axis=1)


def _row_transform(mean: float) -> Array:
    """Matrix from a row to parameters and force; depth counts from the mean, relaxation from the position."""
    transform = np.zeros((SIZE + 1, sums.COLUMNS))
    transform[range(SIZE), _COLUMNS] = 1.0
    transform[SIZE, sums.FORCE] = 1.0
    transform[5, sums.X], transform[6, sums.V] = -2 * mean, -mean
    transform[3, sums.X] = transform[4, sums.X] = 1.0
    transform[3, sums.FAST] = transform[4, sums.SLOW] = -1.0
    return transform


def _symmetric(upper: Array) -> Array:
    matrix = np.zeros((4, 4))
    matrix[np.triu_indices(4)] = upper
    return matrix + np.triu(matrix, 1).T


def _prior_weights() -> Array:
    """Factors of the prior's weights for each combination of sizes, shape (members, 8), the largest sizes first."""
    weights = []
    for mass, *others in product(_MASS_SIZES[::-1], *(_FORCE_SIZES[::-1] for _ in OTHER_FORCES)):
        weight = np.ones(SIZE)
        weight[0] = mass**-2
        for places, size in zip(OTHER_FORCES, others, strict=True):
            weight[list(places)] = size**-2
        weights.append(weight)
    return np.array(weights)


_WEIGHTS = _prior_weights()


def prior_weights(system: OctaveSystem, deviations: Array) -> Array:
    """Weights of the priors, each supposing a size of the mass and of every other force, shape (members, 8).

    The first supposes the largest of all.
    """
    power = np.einsum("oii->i", system.total)
    contact_weights = deviations[:CONTACT_SIZE] ** -2.0
    return (
        np.concatenate([contact_weights, power[CONTACT_SIZE:SIZE] / max(float(power[SIZE]), 1e-300)])
        * _WEIGHTS
    )


def _outer(size: Array) -> Array:
    """Products of each size with each other, shape (..., n, n)."""
    return size[..., :, None] * size[..., None, :]


def scale_columns(normal: Array) -> tuple[Array, Array]:
    """A matrix scaled to a unit diagonal, and the sizes of its columns; shapes (..., n, n), (..., n)."""
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", normal), 1e-300))
    regularisation = 1e-12 * np.eye(normal.shape[-1])
    return normal / _outer(size) + regularisation, size


def solve(normal: Array, right_side: Array) -> Array:
    """normal^-1 right, right of shape (..., n)."""
    scaled, size = scale_columns(normal)
    solution = np.linalg.solve(scaled, (right_side / size)[..., None])[..., 0]
    return np.asarray(solution / size)


def inverse(normal: Array) -> Array:
    """normal^-1, of shape (..., n, n)."""
    scaled, size = scale_columns(normal)
    return np.asarray(np.linalg.inv(scaled) / _outer(size))


def noise_levels(system: OctaveSystem, deviations: Array) -> tuple[Array, Array]:
    """Variance of a line in each octave by its residual and degrees of freedom, shape (octaves,), and the fit."""
    total = system.total
    count = system.count
    prior = prior_weights(system, deviations)[0]
    fractions, worth = stretch_shares(system.products[:, :, -1, -1], system.lines)
    worth = np.where(worth > 0, worth, count)
    mean = float(total[:, -1, -1].sum() / count.sum())
    noise = np.full(len(count), 1e-3 * mean + 1e-280)
    floor = np.maximum(system.sensor, 1e-12 * mean + 1e-280)
    theta = np.zeros(SIZE)
    order = np.argsort(-system.frequency)
    for _ in range(_REWEIGHTINGS):
        data_normal, right_side = system.equations(noise)
        normal = data_normal + np.diag(prior)
        position_noise = np.tensordot(1 / noise, system.noisy, axes=1)
        theta, _, _ = compensate(data_normal, right_side, position_noise, prior)
        residual = np.append(-theta, 1.0)
        power = np.einsum("i,goij,j->go", residual, system.products, residual)
        levels = fractions * np.maximum(power, 0.0) / np.maximum(system.lines, 1.0)
        degrees_used = np.einsum("oij,ij->o", total[:, :-1, :-1], inverse(normal)) / noise
        free = np.maximum(worth - degrees_used, 0.0)
        noise = pool_levels(levels.sum(axis=0) * worth, free, order, _BORROWED_LINES, floor)
    return noise, theta


def compensate(
    known: Array, right_side: Array, position_noise: Array, prior: Array
) -> tuple[Array, Array, Array]:
    """theta without the bias of the position's noise, its covariance, and that of the remaining bias.

    Each direction of the parameters has its fraction of noise, and least squares give 1 - fraction of the truth. In a
    direction that is nearly all noise nothing is removed, and the prior alone bounds the parameter.

    Args:
        known: normal equations of the data, shape (8, 8).
        right_side: their right-hand side, shape (8,).
        position_noise: part of them that is noise of the position, shape (8, 8).
        prior: weights of the prior, shape (..., 8).
    """
    scaled, size = scale_columns(known + prior[..., None] * np.eye(len(right_side)))
    root = np.linalg.cholesky(scaled)
    inner = np.linalg.solve(root, position_noise / _outer(size))
    inner = np.linalg.solve(root, np.swapaxes(inner, -1, -2))
    inner = (inner + np.swapaxes(inner, -1, -2)) / 2
    noise_fraction, directions = np.linalg.eigh(inner)
    is_known = (1 + _BAND_POWER_ERROR) * noise_fraction < _MAX_NOISE_FRACTION
    noise_fraction = np.clip(np.where(is_known, noise_fraction, 0.0), 0.0, None)
    scaled_directions = np.linalg.solve(np.swapaxes(root, -1, -2), directions)
    to_parameters = scaled_directions / size[..., :, None]
    projections = np.einsum("...ij,i->...j", to_parameters, right_side)
    signal_fraction = 1 - noise_fraction
    least_signal = 1 - (1 + _BAND_POWER_ERROR) * noise_fraction
    remaining_bias = projections * (1 / least_signal - 1 / signal_fraction)
    prior_bound = np.einsum("...ij,...i->...j", to_parameters**2, prior) ** -0.5
    remaining_bias = np.where(is_known, remaining_bias, prior_bound)
    to_directions = np.swapaxes(to_parameters, -1, -2)
    theta = np.einsum("...ij,...j->...i", to_parameters, projections / signal_fraction)
    covariance = (to_parameters / signal_fraction[..., None, :] ** 2) @ to_directions
    bias_covariance = (to_parameters * remaining_bias[..., None, :] ** 2) @ to_directions
    return theta, covariance, bias_covariance
