"""Digital filters as parts: coefficients from the book, and one sample a step.

All steps use operators only: a sample may be a number, a `Vec3` or an array. `start_at(u)` is the state after
a constant u for ever; `start()` is that of zero. The lag is the group delay at zero frequency.
"""

import math
from typing import Any, NamedTuple

from palpate._jit import law, part
from palpate.signals.types import coerce_fields, require


class BiquadState(NamedTuple):
    """The two delayed sums of the transposed direct form II."""

    s1: Any
    s2: Any


@part
@coerce_fields()
class Biquad(NamedTuple):
    """y_k = b0 u_k + b1 u_(k-1) + b2 u_(k-2) - a1 y_(k-1) - a2 y_(k-2), signs as scipy.signal's.

    Args:
        b0, b1, b2: numerator.
        a1, a2: denominator 1 + a1 z^-1 + a2 z^-2.
        rate: steps a second [Hz].
    """

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float
    rate: float

    def start(self):
        return BiquadState(0.0, 0.0)

    def start_at(self, u):
        """The state after u for ever."""
        y = ((self.b0 + self.b1 + self.b2) / (1.0 + self.a1 + self.a2)) * u
        s2 = self.b2 * u - self.a2 * y
        return BiquadState(self.b1 * u - self.a1 * y + s2, s2)

    def step(self, state, u):
        y = self.b0 * u + state.s1
        return y, BiquadState(self.b1 * u - self.a1 * y + state.s2, self.b2 * u - self.a2 * y)

    @property
    def lag(self):
        """Group delay at zero frequency [s]."""
        numerator = (self.b1 + 2.0 * self.b2) / (self.b0 + self.b1 + self.b2)
        denominator = (self.a1 + 2.0 * self.a2) / (1.0 + self.a1 + self.a2)
        return (numerator - denominator) / self.rate


class CascadeState(NamedTuple):
    """The states of both stages."""

    first: BiquadState
    second: BiquadState


@part
class Cascade(NamedTuple):
    """Two sections in series."""

    first: Biquad
    second: Biquad

    def start(self):
        return CascadeState(self.first.start(), self.second.start())

    def start_at(self, u):
        """The state after u for ever; the sections pass a constant unchanged."""
        return CascadeState(self.first.start_at(u), self.second.start_at(u))

    def step(self, state, u):
        between, first = self.first.step(state.first, u)
        y, second = self.second.step(state.second, between)
        return y, CascadeState(first, second)

    @property
    def lag(self):
        """Group delay at zero frequency [s]."""
        return self.first.lag + self.second.lag


def lowpass1(cutoff: float, rate: float) -> Biquad:
    """First-order low-pass, cut-off and rate [Hz]; bilinear transform, prewarped at the cut-off."""
    w = _prewarp(cutoff, rate)
    return Biquad(w / (1 + w), w / (1 + w), 0.0, (w - 1) / (1 + w), 0.0, rate)


def lowpass2(frequency: float, quality: float, rate: float) -> Biquad:
    """Second-order low-pass of natural frequency [Hz] and quality factor; bilinear, prewarped there."""
    require(quality > 0, "quality", "above 0", quality)
    w = _prewarp(frequency, rate)
    scale = 1 + w / quality + w * w
    b = w * w / scale
    return Biquad(b, 2 * b, b, 2 * (w * w - 1) / scale, (1 - w / quality + w * w) / scale, rate)


def butterworth2(cutoff: float, rate: float) -> Biquad:
    """Second-order Butterworth low-pass, cut-off and rate [Hz]."""
    return lowpass2(cutoff, math.sqrt(0.5), rate)


def butterworth3(cutoff: float, rate: float) -> Cascade:
    """Third-order Butterworth low-pass: poles at -w and at w exp(+-2 pi j/3)."""
    return Cascade(lowpass1(cutoff, rate), lowpass2(cutoff, 1.0, rate))


def _prewarp(cutoff: float, rate: float) -> float:
    """tan(pi cutoff/rate): what the bilinear transform puts at the cut-off, in units of twice the rate."""
    require(0 < cutoff < rate / 2, "cut-off", f"between 0 and half the rate ({rate / 2:g} Hz)", cutoff)
    return math.tan(math.pi * cutoff / rate)


class Channel(NamedTuple):
    """A signal and its derivatives, all through the same filter."""

    value: Any
    rate: Any
    second: Any


class StateVariableState(NamedTuple):
    """State of the two trapezoidal integrators."""

    i1: Any
    i2: Any


@part
@coerce_fields()
class StateVariable(NamedTuple):
    """Low-pass F(s) = w^2/(s^2 + w s/quality + w^2) whose one step gives F u, s F u and s^2 F u.

    The three have one denominator, s = (2/T)(z-1)/(z+1) in each, so that a relation f = M a + B v + K x among
    signals holds exactly among their channels (Zavalishin, The Art of VA Filter Design, 2012, ch. 4).

    Args:
        g: tan(pi cutoff/rate).
        damping: 1/quality.
        rate: steps a second [Hz].
    """

    g: float
    damping: float
    rate: float

    def start(self):
        return StateVariableState(0.0, 0.0)

    def start_at(self, u):
        """The state after u for ever."""
        return StateVariableState(0.0 * u, u)

    def step(self, state, u):
        g = self.g
        w = 2.0 * self.rate * g
        high = (1.0 / (1.0 + g * (g + self.damping))) * (u - (self.damping + g) * state.i1 - state.i2)
        band = g * high + state.i1
        low = g * band + state.i2
        return Channel(low, w * band, w * w * high), StateVariableState(g * high + band, g * band + low)

    @property
    def lag(self):
        """Group delay at zero frequency [s]: damping / w."""
        return self.damping / (2.0 * self.rate * self.g)


def state_variable(cutoff: float, rate: float, quality: float = math.sqrt(0.5)) -> StateVariable:
    """A state-variable filter of cut-off and rate [Hz]; Butterworth unless another quality is given."""
    require(quality > 0, "quality", "above 0", quality)
    return StateVariable(_prewarp(cutoff, rate), 1.0 / quality, rate)


class History(NamedTuple):
    """The last samples, the newest first."""

    h0: Any
    h1: Any
    h2: Any
    h3: Any
    h4: Any
    h5: Any
    h6: Any
    h7: Any
    h8: Any
    h9: Any


@part
@coerce_fields(
    lambda self: require(0 <= self.samples <= 9, "samples of delay", "between 0 and 9", self.samples)
)
class Delay(NamedTuple):
    """A delay of 0 to 9 samples, whole or not: linear interpolation between two samples.

    Args:
        samples: the delay in samples.
        rate: steps a second [Hz].
    """

    samples: float
    rate: float

    def start(self):
        return self.start_at(0.0)

    def start_at(self, u):
        """The state after u for ever."""
        return History(u, u, u, u, u, u, u, u, u, u)

    def step(self, state, u):
        history = recall(state, u)
        return between(history, self.samples), history

    @property
    def lag(self):
        """Lag of the filter at zero frequency [s]."""
        return self.samples / self.rate


def delay(seconds: float, rate: float) -> Delay:
    """A delay of so many seconds."""
    return Delay(seconds * rate, rate)


@law
def recall(h, u):
    """The history with u as its newest sample."""
    return History(u, h.h0, h.h1, h.h2, h.h3, h.h4, h.h5, h.h6, h.h7, h.h8)


@law
def between(samples, index):
    """The value at an index that need not be whole, linear between neighbours."""
    i = min(int(index), len(samples) - 2)
    part_of_next = index - i
    return (1.0 - part_of_next) * samples[i] + part_of_next * samples[i + 1]
