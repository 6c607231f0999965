"""From a record to an Identification: the stages one after the other."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from palpate.identification.causes import Code, Warn
from palpate.identification.contacts import Contacts, contacts_of
from palpate.identification.filters import Chain
from palpate.identification.in_series import SeriesSpring
from palpate.identification.linearisation import lag_open
from palpate.identification.options import LAG, Options
from palpate.identification.phases import find_break, flows
from palpate.identification.press import gather_evidence
from palpate.identification.problem import Problem, build_problem, thin_rows
from palpate.identification.result import Identification, LagFound, Press, Traces, WorkingPoint
from palpate.identification.sampling import Channels, channels_of, thinned
from palpate.identification.selection import Choice, choose
from palpate.identification.uncertainty import Input, Parameter, Verdict, correlations
from palpate.identification.verdicts import Units, verdicts
from palpate.records import Record
from palpate.signals.samples import block_means, robust_std
from palpate.signals.types import NORMAL
from palpate.units import impedance_units

_MAX_SAMPLES = 2_000_000
_MIN_R2_OF_CONTACT = 0.3


@dataclass(frozen=True)
class _PreparedLog:
    """A log that is being identified.

    Args:
        channels: position and force.
        chain: the filter of both.
        options: as given.
        units: of the record's columns, by name.
        fluid: what is touched flows.
    """

    channels: Channels
    chain: Chain
    options: Options
    units: Units
    fluid: bool

    @property
    def impedance_units(self) -> dict[str, str]:
        """Units of K, B and M."""
        return impedance_units(self.units["force"], self.units["position"])


def identify(record: Record, **given: Any) -> Identification:
    """Find what a probe touched, and how far to trust it.

    First what the log shows without a model: dynamic stiffness by octave, the press, the stiffness at the working
    point. Then f = M a + B v + K x + offset or one of its relatives, beside other causes of force whose size the log
    tells. Each parameter gets a verdict; a number that the log does not carry is not given.

    Args:
        record: with the columns `time` [s], `position` [m] and `force` [N], of shape (n,); NaN means no reading.
        given: what is known beside the log, by the names of `palpate.identification.options.Options`.

    Raises:
        InputError: the record or an option is wrong, in one line.
    """
    options = Options.of(**given)
    units = record.units
    channels, fluid = _until_break(record, options)
    options.check_lag(len(channels.position) * channels.dt)
    channels = thinned(channels, -(-len(channels.position) // _MAX_SAMPLES))
    channels, chain, contacts = contacts_of(channels, options)
    log = _PreparedLog(channels, chain, options, units, fluid)
    warnings = (*channels.warnings, *contacts.warnings)
    if not contacts.spans:
        return _no_contact(log, warnings)
    problem = thin_rows(build_problem(channels, chain, contacts, options))
    choice = choose(problem, options)
    problem = choice.problem
    fitted = choice.answer.fit
    follows = max(fitted.r2, fitted.in_time(problem.motion, problem.force).r2) > _MIN_R2_OF_CONTACT
    if not (contacts.clear or options.bonded or follows or contacts.press):
        rms = f"rms {choice.answer.unexplained:.3g} N"
        text = f"the force ({rms}) does not follow the position: there seems to be no contact"
        return _no_contact(log, (*channels.warnings, Warn(Code.NO_CONTACT, text)))
    return _outcome(log, choice, warnings)


def _until_break(record: Record, options: Options) -> tuple[Channels, bool]:
    """The channels up to the first break of the specimen, with a warning, and whether a fluid is touched.

    All of them without a break, or of a fluid.
    """
    channels = channels_of(record)
    fluid = flows(channels)
    first = None if fluid else find_break(channels, options.tolerance)
    if first is None:
        return channels, fluid
    before = record["time"] < first.time
    channels = channels_of(replace(record, columns={name: record[name][before] for name in record.columns}))
    return replace(channels, warnings=(*channels.warnings, Warn(Code.FORCE_DROPS, first.text))), False


_MIN_STIFFNESS, _MAX_STIFFNESS = 1.0, 1e8
_MAX_DEPTH = 0.5
"""Reach of half an arm [m]: no press goes deeper, and one of half a mm that is read in m does."""
_MAX_TRACE_SAMPLES = 50_000
"""Samples of each trace: what is more is thinned, and averaged where it was fitted."""
_FLOWS = "the force follows the speed, and is gone where the probe rests: what is touched flows"
_MEASURED_LAG_RATIO = 0.5
"""Share of the prior's half-width at which a lag is measured: the log tells three times as much, 1/.5^2 - 1."""


