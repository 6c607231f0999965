"""Low-passes of a force sensor before its sampling, in continuous time, and readings of a signal through them.

The weights of a reading at any instant between the samples are those of the ideal band-limited one, y(t) = 1/(2 pi)
integral of W(w) (jw)^d H(jw) e^(jwt) X(w) dw: H is the low-pass, and W passes all below a quarter of the sampling rate
and nothing above a half. W falls so smoothly that the weights die away fast on both sides.
"""

import re
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import pi, sin

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError

_HIGHEST_ORDER = 10
"""Highest order of a Butterworth filter; sensors and their drivers have one to four."""
_SECTION = re.compile(r"butterworth(\d+):(-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?:hz)?")
_FORM = "butterworth3:120 (order and cut-off in Hz), several joined by '+', or none"


@dataclass(frozen=True)
class LowPass:
    """Butterworth low-passes one after the other.

    Args:
        sections: order and cut-off [Hz] of each; none at all passes everything.
    """

    sections: tuple[tuple[int, float], ...] = ()

    def __post_init__(self) -> None:
        for order, cutoff in self.sections:
            if not 1 <= order <= _HIGHEST_ORDER:
                raise InputError(f"a low-pass has an order of 1 to {_HIGHEST_ORDER}, got {order}")
            if not 0 < cutoff < np.inf:
                raise InputError(f"a low-pass needs a cut-off above 0 Hz, got {cutoff:g}")

    @classmethod
    def parse(cls, text: str) -> "LowPass":
        """The low-passes that a text names: `butterworth3:120`, `butterworth3:120+butterworth2:120`, or `none`.

        Raises:
            InputError: another text, an order or a cut-off out of range.
        """
        word = text.strip().lower().replace(" ", "")
        if word == "none":
            return cls()
        sections = [_SECTION.fullmatch(section) for section in re.split(r"\+(?=b)", word)]
        if not all(sections):
            raise InputError(f"a force filter is given as {_FORM}; got {text!r}")
        return cls(tuple((int(section[1]), float(section[2])) for section in sections if section))

    @classmethod
    def of_first_order(cls, time: float, count: int = 1) -> "LowPass":
        """Equal low-passes of first order, whose time constants add up to a time [s]."""
        return cls(((1, count / (2 * pi * time)),) * count)

    def __str__(self) -> str:
        return "+".join(f"butterworth{order}:{cutoff:.12g}" for order, cutoff in self.sections) or "none"

    @property
    def lag(self) -> float:
        """Delay of slow signals [s]: 1/(w sin(pi/2n)) for order n."""
        return sum(1 / (2 * pi * cutoff * sin(pi / (2 * order))) for order, cutoff in self.sections)

    @property
    def decay(self) -> float:
        """Rate at which the slowest mode of it dies away [1/s]; infinite where there is no low-pass."""
        rates = [2 * pi * cutoff * sin(pi / (2 * order)) for order, cutoff in self.sections]
        return min(rates, default=float("inf"))

    @property
    def roll_off(self) -> int:
        """Number of derivatives of a signal that come through without growing with the frequency."""
        return sum(order for order, _ in self.sections)

    @property
    def cutoff(self) -> float:
        """The lowest cut-off [Hz]; infinite where there is no low-pass."""
        return min((cutoff for _, cutoff in self.sections), default=float("inf"))

    def at(self, omega: Array) -> NDArray[np.complex128]:
        """The complex gain at angular frequencies [rad/s], of their shape."""
        gain = np.ones(np.shape(omega), complex)
        for order, cutoff in self.sections:
            s = 1j * omega / (2 * pi * cutoff)
            for k in range(order):
                gain /= s - np.exp(1j * pi * (2 * k + order + 1) / (2 * order))
        return gain


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
        """Number of samples that are needed after the instant's own."""
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
    for i, offset in enumerate(places):
        shifted = gain * np.exp(1j * omega * offset)
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
    """Number of samples before and after an instant whose weights count."""
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
    cell = np.round(instants * FRACTIONS).astype(np.int64)
    sample = cell // FRACTIONS
    part = cell % FRACTIONS
    first = np.clip(sample - weights.before + count, 0, len(windows) - 1)
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
    """Apply one set of weights at every sample, shape (derivatives, windows)."""
    size = 1 << (len(padded) - 1).bit_length()
    spectrum = np.fft.rfft(padded, size)
    spectra = np.conj(np.fft.rfft(rows, size))  # a correlation, not a convolution
    count = len(padded) - rows.shape[1] + 1
    return np.stack([np.fft.irfft(spectrum * row, size)[:count] for row in spectra])
