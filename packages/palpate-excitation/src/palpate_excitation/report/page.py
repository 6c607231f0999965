"""The page of a designed excitation: whether it is enough, how well each surface will be known, and the force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.references import Multisine
from palpate.report import style
from palpate.report.identification.words import CALLED
from palpate.report.look.assets import CHARTS, TABLES, data, packed_column, rows_shown, scripts, text_of
from palpate.report.numbers import plain, quantity
from palpate.report.page import data_address, render
from palpate.report.style import svg
from palpate_excitation import Design, Remedy
from palpate_excitation.report.table import describe_remedy, describe_wave, half_widths_reached, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = {"K": style.K, "B": style.B, "M": style.M}

_DRAWN = 4.0  # s of the desired force; more would be a block of ink


def write_figure(found: Design, path: Path) -> Path:
    """Draw a design and write it as a PNG, atomically."""
    return style.save(draw(found), path)


def draw(found: Design) -> Figure:
    """The figure of a design."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 6.2), dpi=style.DPI, layout="constrained")
    axes = figure.subplot_mosaic("tt;sp", height_ratios=(1.0, 1.25))
    for axis in axes.values():
        style.plain(axis)
    _force(axes["t"], found)
    _spectrum(axes["s"], found)
    _precision(axes["p"], found)
    return figure


def _force(axis: Axes, found: Design) -> None:
    budget = found.problem.budget
    time, force = found.force()
    shown = time <= found.settle + _DRAWN if isinstance(found.wave, Multisine) else np.full(len(time), True)
    low = min(prediction.force[0] for prediction in found.predictions)
    high = max(prediction.force[1] for prediction in found.predictions)
    axis.axhspan(low, high, color=style.F, alpha=0.12, linewidth=0, label="force on the surfaces")
    axis.plot(time[shown], force[shown], color=style.INK, linewidth=0.8, label="desired force")
    for limit in (budget.mean - budget.swing, budget.mean + budget.swing):
        axis.axhline(limit, **style.KNOWN)
    rest = "" if shown.all() else f", the first {time[shown][-1]:g} of {time[-1]:g} s"
    axis.set(xlabel=f"time [s]{rest}", ylabel="force [N]", xlim=(0, time[shown][-1]))
    style.legend(axis)


def _spectrum(axis: Axes, found: Design) -> None:
    frequencies, amplitudes, forces = lines_of(found)
    axis.fill_between(
        frequencies, forces.min(axis=0), forces.max(axis=0), color=style.F, alpha=0.2, linewidth=0,
        label="on the surfaces",
    )  # fmt: skip
    if isinstance(found.wave, Multisine):
        axis.vlines(frequencies, 0, amplitudes, color=style.INK, linewidth=0.7)
        axis.plot(
            frequencies, amplitudes, color=style.INK, marker="o", markersize=3, linestyle="", label="desired"
        )
    else:
        axis.plot(frequencies, amplitudes, color=style.INK, linewidth=0.8, label="desired")
    style.logarithmic(axis, "x")
    axis.set(xlabel="frequency [Hz]", ylabel="amplitude [N]")
    axis.set_ylim(bottom=0)
    style.legend(axis)


def lines_of(found: Design) -> tuple[Array, Array, Array]:
    """Frequencies [Hz], amplitudes of the desired force [N], and those on each surface, shapes (n,), (n,), (s, n)."""
    wave = found.wave
    if isinstance(wave, Multisine):
        frequencies, amplitudes = np.array(wave.frequencies), np.array(wave.amplitudes)
    else:
        frequencies = np.geomspace(wave.low, wave.high, 100)
        amplitudes = np.full(len(frequencies), wave.amplitude)
    return frequencies, amplitudes, np.abs(found.problem.forces(2 * np.pi * frequencies, amplitudes))


def curves(found: Design) -> tuple[Array, dict[str, Array]]:
    """Durations [s], shape (n,), and each parameter's 95 % half-width as a share, on each surface, shape (s, n)."""
    seconds = np.geomspace(0.1 * found.seconds, 5 * found.seconds, 40)
    names = found.predictions[0].names
    return seconds, {
        name: np.array([[one.half_widths(t)[name] for t in seconds] for one in found.predictions])
        for name in names
    }


def _precision(axis: Axes, found: Design) -> None:
    seconds, known = curves(found)
    for name, widths in known.items():
        axis.fill_between(
            seconds, 100 * widths.min(axis=0), 100 * widths.max(axis=0), color=COLORS[name], alpha=0.25,
            linewidth=0,
        )  # fmt: skip
        axis.plot(seconds, 100 * widths.max(axis=0), color=COLORS[name], linewidth=1.6, label=name)
        if name in found.problem.precision:
            asked = 100 * found.problem.precision[name]
            axis.plot(seconds[[0, -1]], [asked, asked], color=COLORS[name], linewidth=0.9, linestyle="--")
    axis.axvline(found.seconds, color=style.MEASURED, linewidth=0.9)
    for which in "xy":
        style.logarithmic(axis, which)
    axis.set(xlabel="duration [s]", ylabel="95 % half-width [%]")
    style.legend(axis, title="worst surface; dashed: requested", title_fontsize=8.5)


_PACKAGE = "palpate_excitation.report"
_ROWS = 6000
"""Of the desired force that lie in the page, its peaks among them."""
_SHOWN = 4.0
"""Of it that is seen at first, after it has settled [s]."""
_UNITS = {"K": "N/m", "B": "N s/m", "M": "kg"}


