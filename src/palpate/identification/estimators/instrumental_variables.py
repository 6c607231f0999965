"""Refined instrumental variables for continuous-time models: consistent where noise makes least squares wrong.

Noise of the position stands in the regressors of f = M x'' + B x' + K x, and pulls every one of them, however long the
log is. An instrument is what has no such noise: the position that the last round's model simulates from the force.
Each round filters by that model's own denominator, which makes what is left as white as the noise was, and so the
answer nearly as good as that of maximum likelihood. Young, Recursive Estimation and Time-Series Analysis (2nd ed.),
ch. 8.

Every model here is one equation, f + tau f' = d0 x + d1 x' + d2 x'' + offset, a ratio of two polynomials of s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.identification.even_sampling import even_period
from palpate.identification.filters.bandwidth import choose_cutoff
from palpate.identification.filters.filter_bank import FilterBank
from palpate.identification.filters.state_variable import Chain, low_pass_once
from palpate.identification.least_squares import covariance, noise_of, solve
from palpate.signals.types import Estimate

Noisy = Literal["position", "force"]

ORDERS = {"kelvin-voigt": (1, 0), "kelvin-voigt-mass": (2, 0), "standard-linear-solid": (2, 1)}
"""By model: the highest derivative of the position in its equation, and that of the force."""
_ROUNDS = 50
_CONVERGED = 1e-4
"""Fall of the misfit, in shares of one reading, that moves no parameter by more than a hundredth of its deviation."""
_HALVINGS = 6
_FIRST_ROUNDS = 4
_FEWEST = 100
_FASTEST_CUTOFF = 1 / 8
_FASTEST_POLE = 30.0
"""Of a filter, per sample: what is faster than this is the same to sampled signals."""


@dataclass(frozen=True)
class _Log:
    force: Array
    position: Array
    dt: float
    orders: tuple[int, int]


@dataclass(frozen=True)
class _Round:
    """One set of linear equations: target = regressors . theta, with instruments, at the rows that have settled.

    Args:
        theta: whose filter and instruments these are, shape (p,).
        target, regressors, instruments: shapes (m,), (m, p), (m, p).
        rows: shape (m,).
        sound: whether theta is a stable model, so that its residuals are those of its simulation.
    """

    theta: Array
    target: Array
    regressors: Array
    instruments: Array
    rows: NDArray[np.intp]
    sound: bool = True

    @cached_property
    def residuals(self) -> Array:
        """Error of the simulated motion, shape (m,)."""
        missed: Array = self.target - self.regressors @ self.theta
        return missed

    @property
    def misfit(self) -> float:
        """Mean square of the residuals, by the stiffness as those of a position are."""
        return float(np.mean((self.residuals / self.theta[0]) ** 2)) if self.sound else np.inf

    @cached_property
    def _basis(self) -> tuple[Array, Array]:
        """An orthonormal basis Q of what the instruments span, and R with instruments = Q R."""
        size = np.sqrt(np.einsum("ij,ij->j", self.instruments, self.instruments))
        size[size == 0] = 1.0
        basis, triangle = np.linalg.qr(self.instruments / size)
        return np.asarray(basis), np.asarray(triangle * size)

    def refined(self) -> Array:
        """Where the instruments' equations, Z' (target - regressors theta) = 0, have their answer. Shape (p,)."""
        basis, _ = self._basis
        size = np.sqrt(np.einsum("ij,ij->j", self.regressors, self.regressors))
        size[size == 0] = 1.0
        found: Array = np.linalg.lstsq(basis.T @ self.regressors / size, basis.T @ self.target, rcond=1e-14)[
            0
        ]
        return found / size

    def symmetric(self) -> Array:
        """The same to first order with instruments for regressors, which noise cannot turn the wrong way."""
        basis, triangle = self._basis
        step = np.linalg.lstsq(triangle, basis.T @ self.residuals, rcond=1e-14)[0]
        return self.theta + step

    def uncertainty(self) -> tuple[Array, float]:
        """Covariance of theta under the residuals' own colour, shape (p, p), and how many samples they are worth."""
        basis, triangle = self._basis
        noise = noise_of(self.residuals, self.rows, len(self.theta))
        turn = np.linalg.pinv(triangle, rcond=1e-14)
        return turn @ covariance(basis, self.rows, noise) @ turn.T, noise.effective


