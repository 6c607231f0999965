"""Sums of the normal equations by octave of frequency and by stretch of time, in bounded memory.

Every sample is a row: acceleration, velocity, position, force, and the columns of other forces. Level 0 has all rows,
each further level every second row of the one before, smoothed by the binomial weights 1, 4, 6, 4, 1. At each level,
blocks of 16 rows that overlap by half are multiplied by Hann's window and transformed; their lines 3, 4 and 5 are one
octave, and the products of all columns over them are summed. A linear operation on the rows keeps the regression, so
the model holds among the lines as it does in time, while a disturbance stays in its own octave. Each block is without
its mean and slope: an offset and a slow drift of the force drop out.

The stretches of time are `GROUPS` at most: when they are full, neighbours are joined, and later ones are twice as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from palpate._jit import law
from palpate.arrays import Array
from palpate.signals.position_noise import PositionNoise

A, V, X, FORCE, FAST, SLOW, SQUARE, CROSS, RUB = range(9)
"""Columns of a row: then two relaxations of the position, x^2, x v, and the direction of the velocity."""
COLUMNS = 9
PRODUCTS = COLUMNS * (COLUMNS + 1) // 2
RELAXATIONS = (0.03, 0.3)
"""Time constants of the two [s]; one shows all from a third to three times its own."""
SHARP = 0.01
"""Mean square of the velocity about zero within which friction turns, over that of all."""
LEVELS, ROWS, HALF, LINES = 14, 16, 8, 6
"""Levels; rows of a block, and from one to the next; real numbers of its three lines."""
GROUPS, FIRST = 32, 32
"""Stretches of time; samples of a stretch at first."""
MEANS = 5
WEIGHT, NOISE_POWER, NOISE_PRODUCT, NOISE_COUNT, SUMS = range(5)
"""A stretch: samples; sums of the position's sixth differences squared, times their neighbours, and how many; sums of
a, v, x, 1, force and of the products of the first four; then by level the blocks and their products."""
PLAIN = 10
AT_LEVELS = SUMS + MEANS + PLAIN
LEVEL = 1 + PRODUCTS
GROUP = AT_LEVELS + LEVELS * LEVEL
FILLED, SIZE, BEHIND, FAR_BEHIND, CONTACT, INSTANT, SPEED, SEEN, POWER0, PRODUCT0, COUNT0 = range(11)
"""Stretches that are full; samples in one; the relaxations; contact and instant of the last sample; mean square of the
velocity, and of how many; the position's noise when the stretch began."""
HEADER = 11
RING = 1 + ROWS * COLUMNS
"""A level's rows: how many there were, and the last 16."""
AT_RINGS = HEADER + GROUPS * GROUP
AT_BLOCK = AT_RINGS + LEVELS * RING
LENGTH = AT_BLOCK + LINES * COLUMNS


def transform(rows: int, lines: tuple[int, ...]) -> Array:
    """Real and imaginary parts of the lines of a block of so many rows, shape (rows, 2 lines).

    Hann's window, without mean and slope. White noise keeps its variance in each.
    """
    time = np.arange(rows)
    window = np.hanning(rows + 2)[1:-1]
    window /= np.sqrt(window @ window / 2)
    phase = np.exp(-2j * np.pi * np.outer(time, lines) / rows) * window[:, None]
    plain = np.column_stack([np.ones(rows), time - 0.5 * (rows - 1)])
    weighted = window[:, None] * plain
    phase = phase - weighted @ np.linalg.solve(plain.T @ weighted, plain.T @ phase)
    return np.ascontiguousarray(np.concatenate([phase.real, phase.imag], axis=1))


TRANSFORM = transform(ROWS, (3, 4, 5))


def no_sums() -> Array:
    """Before the first sample."""
    sums = np.zeros(LENGTH)
    sums[SIZE] = FIRST
    return sums


