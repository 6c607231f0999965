"""Batch estimators by name: what the model chosen by least squares is worth to another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.estimators.answer import Answer
from palpate.identification.estimators.fit import Fit, fit
from palpate.identification.estimators.instrumental_variables import ORDERS, refined_instrumental
from palpate.identification.estimators.output_error import output_error
from palpate.identification.least_squares import noise_of
from palpate.identification.options import LEAST_SQUARES
from palpate.identification.problem import Problem
from palpate.identification.sampling import Channels
from palpate.signals.types import Estimate


def estimated_by(method: str, answer: Answer, problem: Problem, channels: Channels) -> Fit:
    """The fit that holds if the model does.

    Args:
        method: of `METHODS`; all but least squares work on the longest of the contacts.
        answer: whose model it is of; its lag is where the search for it begins.
        problem: what it is fitted to.
        channels: as read; the force at the samples of the motion's position.

    Raises:
        InputError: a method that cannot fit this model.
    """
    fitted = fit(answer.fit.model, problem.motion, problem.force, problem.lag, answer.fit.lag)
    if method == LEAST_SQUARES:
        return fitted
    force = problem.contacts.force_sign * channels.force
    inside = _longest(problem)
    position = problem.motion.position[inside]
    time: Array = np.arange(len(position), dtype=np.float64) * problem.motion.chain.period
    by = _by_instruments if method == "instrumental-variables" else _by_simulation
    return _with(fitted, problem, by(fitted, time, force[inside], position))


def _longest(problem: Problem) -> slice:
    """The samples of the longest contact."""
    numbers, counts = np.unique(problem.spans, return_counts=True)
    own = problem.motion.rows[problem.spans == numbers[np.argmax(counts)]]
    return slice(int(own[0]), int(own[-1]) + 1)


def _by_instruments(fitted: Fit, time: Array, force: Array, position: Array) -> Estimate:
    extra = [name for name in ("K2", "K3", "Fc", "x0") if name in fitted.names]
    if fitted.model.name not in ORDERS or extra:
        what = fitted.model.name + (f" with {', '.join(extra)}" if extra else "")
        raise InputError(
            f"instrumental variables cannot fit {what}, only {', '.join(ORDERS)} in steady contact:"
            " name one with --model, or take another method"
        )
    return refined_instrumental(time, force, position, model=fitted.model.name, lag=fitted.lag)


def _by_simulation(fitted: Fit, time: Array, force: Array, position: Array) -> Estimate:
    strange = [name for name in fitted.names if name not in ("M", "B", "K", "K2", "K3", "offset", "lag")]
    if "M" not in fitted.names or strange:
        raise InputError(
            f"output error simulates a mass on a spring, and {fitted.model.name} has"
            f" {'no mass' if not strange else ', '.join(strange)}: ask for --model kelvin-voigt-mass"
        )
    start = {name: fitted[name] for name in fitted.names}
    if "K3" not in fitted.names:  # whatever noise has made of least squares, this is near
        found = refined_instrumental(time, force, position, lag=fitted.lag)
        start |= dict(zip(found.names, found.theta, strict=True))
    if start["M"] <= 0:
        raise InputError(
            f"output error needs a mass to simulate, and this log shows none (M = {start['M']:.3g}); take least-squares"
        )
    return output_error(time, force, position, start, free=fitted.model.linear)


def _with(fitted: Fit, problem: Problem, estimate: Estimate) -> Fit:
    """The fit with another's parameters, and what they leave of the filtered force."""
    theta, cov = fitted.theta.copy(), fitted.cov.copy()
    places = [fitted.names.index(name) for name in estimate.names]
    theta[places] = estimate.theta
    cov[np.ix_(places, places)] = estimate.covariance
    nonlinear = {
        parameter.name: float(theta[fitted.names.index(parameter.name)])
        for parameter in fitted.model.nonlinear
    }
    columns = np.column_stack(fitted.model.columns(problem.motion, nonlinear, fitted.lag))
    predicted = columns @ theta[: len(fitted.model.linear)]
    residuals = problem.force - predicted
    rmse = float(np.sqrt(np.mean(residuals**2)))
    return replace(
        fitted, theta=theta, cov=cov, fixed_cov=cov, predicted=predicted, residuals=residuals, rmse=rmse,
        r2=1 - rmse**2 / float(np.var(problem.force)), attenuation=np.zeros(len(theta)),
        noise=replace(noise_of(residuals, problem.motion.rows, len(theta)), effective=estimate.samples),
    )  # fmt: skip
