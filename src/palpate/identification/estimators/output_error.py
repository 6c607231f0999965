"""Output error: the parameters whose simulated position comes nearest to the position that was read.

The force drives the model, the position is compared. White noise of the position, however large, then pulls no
parameter, and the estimate is that of maximum likelihood; noise of the force does pull. What least squares on filtered
derivatives takes from the shape of the force, this takes from the whole course of the motion, a curved spring included.
Ljung, System Identification (2nd ed.), sec. 4.3 and 10.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.estimators.simulation import (
    COLUMNS,
    PARAMETERS,
    Drive,
    drive_of,
    fastest_mode,
    simulated,
)
from palpate.identification.even_sampling import even_period
from palpate.identification.least_squares import covariance, noise_of
from palpate.signals.types import Estimate

LINEAR = ("M", "B", "K", "offset")
CURVED = ("M", "B", "K", "K2", "K3", "offset")
_ROUNDS = 60
_CONVERGED = 1e-10
"""Of a step, as a share of the misfit: below it the step moves no parameter by what could be told."""
_EDGE = 16
"""Readings at each end that are not compared: the force before the first and after the last of them is a guess."""


@dataclass
class _Point:
    values: Array
    slopes: Array
    residuals: Array
    misfit: float


def output_error(
    time: Array,
    force: Array,
    position: Array,
    start: Mapping[str, float],
    *,
    free: Sequence[str] = LINEAR,
) -> Estimate:
    """Fit M x'' + B x' + K x + K2 x^2 + K3 x^3 + offset = f(t + lag) by the position that it simulates.

    When to use it: a probe that stays in contact and whose position is the noisier channel, or a curved spring. A
    force behind a low-pass wants the position behind the same one. Started from least squares, it is a matter of a
    handful of simulations.

    Args:
        time: evenly spaced [s], shape (n,).
        force: shape (n,) [N]; taken as exact.
        position: shape (n,) [m].
        start: where to start, by name; M, B and K at least. Others are zero, and stay as given unless they are free.
        free: the parameters to find, of `PARAMETERS`; `lag` [s] is how much later the force is read.

    Returns:
        The free parameters with the covariance that the residuals' own colour gives. The state at the first reading is
        found too, and left out.

    Raises:
        InputError: uneven time, a parameter that is none, a start that runs away.
    """
    dt = even_period(time, force, position)
    _check(start, free, len(position))
    drive = drive_of(force, dt, fastest_mode(start, float(np.ptp(position)) / 2))
    values = _initial(start, position, dt)
    places = [COLUMNS.index(name) for name in (*free, "x0", "v0")]
    point = _descend(drive, position, values, places)
    inside = _compared(len(position))
    jacobian, rows = point.slopes[inside][:, places], np.arange(len(position))[inside]
    noise = noise_of(point.residuals[inside], rows, len(places))
    spread = covariance(jacobian, rows, noise)
    count = len(free)
    return Estimate(tuple(free), point.values[places[:count]], spread[:count, :count], noise.effective)


def simulation_error(
    time: Array, force: Array, position: Array, parameters: Mapping[str, float]
) -> tuple[float, Array]:
    """How far a model simulates a position wrongly: the rms error [m] and the simulated position, shape (n,).

    Only the state at the first reading is fitted, so on data that the parameters were not found from this is an honest
    test of a model: an error of the parameters adds up over the whole log instead of being corrected at every reading.

    Args:
        time: evenly spaced [s], shape (n,).
        force: shape (n,) [N].
        position: shape (n,) [m].
        parameters: by name, of `PARAMETERS`.
    """
    dt = even_period(time, force, position)
    _check(parameters, (), len(position))
    drive = drive_of(force, dt, fastest_mode(parameters, float(np.ptp(position)) / 2))
    places = [COLUMNS.index(name) for name in ("x0", "v0")]
    point = _descend(drive, position, _initial(parameters, position, dt), places)
    error = point.residuals[_compared(len(position))]
    return float(np.sqrt(np.mean(error**2))), position - point.residuals


def _check(start: Mapping[str, float], free: Sequence[str], count: int) -> None:
    strange = sorted((set(start) | set(free)) - set(PARAMETERS))
    if strange:
        raise InputError(
            f"no parameter of the oscillator: {', '.join(strange)}; there are {', '.join(PARAMETERS)}"
        )
    missing = [name for name in ("M", "B", "K") if name not in start]
    if missing:
        raise InputError(f"the start lacks {', '.join(missing)}: take them from least squares")
    if not start["M"] > 0:
        raise InputError(f"M must be above 0 to simulate a motion, got {start['M']:.3g} kg")
    fewest = 2 * _EDGE + 10 * (len(free) + 2)
    if count < fewest:
        raise InputError(
            f"{count} readings are too few to simulate and compare; at least {fewest} are needed"
        )


def _initial(start: Mapping[str, float], position: Array, dt: float) -> Array:
    """All of `COLUMNS`, the state from a straight line through the first few readings."""
    rate, level = np.polyfit(np.arange(4) * dt, position[:4], 1)
    return np.array([*(float(start.get(name, 0.0)) for name in PARAMETERS), level, rate])


def _compared(count: int) -> slice:
    return slice(_EDGE, count - _EDGE)


def _evaluate(drive: Drive, position: Array, values: Array) -> _Point:
    course, slopes = simulated(drive, dict(zip(COLUMNS, values, strict=True)))
    residuals = position - course
    inside = residuals[_compared(len(position))]
    sound = bool(np.isfinite(inside).all() and np.isfinite(slopes).all())
    return _Point(values, slopes, residuals, float(inside @ inside) if sound else np.inf)


def _descend(drive: Drive, position: Array, values: Array, places: list[int]) -> _Point:
    """Levenberg and Marquardt."""
    point = _evaluate(drive, position, values)
    if not np.isfinite(point.misfit):
        raise InputError(
            "the start's simulation runs away: is it stable (M, B and K above 0), and are the channels' signs right?"
        )
    damping = 1e-6
    for _ in range(_ROUNDS):
        step, promised = _step(point, places, damping)
        moved = point.values.copy()
        moved[places] += step
        trial = _evaluate(drive, position, moved) if moved[0] > 0 else None
        if trial is not None and trial.misfit <= point.misfit:
            point, damping = trial, max(damping / 10, 1e-9)
        else:
            damping *= 10
        if promised <= _CONVERGED * point.misfit or damping > 1e8:
            break
    return point


def _step(point: _Point, places: list[int], damping: float) -> tuple[Array, float]:
    """A damped step of Gauss and Newton, and how much of the misfit it promises to take."""
    inside = _compared(len(point.residuals))
    jacobian, residuals = point.slopes[inside][:, places], point.residuals[inside]
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    slope = jacobian.T @ residuals / scale
    step = np.linalg.lstsq(gram + damping * np.eye(len(places)), slope, rcond=1e-14)[0]
    return step / scale, float(slope @ step)
