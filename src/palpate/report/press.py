"""The report of a press: tables, a film, charts, one page."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array, Indices
from palpate.bench.summary import CONTACT
from palpate.files import write_text
from palpate.press.free_stroke import subtraction_notes
from palpate.press.setting import Place
from palpate.press.summary import PressRequest
from palpate.records import Record
from palpate.report.chart import KNOWN, Band, Chart, Series, panels
from palpate.report.film import (
    animation,
    coordinates,
    film_svg,
    fit_view,
    frame_rows,
    text,
    touch_time,
    trace_panel,
)
from palpate.report.page import Answer, Table, answer_page, data_address, warning_alerts
from palpate.report.run.table import alert_line, alerts, settling, surface_table
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


def film(record: Record, arm: SerialArm, place: Place) -> str:
    """The film of a press as SVG: the arm to scale, its tip in the surface, and the force."""
    rows = frame_rows(record, _BEFORE)
    seconds = float(record["t"][rows[-1]] - record["t"][rows[0]])
    q = np.column_stack([record[f"q{i}"] for i in range(1, arm.joints + 1)])[rows]
    t, force, desired = (record[name][rows] for name in ("t", "force", "force_desired"))
    words = f"force and desired force, up to {float(force.max()):.3g} N in {seconds:.3g} s"
    parts = [
        *_arm_panel(arm, place, q, seconds),
        *_tip_panel(record, rows, seconds),
        *trace_panel(t, force, desired, _FORCE, words),
    ]
    return film_svg(parts, 0.0, _WIDE, _HIGH)


def _arm_panel(arm: SerialArm, place: Place, q: Array, seconds: float) -> list[str]:
    bones = [arm.joint_places(angles) for angles in q]
    patch = _patch(place, 0.16)
    ground = np.column_stack([bones[0][:, :2], 0.0 * bones[0][:, 2]])
    shown = np.vstack([bones[0], bones[-1], patch, ground])
    reach = shown.mean(axis=0)  # seen from the side of where the arm reaches, a little from above
    view = fit_view(shown, _ARM, float(np.arctan2(reach[1], reach[0])) - np.radians(60.0), np.radians(18.0))
    pictures = [view(points) for points in bones]
    moving = animation("points", [coordinates(points) for points in pictures], seconds)
    return [
        f'<polygon class="surface" points="{coordinates(view(patch))}" fill-opacity="0.55"/>',
        f'<polyline class="shadow" points="{coordinates(view(ground))}"/>',
        _MARKER,
        '<polyline class="arm" marker-start="url(#joint)" marker-mid="url(#joint)" ',
        f'points="{coordinates(pictures[0])}">{moving}</polyline>',
        text(_ARM[0], _HIGH - 8, "the arm, to scale"),
    ]


def _tip_panel(record: Record, rows: Indices, seconds: float) -> list[str]:
    """The tip along the normal, drawn so large that its way is seen."""
    left, top, width, height = _TIP
    depth = record["penetration"][rows]
    deepest = float(np.max(np.abs(depth))) or 1e-3
    middle, y0, scale = left + 0.5 * width, top + 0.45 * height, 0.4 * height / deepest
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


def write_report(record: Record, request: PressRequest, summary: dict[str, Any], folder: Path) -> None:
    """Write film.svg and report.html, with charts over time, into a folder."""
    moving = film(record, request.arm, request.place)
    write_text(folder / "film.svg", moving)
    source = data_address(moving.encode(), "image/svg+xml")
    figures: list[dict[str, Any]] = [
        {"source": source, "caption": "The press in real time; the motion of the tip is enlarged."}
    ]
    for panel_charts, caption in build_charts(record, request):
        figures.append({"panels": panels(panel_charts), "caption": caption})
    contact, loop = summary["force"] is not None, summary["loop"]
    force_words = f" with {plain(summary['force']['desired_N'], 3)} N" if contact else ""
    physics = "MuJoCo" if request.physics == "mujoco" else "own"
    page = replace(
        build_answer(request.arm.title, summary),
        title=f"A press of {request.arm.title}{force_words}",
        about=f"{request.arm.title}, {request.gains.arm.kind}s at {loop['rate_hz']:g} Hz, "
        f"{request.controller} control, {physics} physics, simulated, seed {request.seed}.",
        alerts=[*alerts(summary), *warning_alerts(_further_notes(summary))],
        figures=figures if contact else figures[:1],
    )
    write_text(folder / "report.html", answer_page(page, room="press", command=summary["command"]))


def sentence(summary: dict[str, Any]) -> str:
    """Outcome of the press, and the identified stiffness."""
    stiffness = _parameters(summary).get("K")
    if stiffness is None or stiffness["value"] is None or not stiffness["ci95"]:
        return outcome(summary)
    half = 0.5 * (stiffness["ci95"][1] - stiffness["ci95"][0])
    return f"{outcome(summary)} The stiffness of the surface is {quantity(stiffness['value'], 'N/m', half)}."


def _parameters(summary: dict[str, Any]) -> dict[str, Any]:
    """The identified parameters, as JSON has them; none where nothing was identified."""
    parameters: dict[str, Any] = (summary["identified"] or {}).get("parameters", {})
    return parameters


def notes(summary: dict[str, Any]) -> list[str]:
    """Warnings of the press, the failures first."""
    return [*map(alert_line, alerts(summary)), *_further_notes(summary)]


def _further_notes(summary: dict[str, Any]) -> list[str]:
    remarks = []
    if summary["sensor_saturated"]:
        ticks = f"{100 * summary['sensor_saturated']:.2g} % of the ticks"
        remarks.append(f"The force sensor was saturated in {ticks}: its reading is not the force.")
    identified = summary["identified"] or {}
    of_tool = [note["text"] for note in identified.get("warnings", ()) if note["code"] == "tool-inertia"]
    if identified.get("why_not"):
        of_tool.append(f"Nothing was identified: {identified['why_not']}")
    texts = (*of_tool, *subtraction_notes(summary["free_stroke"]), *summary["notes"])
    return [*remarks, *(f"{text[0].upper()}{text[1:]}." for text in texts)]


def tables(summary: dict[str, Any]) -> list[Table]:
    """The force, then the identified surface."""
    if summary["force"] is None:
        return []
    parameters = _parameters(summary)
    surface = surface_table("The surface, by palpate identify", parameters, summary["truth"])
    return [_force_table(summary), *([surface] if parameters else [])]


def build_answer(title: str, summary: dict[str, Any]) -> Answer:
    """The answer of a press by the arm of this title."""
    context = f", seed {summary['seed']}, {summary['duration_s']:.1f} s simulated\n"
    answer_sentence, answer_tables = sentence(summary), tables(summary)
    return Answer(
        summary, title, context=context, sentence=answer_sentence, tables=answer_tables, notes=notes(summary)
    )


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


def build_charts(record: Record, request: PressRequest) -> list[tuple[list[Chart], str]]:
    """Charts of a press, several in a figure, and their caption."""
    t, pressing = record["t"], record["phase"] == CONTACT
    touch = touch_time(record)
    forces = [
        Series(t, record["force_sampled"], "measured", "reading", 0.7),
        Series(t, record["force"], "F", "true"),
        Series(t, np.where(pressing, record["force_desired"], np.nan), label="desired", **KNOWN),
    ]
    near = (max(touch - 0.1, float(t[0])), min(touch + 0.5, float(t[-1])))
    depths = [
        Series(t, 1e3 * record["penetration"], "F", "true", 1.4),
        Series(t, 1e3 * (record["x_measured"] - request.place.place), "measured", "by the encoders", 1.0),
    ]
    depth = Chart("depth [mm]", depths, [Band(0.0, 0.0, "quiet")], x="time [s]", height=2.1)
    caption = "Force and depth of the tip. Encoders before elastic joints measure their deflection, too."
    return [
        (
            [Chart("force [N]", forces, x="time [s]", xlim=near)],
            "The force in the first half second after the touch.",
        ),
        ([Chart("force [N]", forces, height=2.1), depth], caption),
        (_torques(record, request), "Torque of each joint, the arm's weight included."),
    ]


def _torques(record: Record, request: PressRequest) -> list[Chart]:
    """A chart a joint, in per cent of its motor's limit; in N m where nobody says how much that is."""
    limits = np.asarray(request.arm.torque, dtype=float)
    known = bool(np.isfinite(limits).all())
    scales = 100.0 / limits if known else np.ones(len(limits))
    return [
        Chart(
            "of the limit [%]" if known else "torque [N m]",
            [Series(record["t"], scale * record[f"torque{i}"], "ink", width=1.2)],
            [Band(end, end, "measured", "", 1.0, "--") for end in ((-100.0, 100.0) if known else ())],
            x="time [s]",
            title=name,
            ylim=(-110.0, 110.0) if known else None,
            height=1.9,
        )
        for i, (name, scale) in enumerate(zip(request.arm.names, scales, strict=False), 1)
    ]
