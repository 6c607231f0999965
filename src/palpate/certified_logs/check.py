"""Checks solvers against the certified logs: the digits in which each parameter and its deviation agree."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf, log10
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.certified_logs.models import FLOATS, CertifiedProblem, SineMotion, motion_and_force
from palpate.identification.descent import Descent
from palpate.identification.least_squares import solve
from palpate.identification.models import Model, NonlinearParameter

CERTIFIED_DIGITS = 11.0
"""Certified digits."""
REQUIRED_DIGITS = 8.0
"""Digits that a solver of double precision is asked for, as by NIST's StRD for easy problems."""
_ROUNDS = 40
_STEP = 3e-3
"""Step of a nonlinear parameter over its size: a difference of fourth order is exact to 1e-12 there."""


class SolverResult(NamedTuple):
    """Parameters by name, and their standard deviations; none of a solver that gives none."""

    values: dict[str, float]
    std: dict[str, float]


@dataclass(frozen=True)
class Score:
    """Digits of one solver on one log from one start.

    Args:
        problem: which log.
        solver: which.
        start: 0 or 1.
        digits: log relative error of the worst parameter, from 0 to 11.
        digits_std: that of the worst standard deviation; None of a solver that gives none.
    """

    problem: CertifiedProblem
    solver: str
    start: int
    digits: float
    digits_std: float | None


def digits_of(value: float, certified: float) -> float:
    """Log relative error -log10(|value - certified|/|certified|), between 0 and 11 (McCullough, 1998)."""
    if not np.isfinite(value):
        return 0.0
    error = abs(value - certified) / abs(certified)
    return min(max(-log10(error) if error > 0.0 else inf, 0.0), CERTIFIED_DIGITS)


def palpate_solver(problem: CertifiedProblem, start: dict[str, float]) -> SolverResult:
    """The search of `palpate identify`, without its filters, until the sum of squares stands."""
    path, force = motion_and_force(problem)
    law = problem.law

    def columns(_motion: Any, nonlinear: dict[str, float], _lag: float) -> list[Array]:
        return law.columns(path, nonlinear, FLOATS)

    outer = tuple(
        NonlinearParameter(name, (value,), *_range(problem, name), _STEP * _size(problem, name))
        for name, value in start.items()
    )
    search = Descent(Model(problem.model, law.linear, columns, outer), None, force, 0.0)  # type: ignore[arg-type]
    point = search.at(start)
    for _ in range(_ROUNDS if outer else 0):
        before = point
        point = search.from_point(point)
        if before.nonlinear == point.nonlinear:
            break
    values = dict(zip(law.linear, point.theta.tolist(), strict=True)) | point.nonlinear
    return SolverResult(values, _deviations(problem, path, force, values))


