"""Dynamic stiffness by octaves: force over position in blocks of four periods, and how much the blocks differ.

In each block the transform of the force is regressed on that of the position over the three lines about the octave's
middle (the best linear approximation of Pintelon and Schoukens, 2012). Blocks are pooled by the power of their
motion; the variance between them, with Student's t for their effective number, makes the interval, so that whatever
differs from block to block, known or not, widens it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.octaves import Segment
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness

Array = NDArray[np.float64]

PERIODS = 4
"""Periods in a block: the lines 3, 4, 5 of its transform are then the octave."""
_LINES = np.array([3, 4, 5])
_FEWEST = 16
"""Rows in a block."""
_MOST = 24


@dataclass(frozen=True)
class _Blocks:
    """Transforms at the three lines, shape (blocks, 3)."""

    position: NDArray[np.complex128]
    force: NDArray[np.complex128]


def dynamic_stiffness(
    problem: Problem, segments: list[Segment], lag: float, lag_std: float
) -> tuple[DynamicStiffness, ...]:
    """Storage and loss in each octave that a contact is long enough for, lowest first.

    Args:
        problem: of the log.
        segments: of its rows, one at least.
        lag: of the force behind the position [s], taken out.
        lag_std: what is not known of it [s].
    """
    dt = float(np.median(np.diff(problem.time)))
    position, force = problem.motion.moved(0, lag), problem.force
    variance = float(np.concatenate([position[s.first : s.last] for s in segments]).var()) or 1e-300
    longest = max(s.last - s.first for s in segments)
    found = []
    length = longest
    for _ in range(_MOST):
        if length < _FEWEST:
            break
        blocks = _blocks(position, force, segments, length)
        frequency = PERIODS / (length * dt)
        found.append(_octave(problem, blocks, frequency, length, variance, lag_std))
        length //= 2
    return tuple(found)


def _blocks(position: Array, force: Array, segments: list[Segment], length: int) -> _Blocks:
    """Of all segments that hold one; half overlapping."""
    window = np.hanning(length + 2)[1:-1]
    phase = np.exp(-2j * np.pi * np.outer(np.arange(length), _LINES) / length) * window[:, None]
    lines: list[list[NDArray[np.complex128]]] = [[], []]
    for s in segments:
        if s.last - s.first < length:
            continue
        for channel, values in enumerate((position, force)):
            own = np.lib.stride_tricks.sliding_window_view(values[s.first : s.last], length)[:: max(length // 2, 1)]
            own = own - (own @ window / window.sum())[:, None]
            lines[channel].append(own @ phase)
    return _Blocks(np.concatenate(lines[0]), np.concatenate(lines[1]))


def _octave(
    problem: Problem, blocks: _Blocks, frequency: float, length: int, variance: float, lag_std: float
) -> DynamicStiffness:
    power = (np.abs(blocks.position) ** 2).sum(axis=1)
    total = float(power.sum()) or 1e-300
    cross = (np.conj(blocks.position) * blocks.force).sum(axis=1)
    stiffness = complex(cross.sum() / total)
    count = total**2 / float((power**2).sum() or 1e-300)
    independent = max(count * (1.0 if len(power) < 2 else 0.75), 1.0)  # half-overlapping Hann blocks: Welch 1967
    spread = cross - stiffness * power
    left = blocks.force - stiffness * blocks.position
    within = float((np.abs(left) ** 2).sum()) / max(6 * len(power) - 2, 1) / total / 0.75
    parts = []
    for part in (spread.real, spread.imag):
        between = float(part @ part) / total**2 * independent / max(independent - 1, 0.5)
        parts.append(max(between, within))
    dof = max(independent - 1, 0.0) + 4.0 * min(1.0, 1 / max(independent, 1.0))
    halves = _student(dof) * np.sqrt(parts)
    omega = 2 * np.pi * frequency
    storage, loss = stiffness.real, stiffness.imag
    by_lag = 1.96 * omega * lag_std
    noise = _noise_share(problem, frequency, length, total / len(power))
    halves = np.hypot(halves, [abs(loss) * by_lag + abs(storage) * by_lag**2 / 2, abs(storage) * by_lag])
    halves = np.hypot(halves, noise * np.abs([storage, loss]))
    share = total / len(power) * 2 / (length * float((np.hanning(length + 2) ** 2).sum())) / variance
    return DynamicStiffness(
        frequency, storage, float(halves[0]), loss, float(halves[1]), len(power), float(min(share, 1.0))
    )


def _noise_share(problem: Problem, frequency: float, length: int, power: float) -> float:
    """Power of the position's noise in the three lines, over that of the position there."""
    noise = problem.motion.noise
    spacing = problem.motion.chain.period
    step = 4 * np.sin(np.pi * min(frequency * spacing, 0.5)) ** 2
    variance = noise.white**2 + 0.5 * noise.jump**2 / max(step, 1e-12)
    window = float((np.hanning(length + 2) ** 2).sum())
    return min(3 * variance * window / max(power, 1e-300), 1.0)


def _student(freedom: float) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), 0.975))
