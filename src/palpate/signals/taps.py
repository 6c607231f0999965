"""Reading a sampled signal through a low-pass, or a derivative of it, at any instant between its samples.

The weights are those of the ideal band-limited reading, y(t) = 1/(2 pi) integral of W(w) (jw)^d H(jw) e^(jwt) X(w) dw:
H is the low-pass in continuous time, and W passes all below a quarter of the sampling rate and nothing above a half.
W falls so smoothly that the weights die away fast on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.signals.low_pass import LowPass

FRACTIONS = 1024
"""Places between two samples for which weights are kept: an instant is rounded by at most half of 1/1024."""
_FLAT, _END = 0.25, 0.5
_NEGLIGIBLE = 1e-6
_MANY = 8


@dataclass(frozen=True)
class Taps:
    """Weights of the samples around an instant.

    Args:
        weights: shape (FRACTIONS + 1, derivatives, taps), for the derivatives 0, 1, ... in samples, not seconds.
        before: how many samples before the instant's own the first weight belongs to; the weights go forward in time.
    """

    weights: Array
    before: int

    @property
    def after(self) -> int:
        """How many samples after the instant's own are needed."""
        return self.weights.shape[2] - 1 - self.before


@lru_cache(maxsize=8)
def taps(low_pass: LowPass, dt: float, derivatives: int) -> Taps:
    """The weights for a low-pass and a sampling period [s], for the derivatives 0 to `derivatives` - 1."""
    span = _span(low_pass, dt)
    omega: Array = 2 * np.pi * np.fft.rfftfreq(span).astype(np.float64)  # rad a sample
    gain = _taper(omega / (2 * np.pi)) * low_pass.at(omega / dt)
    places = np.arange(FRACTIONS + 1) / FRACTIONS
    before, after = _reach(gain, span)
    window = np.arange(before, -after - 1, -1) % span
    weights = np.empty((len(places), derivatives, len(window)))
    for i, place in enumerate(places):
        shifted = gain * np.exp(1j * omega * place)
        for d in range(derivatives):
            weights[i, d] = np.fft.irfft(shifted * (1j * omega) ** d, span)[window]
    weights[:, 0] /= weights[:, 0].sum(axis=1, keepdims=True)
    weights[:, 1:] -= weights[:, 1:].mean(axis=2, keepdims=True)  # no derivative of a signal at rest
    weights.setflags(write=False)
    return Taps(weights, before)


def _span(low_pass: LowPass, dt: float) -> int:
    """Samples, a power of two, over which the low-pass forgets by 16 powers of e four times over."""
    memory = 64 / (low_pass.decay * dt)
    return 1 << int(np.ceil(np.log2(np.clip(memory, 512, 1 << 16))))


def _reach(gain: NDArray[np.complex128], span: int) -> tuple[int, int]:
    """How many samples before and after an instant have weights that count."""
    size = np.abs(np.fft.irfft(gain, span))
    counts = np.flatnonzero(size > _NEGLIGIBLE * size.max())
    counts = np.where(counts > span // 2, counts - span, counts)
    return int(counts.max()) + 1, int(-counts.min()) + 1


def _taper(frequency: Array) -> Array:
    """1 up to a quarter of the sampling rate, 0 from a half on, and all derivatives continuous between."""
    u = np.clip((frequency - _FLAT) / (_END - _FLAT), 1e-9, 1 - 1e-9)
    return 1 / (1 + np.exp(np.clip(1 / (1 - u) - 1 / u, -700, 700)))


def read(signal: Array, instants: Array, weights: Taps) -> Array:
    """The filtered signal and its derivatives [1/sample^d] at instants counted in samples.

    Args:
        signal: shape (n,); at rest before its first and after its last sample.
        instants: shape (m,).
        weights: of the low-pass.

    Returns:
        Shape (derivatives, m).
    """
    count = weights.weights.shape[2]
    level = float(signal[0])
    padded = np.pad(signal - level, count, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, count)
    few = len(windows) // _MANY
    place = np.round(instants * FRACTIONS).astype(np.int64)
    whole, part = place // FRACTIONS, place % FRACTIONS
    first = np.clip(whole - weights.before + count, 0, len(windows) - 1)
    out = np.empty((weights.weights.shape[1], len(instants)))
    order = np.argsort(part, kind="stable")
    edges = np.flatnonzero(np.diff(part[order], prepend=-1, append=FRACTIONS))
    for begin, end in pairwise(edges):
        own = order[begin:end]
        rows = weights.weights[part[own[0]]]
        if len(own) > few:
            out[:, own] = _everywhere(padded, rows)[:, first[own]]
        else:
            out[:, own] = rows @ windows[first[own]].T
    out[0] += level
    return out


def _everywhere(padded: Array, rows: Array) -> Array:
    """The same weights at every sample, shape (derivatives, windows)."""
    size = 1 << (len(padded) - 1).bit_length()
    spectrum = np.fft.rfft(padded, size)
    turned = np.conj(np.fft.rfft(rows, size))  # a correlation, not a convolution
    count = len(padded) - rows.shape[1] + 1
    return np.stack([np.fft.irfft(spectrum * row, size)[:count] for row in turned])
