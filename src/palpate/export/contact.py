"""The contact that a simulator is to have: a spring and a damper, from what `palpate identify --json` prints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

from palpate.errors import InputError
from palpate.force.arm import Arm
from palpate.force.known_surface import known_from

LINEAR = ("kelvin-voigt", "kelvin-voigt-mass")
"""Models whose force is K x + B v (+ M a), as that of a simulator's contact."""
_IDENTIFIED = "identified"


@dataclass(frozen=True)
class Quantity:
    """A number and its origin.

    Args:
        value: in SI units.
        unit: of it.
        ci95: its 95 % interval; None if it has none.
        origin: identified, or given.
    """

    value: float
    unit: str
    ci95: tuple[float, float] | None = None
    origin: str = _IDENTIFIED

    def __str__(self) -> str:
        interval = f", 95 %: {self.ci95[0]:.6g} to {self.ci95[1]:.6g}" if self.ci95 else ""
        return f"{self.value:.6g} {self.unit} ({self.origin}{interval})"

    def to_json(self) -> dict[str, Any]:
        """The contact as plain values."""
        return {
            "value": self.value,
            "unit": self.unit,
            "ci95": list(self.ci95) if self.ci95 else None,
            "origin": self.origin,
        }


@dataclass(frozen=True)
class Contact:
    """The exported contact: f = K x + B v, one-sided, x the penetration.

    Args:
        stiffness: K [N/m].
        damping: B [N s/m].
        mass: M of the environment [kg]; None if none was identified or given.
        force: that the contact was pressed with [N]; None if it is not known.
        model: the identification's.
        source: the file that it is from.
        assumptions: a line each.
    """

    stiffness: Quantity
    damping: Quantity
    mass: Quantity | None
    force: float | None
    model: str
    source: str
    assumptions: tuple[str, ...] = ()

    @property
    def relaxation_time(self) -> float:
        """B / K [s]."""
        return self.damping.value / self.stiffness.value


@dataclass(frozen=True)
class Given:
    """Numbers in place of identified ones, and what replaces them in a refusal.

    Args:
        stiffness: K [N/m]; None for the identified one.
        damping: B [N s/m], likewise.
        mass: M [kg], likewise.
        working_point: take the stiffness at the working point in place of the model's K.
        arm: by which the log was measured: its compliance is taken out of a K that includes it, and a B that is not
            identified is assumed at the upper end of its interval, as `palpate tune` does.
        give_stiffness, give_damping, name_arm: remedies, in the options of the command.
    """

    stiffness: float | None = None
    damping: float | None = None
    mass: float | None = None
    working_point: bool = False
    arm: Arm | None = None
    give_stiffness: str = "give one with --stiffness"
    give_damping: str = "give one with --damping (0 for a pure spring)"
    name_arm: str = "name the arm with --arm"


def given_contact(given: Given) -> Contact:
    """The contact of numbers alone, without a log.

    Raises:
        InputError: one is missing, or is none that a contact has.
    """
    K = _given_quantity("stiffness", given.stiffness, "N/m")
    B = _given_quantity("damping", given.damping, "N s/m")
    if K is None or B is None:
        raise InputError(
            "nothing to export; give the output of palpate identify --json, or --stiffness and --damping (0 for a pure"
            " spring)"
        )
    M = _given_quantity("mass", given.mass, "kg")
    return Contact(K, B, M, None, "kelvin-voigt", "given numbers", (_LAW,))


def contact_from(
    answer: Mapping[str, Any], source: str, given: Given | None = None, **numbers: Any
) -> Contact:
    """The contact of an identification.

    Args:
        answer: the object that `palpate identify --json` prints, for one log or pooled.
        source: what to call it.
        given: numbers where none was identified, or instead of these.
        numbers: fields of `Given`.

    Raises:
        InputError: it is no such object; the model is not linear; K or B is not identified.
    """
    given = replace(given or Given(), **numbers)
    result = answer.get("pooled") if "logs" in answer else answer
    parameters = result.get("parameters") if isinstance(result, Mapping) else None
    if not isinstance(result, Mapping) or not isinstance(parameters, Mapping):
        raise InputError(
            f"{source}: not the output of palpate identify --json; give that output, or {given.give_stiffness}"
        )
    model = str(result.get("model") or "kelvin-voigt" if "logs" in answer else result.get("model"))
    point = result.get("working_point")
    K = _given_quantity("stiffness", given.stiffness, "N/m")
    B = _given_quantity("damping", given.damping, "N s/m")
    if given.arm is not None:
        alone = _behind_arm(answer, source, given, given.arm)
        K = K or alone[0]
        B = B or _if_identified(parameters.get("B"), "N s/m") or alone[1]
    warnings = result.get("warnings")
    codes = [
        warn.get("code")
        for warn in (warnings if isinstance(warnings, list) else [])
        if isinstance(warn, Mapping)
    ]
    if "series-compliance" in codes and given.arm is None and given.name_arm:
        given = replace(given, give_stiffness=f"{given.name_arm}, or {given.give_stiffness}")
    K = K or _stiffness(parameters, point, model, source, given)
    B = B or _identified_quantity(parameters, "B", "N s/m", source, given.give_damping)
    M = _given_quantity("mass", given.mass, "kg") or _if_identified(parameters.get("M"), "kg")
    assumptions = _assumptions(parameters, point, model, given.working_point)
    return Contact(K, B, M, _force(point), model, source, assumptions)


