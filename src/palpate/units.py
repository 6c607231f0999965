"""The units that logs use, and their way into SI. Inside palpate everything is SI."""

import math
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
"""By symbol. `g` and `kg` are what a scale shows, so they are forces here (standard gravity)."""

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
    """Whether a symbol is that of a unit; none at all is not."""
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
    """The unit that a column's name carries, such as `mm` in `position_mm` or `pos [mm]`, if it fits the quantity."""
    tail = name.rstrip(" ])").replace("[", "_").replace("(", "_").rsplit("_", 1)
    if len(tail) < 2:
        return None
    symbol = _ALIASES.get(tail[1].strip(), tail[1].strip())
    found = UNITS.get(symbol)
    return symbol if found and found.quantity == quantity else None


_PRODUCTS = {
    ("N", "m"): {"K": "N/m", "B": "N s/m", "M": "kg"},
    ("N m", "rad"): {"K": "N m/rad", "B": "N m s/rad", "M": "kg m^2"},
    ("1", "1"): {"K": "1", "B": "1", "M": "1"},
}


def impedance_units(force: str, position: str) -> dict[str, str]:
    """The units of stiffness K, damping B and mass M for a force and a position in SI units."""
    known = _PRODUCTS.get((force, position))
    if known:
        return dict(known)
    ratio = "1" if force == position else f"{force}/({position})"
    return {"K": ratio, "B": f"{ratio} s", "M": f"{ratio} s^2"}
