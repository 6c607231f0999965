"""From the model chosen to the Identification that a user gets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.identification.choosing import Choice, Question
from palpate.identification.contacts import Contacts
from palpate.identification.estimators.fit import fit
from palpate.identification.filters.sensor_path import SensorPath
from palpate.identification.filters.state_variable import Chain, block_means
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.identification.result import Comparison, Identification, Parameter, Traces, Verdict
from palpate.identification.sampling import Channels
from palpate.identification.verdicts import Terms, unit_of, verdicts
from palpate.identification.warning_codes import Code, Warn
from palpate.signals import Estimate
from palpate.units import impedance_units

_SOFTEST, _STIFFEST = 1.0, 1e8
_DEEPEST = 0.5
"""No press goes deeper [m]."""
_SHOWN = 50_000
"""Samples of each trace: what is more is thinned, and averaged where it was fitted."""


def report(
    channels: Channels,
    chain: Chain,
    contacts: Contacts,
    question: Question,
    choice: Choice,
    terms: Terms,
    model: str | None,
) -> Identification:
    """Pass the verdicts, and say everything there is to know; warnings are collected in the channels' list."""
    fitted, own = choice.candidate.fit, choice.candidate.question
    warnings = channels.warnings
    if choice.rejected:
        seen = "; ".join(choice.candidate.against[:3]) or "its parameters make no sense"
        text = f"{fitted.model.name} does not describe this log: {seen}{_instead(choice)}"
        warnings.append(Warn(Code.MODEL_REJECTED, text))
    parameters = verdicts(choice, question.lag, terms, warnings)
    if model is None and "M" not in parameters:
        parameters = _with_mass(parameters, choice, question, terms)
    warnings += _curved(choice) + _doubtful_units(parameters, terms) + _doubtful_depth(question, terms)
    traces = _traces(channels, chain, contacts, own, choice, terms)
    return Identification(
        model=fitted.model.name,
        parameters=parameters,
        contacts=tuple(_clock(channels, chain, contacts, span) for span in contacts.spans),
        lag=_lag_said(question, choice, terms),
        r2=fitted.r2,
        rmse=fitted.rmse,
        n=len(own.force),
        warnings=tuple(warnings),
        comparison=tuple(
            Comparison(c.label, c.fit.r2, c.fit.rmse, "; ".join(c.against), c.held_out, c.whiteness.p)
            for c in choice.others
        ),
        cutoff=question.motion.chain.cutoff,
        traces=traces,
        estimate=Estimate(fitted.names, fitted.theta, fitted.cov, fitted.noise.effective),
    )


def _instead(choice: Choice) -> str:
    closest = min(choice.others, key=lambda c: c.fit.rmse)
    if closest.fit.model is choice.candidate.fit.model:
        return ""
    name = closest.label
    blame = f", but {closest.against[0]}" if closest.against else ""
    return f"; closest is {name} (R2 {closest.fit.r2:.4f}{blame})"


def _with_mass(
    parameters: dict[str, Parameter], choice: Choice, question: Question, terms: Terms
) -> dict[str, Parameter]:
    """Say about the mass what the model with a mass finds, at its own lag or else at that of the model chosen."""
    mass = next((c.fit for c in choice.others if c.fit.model is KELVIN_VOIGT_MASS), None)
    if mass is None:
        return parameters
    unit = unit_of("M", mass, terms)
    chosen = choice.candidate.fit
    if chosen.model.name != "kelvin-voigt" or choice.rejected:
        reason = f"{chosen.model.name} has no mass"
    elif terms.hidden:
        most = f"{terms.hidden.mass:.3g} {unit}"
        reason = f"the log does not show a mass (95 %: 0 to {most}, which would look like a lag)"
    else:
        if mass.lag == question.lag.value != chosen.lag:  # the log tells no lag to the model with a mass
            lag = replace(question.lag, value=chosen.lag)
            mass = fit(KELVIN_VOIGT_MASS, question.motion, question.force, lag)
        half = mass.t * mass.std("M")
        reason = (
            f"the log does not show a mass (95 %: {mass['M'] - half:.3g} to {mass['M'] + half:.3g} {unit})"
        )
    return parameters | {"M": Parameter(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, reason)}


def _curved(choice: Choice) -> list[Warn]:
    fitted = choice.candidate.fit
    if "K3" not in fitted.names:
        return []
    text = "the stiffness changes with the position (K2 x^2 + K3 x^3); K is its value at the mean position"
    return [Warn(Code.NONLINEAR_STIFFNESS, text)]


