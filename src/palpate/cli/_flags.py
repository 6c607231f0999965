"""Flags that several commands have: how they are read, and where their results may go."""

from __future__ import annotations

from pathlib import Path

from cyclopts import Parameter

from palpate.errors import InputError
from palpate.files import check_place

FLAG = Parameter(negative=())
"""A switch without a `--no-` of its own."""
SIGNED = Parameter(allow_leading_hyphen=True)
"""A value that may begin with a minus: it is a number below zero, not another option."""


def in_si(option: str, text: str, kind: str) -> float:
    """`NUMBER` or `NUMBER:UNIT` in SI.

    Raises:
        InputError: no number, or no unit of this kind.
    """
    from palpate.excitation.quantities import quantity

    return quantity(option, text, kind)


def in_si_if_given(option: str, text: str | None, kind: str) -> float | None:
    """The same of an option that may be left out."""
    return None if text is None else in_si(option, text, kind)


def check_new(path: Path | None, option: str, *, replace: bool, ending: str = "") -> None:
    """Refuse a place before any work is done; a file that stands there too, unless it is to be replaced.

    Raises:
        InputError: in one line.
    """
    if path is None:
        return
    check_place(path, option, ending=ending)
    if path.exists() and not replace:
        raise InputError(f"{path} exists; choose another place, or add --replace")
