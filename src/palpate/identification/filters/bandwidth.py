"""How fast the signals of a log are, and so where the filters cut off."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters.sensor_path import SensorPath, position_noise
from palpate.identification.models import Motion
from palpate.signals.samples import periodogram

FASTEST = 1 / 8
"""Highest cut-off as a share of the readings per second: above it sampling, not filtering, sets the error."""
_ABOVE_FLOOR = 10.0
_SEGMENT = 8192
_CONTACTS = 32
_FEWEST_SEGMENT = 64
_APART = 3.0
_MOST = 0.99
_TAPER = 0.1


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
    """The frequency below which the position moved while it was fitted [Hz]; infinite if all contacts are too short.

    Below it lies 99 % of the energy of the probe's speed in the contacts (the longest, where they are many), as far as
    that stands above the position's own noise. Where a clean spectrum at last meets its floor is far above that, and no
    motion.
    """
    chain, rows = motion.chain, motion.rows
    rows = chain.instants[rows].astype(np.intp) if isinstance(chain, SensorPath) else rows
    step = np.diff(rows)
    contacts = np.split(rows, np.flatnonzero(step > _APART * np.median(step)) + 1)
    stretches = [motion.position[own[0] : own[-1] + 1] for own in contacts]
    told = [stretch for stretch in sorted(stretches, key=len)[-_CONTACTS:] if len(stretch) >= _FEWEST_SEGMENT]
    if not told:
        return float("inf")
    spectra = [_energy(stretch) for stretch in told]
    frequency, energy = (np.concatenate(parts) for parts in zip(*spectra, strict=True))
    order = np.argsort(frequency, kind="stable")
    below = np.cumsum(energy[order])
    least = 1 / max(map(len, told))
    return max(float(frequency[order][np.searchsorted(below, _MOST * below[-1])]), least) / chain.dt


def _energy(position: Array) -> tuple[Array, Array]:
    """Of the speed in a stretch by frequency [1/sample], where it stands above the noise; both of shape (l,)."""
    speed = np.diff(position)
    frequency, power = periodogram(speed, _TAPER)
    noise = position_noise([position])
    floor = 2 * (noise.jump**2 + noise.white**2 * 4 * np.sin(np.pi * frequency) ** 2)
    return frequency, np.where(power > _ABOVE_FLOOR * floor, power, 0.0) * len(speed) / len(frequency)
