"""From a record to an Identification: the whole way, step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.errors import InputError
from palpate.identification.bandwidth import FASTEST, choose_cutoff
from palpate.identification.choosing import Choice, Question, choose
from palpate.identification.codes import Code, Warn
from palpate.identification.contacts import Contacts, find_contacts
from palpate.identification.filters import Chain, block_means, white_noise
from palpate.identification.fitting import Fit, Lag, fit
from palpate.identification.lagging import closing_lag, unknown_lag
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS, Motion
from palpate.identification.result import Comparison, Identification, Parameter, Traces, Verdict
from palpate.identification.timebase import Channels, channels_of
from palpate.identification.verdicts import Terms, unit_of, verdicts
from palpate.records import Record

Array = NDArray[np.float64]

_SOFTEST, _STIFFEST = 1.0, 1e8
_MOST_SAMPLES = 2_000_000
_OVERSAMPLED = 32.0
_LONG = 0.05
_SHOWN = 20_000
_FOLLOWS = 0.1


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

    Raises:
        InputError: the record or an argument is wrong, in one line.
    """
    _check(tolerance, calibration, lag, lag_std, series_stiffness, series_std, cutoff)
    channels = channels_of(record)
    channels = _thinned(channels, -(-len(channels.position) // _MOST_SAMPLES))
    warnings = channels.warnings
    if series_stiffness is not None:
        channels.position = channels.position - channels.force / series_stiffness
    channels, chain, contacts = _contacts(channels, bonded, cutoff)
    warnings += contacts.warnings
    terms = Terms(
        tolerance, calibration, (series_stiffness, series_std) if series_stiffness else None,
        record.units["force"], record.units["position"], lags=False,
    )  # fmt: skip
    if not contacts.spans:
        return _nothing(channels, chain, terms, model or "kelvin-voigt")
    question = _question(channels, chain, contacts, lag, lag_std, tolerance)
    choice = choose(question, model)
    if choice.rejected and contacts.bonded and _reversed(choice):
        channels.force = -channels.force
        text = "stiffness and mass are both below zero: the force's sign was turned round"
        warnings.append(Warn(Code.FORCE_SIGN_REVERSED, text))
        question = _question(channels, chain, contacts, lag, lag_std, tolerance)
        choice = choose(question, model)
    plain = _negative_damping(choice, question)
    if plain is not None:
        question, choice = _at_lag(plain, choice, question, model, warnings)
        terms = replace(terms, lags=True)
    return _report(channels, contacts, question, choice, terms, model)


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
    if lag is not None and not np.isfinite(lag):
        raise InputError(f"the lag must be a number of seconds, got {lag:g}")
    for name, positive in (("series stiffness", series), ("cut-off", cutoff)):
        if positive is not None and not (np.isfinite(positive) and positive > 0):
            raise InputError(f"the {name} must be above 0, got {positive:g}")


def _thinned(channels: Channels, size: int) -> Channels:
    """Average `size` neighbouring samples, in the same way on both channels."""
    if size < 2:
        return channels
    position, force = block_means(channels.position, size), block_means(channels.force, size)
    valid = block_means(channels.valid.astype(float), size) == 1
    start = channels.start + (size - 1) / 2 * channels.dt
    dt = channels.dt * size
    return Channels(start, dt, position, force, valid, min(channels.rate, 1 / dt), channels.warnings)


def _contacts(
    channels: Channels, bonded: bool | None, cutoff: float | None
) -> tuple[Channels, Chain, Contacts]:
    """Find the contacts with the widest filter, choose the filter from them, and find them again with it."""
    highest = FASTEST * channels.rate
    if cutoff is not None and cutoff > 2 * highest:
        raise InputError(
            f"the cut-off must be at most {2 * highest:.4g} Hz, a quarter of the readings per second, got {cutoff:g}"
        )
    chain = Chain(cutoff or highest, channels.dt)
    contacts = find_contacts(channels, chain, bonded)
    if not contacts.spans:
        return channels, chain, contacts
    chosen = cutoff or _chosen_cutoff(channels, contacts)
    if chosen > 0.9 * highest:
        return channels, chain, contacts
    fewer = _thinned(channels, int(1 / (_OVERSAMPLED * chosen * channels.dt)))
    narrow = Chain(chosen, fewer.dt)
    again = find_contacts(fewer, narrow, bonded)
    return (fewer, narrow, again) if again.spans else (channels, chain, contacts)


def _chosen_cutoff(channels: Channels, contacts: Contacts) -> float:
    """From the longest contact with what is before and after it, so that its rise and fall are in the picture."""
    begin, end = max(contacts.spans, key=lambda span: span[1] - span[0])
    margin = (end - begin) // 2
    around = slice(max(begin - margin, 0), end + margin)
    return choose_cutoff(channels.position[around], channels.force[around], channels.dt, channels.rate)


def _question(
    channels: Channels, chain: Chain, contacts: Contacts, lag: float | None, lag_std: float, tolerance: float
) -> Question:
    position = contacts.position_sign * channels.position
    force = chain(contacts.force_sign * channels.force)
    rows, spans = _rows(channels, chain, contacts)
    filtered = chain(position)
    if contacts.bonded:
        position = position - filtered[rows].mean()
    else:
        position = position - _origin(filtered, rows, contacts)
    motion = Motion(chain, position, rows, contacts.bonded, white_noise(position))
    known = unknown_lag(motion, channels.rate) if lag is None else Lag(lag, lag_std)
    return Question(
        motion, force[rows], spans, known, tolerance, _free_noise(force, channels, chain, contacts)
    )


def _origin(filtered: Array, rows: NDArray[np.intp], contacts: Contacts) -> float:
    """Where the surface is: the position at the onset; the least in contact, if no onset is in the log."""
    onsets = [filtered[begin] for begin, _ in contacts.spans if begin > 0]
    return float(np.mean(onsets)) if onsets else float(filtered[rows].min())


def _rows(channels: Channels, chain: Chain, contacts: Contacts) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Samples in contact whose filter has forgotten what was before, and the number of each one's contact.

    The end is that of the raw force: a filter shows contact for a while after the probe has gone, but what it shows
    then is no contact any more.
    """
    usable = _settled(channels.valid, int(np.ceil(chain.settling / chain.dt)))
    step = max(int(1 / (8 * chain.cutoff * chain.dt)), 1)
    rows, spans = [], []
    for number, (begin, end) in enumerate(contacts.spans):
        last = end if contacts.bonded else _left(channels, contacts, begin, end)
        own = np.arange(begin + _settling(chain, begin, end - begin), last, step)
        own = own[usable[own]]
        rows.append(own)
        spans.append(np.full(len(own), number))
    found = np.concatenate(rows)
    if len(found) < 30:
        raise InputError(_too_few(len(found), channels))
    return found, np.concatenate(spans)


def _settling(chain: Chain, begin: int, length: int) -> int:
    """Samples to leave out after a touch, which the filter's own delay has already eaten some of.

    Until a disturbance has decayed to 1 %, or to nothing where that costs little of the contact. At the first sample
    of a log there has been no delay: the filter has yet to learn how the probe was moving.
    """
    eaten = chain.delay if begin > 0 else 0.0
    thorough = int(np.ceil((chain.thorough_settling - eaten) / chain.dt))
    if thorough < _LONG * length:
        return thorough
    return min(int(np.ceil((chain.settling - eaten) / chain.dt)), length // 4)


def _left(channels: Channels, contacts: Contacts, begin: int, end: int) -> int:
    """The sample after the last one in contact by the raw force, at least half of the filtered contact."""
    force = contacts.force_sign * channels.force[begin:end]
    clear = max(contacts.threshold, contacts.resting + 4 * white_noise(channels.force))
    above = np.flatnonzero(force > clear)
    middle = begin + (end - begin) // 2
    return max(begin + int(above[-1]) + 1, middle) if len(above) else end


def _too_few(count: int, channels: Channels) -> str:
    text = f"only {count} usable samples in contact; at least 30 are needed: log longer or faster"
    lost = [w.text for w in channels.warnings if w.code in (Code.SATURATED, Code.MISSING_SAMPLES)]
    return f"{text} ({'; '.join(lost)})" if lost else text


def _settled(valid: NDArray[np.bool_], memory: int) -> NDArray[np.bool_]:
    """Where nothing invalid lies within the filter's memory."""
    if valid.all():
        return valid
    bad = np.r_[0, np.cumsum(~valid)]
    index = np.arange(len(valid))
    settled: NDArray[np.bool_] = bad[index + 1] - bad[np.maximum(index - memory, 0)] == 0
    return settled


def _free_noise(force: Array, channels: Channels, chain: Chain, contacts: Contacts) -> float | None:
    """Deviation of the filtered force out of contact; None if too little of the log is."""
    if contacts.bonded:
        return None
    free = np.ones(len(force), bool)
    guard = int(chain.settling / chain.dt)
    for begin, end in contacts.spans:
        free[max(begin - guard, 0) : end + guard] = False
    quiet = force[free & channels.valid]
    if len(quiet) < 30:
        return None
    return float(1.4826 * np.median(np.abs(quiet - np.median(quiet))))


def _reversed(choice: Choice) -> bool:
    mass = [c.fit for c in choice.others if c.fit.model is KELVIN_VOIGT_MASS]
    return bool(mass) and all(mass[0][n] + 3 * mass[0].std(n, lag_known=True) < 0 for n in ("K", "M"))


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
        value, std, least = told.lag, told.std("lag"), ""
    else:
        value, std = closing_lag(question.motion, question.force, -plain["B"] / plain["K"], question.spans)
        least = "at least "
    text = (
        f"without a lag the fit gives B = {plain['B']:.3g}, below zero: the force is read {least}"
        f"{value:.3g} s (std {std:.2g} s) after the position; B is refused until the lag is calibrated (--lag)"
    )
    warnings.append(Warn(Code.FORCE_LAGS_POSITION, text))
    shifted = replace(question, lag=Lag(value, std))
    return shifted, choose(shifted, model or choice.candidate.fit.model.name)


def _report(
    channels: Channels,
    contacts: Contacts,
    question: Question,
    choice: Choice,
    terms: Terms,
    model: str | None,
) -> Identification:
    fitted = choice.candidate.fit
    warnings = channels.warnings
    if choice.rejected:
        seen = "; ".join(choice.candidate.against[:3]) or "its parameters make no sense"
        text = f"{fitted.model.name} does not describe this log: {seen}{_instead(choice)}"
        warnings.append(Warn(Code.MODEL_REJECTED, text))
    parameters = verdicts(choice, question.lag, terms, warnings)
    if model is None and "M" not in parameters:
        parameters = _with_mass(parameters, choice, terms)
    if contacts.bonded and fitted.r2 < _FOLLOWS:
        text = f"the force does not follow the position (R2 {fitted.r2:.2g}): nothing seems to be touched"
        warnings.append(Warn(Code.NO_CONTACT, text))
    warnings += _curved(choice) + _doubtful_units(parameters, terms)
    traces = _traces(channels, contacts, question, choice, terms)
    return Identification(
        model=fitted.model.name,
        parameters=parameters,
        contacts=tuple(_clock(channels, question, span) for span in contacts.spans),
        lag=_lag_said(question, choice),
        r2=fitted.r2,
        rmse=fitted.rmse,
        n=len(question.force),
        warnings=tuple(warnings),
        comparison=tuple(
            Comparison(_label(c.fit.names, c.fit.model.name), c.fit.r2, c.fit.rmse, "; ".join(c.against))
            for c in choice.others
        ),
        cutoff=question.motion.chain.cutoff,
        traces=traces,
    )


def _label(names: tuple[str, ...], model: str) -> str:
    return f"{model}, curved spring" if "K3" in names else model


def _instead(choice: Choice) -> str:
    closest = min(choice.others, key=lambda c: c.fit.rmse)
    if closest.fit.model is choice.candidate.fit.model:
        return ""
    name = _label(closest.fit.names, closest.fit.model.name)
    blame = f", but {closest.against[0]}" if closest.against else ""
    return f"; closest is {name} (R2 {closest.fit.r2:.4f}{blame})"


def _with_mass(parameters: dict[str, Parameter], choice: Choice, terms: Terms) -> dict[str, Parameter]:
    """Say about the mass what the model with a mass found."""
    mass = next((c.fit for c in choice.others if c.fit.model is KELVIN_VOIGT_MASS), None)
    if mass is None:
        return parameters
    unit = unit_of("M", mass, terms)
    if choice.candidate.fit.model.name != "kelvin-voigt" or choice.rejected:
        reason = f"{choice.candidate.fit.model.name} has no mass"
    else:
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


def _lag_said(question: Question, choice: Choice) -> tuple[float, float] | None:
    fitted = choice.candidate.fit
    if question.lag.known:
        told = question.lag.value != 0 or question.lag.std > 0
        return (question.lag.value, question.lag.std) if told else None
    told = not choice.rejected and fitted.r2 > _FOLLOWS and fitted.std("lag") < 0.5 * question.lag.std
    return (fitted.lag, fitted.std("lag")) if told else None


def _clock(channels: Channels, question: Question, span: tuple[int, int]) -> tuple[float, float]:
    """Times of a contact on the log's own clock: the filter's delay is taken off."""
    delay = question.motion.chain.delay if not question.motion.bonded else 0.0
    begin, end = (channels.start + i * channels.dt - delay for i in span)
    return max(float(begin), channels.start), float(end)


def _nothing(channels: Channels, chain: Chain, terms: Terms, model: str) -> Identification:
    from palpate.units import impedance_units

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
    )


def _traces(
    channels: Channels, contacts: Contacts, question: Question, choice: Choice, terms: Terms
) -> Traces:
    chain = question.motion.chain
    fitted = choice.candidate.fit
    step = max(len(channels.position) // _SHOWN, 1)
    fit_step = max(len(question.force) // _SHOWN, 1)
    time = channels.time - chain.delay
    position = chain(question.motion.position)
    rows = question.motion.rows[::fit_step]
    return Traces(
        time=time[::step],
        position=position[::step],
        force=chain(contacts.force_sign * channels.force)[::step],
        fitted_time=time[rows],
        fitted_position=question.motion.moved(0, fitted.lag)[::fit_step],
        fitted_force=question.force[::fit_step],
        predicted=fitted.predicted[::fit_step],
        position_unit=terms.position_unit,
        force_unit=terms.force_unit,
    )
