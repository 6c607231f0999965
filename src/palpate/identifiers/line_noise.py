"""Noise of position and force in the octaves of `octave_sums`, per unit of what the sensors have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.identifiers.kernels import octave_sums as sums

_GRID = 120
"""Frequencies on each side of a multiple of the sampling rate, evenly spaced in their logarithm."""
_JUMPS_LEFT = 0.5
"""Share of the jumps' power towards low frequencies: an error never leaves its count, so each jump is undone later."""


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
        position, force = np.empty((sums.LEVELS, 3, 3)), np.empty(sums.LEVELS)
        for level in range(sums.LEVELS):
            response = _response(f * period, level)
            position[level] = np.tensordot(response, products, axes=1)
            force[level] = (response * share)[own].sum() * 2 * period
        middle = 4.0 / (sums.ROWS * 2.0 ** np.arange(sums.LEVELS) * period)
        return cls(np.asarray(middle, np.float64), position, force, weights, tick, 1 / period)

    def positions(self, noise: PositionNoise) -> Array:
        """Products of what noise of the position makes of a, v and x in a line of each octave, (levels, 3, 3)."""
        return noise.power(self.frequency * self.tick)[:, None, None] * self.position

    def in_samples(self, noise: PositionNoise) -> Array:
        """Products of what noise of the position makes of a, v, x and 1 in one sample, shape (4, 4).

        Jumps have no power of their own in the position, but a position that wanders has its acceleration against it:
        E[e e''] = -E[e'^2].
        """
        found, steps = np.zeros((4, 4)), np.cumsum(self.weights, axis=1)
        steps[2] = 0.0
        jumps = steps @ steps.T
        jumps[0, 2] = jumps[2, 0] = -jumps[1, 1]
        found[:3, :3] = noise.white * self.weights @ self.weights.T + _JUMPS_LEFT * noise.jump * jumps
        return found


def _grid(sampling: float, highest: float) -> tuple[Array, Array]:
    """Frequencies up to the highest, and the band that each stands for [Hz].

    They are dense at the multiples of the sampling rate, whose noise slow lines see.
    """
    apart = 0.5 * sampling * np.geomspace(2.0 ** -(sums.LEVELS + 4), 1.0, _GRID)
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
    phases = np.exp(-2j * np.pi * np.outer(turns, np.arange(sums.ROWS)))
    return np.asarray(gain * np.mean(np.abs(phases @ sums.TRANSFORM) ** 2, axis=1))


@dataclass(frozen=True)
class PositionNoise:
    """Noise of the position: white, and jumps, which are white increments, as slow motion through an encoder has them.

    Args:
        white: variance of a reading [m^2].
        jump: variance of an increment [m^2].
        count: of the encoder [m]; 0 where single counts are not seen.
    """

    white: float
    jump: float
    count: float

    @classmethod
    def of(cls, power: float, product: float, count: float) -> PositionNoise:
        """From the mean square of the position's sixth differences, the mean product of neighbours, and the count."""
        # Sums of products of the binomial weights of sixth differences of both kinds, at no distance and at one.
        white, jump = np.linalg.solve([[924.0, 252.0], [-792.0, -210.0]], [power, product])
        if white < 0:
            white, jump = 0.0, power / 252.0
        elif jump < 0:
            white, jump = power / 924.0, 0.0
        return cls(float(white), float(jump), count)

    def power(self, turns: Array) -> Array:
        """Power at frequencies in turns a tick, over that of white noise of variance 1.

        An encoder's error never leaves its count: below the rate jump/count^2 of its steps its power is even, and its
        whole variance is count^2/12.
        """
        jumps = _JUMPS_LEFT * self.jump / (4 * np.sin(np.pi * np.minimum(turns, 0.5)) ** 2)
        if self.count > 0 and self.jump > 0:
            jumps = np.minimum(jumps, self.count**4 / (24 * self.jump))
        return np.asarray(self.white + jumps)
