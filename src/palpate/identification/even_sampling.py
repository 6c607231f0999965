"""Three channels of one length on one even grid of time: what an estimator that is called by itself asks for."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

_JITTER = 0.05


def even_period(time: Array, force: Array, position: Array) -> float:
    """The sampling period [s] of channels of shape (n,).

    Raises:
        InputError: channels of different lengths, readings that are missing, steps of time that differ.
    """
    if not time.shape == force.shape == position.shape or time.ndim != 1 or len(time) < 2:
        raise InputError(
            f"time, force and position must have one shape (n,), got {time.shape}, {force.shape}, {position.shape}"
        )
    for name, values in (("time", time), ("force", force), ("position", position)):
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise InputError(f"the {name} has no reading in row {row + 1}: bridge it, or cut the log there")
    step = np.diff(time)
    dt = float(step.mean())
    if not dt > 0 or float(np.abs(step - dt).max()) > _JITTER * dt:
        raise InputError(
            f"time must be evenly spaced, its steps are {step.min():.4g} to {step.max():.4g} s: resample the log"
        )
    return dt
