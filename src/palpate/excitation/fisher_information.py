"""Fisher information and Cramer-Rao bound of a force sensor's readings of a known motion.

The chain: the force f = M a + B v + K x + offset passes the sensor's continuous low-pass H, is sampled at the
sensor's own rate, and each sample carries white noise of its own. A log that repeats a reading in several rows has
no more information for it. What is estimated is theta = (K, B, M, offset, lag); a sample at t is, noise aside,

    g(t) = (h * (M a + B v + K x))(t - lag) + offset,    dg/dK = h * x, ...,    dg/dlag = -g'(t),

and the information is J'J / noise^2, plus 1/std^2 for what is known beforehand (Van Trees, 1968, sec. 2.4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import gcd, sqrt

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.signals import Estimate
from palpate.signals.low_pass import LowPass

NAMES = ("K", "B", "M", "offset", "lag")
"""Parameters of the bound, in this order."""

THESIS_FILTER = LowPass(((3, 120.0),))
"""Of the thesis' sensor (sec. 3.4)."""

_ROUNDING = 1e-13  # of the scaled information; a direction with less is one that nothing is known of


@dataclass(frozen=True)
class ForceChain:
    """From the force on the sensor to the readings that carry information.

    Args:
        low_pass: before the sampling.
        sampling: independent samples a second [Hz].
        noise: standard deviation of a sample [N].
        phase_std: of the samples' instants, which the log leaves open [s]: see `phase_std`.
    """

    low_pass: LowPass = THESIS_FILTER
    sampling: float = 480.0
    noise: float = 0.6
    phase_std: float = 0.0

    def __post_init__(self) -> None:
        for name in ("sampling", "noise"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} of a force chain must be above 0, got {getattr(self, name)}")
        if not self.phase_std >= 0:
            raise InputError(f"phase_std must be at least 0 s, got {self.phase_std}")


def phase_std(sampling: int, rate: int) -> float:
    """Uncertainty of the sensor's sampling instants given the pattern of new rows: a standard deviation [s].

    Samples at `sampling` Hz, logged at `rate` Hz, fall on the instants of a grid of gcd/(sampling rate) between the
    rows; anywhere within one such step the log looks the same. 480 Hz in 1 kHz: 1/12 ms, a deviation of 24 us.
    """
    return gcd(sampling, rate) / (sampling * rate) / sqrt(12)


def bound(
    time: Array,
    penetration: Array,
    truth: Mapping[str, float],
    chain: ForceChain,
    *,
    known: Mapping[str, float] | None = None,
    span: tuple[float, float] | None = None,
) -> Estimate:
    """The Cramer-Rao bound of K, B, M, offset and lag for a motion known exactly.

    Args:
        time: evenly spaced [s], shape (n,): the rows of a record or the steps of the physics.
        penetration: true, smooth on that grid [m], shape (n,).
        truth: K [N/m], B [N s/m] and M [kg]; an omitted one is 0.
        chain: of the force sensor.
        known: standard deviation of the prior, by name: 0 is known exactly, inf (or left out) not at
            all. The lag is known exactly unless it is named here; the chain's `phase_std` is open in any case.
        span: first and last instant whose samples count [s]; all of the motion when left out.

    Returns:
        theta and covariance in the order of `NAMES`; a parameter that is known exactly has variance 0, one that the
        samples say nothing about an enormous one. `samples`: how many count.

    Raises:
        InputError: unknown names, uneven time, a span without samples.
    """
    std = {"lag": 0.0, **(known or {})}
    for name in (*std, *truth):
        if name not in NAMES:
            raise unknown("parameter", name, NAMES)
    at = instants(time, chain.sampling, span)
    columns = sensitivities(time, penetration, truth, chain.low_pass, at) / chain.noise
    prior = np.array([std.get(name, np.inf) for name in NAMES])
    theta = np.array([float(truth.get(name, 0.0)) for name in NAMES])
    return Estimate(NAMES, theta, _covariance(columns, prior, chain.phase_std), float(len(at)))


