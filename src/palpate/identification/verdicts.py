"""From an answer to verdicts: what of it may be believed, and why not the rest."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from palpate.identification.causes import NOISE, Code, Warn, cause_of
from palpate.identification.estimators.budget import Answer, Budget, Prediction, Spread
from palpate.identification.estimators.fit import Fit
from palpate.identification.evidence import stiffness_of
from palpate.identification.options import LAG, Options
from palpate.identification.problem import Problem
from palpate.identification.result import WorkingPoint
from palpate.identification.selection import Choice
from palpate.identification.uncertainty import Parameter, Verdict, half_width
from palpate.signals.types import NORMAL
from palpate.units import impedance_units

_FAR = 2.0
"""Prior deviations from its prior beyond which a lag nobody calibrated is a sign of another cause (5 % by chance)."""
_NOTHING = 1e4
"""Half-widths over the value beyond which no bounds are worth printing."""
_SHAPE = ("n", "tau", "x0")
"""Parameters without force in their unit: no calibration of force or position scales them."""
_NUISANCE = ("x0", "y0")
"""Where the surface is, and how a branch was stretched when the log began: found, not asked for."""
_IN_TIME = ("B", "M", "K1", "tau")
"""Parameters that are seen in time: a shift of the force looks like them."""
_UNTOLD = "lag", "low-pass", "missing force"
"""Causes of which no faster motion tells more."""
_BELOW = "below zero: no passive surface does that"
_STEADY = "the log does not show it: the probe moves at constant speed"
_UNSIGNED = (
    "the log does not show the signs of force and position: begin it in free motion, or give --force-sign"
)
_UNTOUCHED = (
    "a power law needs depth and force from the touch on, and the log never leaves the surface:"
    " let it begin in free motion"
)
Units = Mapping[str, str]
"""Of a record's columns; here of its force and its position."""


def verdicts(
    choice: Choice, holds: Fit, point: WorkingPoint | None, options: Options, units: Units
) -> tuple[dict[str, Parameter], tuple[Warn, ...]]:
    """Pass a verdict on each parameter.

    `holds` is least squares on the model chosen, for the interval that holds if the model does; `point` is the working
    point, with which K must agree.
    """
    contacts, model = choice.problem.contacts, choice.answer.fit.model
    tangent = None if contacts.press is None or model.nonlinear else point
    found = _lacking(against_working_point(choice.answer, point))
    if tangent is not None:
        found = replace(found, budget=_with_presses(found, tangent))
    scales = np.array([0.0 if name in (*_SHAPE, LAG) else options.calibration for name in found.names])
    found = found.with_cause("calibration", scales * found.theta)
    names = [n for n in found.names if n not in (LAG, *_NUISANCE)]
    parameters = {name: _parameter(name, found, holds, options.tolerance, units) for name in names}
    parameters = _passive(parameters, contacts.payload is not None)
    refused = _UNSIGNED if not contacts.signed else _UNTOUCHED if model.of_power and contacts.bonded else ""
    for name, p in parameters.items() if refused else ():
        if p.verdict is Verdict.IDENTIFIED:
            parameters[name] = replace(p, verdict=Verdict.NOT_IDENTIFIABLE, reason=refused)
    if tangent is not None:
        parameters = _of_press(parameters, tangent)
    return parameters, _warnings(parameters, found, choice.problem, options.tolerance)


def _parameter(name: str, found: Answer, holds: Fit, tolerance: float, units: Units) -> Parameter:
    value, unit = found[name], unit_of(name, found.fit, units)
    half, parts = found.half_of(name), found.contributions(name)
    whole = Parameter.of(value, unit, Verdict.NOT_IDENTIFIABLE, "", parts)
    low, high = interval = (value - half, value + half)
    if name in holds.names:
        reach = float(np.hypot(holds.half_of(name), parts["calibration"].half))
        whole = replace(whole, ci95_if_model_holds=(holds[name] - reach, holds[name] + reach))
    if name in found.fit.model.positive and _highest(found, name) < 0:
        reason = f"the fit gives {_digits(value)} {_show(unit)}, {_BELOW}"
        return whole.without_number(" ".join(reason.split()), Verdict.REJECTED)
    if half > _NOTHING * max(abs(value), 1e-300):
        return whole.without_number(f"the log does not show it: {NOISE.remedy}")
    clear = low > 0 or high < 0
    if half <= tolerance * abs(value) and clear:
        reason, depth = f"known to {100 * half / abs(value):.2g} % (95 %)", found.fit.model.depth
        if depth is not None and name not in _SHAPE:  # it grows with the depth
            reason += f", at a penetration of {_digits(depth)} {units['position']}"
        return replace(whole, verdict=Verdict.IDENTIFIED, reason=reason)
    bounds = f"95 %: {_digits(low)} to {_digits(high)} {_show(unit)}".rstrip()
    limit = f"wider than {tolerance:.0%}" if clear else "zero is within it"
    main = cause_of(next(iter(whole.budget), "noise"))
    reason = f"{bounds}; {limit}. Mostly due to {main.described}: {main.remedy}"
    return replace(whole, reason=reason) if clear else whole.without_number(reason, ci95=interval)