def _outcome(log: _PreparedLog, choice: Choice, warnings: tuple[Warn, ...]) -> Identification:
    """Identification from the fit: its evidence, and the verdicts that rest on both."""
    problem = choice.problem
    options = log.options
    unit = log.impedance_units["K"]
    spectrum, press, point = gather_evidence(problem, options, unit, choice.answer)
    if press is not None:
        press = replace(press, pull_off=_pull_off(log.channels, problem.contacts))
    choice = _surface_alone(choice, options)
    parameters, parameter_warnings = verdicts(choice, point, options, log.units)
    if log.fluid:
        point, press, parameter_warnings = None, None, (Warn(Code.FORCE_FLOWS, _FLOWS),)
        parameters |= {"K": parameters["K"].without_number(_FLOWS)}
    warnings = (*warnings, *parameter_warnings)
    fitted = choice.answer
    mass = parameters.get("M")
    name = fitted.fit.model.name
    massless = options.model is None and (mass is None or mass.verdict is not Verdict.IDENTIFIED)
    return Identification(
        model="kelvin-voigt" if massless and name == "kelvin-voigt-mass" else name,
        parameters=parameters,
        contacts=_contact_times(log, problem.contacts),
        lag=_lag(choice),
        r2=max(fitted.fit.r2, 0.0),
        rmse=fitted.fit.rmse,
        n=len(problem.force),
        warnings=(*warnings, *_doubtful_numbers(log, parameters, press, problem, warnings)),
        comparison=choice.tried,
        cutoff=problem.motion.chain.cutoff,
        traces=_traces(log, choice),
        working_point=point,
        dynamic_stiffness=spectrum,
        press=press,
        options=_plain_options(options),
        depth=fitted.fit.model.depth,
        inputs=_inputs(problem, options),
        correlation=_correlation(choice, parameters, point),
    )


_MIN_PULL_STDS, _MIN_PULL_ROWS = 6.0, 3
"""Standard deviations of the free force, and rows of it, from which on a force below its rest is an adhesion."""
_MIN_PULL_FRACTION = 0.01
"""Fraction of the largest force below which a force below the rest may be a drift."""


def _pull_off(channels: Channels, contacts: Contacts) -> float | None:
    """Largest force that holds the probe behind the deepest row of a contact [N]; None if none shows."""
    if contacts.bonded:
        return None
    force = contacts.force_sign * channels.force - contacts.resting
    outside = np.ones(len(force), bool)
    behind = np.zeros(len(force), bool)
    ends = [begin for begin, _ in contacts.spans[1:]] + [len(force)]
    for (begin, end), next_begin in zip(contacts.spans, ends, strict=True):
        outside[begin:end] = False
        behind[begin + int(np.argmax(force[begin:end])) : next_begin] = True
    noise = robust_std(force[outside]) if outside.any() else 0.0
    least = max(_MIN_PULL_STDS * noise, _MIN_PULL_FRACTION * float(force.max()))
    pulls = np.sort(-force[behind & channels.valid])[::-1]
    sticks = len(pulls) > _MIN_PULL_ROWS and pulls[_MIN_PULL_ROWS - 1] > least
    return float(pulls[0]) if sticks else None


