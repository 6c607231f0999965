"""Units of logs and their way into SI, and numbers in SI for people, with as many digits as mean something."""

import math
import re
from dataclasses import dataclass

from palpate.errors import InputError, unknown


@dataclass(frozen=True)
class Unit:
    """One unit: its quantity, its SI unit, and the factor to it."""

    quantity: str
    si: str
    factor: float


GRAVITY = 9.80665
"""Standard gravity [m/s^2]."""
_POUND_FORCE = 4.4482216152605
"""[N]: 0.45359237 kg at the standard 9.80665 m/s^2, exact."""

UNITS: dict[str, Unit] = {
    "1": Unit("number", "1", 1.0),
    "s": Unit("time", "s", 1.0),
    "ms": Unit("time", "s", 1e-3),
    "us": Unit("time", "s", 1e-6),
    "ns": Unit("time", "s", 1e-9),
    "min": Unit("time", "s", 60.0),
    "m": Unit("length", "m", 1.0),
    "cm": Unit("length", "m", 1e-2),
    "mm": Unit("length", "m", 1e-3),
    "um": Unit("length", "m", 1e-6),
    "nm": Unit("length", "m", 1e-9),
    "in": Unit("length", "m", 0.0254),
    "mil": Unit("length", "m", 0.0254e-3),
    "N": Unit("force", "N", 1.0),
    "kN": Unit("force", "N", 1e3),
    "mN": Unit("force", "N", 1e-3),
    "uN": Unit("force", "N", 1e-6),
    "nN": Unit("force", "N", 1e-9),
    "pN": Unit("force", "N", 1e-12),
    "gf": Unit("force", "N", GRAVITY * 1e-3),
    "g": Unit("force", "N", GRAVITY * 1e-3),
    "kgf": Unit("force", "N", GRAVITY),
    "kg": Unit("force", "N", GRAVITY),
    "lbf": Unit("force", "N", _POUND_FORCE),
    "ozf": Unit("force", "N", _POUND_FORCE / 16),
    "N/m": Unit("stiffness", "N/m", 1.0),
    "N/mm": Unit("stiffness", "N/m", 1e3),
    "kN/m": Unit("stiffness", "N/m", 1e3),
    "mN/mm": Unit("stiffness", "N/m", 1.0),
    "mN/um": Unit("stiffness", "N/m", 1e3),
    "rad": Unit("angle", "rad", 1.0),
    "deg": Unit("angle", "rad", math.pi / 180),
    "Nm": Unit("torque", "N m", 1.0),
    "N m": Unit("torque", "N m", 1.0),
    "mNm": Unit("torque", "N m", 1e-3),
    "m/s": Unit("velocity", "m/s", 1.0),
    "mm/s": Unit("velocity", "m/s", 1e-3),
    "rad/s": Unit("angular velocity", "rad/s", 1.0),
    "deg/s": Unit("angular velocity", "rad/s", math.pi / 180),
    "m/s^2": Unit("acceleration", "m/s^2", 1.0),
}
"""Units by symbol. `g` and `kg` are what a scale shows, so they are forces here (standard gravity)."""

_ALIASES = {
    "\u00b5m": "um",
    "\u03bcm": "um",
    "\u00b5s": "us",
    "\u03bcs": "us",
    "\u00b5N": "uN",
    "\u03bcN": "uN",
    "gram": "g",
    "grams": "g",
    "sec": "s",
    "seconds": "s",
    "Seconds": "s",
    "millimeters": "mm",
    "meters": "m",
    "milliseconds": "ms",
    "millis": "ms",
    "micros": "us",
    "microseconds": "us",
    "nanoseconds": "ns",
    "newton": "N",
    "newtons": "N",
    "Newton": "N",
    "Newtons": "N",
    "inch": "in",
    "lb": "lbf",
    "oz": "ozf",
    "-": "1",
    "": "1",
}


