"""A mass on a spring that stiffens with the cube of its stretch, identified by output error.

M y'' + (B + B3 y^2) y' + K y + K3 y^3 = f + f0, measured u = G f and x = G (y + x0). The force is band-limited between
its samples; the equation is integrated by Runge and Kutta's method of fourth order. Output error needs no derivative
of the measured position, so that its noise biases nothing; the force is taken to be exact. G is the filter that both
channels pass: a linear equation does not show it, but the harmonics of the spring lie where its phase has left the
straight line. Of G only that phase is modelled: phase (f/f_N)^3 [rad], f_N half the rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate._jit import kernel, law, part
from palpate.arrays import Array

STEPS = 4
"""Of the integration in a sample."""
EDGE = 128
"""Samples beside a part of a record that its filters know; beyond the record's ends it is mirrored."""
BLOCK = 1024
"""Samples whose errors count as one in the covariance: longer than the oscillation lasts."""
MODELS = {
    "linear": ("M", "B", "K"),
    "cubic spring": ("M", "B", "K", "K3"),
    "cubic spring, phase": ("M", "B", "K", "K3", "phase"),
    "cubic spring and damping, phase": ("M", "B", "K", "K3", "phase", "B3"),
}
"""Free numbers of each model; offsets and the state at the first row are free in all."""
UNITS = {"M": "s^2", "B": "s", "K": "1", "K3": "1/V^2", "B3": "s/V^2", "phase": "rad", "f0": "V", "x0": "V"}
"""For force and position in volts, as an electronic circuit has them."""


@part
class Numbers(NamedTuple):
    """Numbers of the equation."""

    M: float
    B: float
    K: float
    K3: float
    B3: float
    f0: float


@law
def acceleration(numbers, y, v, f):
    """y'' of the equation."""
    damping = numbers.B + numbers.B3 * y * y
    return (f + numbers.f0 - damping * v - y * (numbers.K + numbers.K3 * y * y)) / numbers.M


@law
def integrate(numbers, f, h, y, v, out):
    """y at each sample: `f` at half steps, shape (2 STEPS (n - 1) + 1,); `out`, shape (n,)."""
    for k in range(len(out)):
        out[k] = y
        if k + 1 == len(out):
            break
        for i in range(2 * STEPS * k, 2 * STEPS * (k + 1), 2):
            a1 = acceleration(numbers, y, v, f[i])
            v2 = v + 0.5 * h * a1
            a2 = acceleration(numbers, y + 0.5 * h * v, v2, f[i + 1])
            v3 = v + 0.5 * h * a2
            a3 = acceleration(numbers, y + 0.5 * h * v2, v3, f[i + 1])
            v4 = v + h * a3
            a4 = acceleration(numbers, y + h * v3, v4, f[i + 2])
            y += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
            v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


compiled_integrate = kernel(integrate)


def turn(signal: Array, phase: float, finer: int = 1) -> Array:
    """A signal behind a filter of size one and phase (f/f_N)^3 [rad], at a multiple of its rate.

    Args:
        signal: shape (n,), with neighbours of no interest at both ends.
        phase: at half the rate [rad].
        finer: samples for each one.

    Returns:
        Shape (finer (n - 1) + 1,).
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = len(signal)
    size = next_fast_len(n + 2 * EDGE, real=True)
    before = min(EDGE, n - 1)
    after = min(size - n - before, n - 1)
    mirrored = np.pad(signal, (before, after), mode="reflect", reflect_type="odd")
    share = np.linspace(0.0, 1.0, len(mirrored) // 2 + 1)
    spectrum = rfft(mirrored) * np.exp(1j * phase * share**3)
    found = irfft(spectrum, finer * len(mirrored)) * finer
    return np.asarray(found[finer * before :][: finer * (n - 1) + 1])


@dataclass(frozen=True)
class Part:
    """A part of a record.

    Args:
        u: measured force of its rows and of those beside it, shape (before + n + after,).
        before: rows of `u` before its first.
        x: measured position, shape (n,).
        rate: of the rows [Hz].
    """

    u: Array
    before: int
    x: Array
    rate: float

    @classmethod
    def of(cls, force: Array, position: Array, rate: float, begin: int, end: int) -> Part:
        """Rows begin to end of a record."""
        first = max(begin - EDGE, 0)
        return cls(force[first : end + EDGE], begin - first, position[begin:end], rate)

    def shorter(self, rows: int) -> Part:
        """The part of its first rows."""
        return Part(self.u[: self.before + rows + EDGE], self.before, self.x[:rows], self.rate)

    def force(self, phase: float) -> Array:
        """Force before the channel's filter at half steps, from the first row on, shape (2 STEPS (rows - 1) + 1,)."""
        return turn(self.u, -phase, 2 * STEPS)[2 * STEPS * self.before :]


@dataclass(frozen=True)
class FittedEquation:
    """Identified equation.

    Args:
        values: of its numbers, offsets included.
        std: standard deviation of each, for errors that are correlated within a block.
        blocks: that the standard deviations rest on.
    """

    values: Mapping[str, float]
    std: Mapping[str, float]
    blocks: int

    def ci95(self, name: str) -> tuple[float, float]:
        """95 % interval of a number."""
        from scipy.stats import t

        half = float(t.ppf(0.975, self.blocks - 1)) * self.std[name]
        return self.values[name] - half, self.values[name] + half


