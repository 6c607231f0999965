"""The figure of an identification: the answer, the spectrum and the press, then how the model follows the log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from palpate.report import style
from palpate.report.identification import evidence_panels as evidence
from palpate.report.identification import evidence_panels as fit
from palpate.report.identification import evidence_panels as trust
from palpate.report.identification.words import MARKS, formatted, model_line, sentence, subtitle
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from palpate.identification.result import Identification, Traces

Panel = Callable[["Axes", "Identification", "Traces"], None]

_WIDE, _HIGH, _HEAD = 13.0, 11.8, 1.75
_LINE = 160
"""Letters in a line of the head."""
_PIXEL = 1 / 72
"""Of a page, in inches: what is drawn so wide keeps its letters at their size."""
_LETTERS = 12
"""Size of letters on a page [px]."""


def write_figure(found: Identification, path: Path, title: str, dpi: int | None = None) -> Path:
    """Draw an identification and write it, whole or not at all.

    Args:
        found: with its traces.
        path: of the PNG, SVG or PDF.
        title: what to call the log.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    figure = draw(found, title)
    return style.save(figure, path, dpi)


def draw(found: Identification, title: str) -> Figure:
    """The figure of an identification; needs its traces."""
    traces = found.traces
    if traces is None:
        raise ValueError("an identification without traces has no figure")
    with style.ink():
        fitted = len(traces.fitted_time) > 0
        figure = _figure(_WIDE, _HIGH if fitted else _HIGH / 2)
        parts: Any = figure.subfigures(2, 1, height_ratios=(_HEAD, figure.get_figheight() - _HEAD))
        head, body = parts
        _head(head, found, title)
        if fitted:
            _panels(body, found, traces)
        else:
            fit.force(_title(body.subplots(), "Force"), found, traces)
    return figure


def _head(figure: Any, found: Identification, title: str) -> None:
    """The answer in a sentence, what else is known, and of which log."""
    lines = [(printable(title), 11.5, style.QUIET), (sentence(found), 14, style.INK)]
    values = [f"{name} {formatted(p)} {MARKS[p.verdict]} {p.verdict}" for name, p in found.parameters.items()]
    lines += [(model_line(found), 10, style.QUIET), (";  ".join(values), 10, style.INK)]
    lines += [(subtitle(found), 9, style.QUIET)]
    top = 1 - 0.06 / _HEAD
    for text, size, colour in lines:
        wrapped = fill(text, int(_LINE * 11 / size))
        figure.text(0.01, top, wrapped, fontsize=size, va="top", color=colour, parse_math=False)
        top -= (1.35 * size * (wrapped.count("\n") + 1) + 3) * _PIXEL / _HEAD if text else 0


def _panels(figure: Any, found: Identification, traces: Traces) -> None:
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.35, 1.0))
    left, right = top.subfigures(1, 2)
    dynamic(left, found, traces, "Dynamic stiffness")
    evidence.press(_title(right.subplots(), "Press"), found, traces)
    left, right = bottom.subfigures(1, 2, width_ratios=(1.3, 1.0))
    above, below = left.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    fit.force(_title(above, "Force"), found, traces)
    fit.residual(_title(below, "Misfit"), found, traces)
    above.set_xlabel("")
    trust.residual_spectrum(_title(right.subplots(), "Is the misfit noise?"), found, traces)


def dynamic(figure: Any, found: Identification, traces: Traces, title: str = "") -> None:
    """Storage above loss, over the same frequencies."""
    above, below = figure.subplots(2, 1, sharex=True)
    evidence.storage(_title(above, title), found, traces)
    evidence.loss(_title(below, ""), found, traces)


def one(panel: Panel, found: Identification, traces: Traces, width: int, height: int) -> Figure:
    """A figure of one panel, so many pixels wide and high on a page."""
    with style.ink(_LETTERS):
        figure = _figure(width * _PIXEL, height * _PIXEL)
        panel(figure.subplots(), found, traces)
    return figure


def both_parts(found: Identification, traces: Traces, width: int, height: int) -> Figure:
    """Storage above loss, likewise."""
    with style.ink(_LETTERS):
        figure = _figure(width * _PIXEL, height * _PIXEL)
        dynamic(figure, found, traces)
    return figure


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=style.DPI, layout="constrained")


def _title(axis: Axes, text: str) -> Axes:
    if text:
        axis.set_title(text, loc="left", fontsize=11.5, fontweight="bold", pad=40)
    return axis
