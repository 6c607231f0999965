"""The figures of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import CONTACT, LOST
from palpate.files import write_text
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import KNOWN, Chart, Series, figure_of, page_figures, panels
from palpate.report.numbers import NONE, quantity
from palpate.report.page import Table, render
from palpate.report.run.table import notes, sentence, settling

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEFORE = 1.0
"""Seconds before contact that are still shown."""
SINCE = "time since the switch to force control [s]"
FRONT_ENDS = {
    "thesis": ("filtered as in the thesis", (0, (5, 2))),
    "raw": ("raw signals", "-"),
}
"""Beside the estimate from matched channels, which has its quantity's colour: what the thesis feeds it, in grey."""


@dataclass(frozen=True)
class Drawing:
    """A figure, not yet drawn.

    Args:
        name: of its file.
        caption: of the figure.
        draw: makes it.
    """

    name: str
    caption: str
    draw: Callable[[Record], Figure]


def drawings(record: Record) -> Iterator[Drawing]:
    """All figures that a run has, in the order to be read."""
    yield Drawing(
        "approach",
        "The whole run. The desired position moves in steps until contact; friction delays the tip. Shaded: force "
        "control, and loss of contact.",
        _approach,
    )
    if (record["phase"] == CONTACT).any():
        yield Drawing(
            "force",
            "Contact force. The true force acts on the simulated surface; the controller receives the measured one.",
            _force,
        )
        yield Drawing(
            "identification",
            "Recursive least squares with three kinds of signals. Shaded: 95 % interval of the matched one. The "
            "initial transient of the estimates is cut off.",
            _identification,
        )
    yield Drawing("torque", "Applied torque. Dashed: the limit, if the torque comes near it.", _torque)


def draw(
    record: Record, folder: Path, endings: Sequence[str] = (".png",), dpi: int | None = None
) -> dict[str, str]:
    """Draws all figures of a run into a folder: file name and caption of each, in the order to be read.

    Args:
        record: of the run.
        folder: that is there.
        endings: of the files, each of `style.FORMATS`.
        dpi: of a PNG; `style.DPI` if none is given.
    """
    captions = {}
    for one in drawings(record):
        with style.ink():
            figure = one.draw(record)
            for ending in endings:
                style.save(figure, folder / f"{one.name}{ending}", dpi)
                captions[f"{one.name}{ending}"] = one.caption
    return captions


def _approach(record: Record) -> Figure:
    figure, (position, force) = style.figure(2, height=2.1)
    t, wall = record["t"], record.meta["experiment"]["wall"]["x"]
    for axis in (position, force):
        _shade(axis, record)
    style.panel(position, "x [mm]")
    position.axhline(1e3 * wall, color=style.QUIET, linewidth=1, linestyle=":", label="surface at rest")
    position.plot(t, 1e3 * record["x_desired"], **style.KNOWN, label="desired")
    position.plot(t, 1e3 * record["x"], color=style.F, linewidth=1.6, label="tip")
    style.legend(position)
    style.panel(force, "force [N]", "time [s]")
    force.plot(t, record["force_measured"], color=style.MEASURED, linewidth=0.8, label="measured")
    force.plot(t, record["force_desired"], **style.KNOWN, label="desired")
    style.legend(force)
    return figure


def _force(record: Record) -> Figure:
    figure, (axis,) = style.figure(1, height=3.4)
    since, shown = around_contact(record)
    style.panel(axis, "force on the surface [N]", SINCE)
    axis.plot(
        since,
        record["force_measured"][shown],
        color=style.MEASURED,
        linewidth=0.8,
        label="measured, filtered",
    )
    axis.plot(since, record["force"][shown], color=style.F, linewidth=1.6, label="true")
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)[shown]
    axis.plot(since, desired, **style.KNOWN, label="desired")
    switch = record.meta["experiment"]["approach"]["switch"]
    axis.axhline(switch, color=style.QUIET, linewidth=0.8, linestyle=":", label=f"switch, {switch:g} N")
    for i in (1, 2, 3):
        _mark(axis, since, record[f"saturated{i}"][shown], f"motor {i} at its limit")
    style.legend(axis)
    return figure


def _identification(record: Record) -> Figure:
    figure, axes = style.figure(3, height=2.0)
    since, shown = around_contact(record, 0.0)  # before it there is nothing to be known
    truth: dict[str, Any] = record.meta["truth"]
    units = (("K", "N/m"), ("B", "N s/m"), ("M", "kg"))
    for axis, (name, unit) in zip(axes, units, strict=True):
        style.panel(axis, f"{name} [{unit}]", SINCE if axis is axes[-1] else "")
        for front, (label, dashes) in FRONT_ENDS.items():
            estimate = record[f"{name}_{front}"][shown]
            axis.plot(since, estimate, color=style.MEASURED, linestyle=dashes, linewidth=1.1, label=label)
        colour = getattr(style, name)
        value, std = record[f"{name}_matched"][shown], record[f"{name}_matched_std"][shown]
        ends = value - 1.96 * std, value + 1.96 * std
        axis.fill_between(since, *ends, color=colour, alpha=0.22, linewidth=0)
        axis.plot(since, value, color=colour, linewidth=1.6, label=f"{name}, channels matched in lag")
        if name in truth:
            axis.axhline(truth[name]["value"], **style.KNOWN, label="truth")
        _limits(axis, record, name, shown)
        style.legend(axis)
    return figure


