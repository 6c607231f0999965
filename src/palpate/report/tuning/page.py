"""The page of a tuned force loop: proved surfaces and the estimate, the press at both ends, Nyquist's curve."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.force.describe import UNCOVERED
from palpate.force.steps import BAND, frequency_response
from palpate.force.tuning import RIGID, Tuning
from palpate.report import style
from palpate.report.figure_panels.panels import panels_of, shown_in
from palpate.report.page import Table, render
from palpate.report.tuning.table import rows
from palpate.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHOWN = (1.0, 1e7)
"""Stiffnesses that the figure shows [N/m]."""


def page(told: Tuning, command: str = "palpate tune") -> str:
    """The page as HTML; `command` is what made it."""
    return render(
        "page.html",
        title=f"A force loop for {told.gains.arm.title}",
        about="Gains, their predicted performance, and the surfaces of the stability proof.",
        notes=[text for _, text in told.warnings],
        tables=[
            Table("Notes", ("", ""), rows(told)),
            Table("Not covered by a proof", ("",), [(text,) for text in UNCOVERED]),
        ],
        **shown_in(
            [
                _figure("Proved stable surfaces, and the surface to press on", one(_intervals, told, 1.6)),
                _figure("The press at both ends, with known stiffness", one(steps, told, 2.6)),
                _figure("Nyquist's curve on the stiffest surface", one(_nyquist, told, 4.0)),
            ]
        ),
        source=told.gains.to_toml(),
        source_title="The gains",
        room="tune",
        command=printable(command),
    )


def one(drawn: Callable[[Axes, Tuning], None], told: Tuning, height: float) -> Figure:
    """A figure of one panel."""
    with style.inked():
        figure, (axis,) = style.figure(height=height)
        drawn(axis, told)
    return figure


def _figure(caption: str, drawing: Figure) -> dict[str, Any]:
    return {"panels": panels_of(drawing), "caption": caption}


def _intervals(axis: Axes, told: Tuning) -> None:
    spans = [("stable, exact", told.exact, style.LINE)]
    for kind, name in (("adapting", "proved, adapting"), ("held", "proved, gain held")):
        found = told.surface_stiffness(kind)
        if found is not None and kind == "adapting" and told.gains.arm.kind == "position":
            found = (_SHOWN[0], RIGID)
        if found is not None:
            spans.append((name, found, style.OK if kind == "held" else style.SERIES[0]))
    if told.known is not None:
        spans.append(("surface", told.known.stiffness, style.K))
    for i, (_, (low, high), colour) in enumerate(spans):
        ends = [max(low, _SHOWN[0]), min(max(high, 1.02 * low), _SHOWN[1])]
        axis.plot(ends, [i, i], color=colour, linewidth=9, solid_capstyle="butt")
    axis.set(xlim=_SHOWN, xlabel="stiffness of the surface [N/m]", ylim=(-0.6, len(spans) - 0.4))
    axis.set_yticks(range(len(spans)), [name for name, _, _ in spans])
    style.logarithmic(axis, "x")


def steps(axis: Axes, told: Tuning) -> None:
    """The force after the touch on the softest and on the stiffest surface."""
    for step, name, colour in zip(told.steps, ("softest", "stiffest"), style.SERIES[:2], strict=True):
        axis.plot(step.time, told.gains.force * step.force, color=colour, label=name)
    for edge in (1.0 - BAND, 1.0 + BAND):
        axis.axhline(edge * told.gains.force, color=style.MEASURED, linewidth=0.7, linestyle="--")
    longest = max(step.settling if isfinite(step.settling) else 0.0 for step in told.steps)
    axis.set(xlabel="time from the touch [s]", ylabel="force [N]", xlim=(0.0, max(2.5 * longest, 0.1)))
    style.legend(axis)


def _nyquist(axis: Axes, told: Tuning) -> None:
    _, L = frequency_response(told.gains, told.gains.seen_cap)
    shown = L[np.abs(L) < 4.0]
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axis.plot(np.cos(angle), np.sin(angle), color=style.LINE, linewidth=1.0)
    axis.plot(shown.real, shown.imag, color=style.SERIES[0])
    axis.plot([-1.0], [0.0], color=style.FAIL, marker="+", markersize=12, linestyle="")
    axis.set(xlabel="real part", ylabel="imaginary part", xlim=(-2.5, 1.5), ylim=(-2.0, 1.2), aspect="equal")
