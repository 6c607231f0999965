"""A weighed tool: on a terminal, in Python, in a notebook, and on a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.contact_frame.tool_payload import Weighed
from palpate.contact_frame.weighing import Estimated
from palpate.report import page as pages
from palpate.report import style
from palpate.text import printable

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from palpate.contact_frame.load_files import NumberOfLoad

_NAMES = {
    "mass": "mass",
    "centre": "centre of mass, tool's axes",
    "weight": "weight, base's axes",
    "bias": "bias of the force, tool's axes",
    "drift": "drift of the bias",
    "torque_bias": "bias of the torque, tool's axes",
    "inertia": "inertial mass",
}


def table(found: Weighed) -> pages.Table:
    """Each number with its 95 % interval."""
    rows = [
        (_NAMES[name] + axis, f"{value:.4g}", _half(half), one.unit)
        for name, one in found.parameters.items()
        for axis, value, half in _parts(one)
    ]
    return pages.Table("", ("", "value", "+- 95 %", "unit"), rows)


def sentence(found: Weighed) -> str:
    """The answer in one sentence."""
    if found.payload is None:
        return "The poses do not determine the tool's mass: " + "; ".join(found.lacking) + "."
    mass = found.parameters["mass"]
    return f"The tool weighs {float(mass.value):.4g} +- {float(mass.half):.2g} kg (95 %, {found.poses} orientations)."


def answer_of(found: Weighed, log: str, check: Path | None, rows: list[NumberOfLoad]) -> pages.CommandAnswer:
    """The answer of `palpate payload`.

    Args:
        found: the tool.
        log: name of its log.
        check: a load file that is compared with it.
        rows: numbers of that file.
    """
    notes = [f"{note['code']}: {note['text']}" for note in found.notes]
    said, tables, checked = sentence(found), [table(found)], None
    if check is not None:
        agrees = bool(rows) and all(row.agrees for row in rows)
        numbers = [row._asdict() | {"agrees": row.agrees} for row in rows]
        checked = {"file": str(check), "agrees": agrees, "numbers": numbers}
    if check is not None and rows:
        said, tables = f"{said} {check_sentence(check.name, rows)}", [*tables, check_table(rows)]
    return pages.CommandAnswer(found.to_json() | {"check": checked}, log, f": {said}", tables, notes)


def check_table(rows: list[NumberOfLoad]) -> pages.Table:
    """Each number of a load file beside the log's."""
    numbers = [
        (
            row.name,
            f"{row.file:.4g}",
            f"{row.log:.4g}",
            _half(row.half),
            row.unit,
            "yes" if row.agrees else "no",
        )
        for row in rows
    ]
    return pages.Table("", ("", "file", "log", "+- 95 %", "unit", "agrees"), numbers)


def check_sentence(name: str, rows: list[NumberOfLoad]) -> str:
    """Whether a load file agrees with the log."""
    wrong = [row for row in rows if not row.agrees]
    if not wrong:
        return f"{printable(name)} agrees with the log."
    parts = (
        f"{row.name} {row.file:.4g} {row.unit}, {row.log:.4g} +- {row.half:.2g} by the log" for row in wrong
    )
    return f"{printable(name)} does not agree with the log: {'; '.join(parts)}."


def line(found: Weighed) -> str:
    """The answer in one line."""
    return printable(sentence(found))


def text(found: Weighed) -> str:
    """The sentence and the table of `palpate payload`."""
    return pages.as_text(sentence(found), [table(found).head, *table(found).rows])


def html(found: Weighed) -> str:
    """The same for a notebook."""
    rows = [table(found).head, *table(found).rows]
    return pages.as_html(sentence(found), rows, [note["text"] for note in found.notes])


def page(found: Weighed, title: str = "a record") -> str:
    """The page of `palpate payload --report`."""
    caption = "The force in each orientation: measured (dots) and predicted from tool and bias (rings)"
    answer = pages.PageAnswer(
        title=f"Payload of the sensor, from {title}",
        sentence=sentence(found),
        alerts=pages.warning_alerts([*(note["text"] for note in found.notes), *found.lacking]),
        tables=[table(found)],
        figures=[{"source": pages.data_address(style.svg(draw(found)), "image/svg+xml"), "caption": caption}],
        source=("The tool", "" if found.payload is None else found.payload.to_toml()),
    )
    return pages.answer_page(answer, room="payload", command=f"palpate payload {title}")


def _parts(one: Estimated) -> list[tuple[str, float, float]]:
    values, halves = np.atleast_1d(one.value), np.atleast_1d(one.half)
    axes = [""] if len(values) == 1 else [", x", ", y", ", z"]
    return [(a, float(v), float(h)) for a, v, h in zip(axes, values, halves, strict=True)]


def _half(half: float) -> str:
    return f"{half:.2g}" if np.isfinite(half) else "not told"


def draw(found: Weighed) -> Figure:
    """The force in each orientation, measured (dots) and of tool and bias (rings)."""
    with style.ink():
        figure, (axis,) = style.figure(height=2.8)
        places = np.arange(1, len(found.shown) + 1)
        for i, (name, colour) in enumerate(zip("xyz", style.SERIES[:3], strict=True)):
            axis.plot(places, found.shown[:, 0, i], ".", color=colour, label=name)
            axis.plot(places, found.shown[:, 1, i], "o", mfc="none", color=colour, markersize=8)
        axis.set_xlabel("orientation")
        axis.set_ylabel("force in the tool's axes [N]")
        style.legend(axis)
    return figure
