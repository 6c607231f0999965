"""From a fit to verdicts: what of it may be believed, and why not the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.identification.choosing import Choice
from palpate.identification.estimators.fit import Fit
from palpate.identification.hidden_mass import HiddenMass, before_position
from palpate.identification.prior import Lag
from palpate.identification.result import Parameter, Verdict
from palpate.identification.surface import surface, together
from palpate.identification.warning_codes import Code, Warn
from palpate.units import impedance_units


@dataclass(frozen=True)
class Terms:
    """What a verdict is passed on, besides the fit.

    Args:
        tolerance: largest half-width of an identified parameter's interval, as a share of its value.
        calibration: relative standard deviation of the force's and position's scales together.
        series: stiffness in series with the surface and its standard deviation [N/m]; None if it is not given.
        force_unit, position_unit: of the record.
        lags: the force was found to lag the position although no lag is calibrated.
        bent: how far that lag, which may be longer, has moved K [N/m].
        band: frequency below which the probe moved [Hz].
        hidden: the mass that an uncalibrated lag may hide; None if there is none.
    """

    tolerance: float
    calibration: float
    series: tuple[float, float] | None
    force_unit: str
    position_unit: str
    lags: bool
    bent: float = 0.0
    band: float = np.inf
    hidden: HiddenMass | None = None


def verdicts(choice: Choice, lag: Lag, terms: Terms, warnings: list[Warn]) -> dict[str, Parameter]:
    """Pass a verdict on each parameter of the chosen model; warnings are added to the list given."""
    fitted = choice.candidate.fit
    names = [n for n in fitted.names if n not in ("offset", "lag", "x0")]
    found = {name: _verdict(name, choice, lag, terms, warnings) for name in names}
    place = surface(choice.candidate, choice.rejected, terms.tolerance, terms.position_unit)
    if place and place.verdict is Verdict.IDENTIFIED and not _begins(found):
        place = Parameter(None, None, None, place.unit, Verdict.NOT_IDENTIFIABLE, _NO_FORCE)
    if place:
        found["x0"] = place
    if terms.hidden and before_position(fitted):
        text = (
            f"the force seems to be read {-fitted.lag * 1e3:.2g} ms before the position, which no sensor's lag does: a"
            f" mass of up to {terms.hidden.mass:.2g} kg looks like this; calibrate the lag and give it with --lag"
        )
        warnings.append(Warn(Code.LAG_DAMPING_CONFOUNDED, text))
    if fitted.matched and not lag.known and _lag_rules(fitted):
        _confounded("B cannot be told from a lag of the force", fitted, terms, warnings)
    low = [n for n, p in found.items() if p.verdict is Verdict.NOT_IDENTIFIABLE and "lag" not in p.reason]
    low = [n for n in low if n in ("K", "B", "M", "K1", "tau", "n")]
    if low:
        text = f"the log does not show {', '.join(low)} above the noise: {_remedy(low[-1], terms)}"
        warnings.append(Warn(Code.LOW_EXCITATION, text))
    return found


_NO_FORCE = "the log does not show the force that would begin there"


def _begins(found: dict[str, Parameter]) -> bool:
    """Whether there is any force of which a place could be told."""
    return any(found[n].verdict is Verdict.IDENTIFIED for n in ("K", "K1", "n") if n in found)


def _verdict(name: str, choice: Choice, lag: Lag, terms: Terms, warnings: list[Warn]) -> Parameter:
    fitted = choice.candidate.fit
    value = fitted[name]
    std = _whole_std(name, choice, terms)
    unit = unit_of(name, fitted, terms)
    interval = _interval(name, value, fitted.t * std, terms.hidden)
    half = (interval[1] - interval[0]) / 2
    std = half / fitted.t
    if name in fitted.model.positive and interval[1] < 0:
        return _refused(name, value, unit, terms, warnings)
    if terms.lags and name in ("B", "M"):
        return Parameter(None, None, None, unit, Verdict.REJECTED, _LAGS.format(fit=value, unit=unit))
    if choice.rejected:
        return _of_rejected(name, choice, value, std, interval, unit)
    clear = interval[0] > 0 or interval[1] < 0
    if half <= terms.tolerance * abs(value) and clear:
        reason = f"known to {_percent(half, value)} (95 %){_with_hidden(name, half, terms)}"
        return Parameter(value, std, interval, unit, Verdict.IDENTIFIED, reason)
    reason = _why_not(name, fitted, lag, terms, interval, value, unit, warnings)
    return _reported(value, std, interval, unit, Verdict.NOT_IDENTIFIABLE, reason)


def _interval(name: str, value: float, half: float, hidden: HiddenMass | None) -> tuple[float, float]:
    """The 95 % interval; it reaches further to the side that a hidden mass would move the parameter to."""
    shift = hidden.shifts.get(name, 0.0) if hidden else 0.0
    further = float(np.hypot(half, shift))
    return (value - half, value + further) if shift > 0 else (value - further, value + half)


def _with_hidden(name: str, half: float, terms: Terms) -> str:
    """Say so if a hidden mass makes most of an interval."""
    if terms.hidden is None or abs(terms.hidden.shifts.get(name, 0.0)) < half:
        return ""
    return f", a mass of up to {terms.hidden.mass:.2g} kg included that would look like a lag"


_LAGS = "the force lags the position, and a lag T counts as a damping of -K T: calibrate it and give --lag"


def _refused(name: str, value: float, unit: str, terms: Terms, warnings: list[Warn]) -> Parameter:
    what = f"the fit gives {_digits(value)} {_shown(unit)}, below zero: no passive surface does that".replace(
        "  ", " "
    )
    if name == "K":
        warnings.append(Warn(Code.NEGATIVE_STIFFNESS, f"K: {what}; a channel's sign or column may be wrong"))
    elif not terms.lags:
        warnings.append(Warn(Code.FORCE_LAGS_POSITION, f"{name}: {what}; {_LAGS}"))
    return Parameter(
        None, None, None, unit, Verdict.REJECTED, f"{what}; {_LAGS if name != 'K' else 'check the signs'}"
    )


def _of_rejected(
    name: str, choice: Choice, value: float, std: float, interval: tuple[float, float], unit: str
) -> Parameter:
    """The model does not hold. A stiffness is still a secant through the log; damping and mass are artefacts."""
    seen = "; ".join(choice.candidate.against[:2])
    alone = [
        f"{label} alone {_digits(values[name])}" for label, values in choice.halves.items() if name in values
    ]
    if len(alone) == 2:
        seen = f"{', '.join(alone)} {_shown(unit)}".rstrip() + f"; {seen}"
    if name in ("K", "n"):
        curved = "n" in choice.candidate.fit.names
        what = "of the curve through" if curved else "a secant through"
        reason = f"{what} the whole contact, not a constant of the surface: {seen}"
        reason += together(choice.candidate) if name == "n" else ""
        return _reported(value, std, interval, unit, Verdict.REJECTED, reason)
    reason = f"the fit's {_digits(value)} {_shown(unit)} is an artefact of a model that does not hold: {seen}"
    return Parameter(None, None, None, unit, Verdict.REJECTED, reason)


def _reported(
    value: float, std: float, interval: tuple[float, float], unit: str, verdict: Verdict, reason: str
) -> Parameter:
    """A number only if its interval excludes zero."""
    if interval[0] <= 0 <= interval[1]:
        return Parameter(None, None, None, unit, verdict, reason)
    return Parameter(value, std, interval, unit, verdict, reason)


def _why_not(
    name: str,
    fitted: Fit,
    lag: Lag,
    terms: Terms,
    interval: tuple[float, float],
    value: float,
    unit: str,
    warnings: list[Warn],
) -> str:
    half = (interval[1] - interval[0]) / 2
    bounds = f"95 %: {_digits(interval[0])} to {_digits(interval[1])} {_shown(unit)}".rstrip()
    if _with_hidden(name, half, terms):
        text = f"{name} cannot be told from a lag of the force that hides a mass ({bounds})"
        return _confounded(text, fitted, terms, warnings)
    alone = fitted.t * fitted.std(name, lag_known=True)
    if lag.std and half > 1.5 * alone and alone <= max(terms.tolerance * abs(value), 0.67 * half):
        known = f"{fitted.std('lag') * 1e3:.2g} ms"
        text = f"{name} cannot be told from a lag of the force, which is known to {known} only ({bounds})"
        return _confounded(text, fitted, terms, warnings)
    pulled = abs(float(fitted.attenuation[fitted.names.index(name)]))
    if fitted.t * pulled > 0.7 * half:
        return (
            f"noise of the position may have pulled it by {pulled:.2g} ({bounds}); filter lower with --cutoff"
        )
    inside = interval[0] <= 0 <= interval[1]
    limit = "zero is within it" if inside else f"wider than {terms.tolerance:.0%}"
    return f"the log does not show it above the noise ({bounds}; {limit}): {_remedy(name, terms)}"


def _lag_rules(fitted: Fit) -> bool:
    """Whether what is not known of the lag makes most of what is not known of the damping."""
    if not {"K", "B"} <= set(fitted.names):
        return False
    return abs(fitted["K"]) * fitted.std("lag") > 2 * fitted.std("B", lag_known=True)


def _remedy(name: str, terms: Terms) -> str:
    """What would show a parameter."""
    if name in ("B", "M") and np.isfinite(terms.band):
        more = "mass needs" if name == "M" else "damping needs"
        return f"the position moved only below {_digits(terms.band, 2)} Hz, {more} faster motion; try palpate excite"
    return "press deeper, longer or more often; try palpate excite"


def _confounded(text: str, fitted: Fit, terms: Terms, warnings: list[Warn]) -> str:
    """Warn once for all parameters that a lag looks like one of them, and say what is known of them together."""
    if not any(w.code is Code.LAG_DAMPING_CONFOUNDED for w in warnings):
        whole = f"{text}{_together(fitted, terms)}; calibrate the lag T and give it with --lag"
        warnings.append(Warn(Code.LAG_DAMPING_CONFOUNDED, whole))
    return text


def _together(fitted: Fit, terms: Terms) -> str:
    """The combination of damping and lag that a narrow band shows: B - K T, for (M s^2 + B s + K) e^(-sT)."""
    if not {"K", "B", "lag"} <= set(fitted.names):
        return ""
    own = [fitted.names.index(name) for name in ("B", "K", "lag")]
    slope = np.array([1.0, -fitted.lag, -fitted["K"]])
    std = float(np.sqrt(max(slope @ fitted.cov[np.ix_(own, own)] @ slope, 0.0)))
    value = fitted["B"] - fitted["K"] * fitted.lag
    return f"; what is known is B - K T = {value:.4g} +- {fitted.t * std:.2g} {_shown(unit_of('B', fitted, terms))}"


def _whole_std(name: str, choice: Choice, terms: Terms) -> float:
    fitted = choice.candidate.fit
    value = fitted[name]
    parts = [fitted.std(name), terms.calibration * value if name not in ("n", "tau") else 0.0]
    if choice.rejected:
        parts += [d.spread for d in choice.candidate.disagreements if d.name == name]
    if name == "K":
        parts.append(terms.bent / fitted.t)
    if terms.series and name == "K":
        parts.append(terms.series[1] * (value / terms.series[0]) ** 2)
    return float(np.sqrt(np.sum(np.square(parts))))


def unit_of(name: str, fitted: Fit, terms: Terms) -> str:
    """The unit of one parameter of a model."""
    units = impedance_units(terms.force_unit, terms.position_unit)
    plain = units["K"] == "1"
    if name == "tau":
        return "s"
    if name == "Fc":
        return terms.force_unit
    if name == "n" or plain:
        return "1"
    if name in ("K2", "K3"):
        return f"{terms.force_unit}/{terms.position_unit}^{name[1]}"
    if fitted.model.name == "hunt-crossley":
        n = fitted["n"]
        power = f"{terms.position_unit}^{n + 1:.3g}" if name == "B" else f"{terms.position_unit}^{n:.3g}"
        return f"{terms.force_unit} s/{power}" if name == "B" else f"{terms.force_unit}/{power}"
    return units["K" if name == "K1" else name]


def _percent(half: float, value: float) -> str:
    return (
        f"{half / abs(value):.2g}".replace("inf", "?") if value == 0 else f"{100 * half / abs(value):.2g} %"
    )


def _digits(value: float, count: int = 3) -> str:
    """A number rounded to some digits; with a power of ten only where it is very large or small."""
    return f"{float(f'{value:.{count}g}'):.7g}"


def _shown(unit: str) -> str:
    return "" if unit == "1" else unit