def _surface_alone(choice: Choice, options: Options) -> Choice:
    """Remove the series spring from the answer, and add the uncertainty of the tool's inertia."""
    series = SeriesSpring.of(options)
    payload = choice.problem.contacts.payload
    band = choice.problem.band
    if series is not None:
        choice = replace(choice, answer=series.parameters(choice.answer, band))
    if payload is not None:
        weighed = np.where(np.array(choice.answer.names) == "M", payload.std, 0.0)
        choice = replace(choice, answer=choice.answer.with_cause("tool's inertia", weighed))
    return choice


def _contact_times(log: _PreparedLog, contacts: Contacts) -> tuple[tuple[float, float], ...]:
    """Begin and end of each contact on the log's clock [s]."""
    start = log.channels.start
    delay = 0.0 if contacts.bonded else log.chain.delay
    ends = ((start + sample * log.channels.dt - delay for sample in span) for span in contacts.spans)
    return tuple((max(float(begin), start), float(end)) for begin, end in ends)


def _no_contact(log: _PreparedLog, warnings: tuple[Warn, ...]) -> Identification:
    """There is no contact: every parameter without a number, and the force, which says why."""
    reason = "there is no contact in this log"
    nan = float("nan")
    return Identification(
        log.options.model or "kelvin-voigt",
        {name: Parameter.unknown(unit, reason) for name, unit in log.impedance_units.items()},
        (),
        None,
        nan,
        nan,
        0,
        warnings,
        cutoff=log.chain.cutoff,
        traces=_traces(log, None),
        options=_plain_options(log.options),
    )


def _plain_options(options: Options) -> dict[str, object]:
    """The given options, and the tolerance; a lag of 0 and "not bonded" are given too."""
    given = {
        option.name: getattr(options, option.name)
        for option in fields(options)
        if option.name == "tolerance" or getattr(options, option.name) != option.default
    }
    return given | ({"force_filter": str(options.force_filter)} if options.force_filter else {})


def _inputs(problem: Problem, options: Options) -> dict[str, Input]:
    """The input quantities whose uncertainty is given, or assumed, before the log is read."""
    payload, (swing, swing_std) = problem.contacts.payload, options.swing
    quantities = {
        "lag": Input(problem.lag.value + (problem.filtered or 0.0), problem.lag.std, "s"),
        "calibration": Input(1.0, options.calibration, "1"),
        "series stiffness": Input(options.series_stiffness or 0.0, options.series_std, "N/m"),
        "tip's mass": Input(swing, swing_std, "s^2"),
        "tool's inertia": Input(payload.mass, payload.std, "kg") if payload else Input(0.0, 0.0, "kg"),
    }
    return {cause: quantity for cause, quantity in quantities.items() if quantity.std > 0}


def _correlation(
    choice: Choice, parameters: dict[str, Parameter], point: WorkingPoint | None
) -> dict[str, float]:
    """Correlations of the fit's K, B and M that have a number; a tangent in place of K is no part of the fit."""
    fitted = choice.answer
    tangent = point and point.stiffness
    known = {
        name: parameter
        for name, parameter in parameters.items()
        if parameter.value is not None and parameter is not tangent
    }
    names = [name for name in ("K", "B", "M") if name in fitted.names and name in known]
    places = [fitted.names.index(name) for name in names]
    return correlations(names, fitted.cov[np.ix_(places, places)])


def _lag(choice: Choice) -> LagFound | None:
    prior = choice.problem.lag
    fitted = choice.answer
    filtered = choice.problem.filtered or 0.0
    if prior.known:
        given = prior.value + filtered != 0 or prior.std > 0
        return LagFound(prior.value + filtered, prior.std, NORMAL * prior.std, "told") if given else None
    half = fitted.half_of(LAG) if LAG in fitted.names else NORMAL * prior.std
    if half <= _MEASURED_LAG_RATIO * NORMAL * prior.std and not lag_open(choice.problem):
        return LagFound(fitted[LAG] + filtered, half / NORMAL, half, "measured")
    return LagFound(prior.value + filtered, prior.std, NORMAL * prior.std, "prior")