_LAW = "the force is K x + B v of the penetration x, and never pulls"


def _behind_arm(
    answer: Mapping[str, Any], source: str, given: Given, arm: Arm
) -> tuple[Quantity | None, Quantity | None]:
    """K of the surface behind an arm that gives way, and B as far as the log bounds it; None where neither applies."""
    try:
        measured = known_from(answer, source)
    except InputError as error:
        raise InputError(f"{str(error).partition('; ')[0]}; {given.give_stiffness}") from None
    known = measured.beyond(arm)
    K = B = None
    if "stiffness" in known.assumed:
        low, high = known.stiffness
        value = high if measured.value is None else min(arm.surface(measured.value), high)
        K = Quantity(value, "N/m", (low, high), f"identified, without the arm's {arm.series / 1e3:.3g} kN/m")
    if isfinite(known.damping[1]):
        origin = "assumed: the upper end of its interval"
        B = Quantity(known.damping[1], "N s/m", known.damping, origin)
    return K, B


def _given_quantity(name: str, value: float | None, unit: str) -> Quantity | None:
    if value is None:
        return None
    if not (isfinite(value) and value >= 0.0 and (value > 0.0 or name == "damping")):
        range_words = "0 or more" if name == "damping" else "above 0"
        raise InputError(f"--{name} must be {range_words} {unit}, got {value:g}")
    return Quantity(value, unit, None, "given, not identified")


def _stiffness(
    parameters: Mapping[str, Any], point: object, model: str, source: str, given: Given
) -> Quantity:
    measured = point.get("stiffness") if isinstance(point, Mapping) else None
    known = _if_identified(measured, "N/m")
    if given.working_point:
        return known or _identified_quantity(
            {"K": measured or {}}, "K", "N/m", source, "export the model's K instead"
        )
    remedy = (
        f"the stiffness at the working point is: {known.value:.6g} N/m; take it with --working-point"
        if known
        else given.give_stiffness
    )
    if model not in LINEAR:
        raise InputError(
            f"{source}: the force of {model} is not K x + B v, as that of a simulator's contact is; {remedy}"
        )
    return _identified_quantity(parameters, "K", "N/m", source, remedy)


def _identified_quantity(
    parameters: Mapping[str, Any], name: str, unit: str, source: str, remedy: str
) -> Quantity:
    parameter = parameters.get(name)
    quantity = _if_identified(parameter, unit)
    if quantity is not None:
        return quantity
    known = parameter if isinstance(parameter, Mapping) else {}
    if known.get("unit") is not None and known["unit"] != unit:
        raise InputError(
            f"{source}: {name} is in {known['unit']}, not {unit}; name the units of the log's columns"
        )
    # Remedies of palpate identify are no options of this command.
    verdict, reason = (
        known.get("verdict", "not there"),
        str(known.get("reason") or "").partition("; give --")[0],
    )
    reason = reason.rstrip(".")
    because = f" ({reason})" if reason else ""
    raise InputError(f"{source}: {name} is {verdict}{because}, and is not exported; {remedy}")


def _if_identified(parameter: object, unit: str) -> Quantity | None:
    if not isinstance(parameter, Mapping):
        return None
    if parameter.get("verdict") != _IDENTIFIED or parameter.get("unit") != unit:
        return None
    value = _number(parameter.get("value"))
    if value is None or not value > 0.0:
        return None
    ends = parameter.get("ci95")
    pair = [_number(end) for end in ends] if isinstance(ends, list | tuple) else []
    low, high = pair if len(pair) == 2 else (None, None)
    return Quantity(value, unit, None if low is None or high is None else (low, high))


def _number(value: object) -> float | None:
    """The value if it is a finite number; else None."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
    return float(value) if is_number else None  # type: ignore[arg-type]


def _force(point: object) -> float | None:
    """Mean force of the working point [N]; of a pooled one, the middle of its range."""
    force = point.get("force_N") if isinstance(point, Mapping) else None
    values = [_number(value) for value in (force if isinstance(force, list | tuple) else [force])]
    positive = [value for value in values if value is not None and value > 0.0]
    return sum(positive) / len(positive) if positive and len(positive) == len(values) else None


def _assumptions(parameters: Mapping[str, Any], point: object, model: str, at_point: bool) -> tuple[str, ...]:
    lines = [_LAW]
    force = _force(point)
    if force is not None:
        lines.append(f"K was measured at a mean force of {force:.3g} N; far from it the stiffness may differ")
    if at_point:
        frequency = _number(point.get("frequency_Hz")) if isinstance(point, Mapping) else None
        at = f", at {frequency:.3g} Hz" if frequency else ""
        lines.append(f"K is the stiffness at the working point{at}, whatever the model ({model})")
    friction = _if_identified(parameters.get("Fc"), "N")
    if friction is not None:
        lines.append(f"dry friction within the surface, {friction}, is left out")
    return tuple(lines)
