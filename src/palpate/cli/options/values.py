"""Groups of options and their values: flags, quantities with units (`3:8:N/mm`, `15:N`, `10%`), VALUE:STD, x,y,z."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from math import isfinite, isnan
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Generic,
    TypeAlias,
    TypeVar,
    dataclass_transform,
    get_type_hints,
)

from cyclopts import Group, Parameter, Token, convert

from palpate.errors import InputError, PalpateError, unknown
from palpate.units import UNITS, unit

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
"""Largest values in SI: no robot has more, and their fourth power does not overflow."""
_SMALLEST = 1e-15
"""Smallest value in SI besides 0: no sensor resolves less."""


_NUMBER_AND_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\s\d:].*)")


def _separate_unit(text: str) -> str:
    """`15N` as `15:N`: a unit that follows its number directly."""
    head, colon, last = text.rpartition(":")
    match = None if _is_number(last) else _NUMBER_AND_UNIT.fullmatch(last.strip())
    return f"{head}{colon}{match[1]}:{match[2]}" if match else text


def quantity(option: str, text: str, kind: str) -> float:
    """`NUMBER`, `NUMBER:UNIT` or `NUMBERUNIT` in SI.

    Args:
        option: that it was given for, as in `--force`; errors name it.
        text: the given text.
        kind: of `FACTORS`.

    Raises:
        InputError: no number, no such unit, or a number that no robot has.
    """
    number, colon, symbol = _separate_unit(text).partition(":")
    return _in_range(
        option, _number(option, text, number), _factor(option, symbol, kind) if colon else 1.0, kind
    )


def spread(option: str, text: str, kind: str) -> tuple[float, float]:
    """`LOW:HIGH`, `LOW:HIGH:UNIT`, `VALUE` or `VALUE:UNIT` in SI, or without the last colon; a value is both ends.

    Raises:
        InputError: no numbers, or no such unit.
    """
    parts = _separate_unit(text).split(":")
    factor = 1.0
    if len(parts) > 1 and not _is_number(parts[-1]):
        factor = _factor(option, parts.pop(), kind)
    if len(parts) > 2:
        raise InputError(f"{option} needs LOW:HIGH or LOW:HIGH:UNIT, got {text!r}")
    low, high = (_number(option, text, part) for part in (parts[0], parts[-1]))
    return _in_range(option, low, factor, kind), _in_range(option, high, factor, kind)


def _in_range(option: str, number: float, factor: float, kind: str) -> float:
    value, largest = number * factor, _LARGEST[kind]
    if not (value == 0 or _SMALLEST <= abs(value) <= largest):
        raise InputError(
            f"{option} must be 0, or between {_SMALLEST:g} and {largest:g} in SI units, got {value:g};"
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
    fractions = {}
    for part in text.split(","):
        name, _, share = part.partition("=")
        if name.strip() not in names:
            raise unknown(f"parameter in {option}", name.strip(), names)
        fractions[name.strip()] = _share(option, share)
    return fractions


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


FLAG = Parameter(negative=())
"""A switch without a `--no-` of its own."""
SIGNED = Parameter(allow_leading_hyphen=True)
"""A value that may begin with a minus: it is a number below zero, not another option."""


def convert_value(kind: Any, tokens: Sequence[Token]) -> Any:
    """The value of any option or argument: a number must be one, and not beyond what the machine counts."""
    try:
        value = convert(kind, tokens)
    except OverflowError:
        raise InputError(f"it must be a finite number, got {tokens[0].value!r}") from None
    if isinstance(value, float) and isnan(value):
        raise InputError(f"it must be a number, got {tokens[0].value!r}")
    return value


def _whole_number(_: Any, tokens: Sequence[Token]) -> int:
    (token,) = tokens
    if not token.value.isdecimal():
        raise InputError(f"it must be a whole number, 0 or above, got {token.value!r}")
    return int(token.value)


WHOLE = Parameter(converter=_whole_number)
"""A seed; the conversion of cyclopts would silently round 1.5."""


def parse_lag(text: str | None) -> tuple[float, float] | None:
    """`VALUE`, `VALUE:STD`, either with a unit of time behind it, as two numbers in s.

    Raises:
        InputError: no numbers, another unit, or seconds where milliseconds seem to be meant.
    """
    if text is None:
        return None
    plain, _, symbol = text.rpartition(":")
    factor = 1.0
    if plain and _numbers([symbol]) is None:
        if unit(symbol).quantity != "time":
            raise InputError(
                f"{symbol!r} of --lag is a unit of {unit(symbol).quantity}; it needs one of time"
            )
        text, factor = plain, unit(symbol).factor
    lag = with_std("lag", text)
    if lag is not None and factor == 1.0 and not symbol.isalpha() and abs(lag[0]) >= _LONGEST_LAG:
        raise InputError(
            f"--lag {text} is {lag[0]:g} s, and no sensor is so late: is {text} ms meant? Then say --lag {text}:ms,"
            f" if not --lag {text}:s"
        )
    return None if lag is None else (factor * lag[0], factor * lag[1])


def with_std(option: str, text: str | None, example: str = "0.0076:0.0002") -> tuple[float, float] | None:
    """`VALUE` or `VALUE:STD` as two numbers."""
    if text is None:
        return None
    value, _, std = text.partition(":")
    numbers = _numbers([value, std or "0"])
    if numbers is None:
        plain = example.partition(":")[0]
        raise InputError(f"--{option} needs VALUE or VALUE:STD, as {plain} or {example}, got {text!r}")
    if numbers[1] < 0:
        raise InputError(f"the std of --{option} must be 0 or more, got {numbers[1]:g}")
    return numbers[0], numbers[1]


def vector(option: str, text: str, quantity: str) -> tuple[float, float, float]:
    """`x,y,z` or `x,y,z:UNIT` as three numbers in SI units.

    Args:
        option: its name.
        text: the given text.
        quantity: of the unit; `number` for a direction.
    """
    plain, _, symbol = text.partition(":")
    numbers = _numbers(plain.split(","))
    if numbers is None or len(numbers) != 3:
        raise InputError(f"{option} needs three numbers, as {_EXAMPLES[quantity]}, got {text!r}")
    given_unit = unit(symbol) if symbol else unit(_DEFAULTS[quantity])
    if given_unit.quantity != quantity:
        raise InputError(
            f"{symbol!r} of {option} is a unit of {given_unit.quantity}; it needs one of {quantity}"
        )
    return numbers[0] * given_unit.factor, numbers[1] * given_unit.factor, numbers[2] * given_unit.factor


def span(option: str, text: str) -> tuple[float, float]:
    """`BEGIN,END` as two numbers."""
    ends = _numbers(text.split(","))
    if ends is None or len(ends) != 2:
        raise InputError(f"{option} needs BEGIN,END in seconds, as 0,2.5, got {text!r}")
    return ends[0], ends[1]


_LONGEST_LAG = 1.0
"""A lag without a unit [s] from which on milliseconds are meant: no sensor of force is a second late."""
_DEFAULTS = {"length": "m", "angle": "deg", "number": "1"}
_EXAMPLES = {"length": "0,0,0.12 or 0,0,120:mm", "angle": "0,0,45 (degrees)", "number": "0,0,-1"}


def _numbers(words: list[str]) -> list[float] | None:
    """Finite numbers; None if one is none."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return None
    return numbers if all(isfinite(value) for value in numbers) else None


