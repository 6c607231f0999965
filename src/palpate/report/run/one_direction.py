"""The report of a press along one direction: the outcome, the force, and the law's estimate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.sequence import CONTACT
from palpate.files import write_text
from palpate.records import Record
from palpate.report import style
from palpate.report.numbers import NONE, quantity
from palpate.report.page import Table, page
from palpate.report.run.figures import around_contact
from palpate.report.run.table import notes
from palpate.report.run.words import sentence, settling

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BEFORE = 0.1
"""Seconds before the touch that are still shown."""


def write_one_direction(
    record: Record,
    folder: Path,
    summary: dict[str, Any],
    source: str,
    endings: tuple[str, ...],
    dpi: int | None,
) -> None:
    """Writes figures and report.html into a folder.

    Args:
        record: of the run.
        folder: that is there.
        summary: as `summary.json` has it.
        source: the experiment's file.
        endings: of the figures' files, each of `style.FORMATS`.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    experiment = record.meta["experiment"]
    figures = {}
    for name, draw, caption in DRAWN if summary["force"] is not None else ():
        with style.inked():
            drawing = draw(record)
            for ending in dict.fromkeys((*endings, ".png")):
                style.save(drawing, folder / f"{name}{ending}", dpi)
        figures[folder / f"{name}.png"] = caption
    text = page(
        title=experiment["title"],
        about=f"{sentence(summary)} {experiment['about']}",
        tables=one_direction_tables(record, summary),
        figures=figures,
        command=summary["command"],
        source=source,
        notes=notes(summary),
    )
    write_text(folder / "report.html", text)


def one_direction_tables(record: Record, summary: dict[str, Any]) -> list[Table]:
    """The force first, then the loop and the surface."""
    f = summary["force"]
    if f is None:
        return []
    over = NONE
    if f["overshoot_N"] is not None:
        first = float(record["force_desired"][record["phase"] == CONTACT][0])
        over = f"{f['overshoot_N']:.2f} N, {100.0 * f['overshoot_N'] / first:.1f} %"
    force = (
        ("touch at", f"{summary['contact_at_s']:.3f} s"),
        ("settling to 5 %", settling(f)),
        ("overshoot", over),
        ("error, last second", f"{f['error_N']:+.3f} ± {f['std_N']:.3f} N"),
        ("error since the touch, RMS", f"{f['rms_error_N']:.3f} N"),
        ("contact lost", f"{summary['contacts_lost']} times"),
    )
    return [Table("Force", ("", "value"), force), Table("Arm and surface", ("", "value"), _world(record))]


def _world(record: Record) -> tuple[tuple[str, str], ...]:
    loop, truth = record.meta["loop"], record.meta["truth"]
    return (
        ("arm", f"{loop['arm']} ({loop['kind']}s at {loop['rate_hz']:g} Hz)"),
        ("lag of the loop, as given to the law", f"{1e3 * loop['theta_s']:.3g} ms"),
        ("stiffest surface, as given to the law", quantity(loop["cap"], "N/m", digits=4)),
        ("approach", f"{1e3 * loop['approach_m_s']:.3g} mm/s"),
        ("stiffness of the surface", quantity(truth["K"]["value"], "N/m", digits=4)),
        ("its damping", quantity(truth["B"]["value"], "N s/m", digits=4)),
        ("K_u at the end", quantity(float(record["bound"][-1]), "N/m", digits=4)),
    )


def _force(record: Record) -> Figure:
    figure, (force, speed) = style.figure(2, height=2.3)
    since, shown = around_contact(record, BEFORE)
    style.panel(force, "force on the surface [N]")
    measured, true = record["force_measured"][shown], record["force"][shown]
    force.plot(since, measured, color=style.MEASURED, linewidth=0.8, label="reading")
    force.plot(since, true, color=style.F, linewidth=1.6, label="true")
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)[shown]
    force.plot(since, desired, **style.KNOWN, label="desired")
    style.legend(force)
    style.panel(speed, "commanded speed [mm/s]", "time since the touch [s]")
    speed.plot(since, 1e3 * record["speed"][shown], color=style.INK, linewidth=0.9)
    return figure


def _bound(record: Record) -> Figure:
    figure, (axis,) = style.figure(1, height=2.4)
    since, shown = around_contact(record, BEFORE)
    style.panel(axis, "stiffness [N/m]", "time since the touch [s]")
    axis.plot(since, record["bound"][shown], color=style.K, linewidth=1.6, label="K_u, the law's upper bound")
    axis.plot(
        since,
        _true_stiffness(record)[shown],
        **style.KNOWN,
        label="truth, with respect to the measured position",
    )
    axis.set_yscale("log")
    style.legend(axis)
    return figure


def _true_stiffness(record: Record) -> np.ndarray[Any, np.dtype[np.float64]]:
    """K as the measured position feels it at each row [N/m]."""
    surface, loop = record.meta["experiment"]["surface"], record.meta["loop"]
    since = record["t"] - record["t"][np.argmax(record["phase"] == CONTACT)]
    later = surface["later"] or surface["stiffness"]
    own = np.where(since < surface["changes"], surface["stiffness"], later)
    return own / (1.0 + own / loop["series"]) if loop["kind"] == "position" else own


DRAWN = (
    (
        "force",
        _force,
        "Force on the surface, and the commanded speed; times count from the touch.",
    ),
    (
        "bound",
        _bound,
        "The law's upper bound of the stiffness (not its estimate). It falls as the readings give more information.",
    ),
)