def _highest(found: Answer, name: str) -> float:
    """Upper end of a parameter's interval: a low-pass that nobody gave adds to a mass, and takes nothing from it."""
    parts = found.contributions(name)
    return found[name] + half_width({cause: part for cause, part in parts.items() if cause != "low-pass"})


def against_working_point(found: Answer, point: WorkingPoint | None) -> Answer:
    """An answer with the gap between the stiffness of its force at the working point and of the log's as a cause.

    Both are read in the same way: the slope of a press has a mass and a damping in it, in the log as in the answer.
    A parameter may be off by as much as it moves if the answer is made to agree: theta + C g (g' C g)^-1 gap, C the
    covariance and g the stiffness' derivatives (a measurement without error in a Kalman filter). Nothing is compared
    without a working point that has an interval.
    """
    if point is None or point.stiffness.ci95 is None or point.stiffness.value is None:
        return found
    problem, fitted = found.problem, found.fit
    shown, own = (stiffness_of(problem, force, point) for force in (problem.force, fitted.force))
    if shown is None or own is None:
        return found
    slope = np.zeros(len(found.names))
    for i, name in enumerate(found.names):
        if name in fitted.theta:
            step = 1e-4 * (abs(fitted.theta[name]) or 1.0)
            theta = fitted.theta | {name: fitted.theta[name] + step}
            moved = Prediction.of(fitted.model, problem.motion, problem.force, theta, fitted.lag)
            slope[i] = ((stiffness_of(problem, moved.force, point) or own) - own) / step
    common = "calibration", "friction", "loadings"  # of the answer, too
    parts = {cause: part for cause, part in point.stiffness.contributions.items() if cause not in common}
    along = found.cov @ slope
    power = float(slope @ along)
    gap = max(abs(own - shown) - float(np.hypot(NORMAL * np.sqrt(max(power, 0.0)), half_width(parts))), 0.0)
    return found.with_cause("dynamic stiffness", along * gap / power if power > 0 else np.zeros(len(slope)))


def _lacking(found: Answer) -> Answer:
    """An answer whose damping may be off by as much force as its mass is certainly below zero.

    Of a force in an unknown phase, as much is in quadrature as in phase.
    """
    if "M" not in found.names or (highest := _highest(found, "M")) >= 0:
        return found
    speed, acceleration = (np.std(found.problem.motion.moved(k, found.fit.lag)) for k in (1, 2))
    most = highest * acceleration / speed
    return found.with_cause("missing force", most / NORMAL * np.equal(found.names, "B"))


def _with_presses(found: Answer, point: WorkingPoint) -> Budget:
    """The budget of a linear answer, its stiffness no more certain than presses at constant speed agree on theirs.

    At constant speed neither a damping nor a mass makes the slopes of two presses differ.
    """
    apart = point.stiffness.contributions["repetition"]
    own, place = found.budget["repetition"], found.names.index("K")
    variance, freedom = own.variance.copy(), own.each.copy()
    if apart.std**2 > variance[place]:
        variance[place], freedom[place] = apart.std**2, apart.freedom
    return found.budget | {"repetition": Spread(variance, freedom)}


def _of_press(parameters: dict[str, Parameter], point: WorkingPoint) -> dict[str, Parameter]:
    """K of presses at constant speed is their tangent, unless a model among them knows it better; no more is shown."""
    shown = {
        name: replace(p, verdict=Verdict.NOT_IDENTIFIABLE, reason=_STEADY)
        for name, p in parameters.items()
        if p.verdict is Verdict.REJECTED
    }
    own = parameters["K"]
    if len(point.each) > 1 and own.ci95 is not None:
        among = own.ci95[0] <= max(point.each) and own.ci95[1] >= min(point.each)
        own = own if among else point.stiffness
    both = [p for p in (point.stiffness, own) if p.verdict is Verdict.IDENTIFIED]
    K = min(both, key=lambda p: p.std or np.inf, default=point.stiffness)
    return parameters | shown | {"K": K}


