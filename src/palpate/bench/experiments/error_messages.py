"""Errors of an experiment's file, in its own words: the key, the allowed value, the given one."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from types import NoneType
from typing import Any, Literal, get_args, get_origin

import msgspec

from palpate.errors import unknown

_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "left out",
}
_LIMITS = {">": "above", ">=": "at least", "<": "below", "<=": "at most"}
_EXPECTED = re.compile(r"Expected `([^`]+)`(?: (>=|<=|>|<) (\S+)| of length (\d+))?(?:, got .*)?$")
_MISSING = re.compile(r"Object missing required field `(.+)`")
_UNKNOWN_KEY = re.compile(r"Object contains unknown field `(.+)`")


def explained(message: str, tables: Mapping[str, Any], kind: Any) -> str:
    """msgspec's message about a file in its user's words.

    Args:
        message: as msgspec has it.
        tables: what was given, without types.
        kind: the type that it should have had.
    """
    what, _, path = message.partition(" - at `$")
    steps = re.findall(r"[^.\[\]`]+", path)
    if found := _UNKNOWN_KEY.match(what):
        return _unknown("key", found[1], _keys(kind, tables, steps), _place(steps))
    if found := _MISSING.match(what):
        choices = _choices(kind, tables, [*steps, found[1]])
        those = f"; it is one of: {', '.join(choices)}" if choices else ""
        return f"the key {found[1]!r} is missing{_place(steps)}{those}"
    given = _given(tables, steps)
    if what.startswith("Invalid"):
        return _unknown(steps[-1], str(given), _choices(kind, tables, steps), _place(steps[:-1]))
    if found := _EXPECTED.match(what):
        return f"{_name(steps)} must be {_wanted(*found.groups())}, got {given!r}"
    return f"{what}{_place(steps)}"


def not_finite(tables: Any, steps: tuple[str, ...] = ()) -> str | None:
    """Message about the first number that is not finite; None if all are."""
    if isinstance(tables, float) and not math.isfinite(tables):
        return f"{_name(list(steps))} must be finite, got {tables}"
    pairs = (
        tables.items() if isinstance(tables, dict) else enumerate(tables) if isinstance(tables, list) else ()
    )
    return next(filter(None, (not_finite(value, (*steps, str(key))) for key, value in pairs)), None)


def _unknown(kind: str, name: str, known: list[str], place: str) -> str:
    return str(unknown(kind, name, known)).replace(";", f"{place};", 1)


def _wanted(kind: str, sign: str | None, limit: str | None, length: str | None) -> str:
    words = " or ".join(_KINDS.get(name, name) for name in kind.split(" | ") if name != "null")
    if length is not None:
        return f"{words} of {length}"
    return words if sign is None or limit is None else f"{words} {_LIMITS[sign]} {float(limit):g}"


def _name(steps: list[str]) -> str:
    """``coulomb[1] in [friction]`` of the steps friction, coulomb, 1."""
    keys = [step for step in steps if not step.isdigit()]
    index = "".join(f"[{step}]" for step in steps if step.isdigit())
    return f"{keys[-1] if keys else 'the file'}{index}{_place(keys[:-1])}"


def _place(steps: list[str]) -> str:
    return f" in [{'.'.join(steps)}]" if steps else ""


def _given(tables: Any, steps: list[str]) -> Any:
    for step in steps:
        tables = tables[int(step)] if isinstance(tables, list) else tables.get(step)
    return tables


def _keys(kind: Any, tables: Mapping[str, Any], steps: list[str]) -> list[str]:
    """The keys of a table, of the kind that it says it is."""
    structs = list(_structs(kind, tables, steps))
    tags = [s.__struct_config__.tag_field for s in structs if s.__struct_config__.tag_field]
    return sorted({f.encode_name for s in structs for f in msgspec.structs.fields(s)} | set(tags))


def _choices(kind: Any, tables: Mapping[str, Any], steps: list[str]) -> list[str]:
    """Allowed words of a key."""
    *table, key = steps
    structs = list(_structs(kind, tables, table, of_any_kind=True))
    tags = [s.__struct_config__.tag for s in structs if s.__struct_config__.tag_field == key]
    fields = [f.type for s in structs for f in msgspec.structs.fields(s) if f.encode_name == key]
    words = [choice for f in fields if get_origin(f) is Literal for choice in get_args(f)]
    return [str(choice) for choice in tags or words]


def _structs(
    kind: Any, tables: Mapping[str, Any], steps: list[str], *, of_any_kind: bool = False
) -> Iterator[Any]:
    """The types that the table at these steps may have, or the one that its tag names."""
    for step in steps:
        kind = next(f.type for f in msgspec.structs.fields(kind) if f.encode_name == step)
    given = _given(tables, steps)
    for one in get_args(kind) or (kind,):
        if one is NoneType:  # a table that may be left out
            continue
        config = one.__struct_config__
        if of_any_kind or config.tag_field is None or given.get(config.tag_field) in {config.tag, None}:
            yield one
