"""Fisher information and Cramer-Rao bound of a force sensor's readings of a known motion.

The chain: the force f = M a + B v + K x + offset passes the sensor's continuous low-pass H, is sampled at the
sensor's own rate, and each sample carries white noise of its own. A log that repeats a reading in several rows has
no more information for it. What is estimated is theta = (K, B, M, offset, lag); a sample at t is, noise aside,

    g(t) = (h * (M a + B v + K x))(t - lag) + offset,    dg/dK = h * x, ...,    dg/dlag = -g'(t),

and the information is J'J / noise^2, plus 1/std^2 for what is known beforehand (Van Trees, 1968, sec. 2.4).

Which frequencies the power of an excitation belongs to: optimal input design over a range of surfaces.

The power w_i of each frequency, together 1, minimises a convex criterion of the covariance C(w) = (prior + sum w_i
m_i)^-1, for the worst of several surfaces. The update multiplies each power by a root of its sensitivity (Titterington,
1976; Silvey, Titterington and Torsney, 1978; Yu, 2010, for its convergence), and the general equivalence theorem of
Kiefer and Wolfowitz (1960; Fedorov, 1972) says how far from the optimum it can be at most.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import gcd, sqrt

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.signals import Estimate
from palpate.signals.low_pass import LowPass
from palpate.signals.types import NORMAL

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
    x, v, a, jerk = filter_at(time, penetration, low_pass, at)
    K, B, M = (float(truth.get(name, 0.0)) for name in ("K", "B", "M"))
    return np.column_stack([x, v, a, np.ones_like(at), -(K * v + B * a + M * jerk)])


def filter_at(time: Array, signal: Array, low_pass: LowPass, at: Array, derivatives: int = 4) -> Array:
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


_SHARPNESS = 8.0  # of the norm that stands for a maximum: of 27 equal ones it makes 1.5 times as much
_ROUNDS = 1500
_CLOSE = 0.01
"""To the best design there is, as a share of its criterion: Kiefer and Wolfowitz' bound on what is left."""


@dataclass(frozen=True)
class PowerSpectrum:
    """Powers, and how good they are.

    Args:
        powers: of the frequencies, shape (F,); their costs together are 1.
        gap: by how much the criterion may at most be above the best, as a share of it.
    """

    powers: Array
    gap: float


def optimal(
    information: Array,
    prior: Array,
    wanted: Array,
    criterion: str = "worst",
    costs: Array | None = None,
    start: Array | None = None,
) -> PowerSpectrum:
    """The optimal powers.

    Args:
        information: about each surface by each frequency with unit power, shape (C, F, n, n).
        prior: information, shape (n, n).
        wanted: what a deviation of each parameter is measured with, shape (n,): 1.96 sigma of this size is just good
            enough; infinite for a parameter that has to be estimated but is of no interest.
        criterion: `worst` parameter, `D`eterminant, `A`verage variance or worst direction (`E`), each of the worst
            surface.
        costs: of unit power at each frequency, shape (F,); 1 when left out.
        start: powers to start from.

    Raises:
        InputError: no such criterion.
    """
    if criterion not in CRITERIA:
        raise unknown("criterion", criterion, CRITERIA)
    count = information.shape[1]
    price = np.ones(count) if costs is None else costs
    asked = np.flatnonzero(np.isfinite(wanted))
    # A little for each, so that the first information can be inverted and no power is lost for good.
    powers = np.full(count, 1.0) if start is None else start + 1e-3 * start.max()
    powers = powers / (powers @ price)
    for _ in range(_ROUNDS):
        sensitivity = sensitivity_of(information, prior, wanted, asked, powers, CRITERIA[criterion]) / price
        mean = float(powers @ (price * sensitivity))
        gap = float(sensitivity.max()) / mean - 1
        if gap < _CLOSE:
            break
        powers = powers * (sensitivity / mean) ** _ROOTS[criterion]
        powers /= powers @ price
    return PowerSpectrum(powers, gap)


def covariance(information: Array, prior: Array) -> Array:
    """Inverse of information and prior; what nothing is known of has an enormous variance. Shapes (..., n, n)."""
    total = information + prior
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", total), 1e-30))
    scaled = total / (scale[..., :, None] * scale[..., None, :])
    inverse: Array = np.linalg.pinv(scaled + 1e-14 * np.eye(total.shape[-1]), rcond=1e-15, hermitian=True)
    return inverse / (scale[..., :, None] * scale[..., None, :])


def sensitivity_of(
    information: Array,
    prior: Array,
    wanted: Array,
    asked: NDArray[np.intp],
    powers: Array,
    criterion: Callable[[Array], tuple[Array, Array]],
) -> Array:
    """How fast the criterion falls with the power of each frequency, shape (F,)."""
    C = covariance(np.einsum("f,cfij->cij", powers, information), prior)
    unit = wanted[asked] / NORMAL
    own = C[:, asked[:, None], asked] / np.outer(unit, unit)
    values, slopes = criterion(own)
    slopes = slopes / np.outer(unit, unit)
    top = values.max()
    shares = (values / top) ** (_SHARPNESS - 1)  # towards the worst surface
    reach = C[:, :, asked]
    G = np.einsum("c,cip,cpq,cjq->cij", shares, reach, slopes, reach)
    fall: Array = np.einsum("cij,cfij->f", G, information)
    return fall


def _worst(C: Array) -> tuple[Array, Array]:
    """The largest variance, as a norm, and its derivative by C. Shapes (c, k, k) to (c,) and (c, k, k)."""
    variances = np.einsum("cii->ci", C)
    values = (variances**_SHARPNESS).sum(axis=1) ** (1 / _SHARPNESS)
    slopes = (variances / values[:, None]) ** (_SHARPNESS - 1)
    return values, slopes[:, :, None] * np.eye(C.shape[-1])


def _average(C: Array) -> tuple[Array, Array]:
    """A: the sum of the variances."""
    return np.einsum("cii->c", C), np.broadcast_to(np.eye(C.shape[-1]), C.shape)


def _determinant(C: Array) -> tuple[Array, Array]:
    """D: the volume of the confidence ellipsoid, as the k-th root of the determinant."""
    size = C.shape[-1]
    values = np.exp(np.linalg.slogdet(C)[1] / size)
    return values, values[:, None, None] / size * np.linalg.inv(C)


def _longest_axis(C: Array) -> tuple[Array, Array]:
    """E: the largest eigenvalue, as a norm of them all."""
    lengths, axes = np.linalg.eigh(C)
    values = (lengths**_SHARPNESS).sum(axis=1) ** (1 / _SHARPNESS)
    shares = (lengths / values[:, None]) ** (_SHARPNESS - 1)
    return values, np.einsum("cik,ck,cjk->cij", axes, shares, axes)


CRITERIA: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    "worst": _worst,
    "D": _determinant,
    "A": _average,
    "E": _longest_axis,
}
"""By name: from covariances to their values and derivatives."""

_ROOTS = {"worst": 0.2, "D": 0.5, "A": 0.3, "E": 0.2}
