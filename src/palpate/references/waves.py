"""Excitations that are added to a desired force: a chirp, or a multisine."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array


class Chirp(NamedTuple):
    """A sine that sweeps from one frequency to another, once; its phase is the exact integral of its frequency.

    Args:
        low: frequency at the start [Hz].
        high: at the end [Hz].
        seconds: from the one to the other; zero afterwards.
        amplitude: unit of the signal.
        logarithmic: the frequency grows by the same factor each second, not by the same difference.
    """

    low: float
    high: float
    seconds: float
    amplitude: float
    logarithmic: bool = False

    def at(self, time: Array) -> Array:
        """The signal at times [s], shape (n,)."""
        inside = (time >= 0.0) & (time <= self.seconds)
        return np.where(inside, self.amplitude * np.sin(2.0 * math.pi * self._turns(time)), 0.0)

    def _turns(self, time: Array) -> Array:
        """Periods since the start."""
        if not self.logarithmic or self.low == self.high:
            return (self.low + 0.5 * (self.high - self.low) * time / self.seconds) * time
        growth = math.log(self.high / self.low) / self.seconds
        return self.low / growth * np.expm1(growth * np.clip(time, 0.0, self.seconds))


class Multisine(NamedTuple):
    """Sines side by side: sum of a sin(2 pi f t + phase).

    Args:
        frequencies: [Hz], shape (m,).
        amplitudes: unit of the signal, shape (m,).
        phases: at the start [rad], shape (m,).
    """

    frequencies: tuple[float, ...]
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]

    def at(self, time: Array) -> Array:
        """The signal at times [s], shape (n,)."""
        total = np.zeros(len(time))
        for f, a, phase in zip(self.frequencies, self.amplitudes, self.phases, strict=True):
            total += a * np.sin(2.0 * math.pi * f * time + phase)
        return total
