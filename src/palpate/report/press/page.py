"""The report of a press: tables, a film, figures, one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.sequence import CONTACT
from palpate.files import write_text
from palpate.press.summary import Asked
from palpate.records import Record
from palpate.report import style
from palpate.report.figure_panels.panels import panels_of, shown_in
from palpate.report.numbers import NONE, plain, with_half
from palpate.report.page import Table, embedded, render
from palpate.report.press.film import film

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_report(record: Record, asked: Asked, summary: dict[str, Any], folder: Path) -> None:
    """Writes figures, film.svg and report.html into a folder."""
    figures = []
    for name, draw in (("force", _force), ("torque", _torque), ("arm", _arm)):
        with style.inked():
            drawing, caption = draw(record, asked)
            style.save(drawing, folder / f"{name}.png")
            figures.append({"panels": panels_of(drawing), "caption": caption})
    moving = film(record, asked.arm, asked.place)
    write_text(folder / "film.svg", moving)
    first = {
        "source": embedded(moving.encode(), "image/svg+xml"),
        "caption": "The press in real time, from shortly before the touch. The tip's motion is enlarged; the arm is to "
        "scale.",
    }
    loop = summary["loop"]
    about = (
        f"{asked.arm.title}, {asked.gains.arm.kind}s at {loop['rate_hz']:g} Hz, {asked.controller} control, "
        f"{'MuJoCo' if asked.physics == 'mujoco' else 'own'} physics, seed {asked.seed}."
    )
    page = render(
        "page.html",
        title="A press in simulation",
        about=about,
        notes=notes(summary),
        tables=tables(summary),
        **shown_in([first, *figures]),
        source="",
        room="press",
        command=summary["command"],
    )
    write_text(folder / "report.html", page)


def notes(summary: dict[str, Any]) -> list[str]:
    """Warnings of the page."""
    end = summary["end"]
    found = [] if end == "done" else [f"{end}: {summary['why']}."]
    if summary["contacts_lost"]:
        found.append(f"Contact was lost {summary['contacts_lost']} times.")
    joint, share = max(summary["saturated"].items(), key=lambda item: item[1])
    if share > 0.01:
        found.append(f"The motor of {joint} was at its limit in {100 * share:.1f} % of the ticks.")
    if summary["sensor_saturated"]:
        share = f"{100 * summary['sensor_saturated']:.2g} % of the ticks"
        found.append(f"The force sensor was saturated in {share}: its reading is not the force.")
    identified = summary["identified"] or {}
    found += [note["text"][0].upper() + note["text"][1:] + "." for note in _of_tool(identified)]
    if identified.get("why_not"):
        found.append(f"Nothing was identified: {identified['why_not']}.")
    return [*found, *(f"{note[0].upper()}{note[1:]}." for note in summary["notes"])]


def _of_tool(identified: dict[str, Any]) -> list[dict[str, Any]]:
    """Warnings that a tool's inertia is the cause of."""
    return [note for note in identified.get("warnings", ()) if note["code"] == "tool-inertia"]


def tables(summary: dict[str, Any]) -> list[Table]:
    """Force first, then what was identified."""
    if summary["force"] is None:
        return []
    found = (summary["identified"] or {}).get("parameters", {})
    return [_force_table(summary), *([_identified_table(found, summary["truth"])] if found else [])]


def _force_table(summary: dict[str, Any]) -> Table:
    f, loop = summary["force"], summary["loop"]
    settling = "not within the press" if f["settling_s"] is None else f"{f['settling_s']:.3f} s"
    return Table(
        "Force",
        ("", "value"),
        (
            ("contact at", f"{summary['contact_at_s']:.3f} s"),
            ("approach", f"{1e3 * loop['approach_speed_m_s']:.2f} mm/s"),
            ("desired at the end", f"{f['desired_N']:.2f} N"),
            ("error, last second", f"{f['error_N']:+.3f} N, standard deviation {f['std_N']:.3f} N"),
            ("settling to 5 %", settling),
            ("overshoot", NONE if f["overshoot_N"] is None else f"{f['overshoot_N']:.2f} N"),
            ("noise of the measured force", f"{f['measured_std_N']:.3f} N"),
            ("tip slipped by", f"{summary['tip']['slipped_mm']:.3f} mm"),
        ),
    )


