"""From an answer to verdicts: what of it may be believed, and why not the rest."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from palpate.identification.budget import Budget, FittedParameters, Prediction, Spread
from palpate.identification.causes import NOISE, Code, Warn, cause_of
from palpate.identification.options import LAG, Options
from palpate.identification.press import stiffness_at_point
from palpate.identification.problem import Problem
from palpate.identification.result import WorkingPoint
from palpate.identification.selection import Choice
from palpate.identification.uncertainty import Parameter, Verdict, half_width
from palpate.signals.types import NORMAL
from palpate.units import impedance_units

_DOUBTFUL_LAG_STDS = 2.0
"""Prior deviations from its prior beyond which a lag nobody calibrated is a sign of another cause (5 % by chance)."""
_MAX_RELATIVE_HALF = 1e4
"""Half-widths over the value beyond which no bounds are worth printing."""
_WITHOUT_FORCE_UNIT = ("n", "tau", "x0")
"""Parameters without force in their unit: no calibration of force or position scales them."""
_NUISANCE = ("x0", "y0")
"""Where the surface is, and how a branch was stretched when the log began: found, not asked for."""
_IN_TIME = ("B", "M", "K1", "tau")
"""Parameters that are seen in time: a shift of the force looks like them."""
_CAUSES_BEYOND_MOTION = "lag", "low-pass", "missing force"
"""Causes of which no faster motion tells more."""
_BELOW_ZERO = "below zero: no passive surface does that"
_CONSTANT_SPEED = "the log does not show it: the probe moves at constant speed"
_UNKNOWN_SIGNS = (
    "the log does not show the signs of force and position: begin it in free motion, or give --force-sign"
)
_UNKNOWN_SURFACE = (
    "a power law needs depth and force from the touch on, and the log never leaves the surface:"
    " let it begin in free motion"
)
Units = Mapping[str, str]
"""Of a record's columns; here of its force and its position."""


def verdicts(
    choice: Choice, point: WorkingPoint | None, options: Options, units: Units
) -> tuple[dict[str, Parameter], tuple[Warn, ...]]:
    """Pass a verdict on each parameter; K must agree with the working point."""
    contacts = choice.problem.contacts
    model = choice.answer.fit.model
    tangent = None if contacts.press is None or model.nonlinear else point
    fitted = _add_missing_force(against_working_point(choice.answer, point))
    if tangent is not None:
        fitted = replace(fitted, budget=_with_presses(fitted, tangent))
    scales = np.array(
        [0.0 if name in (*_WITHOUT_FORCE_UNIT, LAG) else options.calibration for name in fitted.names]
    )
    fitted = fitted.with_cause("calibration", scales * fitted.theta)
    names = [parameter_name for parameter_name in fitted.names if parameter_name not in (LAG, *_NUISANCE)]
    parameters = {name: _parameter(name, fitted, options.tolerance, units) for name in names}
    parameters = _reject_negative(parameters, contacts.payload is not None)
    refused = (
        _UNKNOWN_SIGNS
        if not contacts.signed
        else _UNKNOWN_SURFACE
        if model.of_power and contacts.bonded
        else ""
    )
    for name, parameter in parameters.items() if refused else ():
        if parameter.verdict is Verdict.IDENTIFIED:
            parameters[name] = replace(parameter, verdict=Verdict.NOT_IDENTIFIABLE, reason=refused)
    if tangent is not None:
        parameters = _press_stiffness(parameters, tangent)
    elif point is not None and point.source == "press":
        parameters = _agreeing(parameters, point.stiffness)
    return parameters, _warnings(parameters, fitted, choice.problem, options.tolerance)