def refined_instrumental(
    time: Array,
    force: Array,
    position: Array,
    *,
    model: str = "kelvin-voigt-mass",
    noisy: Noisy = "position",
    lag: float = 0.0,
) -> Estimate:
    """Fit a model in steady contact with one noisy channel, without the bias that least squares has from it.

    When to use it: a position of poor resolution (an encoder far from the surface, a camera) beside a good force
    sensor; or a standard linear solid under a noisy force, whose rate is a regressor. It needs no start, unlike
    `output_error`, and no simulation step by step.

    Args:
        time: evenly spaced [s], shape (n,).
        force: shape (n,) [N].
        position: shape (n,) [m].
        model: of `ORDERS`.
        noisy: the channel whose noise matters; the other one is where the instruments come from, and taken as exact.
        lag: how much later the force is read than the position [s], calibrated.

    Returns:
        The model's parameters and the offset, with the covariance that the residuals' own colour gives.

    Raises:
        InputError: uneven time, an unknown model, too few readings.
    """
    if model not in ORDERS:
        raise unknown("model", model, tuple(ORDERS))
    if noisy not in _ROUND:
        raise unknown("noisy channel", noisy, tuple(_ROUND))
    dt = even_period(time, force, position)
    if len(time) < _FEWEST:
        raise InputError(
            f"{len(time)} readings are too few; at least {_FEWEST} are needed: log longer or faster"
        )
    log = _Log(force, _late(time, position, lag) if lag else position, dt, ORDERS[model])
    current = _start(log, noisy)
    for _ in range(_ROUNDS):
        last, current = current, _better(log, noisy, current)
        if len(time) * (last.misfit - current.misfit) <= _CONVERGED * last.misfit:
            break
    spread, effective = current.uncertainty()
    return _named(model, current.theta, spread, effective)


def _start(log: _Log, noisy: Noisy) -> _Round:
    """The best of the first rounds, each taken as it comes: the bias of least squares may be far from any descent."""
    rounds = [_ROUND[noisy](log, _least_squares(log))]
    for _ in range(_FIRST_ROUNDS):
        rounds.append(_ROUND[noisy](log, rounds[-1].refined()))
    return min(rounds, key=lambda one: one.misfit)


def _better(log: _Log, noisy: Noisy, current: _Round) -> _Round:
    """The next round: the first of ever more careful steps that simulates no worse; the same if there is none."""
    refined, symmetric = current.refined(), current.symmetric()
    halves = (current.theta + (symmetric - current.theta) / 2**k for k in range(_HALVINGS))
    for theta in (refined, *halves):
        trial = _ROUND[noisy](log, theta)
        if trial.misfit <= current.misfit:
            return trial
    return current


def _late(time: Array, position: Array, lag: float) -> Array:
    from scipy.interpolate import CubicSpline

    late: Array = CubicSpline(time, position)(np.clip(time - lag, time[0], time[-1]))
    return late


