"""A weighed tool in Python: for `print` and for a notebook, drawn, and as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.contact_frame import Weighed
from palpate.report.numbers import as_html, as_text
from palpate.report.payload import page as pages
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def line(found: Weighed) -> str:
    """The answer in one line."""
    return printable(pages.sentence(found))


def text(found: Weighed) -> str:
    """The sentence and the table of `palpate payload`."""
    return as_text(pages.sentence(found), [pages.table(found).head, *pages.table(found).rows])


def html(found: Weighed) -> str:
    """The same for a notebook."""
    table = [pages.table(found).head, *pages.table(found).rows]
    return as_html(pages.sentence(found), table, [note["text"] for note in found.notes])


def draw(found: Weighed) -> Figure:
    """The force in each orientation, measured and of tool and bias."""
    return pages.draw(found)


def page(found: Weighed) -> str:
    """The page of `palpate payload --report`."""
    return pages.page(found, "a record")
