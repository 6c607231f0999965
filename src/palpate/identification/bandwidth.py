"""How fast the signals of a log are, and so where the filters cut off."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.models import Motion
from palpate.identification.sensor_path import SensorPath

Array = NDArray[np.float64]

FASTEST = 1 / 8
"""Highest cut-off as a share of the readings per second: above it sampling, not filtering, sets the error."""
_ABOVE_FLOOR = 10.0
_SEGMENT = 8192
_FEWEST_SEGMENT = 64


def choose_cutoff(position: Array, force: Array, dt: float, rate: float) -> float:
    """The cut-off [Hz] that passes what stands above the noise in both channels.

    Args:
        position: of the stretch that will be fitted, shape (n,).
        force: likewise.
        dt: their sampling period [s].
        rate: fresh readings per second of the slower channel [1/s].
    """
    highest = FASTEST * rate
    if len(position) < _FEWEST_SEGMENT:
        return highest
    edge = 2 * min(
        _edge(position, dt), _edge(force, dt)
    )  # five lags in a row halve the power at 0.39 of their cut-off
    lowest = min(highest, 10 / (len(position) * dt))
    return float(np.clip(edge, max(lowest, highest / 50), highest))


def _edge(signal: Array, dt: float) -> float:
    """The highest frequency at which the spectrum stands well above its own floor near the end of the band [Hz]."""
    size = min(len(signal), _SEGMENT)
    window = np.hanning(size)
    hop = max(size // 2, 1)
    starts = range(0, len(signal) - size + 1, hop)
    power = np.zeros(size // 2 + 1)
    line = np.linspace(0, 1, size)
    for begin in starts:
        part = signal[begin : begin + size]
        part = part - part[0] - line * (part[-1] - part[0])
        power += np.abs(np.fft.rfft(part * window)) ** 2
    frequency = np.fft.rfftfreq(size, dt)
    power = _smooth(power)
    floor = float(np.median(power[-len(power) // 4 :]))
    above = np.flatnonzero(power > _ABOVE_FLOOR * floor)
    return float(frequency[above[-1]]) if len(above) else 0.0


def _smooth(power: Array) -> Array:
    width = max(len(power) // 100, 1)
    return np.convolve(power, np.ones(width) / width, mode="same")


def highest_motion(motion: Motion) -> float:
    """The frequency below which the position moved while it was fitted, by where its spectrum meets its floor [Hz]."""
    chain, rows = motion.chain, motion.rows
    rows = chain.instants[rows].astype(np.intp) if isinstance(chain, SensorPath) else rows
    stretch = motion.position[rows[0] : rows[-1] + 1]
    return _edge(stretch, chain.dt) if len(stretch) >= _FEWEST_SEGMENT else float("inf")