def _least_squares(log: _Log) -> Array:
    """Where the rounds begin: least squares behind a state-variable filter, bias and all."""
    chain = Chain(choose_cutoff(log.position, log.force, log.dt, 1 / log.dt), log.dt)
    first = min(_settled(chain), len(log.force) // 4)
    columns = _columns(log, lambda k: chain(log.position, k), lambda k: chain(log.force, k))[first:]
    return solve(columns, chain(log.force)[first:])


def _columns(log: _Log, position: Callable[[int], Array], force: Callable[[int], Array]) -> Array:
    """[x, x', ..., -f', 1] from what gives their derivatives, shape (n, p)."""
    highest_x, highest_f = log.orders
    moved = [position(k) for k in range(highest_x + 1)]
    pressed = [-force(k) for k in range(1, highest_f + 1)]
    return np.column_stack([*moved, *pressed, np.ones(len(log.force))])


def _polynomials(log: _Log, theta: Array) -> tuple[Array, Array]:
    """Those of position and force, ascending, made fit for filters and instruments, whatever the last round found."""
    highest = log.orders[0]
    return _usable(log, theta[: highest + 1]), _usable(log, np.r_[1.0, theta[highest + 1 : -1]])


def _usable(log: _Log, polynomial: Array) -> Array:
    """The same, if it is stable and no faster than sampled signals can show: else one near by that is.

    To the second order, to be stable is to have no coefficient below zero. Any filter is consistent; the best one is
    the model's own.
    """
    order = len(polynomial) - 1
    usable = np.abs(polynomial)
    for k in range(order):
        usable[k + 1] = max(usable[k + 1], usable[k] * log.dt / _FASTEST_POLE)
    return usable


def _round_of_noisy_position(log: _Log, theta: Array) -> _Round:
    """All through F = D(0)/D(s); the instruments come from x = N(s)/D(s) f."""
    D, N = _polynomials(log, theta)
    bank = FilterBank(D, log.dt)
    pressed = log.force - theta[-1]
    course = sum(N[k] / D[0] * bank(pressed, k) for k in range(len(N)))
    regressors = _columns(log, lambda k: bank(log.position, k), lambda k: bank(log.force, k))
    instruments = regressors.copy()
    for k in range(len(D)):
        instruments[:, k] = bank(course, k)
    return _equations(
        theta, bank(log.force, 0), regressors, instruments, bank.memory(len(log.force)), len(D) - 1
    )


def _round_of_noisy_force(log: _Log, theta: Array) -> _Round:
    """All through F = L(s)/N(s), L the five lags that make x'' finite; the instruments come from f = D(s)/N(s) x."""
    D, N = _polynomials(log, theta)
    chain = Chain(_FASTEST_CUTOFF / log.dt, log.dt)

    def filtered(signal: Array) -> Array:
        return signal[0] + low_pass_once(signal - signal[0], N[1], log.dt) if len(N) > 1 else signal

    moved = [chain(log.position, k) for k in range(len(D) + len(N) - 1)]
    pressed = [filtered(chain(log.force, k)) for k in range(len(N))]
    regressors = _columns(log, lambda k: filtered(moved[k]), lambda k: pressed[k])
    instruments = regressors.copy()
    for k in range(1, len(N)):
        course = filtered(sum(D[j] * moved[j + k] for j in range(len(D))))
        instruments[:, len(D) + k - 1] = -filtered(course)
    memory = (
        np.exp(-np.arange(len(log.force)) * log.dt / N[1])[:, None]
        if len(N) > 1
        else np.empty((len(log.force), 0))
    )
    return _equations(theta, pressed[0], regressors, instruments, memory, _settled(chain))


_ROUND: dict[str, Callable[[_Log, Array], _Round]] = {
    "position": _round_of_noisy_position,
    "force": _round_of_noisy_force,
}


def _equations(
    theta: Array, target: Array, regressors: Array, instruments: Array, memory: Array, first: int
) -> _Round:
    """The equations from the sample `first` on, without what the filters remember of before the log, shape (n, k)."""
    basis = np.linalg.qr(memory[first:])[0] if memory.shape[1] else memory[first:]

    def rest(columns: Array) -> Array:
        own = columns[first:]
        left: Array = own - basis @ (basis.T @ own)
        return left

    sound = bool(np.all(theta[:-1] > 0))
    return _Round(
        theta, rest(target), rest(regressors), rest(instruments), np.arange(first, len(target)), sound
    )


def _settled(chain: Chain) -> int:
    """Samples after which the chain has forgotten what was before the log."""
    return int(np.ceil(chain.thorough_settling / chain.dt))


def _named(model: str, theta: Array, spread: Array, effective: float) -> Estimate:
    if model != "standard-linear-solid":
        names = ("K", "B", "M")[: len(theta) - 1]
        return Estimate((*names, "offset"), theta, spread, effective)
    d0, d1, d2, tau, offset = theta
    B = d2 / tau
    found = np.array([d0, B, (d1 - B) / tau - d0, tau, offset])
    # (tau s + 1) f = (K (tau s + 1) + B s (tau s + 1) + K1 tau s) x
    slopes = np.zeros((5, 5))
    slopes[0, 0] = slopes[3, 3] = slopes[4, 4] = 1.0
    slopes[1, 2:4] = 1 / tau, -B / tau
    slopes[2, :4] = -1.0, 1 / tau, -1 / tau**2, -(d1 - 2 * B) / tau**2
    return Estimate(("K", "B", "K1", "tau", "offset"), found, slopes @ spread @ slopes.T, effective)
