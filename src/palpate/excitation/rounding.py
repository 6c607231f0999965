"""Error of a position that an encoder rounds, along a designed motion.

The rounding of a motion is no white noise: a slow motion through few counts has its error where the motion itself is,
a repeated motion repeats it, and no time averages it out. So it is simulated: the motion is rounded from some places
of the encoder, and the errors of the parameters follow.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array

Complex = NDArray[np.complexfloating[Any, Any]]

PLACES = 24
"""Places of the encoder's counts under the motion that are tried, evenly spread."""


def error_of_period(motion: Complex, harmonics: NDArray[np.intp], readings: int, step: float) -> Complex:
    """Phasors of the error at all harmonics of a periodic motion [m], shape (places, readings // 2 + 1).

    Args:
        motion: phasors x = Im(X e^jwt) [m], shape (F,).
        harmonics: of the period, shape (F,).
        readings: in a period.
        step: of the encoder [m].
    """
    spectrum = np.zeros(readings // 2 + 1, complex)
    spectrum[harmonics] = -0.5j * readings * motion
    error = _rounded(np.fft.irfft(spectrum, readings), step)
    return np.asarray(2j / readings * np.fft.rfft(error, axis=-1))


def error_of_sweep(motion: Complex, omega: Array, seconds: float, rate: float, step: float) -> Complex:
    """Phasors of the error along a sweep [m], each of the stretch about its frequency, shape (places, F).

    Args:
        motion: phasors x = Im(X e^jwt) [m], shape (F,), one after the other for equal times.
        omega: their angular frequencies [rad/s], shape (F,).
        seconds: that the sweep lasts.
        rate: readings a second [Hz].
        step: of the encoder [m].
    """
    each = max(round(seconds * rate / len(omega)), 2)
    place = np.arange(len(omega) * each) / each - 0.5
    phase = np.exp(1j * np.cumsum(np.interp(place, np.arange(len(omega)), omega)) / rate)
    size = np.interp(place, np.arange(len(omega)), motion.real) + 1j * np.interp(
        place, np.arange(len(omega)), motion.imag
    )
    error = _rounded(np.imag(size * phase), step) * np.conj(phase)
    return np.asarray(2j / each * error.reshape(PLACES, len(omega), each).sum(axis=-1))


def _rounded(path: Array, step: float) -> Array:
    """Error that rounding adds to a path from each place of the encoder, shape (places, *path.shape)."""
    if not step > 0:
        return np.zeros((PLACES, *path.shape))
    place = step * (np.arange(PLACES) + 0.5).reshape(-1, *(1,) * path.ndim) / PLACES
    return np.asarray(step * np.round((path + place) / step) - place - path)
