"""From a record to an Identification: the whole way, step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.errors import InputError, unknown
from palpate.identification.choosing import Choice, Question, choose, with_mass
from palpate.identification.contacts import Contacts
from palpate.identification.estimators.fit import Fit, fit
from palpate.identification.estimators.methods import LEAST_SQUARES, METHODS, estimated_by
from palpate.identification.filters.bandwidth import highest_motion
from palpate.identification.filters.state_variable import Chain
from palpate.identification.hidden_mass import hidden_mass
from palpate.identification.in_series import take_out
from palpate.identification.judging import below_zero
from palpate.identification.lagging import closing_lag, flat_between
from palpate.identification.matching import matched_question, samples_of
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS
from palpate.identification.preparing import filter_and_contacts, question_of, thinned
from palpate.identification.prior import Lag
from palpate.identification.reporting import nothing, report
from palpate.identification.result import Identification, Verdict
from palpate.identification.sampling import Channels, channels_of, held_force
from palpate.identification.verdicts import Terms
from palpate.identification.warning_codes import Code, Warn
from palpate.records import Record
from palpate.signals.low_pass import LowPass

_MOST_SAMPLES = 2_000_000
_FOLLOWS = 0.3
_FOLLOWS_CLEARLY = 0.5


def identify(
    record: Record,
    *,
    model: str | None = None,
    lag: float | None = None,
    lag_std: float = 0.0,
    tolerance: float = 0.25,
    calibration: float = 0.0,
    series_stiffness: float | None = None,
    series_std: float = 0.0,
    bonded: bool | None = None,
    cutoff: float | None = None,
    force_filter: LowPass | str | None = None,
    mass: tuple[float, float] | None = None,
    method: str = LEAST_SQUARES,
) -> Identification:
    """Find what a probe touched, and how far to trust it.

    f = M a + B v + K x + offset and its relatives are fitted to the stretches in contact, with one and the same filter
    chain on every channel. Each parameter gets a verdict; a number that the log does not carry is not given.

    Args:
        record: with the columns `time` [s], `position` [m] and `force` [N], of shape (n,); NaN means no reading.
        model: kelvin-voigt, kelvin-voigt-mass, standard-linear-solid or hunt-crossley; None to choose.
        lag: how much later the force is read than the position [s], if it is calibrated.
        lag_std: standard deviation of that [s].
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        series_stiffness: of what lies between the position sensor and the surface [N/m]; it is taken out.
        series_std: standard deviation of that [N/m].
        bonded: True if the probe is fixed to the surface, False if it is not, None to find out.
        cutoff: of the filter chain [Hz]; None to choose.
        force_filter: what the force sensor low-passes the force with before it is sampled, as `butterworth3:120`.
            The position then goes through the same, and is read at the sensor's own samples. The lag, if it is given,
            is that of a fresh reading, this low-pass included.
        mass: what is known of the mass beforehand, value and standard deviation [kg]; 0 fixes it.
        method: least-squares; instrumental-variables or output-error, where noise of the position would pull it.

    Raises:
        InputError: the record or an argument is wrong, in one line.
    """
    _check(tolerance, calibration, lag, lag_std, series_stiffness, series_std, cutoff)
    _check_mass(mass)
    _check_method(method, force_filter is not None)
    low_pass = LowPass.parse(force_filter) if isinstance(force_filter, str) else force_filter
    if low_pass is not None and not low_pass.sections:
        low_pass = None
    channels = channels_of(record)
    _check_lag(lag, channels)
    if low_pass is None:
        channels = thinned(channels, -(-len(channels.position) // _MOST_SAMPLES))
    warnings = channels.warnings
    if series_stiffness is not None:
        channels = take_out(channels, series_stiffness, bonded, cutoff)
    samples = samples_of(channels, held_force(record, channels), low_pass) if low_pass is not None else None
    channels, chain, contacts = filter_and_contacts(channels, bonded, cutoff)
    of_time = tuple(warnings)
    warnings += contacts.warnings
    terms = Terms(
        tolerance, calibration, (series_stiffness, series_std) if series_stiffness else None,
        record.units["force"], record.units["position"], lags=False,
    )  # fmt: skip
    if not contacts.spans:
        return nothing(channels, chain, terms, model or "kelvin-voigt")
    known = Lag(lag or 0.0, lag_std, lag is not None, mass)
    if samples is not None:
        question = matched_question(samples, contacts, chain, channels, known, tolerance)
        choice = with_mass(choose(question, model), model)
        terms = replace(terms, band=highest_motion(question.motion))
        found = report(channels, chain, contacts, question, choice, terms, model)
        return (
            found if contacts.bonded else _nothing_in_noise(found, contacts, channels, chain, terms, of_time)
        )
    question = question_of(channels, chain, contacts, known, tolerance)
    terms = replace(terms, band=highest_motion(question.motion))
    choice = choose(question, model)
    if choice.rejected and contacts.bonded and _reversed(choice):
        channels.force = -channels.force
        text = "stiffness and mass are both below zero: the force's sign was turned round"
        warnings.append(Warn(Code.FORCE_SIGN_REVERSED, text))
        question = question_of(channels, chain, contacts, known, tolerance)
        choice = choose(question, model)
    if contacts.bonded and _unrelated(choice):
        text = "the force does not follow the position: nothing seems to be touched"
        warnings.append(Warn(Code.NO_CONTACT, text))
        return nothing(channels, chain, terms, model or "kelvin-voigt")
    plain = _negative_damping(choice, question)
    if plain is not None:
        question, choice = _at_lag(plain, choice, question, model, warnings)
        terms = replace(terms, lags=True, bent=abs(choice.candidate.fit["K"] - plain["K"]))
    elif not choice.rejected:
        terms = replace(terms, hidden=hidden_mass(choice.candidate.fit, question))
    candidate = estimated_by(method, choice.candidate, contacts.force_sign * channels.force)
    found = report(channels, chain, contacts, question, replace(choice, candidate=candidate), terms, model)
    return _nothing_in_noise(found, contacts, channels, chain, terms, of_time)


def _nothing_in_noise(
    found: Identification,
    contacts: Contacts,
    channels: Channels,
    chain: Chain,
    terms: Terms,
    of_time: tuple[Warn, ...],
) -> Identification:
    """What was found; or no contact, if the force hardly stands above its noise and does not follow the position."""
    sure = any(p.verdict is Verdict.IDENTIFIED for p in found.parameters.values())
    if contacts.clear or found.r2 >= (_FOLLOWS if sure else _FOLLOWS_CLEARLY):
        return found
    text = "the force hardly leaves its noise and does not follow the position: nothing seems to be touched"
    channels.warnings[:] = [*of_time, Warn(Code.NO_CONTACT, text)]
    return nothing(channels, chain, terms, found.model)


def _check_lag(lag: float | None, channels: Channels) -> None:
    span = len(channels.position) * channels.dt
    if lag is not None and abs(lag) >= span:
        raise InputError(
            f"the lag of {lag:g} s is as long as the whole log ({span:.3g} s); give it in seconds"
        )


def _check_method(method: str, matched: bool) -> None:
    if method not in METHODS:
        raise unknown("method", method, METHODS)
    if method != LEAST_SQUARES and matched:
        raise InputError(
            f"a known force filter is for {LEAST_SQUARES}: leave --force-filter out for {method}"
        )


def _check_mass(mass: tuple[float, float] | None) -> None:
    if mass is not None and not all(np.isfinite(number) and number >= 0 for number in mass):
        raise InputError(f"the mass and its std must be 0 or more, got {mass[0]:g} and {mass[1]:g}")


def _check(
    tolerance: float,
    calibration: float,
    lag: float | None,
    lag_std: float,
    series: float | None,
    series_std: float,
    cutoff: float | None,
) -> None:
    if not 0 < tolerance <= 1:
        raise InputError(f"the tolerance must be in (0, 1], got {tolerance:g}; 0.25 means 25 %")
    for name, value in (
        ("calibration", calibration),
        ("lag's std", lag_std),
        ("series stiffness' std", series_std),
    ):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"the {name} must be 0 or more, got {value:g}")
    if calibration >= 1:
        raise InputError(f"the calibration must be below 1, got {calibration:g}; 0.01 means 1 %")
    if lag is not None and not np.isfinite(lag):
        raise InputError(f"the lag must be a number of seconds, got {lag:g}")
    for name, positive in (("series stiffness", series), ("cut-off", cutoff)):
        if positive is not None and not (np.isfinite(positive) and positive > 0):
            raise InputError(f"the {name} must be above 0, got {positive:g}")


def _reversed(choice: Choice) -> bool:
    best = min((c.fit for c in choice.others if "M" in c.fit.names), key=lambda fitted: fitted.rmse)
    return {"K", "M"} <= set(below_zero(best))


def _unrelated(choice: Choice) -> bool:
    return max(c.fit.r2 for c in choice.others) < _FOLLOWS


def _negative_damping(choice: Choice, question: Question) -> Fit | None:
    """The fit without a lag, if it finds a damping below zero by more than chance and nobody has calibrated the lag."""
    if question.lag.known:
        return None
    with_mass = "M" in choice.candidate.fit.names
    model = KELVIN_VOIGT_MASS if with_mass else KELVIN_VOIGT
    plain = fit(model, question.motion, question.force, Lag())
    return plain if plain["K"] > 0 and plain["B"] + 4 * plain.std("B") < 0 else None


def _at_lag(
    plain: Fit, choice: Choice, question: Question, model: str | None, warnings: list[Warn]
) -> tuple[Question, Choice]:
    """Judge again with the lag that the log tells, or else with that at which loading and unloading coincide."""
    told = choice.candidate.fit
    if not choice.rejected and told["B"] >= 0 and told.lag > 0:
        hidden = hidden_mass(told, question)
        more = hidden.shifts["lag"] / told.t if hidden else 0.0
        value, std, least, flat = told.lag, float(np.hypot(told.std("lag"), more)), "", ""
    else:
        value, std = closing_lag(question.motion, question.force, -plain["B"] / plain["K"], question.spans)
        low, high = flat_between(question.motion, question.force, value, std)
        least = "at least "
        flat = f", while the misfit is flat (to a thousandth) from {low:.2g} to {high:.2g} s"
    text = (
        f"without a lag the fit gives B = {plain['B']:.3g}, below zero: the force is read {least}"
        f"{value:.3g} s (std {std:.2g} s) after the position{flat}; B is refused until the lag is calibrated (--lag)"
    )
    warnings.append(Warn(Code.FORCE_LAGS_POSITION, text))
    shifted = replace(question, lag=Lag(value, std))
    return shifted, choose(shifted, model or (plain if flat else told).model.name)