def _doubtful_numbers(
    log: _PreparedLog,
    parameters: dict[str, Parameter],
    press: Press | None,
    problem: Problem,
    warnings: tuple[Warn, ...],
) -> list[Warn]:
    """The lag that the work of the presses tells, where it is beyond an assumed prior's bound; unlikely numbers."""
    doubts = []
    prior = problem.lag
    late = press.late if press else None
    known = prior.known or any(w.code is Code.FORCE_LAGS_POSITION for w in warnings)
    if late is not None and not known and late[0] > NORMAL * prior.std:
        text = (
            f"unloading returns more work than loading took, which no passive surface does: the force is read"
            f" after the position by {prior.value + late[0]:.2g} s or more (± {late[1]:.2g}); calibrate the lag"
        )
        doubts.append(Warn(Code.FORCE_LAGS_POSITION, text))
    stiffness = parameters["K"].value if "K" in parameters else None
    if (
        stiffness is not None
        and parameters["K"].unit == "N/m"
        and not _MIN_STIFFNESS <= stiffness <= _MAX_STIFFNESS
    ):
        question = "is a unit off, as by a factor of 1000?"
        text = f"K = {stiffness:.3g} N/m lies outside 1 N/m to 100 MN/m: {question}"
        doubts.append(Warn(Code.UNIT_DOUBTFUL, text))
    series = log.options.series_stiffness
    if stiffness is not None and series and stiffness > series / 3:
        comparison = f"K = {stiffness:.3g} against {series:.3g} N/m in series with it"
        text = f"{comparison}: K depends on that calibration"
        doubts.append(Warn(Code.SERIES_COMPLIANCE, text))
    deep = float(np.ptp(problem.motion.position[problem.in_contact]))
    if log.units["position"] == "m" and deep > _MAX_DEPTH:
        text = f"the probe moves by {deep:.3g} m in contact: is the position in mm? then say NAME:mm"
        doubts.append(Warn(Code.UNIT_DOUBTFUL, text))
    return doubts


def _traces(log: _PreparedLog, choice: Choice | None) -> Traces:
    """Signals and fit to be drawn; of a log in which nothing is touched, the force alone."""
    channels = log.channels
    chain = log.chain
    units = log.units
    stride = max(len(channels.position) // _MAX_TRACE_SAMPLES, 1)
    axis_units = (units["position"], units["force"])
    time = (channels.time - chain.delay)[::stride]
    if choice is None:
        none = np.empty(0)
        return Traces(time, chain(channels.force)[::stride], *(none,) * 4, {}, {}, {}, False, *axis_units)
    problem = choice.answer.problem
    fitted = choice.answer.fit
    size = max(len(problem.force) // _MAX_TRACE_SAMPLES, 1)
    linear = fitted.model.linear
    mass = problem.lag.mass
    motion = problem.motion
    columns = fitted.model.columns(motion, fitted.theta, fitted.lag)
    # As the press and the working point: the depth from where contact is seen, the force from where it rests.
    position = motion.position[0] + (0.0 if motion.free is None else motion.free[0])
    surface = float(choice.problem.motion.position[0] - position)
    rest = problem.contacts.resting
    rows_rest = 0.0 if problem.counted else rest
    return Traces(
        time,
        chain(problem.contacts.force_sign * channels.force)[::stride] - rest,
        block_means(channels.start + problem.time, size),
        block_means(motion.moved(0, fitted.lag) + surface, size),
        block_means(problem.force - rows_rest, size),
        block_means(fitted.force - rows_rest, size),
        {name: block_means(c, size) for name, c in zip(linear, columns, strict=True)},
        {name: fitted[name] for name in linear},
        {"M": mass[1]} if mass and "M" in linear else {},
        problem.motion.matched,
        *axis_units,
    )