def simulate(values: Mapping[str, float], own: Part) -> Array:
    """Measured position that the equation predicts, from the state y, v among its values, shape (n,)."""
    numbers = Numbers(*(float(values.get(name, 0.0)) for name in Numbers._fields))
    out, phase = np.empty(len(own.u) - own.before), float(values.get("phase", 0.0))
    h = 1.0 / own.rate / STEPS
    compiled_integrate(numbers, own.force(phase), h, float(values["y"]), float(values["v"]), out)
    if np.abs(out).max() < _BOUND:
        return turn(out, phase)[: len(own.x)] + float(values.get("x0", 0.0))
    return np.full(len(own.x), _BOUND)


_BOUND = 1e3
"""Position from which on there is no solution of interest, which a search may come to."""


def equation_error(own: Part, names: tuple[str, ...]) -> dict[str, float]:
    """Numbers by linear least squares on the spectrum's derivatives of the position: a start for the search."""
    n = len(own.x)
    window = np.hanning(n)
    rate = 2j * np.pi * np.fft.rfftfreq(n, 1.0 / own.rate)
    low = np.abs(rate) < 0.7 * np.pi * own.rate
    spectrum = np.fft.rfft(own.x) * low
    x, v, a = (np.fft.irfft(spectrum * rate**k, n) for k in range(3))
    columns = {"M": a, "B": v, "K": x, "K3": x**3, "B3": x**2 * v, "f0": -np.ones(n)}
    chosen = [name for name in (*names, "f0") if name in columns]
    A = np.column_stack([columns[name] for name in chosen]) * window[:, None]
    size = np.sqrt((A**2).mean(axis=0))
    theta = np.linalg.lstsq(A / size, own.u[own.before :][:n] * window, rcond=None)[0] / size
    return dict(zip(chosen, theta.tolist(), strict=True)) | {"y": float(x[0]), "v": float(v[0])}


def fit(own: Part, names: tuple[str, ...]) -> FittedEquation:
    """The equation by output error, with the state at the first row.

    The search begins with the equation's error. Rows at both ends, which the channel's filter does not know, do not
    count; a linear equation has one offset alone.

    Args:
        own: of a record.
        names: of the free numbers, as `MODELS` has them.
    """
    from scipy.optimize import least_squares

    first = equation_error(own, names)
    free = [*names, *(("f0", "x0") if "K3" in names else ("f0",)), "y", "v"]
    size = _sizes(own, first)
    inner = slice(_UNKNOWN, -_UNKNOWN)

    def residual(scaled: Array) -> Array:
        at = {name: s * size[name] for name, s in zip(free, scaled, strict=True)}
        return (simulate(at, own) - own.x)[inner]

    start = [first.get(name, 0.0) / size[name] for name in free]
    done = least_squares(residual, start, method="lm", diff_step=1e-6)
    values = {name: float(s * size[name]) for name, s in zip(free, done.x, strict=True)}
    blocks = max(len(own.x) // BLOCK, 2)
    parts = zip(np.array_split(done.jac, blocks), np.array_split(done.fun, blocks), strict=True)
    scores = np.array([J.T @ e for J, e in parts])
    inverse = np.linalg.pinv(done.jac.T @ done.jac)
    covariance = inverse @ (scores.T @ scores) @ inverse * blocks / (blocks - 1)
    std = {name: float(np.sqrt(covariance[j, j]) * size[name]) for j, name in enumerate(free)}
    return FittedEquation(values, std, blocks)


_UNKNOWN = 20
"""Rows at an end that the channel's filter does not know."""


def _sizes(own: Part, first: Mapping[str, float]) -> dict[str, float]:
    """Order of each number, so that the search sees numbers near one."""
    x, K, M = float(own.x.std()), abs(first["K"]), abs(first["M"])
    swing = float(np.sqrt(K / M))
    return {
        "M": M,
        "B": M * swing,
        "K": K,
        "K3": K / x**2,
        "B3": M * swing / x**2,
        "phase": 1.0,
        "f0": K * x,
        "x0": x,
        "y": x,
        "v": swing * x,
    }


def state_of(fitted: FittedEquation, own: Part, rows: int) -> dict[str, float]:
    """The equation's numbers with the state that fits the first rows of another part best."""
    from scipy.optimize import least_squares

    short, size = own.shorter(rows + EDGE), _sizes(own, fitted.values)

    def values(state: Array) -> dict[str, float]:
        return {**fitted.values, "y": float(state[0] * size["y"]), "v": float(state[1] * size["v"])}

    def residual(state: Array) -> Array:
        return (simulate(values(state), short) - short.x)[:rows]

    return values(least_squares(residual, [own.x[0] / size["y"], 0.0], method="lm").x)


def nrmse(fitted: FittedEquation, own: Part, rows: int) -> float:
    """Root mean square of the prediction's error over the standard deviation of the position, without the first rows.

    Args:
        fitted: the equation.
        own: a part that it was not fitted to.
        rows: from which the state at the begin is found; the prediction knows no other position.
    """
    error = (simulate(state_of(fitted, own, rows), own) - own.x)[rows:]
    return float(np.sqrt(np.mean(error**2)) / own.x[rows:].std())