def _parameter(name: str, fitted: FittedParameters, tolerance: float, units: Units) -> Parameter:
    value = fitted[name]
    unit = parameter_unit(name, fitted.fit, units)
    half_width = fitted.half_of(name)
    causes = fitted.contributions(name)
    parameter = Parameter.of(value, unit, Verdict.NOT_IDENTIFIABLE, "", causes)
    low, high = interval = (value - half_width, value + half_width)
    if name in fitted.fit.model.positive and _highest(fitted, name) < 0:
        reason = f"the fit gives {_format_number(value)} {_format_unit(unit)}, {_BELOW_ZERO}"
        return parameter.without_number(" ".join(reason.split()), Verdict.REJECTED)
    if half_width > _MAX_RELATIVE_HALF * max(abs(value), 1e-300):
        return parameter.without_number(f"the log does not show it: {NOISE.remedy}")
    excludes_zero = low > 0 or high < 0
    if half_width <= tolerance * abs(value) and excludes_zero:
        reason = f"known to {100 * half_width / abs(value):.2g} % (95 %)"
        depth = fitted.fit.model.depth
        if depth is not None and name not in _WITHOUT_FORCE_UNIT:  # it grows with the depth
            reason += f", at a penetration of {_format_number(depth)} {units['position']}"
        return replace(parameter, verdict=Verdict.IDENTIFIED, reason=reason)
    bounds = f"95 %: {_format_number(low)} to {_format_number(high)} {_format_unit(unit)}".rstrip()
    limit = f"wider than {tolerance:.0%}" if excludes_zero else "zero is within it"
    main_cause = cause_of(next(iter(parameter.budget), "noise"))
    reason = f"{bounds}; {limit}. Mostly due to {main_cause.described}: {main_cause.remedy}"
    return (
        replace(parameter, reason=reason)
        if excludes_zero
        else parameter.without_number(reason, ci95=interval)
    )


def _highest(fitted: FittedParameters, name: str) -> float:
    """Upper end of a parameter's interval: a low-pass that nobody gave adds to a mass, and takes nothing from it."""
    causes = fitted.contributions(name)
    return fitted[name] + half_width(
        {cause: contribution for cause, contribution in causes.items() if cause != "low-pass"}
    )


def against_working_point(answer: FittedParameters, point: WorkingPoint | None) -> FittedParameters:
    """An answer with the gap between the stiffness of its force at the working point and of the log's as a cause.

    Both are read in the same way: the slope of a press has a mass and a damping in it, in the log as in the answer.
    A parameter may be off by as much as it moves if the answer is made to agree: theta + C g (g' C g)^-1 gap, C the
    covariance and g the stiffness' derivatives (a measurement without error in a Kalman filter). Nothing is compared
    without a working point that has an interval.
    """
    if point is None or point.stiffness.ci95 is None or point.stiffness.value is None:
        return answer
    problem = answer.problem
    fitted = answer.fit
    log_stiffness, model_stiffness = (
        stiffness_at_point(problem, force, point) for force in (problem.force, fitted.force)
    )
    if log_stiffness is None or model_stiffness is None:
        return answer
    slope = np.zeros(len(answer.names))
    for place, name in enumerate(answer.names):
        if name in fitted.theta:
            step = 1e-4 * (abs(fitted.theta[name]) or 1.0)
            theta = fitted.theta | {name: fitted.theta[name] + step}
            shifted = Prediction.of(fitted.model, problem.motion, problem.force, theta, fitted.lag)
            slope[place] = (
                (stiffness_at_point(problem, shifted.force, point) or model_stiffness) - model_stiffness
            ) / step
    shared_causes = "calibration", "friction", "loadings"  # of the answer, too
    point_causes = {
        cause: contribution
        for cause, contribution in point.stiffness.contributions.items()
        if cause not in shared_causes
    }
    direction = answer.cov @ slope
    power = float(slope @ direction)
    gap = max(
        abs(model_stiffness - log_stiffness)
        - float(np.hypot(NORMAL * np.sqrt(max(power, 0.0)), half_width(point_causes))),
        0.0,
    )
    return answer.with_cause(
        "dynamic stiffness", direction * gap / power if power > 0 else np.zeros(len(slope))
    )


def _add_missing_force(answer: FittedParameters) -> FittedParameters:
    """An answer whose damping may be off by as much force as its mass is certainly below zero.

    Of a force in an unknown phase, as much is in quadrature as in phase.
    """
    if "M" not in answer.names or (highest := _highest(answer, "M")) >= 0:
        return answer
    speed, acceleration = (np.std(answer.problem.motion.moved(k, answer.fit.lag)) for k in (1, 2))
    largest = highest * acceleration / speed
    return answer.with_cause("missing force", largest / NORMAL * np.equal(answer.names, "B"))


