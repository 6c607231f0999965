"""Compound numbers of the command line: VALUE:STD, and x,y,z with a unit."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli._terminal import print_lines
from palpate.cli.options.flags import FLAG
from palpate.errors import InputError
from palpate.text import printable
from palpate.units import unit

if TYPE_CHECKING:
    from palpate.bench.toml_parts import TomlFiles


def lag_of(text: str | None) -> tuple[float, float] | None:
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
    found = with_std("lag", text)
    if found is not None and factor == 1.0 and not symbol.isalpha() and abs(found[0]) >= _LONGEST_LAG:
        raise InputError(
            f"--lag {text} is {found[0]:g} s, and no sensor is so late: is {text} ms meant? Then say --lag {text}:ms,"
            f" if not --lag {text}:s"
        )
    return None if found is None else (factor * found[0], factor * found[1])


def with_std(option: str, text: str | None, example: str = "0.0076:0.0002") -> tuple[float, float] | None:
    """`VALUE` or `VALUE:STD` as two numbers."""
    if text is None:
        return None
    value, _, std = text.partition(":")
    found = _numbers([value, std or "0"])
    if found is None:
        plain = example.partition(":")[0]
        raise InputError(f"--{option} needs VALUE or VALUE:STD, as {plain} or {example}, got {text!r}")
    if found[1] < 0:
        raise InputError(f"the std of --{option} must be 0 or more, got {found[1]:g}")
    return found[0], found[1]


def vector(option: str, text: str | None, quantity: str) -> tuple[float, float, float] | None:
    """`x,y,z` or `x,y,z:UNIT` as three numbers in SI units.

    Args:
        option: its name.
        text: the given text.
        quantity: of the unit; `number` for a direction.
    """
    if text is None:
        return None
    plain, _, symbol = text.partition(":")
    found = _numbers(plain.split(","))
    if found is None or len(found) != 3:
        raise InputError(f"--{option} needs three numbers, as {_EXAMPLES[quantity]}, got {text!r}")
    own = unit(symbol) if symbol else unit(_DEFAULTS[quantity])
    if own.quantity != quantity:
        raise InputError(f"{symbol!r} of --{option} is a unit of {own.quantity}; it needs one of {quantity}")
    return found[0] * own.factor, found[1] * own.factor, found[2] * own.factor


def span(option: str, text: str | None) -> tuple[float, float] | None:
    """`BEGIN,END` as two numbers."""
    if text is None:
        return None
    found = _numbers(text.split(","))
    if found is None or len(found) != 2:
        raise InputError(f"--{option} needs BEGIN,END in seconds, as 0,2.5, got {text!r}")
    return found[0], found[1]


_LONGEST_LAG = 1.0
"""A lag without a unit [s] from which on milliseconds are meant: no sensor of force is a second late."""
_DEFAULTS = {"length": "m", "angle": "deg", "number": "1"}
_EXAMPLES = {"length": "0,0,0.12 or 0,0,120:mm", "angle": "0,0,45 (degrees)", "number": "0,0,-1"}


def _numbers(words: list[str]) -> list[float] | None:
    """Finite numbers; None if one is none."""
    try:
        found = [float(word) for word in words]
    except ValueError:
        return None
    return found if all(isfinite(value) for value in found) else None


@Parameter(name="*", group=Group("Known names", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class KnownOptions:
    """List or print, without a run."""

    list_: Annotated[bool, FLAG, Parameter(name="--list")] = False
    "List the known names and stop."
    print_: Annotated[bool, FLAG, Parameter(name="--print")] = False
    "Print the named file, to copy and edit, and stop."


@Parameter(name="*", group=Group("Output", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class FolderOptions:
    """The folder of results."""

    out: Path | None = None
    "Folder for results; when left out, one in runs/ with the name of the run."
    replace: Annotated[bool, FLAG] = False
    "Replace existing results."
    json: Annotated[bool, FLAG] = False
    "Print the summary as JSON and nothing else."


def print_names(files: TomlFiles, title: Callable[[str], str]) -> None:
    """Print the names that come with palpate, each with its title."""
    width = 2 + max(map(len, files.names()))
    for name in files.names():
        print_lines(f"{name:<{width}}{title(name)}")


def source_of(files: TomlFiles, name: str | None, verb: str, printed: bool) -> str | None:
    """The text of the named file; None if it was only printed.

    Raises:
        InputError: no name, or an unknown one.
    """
    if name is None:
        raise InputError(
            f"no {files.kind} is named; name one (palpate {verb} --list lists them) or a TOML file"
        )
    source = files.source(name)
    if not printed:
        return source
    sys.stdout.write(printable(source))
    return None
