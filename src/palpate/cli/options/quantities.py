"""Quantities of the command line, from text to SI: `3:8:N/mm`, `15:N`, `10%`, `K=2%,M=25%`."""

from __future__ import annotations

from math import isfinite

from palpate.errors import InputError, unknown
from palpate.units import UNITS

FACTORS: dict[str, dict[str, float]] = {
    "stiffness": {"N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3, "N/cm": 1e2},
    "damping": {"N s/m": 1.0, "Ns/m": 1.0, "kN s/m": 1e3, "kNs/m": 1e3, "N s/mm": 1e3, "Ns/mm": 1e3},
    "mass": {"kg": 1.0, "g": 1e-3},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "force rate": {"N/s": 1.0, "kN/s": 1e3},
    **{
        kind: {symbol: unit.factor for symbol, unit in UNITS.items() if unit.quantity == kind}
        for kind in ("force", "length", "time", "velocity")
    },
}
"""Units by quantity, and their factors into SI."""
_LARGEST = {
    "stiffness": 1e12,
    "damping": 1e9,
    "mass": 1e6,
    "frequency": 1e7,
    "force rate": 1e12,
    "force": 1e9,
    "length": 1e6,
    "time": 1e9,
    "velocity": 1e6,
}
"""In SI: no robot has more, and no calculation with its fourth power overflows."""
_SMALLEST = 1e-15
"""In SI, but for 0: the step of no sensor is finer."""


def quantity(option: str, text: str, kind: str) -> float:
    """`NUMBER` or `NUMBER:UNIT` in SI.

    Args:
        option: that it was given for, as in `--force`; errors name it.
        text: the given text.
        kind: of `FACTORS`.

    Raises:
        InputError: no number, no such unit, or a number that no robot has.
    """
    number, colon, symbol = text.partition(":")
    return _in_range(
        option, _number(option, text, number), _factor(option, symbol, kind) if colon else 1.0, kind
    )


def spread(option: str, text: str, kind: str) -> tuple[float, float]:
    """`LOW:HIGH`, `LOW:HIGH:UNIT`, `VALUE` or `VALUE:UNIT` in SI; a value alone is both ends.

    Raises:
        InputError: no numbers, or no such unit.
    """
    parts = text.split(":")
    factor = 1.0
    if len(parts) > 1 and not _is_number(parts[-1]):
        factor = _factor(option, parts.pop(), kind)
    if len(parts) > 2:
        raise InputError(f"{option} needs LOW:HIGH or LOW:HIGH:UNIT, got {text!r}")
    low, high = (_number(option, text, part) for part in (parts[0], parts[-1]))
    return _in_range(option, low, factor, kind), _in_range(option, high, factor, kind)


def _in_range(option: str, number: float, factor: float, kind: str) -> float:
    value, most = number * factor, _LARGEST[kind]
    if not (value == 0 or _SMALLEST <= abs(value) <= most):
        raise InputError(
            f"{option} must be 0, or between {_SMALLEST:g} and {most:g} in SI units, got {value:g};"
            f" no robot has such a {kind}"
        )
    return value


def shares(option: str, text: str, names: tuple[str, ...]) -> dict[str, float]:
    """`10%` for all parameters, or `K=2%,M=25%` for some; plain numbers are shares of 1.

    Raises:
        InputError: not of this form.
    """
    if "=" not in text:
        return dict.fromkeys(names, _share(option, text))
    found = {}
    for part in text.split(","):
        name, _, share = part.partition("=")
        if name.strip() not in names:
            raise unknown(f"parameter in {option}", name.strip(), names)
        found[name.strip()] = _share(option, share)
    return found


def _share(option: str, text: str) -> float:
    number = text.strip().removesuffix("%")
    return _number(option, text, number) * (0.01 if text.strip().endswith("%") else 1.0)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(option: str, text: str, number: str) -> float:
    if not _is_number(number) or not isfinite(float(number)):
        raise InputError(f"{option} needs a number, or a number and a unit after a colon, got {text!r}")
    return float(number)


def _factor(option: str, symbol: str, kind: str) -> float:
    if symbol.strip() not in FACTORS[kind]:
        raise unknown(f"unit of {kind} in {option}", symbol.strip(), FACTORS[kind])
    return FACTORS[kind][symbol.strip()]