@law
def add_sample(sums, a, v, x, force, contact, instant, dt, differences):
    """Adds a sample.

    A contact of another number begins the relaxations again; the instant is in ticks of `dt` seconds;
    the differences are power, product and count of the position's sixth ones so far.
    """
    _row(sums, a, v, x, force, contact, instant, dt)
    group = HEADER + int(sums[FILLED]) * GROUP
    _plain(sums, group, a, v, x, force)
    level = 0
    while level < LEVELS:
        ring = AT_RINGS + level * RING
        sums[ring] += 1.0
        rows = int(sums[ring])
        if rows >= ROWS and rows % HALF == 0:
            _block(sums, ring, rows, group + AT_LEVELS + level * LEVEL)
        level += 1
        if rows % 2 == 1 or rows < 5 or level == LEVELS:
            break
        _thin(sums, ring, rows)
    if sums[group + WEIGHT] >= sums[SIZE]:
        power, product, count = differences
        sums[group + NOISE_POWER] = power - sums[POWER0]
        sums[group + NOISE_PRODUCT] = product - sums[PRODUCT0]
        sums[group + NOISE_COUNT] = count - sums[COUNT0]
        sums[POWER0], sums[PRODUCT0], sums[COUNT0] = power, product, count
        sums[FILLED] += 1.0
        if sums[FILLED] >= GROUPS:
            _join(sums)


@law
def _row(sums, a, v, x, force, contact, instant, dt):
    """Writes the columns of a sample into the first level."""
    if contact != sums[CONTACT]:
        sums[CONTACT], sums[BEHIND], sums[FAR_BEHIND] = contact, x, x
    else:
        passed = (instant - sums[INSTANT]) * dt
        sums[BEHIND] += (x - sums[BEHIND]) * passed / (RELAXATIONS[0] + passed)
        sums[FAR_BEHIND] += (x - sums[FAR_BEHIND]) * passed / (RELAXATIONS[1] + passed)
    sums[INSTANT] = instant
    sums[SEEN] += 1.0
    sums[SPEED] += (v * v - sums[SPEED]) / sums[SEEN]
    size = v * v + SHARP * sums[SPEED]
    w = AT_RINGS + 1 + (int(sums[AT_RINGS]) % ROWS) * COLUMNS
    sums[w + A], sums[w + V], sums[w + X], sums[w + FORCE] = a, v, x, force
    sums[w + FAST], sums[w + SLOW], sums[w + SQUARE] = sums[BEHIND], sums[FAR_BEHIND], x * x
    sums[w + CROSS], sums[w + RUB] = x * v, v / sqrt(size) if size > 0.0 else 0.0


@law
def _plain(sums, group, a, v, x, force):
    """Adds a sample to the sums of its stretch that know no frequency."""
    at = group + SUMS
    sums[group + WEIGHT] += 1.0
    sums[at] += a
    sums[at + 1] += v
    sums[at + 2] += x
    sums[at + 3] += 1.0
    sums[at + 4] += force
    at += MEANS
    sums[at] += a * a
    sums[at + 1] += a * v
    sums[at + 2] += a * x
    sums[at + 3] += a
    sums[at + 4] += v * v
    sums[at + 5] += v * x
    sums[at + 6] += v
    sums[at + 7] += x * x
    sums[at + 8] += x
    sums[at + 9] += 1.0


@law
def _thin(sums, ring, rows):
    """Writes the next level's row: the last five of a level, smoothed."""
    below = ring + 1
    w = ring + RING + 1 + (int(sums[ring + RING]) % ROWS) * COLUMNS
    r0 = below + ((rows - 5) % ROWS) * COLUMNS
    r1 = below + ((rows - 4) % ROWS) * COLUMNS
    r2 = below + ((rows - 3) % ROWS) * COLUMNS
    r3 = below + ((rows - 2) % ROWS) * COLUMNS
    r4 = below + ((rows - 1) % ROWS) * COLUMNS
    for c in range(COLUMNS):
        sums[w + c] = (
            0.0625 * (sums[r0 + c] + sums[r4 + c])
            + 0.25 * (sums[r1 + c] + sums[r3 + c])
            + 0.375 * sums[r2 + c]
        )


