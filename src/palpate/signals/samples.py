"""Sampled signals: fresh rows, unbroken runs, rounding, block means, white noise, detrending and spectra.

`scipy.signal` has the last ones too, but its import takes longer than the identification of a log; so `scipy.fft`.
"""

from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from palpate._jit import law
from palpate.arrays import Array, Indices, Mask

GAUSSIAN = 1.4826
"""Standard deviation of Gaussian noise over its median absolute deviation."""
_OUTLIERS = (0.1, 99.9)
"""Percentiles beyond which a reading may be an outlier."""
_LONG_JUMP = 4.0
"""Times the sensor's own resolution from which a step is a jump."""
_HELD_SHARE = 0.3
"""Pairs of jumps between which a reading may move all the same."""


def robust_std(deviations: Array) -> float:
    """Standard deviation of Gaussian noise from its deviations, shape (n,), by their median size; 0 of none."""
    return GAUSSIAN * float(np.median(np.abs(deviations))) if len(deviations) else 0.0


def outer_range(values: Array) -> tuple[float, float]:
    """Lowest and highest value, outliers left aside."""
    low, high = np.percentile(values, _OUTLIERS)
    return float(low), float(high)


def fresh_rows(values: Array) -> Mask | None:
    """Rows in which a channel, shape (n,), was refreshed; None if every row is.

    A value that repeats is no proof: a coarse or resting sensor repeats too. Held samples show in jumps that are many
    times the sensor's own resolution with exact repetitions right between them.
    """
    step = np.diff(values)
    changed = step != 0
    if changed.all() or changed.sum() < 10:
        return None
    sizes = np.abs(step[changed])
    resolution = float(np.percentile(sizes, 2))
    jumps = np.flatnonzero(np.abs(step) > max(_LONG_JUMP * resolution, float(np.median(sizes)) * 0.5))
    if len(jumps) < 10:
        return None
    apart = np.diff(jumps)
    usual = float(np.median(apart))
    if usual < 2 or not _quiet_between(changed, jumps, usual):
        return None
    fresh = np.r_[True, changed]
    return _refill(fresh, round(usual))


def _quiet_between(changed: Mask, jumps: Indices, usual: float) -> bool:
    """True if nothing at all moves between neighbouring jumps."""
    total = np.r_[0, np.cumsum(changed)]
    near = np.flatnonzero(np.diff(jumps) <= 2 * usual)
    if len(near) < 8:
        return False
    begin = jumps[near] + 1
    end = jumps[near + 1]
    still = (total[end] - total[begin]) == 0
    return bool(still.mean() > 1 - _HELD_SHARE)


def _refill(fresh: Mask, every: int) -> Mask:
    """Count a long stretch without change as fresh once per period: the channel may simply rest."""
    fresh = fresh.copy()
    marks = np.flatnonzero(fresh)
    ends = np.r_[marks[1:], len(fresh)]
    for begin, end in zip(marks[long := ends - marks >= 2 * every], ends[long], strict=True):
        fresh[begin:end:every] = True
    return fresh


def runs(inside: Mask) -> list[tuple[int, int]]:
    """First and past-the-last sample of each unbroken run within, in their order.

    Args:
        inside: shape (n,).
    """
    edges = np.diff(np.r_[0, np.asarray(inside).astype(np.int8), 0])
    return list(zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True))


# Adding this to a double leaves no bits below one: the sum is rounded to a whole number, ties to even. It
# works on numbers, vectors and arrays alike, up to 2^51 steps.
_WHOLE = 1.5 * 2.0**52


@law
def whole(u):
    """u to the nearest whole number."""
    return u + _WHOLE - _WHOLE


@law
def quantise(u, step):
    """u to the nearest multiple of step (mid-tread: zero is a level)."""
    return whole(u / step) * step


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
    filtered: Array = irfft(rfft(signal, size) * rfft(taps, size), size)[:count]
    return filtered


def recursive_filter(numerator: Array, denominator: Array, values: Array) -> Array:
    """y for which the convolution of the denominator with it is that of the numerator with values, from rest, (n,)."""
    from scipy.linalg import solve_banded

    n = len(values)
    bands = np.repeat(denominator[:, None], n, axis=1)
    filtered: Array = solve_banded((len(denominator) - 1, 0), bands, np.convolve(values, numerator)[:n])
    return filtered


def ranks(values: Array) -> Array:
    """Rank of each value, 1 the least; equal ones share the mean of theirs, shape (n,)."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - 0.5 * (count - 1))[place]


def coherent_share(source: Array, values: Array, rows: int) -> float:
    """Share of the power of values that a filter of the source accounts for, by coherence (Welch, 1967), 0 to 1.

    Args:
        source: shape (n,).
        values: shape (n,).
        rows: of a window; windows overlap by half.
    """
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(rows) / rows)

    def lines(signal: Array) -> Any:
        parts = sliding_window_view(signal, rows)[:: rows - rows // 2]
        return np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window)

    a, b = lines(source), lines(values)
    sides = np.full(a.shape[1], 2.0)
    sides[0] = 1.0
    if rows % 2 == 0:
        sides[-1] = 1.0
    power = np.sum(np.abs(a) ** 2, axis=0)
    shared = np.abs(np.sum(a.conj() * b, axis=0)) ** 2 / np.where(power > 0.0, power, np.inf)
    return float(sides @ shared / (sides @ np.sum(np.abs(b) ** 2, axis=0)))


def quadrature(values: Array) -> Array:
    """Values a quarter of a period later at every frequency (Hilbert transform), zeros beyond the ends, shape (n,)."""
    from scipy.fft import irfft, next_fast_len, rfft

    size = next_fast_len(2 * len(values))
    lines = -1j * rfft(values, size)
    lines[0] = 0.0
    if size % 2 == 0:
        lines[-1] = 0.0
    shifted: Array = irfft(lines, size)[: len(values)]
    return shifted


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


def white_noise(signal: Array) -> float:
    """Standard deviation of the white part of a signal, from its eighth differences.

    An upper bound: what is left of the motion itself in the differences counts as noise.
    """
    differences = np.diff(signal, 8)  # the sum of whose squared weights is 12870
    return float(GAUSSIAN * np.median(np.abs(differences)) / np.sqrt(12870)) if len(differences) else 0.0


def block_means(signal: Array, size: int) -> Array:
    """Means of neighbouring blocks of `size` samples, shape (n // size,); the rest at the end is dropped."""
    count = len(signal) // size
    return np.asarray(signal[: count * size].reshape(count, size).mean(axis=1))