def page(found: Design, helps: Sequence[Remedy], command: str) -> str:
    """The page as HTML."""
    told = describe_wave(found)
    codes = (*scripts(*CHARTS, *TABLES), text_of("excitation.js", _PACKAGE))
    with style.ink():
        still = data_address(svg(draw(found)), "image/svg+xml")
    return render(
        "excitation.html",
        _PACKAGE,
        room="excite",
        title="A desired force",
        sentence=_sentence(found),
        about=f"{told[0].upper()}{told[1:]}.",
        feasible=found.feasible,
        cards=_cards(found),
        remedies=[(one.change, describe_remedy(one, found), one.enough) for one in helps],
        head=_head(found),
        rows=_rows(found),
        charts=data(_charts(found)),
        still=still,
        scripts=codes,
        command=command,
    )


def _sentence(found: Design) -> str:
    asked = ", ".join(f"{name} {percent(share)}" for name, share in found.problem.precision.items())
    lasts = quantity(found.seconds, "s", digits=3)
    if found.feasible:
        says = f"In {lasts} this force identifies every surface of the range to the requested precision"
        return f"{says}: {asked} (95 %)."
    worst = half_widths_reached(found.made.worst(found.seconds), found)
    limits = "No force within these limits identifies every surface to the requested precision"
    return f"{limits}, {asked} (95 %): at best {worst}."


def _cards(found: Design) -> list[dict[str, str]]:
    """Each parameter on the surface that shows it worst, then how long and how hard."""
    worst = found.made.worst(found.seconds)
    cards = []
    for name in found.predictions[0].names:
        asked = found.problem.precision.get(name)
        enough = asked is None or worst[name] <= asked
        cards.append(
            {
                "name": name,
                "called": CALLED[name],
                "colour": name,
                "number": f"± {percent(worst[name])}",
                "tone": "none" if asked is None else "ok" if enough else "fail",
                "verdict": "not asked for" if asked is None else "enough" if enough else "not enough",
                "why": "95 % half-width on the worst surface"
                + ("" if asked is None else f"; asked: {percent(asked)}"),
            }
        )
    _, force = found.force()
    low = min(one.force[0] for one in found.predictions)
    high = max(one.force[1] for one in found.predictions)
    settles = f" after {quantity(found.settle, 's', digits=2)} of settling" if found.settle else ""
    cards.append(
        {"name": "Duration", "number": quantity(found.seconds, "s", digits=3), "why": f"of pressing{settles}"}
    )
    cards.append(
        {
            "name": "Force",
            "number": f"{plain(low, 3)} to {plain(high, 3)} N",
            "why": f"on the surfaces; asked of the robot: {plain(force.min(), 3)} to {plain(force.max(), 3)} N",
        }
    )
    return cards


def _head(found: Design) -> list[str]:
    names = found.predictions[0].names
    return [
        *(f"{name} [{_UNITS[name]}]" for name in names),
        *(f"{name}, 95 %" for name in names),
        "force [N]",
        "travel [µm]",
    ]


def _rows(found: Design) -> list[list[dict[str, Any]]]:
    """Each surface: its parameters, their predicted uncertainty, and its force."""
    rows = []
    for one in found.predictions:
        widths = one.half_widths(found.seconds)
        values = dict(zip(("K", "B", "M"), one.surface.values, strict=True))
        row = [{"text": plain(values[name], 4), "value": values[name]} for name in one.names]
        for name in one.names:
            asked = found.problem.precision.get(name)
            bad = asked is not None and widths[name] > asked
            row.append({"text": f"± {percent(widths[name])}", "value": widths[name], "bad": bad})
        low, high = one.force
        row += [
            {"text": f"{low:.1f} to {high:.1f}", "value": high},
            {"text": f"{1e6 * one.travel:.0f}", "value": one.travel},
        ]
        rows.append(row)
    return rows


def _charts(found: Design) -> dict[str, Any]:
    """Data of the charts, in plain values."""
    time, force = found.force()
    rows = rows_shown(force, _ROWS)
    budget = found.problem.budget
    n = len(rows)
    over = {
        "t": time[rows],
        "desired": force[rows],
        "low": np.full(n, min(one.force[0] for one in found.predictions)),
        "high": np.full(n, max(one.force[1] for one in found.predictions)),
        "least": np.full(n, budget.mean - budget.swing),
        "most": np.full(n, budget.mean + budget.swing),
    }
    frequencies, amplitudes, felt = lines_of(found)
    seconds, widths = curves(found)
    precision: dict[str, Array] = {"t": seconds}
    for name, share in widths.items():
        precision |= {f"{name}_low": 100 * share.min(axis=0), f"{name}_high": 100 * share.max(axis=0)}
        asked = found.problem.precision.get(name)
        if asked is not None:
            precision[f"{name}_asked"] = np.full(len(seconds), 100 * asked)
    return {
        "force": {name: packed_column(values) for name, values in over.items()},
        "spectrum": {
            "t": frequencies.tolist(),
            "desired": amplitudes.tolist(),
            "low": felt.min(axis=0).tolist(),
            "high": felt.max(axis=0).tolist(),
        },
        "precision": {name: values.tolist() for name, values in precision.items()},
        "names": list(widths),
        "window": [0.0, min(float(time[-1]), found.settle + _SHOWN)],
        "seconds": found.seconds,
    }