@law
def _block(sums, ring, rows, at):
    """Adds the lines of a level's last 16 rows to its products."""
    for k in range(LINES * COLUMNS):
        sums[AT_BLOCK + k] = 0.0
    for row in range(ROWS):
        w = ring + 1 + ((rows + row) % ROWS) * COLUMNS
        for line in range(LINES):
            weight, b = TRANSFORM[row, line], AT_BLOCK + line * COLUMNS
            for c in range(COLUMNS):
                sums[b + c] += weight * sums[w + c]
    sums[at] += 1.0
    k = at + 1
    for i in range(COLUMNS):
        for j in range(i, COLUMNS):
            total = 0.0
            for line in range(LINES):
                b = AT_BLOCK + line * COLUMNS
                total += sums[b + i] * sums[b + j]
            sums[k] += total
            k += 1


@law
def _join(sums):
    """Joins neighbouring stretches; the next are twice as long."""
    half = GROUPS // 2
    for g in range(half):
        for k in range(GROUP):
            first = HEADER + 2 * g * GROUP + k
            sums[HEADER + g * GROUP + k] = sums[first] + sums[first + GROUP]
    for k in range(HEADER + half * GROUP, HEADER + GROUPS * GROUP):
        sums[k] = 0.0
    sums[FILLED] = float(half)
    sums[SIZE] *= 2.0


_GRID = 120
"""Frequencies on each side of a multiple of the sampling rate, evenly spaced in their logarithm."""


@dataclass(frozen=True)
class LineNoise:
    """Variance in a line of each octave for noise of variance 1.

    Args:
        frequency: middle of each octave [Hz], shape (levels,).
        position: products of a, v and x for white noise of the position, shape (levels, 3, 3).
        force: for white noise of the force samples, shape (levels,).
        weights: by which a, v and x are read from the positions, shape (3, taps).
        tick: from position to position [s].
        rate: samples of the force a second [Hz].
    """

    frequency: Array
    position: Array
    force: Array
    weights: Array
    tick: float
    rate: float

    @classmethod
    def of(cls, weights: Array, tick: float, period: float) -> LineNoise:
        """For the weights by which a, v and x are read, shape (3, taps), and the time between samples [s]."""
        f, share = _grid(1 / period, 0.5 / tick)
        read = np.exp(-2j * np.pi * np.outer(f * tick, np.arange(weights.shape[1]))) @ weights.T  # (F, 3)
        products = np.real(read[:, :, None] * np.conj(read[:, None, :])) * (2 * tick * share)[:, None, None]
        own = f <= 0.5 / period
        position, force = np.empty((LEVELS, 3, 3)), np.empty(LEVELS)
        for level in range(LEVELS):
            response = _response(f * period, level)
            position[level] = np.tensordot(response, products, axes=1)
            force[level] = (response * share)[own].sum() * 2 * period
        middle = 4.0 / (ROWS * 2.0 ** np.arange(LEVELS) * period)
        return cls(np.asarray(middle, np.float64), position, force, weights, tick, 1 / period)

    def positions(self, noise: PositionNoise) -> Array:
        """Products of what noise of the position makes of a, v and x in a line of each octave, (levels, 3, 3)."""
        return noise.power(self.frequency, self.tick)[:, None, None] * self.position


def _grid(sampling: float, highest: float) -> tuple[Array, Array]:
    """Frequencies up to the highest, and the band that each stands for [Hz].

    They are dense at the multiples of the sampling rate, whose noise slow lines see.
    """
    apart = 0.5 * sampling * np.geomspace(2.0 ** -(LEVELS + 4), 1.0, _GRID)
    edges = [apart]
    for multiple in range(1, int(highest / sampling + 0.5) + 1):
        edges += [multiple * sampling - apart[::-1], multiple * sampling + apart]
    edge = np.unique(np.concatenate([[0.0], *edges]).clip(0.0, highest))
    return 0.5 * (edge[1:] + edge[:-1]), np.diff(edge)


def _response(turns: Array, level: int) -> Array:
    """Mean power gain of a level's lines at frequencies in turns a sample, shape (F,)."""
    gain = np.ones(len(turns))
    for _ in range(level):
        gain *= np.cos(np.pi * turns) ** 8
        turns = np.mod(2 * turns, 1.0)
    phases = np.exp(-2j * np.pi * np.outer(turns, np.arange(ROWS)))
    return np.asarray(gain * np.mean(np.abs(phases @ TRANSFORM) ** 2, axis=1))
