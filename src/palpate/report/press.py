"""The report of a press: tables, a film, figures, one page."""

from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array, Indices
from palpate.bench.summary import CONTACT
from palpate.files import write_text
from palpate.identification.uncertainty import Verdict
from palpate.press.pressing import Asked
from palpate.press.setting import Place
from palpate.records import Record
from palpate.report import page, style
from palpate.report.chart import KNOWN, Band, Chart, Series, figure_of, panels
from palpate.report.film import animation, coordinates, film_of, frames_of, text, trace_panel, view_of
from palpate.report.identification.page import TONES
from palpate.report.identification.words import CALLED
from palpate.report.run.table import alert_line, alerts, force_cards, settling, surface_table
from palpate.report.run.table import sentence as outcome
from palpate.robots.serial.serial_arm import SerialArm
from palpate.units import NONE, plain, quantity

_BEFORE = 0.4
"""Seconds of the approach that are shown."""
_WIDE, _HIGH = 900.0, 420.0
_ARM = (20.0, 20.0, 420.0, 372.0)
"""Left, top, width and height of the arm's panel; then of the tip's, and of the force's."""
_TIP = (480.0, 30.0, 400.0, 170.0)
_FORCE = (480.0, 250.0, 400.0, 130.0)


_MARKER = (
    '<marker id="joint" markerWidth="3" markerHeight="3" refX="1.5" refY="1.5">'
    '<circle class="joint" cx="1.5" cy="1.5" r="0.55" stroke-width="0.22"/></marker>'
)


def film(record: Record, arm: SerialArm, place: Place, half: str = "") -> str:
    """The film of a press.

    Args:
        record: of the press.
        arm: what moved.
        place: where.
        half: `arm` or `tip` for that half alone, which is legible on a telephone; both if empty.
    """
    rows = frames_of(record, _BEFORE)
    seconds = float(record["t"][rows[-1]] - record["t"][rows[0]])
    q = np.column_stack([record[f"q{i}"] for i in range(1, arm.joints + 1)])[rows]
    left, width = {"": (0.0, _WIDE), "arm": (0.0, _TIP[0] - 20.0), "tip": (_TIP[0] - 20.0, _TIP[2] + 40.0)}[
        half
    ]
    parts = _arm_panel(arm, place, q, seconds) if half != "tip" else []
    if half != "arm":
        t, force, wanted = (record[name][rows] for name in ("t", "force", "force_desired"))
        words = f"force and desired force, up to {float(force.max()):.3g} N in {seconds:.3g} s"
        parts += [*_tip_panel(record, rows, seconds), *trace_panel(t, force, wanted, _FORCE, words)]
    return film_of(parts, left, width, _HIGH)


def _arm_panel(arm: SerialArm, place: Place, q: Array, seconds: float) -> list[str]:
    bones = [arm.joint_places(one) for one in q]
    patch = _patch(place, 0.16)
    ground = np.column_stack([bones[0][:, :2], 0.0 * bones[0][:, 2]])
    shown = np.vstack([bones[0], bones[-1], patch, ground])
    reach = shown.mean(axis=0)  # seen from the side of where the arm reaches, a little from above
    view = view_of(shown, _ARM, float(np.arctan2(reach[1], reach[0])) - np.radians(60.0), np.radians(18.0))
    seen = [view(b) for b in bones]
    moving = animation("points", [coordinates(s) for s in seen], seconds)
    return [
        f'<polygon class="surface" points="{coordinates(view(patch))}" fill-opacity="0.55"/>',
        f'<polyline class="shadow" points="{coordinates(view(ground))}"/>',
        _MARKER,
        '<polyline class="arm" marker-start="url(#joint)" marker-mid="url(#joint)" ',
        f'points="{coordinates(seen[0])}">{moving}</polyline>',
        text(_ARM[0], _HIGH - 8, "the arm, to scale"),
    ]


def _tip_panel(record: Record, rows: Indices, seconds: float) -> list[str]:
    """The tip along the normal, drawn so large that its way is seen."""
    left, top, width, height = _TIP
    depth = record["penetration"][rows]
    most = float(np.max(np.abs(depth))) or 1e-3
    middle, y0, scale = left + 0.5 * width, top + 0.45 * height, 0.4 * height / most
    places = y0 + scale * depth
    dents = [_dent(left, width, y0, max(float(p) - y0, 0.0), top + height) for p in places]
    probes = [
        f"{middle - 26:.1f},{p - 60:.1f} {middle:.1f},{p:.1f} {middle + 26:.1f},{p - 60:.1f}" for p in places
    ]
    return [
        f'<polygon class="surface" points="{dents[0]}">{animation("points", dents, seconds)}</polygon>',
        f'<polygon class="probe" points="{probes[0]}">{animation("points", probes, seconds)}</polygon>',
        text(left, top + height + 18, f"the tip; its deepest is {1e3 * float(depth.max()):.3g} mm"),
    ]


def _dent(left: float, width: float, y0: float, deep: float, bottom: float) -> str:
    x = np.linspace(-1.0, 1.0, 17)
    y = y0 + deep * np.maximum(1.0 - np.abs(x) / 0.6, 0.0) ** 1.5
    over = np.column_stack([left + 0.5 * width * (1.0 + x), y])
    return coordinates(np.vstack([over, [[left + width, bottom], [left, bottom]]]))


