"""How noisy a measured position is within the band of a fit, judged from above that band.

Two kinds of noise count: white noise of the position itself, and jumps of it, white noise of its increments, as a slow
motion through a coarse encoder makes them. Power of the increments per sample at f of the sampling rate:
jump^2 + white^2 4 sin^2(pi f); no motion of a robot reaches the upper frequencies, so there it is the noise's alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FROM = 0.2
"""Share of the sampling rate above which there is no motion."""
_SEGMENT = 256


@dataclass(frozen=True)
class PositionNoise:
    """Deviations in the position's unit.

    Args:
        white: of a sample.
        jump: of what is added from sample to sample.
    """

    white: float
    jump: float


NOISELESS = PositionNoise(0.0, 0.0)


def position_noise(stretches: list[Array]) -> PositionNoise:
    """Measure it on stretches of a position, each of shape (n_i,); those shorter than 16 samples say nothing."""
    from scipy.optimize import nnls

    power, weight = np.zeros(_SEGMENT // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(_SEGMENT)
    for stretch in stretches:
        if len(stretch) >= 16:
            own, count = _power(np.diff(stretch))
            power += count * np.interp(frequency, np.linspace(0, 0.5, len(own)), own)
            weight += count
    if weight == 0:
        return NOISELESS
    above = frequency >= _FROM
    shape = np.column_stack([4 * np.sin(np.pi * frequency[above]) ** 2, np.ones(int(above.sum()))])
    scale = float(np.mean(power[above])) or 1.0
    found, _ = nnls(shape, power[above] / scale)
    white, jump = np.sqrt(found * scale / weight)
    return PositionNoise(float(white), float(jump))


def _power(increments: Array) -> tuple[Array, float]:
    """Mean periodogram of overlapping windowed segments, shape (size // 2 + 1,), and the samples it stands for."""
    size = min(_SEGMENT, len(increments))
    segments = np.lib.stride_tricks.sliding_window_view(increments, size)[:: max(size // 2, 1)]
    window = np.hanning(size + 2)[1:-1]
    spectra = np.abs(np.fft.rfft(segments * window, axis=1)) ** 2
    return spectra.mean(axis=0) / float(window @ window), float(len(increments))