def _doubtful_depth(question: Question, terms: Terms) -> list[Warn]:
    """A press of metres is one of millimetres whose unit was not given."""
    deep = float(np.ptp(question.motion.position[question.motion.rows]))
    if terms.position_unit != "m" or deep <= _DEEPEST:
        return []
    text = f"the probe moves by {deep:.3g} m in contact: is the position in mm? then say NAME:mm"
    return [Warn(Code.UNIT_GUESS, text)]


def _doubtful_units(parameters: dict[str, Parameter], terms: Terms) -> list[Warn]:
    warnings = []
    stiffness = parameters["K"].value if "K" in parameters else None
    if stiffness is not None and parameters["K"].unit == "N/m" and not _SOFTEST <= stiffness <= _STIFFEST:
        text = (
            f"K = {stiffness:.3g} N/m lies outside 1 N/m to 100 MN/m: is a unit off, as by a factor of 1000?"
        )
        warnings.append(Warn(Code.UNIT_GUESS, text))
    if stiffness is not None and terms.series and stiffness > terms.series[0] / 3:
        text = f"K = {stiffness:.3g} against {terms.series[0]:.3g} N/m in series with it: K rests on that calibration"
        warnings.append(Warn(Code.SERIES_COMPLIANCE, text))
    return warnings


def _lag_said(question: Question, choice: Choice, terms: Terms) -> tuple[float, float] | None:
    fitted = choice.candidate.fit
    if question.lag.known:
        told = question.lag.value != 0 or question.lag.std > 0
        return (question.lag.value, question.lag.std) if told else None
    told = not choice.rejected and fitted.std("lag") < 0.5 * question.lag.std
    more = terms.hidden.shifts["lag"] / fitted.t if terms.hidden else 0.0
    return (fitted.lag, float(np.hypot(fitted.std("lag"), more))) if told else None


def _clock(
    channels: Channels, chain: Chain, contacts: Contacts, span: tuple[int, int]
) -> tuple[float, float]:
    """Times of a contact on the log's own clock: the filter's delay is taken off."""
    delay = 0.0 if contacts.bonded else chain.delay
    begin, end = (channels.start + i * channels.dt - delay for i in span)
    return max(float(begin), channels.start), float(end)


def nothing(channels: Channels, chain: Chain, terms: Terms, model: str) -> Identification:
    """There is no contact: every parameter without a number."""
    reason = "there is no contact in this log"
    units = impedance_units(terms.force_unit, terms.position_unit)
    parameters = {
        name: Parameter(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, reason)
        for name, unit in units.items()
    }
    return Identification(
        model,
        parameters,
        (),
        None,
        float("nan"),
        float("nan"),
        0,
        tuple(channels.warnings),
        cutoff=chain.cutoff,
        traces=_untouched(channels, chain, terms),
    )


def _untouched(channels: Channels, chain: Chain, terms: Terms) -> Traces:
    """The force of a log in which nothing is touched: seen, it says why."""
    step = max(len(channels.force) // _SHOWN, 1)
    none = np.empty(0)
    time, force = channels.time - chain.delay, chain(channels.force)
    return Traces(
        time[::step], force[::step], none, none, none, none,
        position_unit=terms.position_unit, force_unit=terms.force_unit,
    )  # fmt: skip


def _traces(
    channels: Channels, chain: Chain, contacts: Contacts, question: Question, choice: Choice, terms: Terms
) -> Traces:
    fitted = choice.candidate.fit
    step = max(len(channels.position) // _SHOWN, 1)
    size = max(len(question.force) // _SHOWN, 1)
    time = channels.time - chain.delay
    linear = fitted.model.linear
    knobs = {knob.name: fitted[knob.name] for knob in fitted.model.knobs}
    columns = fitted.model.columns(question.motion, knobs, fitted.lag)
    return Traces(
        time=time[::step],
        force=chain(contacts.force_sign * channels.force)[::step] - question.resting,
        fitted_time=block_means(_fitted_time(time, question), size),
        fitted_position=block_means(question.motion.moved(0, fitted.lag), size),
        fitted_force=block_means(question.force, size),
        predicted=block_means(fitted.predicted, size),
        columns={name: block_means(c, size) for name, c in zip(linear, columns, strict=True)},
        theta={name: fitted[name] for name in linear},
        beforehand={"M": question.lag.mass[1]} if question.lag.mass and "M" in linear else {},
        matched=question.motion.matched,
        position_unit=terms.position_unit,
        force_unit=terms.force_unit,
    )


def _fitted_time(time: np.ndarray, question: Question) -> np.ndarray:
    """When the rows of the fit were: those of the filtered log, or the force sensor's own samples [s]."""
    chain, rows = question.motion.chain, question.motion.rows
    return chain.start + chain.instants[rows] * chain.dt if isinstance(chain, SensorPath) else time[rows]
