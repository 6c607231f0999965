"""Residual of a model by frequency, and a test whether it is noise."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.arrays import AnyArray, Array, Mask
from palpate.identification.filters import ORDER
from palpate.identification.result import Identification, Traces
from palpate.signals.samples import GAUSSIAN

_SHORTEST = 16
"""Rows of a stretch: with fewer, a Hann window leaves less than an octave between its own width and Nyquist's."""
_PER_OCTAVE = 3
_FEWEST_BINS = 3
"""Of a band: by fewer, its power is known to worse than a factor of two, one standard deviation."""
_SEEN = 1.25
"""Where the filter chain has taken all but a hundredth of the power, as a share of its cut-off."""
_FEWEST_TESTED = 30
"""Residuals for a test of whiteness: below, the sum of squares of the correlations is not yet chi-square."""
_LAGS = 20
"""Autocorrelations that the test sums, at most."""
_PASSED = 0.5
"""Up to this share of its cut-off the chain passes more than half of the amplitude."""
_HANN = 35 / 18
"""Bins of a Hann window's spectrum that are worth one independent value: N sum w^4 / (sum w^2)^2 of the window w."""
_FORGOTTEN = 3.2
"""Periods of the cut-off after which what was before has left the filter chain but for 2e-5 of it."""


@dataclass(frozen=True)
class Spectrum:
    """Power by bands of a third of an octave.

    Args:
        frequency: middle of each band [Hz], shape (k,).
        width: of each band [Hz], shape (k,).
        density: mean power density in each [unit^2/Hz], shape (k,).
        freedom: degrees of freedom of each, shape (k,).
    """

    frequency: Array
    width: Array
    density: Array
    freedom: Array

    @property
    def amplitude(self) -> Array:
        """Root mean square of the signal in each band, shape (k,)."""
        return np.sqrt(self.density * self.width)

    @property
    def power(self) -> float:
        """Mean square of the signal in all bands."""
        return float(self.density @ self.width)


def spectrum(values: Array, time: Array, cutoff: float = np.inf) -> Spectrum | None:
    """Spectrum of a signal over its unbroken stretches, the long ones counting for more; None if all are short.

    Each stretch is freed of its straight line and tapered, so that a press that ends elsewhere than it began does not
    fill the whole band.

    Args:
        values: shape (n,).
        time: of each [s], evenly spaced but for gaps, shape (n,).
        cutoff: of the filter chain that the signal has passed [Hz]; what it leaves nothing of is left out.
    """
    pieces = [piece for piece in stretches(time) if piece.stop - piece.start >= _SHORTEST]
    if not pieces:
        return None
    dt = float(np.median(np.diff(time)))
    bins = [_periodogram(values[piece], dt) for piece in pieces]
    frequency = np.concatenate([f for f, _ in bins])
    density = np.concatenate([p for _, p in bins])
    seen = frequency <= _SEEN * cutoff if np.isfinite(cutoff) else np.ones(len(frequency), bool)
    return _band_means(frequency[seen], density[seen]) if seen.sum() >= 2 * _FEWEST_BINS else None


def _band_means(frequency: Array, density: Array) -> Spectrum:
    """Means over bands of a third of an octave, or more where that holds too few bins.

    A stretch has as many bins in a band as it is long, so that a plain mean over bins weighs it by its length.
    """
    order = np.argsort(frequency)
    frequency, density = frequency[order], density[order]
    band = np.floor(_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9).astype(int)
    count = np.bincount(band)
    starts, held = [0], 0
    for k, more in enumerate(count):
        if held >= _FEWEST_BINS:
            starts.append(int(count[:k].sum()))
            held = 0
        held += int(more)
    if held < _FEWEST_BINS and len(starts) > 1:
        starts.pop()
    ends = [*starts[1:], len(frequency)]
    size = np.diff([*starts, len(frequency)])
    edges = np.array(
        [0.5 * frequency[0], *(np.sqrt(frequency[s - 1] * frequency[s]) for s in starts[1:]), frequency[-1]]
    )
    return Spectrum(
        np.array([np.exp(np.log(frequency[a:b]).mean()) for a, b in zip(starts, ends, strict=True)]),
        np.diff(edges),
        np.add.reduceat(density, starts) / size,
        2 * size / _HANN,
    )


def stretches(time: Array) -> list[slice]:
    """The parts of a time without gaps, as slices."""
    if len(time) < 2:
        return []
    step = np.diff(time)
    cuts = np.flatnonzero(step > 1.5 * np.median(step)) + 1
    edges = [0, *cuts.tolist(), len(time)]
    return [slice(a, b) for a, b in pairwise(edges)]


def _periodogram(values: Array, dt: float) -> tuple[AnyArray, Array]:
    """Frequencies above 0 [Hz] and one-sided power density there, freed of a line and tapered (Hann)."""
    n = len(values)
    ramp = np.arange(n) - (n - 1) / 2
    centred = values - values.mean()
    centred = centred - ramp * float(centred @ ramp) / float(ramp @ ramp)
    window = np.hanning(n + 2)[1:-1]
    power = np.abs(np.fft.rfft(centred * window)) ** 2 * 2 * dt / float(window @ window)
    return np.fft.rfftfreq(n, dt)[1:], power[1:]


