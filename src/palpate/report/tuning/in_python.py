"""A tuned force loop in Python: as the terminal has it, for a notebook, drawn, and as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.force.tuning import Tuning
from palpate.report.numbers import as_html, printed
from palpate.report.tuning import page as pages
from palpate.report.tuning.table import rows, show
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def line(told: Tuning) -> str:
    """The arm, the force, and whether anything is proved."""
    proved = "proved" if told.proved else "nothing proved"
    return printable(f"{told.gains.arm.title}, {told.gains.force:g} N, {proved}")


def text(told: Tuning) -> str:
    """Output of `palpate tune`."""
    return printed(lambda console: show(told, console))


def html(told: Tuning) -> str:
    """The same as a table."""
    table = [("", f"A force loop for {told.gains.arm.title}"), *rows(told)]
    return as_html("Tuning", table, [text for _, text in told.warnings])


def draw(told: Tuning) -> Figure:
    """The press on the softest and on the stiffest surface, its stiffness known."""
    return pages.first_touch(told)


def page(told: Tuning) -> str:
    """The page of `palpate tune --report`."""
    return pages.page(told, "palpate.force.tune(...).report(...)")
