"""A model fitted to a log by least squares in time, were it exactly true and its noise the force's alone.

Linear parameters inside (variable projection: Golub and Pereyra, 1973), the nonlinear by Levenberg and Marquardt
outside.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters import Chain
from palpate.identification.least_squares import solve
from palpate.identification.models import Model, Motion
from palpate.identification.options import LAG

_MAX_STEPS = 30
_CONVERGED_GAIN = 1e-6
_ROUNDING_GAIN = 1e-9
"""Steps at most; relative gains of the cost below which the search ends, and which are rounding."""
_MIN_DAMPING = 1e-9
"""Damping from which a step is whole in every direction: a damped one gains little where parameters are confounded."""

_FOURTH_ORDER = ((2 / 3, 1), (-2 / 3, -1), (-1 / 12, 2), (1 / 12, -2))
"""Weights of a derivative, over the step, and their places in steps."""


@dataclass(frozen=True)
class Point:
    """A model at some nonlinear parameters, with the linear ones, shape (p,), that fit best there.

    The columns of the regression have the shape (n, p), the residuals of the force (n,); rss is the sum of their
    squares.
    """

    nonlinear: dict[str, float]
    columns: Array
    theta: Array
    residuals: Array
    rss: float


@dataclass(frozen=True)
class Descent:
    """The search for a model's parameters: the force is filtered, shape (n,), and its lag behind the motion in [s]."""

    model: Model
    motion: Motion
    force: Array
    lag: float

    def at(self, nonlinear: dict[str, float]) -> Point:
        """The linear parameters that fit best at these nonlinear ones."""
        columns = np.column_stack(self.model.columns(self.motion, nonlinear, self.lag))
        theta = solve(columns, self.force)
        residuals = self.force - columns @ theta
        return Point(nonlinear, columns, theta, residuals, float(residuals @ residuals))

    def best_start(self) -> Point:
        """The best of the start values of the nonlinear parameters."""
        names = [parameter.name for parameter in self.model.nonlinear]
        starts = product(*(parameter.starts for parameter in self.model.nonlinear))
        points = (self.at(dict(zip(names, values, strict=True))) for values in starts)
        return min(points, key=lambda point: point.rss)

    def from_point(self, point: Point) -> Point:
        """The least sum of squares near a point."""
        damping = 1e-3
        for _ in range(_MAX_STEPS):
            jacobian = np.column_stack([point.columns, self.slopes(point)])
            linear = len(point.theta)
            step = _damped_step(jacobian, point.residuals, linear, damping)
            trial = self.at(self._move(point.nonlinear, step[linear:]))
            gain = 1 - trial.rss / point.rss if point.rss else 0.0
            if gain > -_ROUNDING_GAIN:  # the gradient has more digits than the cost: its rounding is taken
                point = trial
                damping = max(damping / 10, _MIN_DAMPING)
                if gain < _CONVERGED_GAIN and damping <= _MIN_DAMPING:
                    break
            elif (damping := 10 * damping) > 1e6:
                break
        return point

    def slopes(self, point: Point) -> Array:
        """Derivatives of the predicted force by each nonlinear parameter, of a logarithmic one by its logarithm.

        Shape (n, parameters).
        """
        derivatives = []
        for parameter in self.model.nonlinear:
            value = point.nonlinear[parameter.name]
            step = parameter.step * value if parameter.logarithmic else parameter.step
            neighbours = [
                (weight, {**point.nonlinear, parameter.name: value + multiple * step})
                for weight, multiple in _FOURTH_ORDER
            ]
            stencil = (
                (weight, self.model.columns(self.motion, parameters, self.lag))
                for weight, parameters in neighbours
            )
            columns = (weight * np.column_stack(parts) for weight, parts in stencil)
            derivatives.append(sum(columns) @ point.theta / parameter.step)
        return np.column_stack(derivatives)

    def about(self, point: Point) -> tuple[dict[str, float], Array]:
        """Return all parameters by name, the lag last, and the derivatives of the force by them, shape (n, p)."""
        linear = dict(zip(self.model.linear, point.theta.tolist(), strict=True))
        size = [point.nonlinear[p.name] if p.logarithmic else 1.0 for p in self.model.nonlinear]
        lag_slope = slope_of_lag(self.model, self.motion, linear, self.lag, point.nonlinear)
        nonlinear = self.slopes(point) / size if size else np.empty((len(self.force), 0))
        return linear | point.nonlinear | {LAG: self.lag}, np.column_stack(
            [point.columns, nonlinear, lag_slope]
        )

    def _move(self, nonlinear: dict[str, float], step: Array) -> dict[str, float]:
        """The nonlinear parameters after a step, within their limits."""
        moved = {}
        for parameter, change in zip(self.model.nonlinear, step, strict=True):
            value = nonlinear[parameter.name]
            unbounded = (
                value * np.exp(np.clip(change, -1.0, 1.0)) if parameter.logarithmic else value + change
            )
            moved[parameter.name] = float(np.clip(unbounded, parameter.low, parameter.high))
        return moved


def slope_of_lag(
    model: Model,
    motion: Motion,
    theta: dict[str, float],
    lag: float,
    nonlinear: dict[str, float] | None = None,
) -> Array:
    """Derivative of the predicted force by the lag [N/s], shape (n,): of a sum of the position's derivatives the next.

    `theta` are the model's linear parameters, `lag` is that of the force [s].
    """
    of_position = not model.nonlinear and {*model.derivatives, "offset"} == {*model.linear}
    if of_position and isinstance(motion.chain, Chain):
        parts = [
            theta.get(name, 0.0) * motion.moved(order + 1, lag) for name, order in model.derivatives.items()
        ]
        return -sum(parts, np.zeros(len(motion.rows)))
    step = 0.02 / motion.chain.rate
    up, down = (model.columns(motion, nonlinear or {}, at) for at in (lag + step, lag - step))
    pairs = zip(model.linear, up, down, strict=True)
    change = sum(
        (theta.get(name, 0.0) * (after - before) for name, after, before in pairs), np.zeros(len(motion.rows))
    )
    return change / (2 * step)


def _damped_step(jacobian: Array, residuals: Array, linear: int, damping: float) -> Array:
    """One step; only the outer parameters are damped, because the linear ones are solved for exactly."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    gram[np.arange(linear, len(scale)), np.arange(linear, len(scale))] += damping
    vector = jacobian.T @ residuals / scale
    return np.asarray(np.linalg.lstsq(gram, vector, rcond=1e-13)[0] / scale)