def white(left: Spectrum, cutoff: float, level: float = 0.95) -> tuple[Array, Array, Array]:
    """White noise of the same power behind the filter chain: density, and its 95 % band.

    Args:
        left: spectrum of the residuals.
        cutoff: of the chain [Hz]; not finite if there is none.
        level: share of the values in the band.

    Returns:
        Density expected, and the lower and the upper end of the band, each of shape (k,).
    """
    from scipy.special import gammaincinv

    gain = _gain(left.frequency, cutoff)
    expected = gain * left.power / float(gain @ left.width)
    tail = (1 - level) / 2
    low, high = (2 * gammaincinv(left.freedom / 2, q) / left.freedom for q in (tail, 1 - tail))
    return expected, expected * low, expected * high


def leaving(found: Identification, traces: Traces) -> Spectrum | None:
    """Spectrum of what the model leaves."""
    return spectrum(traces.fitted_force - traces.predicted, traces.fitted_time, band_of(found, traces))


def resting(found: Identification, traces: Traces) -> Spectrum | None:
    """Spectrum of the force out of contact: what the sensor's noise is; None if too little of it is in the log."""
    free = _free(found, traces)
    return spectrum(traces.force[free], traces.time[free], found.cutoff)


def over_noise(found: Identification, traces: Traces) -> float | None:
    """How many times the usual noise out of contact the misfit is; None if too little of that is in the log."""
    quiet = traces.force[_free(found, traces)]
    if len(quiet) < _FEWEST_TESTED:
        return None
    noise = GAUSSIAN * float(np.median(np.abs(quiet - np.median(quiet))))
    return found.rmse / noise if noise > 0 else None


def _free(found: Identification, traces: Traces) -> Mask:
    """Where the filters have forgotten every contact; nowhere if the fitted samples passed no filters."""
    time, apart = traces.time, _FORGOTTEN / found.cutoff
    free = np.zeros(len(time), bool)
    if traces.matched or len(time) < _SHORTEST or np.median(np.diff(time)) > 1 / (4 * found.cutoff):
        return free
    free[int(np.searchsorted(time, time[0] + apart)) :] = True
    for start, end in found.contacts:
        free &= (time < start - apart) | (time > end + apart)
    return free


def band_of(found: Identification, traces: Traces) -> float:
    """Cut-off of the filter chain that the fitted samples have passed [Hz], infinite if they have passed none."""
    return np.inf if traces.matched else found.cutoff


def _ljung_box(residuals: Array) -> float:
    """Probability of first autocorrelations as large as those of evenly spaced residuals, if they are white (1978)."""
    from scipy.special import chdtrc

    n = len(residuals)
    lags = max(min(_LAGS, n // 5), 1)
    e = residuals - residuals.mean()
    power = float(e @ e)
    if power == 0:
        return 1.0
    r = np.array([e[k:] @ e[:-k] for k in range(1, lags + 1)]) / power
    return float(chdtrc(lags, n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1)))))


def whiteness_of(found: Identification, traces: Traces) -> float | None:
    """Probability of residuals as far from white as these if they were white; None for too few of them.

    Of the force sensor's own samples by Ljung and Box. Behind a filter chain by Bartlett's cumulative periodogram,
    divided by the chain's gain, over the frequencies that the chain passes well.
    """
    left = traces.fitted_force - traces.predicted
    pieces = [left[piece] for piece in stretches(traces.fitted_time)]
    if traces.matched:
        return _ljung_box(np.concatenate(pieces)) if len(left) >= _FEWEST_TESTED else None
    dt = float(np.median(np.diff(traces.fitted_time))) if pieces else 0.0
    bins = [_periodogram(piece, dt) for piece in pieces if len(piece) >= _SHORTEST]
    if not bins:
        return None
    frequency, density = (np.concatenate(parts) for parts in zip(*bins, strict=True))
    passed = frequency <= _PASSED * found.cutoff
    return _bartlett(frequency[passed], density[passed] / _gain(frequency[passed], found.cutoff))


def _bartlett(frequency: Array, density: Array) -> float | None:
    """Kolmogorov and Smirnov's test of whether power grows evenly with the frequency."""
    from scipy.special import kolmogorov

    if len(frequency) < _FEWEST_TESTED // 2 or not density.any():
        return None
    cumulated = np.cumsum(density[np.argsort(frequency)])[:-1] / density.sum()
    even = np.arange(1, len(cumulated) + 1) / len(density)
    independent = len(cumulated) / _HANN
    return float(kolmogorov(np.sqrt(independent) * np.abs(cumulated - even).max()))


def _gain(frequency: Array, cutoff: float) -> Array:
    """Of the filter chain, in power; one if there is none."""
    return (1 + (frequency / cutoff) ** 2) ** -ORDER if np.isfinite(cutoff) else np.ones(len(frequency))