def _with_presses(answer: FittedParameters, point: WorkingPoint) -> Budget:
    """The budget of a linear answer, its stiffness no more certain than presses at constant speed agree on theirs.

    At constant speed neither a damping nor a mass makes the slopes of two presses differ.
    """
    scatter = point.stiffness.contributions["repetition"]
    repetition = answer.budget["repetition"]
    place = answer.names.index("K")
    variance = repetition.variance.copy()
    freedom = repetition.each.copy()
    if scatter.std**2 > variance[place]:
        variance[place], freedom[place] = scatter.std**2, scatter.freedom
    return answer.budget | {"repetition": Spread(variance, freedom)}


def _press_stiffness(parameters: dict[str, Parameter], point: WorkingPoint) -> dict[str, Parameter]:
    """K of presses at constant speed is their tangent, unless a model among them knows it better; no more is shown."""
    rejected = {
        name: replace(parameter, verdict=Verdict.NOT_IDENTIFIABLE, reason=_CONSTANT_SPEED)
        for name, parameter in parameters.items()
        if parameter.verdict is Verdict.REJECTED
    }
    stiffness = parameters["K"]
    if len(point.each) > 1 and stiffness.ci95 is not None:
        overlaps = stiffness.ci95[0] <= max(point.each) and stiffness.ci95[1] >= min(point.each)
        stiffness = stiffness if overlaps else point.stiffness
    identified = [
        parameter for parameter in (point.stiffness, stiffness) if parameter.verdict is Verdict.IDENTIFIED
    ]
    best = min(identified, key=lambda parameter: parameter.std or np.inf, default=point.stiffness)
    return parameters | rejected | {"K": best}


def _agreeing(parameters: dict[str, Parameter], slope: Parameter) -> dict[str, Parameter]:
    """K is not identified where it excludes the slope of the press, less the branch by which a solid relaxes."""
    K = parameters.get("K")
    both = K is not None and K.verdict is slope.verdict is Verdict.IDENTIFIED and K.unit == slope.unit
    if not (both and K and K.ci95 and slope.ci95):
        return parameters
    branch = parameters["K1"].ci95 if "K1" in parameters else None
    if K.ci95[0] <= slope.ci95[1] and slope.ci95[0] <= K.ci95[1] + (branch[1] if branch else 0.0):
        return parameters
    reason = "it contradicts the slope of the press, of the first line: the stiffness changes with the force"
    return parameters | {"K": replace(K, verdict=Verdict.NOT_IDENTIFIABLE, reason=reason)}


def _reject_negative(parameters: dict[str, Parameter], weighed: bool) -> dict[str, Parameter]:
    """A parameter that is certainly below zero refuses those that the same missing force may be in.

    All that is seen in time shares a force that depends on the motion. A stiffness below zero leaves no model at all. A
    mass below zero is in the damping's interval (`_add_missing_force`), and refuses all only where a tool's inertia was
    found in free motion and removed (`weighed`): it is not that force, and K rests on the same fit.
    """
    negative = [
        name for name in ("K", "B", "M") if name in parameters and _BELOW_ZERO in parameters[name].reason
    ]
    if "K" in negative:
        reason = "K is certainly below zero: the model does not hold"
        touched = (*parameters,)
    elif len(negative) == 1 and (weighed or "B" in negative):
        reason = f"{negative[0]} is certainly below zero: the model lacks a force that depends on the motion"
        touched = ("K", *_IN_TIME) if weighed else _IN_TIME
    else:
        return parameters
    return {  # a number that a model gives which does not hold stands nowhere
        name: parameter.without_number(reason, Verdict.REJECTED)
        if name in touched and parameter.verdict is Verdict.IDENTIFIED
        else parameter
        for name, parameter in parameters.items()
    }


def _warnings(
    parameters: dict[str, Parameter], fitted: FittedParameters, problem: Problem, tolerance: float
) -> tuple[Warn, ...]:
    warnings = [
        _warn_of_fitted_lag(fitted, problem),
        _warn_of_damping(parameters.get("B"), fitted, problem, tolerance),
        _warn_of_stiffness(parameters.get("K")),
        _warn_of_excitation(parameters, problem),
    ]
    return tuple(warning for warning in warnings if warning is not None)