T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True)
def options(group: str | Group, rank: int = 0) -> Callable[[type[T]], type[T]]:
    """Makes a class a frozen dataclass of keyword options, under a heading of the help.

    Args:
        group: the heading, or a group that several classes share.
        rank: of a new heading among those of a command.
    """
    heading = Group(group, sort_key=rank) if isinstance(group, str) else group
    return lambda cls: Parameter(name="*", group=heading)(dataclass(frozen=True, kw_only=True)(cls))


class Typed(str, Generic[T]):
    """An option as it was typed, with its value in SI.

    Args:
        text: as typed.
        si: its value.
    """

    __slots__ = ("si",)
    si: T

    def __new__(cls, text: str, si: T) -> Typed[T]:
        """Keep the text and its value."""
        typed = super().__new__(cls, text)
        typed.si = si
        return typed


class OptionError(PalpateError):
    """An option's value is wrong, in one line that names the option."""


def si(typed: Typed[T] | None) -> T | None:
    """Value of an option in SI; None if it was not given."""
    return None if typed is None else typed.si


def quantity_default(text: str, kind: str) -> Typed[float]:
    """A quantity that an option has if it is not given."""
    return Typed(text, quantity("the default", text, kind))


def spread_default(text: str, kind: str) -> Typed[tuple[float, float]]:
    """A range that an option has if it is not given."""
    return Typed(text, spread("the default", text, kind))