def _identified_table(found: dict[str, Any], truth: dict[str, Any]) -> Table:
    rows = []
    for name in ("K", "B", "M"):
        p = found.get(name)
        if p is None:
            continue
        ends = p["ci95"]
        value = NONE if p["value"] is None or not ends else with_half(p["value"], 0.5 * (ends[1] - ends[0]))
        true = plain(truth[name]["value"]) if name in truth else NONE
        rows.append((f"{name} [{p['unit']}]", value, p["verdict"], true, p["reason"]))
    return Table("The surface, as palpate identify finds it", ("", "95 %", "verdict", "truth", "why"), rows)


def _arm(record: Record, asked: Asked) -> tuple[Figure, str]:
    """The arm from two sides at the end."""
    joints = [record[f"q{i}"] for i in range(1, asked.arm.joints + 1)]
    bones = asked.arm.joint_places([column[-1] for column in joints])
    drawing, axes = style.grid((9.0, 4.2), 1, 2)
    centre = asked.place.pose[:3, 3]
    for axis, (i, j), names in zip(axes, ((0, 2), (1, 2)), ("xz", "yz"), strict=True):
        along = np.array([-0.15, 0.15])
        flat = asked.place.axes[1:][:, [i, j]]
        for direction in flat:
            ends = centre[[i, j]] + along[:, None] * direction
            axis.plot(ends[:, 0], ends[:, 1], color=style.MEASURED, linewidth=2)
        axis.plot(bones[:, i], bones[:, j], "-o", color=style.INK, linewidth=4, markersize=6)
        axis.plot(bones[-1, i], bones[-1, j], "o", color=style.F)
        axis.set(xlabel=f"{names[0]} [m]", ylabel=f"{names[1]} [m]", aspect="equal")
    caption = "The arm at the end of the press from two sides: joints, tip, and the surface around it."
    return drawing, caption


def _force(record: Record, asked: Asked) -> tuple[Figure, str]:
    drawing, (force, depth) = style.figure(2, height=2.1)
    t, pressing = record["t"], record["phase"] == CONTACT
    force.plot(t, record["force_sampled"], color=style.MEASURED, linewidth=0.7, label="reading")
    force.plot(t, record["force"], color=style.F, linewidth=1.4, label="true")
    wanted = np.where(pressing, record["force_desired"], np.nan)
    force.plot(t, wanted, **style.KNOWN, label="desired")
    force.set_ylabel("force [N]")
    style.legend(force)
    depth.plot(t, 1e3 * record["penetration"], color=style.F, linewidth=1.4, label="true")
    seen = record["x_measured"] - asked.place.place
    depth.plot(t, 1e3 * seen, color=style.MEASURED, linewidth=1.0, label="by the encoders")
    depth.axhline(0.0, color=style.QUIET, linewidth=0.8)
    depth.set(xlabel="time [s]", ylabel="depth [mm]")
    style.legend(depth)
    caption = (
        "Force and depth of the tip. Encoders in front of elastic joints measure the joints' deflection besides the "
        "surface's."
    )
    return drawing, caption


def _torque(record: Record, asked: Asked) -> tuple[Figure, str]:
    drawing, (axis,) = style.figure(1, height=2.8)
    for i, name in enumerate(asked.arm.names, start=1):
        axis.plot(record["t"], record[f"torque{i}"], linewidth=1.0, label=style.literal(name))
    axis.set(xlabel="time [s]", ylabel="torque [N m]")
    style.legend(axis, ncols=4)
    return drawing, "Torque on each link, its weight included."
