"""Noise of a measured position: white noise, and jumps, which are white noise of its increments.

Slow motion through a coarse encoder makes jumps. Power of the increments per sample at f of the sampling rate:
jump^2 + white^2 4 sin^2(pi f). No motion of a robot reaches the upper frequencies, so there the power is the noise's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices

_LOWEST = 0.2
"""Fraction of the sampling rate above which there is no motion."""
_STEPS = 256
"""Samples of a spectrum of the increments."""
_IN_BAND = 0.5
"""Fraction of the jumps' power that counts at the frequencies of a motion. An encoder's error never leaves its count,
so its jumps undo each other, and toward low frequencies their power falls."""
_MIN_COUNTS = 10
"""Single counts that show the encoder's step."""


@dataclass(frozen=True)
class PositionNoise:
    """Standard deviations in the position's unit.

    Args:
        white: of a sample.
        jump: of what is added from sample to sample.
        count: step of the encoder; 0 where single counts are not seen.
    """

    white: float
    jump: float
    count: float = 0.0

    @classmethod
    def of_differences(cls, power: float, product: float, count: float) -> PositionNoise:
        """Noise from the mean square of the position's sixth differences, the product of neighbours, and the count."""
        # Sums of products of the binomial weights of sixth differences of both kinds, at no distance and at one.
        white, jump = np.linalg.solve([[924.0, 252.0], [-792.0, -210.0]], [power, product])
        if white < 0:
            white, jump = 0.0, power / 252.0
        elif jump < 0:
            white, jump = power / 924.0, 0.0
        return cls(float(np.sqrt(white)), float(np.sqrt(jump)), count)

    def power(self, frequency: Array, dt: float) -> Array:
        """Power in a line of an orthonormal transform of the position, at frequencies [Hz].

        Below the rate jump^2/count^2 of an encoder's steps the power is flat, with a whole variance of count^2/12.
        """
        step = 4 * np.sin(np.pi * np.minimum(frequency * dt, 0.5)) ** 2
        jumps = _IN_BAND * self.jump**2 / np.maximum(step, 1e-12)
        if self.count and self.jump:
            jumps = np.minimum(jumps, self.count**4 / (24 * self.jump**2))
        return np.asarray(self.white**2 + jumps)

    def variance(self, weights: Array) -> float:
        """Variance of a filtered rate or acceleration of this noise, by the filter's weights, shape (n,)."""
        steps = np.cumsum(weights)
        return float(self.white**2 * weights @ weights + _IN_BAND * self.jump**2 * steps @ steps)

    def in_samples(self, weights: Array) -> Array:
        """Products of what the noise makes of acceleration, velocity, position and 1 in one sample, shape (4, 4).

        The weights, shape (3, n), read the first three from positions. Jumps have no power of their own in the
        position, but a position that wanders has its acceleration against it: E[e e''] = -E[e'^2].
        """
        products = np.zeros((4, 4))
        steps = np.cumsum(weights, axis=1)
        steps[2] = 0.0
        jumps = steps @ steps.T
        jumps[0, 2] = jumps[2, 0] = -jumps[1, 1]
        products[:3, :3] = self.white**2 * weights @ weights.T + _IN_BAND * self.jump**2 * jumps
        return products


NOISELESS = PositionNoise(0.0, 0.0)


def position_noise(stretches: list[Array]) -> PositionNoise:
    """Measure the noise on stretches of a position, each of shape (n_i,), by the spectrum of their increments.

    Stretches shorter than 16 samples say nothing.
    """
    from scipy.optimize import nnls

    power = np.zeros(_STEPS // 2 + 1)
    weight = 0.0
    frequency = np.fft.rfftfreq(_STEPS)
    for steps in (np.diff(stretch) for stretch in stretches if len(stretch) >= 16):
        size = min(_STEPS, len(steps))
        segments = np.lib.stride_tricks.sliding_window_view(steps, size)[:: max(size // 2, 1)]
        window = np.hanning(size + 2)[1:-1]
        spectrum = (np.abs(np.fft.rfft(segments * window, axis=1)) ** 2).mean(axis=0) / float(window @ window)
        power += len(steps) * np.interp(frequency, np.linspace(0, 0.5, len(spectrum)), spectrum)
        weight += len(steps)
    if weight == 0:
        return NOISELESS
    above = frequency >= _LOWEST
    shape = np.column_stack([4 * np.sin(np.pi * frequency[above]) ** 2, np.ones(int(above.sum()))])
    scale = float(np.mean(power[above])) or 1.0
    levels, _ = nnls(shape, power[above] / scale)
    white, jump = np.sqrt(levels * scale / weight)
    return PositionNoise(float(white), float(jump), _encoder_count(stretches))


def noise_in_contacts(position: Array, rows: Indices, spans: Indices) -> PositionNoise:
    """Measure the noise of a position, shape (n,), from the first to the last row of each contact.

    The rows in contact, and the number of each one's contact, have the shape (m,).
    """
    contacts = np.split(rows, np.flatnonzero(np.diff(spans)) + 1)
    return position_noise(
        [position[contact_rows[0] : contact_rows[-1] + 1] for contact_rows in contacts if len(contact_rows)]
    )


def _encoder_count(stretches: list[Array]) -> float:
    """Mean size of changes that have none before and none after them. Of several encoders the coarsest counts most."""
    alone = []
    for steps in (np.abs(np.diff(stretch)) for stretch in stretches if len(stretch) > 3):
        still = steps == 0
        alone.append(steps[1:-1][still[:-2] & still[2:] & ~still[1:-1]])
    counts = np.concatenate(alone) if alone else np.zeros(0)
    return float(np.sum(counts**3) / np.sum(counts**2)) if len(counts) >= _MIN_COUNTS else 0.0
