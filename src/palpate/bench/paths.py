"""A prescribed path of a tip, at every step of the physics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError

Path = Callable[[Array], Array] | ArrayLike
"""A function of times [s], or positions [m] at ticks, shape (n,), or at steps of the physics, shape (n, steps)."""
LEAST = 4
"""Ticks that a path must have: a cubic spline needs so many."""


def positions(path: Path, duration: float | None, tick: float, steps: int) -> Array:
    """Positions [m] at each step of n ticks, and at one step before and after: shape (n steps + 2,).

    Raises:
        InputError: no finite numbers, another shape, a duration that is missing, too short or not asked for.
    """
    if callable(path):
        x = _called(path, duration, tick, steps)
    else:
        if duration is not None:
            raise InputError(
                "duration belongs to a path that is a function; an array has its own, leave it out"
            )
        x = _extended(np.asarray(path, dtype=np.float64), steps)
    if not np.isfinite(x).all():
        raise InputError("path must be finite numbers, got some that are not; look for NaN in it")
    return x


def _called(
    path: Callable[[Array], Array],
    duration: float | None,
    tick: float,
    steps: int,
) -> Array:
    if duration is None or not duration >= LEAST * tick:
        raise InputError(
            f"duration must be at least {LEAST * tick:g} s for a path that is a function, got {duration}"
        )
    times: Array = np.arange(-1.0, round(duration / tick) * steps + 1) * (tick / steps)
    x = np.asarray(path(times), dtype=np.float64)
    if x.shape != times.shape:
        raise InputError(f"path must give one position for each time, {times.shape}, got {x.shape}")
    return x


def _extended(path: Array, steps: int) -> Array:
    if path.ndim not in {1, 2} or len(path) < LEAST or (path.ndim == 2 and path.shape[1] != steps):
        raise InputError(
            f"path must be of shape (n,), one position a tick, or (n, {steps}), one a step of the physics, with n at "
            f"least {LEAST}; got {path.shape}"
        )
    if path.ndim == 1:
        return _interpolated(path, steps)
    flat = path.ravel()
    # One step on at constant acceleration.
    before, after = (3.0 * (a - b) + c for a, b, c in (flat[:3], flat[:-4:-1]))
    return np.concatenate([[before], flat, [after]])


def _interpolated(at_ticks: Array, steps: int) -> Array:
    """By a cubic spline: acceleration has no jumps, which a mass would feel."""
    from scipy.interpolate import CubicSpline

    if not np.isfinite(at_ticks).all():
        return at_ticks
    spline = CubicSpline(np.arange(len(at_ticks)), at_ticks)
    powers = (np.arange(steps) / steps) ** np.arange(3, -1, -1)[:, None]
    inside = (spline.c.T @ powers).ravel()
    before = spline(-1.0 / steps)
    last = spline(len(at_ticks) - 1 + np.arange(steps + 1) / steps)
    return np.concatenate([[before], inside, last])
