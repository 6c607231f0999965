"""How numbers are written for people: with as many digits as mean something."""

from __future__ import annotations

import math

NONE = "-"
_LARGE, _SMALL = 1e7, 1e-4
"""Sizes from which on, and under which, a power of ten is written out of a number."""


def plain(value: float | None, digits: int = 4) -> str:
    """A number with four digits, or as many as are asked for; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"


def with_half(value: float, half: float) -> str:
    """`5192 ± 18`: value and half-width of its interval, to two digits of the latter."""
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(value)} ± ?"
    power = _power(max(abs(value), half))
    value, half = value / 10.0**power, half / 10.0**power
    decimals = _decimals(half)
    text = " ± ".join(f"{round(number, decimals):.{max(0, decimals)}f}" for number in (value, half))
    return f"({text})·10{_superscript(power)}" if power else text


def between(low: float, high: float) -> str:
    """`5173 to 5210`: the ends of an interval, to two digits of its half-width."""
    half = (high - low) / 2
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(low)} to {plain(high)}"
    power = _power(max(abs(low), abs(high)))
    decimals = _decimals(half / 10.0**power)
    text = " to ".join(f"{round(end / 10.0**power, decimals):.{max(0, decimals)}f}" for end in (low, high))
    return f"({text})·10{_superscript(power)}" if power else text


def _decimals(half: float) -> int:
    """Behind the point, that two digits of `half` are seen; below zero before it."""
    return 1 - math.floor(math.log10(float(f"{half:.1e}")))


def _power(size: float) -> int:
    """The power of ten to take out of numbers that are too large or too small to read."""
    return 3 * math.floor(math.log10(size) / 3) if not _SMALL <= size < _LARGE else 0


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


_PREFIXED = {"N", "m", "s", "Pa", "N/m", "N s/m", "N m", "N m/rad"}
_SMALL_PREFIXED = {"N", "m", "s", "N m"}
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))


def quantity(value: float, unit: str, half: float | None = None, digits: int = 3) -> str:
    """`46.6 kN/m`, `2.36 mm` or `5244 ± 105 N/m`: a number in SI with the prefix that keeps it short.

    Args:
        value: in SI.
        unit: its own; `1` for none.
        half: half-width of its 95 % interval.
        digits: of a value without one.
    """
    factor, prefix = si_prefix(value, unit)
    number = plain(value / factor, digits) if half is None else with_half(value / factor, half / factor)
    return f"{number} {prefix}{unit}" if unit != "1" else number


def quantity_between(low: float, high: float, unit: str) -> str:
    """`5139 to 5348 N/m`: the ends of an interval, with the prefix of the larger."""
    factor, prefix = si_prefix(max(abs(low), abs(high)), unit)
    text = between(low / factor, high / factor)
    return f"{text} {prefix}{unit}" if unit != "1" else text


def si_prefix(value: float, unit: str) -> tuple[float, str]:
    """The factor and the letter of the SI prefix that keeps a number short."""
    size = abs(value)
    if unit in _PREFIXED:
        found = next(((f, p) for f, p in _PREFIXES if size >= 9.9995 * f), None)
        if found:
            return found
    if unit in _SMALL_PREFIXED and 0 < size < 0.1:
        return (1e-3, "m") if size >= 1e-4 else (1e-6, "µ")
    return 1.0, ""