def _passive(parameters: dict[str, Parameter], weighed: bool) -> dict[str, Parameter]:
    """A parameter that is certainly below zero refuses those that the same missing force may be in.

    All that is seen in time shares a force that depends on the motion. A stiffness below zero leaves no model at all. A
    mass below zero is in the damping's interval (`_lacking`), and refuses all only where a tool's inertia was found in
    free motion and removed (`weighed`): it is not that force, and K rests on the same fit.
    """
    negative = [name for name in ("K", "B", "M") if name in parameters and _BELOW in parameters[name].reason]
    if "K" in negative:
        reason, touched = "K is certainly below zero: the model does not hold", (*parameters,)
    elif len(negative) == 1 and (weighed or "B" in negative):
        reason = f"{negative[0]} is certainly below zero: the model lacks a force that depends on the motion"
        touched = ("K", *_IN_TIME) if weighed else _IN_TIME
    else:
        return parameters
    return {  # a number that a model gives which does not hold stands nowhere
        name: p.without_number(reason, Verdict.REJECTED)
        if name in touched and p.verdict is Verdict.IDENTIFIED
        else p
        for name, p in parameters.items()
    }


def _warnings(
    parameters: dict[str, Parameter], found: Answer, problem: Problem, tolerance: float
) -> tuple[Warn, ...]:
    lag = problem.lag
    told: list[tuple[Code, str]] = []
    if LAG in found.names and not lag.known:
        at, reach = found[LAG], _FAR * lag.std
        if abs(at - lag.value) > reach or at + found.half_of(LAG) < lag.value - reach:
            text = (
                f"the fit estimates a lag of {_digits(1e3 * at)} ms of the force, longer than sensors have:"
                " something else delays the force; parameters that such a delay changes are rejected"
            )
            told.append((Code.FORCE_LAGS_POSITION, text))
    damping, stiffness = parameters.get("B"), parameters.get("K")
    if damping is not None and _BELOW in damping.reason and damping.verdict is not Verdict.IDENTIFIED:
        text = f"B: {damping.reason}; a lag T of the force adds -K T to it: calibrate the lag and give --lag"
        told.append((Code.FORCE_LAGS_POSITION, text))
    elif damping is not None and damping.verdict is not Verdict.IDENTIFIED and not lag.known:
        reach = NORMAL * lag.std * abs(found["K"]) if "K" in found.names else 0.0
        if damping.budget.get("lag", 0.0) > tolerance * abs(found["B"]):
            text = (
                "a lag of the force lowers B by K times the lag, and the lag is not calibrated: B is uncertain by"
                f" {_digits(reach, 2)} {_show(damping.unit)}; give --lag"
            )
            told.append((Code.LAG_DAMPING_CONFOUNDED, text))
    if stiffness is not None and _BELOW in stiffness.reason:
        text = f"K: {stiffness.reason}; a channel's sign or column may be wrong (--force-sign)"
        told.append((Code.NEGATIVE_STIFFNESS, text))
    low = [
        n for n, p in parameters.items()
        if p.verdict is Verdict.NOT_IDENTIFIABLE and next(iter(p.budget), "noise") not in _UNTOLD
    ]  # fmt: skip
    if low:
        remedy, more = NOISE.remedy, {"B": "damping needs", "M": "mass needs"}.get(low[-1])
        if more and np.isfinite(problem.band):
            fastest = _digits(problem.band, 2)
            remedy = f"the position moved only below {fastest} Hz, {more} faster motion; try palpate excite"
        told.append((Code.LOW_EXCITATION, f"the log does not show {', '.join(low)}: {remedy}"))
    return tuple(Warn(*own) for own in told)


def unit_of(name: str, fitted: Prediction, units: Units) -> str:
    """The unit of one parameter of a model."""
    force, position = units["force"], units["position"]
    own = impedance_units(force, position)
    if name == "tau":
        return "s"
    if name == "Fc":
        return force
    if name == "n" or own["K"] == "1":
        return "1"
    if fitted.model.of_power and fitted.model.depth is None:
        n = fitted["n"] + (name == "B")
        return f"{force}{' s' if name == 'B' else ''}/{position}^{n:.3g}"
    return own["K" if name == "K1" else name]


def _digits(value: float, count: int = 3) -> str:
    """A number rounded to some digits; with a power of ten only where it is very large or small."""
    return f"{float(f'{value:.{count}g}'):.7g}"


def _show(unit: str) -> str:
    return "" if unit == "1" else unit
