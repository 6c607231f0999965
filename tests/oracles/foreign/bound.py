"""What an estimator could know that knows the model, the lag as told, the low-pass and the noise: Cramer and Rao."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foreign.logs import Log
from foreign.recording import at_times

Array = NDArray[np.float64]

_KNOWN = {"kelvin-voigt", "mass"}
_NOTHING = 1e30
"""Variance along a direction that the log does not show, over what noise alone would leave: a probe at rest."""


def half_widths(log: Log) -> dict[str, float]:
    """Least half-width of a 95 % interval of K, B and M that the log carries; none for surfaces that are not linear.

    Noise of the position counts as noise of the force, times K. A mass is only asked for where there is one, or where a
    payload looks like one. A stiffness that differs between repeats costs its spread over their number, an arm
    that is told with a deviation what that deviation does.
    """
    plan, r = log.plan, log.plan.recording
    if plan.surface.name not in _KNOWN:
        return {}
    names = ["K", "B"] + (["M"] if plan.surface["M"] or r.payload else [])
    columns, rows = columns_of(log, names)
    if len(rows) < 2 * columns.shape[1]:
        return {}
    stiff = plan.surface["K"]
    counts = (r.force_count**2 + (stiff * r.position_count) ** 2) / 12
    white = (stiff * r.position_noise) ** 2 + counts + (1e-9 * plan.largest) ** 2
    step = max(r.hold_force, r.hold_position) / r.rate
    keep = np.exp(-step / r.colour) if r.colour else 0.0
    joined = np.diff(rows, prepend=-9) == 1
    white_columns = columns - keep * np.where(joined[:, None], np.roll(columns, 1, axis=0), 0.0)
    variance = r.force_noise**2 * np.where(joined, 1 - keep**2, 1.0) + white * (1 + keep**2)
    information = (white_columns / variance[:, None]).T @ white_columns
    if "lag" in plan.told and plan.told.get("lag_std"):
        information[-1, -1] += plan.told["lag_std"] ** -2
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    value, vector = np.linalg.eigh(scale[:, None] * information * scale)
    variance = np.where(value > 1e-12 * value[-1], 1 / np.maximum(value, 1e-300), _NOTHING)
    covariance = scale[:, None] * (vector * variance) @ vector.T * scale
    again = plan.repeats**2 / max(log.dense.contact.sum() * log.dense.dt, 1.0)
    arm = plan.told.get("series_std", 0.0) * (stiff / r.series) ** 2 / stiff
    # K k/(k - K) of the apparent K: dK/dk = -(K/k)^2; B and M with twice the relative error.
    spread = {"K": again + arm**2, "B": again + 4 * arm**2, "M": again + 4 * arm**2}
    return {
        name: 1.96 * float(np.sqrt(covariance[i, i] + spread[name] * plan.surface[name] ** 2))
        for i, name in enumerate(names)
    }


def columns_of(log: Log, names: list[str]) -> tuple[Array, NDArray[np.intp]]:
    """What a unit of each parameter adds to the fresh readings in contact, an offset and the rest that is not known."""
    plan, r, dense = log.plan, log.plan.recording, log.dense
    v = np.gradient(dense.depth, dense.dt)
    a = np.gradient(v, dense.dt)
    j = np.gradient(a, dense.dt)
    s = plan.surface
    per_name = {"K": dense.depth, "B": v, "M": a}
    late = -(s["K"] * v + s["B"] * a + s["M"] * j)
    parts = [
        np.where(dense.contact, r.low_passed(c, dense.dt), 0.0) for c in [*map(per_name.get, names), late]
    ]
    step = max(r.hold_force, r.hold_position) / r.rate
    times = np.arange(int(len(dense.depth) * dense.dt / step) - 2) * step + dense.dt
    read = [at_times(part, times - r.lag, dense.dt) for part in parts]
    touched = at_times(dense.contact.astype(float), times, dense.dt) > 0.99
    below = at_times(dense.force, times, dense.dt) + r.bias < r.range
    rows = np.flatnonzero(touched & below)
    columns = [*read[:-1], np.ones_like(times)]
    if r.drift:
        columns.append(times / times[-1])
    if "lag" not in plan.told or plan.told.get("lag_std"):
        columns.append(read[-1])
    return np.column_stack(columns)[rows], rows
