"""Kinds of flags that several commands have, and numbers with their units."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Any

from cyclopts import Parameter, Token

from palpate.errors import InputError

FLAG = Parameter(negative=())
"""A switch without a `--no-` of its own."""
SIGNED = Parameter(allow_leading_hyphen=True)
"""A value that may begin with a minus: it is a number below zero, not another option."""


def value_of(kind: Any, tokens: Sequence[Token]) -> Any:
    """The value of any option or argument: a number must be one, and not beyond what the machine counts."""
    from cyclopts import convert

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


def in_si(option: str, text: str, kind: str) -> float:
    """`NUMBER` or `NUMBER:UNIT` in SI.

    Raises:
        InputError: not a number, or not a unit of this kind.
    """
    from palpate.cli.options.quantities import quantity

    return quantity(option, text, kind)


def in_si_if_given(option: str, text: str | None, kind: str) -> float | None:
    """The same of an option that may be left out."""
    return None if text is None else in_si(option, text, kind)