def unit(symbol: str) -> Unit:
    """The unit of a symbol.

    Raises:
        InputError: no such unit; the text lists those there are.
    """
    symbol = _ALIASES.get(symbol.strip(), symbol.strip())
    if symbol not in UNITS:
        raise unknown("unit", symbol, UNITS)
    return UNITS[symbol]


def known_unit(symbol: str) -> bool:
    """True if a symbol names a unit; False for an empty symbol."""
    symbol = symbol.strip()
    return bool(symbol) and _ALIASES.get(symbol, symbol) in UNITS


def split_spec(spec: str) -> tuple[str, str | None]:
    """`position_mm:mm` into the column's name and its unit's symbol, None where none is given.

    Only what follows the last colon can be a unit, so a name may hold colons if a unit is given too.

    Raises:
        InputError: the name is empty.
    """
    name, colon, symbol = spec.rpartition(":")
    if not colon:
        name, symbol = spec, ""
    if not name.strip():
        raise InputError(f"column {spec!r} has no name; write NAME or NAME:UNIT, as in position_mm:mm")
    return name.strip(), symbol.strip() if colon else None


def unit_in_name(name: str, quantity: str) -> str | None:
    """The unit that a column's name carries, as `mm` in `pos_mm`, `pos [mm]` and `pos, mm`, if it fits the quantity."""
    name = re.sub(r"([\])])\.\d+$", r"\1", name)  # pandas numbers repeated names
    name = re.sub(r"_(mm?|rad|deg)_s$", r"_\1/s", name)
    name = re.sub(r",\s*([^\s,]+)$", r"_\1", name)  # Force, N
    if quantity == "time":
        name = re.sub(r"^([mun]s)$|((?:milli|micro|nano)s(?:econds)?)$", r"_\1\2", name.lower())
    tail = name.rstrip(" ])").replace("[", "_").replace("(", "_").rsplit("_", 1)
    if len(tail) < 2:
        return None
    symbol = _ALIASES.get(tail[1].strip(), tail[1].strip())
    match = UNITS.get(symbol)
    return symbol if match and match.quantity == quantity else None


_PRODUCTS = {
    ("N", "m"): {"K": "N/m", "B": "N s/m", "M": "kg"},
    ("N m", "rad"): {"K": "N m/rad", "B": "N m s/rad", "M": "kg m^2"},
    ("1", "1"): {"K": "1", "B": "1", "M": "1"},
}


def impedance_units(force: str, position: str) -> dict[str, str]:
    """The units of stiffness K, damping B and mass M for a force and a position in SI units."""
    units = _PRODUCTS.get((force, position))
    if units:
        return dict(units)
    ratio = "1" if force == position else f"{force}/({position})"
    return {"K": ratio, "B": f"{ratio} s", "M": f"{ratio} s^2"}


NONE = "-"
_LARGE, _SMALL = 1e7, 1e-4
"""Sizes from which on, and under which, a power of ten is written out of a number."""


def plain(value: float | None, digits: int = 4) -> str:
    """A number with four digits, or as many as are asked for; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:.{digits}g}" if abs(value) < 10**digits else f"{value:.0f}"


def cone95(angle: float) -> float | None:
    """Half-angle of a normal's 95 % cone [rad] in degrees; None above 90, where it holds any normal into a surface."""
    degrees = math.degrees(angle)
    return degrees if degrees <= 90.0 else None


def with_half(value: float, half: float) -> str:
    """`5192 ± 18`: value and half-width of its interval, to two digits of the latter."""
    if not (half > 0 and math.isfinite(half)):
        return f"{plain(value)} ± ?"
    power = _power(max(abs(value), half))
    value = value / 10.0**power
    half = half / 10.0**power
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
        prefix = next(((f, p) for f, p in _PREFIXES if size >= 9.9995 * f), None)
        if prefix:
            return prefix
    if unit in _SMALL_PREFIXED and 0 < size < 0.1:
        return (1e-3, "m") if size >= 1e-4 else (1e-6, "µ")
    return 1.0, ""
