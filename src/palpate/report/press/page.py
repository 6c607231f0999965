"""The report of a press: tables, a film, figures, one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.sequence import CONTACT
from palpate.files import write_text
from palpate.identification.result import Verdict
from palpate.press.summary import Asked
from palpate.records import Record
from palpate.report import style
from palpate.report.answer import Answer, Card, answer_page
from palpate.report.figure_panels.panels import panels_of
from palpate.report.identification.page import TONES
from palpate.report.identification.words import CALLED
from palpate.report.numbers import NONE, plain, quantity
from palpate.report.page import Table, embedded
from palpate.report.press.film import film
from palpate.report.run.cards import force_cards
from palpate.report.run.table import alert_line, surface_table
from palpate.report.run.words import alerts, settling
from palpate.report.run.words import sentence as outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def write_report(record: Record, asked: Asked, summary: dict[str, Any], folder: Path) -> None:
    """Writes figures, film.svg and report.html into a folder."""
    figures = []
    for name, draw in (("touch", _touch), ("force", _force), ("torque", _torque)):
        with style.inked():
            drawing, caption = draw(record, asked)
            style.save(drawing, folder / f"{name}.png")
            figures.append({"panels": panels_of(drawing), "caption": caption})
    write_text(folder / "film.svg", film(record, asked.arm, asked.place))
    captions = {
        "arm": "The arm, to scale, in real time.",
        "tip": "The tip, its motion enlarged; and the force.",
    }
    halves = [
        {
            "source": embedded(film(record, asked.arm, asked.place, half).encode(), "image/svg+xml"),
            "caption": told,
        }
        for half, told in captions.items()
    ]
    loop, parameters = summary["loop"], (summary["identified"] or {}).get("parameters", {})
    contact = summary["force"] is not None
    wanted = f" with {plain(summary['force']['desired_N'], 3)} N" if contact else ""
    answer = Answer(
        title=f"A press of {asked.arm.title}{wanted}",
        sentence=sentence(summary, parameters),
        about=f"{asked.arm.title}, {asked.gains.arm.kind}s at {loop['rate_hz']:g} Hz, {asked.controller} control, "
        f"{'MuJoCo' if asked.physics == 'mujoco' else 'own'} physics, simulated, seed {asked.seed}.",
        alerts=_alerts(summary),
        cards={
            "": force_cards(summary) if contact else [],
            "The surface, by palpate identify": _surface(parameters, summary["truth"]),
        },
        pairs=halves,
        figures=figures if contact else (),
        folds=[(table.title, "all numbers", table.rows) for table in tables(summary)],
    )
    write_text(folder / "report.html", answer_page(answer, room="press", command=summary["command"]))


def sentence(summary: dict[str, Any], parameters: dict[str, Any]) -> str:
    """How the force went, and the stiffness that was identified."""
    found = parameters.get("K")
    if found is None or found["value"] is None or not found["ci95"]:
        return outcome(summary)
    half = 0.5 * (found["ci95"][1] - found["ci95"][0])
    return f"{outcome(summary)} The stiffness of the surface is {quantity(found['value'], 'N/m', half)}."


def _surface(found: dict[str, Any], truth: dict[str, Any]) -> list[Card]:
    """A card a parameter: value, verdict, its limit, and the truth of the simulation."""
    cards = []
    for name in (name for name in ("K", "B", "M") if name in found):
        p, number, unit, half = found[name], "", "", ""
        known = f" Truth: {quantity(truth[name]['value'], p['unit'])}." if name in truth else ""
        if p["value"] is not None and p["ci95"]:
            text = quantity(p["value"], p["unit"], 0.5 * (p["ci95"][1] - p["ci95"][0]))
            number, _, rest = text.partition(" ± ")
            half, _, unit = rest.partition(" ")
        why, tone = f"{p['reason']}.{known}", TONES[Verdict(p["verdict"])]
        cards.append(Card(f"{name}, {CALLED[name]}", number, unit, half, why, tone, p["verdict"], name))
    return cards


def _alerts(summary: dict[str, Any]) -> list[dict[str, str]]:
    """Failures first, then the notes of the press."""
    shown = alerts(summary)
    told = {alert_line(alert) for alert in shown}
    others = [note for note in notes(summary) if note not in told]
    return [*shown, *({"tone": "warn", "title": "", "text": note, "advice": ""} for note in others)]


def notes(summary: dict[str, Any]) -> list[str]:
    """Warnings of the page."""
    found = [alert_line(alert) for alert in alerts(summary)]
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
    surface = surface_table("The surface, by palpate identify", found, summary["truth"])
    return [_force_table(summary), *([surface] if found else [])]


def _force_table(summary: dict[str, Any]) -> Table:
    f, loop = summary["force"], summary["loop"]
    return Table(
        "Force",
        ("", "value"),
        (
            ("contact at", f"{summary['contact_at_s']:.3f} s"),
            ("approach", f"{1e3 * loop['approach_speed_m_s']:.2f} mm/s"),
            ("desired at the end", f"{f['desired_N']:.2f} N"),
            ("error, last second", f"{f['error_N']:+.3f} N, standard deviation {f['std_N']:.3f} N"),
            ("settling to 5 %", settling(f)),
            ("overshoot", NONE if f["overshoot_N"] is None else f"{f['overshoot_N']:.2f} N"),
            ("noise of the measured force", f"{f['measured_std_N']:.3f} N"),
            ("tip slipped by", f"{summary['tip']['slipped_mm']:.3f} mm"),
        ),
    )


def _touch(record: Record, asked: Asked) -> tuple[Figure, str]:
    """The force about the touch."""
    drawing, (axis,) = style.figure(1, height=2.6)
    t, pressing = record["t"], record["phase"] == CONTACT
    touch = float(t[np.argmax(pressing)]) if pressing.any() else float(t[0])
    _forces(axis, record)
    axis.set(xlabel="time [s]", ylabel="force [N]", xlim=(max(touch - 0.1, t[0]), min(touch + 0.5, t[-1])))
    return drawing, "The force in the first half second after the touch."


def _forces(axis: Axes, record: Record) -> None:
    t = record["t"]
    axis.plot(t, record["force_sampled"], color=style.MEASURED, linewidth=0.7, label="reading")
    axis.plot(t, record["force"], color=style.F, linewidth=1.6, label="true")
    wanted = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)
    axis.plot(t, wanted, **style.KNOWN, label="desired")
    style.legend(axis)


def _force(record: Record, asked: Asked) -> tuple[Figure, str]:
    drawing, (force, depth) = style.figure(2, height=2.1)
    t = record["t"]
    _forces(force, record)
    force.set_ylabel("force [N]")
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
    """A panel a joint, in per cent of its motor's limit; in N m where nobody says how much that is."""
    n = asked.arm.joints
    drawing, axes = style.grid((9.0, 1.9 * -(-n // 3)), -(-n // 3), 3)
    limits = np.asarray(asked.arm.torque, dtype=float)
    known = bool(np.isfinite(limits).all())
    for i, (axis, name) in enumerate(zip(axes, asked.arm.names, strict=False)):
        scale = 100.0 / limits[i] if known else 1.0
        axis.plot(record["t"], scale * record[f"torque{i + 1}"], color=style.INK, linewidth=1.2)
        if known:
            axis.set_ylim(-110.0, 110.0)
            for end in (-100.0, 100.0):
                axis.axhline(end, color=style.MEASURED, linewidth=1.0, linestyle="--")
        axis.set_title(style.literal(name), loc="left")
        axis.set(ylabel="of the limit [%]" if known else "torque [N m]", xlabel="time [s]")
    for axis in axes[n:]:
        axis.remove()
    return drawing, "Torque of each joint, the arm's weight included."
