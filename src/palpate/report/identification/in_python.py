"""An identification in Python: as the terminal has it, for a notebook, drawn, and as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.errors import InputError
from palpate.identification.result import Identification, Parameter
from palpate.report.identification import figure
from palpate.report.identification import page as pages
from palpate.report.identification.answer import show
from palpate.report.identification.words import Source, formatted, sentence
from palpate.report.numbers import as_html, printed
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAME = "a record"
HEAD = ("parameter", "value", "verdict", "why")


def line(found: Identification) -> str:
    """The model, and each parameter with its verdict."""
    values = [f"{name} {_value(own)} {own.verdict}" for name, own in found.parameters.items()]
    return printable(f"{found.model}; {', '.join(values)}")


def text(found: Identification) -> str:
    """The output of `palpate identify`; `report` has all evidence."""
    return printed(lambda console: show(found, NAME, console))


def html(found: Identification) -> str:
    """The sentence, a row a parameter, and the warnings."""
    rows = [HEAD, *(_row(name, parameter) for name, parameter in found.parameters.items())]
    return as_html(sentence(found), rows, [f"{warn.code.word}: {warn.text}" for warn in found.warnings])


def _row(name: str, own: Parameter) -> tuple[str, ...]:
    return name, _value(own), str(own.verdict), own.reason


def _value(own: Parameter) -> str:
    return "-" if own.value is None else formatted(own)


def draw(found: Identification) -> Figure:
    """The figure of `palpate identify`.

    Raises:
        InputError: its traces were left out.
    """
    if found.traces is None:
        raise InputError(
            "this identification holds no traces, as many logs' do not; identify its log alone to draw it"
        )
    return figure.draw(found, NAME)


def page(found: Identification) -> str:
    """The page of `palpate identify --report`."""
    return pages.page(found, Source(NAME, found.options, command="palpate.identify(...).report(...)"))