def _patch(place: Place, half: float) -> Array:
    """Four corners of the surface around the tip."""
    centre = place.pose[:3, 3] + (place.place - place.normal @ place.pose[:3, 3]) * place.normal
    u, v = half * place.axes[1], half * place.axes[2]
    return np.array([centre + u + v, centre + u - v, centre - u - v, centre - u + v])


def write_report(record: Record, asked: Asked, summary: dict[str, Any], folder: Path) -> None:
    """Writes figures, film.svg and report.html into a folder."""
    figures = []
    for name, (charts, caption) in charts_of(record, asked).items():
        style.save(figure_of(charts, 3 if name == "torque" else 1), folder / f"{name}.png")
        figures.append({"panels": panels(charts), "caption": caption})
    write_text(folder / "film.svg", film(record, asked.arm, asked.place))
    captions = {
        "arm": "The arm, to scale, in real time.",
        "tip": "The tip, its motion enlarged; and the force.",
    }
    halves = [
        {
            "source": page.data_address(film(record, asked.arm, asked.place, half).encode(), "image/svg+xml"),
            "caption": told,
        }
        for half, told in captions.items()
    ]
    loop, parameters = summary["loop"], (summary["identified"] or {}).get("parameters", {})
    contact = summary["force"] is not None
    wanted = f" with {plain(summary['force']['desired_N'], 3)} N" if contact else ""
    answer = page.PageAnswer(
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
    write_text(folder / "report.html", page.answer_page(answer, room="press", command=summary["command"]))


def sentence(summary: dict[str, Any], parameters: dict[str, Any]) -> str:
    """How the force went, and the stiffness that was identified."""
    found = parameters.get("K")
    if found is None or found["value"] is None or not found["ci95"]:
        return outcome(summary)
    half = 0.5 * (found["ci95"][1] - found["ci95"][0])
    return f"{outcome(summary)} The stiffness of the surface is {quantity(found['value'], 'N/m', half)}."


def _surface(found: dict[str, Any], truth: dict[str, Any]) -> list[page.Card]:
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
        cards.append(page.Card(f"{name}, {CALLED[name]}", number, unit, half, why, tone, p["verdict"], name))
    return cards


def _alerts(summary: dict[str, Any]) -> list[dict[str, str]]:
    """Failures first, then the notes of the press."""
    shown = alerts(summary)
    told = {alert_line(alert) for alert in shown}
    return [*shown, *page.warning_alerts(note for note in notes(summary) if note not in told)]


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


def tables(summary: dict[str, Any]) -> list[page.Table]:
    """Force first, then what was identified."""
    if summary["force"] is None:
        return []
    found = (summary["identified"] or {}).get("parameters", {})
    surface = surface_table("The surface, by palpate identify", found, summary["truth"])
    return [_force_table(summary), *([surface] if found else [])]


def answer_of(title: str, summary: dict[str, Any]) -> page.CommandAnswer:
    """The answer of a press by the arm of this title."""
    found = (summary["identified"] or {}).get("parameters", {})
    head = f", seed {summary['seed']}, {summary['duration_s']:.1f} s simulated"
    said = f"{head}\n{sentence(summary, found)}"
    return page.CommandAnswer(summary, title, said, tables(summary), notes(summary))


def _force_table(summary: dict[str, Any]) -> page.Table:
    f, loop = summary["force"], summary["loop"]
    return page.Table(
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


def charts_of(record: Record, asked: Asked) -> dict[str, tuple[list[Chart], str]]:
    """Charts of a press and their caption, by the name of their figure."""
    t, pressing = record["t"], record["phase"] == CONTACT
    touch = float(t[np.argmax(pressing)]) if pressing.any() else float(t[0])
    forces = [
        Series(t, record["force_sampled"], "measured", "reading", 0.7),
        Series(t, record["force"], "F", "true"),
        Series(t, np.where(pressing, record["force_desired"], np.nan), label="desired", **KNOWN),
    ]
    near = (max(touch - 0.1, float(t[0])), min(touch + 0.5, float(t[-1])))
    depths = [
        Series(t, 1e3 * record["penetration"], "F", "true", 1.4),
        Series(t, 1e3 * (record["x_measured"] - asked.place.place), "measured", "by the encoders", 1.0),
    ]
    depth = Chart("depth [mm]", depths, [Band(0.0, 0.0, "quiet")], x="time [s]", height=2.1)
    return {
        "touch": (
            [Chart("force [N]", forces, x="time [s]", xlim=near)],
            "The force in the first half second after the touch.",
        ),
        "force": (
            [Chart("force [N]", forces, height=2.1), depth],
            "Force and depth of the tip. Encoders before elastic joints measure their deflection, too.",
        ),
        "torque": (_torques(record, asked), "Torque of each joint, the arm's weight included."),
    }


def _torques(record: Record, asked: Asked) -> list[Chart]:
    """A chart a joint, in per cent of its motor's limit; in N m where nobody says how much that is."""
    limits = np.asarray(asked.arm.torque, dtype=float)
    known = bool(np.isfinite(limits).all())
    scales = 100.0 / limits if known else np.ones(len(limits))
    return [
        Chart(
            "of the limit [%]" if known else "torque [N m]",
            [Series(record["t"], scale * record[f"torque{i}"], "ink", width=1.2)],
            [Band(end, end, "measured", "", 1.0, "--") for end in ((-100.0, 100.0) if known else ())],
            x="time [s]", title=name, ylim=(-110.0, 110.0) if known else None, height=1.9,
        )
        for i, (name, scale) in enumerate(zip(asked.arm.names, scales, strict=False), 1)
    ]  # fmt: skip
