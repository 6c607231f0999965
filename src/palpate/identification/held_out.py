"""How well a model predicts the parts of a log that it was not fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.estimators.fit import Fit, fit
from palpate.identification.models import Motion, on_rows
from palpate.identification.prior import Lag

Array = NDArray[np.float64]

_BLOCKS = 20
_FOLDS = 5


def held_out(fitted: Fit, motion: Motion) -> Array:
    """What each row's prediction by the other rows' parameters misses, shape (n,).

    The rows are cut into twenty blocks, every fifth of which is left out at a time; the parameters move by one step of
    Gauss and Newton, which is exact for those that the model is linear in.

    Args:
        fitted: of all rows.
        motion: at those rows, shape (n,).
    """
    jacobian = _jacobian(fitted, motion)
    gram = jacobian.T @ jacobian
    missed = fitted.residuals.copy()
    fold = (np.arange(len(missed)) * _BLOCKS // len(missed)) % _FOLDS
    for k in range(_FOLDS):
        out = jacobian[fold == k]
        pull = out.T @ fitted.residuals[fold == k]
        missed[fold == k] += out @ np.linalg.lstsq(gram - out.T @ out, pull, rcond=1e-10)[0]
    return missed


def foretold(fitted: Fit, motion: Motion, force: Array) -> Array:
    """What the same model, fitted to loading alone, misses of all the rest; zero while loading. Shape (n,).

    Args:
        fitted: of all rows, for its lag.
        motion: at those rows, shape (n,).
        force: filtered, at those rows, shape (n,).
    """
    speed = motion.moved(1, fitted.lag)
    loading = speed > 0.05 * float(np.percentile(np.abs(speed), 95))
    if loading.sum() < 10 * len(fitted.names) or loading.all():
        return fitted.residuals
    part = on_rows(motion, motion.rows[loading])
    first = fit(fitted.model, part, force[loading], Lag(fitted.lag))
    knobs = {knob.name: first[knob.name] for knob in fitted.model.knobs}
    predicted = (
        np.column_stack(fitted.model.columns(motion, knobs, fitted.lag))
        @ first.theta[: len(fitted.model.linear)]
    )
    return np.where(loading, 0.0, force - predicted)


def _jacobian(fitted: Fit, motion: Motion) -> Array:
    """Of the predicted force by all parameters but the lag, each column of unit length, shape (n, p)."""
    model = fitted.model
    knobs = {knob.name: fitted[knob.name] for knob in model.knobs}
    theta = fitted.theta[: len(model.linear)]

    def columns(changed: dict[str, float]) -> Array:
        return np.column_stack(model.columns(motion, knobs | changed, fitted.lag))

    slopes = []
    for knob in model.knobs:
        step = knob.step * (knobs[knob.name] if knob.logarithmic else 1.0)
        up, down = (columns({knob.name: knobs[knob.name] + sign * step}) for sign in (1, -1))
        slopes.append((up - down) @ theta / (2 * step))
    jacobian = np.column_stack([columns({}), *slopes])
    size = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    size[size == 0] = 1.0
    return jacobian / size
