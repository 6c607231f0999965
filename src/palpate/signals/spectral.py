"""Detrending, convolution, quadrature and the periodogram of one evenly sampled signal, by `scipy.fft`.

`scipy.signal` has all four, but its import takes longer than the identification of a log.
"""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array

_SHORT = 256
"""Taps below which a direct convolution is the faster one."""


def detrend(values: Array) -> Array:
    """Values less their straight line of least squares, shape (n,)."""
    u = np.arange(len(values)) - (len(values) - 1) / 2
    mean = float(np.mean(values))
    return values - mean - u * float(u @ values) / max(float(u @ u), 1.0)


def convolve(signal: Array, taps: Array) -> Array:
    """The full convolution, shape (n + m - 1,)."""
    if len(taps) <= _SHORT:
        return np.convolve(signal, taps)
    from scipy.fft import irfft, next_fast_len, rfft

    count = len(signal) + len(taps) - 1
    size = next_fast_len(count, real=True)
    found: Array = irfft(rfft(signal, size) * rfft(taps, size), size)[:count]
    return found


def quadrature(values: Array) -> Array:
    """Values a quarter of a period later at every frequency (Hilbert transform), zeros beyond the ends, shape (n,)."""
    from scipy.fft import irfft, next_fast_len, rfft

    size = next_fast_len(2 * len(values))
    lines = -1j * rfft(values, size)
    lines[0] = 0.0
    if size % 2 == 0:
        lines[-1] = 0.0
    found: Array = irfft(lines, size)[: len(values)]
    return found


def periodogram(values: Array, taper: float) -> tuple[Array, Array]:
    """Frequency [1/sample] and one-sided power density [1/(1/sample)] of a signal less its mean, shape (l,) each.

    Args:
        values: shape (n,).
        taper: share of the signal in the cosine ends of the window (Tukey, 1967).
    """
    from scipy.fft import next_fast_len, rfft

    n = len(values)
    window = _tukey(n + 1, taper)[:n]  # of one period
    size = next_fast_len(n, real=True)
    power = np.abs(rfft((values - values.mean()) * window, size)) ** 2 / float(window @ window)
    power[1 : len(power) - (size % 2 == 0)] *= 2
    return np.arange(len(power)) / size, power


def _tukey(n: int, taper: float) -> Array:
    """A window whose ends rise as half a cosine."""
    width = int(taper * (n - 1) / 2)
    window = np.ones(n)
    rise = 0.5 * (1 - np.cos(2 * np.pi * np.arange(width + 1) / (taper * (n - 1))))
    window[: width + 1] = rise
    window[n - width - 1 :] = rise[::-1]
    return window
