"""Batch estimators by name: what the model chosen by least squares is worth to another one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError, unknown
from palpate.identification.estimators.fit import Fit
from palpate.identification.estimators.instrumental_variables import ORDERS, refined_instrumental
from palpate.identification.estimators.least_squares import noise_of
from palpate.identification.estimators.output_error import output_error
from palpate.identification.judging import Candidate, Question
from palpate.signals.types import Estimate

Array = NDArray[np.float64]

LEAST_SQUARES = "least-squares"
METHODS = (LEAST_SQUARES, "instrumental-variables", "output-error")
"""Least squares on the force; refined instrumental variables, where the position is the noisier channel; output error,
the same by simulation, which takes a curved spring too."""


def estimated_by(method: str, candidate: Candidate, force: Array) -> Candidate:
    """The candidate with the parameters that another estimator finds in the longest of its contacts.

    Args:
        method: of `METHODS`.
        candidate: fitted by least squares, which is where output error starts.
        force: as read, at the samples of the motion's position, shape (n,) [N].

    Raises:
        InputError: no such method, or one that cannot fit this model.
    """
    if method not in METHODS:
        raise unknown("method", method, METHODS)
    if method == LEAST_SQUARES:
        return candidate
    if len(force) != len(candidate.question.motion.position):
        raise ValueError(f"force and position must be of one grid, got {len(force)} readings for the force")
    inside = _longest(candidate.question)
    position = candidate.question.motion.position[inside]
    time: Array = np.arange(len(position), dtype=np.float64) * candidate.question.motion.chain.dt
    by = _by_instruments if method == "instrumental-variables" else _by_simulation
    return replace(candidate, fit=_with(candidate, by(candidate.fit, time, force[inside], position)))


def _longest(question: Question) -> slice:
    """The samples of the longest contact."""
    numbers, counts = np.unique(question.spans, return_counts=True)
    own = question.motion.rows[question.spans == numbers[np.argmax(counts)]]
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


def _with(candidate: Candidate, estimate: Estimate) -> Fit:
    """The fit with another's parameters, and what they leave of the filtered force."""
    fitted, question = candidate.fit, candidate.question
    theta, cov = fitted.theta.copy(), fitted.cov.copy()
    places = [fitted.names.index(name) for name in estimate.names]
    theta[places] = estimate.theta
    cov[np.ix_(places, places)] = estimate.covariance
    knobs = {knob.name: float(theta[fitted.names.index(knob.name)]) for knob in fitted.model.knobs}
    columns = np.column_stack(fitted.model.columns(question.motion, knobs, fitted.lag))
    predicted = columns @ theta[: len(fitted.model.linear)]
    residuals = question.force - predicted
    rmse = float(np.sqrt(np.mean(residuals**2)))
    return replace(
        fitted, theta=theta, cov=cov, fixed_cov=cov, predicted=predicted, residuals=residuals, rmse=rmse,
        r2=1 - rmse**2 / float(np.var(question.force)), attenuation=np.zeros(len(theta)),
        noise=replace(noise_of(residuals, question.motion.rows, len(theta)), effective=estimate.samples),
    )  # fmt: skip