def _limits(axis: Axes, record: Record, name: str, shown: Mask) -> None:
    """Shows where the estimates come to rest, and the truth, not where they come from."""
    half = np.nonzero(shown)[0][-max(1, int(0.75 * shown.sum())) :]
    seen = [record[f"{name}_{front}"][half] for front in (*FRONT_ENDS, "matched")]
    if name in record.meta["truth"]:
        seen.append(np.array([record.meta["truth"][name]["value"]]))
    low = min(float(np.quantile(s, 0.02)) for s in seen)
    high = max(float(np.quantile(s, 0.98)) for s in seen)
    margin = 0.25 * max(high - low, 1e-9)
    axis.set_ylim(low - margin, high + margin)


def _torque(record: Record) -> Figure:
    figure, axes = style.figure(3, height=1.5)
    t, limits = record["t"], record.meta["experiment"]["robot"]["torque_limits"]
    for i, (axis, limit) in enumerate(zip(axes, limits, strict=True), start=1):
        style.panel(axis, f"motor {i} [N m]", "time [s]" if axis is axes[-1] else "")
        _shade(axis, record)
        torque = record[f"torque{i}"]
        axis.plot(t, torque, color=style.INK, linewidth=0.8)
        _mark(axis, t, record[f"saturated{i}"], "at the limit")
        if len(t) and np.max(np.abs(torque)) > 0.7 * limit:
            for sign in (-1, 1):
                axis.axhline(sign * limit, color=style.FAIL, linewidth=0.8, linestyle="--")
    return figure


def around_contact(record: Record, before: float = BEFORE) -> tuple[Array, Mask]:
    """Time since contact [s] where it is shown, and which rows those are."""
    t = record["t"]
    start = t[np.argmax(record["phase"] == CONTACT)]
    shown = t >= start - before
    return (t - start)[shown], shown


def _shade(axis: Axes, record: Record) -> None:
    """Where force is controlled, and where contact is lost."""
    across = axis.get_xaxis_transform()
    for phase, colour in ((CONTACT, style.F), (LOST, style.FAIL)):
        inside = record["phase"] == phase
        ends = {"where": inside, "transform": across, "linewidth": 0, "zorder": 0}
        axis.fill_between(record["t"], 0, 1, color=colour, alpha=0.09, **ends)


def _mark(axis: Axes, t: Array, flags: Array, label: str) -> None:
    """Ticks at the lower edge where a flag is up."""
    up = flags > 0.0
    if up.any():
        low = np.full(up.sum(), 0.02)
        axis.plot(t[up], low, "|", color=style.FAIL, transform=axis.get_xaxis_transform(), label=label)


BEFORE_CONTACT = 0.1
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
    figures = []
    for name, (charts, caption) in (
        one_direction_charts(record).items() if summary["force"] is not None else ()
    ):
        drawing = figure_of(charts)
        for ending in dict.fromkeys((*endings, ".png")):
            style.save(drawing, folder / f"{name}{ending}", dpi)
        figures.append({"panels": panels(charts), "caption": caption})
    text = render(
        "page.html",
        title=experiment["title"],
        about=f"{sentence(summary)} {experiment['about']}",
        tables=one_direction_tables(record, summary),
        command=summary["command"],
        source=source,
        notes=notes(summary),
        **page_figures(figures),
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


def one_direction_charts(record: Record) -> dict[str, tuple[list[Chart], str]]:
    """Charts of a run in one direction and their caption, by the name of their figure."""
    since, shown = around_contact(record, BEFORE_CONTACT)
    below = "time since the touch [s]"
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)[shown]
    forces = [
        Series(since, record["force_measured"][shown], "measured", "reading", 0.8),
        Series(since, record["force"][shown], "F", "true"),
        Series(since, desired, label="desired", **KNOWN),
    ]
    speed = Series(since, 1e3 * record["speed"][shown], "ink", width=0.9)
    true = Series(
        since, _true_stiffness(record)[shown], label="truth, with respect to the measured position", **KNOWN
    )
    bound = Series(since, record["bound"][shown], "K", "K_u, the law's upper bound")
    return {
        "force": (
            [
                Chart("force on the surface [N]", forces, height=2.3),
                Chart("commanded speed [mm/s]", [speed], x=below, height=2.3),
            ],
            "Force on the surface, and the commanded speed; times count from the touch.",
        ),
        "bound": (
            [Chart("stiffness [N/m]", [bound, true], x=below, log="y", height=2.4)],
            "The law's upper bound of the stiffness (not its estimate). It falls as the readings tell more.",
        ),
    }


def _true_stiffness(record: Record) -> np.ndarray[Any, np.dtype[np.float64]]:
    """K as the measured position feels it at each row [N/m]."""
    surface, loop = record.meta["experiment"]["surface"], record.meta["loop"]
    since = record["t"] - record["t"][np.argmax(record["phase"] == CONTACT)]
    later = surface["later"] or surface["stiffness"]
    own = np.where(since < surface["changes"], surface["stiffness"], later)
    return own / (1.0 + own / loop["series"]) if loop["kind"] == "position" else own