def _warn_of_fitted_lag(fitted: FittedParameters, problem: Problem) -> Warn | None:
    """Warn of a fitted lag that is far from its prior."""
    lag = problem.lag
    if LAG not in fitted.names or lag.known:
        return None
    reach = _DOUBTFUL_LAG_STDS * lag.std
    change = fitted[LAG] - lag.value
    if abs(change) <= reach and change + fitted.half_of(LAG) >= -reach:
        return None
    text = (
        f"the fit estimates a lag of {_format_number(1e3 * fitted[LAG])} ms of the force, longer than sensors have:"
        " something else delays the force; parameters that such a delay changes are rejected"
    )
    return Warn(Code.FORCE_LAGS_POSITION, text)


def _warn_of_damping(
    damping: Parameter | None, fitted: FittedParameters, problem: Problem, tolerance: float
) -> Warn | None:
    """Warn of a damping that a lag of the force makes negative or uncertain."""
    if damping is None or damping.verdict is Verdict.IDENTIFIED:
        return None
    if _BELOW_ZERO in damping.reason:
        text = f"B: {damping.reason}; a lag T of the force adds -K T to it: calibrate the lag and give --lag"
        return Warn(Code.FORCE_LAGS_POSITION, text)
    lag = problem.lag
    if lag.known or damping.budget.get("lag", 0.0) <= tolerance * abs(fitted["B"]):
        return None
    stiffness = fitted["K"] if "K" in fitted.names else 0.0
    half = NORMAL * lag.std * abs(stiffness)
    text = (
        "a lag of the force lowers B by K times the lag, and the lag is not calibrated: B is uncertain by"
        f" {_format_number(half, 2)} {_format_unit(damping.unit)}; give --lag"
    )
    return Warn(Code.LAG_DAMPING_CONFOUNDED, text)


def _warn_of_stiffness(stiffness: Parameter | None) -> Warn | None:
    """Warn of a negative stiffness."""
    if stiffness is None or _BELOW_ZERO not in stiffness.reason:
        return None
    text = f"K: {stiffness.reason}; a channel's sign or column may be wrong (--force-sign)"
    return Warn(Code.NEGATIVE_STIFFNESS, text)


def _warn_of_excitation(parameters: dict[str, Parameter], problem: Problem) -> Warn | None:
    """Warn of parameters that a faster or larger motion would show."""
    unknown = []
    for name, parameter in parameters.items():
        main_cause = next(iter(parameter.budget), "noise")
        if parameter.verdict is Verdict.NOT_IDENTIFIABLE and main_cause not in _CAUSES_BEYOND_MOTION:
            unknown.append(name)
    if not unknown:
        return None
    remedy = NOISE.remedy
    needs = {"B": "damping needs", "M": "mass needs"}.get(unknown[-1])
    if needs and np.isfinite(problem.band):
        fastest = _format_number(problem.band, 2)
        remedy = f"the position moved only below {fastest} Hz, {needs} faster motion; try palpate excite"
    return Warn(Code.LOW_EXCITATION, f"the log does not show {', '.join(unknown)}: {remedy}")


def parameter_unit(name: str, fitted: Prediction, units: Units) -> str:
    """The unit of one parameter of a model."""
    force = units["force"]
    position = units["position"]
    impedance = impedance_units(force, position)
    if name == "tau":
        return "s"
    if name == "Fc":
        return force
    if name == "n" or impedance["K"] == "1":
        return "1"
    if fitted.model.of_power and fitted.model.depth is None:
        n = fitted["n"] + (name == "B")
        return f"{force}{' s' if name == 'B' else ''}/{position}^{n:.3g}"
    return impedance["K" if name == "K1" else name]


def _format_number(value: float, count: int = 3) -> str:
    """A number rounded to some digits; with a power of ten only where it is very large or small."""
    return f"{float(f'{value:.{count}g}'):.7g}"


def _format_unit(unit: str) -> str:
    return "" if unit == "1" else unit
