"""The position that a force gives a mass on a curved spring, and how it moves with each parameter.

M x'' + B x' + K x + K2 x^2 + K3 x^3 + offset = f(t), integrated by Runge and Kutta's fourth-order rule together with
its sensitivity equations. Between its readings the force is band-limited, not straight lines: at a fifth of the
sampling rate a straight line would lose an eighth of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate._jit import kernel, law
from palpate.arrays import Array
from palpate.errors import InputError

PARAMETERS = ("M", "B", "K", "K2", "K3", "offset", "lag")
"""Of the oscillator, in the order of its sensitivities; `lag` [s] is how much later the force is read."""
COLUMNS = (*PARAMETERS, "x0", "v0")
"""The same and the state at the first reading [m], [m/s]: what the position is differentiated by."""

_RADIANS_PER_STEP = 0.25
_FEWEST_STEPS, _MOST_STEPS = 2, 200


@dataclass(frozen=True)
class Drive:
    """The force between its readings, at the half steps of the integration.

    Args:
        force: at even times, half a step apart, shape (2 * steps * (n - 1) + 1,) [N].
        rate: its derivative, likewise [N/s].
        dt: time between two readings [s].
        steps: of the integration between two readings.
    """

    force: Array
    rate: Array
    dt: float
    steps: int

    @property
    def count(self) -> int:
        """How many readings."""
        return (len(self.force) - 1) // (2 * self.steps) + 1


def drive_of(force: Array, dt: float, fastest: float) -> Drive:
    """A force [N], shape (n,), read every `dt` [s], made ready for modes of up to `fastest` [rad/s].

    Raises:
        InputError: the mode is so fast that it is no oscillation of this log's.
    """
    from scipy.signal import resample_poly

    steps = max(_FEWEST_STEPS, int(np.ceil(fastest * dt / _RADIANS_PER_STEP)))
    if steps > _MOST_STEPS:
        raise InputError(
            f"the model's fastest mode of {fastest:.3g} rad/s is beyond what readings every {dt:.3g} s show: "
            "start from a larger mass, or use least squares, which needs no simulation"
        )
    fine = resample_poly(force, 2 * steps, 1, window=("kaiser", 9.0), padtype="line")
    fine = fine[: 2 * steps * (len(force) - 1) + 1]
    return Drive(fine, np.gradient(fine, dt / (2 * steps)), dt, steps)


def fastest_mode(parameters: Mapping[str, float], reach: float) -> float:
    """The fastest mode [rad/s] of an oscillator that moves by up to `reach` [m] from the origin."""
    curve = 2 * abs(parameters.get("K2", 0.0)) * reach + 3 * abs(parameters.get("K3", 0.0)) * reach**2
    stiffness, mass = abs(parameters["K"]) + curve, parameters["M"]
    return float(np.sqrt(stiffness / mass) + parameters["B"] / mass)


def simulated(drive: Drive, parameters: Mapping[str, float]) -> tuple[Array, Array]:
    """The position [m], shape (n,), and its derivatives by `COLUMNS`, shape (n, 9); not finite if it runs away.

    Args:
        drive: the force.
        parameters: by name, of `COLUMNS`; those that are missing are zero.
    """
    values = np.array([float(parameters.get(name, 0.0)) for name in COLUMNS])
    position = np.empty(drive.count)
    slopes = np.empty((drive.count, len(COLUMNS)))
    lagging = drive
    if values[6]:
        lagging = _earlier(drive, values[6])
    _integrate(lagging.force, lagging.rate, drive.dt / drive.steps, drive.steps, values, position, slopes)
    return position, slopes


def _earlier(drive: Drive, lag: float) -> Drive:
    """The drive as it acted: what is read at t acted at t - lag."""
    fine = drive.dt / (2 * drive.steps)
    place = np.arange(len(drive.force)) * fine
    force, rate = (np.interp(place + lag, place, signal) for signal in (drive.force, drive.rate))
    return Drive(force, rate, drive.dt, drive.steps)


@law
def _rates(values: Array, force: float, force_rate: float, state: Array, rates: Array) -> None:
    """Derivatives by time of position and velocity (row 0), and of their sensitivities (the other rows), in place."""
    M, B, K, K2, K3, offset = values[0], values[1], values[2], values[3], values[4], values[5]
    x, v = state[0, 0], state[0, 1]
    a = (force - offset - B * v - (K + (K2 + K3 * x) * x) * x) / M
    rates[0, 0], rates[0, 1] = v, a
    slope = K + (2.0 * K2 + 3.0 * K3 * x) * x
    for i in range(1, len(state)):
        rates[i, 0] = state[i, 1]
        rates[i, 1] = -(B * state[i, 1] + slope * state[i, 0]) / M
    rates[1, 1] -= a / M
    rates[2, 1] -= v / M
    rates[3, 1] -= x / M
    rates[4, 1] -= x * x / M
    rates[5, 1] -= x * x * x / M
    rates[6, 1] -= 1.0 / M
    rates[7, 1] += force_rate / M


@law
def _along(out: Array, state: Array, rates: Array, h: float) -> None:
    """state + h rates, into `out`."""
    for i in range(len(state)):
        out[i, 0] = state[i, 0] + h * rates[i, 0]
        out[i, 1] = state[i, 1] + h * rates[i, 1]


@law
def _runge_kutta(
    values: Array, force: Array, force_rate: Array, j: int, h: float, state: Array, work: Array
) -> None:
    """One step of h from the half step j, in place; `work` has room for five states."""
    k1, k2, k3, k4, there = work[0], work[1], work[2], work[3], work[4]
    _rates(values, force[j], force_rate[j], state, k1)
    _along(there, state, k1, 0.5 * h)
    _rates(values, force[j + 1], force_rate[j + 1], there, k2)
    _along(there, state, k2, 0.5 * h)
    _rates(values, force[j + 1], force_rate[j + 1], there, k3)
    _along(there, state, k3, h)
    _rates(values, force[j + 2], force_rate[j + 2], there, k4)
    for i in range(len(state)):
        for k in range(2):
            state[i, k] += h / 6.0 * (k1[i, k] + 2.0 * (k2[i, k] + k3[i, k]) + k4[i, k])


@kernel
def _integrate(
    force: Array, force_rate: Array, h: float, steps: int, values: Array, position: Array, slopes: Array
) -> None:
    rows = len(values) + 1
    state = np.zeros((rows, 2))
    work = np.empty((5, rows, 2))
    state[0, 0], state[0, 1] = values[7], values[8]
    state[rows - 2, 0] = 1.0
    state[rows - 1, 1] = 1.0
    for i in range(len(position)):
        position[i] = state[0, 0]
        slopes[i] = state[1:, 0]
        if i + 1 < len(position):
            for k in range(steps):
                _runge_kutta(values, force, force_rate, 2 * (i * steps + k), h, state, work)
