"""Phases that keep the peak of a sum of sines low, so that a force budget buys as much power as it can."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array

Complex = NDArray[np.complexfloating[Any, Any]]

_POINTS = 8  # of the period a cycle of the highest harmonic
_STARTS = 5
"""Random phases beside Schroeder's; the best peak of all is taken."""


def schroeder(powers: Array) -> Array:
    """Phases of a sum of sines by the share of power below each (Schroeder, IEEE Trans. IT 16, 1970), shape (F,).

    Each frequency follows the one before by as long as its power asks for: a chirp of the given spectrum.
    """
    share = powers / powers.sum()
    below = np.concatenate([[0.0], np.cumsum(share)[:-1]])
    return -2 * np.pi * np.cumsum(below)


def low_peak(amplitudes: Array, harmonics: NDArray[np.intp], rounds: int = 500) -> Array:
    """Phases under which sum a sin(2 pi h t/T + phase) peaks low, shape (F,).

    Schroeder's, and a few random ones, each improved by clipping the signal and keeping the phases of what is left
    (van der Ouderaa, Schoukens and Renneboog, IEEE Trans. IM 37, 1988); the lowest peak wins. The same amplitudes
    give the same phases.

    Args:
        amplitudes: shape (F,).
        harmonics: cycles in the period, whole numbers, rising, shape (F,).
        rounds: of clipping.
    """
    rng = np.random.default_rng(0)
    phases = np.vstack([schroeder(amplitudes**2), rng.uniform(0, 2 * np.pi, (_STARTS, len(amplitudes)))])
    lowest, best = np.full(len(phases), np.inf), phases.copy()
    for k in range(rounds):
        signal = summed(amplitudes * np.exp(1j * phases), harmonics)
        top = np.abs(signal).max(axis=1)
        better = top < lowest
        lowest[better], best[better] = top[better], phases[better]
        level = (top * (0.75 + 0.2 * k / rounds))[:, None]  # gently at the end
        phases = np.angle(1j * np.fft.rfft(np.clip(signal, -level, level))[:, harmonics])
    return best[np.argmin(lowest)]


def summed(phasors: Complex, harmonics: NDArray[np.intp], points: int = _POINTS) -> Array:
    """Sums over a period of sines of given phasors, Im sum p exp(2 pi j h t/T).

    Args:
        phasors: shape (..., F).
        harmonics: rising, shape (F,).
        points: instants a cycle of the highest harmonic, or a few more.

    Returns:
        At even instants, shape (..., n).
    """
    count = 1 << int(points * int(harmonics[-1])).bit_length()
    spectra = np.zeros((*phasors.shape[:-1], count // 2 + 1), complex)
    spectra[..., harmonics] = -0.5j * count * phasors
    return np.fft.irfft(spectra, count)
