"""The figure of an identification: everything that tells how far to trust it, on one picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.identification.result import Verdict
from palpate.report import identification_fit as fit
from palpate.report import identification_trust as trust
from palpate.report import style
from palpate.report.identification_growth import growth
from palpate.report.identification_words import MARKS, headline, number, subtitle, unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from palpate.identification.result import Identification, Traces

_WIDE, _HIGH, _HEAD = 13.0, 11.6, 1.3
_LINE, _COLUMN, _APART = 118, 20, 3
"""Letters in a line of the head, at least in a parameter's column, and between two of them."""
_VERDICTS = {
    Verdict.IDENTIFIED: style.GREEN,
    Verdict.NOT_IDENTIFIABLE: style.ORANGE,
    Verdict.REJECTED: style.RED,
}


def write_figure(found: Identification, path: Path, title: str) -> Path:
    """Draw an identification and write it as a PNG, whole or not at all.

    Args:
        found: with its traces.
        path: of the PNG.
        title: what to call the log.
    """
    figure = draw(found, title)
    return style.save(figure, path)


def draw(found: Identification, title: str) -> Figure:
    """The figure of an identification; needs its traces."""
    traces = found.traces
    if traces is None:
        raise ValueError("an identification without traces has no figure")
    with style.inked():
        figure = _figure(_WIDE, _HIGH if len(traces.fitted_time) else _HIGH / 2)
        ratios = _HEAD, figure.get_figheight() - _HEAD
        parts: Any = figure.subfigures(2, 1, height_ratios=ratios)
        head, body = parts
        _head(head, found, title)
        if not len(traces.fitted_time):
            fit.force(_titled(body.subplots(), "Force over time"), found, traces)
        else:
            _panels(body, found, traces)
    return figure


def _head(figure: Any, found: Identification, title: str) -> None:
    """The log, the outcome, and each parameter with its verdict."""
    figure.text(0.01, 0.97, style.literal(title), fontsize=13, fontweight="bold", va="top")
    figure.text(0.01, 0.75, headline(found), fontsize=11, va="top")
    figure.text(0.01, 0.56, subtitle(found), fontsize=9, va="top")
    said = [
        f"{name}  {number(p)} {unit(p) if p.value is not None else ''}"
        for name, p in found.parameters.items()
    ]
    widths = [max(len(text), _COLUMN) + _APART for text in said]
    size = min(1.0, _LINE / sum(widths))
    left = 0.01
    for p, text, wide in zip(found.parameters.values(), said, widths, strict=True):
        figure.text(left, 0.35, text, fontsize=12 * size, va="top")
        verdict = f"{MARKS[p.verdict]} {p.verdict}"
        figure.text(left, 0.14, verdict, fontsize=9.5, va="top", color=_VERDICTS[p.verdict])
        left += wide * size / _LINE


def _panels(figure: Any, found: Identification, traces: Traces) -> None:
    top, middle, bottom = figure.subfigures(3, 1, height_ratios=(1.15, 1.0, 1.25))
    left, right = top.subplots(1, 2)
    fit.loop(_titled(left, "Force against penetration"), found, traces)
    fit.force(_titled(right, "Force over time"), found, traces)
    left, right = middle.subplots(1, 2)
    fit.residual(_titled(left, "What the model leaves"), found, traces)
    trust.residual_spectrum(_titled(right, "Is it noise?"), found, traces)
    left, right = bottom.subfigures(1, 2)
    settle(left, found, "How the estimates settled")
    excite(right, found, traces, "What was excited")


def settle(figure: Any, found: Identification, title: str = "") -> None:
    """How the estimates settled, one panel a parameter."""
    grown = growth(found)
    names = trust.settled(grown)
    if not names:
        trust.empty(figure.subplots(), "too few samples to watch the estimates settle")
        return
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for i, (name, axis) in enumerate(zip(names, axes, strict=True)):
        trust.settling(_titled(axis, title if i == 0 else ""), found, name, grown[name])
    style.legend(axes[0])
    axes[-1].set_xlabel("data up to [s]")


def excite(figure: Any, found: Identification, traces: Traces, title: str = "") -> None:
    """What was excited, and under it which term carries the force."""
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    trust.excitation(_titled(above, title), found, traces)
    trust.shares(_titled(below, ""), found, traces)
    above.set_xlabel("")


def one(
    panel: Callable[[Axes, Identification, Traces], None], found: Identification, traces: Traces
) -> Figure:
    """A figure of one panel."""
    with style.inked():
        figure = _figure(6.4, 3.5)
        panel(_titled(figure.subplots(), ""), found, traces)
    return figure


def several(draw_on: Callable[[Any], None]) -> Figure:
    """A figure of panels that somebody draws on it."""
    with style.inked():
        figure = _figure(6.4, 4.4)
        draw_on(figure)
    return figure


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=style.DPI, layout="constrained")


def _titled(axis: Axes, text: str) -> Axes:
    style.plain(axis)
    if text:
        axis.set_title(text, loc="left", fontsize=10.5, fontweight="bold")
    return axis
