"""Sums of the normal equations in blocks of samples: bounded memory from which a fit and its doubts are read.

There are `BLOCKS` at most. When they are full neighbours are joined, and from then on blocks are twice as long: noise
that is correlated over less than a block, a share of all the samples, is covered.
"""

from math import sqrt

import numpy as np

from palpate._jit import law
from palpate.arrays import Array

BLOCKS = 64
FIRST = 16
"""Samples in a block at first."""
JERK, EXTRA = 4, 5
"""Behind a, v, x and 1 the rate of a, which tells what an error of the lag does; then those that tell whether the model
holds: two relaxations, x^2, x v, and friction."""
COLUMNS = 10
RELAXATIONS = (0.03, 0.3)
"""Time constants of the two [s]; one tells of all from a third to three times its own."""
SUMS = COLUMNS * (COLUMNS + 1) // 2
WEIGHT, NOISE_POWER, NOISE_PRODUCT, NOISE_COUNT, SQUARES, MOMENTS = 0, 1, 2, 3, 4, 5
WIDTH = MOMENTS + COLUMNS + SUMS
"""A block: samples; sums of the sixth differences' squares, products and count; of force squared; of column times
force; of column times column, the upper triangle row by row."""
FILLED, SIZE, FAST, SLOW, CONTACT, INSTANT, SPEED, SEEN, POWER0, PRODUCT0, COUNT0, RATE = range(12)
"""Blocks that are full; samples in a block; the relaxations; contact and instant of the last sample; mean square of
the speed, and of how many; the position's noise as it was told when the block began; and the last a."""
HEADER = 12
LENGTH = HEADER + BLOCKS * WIDTH + COLUMNS


def no_sums() -> Array:
    """Before the first sample."""
    sums = np.zeros(LENGTH)
    sums[SIZE] = FIRST
    return sums


@law
def added(sums, a, v, x, force, contact, instant, dt, power, product, count):
    """Takes a sample in.

    a, v, x are its regressor; the number of its contact starts the relaxations afresh where it is a new one; its
    instant is in ticks of `dt` seconds; power, product and count are those of the position's sixth differences.
    """
    w = HEADER + BLOCKS * WIDTH
    _columns(sums, w, a, v, x, contact, instant, dt)
    at = HEADER + int(sums[FILLED]) * WIDTH
    sums[at + WEIGHT] += 1.0
    sums[at + SQUARES] += force * force
    k = at + MOMENTS + COLUMNS
    for i in range(COLUMNS):
        sums[at + MOMENTS + i] += sums[w + i] * force
        for j in range(i, COLUMNS):
            sums[k] += sums[w + i] * sums[w + j]
            k += 1
    if sums[at + WEIGHT] >= sums[SIZE]:
        sums[at + NOISE_POWER] = power - sums[POWER0]
        sums[at + NOISE_PRODUCT] = product - sums[PRODUCT0]
        sums[at + NOISE_COUNT] = count - sums[COUNT0]
        sums[POWER0], sums[PRODUCT0], sums[COUNT0] = power, product, count
        sums[FILLED] += 1.0
        if sums[FILLED] >= BLOCKS:
            _joined(sums)


@law
def _columns(sums, w, a, v, x, contact, instant, dt):
    """Writes the regressors of a sample behind the blocks."""
    jerk = 0.0
    if contact != sums[CONTACT]:
        sums[CONTACT], sums[FAST], sums[SLOW] = contact, x, x
    else:
        passed = (instant - sums[INSTANT]) * dt
        jerk = (a - sums[RATE]) / passed
        sums[FAST] += (x - sums[FAST]) * passed / (RELAXATIONS[0] + passed)
        sums[SLOW] += (x - sums[SLOW]) * passed / (RELAXATIONS[1] + passed)
    sums[INSTANT], sums[RATE] = instant, a
    sums[SEEN] += 1.0
    sums[SPEED] += (v * v - sums[SPEED]) / sums[SEEN]
    fast = v * v + sums[SPEED]
    sums[w], sums[w + 1], sums[w + 2], sums[w + 3] = a, v, x, 1.0
    sums[w + 4], sums[w + 5], sums[w + 6], sums[w + 7] = jerk, sums[FAST], sums[SLOW], x * x
    sums[w + 8], sums[w + 9] = x * v, v / sqrt(fast) if fast > 0.0 else 0.0


@law
def _joined(sums):
    """Joins neighbours; the next blocks are twice as long."""
    half = BLOCKS // 2
    for b in range(half):
        for k in range(WIDTH):
            first = HEADER + 2 * b * WIDTH + k
            sums[HEADER + b * WIDTH + k] = sums[first] + sums[first + WIDTH]
    for k in range(HEADER + half * WIDTH, HEADER + BLOCKS * WIDTH):
        sums[k] = 0.0
    sums[FILLED] = float(half)
    sums[SIZE] *= 2.0
