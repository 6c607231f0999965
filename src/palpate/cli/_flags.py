"""Kinds of flags that several commands have, and numbers with their units."""

from __future__ import annotations

from cyclopts import Parameter

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