def typed_option(parse: Callable[[str, str], Any]) -> Parameter:
    """An option that is kept as it is typed, beside its value.

    Args:
        parse: its name and its text into the value.
    """

    def convert(_: Any, tokens: Sequence[Token]) -> Typed[Any]:
        (token,) = tokens
        try:
            return Typed(token.value, parse(token.keyword or "it", token.value))
        except InputError as error:
            raise OptionError(str(error)) from None

    return Parameter(converter=convert, allow_leading_hyphen=True)


if TYPE_CHECKING:
    Quantity: TypeAlias = Typed[float]
    Ends: TypeAlias = Typed[tuple[float, float]]
    Triple: TypeAlias = Typed[tuple[float, float, float]]
else:
    Quantity = Ends = Triple = str  # what the help names

Damping = Annotated[Quantity, typed_option(partial(quantity, kind="damping"))]
Force = Annotated[Quantity, typed_option(partial(quantity, kind="force"))]
ForceRate = Annotated[Quantity, typed_option(partial(quantity, kind="force rate"))]
Frequency = Annotated[Quantity, typed_option(partial(quantity, kind="frequency"))]
Length = Annotated[Quantity, typed_option(partial(quantity, kind="length"))]
Mass = Annotated[Quantity, typed_option(partial(quantity, kind="mass"))]
Stiffness = Annotated[Quantity, typed_option(partial(quantity, kind="stiffness"))]
Time = Annotated[Quantity, typed_option(partial(quantity, kind="time"))]
Velocity = Annotated[Quantity, typed_option(partial(quantity, kind="velocity"))]
DampingRange = Annotated[Ends, typed_option(partial(spread, kind="damping"))]
MassRange = Annotated[Ends, typed_option(partial(spread, kind="mass"))]
StiffnessRange = Annotated[Ends, typed_option(partial(spread, kind="stiffness"))]
TimeRange = Annotated[Ends, typed_option(partial(spread, kind="time"))]
Interval = Annotated[Ends, typed_option(span)]
Angles = Annotated[Triple, typed_option(partial(vector, quantity="angle"))]
Direction = Annotated[Triple, typed_option(partial(vector, quantity="number"))]
Point = Annotated[Triple, typed_option(partial(vector, quantity="length"))]


def changed_fields(part: Any) -> dict[str, Any]:
    """Fields of a dataclass that differ from their defaults."""
    values = {field.name: (getattr(part, field.name), field.default) for field in fields(part)}
    return {name: value for name, (value, default) in values.items() if value != default}


def plain_value(value: Any) -> Any:
    """The value of an option as JSON has it: a path is a text, a tuple a list."""
    if isinstance(value, Mapping):
        return {name: plain_value(inner) for name, inner in value.items()}
    if isinstance(value, tuple | list):
        return [plain_value(inner) for inner in value]
    return str(value) if isinstance(value, Path | str) else value


def options_given(parts: Iterable[Any]) -> dict[str, Any]:
    """Options that differ from their defaults, by name."""
    return {
        _name(part, name): str(value) if isinstance(value, str) else value
        for part in parts
        for name, value in changed_fields(part).items()
    }


def only(part: Any, of: str) -> None:
    """Refuse options of another kind of arm or task: a part of a command that is not as by default.

    Raises:
        InputError: one was given; it is named.
    """
    for name in options_given((part,)):
        raise InputError(f"--{name} is for {of}, or leave out --{name}")


def _name(part: Any, field: str) -> str:
    """The first name of an option on the command line."""
    hint = get_type_hints(type(part), include_extras=True)[field]
    names = [
        name
        for metadata in getattr(hint, "__metadata__", ())
        for name in getattr(metadata, "name", None) or ()
    ]
    return names[0].removeprefix("--") if names else field.replace("_", "-")