def scipy_solver(problem: CertifiedProblem, start: dict[str, float]) -> SolverResult:
    """`scipy.optimize.least_squares`, method "lm", tolerances of 1e-15, all parameters at once."""
    from scipy.optimize import least_squares

    path, force = motion_and_force(problem)
    law = problem.law
    names = [*problem.law.linear, *problem.law.nonlinear]
    theta = solve(np.column_stack(law.columns(path, start, FLOATS)), force)
    first = np.array([*theta, *start.values()])

    def residual(p: Array) -> Array:
        at = dict(zip(names, p.tolist(), strict=True))
        parts = zip(law.linear, law.columns(path, at, FLOATS), strict=True)
        return sum((at[k] * c for k, c in parts), -force)

    with np.errstate(all="ignore"):  # a step out of the model's domain has no digits
        done = least_squares(residual, first, method="lm", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        values = dict(zip(names, done.x.tolist(), strict=True))
        return SolverResult(values, _deviations(problem, path, force, values))


def lstsq_solver(problem: CertifiedProblem, _start: dict[str, float]) -> SolverResult:
    """`numpy.linalg.lstsq`, of a linear model."""
    path, force = motion_and_force(problem)
    theta = np.linalg.lstsq(_regressors(problem, path), force, rcond=None)[0]
    values = dict(zip(problem.law.linear, theta.tolist(), strict=True))
    return SolverResult(values, _deviations(problem, path, force, values))


def recursive_solver(problem: CertifiedProblem, _start: dict[str, float]) -> SolverResult:
    """`palpate.identifiers.RecursiveLeastSquares` of a linear model, a row at a time, from zero."""
    from palpate.identifiers import RecursiveLeastSquares

    path, force = motion_and_force(problem)
    columns = _regressors(problem, path)
    size = np.sqrt((columns**2).mean(axis=0))
    p = columns.shape[1]
    estimator = RecursiveLeastSquares(np.zeros(p), 1e16 * np.eye(p))
    for row, value in zip(columns / size, force, strict=True):
        estimator.update(row, value)
    values = dict(zip(problem.law.linear, (estimator.theta / size).tolist(), strict=True))
    return SolverResult(values, {})


Solver = Callable[[CertifiedProblem, dict[str, float]], SolverResult]
SOLVERS: dict[str, Solver] = {
    "palpate": palpate_solver,
    "scipy least_squares": scipy_solver,
    "numpy lstsq": lstsq_solver,
    "palpate recursive": recursive_solver,
}
LINEAR = {"numpy lstsq", "palpate recursive"}
"""Solvers of linear models alone."""


def scores(problem: CertifiedProblem, solver: str) -> Iterator[Score]:
    """Digits of a solver from each start; none where it does not take the model."""
    if problem.starts and solver in LINEAR:
        return
    for number in range(2 if problem.starts else 1):
        start = {name: float(both[number]) for name, both in problem.starts.items()}
        solution = SOLVERS[solver](problem, start)
        certified = problem.certified
        digits = min(digits_of(solution.values[k], float(c.value)) for k, c in certified.items())
        std = [digits_of(v, float(certified[k].std)) for k, v in solution.std.items()]
        yield Score(problem, solver, number, digits, min(std) if std else None)


def _size(problem: CertifiedProblem, name: str) -> float:
    """Order of a nonlinear parameter: the larger of its starts."""
    return max(abs(float(text)) for text in problem.starts[name])


def _range(problem: CertifiedProblem, name: str) -> tuple[float, float]:
    """Range of a nonlinear parameter: between its starts, and as far beyond either."""
    low, high = (float(text) for text in problem.starts[name])
    return 2.0 * low - high, 2.0 * high - low


def _regressors(problem: CertifiedProblem, path: SineMotion) -> Array:
    """Columns of a linear model, shape (n, p)."""
    return np.column_stack(problem.law.columns(path, {}, FLOATS))


def _deviations(
    problem: CertifiedProblem, path: SineMotion, force: Array, values: dict[str, float]
) -> dict[str, float]:
    """Standard deviations by the Jacobian, of differences of fourth order in the nonlinear parameters."""
    law = problem.law
    columns = law.columns(path, values, FLOATS)

    def predict(at: dict[str, float]) -> Array:
        return sum(
            (at[k] * c for k, c in zip(law.linear, law.columns(path, at, FLOATS), strict=True)), 0.0 * force
        )

    for name in law.nonlinear:
        h = 0.1 * _STEP * _size(problem, name)
        beside = [predict({**values, name: values[name] + k * h}) for k in (1, -1, 2, -2)]
        columns.append((8.0 * (beside[0] - beside[1]) - (beside[2] - beside[3])) / (12.0 * h))
    jacobian = np.column_stack(columns)
    size = np.sqrt((jacobian**2).sum(axis=0))
    residual = force - predict(values)
    variance = float(residual @ residual) / (len(force) - jacobian.shape[1])
    R = np.linalg.qr(jacobian / size, mode="r")
    spread = np.sqrt((np.linalg.inv(R) ** 2).sum(axis=1) * variance) / size
    return dict(zip([*law.linear, *law.nonlinear], spread.tolist(), strict=True))