def instants(time: Array, sampling: float, span: tuple[float, float] | None = None) -> Array:
    """The multiples of 1/sampling within the time of a motion, or within a span of it [s].

    Raises:
        InputError: there are none.
    """
    first, last = (time[0], time[-1]) if span is None else span
    first, last = max(first, time[0]), min(last, time[-1])
    at = np.arange(np.ceil(first * sampling - 1e-9), np.floor(last * sampling + 1e-9) + 1) / sampling
    if not len(at):
        raise InputError(f"no sample of a sensor at {sampling:g} Hz lies between {first:g} and {last:g} s")
    return np.clip(at, time[0], time[-1])


def sensitivities(
    time: Array, penetration: Array, truth: Mapping[str, float], low_pass: LowPass, at: Array
) -> Array:
    """Derivatives of the filtered force by K, B, M, offset and lag at the instants `at` [s], shape (len(at), 5).

    Those of K, B and M times their values, summed, are the filtered force itself.
    """
    x, v, a, jerk = filtered(time, penetration, low_pass, at)
    K, B, M = (float(truth.get(name, 0.0)) for name in ("K", "B", "M"))
    return np.column_stack([x, v, a, np.ones_like(at), -(K * v + B * a + M * jerk)])


def filtered(time: Array, signal: Array, low_pass: LowPass, at: Array, derivatives: int = 4) -> Array:
    """A smooth signal through a continuous filter, and its derivatives, at any instants; shape (derivatives, len(at)).

    Exact for signals without content above half the grid's rate: the line between its ends is filtered by hand, what
    is left is continued oddly, which keeps value and slope continuous, and filtered as a Fourier series.

    Raises:
        InputError: time that is not even, or fewer than 8 points.
    """
    from scipy.interpolate import make_interp_spline

    dt = _even(time)
    slope = (signal[-1] - signal[0]) / (time[-1] - time[0])
    rest = signal - signal[0] - slope * (time - time[0])
    odd = np.concatenate([rest, -rest[-2:0:-1]])
    omega = (2 * np.pi * np.fft.rfftfreq(len(odd), dt)).astype(np.float64)
    spectrum: NDArray[np.complex128] = low_pass.at(omega) * np.fft.rfft(odd)
    lines = (signal[0] + slope * (at - time[0] - low_pass.lag), np.full_like(at, slope))
    found = []
    for k in range(derivatives):
        whole = np.fft.irfft(spectrum * (1j * omega) ** k, len(odd))[: len(time)]
        curve = make_interp_spline(time, whole, k=5)(at)
        found.append(curve + lines[k] if k < len(lines) else curve)
    return np.stack(found)


def _even(time: Array) -> float:
    if len(time) < 8:
        raise InputError(f"a motion needs at least 8 points, got {len(time)}")
    dt = (time[-1] - time[0]) / (len(time) - 1)
    if not dt > 0 or np.abs(np.diff(time) - dt).max() > 1e-3 * dt:
        raise InputError("the time of a motion must rise in even steps; put it on an even grid first")
    return float(dt)


def _covariance(columns: Array, prior: Array, phase: float) -> Array:
    """Inverse of the information about the five, the phase of the samples a sixth that moves them as the lag does."""
    all_columns = np.column_stack([columns, columns[:, -1]])
    std = np.append(prior, phase)
    free = np.flatnonzero(std > 0)
    used = all_columns[:, free]
    information = used.T @ used + np.diag(std[free] ** -2.0)
    scale = np.sqrt(np.diag(information))
    scale[scale == 0] = 1.0
    weights, axes = np.linalg.eigh(information / np.outer(scale, scale))
    inverse = (axes / np.maximum(weights, _ROUNDING * weights[-1])) @ axes.T / np.outer(scale, scale)
    covariance = np.zeros((len(std), len(std)))
    covariance[np.ix_(free, free)] = inverse
    return covariance[:-1, :-1]
