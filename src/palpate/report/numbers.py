"""How numbers are written for people: with as many digits as mean something."""

from __future__ import annotations

import math

NONE = "-"
_LARGE, _SMALL = 1e7, 1e-4


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
    return f"({text})·10{_raised(power)}" if power else text


def between(low: float, high: float) -> str:
    """`5173 to 5210`: the ends of an interval, to two digits of its half-width."""
    half = (high - low) / 2
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(low)} to {plain(high)}"
    power = _power(max(abs(low), abs(high)))
    decimals = _decimals(half / 10.0**power)
    text = " to ".join(f"{round(end / 10.0**power, decimals):.{max(0, decimals)}f}" for end in (low, high))
    return f"({text})·10{_raised(power)}" if power else text


def _decimals(half: float) -> int:
    """Behind the point, that two digits of `half` are seen; below zero before it."""
    return 1 - math.floor(math.log10(float(f"{half:.1e}")))


def _power(size: float) -> int:
    """The power of ten to take out of numbers that are too large or too small to read."""
    return 3 * math.floor(math.log10(size) / 3) if not _SMALL <= size < _LARGE else 0


def _raised(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
