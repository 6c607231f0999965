"""Cramer-Rao bound of K, B, M, offset and lag from a force sensor's readings of a known motion.

The force f = M a + B v + K x + offset passes the sensor's continuous low-pass H, is sampled at the sensor's own rate,
and each sample carries white noise. With theta = (K, B, M, offset, lag) a sample at t is, noise aside,

    g(t) = (h * (M a + B v + K x))(t - lag) + offset,    dg/dK = h * x, ...,    dg/dlag = -g'(t),

and the information is J'J / noise^2, plus 1/std^2 for what is known beforehand (Van Trees, 1968, sec. 2.4).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.excitation.sensors import ForceChain
from palpate.signals import Estimate
from palpate.signals.low_pass import LowPass

Array = NDArray[np.float64]

NAMES = ("K", "B", "M", "offset", "lag")
"""Parameters of the bound, in this order."""

_ROUNDING = 1e-13  # of the scaled information; a direction with less is one that nothing is known of


def cramer_rao_bound(
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
    """
    std = {"lag": 0.0, **(known or {})}
    at = instants(time, chain.sampling, span)
    columns = sensitivities(time, penetration, truth, chain.low_pass, at) / chain.noise
    prior = np.array([std.get(name, np.inf) for name in NAMES])
    theta = np.array([float(truth.get(name, 0.0)) for name in NAMES])
    return Estimate(NAMES, theta, _covariance(columns, prior, chain.phase_std), float(len(at)))


def instants(time: Array, sampling: float, span: tuple[float, float] | None = None) -> Array:
    """The multiples of 1/sampling within the time of a motion, or within a span of it [s]."""
    first, last = (time[0], time[-1]) if span is None else span
    first, last = max(first, time[0]), min(last, time[-1])
    at = np.arange(np.ceil(first * sampling - 1e-9), np.floor(last * sampling + 1e-9) + 1) / sampling
    return np.clip(at, time[0], time[-1])


def sensitivities(
    time: Array, penetration: Array, truth: Mapping[str, float], low_pass: LowPass, at: Array
) -> Array:
    """Derivatives of the filtered force by K, B, M, offset and lag at the instants `at` [s], shape (len(at), 5).

    Those of K, B and M times their values, summed, are the filtered force itself.
    """
    x, v, a, jerk = filter_at(time, penetration, low_pass, at)
    K, B, M = (float(truth.get(name, 0.0)) for name in ("K", "B", "M"))
    return np.column_stack([x, v, a, np.ones_like(at), -(K * v + B * a + M * jerk)])


def filter_at(time: Array, signal: Array, low_pass: LowPass, at: Array, derivatives: int = 4) -> Array:
    """A smooth signal through a continuous filter, and its derivatives, at any instants; shape (derivatives, len(at)).

    Exact for signals without content above half the grid's rate: the line between its ends is filtered by hand, what
    is left is continued oddly, which keeps value and slope continuous, and filtered as a Fourier series.
    """
    from scipy.interpolate import make_interp_spline

    dt = float(time[-1] - time[0]) / (len(time) - 1)
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
