"""Noise of both channels in a spectral line of each octave, the position's by derivative."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from palpate.arrays import Array, Mask
from palpate.identification.estimators.budget import white_level
from palpate.identification.estimators.by_octave import Solution, System, worth
from palpate.identification.estimators.octaves import Octaves, Segment, lines_of, longest_of, octaves_of
from palpate.identification.models import Motion
from palpate.identification.problem import Problem

_SEEN = 10.0
"""Power of a column over that of the position's noise in it, below which an octave is left out: its parameter would be
off by a tenth."""
_ROUNDED = 100.0
"""Last digits of a position that its way through the filters may round."""


def position_lines(motion: Motion, dt: float, longest: int, count: int, most: int) -> dict[int, Array]:
    """Power of the position's noise times omega^k in a line of each octave, shape (count,), by even k.

    Args:
        motion: of the log.
        dt: from row to row [s].
        longest: rows of the block of the first octave.
        count: of the octaves.
        most: the highest derivative; k goes up to twice that.
    """
    chain = motion.chain

    def power(k: int) -> Callable[[Array], Array]:
        return lambda f: (
            motion.noise.power(f, chain.dt)
            * chain.position_gain(f) ** 2
            * (2 * np.pi * f) ** k
            * chain.dt
            / dt
        )

    return {k: lines_of(power(k), dt, longest, count) for k in range(0, 2 * most + 1, 2)}


def derivative_products(noisy: dict[int, Array]) -> Array:
    """Products of the noise of derivative i with that of j by octave, shape (octaves, d, d); others are in quadrature.

    Args:
        noisy: as `position_lines` has it.
    """
    order = np.arange(1 + max(noisy) // 2)
    both, apart = np.add.outer(order, order), np.abs(np.subtract.outer(order, order))
    found = np.zeros((len(noisy[0]), *both.shape))
    for k, power in noisy.items():
        found += np.where(both == k, 1 - apart % 4, 0) * power[:, None, None]
    return found


def seen(motion: Motion, noisy: dict[int, Array], octaves: Octaves, derivatives: dict[int, int]) -> Mask:
    """Octaves up to the first in which a column is mostly the position's noise, which pulls its parameter to zero.

    Args:
        motion: of the log.
        noisy: as `position_lines` has it.
        octaves: of the columns.
        derivatives: place of a column, and which derivative of the position it is.
    """
    rounding = (_ROUNDED * np.finfo(float).eps * float(np.abs(motion.position).max())) ** 2
    omega2 = (2 * np.pi * octaves.frequency) ** 2
    power = np.stack([octaves.total[:, place, place] for place in derivatives])
    noise = [np.maximum(octaves.all_lines * noisy[2 * k], rounding * omega2**k) for k in derivatives.values()]
    return np.logical_and.accumulate(np.all(power >= _SEEN * np.stack(noise), axis=0))


def sensor_lines(
    problem: Problem,
    segments: list[Segment],
    octaves: Octaves,
    use: Mask,
    system: System,
    solution: Solution,
) -> tuple[Array, Array]:
    """Variance of a line by the sensor's own noise in each octave, and the lines that tell it, shape (octaves,).

    Out of contact it is seen; where the log has no such stretch, it is what the quietest octaves have in common.

    Args:
        problem: of the log.
        segments: of its rows.
        octaves: sums of the columns, the force last.
        use: octaves that count, shape (octaves,).
        system: the normal equations of those.
        solution: of them.
    """
    longest, dt = longest_of(segments), float(np.median(np.diff(problem.time)))
    passed = problem.motion.chain.force_gain
    gain = lines_of(lambda f: passed(f) ** 2, dt, longest, len(octaves.frequency))
    gain = np.maximum(gain, np.finfo(float).eps)
    rest = _rest(problem, dt, longest)
    if rest is None:
        own = octaves.total[:, -1, -1] / np.maximum(octaves.all_lines, 1.0)
        level = np.where(use, solution.noise, own)
        lines = np.where(use, worth(system), octaves.all_lines)
    else:
        lines = rest.all_lines
        level = rest.total[:, 0, 0] / np.maximum(lines, 1.0)
    digits = problem.rounding**2 * problem.motion.chain.dt / dt
    sensor = max(white_level(level / gain, lines), digits) * gain
    told = np.full(len(sensor), float(lines.sum()))
    if rest is not None:
        louder = (lines > 0) & (level > sensor)
        sensor, told = np.where(louder, level, sensor), np.where(louder, lines, told)
    return np.minimum(sensor, solution.noise), told


def _rest(problem: Problem, dt: float, longest: int) -> Octaves | None:
    """The force out of contact by the octaves of the contacts; None if there is too little of it."""
    if not problem.free:
        return None
    edges = np.cumsum([0, *(len(f) for f in problem.free)])
    stretches = [Segment(int(a), int(b)) for a, b in pairwise(edges)]
    found = octaves_of(np.concatenate(problem.free)[:, None], stretches, dt, longest)
    return found if found.lines.any() else None
