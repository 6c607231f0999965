"""The report of a slide: its summary in plain values, one figure, the record and one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.files import write_text
from palpate.force.gains import Gains
from palpate.force.sliding.slide_domain import slide_json, slide_sentence
from palpate.force.sliding.slide_state import SLIDING_TROUBLES
from palpate.force.sliding.sliding_loop import CHI2_95, Z_95, Uncertain
from palpate.records import Record
from palpate.report import style
from palpate.report.answer import Card, PageAnswer, answer_page
from palpate.report.figure_panels.panels import panels_of
from palpate.report.numbers import plain, quantity
from palpate_slide.ground import Ground
from palpate_slide.world import COLUMNS, SETTLED, figures_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_UNITS = dict.fromkeys(("normal_force", "fx", "fy", "fz"), "N") | dict.fromkeys(("x", "y", "z"), "m")
_UNITS |= {"normal_error": "rad", "cone": "rad", "stiffness": "N/m", "speed": "m/s", "t": "s"}


def summarise(rows: Array, gains: Gains, ground: Ground) -> dict[str, Any]:
    """Plain JSON values: how the force was held, normal, friction and stiffness with intervals, and the truth."""
    c, found = dict(zip(COLUMNS, rows.T, strict=True)), figures_of(rows, gains, ground)
    on = c["sliding"] > 0.0
    said = [SLIDING_TROUBLES[code] for code in dict.fromkeys(c["trouble"].tolist()) if code]
    summary: dict[str, Any] = {
        "arm": gains.arm.title, "mode": gains.arm.kind, "slide": slide_json(gains), "troubles": said,
        "end": "no contact" if not found.touched else "held" if found.obeys else "not held",
        "truth": {"friction": ground.friction, "stiffness": _seen(gains, ground)},
        "force": None, "normal": None, "friction": None, "stiffness": None, "path_m": 0.0,
    }  # fmt: skip
    if not found.touched:
        return summary
    where = np.stack([c[axis][on] for axis in "xyz"], 1)
    mu, K = (Uncertain(float(c[name][-1]), float(c[f"{name}_std"][-1])) for name in ("mu", "stiffness"))
    judged = np.flatnonzero(on)[round(SETTLED * gains.arm.rate) :]
    return summary | {
        "force": {
            "desired_N": gains.force, "rms_share": found.rms, "largest_share": found.most,
            "worst_N": found.worst * gains.force,
        },
        "normal": {
            "median_error_deg": float(np.degrees(found.normal)), "coverage": found.cone,
            "cone95_deg": float(np.degrees(CHI2_95 * np.median(c["cone"][judged]))),
        },
        "friction": {"value": float(mu), "ci95": list(mu.ci95)},
        "stiffness": {"value": float(K), "ci95": list(K.ci95)},
        "path_m": float(np.linalg.norm(np.diff(where, axis=0), axis=1).sum()),
        "contact_lost": found.lost,
    }  # fmt: skip


def _seen(gains: Gains, ground: Ground) -> float:
    return gains.arm.seen(ground.stiffness) if gains.arm.kind == "position" else ground.stiffness


def sentence(summary: dict[str, Any]) -> str:
    """The answer in a line."""
    f = summary["force"]
    if f is None:
        return "The surface was never touched, or the force was not held before a slide."
    mu, n = summary["friction"], summary["normal"]
    half = 0.5 * (mu["ci95"][1] - mu["ci95"][0])
    held = "" if summary["end"] == "held" else "Not held: "
    return (
        f"{held}{plain(f['desired_N'], 3)} N within {100 * f['rms_share']:.2g} % rms over "
        f"{quantity(summary['path_m'], 'm')}; normal known to {n['cone95_deg']:.2g}\N{DEGREE SIGN}; "
        f"friction {mu['value']:.2f} ± {half:.2g}."
    )


def write_report(rows: Array, gains: Gains, summary: dict[str, Any], folder: Path, record: str) -> None:
    """Writes the record, slide.png and report.html into a folder."""
    from palpate.logs import write_record

    columns = {"t": gains.arm.tick * np.arange(len(rows)), **dict(zip(COLUMNS, rows.T, strict=True))}
    units = {name: _UNITS.get(name, "1") for name in columns}
    write_record(Record(columns, units, {"command": summary["command"]}), folder / record)
    with style.ink():
        drawing = _drawn(rows, gains, summary)
        style.save(drawing, folder / "slide.png")
        panels = panels_of(drawing)
    alerts = [
        {"tone": "warn", "title": "", "text": f"{text[0].upper()}{text[1:]}."} for text in summary["troubles"]
    ]
    if summary["end"] != "held":
        alerts.insert(0, {"tone": "fail", "title": "", "text": f"The force: {summary['end']}."})
    caption = "Against the path. Grey: 95 % intervals; dashed: desired, or the truth of the simulation."
    figures = [
        {"panels": panels[:-1], "caption": caption},
        {"panels": panels[-1:], "caption": "Speed along the path."},
    ]
    answer = PageAnswer(
        title=f"A slide of {1e3 * summary['path_m']:.0f} mm with {plain(gains.force, 3)} N",
        sentence=sentence(summary),
        about=f"{gains.arm.title}. Simulated, seed {summary['seed']}; {slide_sentence(gains)}.",
        alerts=alerts, cards={"": _cards(summary)}, figures=figures,
        source=("The gains", gains.to_toml()),
    )  # fmt: skip
    write_text(folder / "report.html", answer_page(answer, room="slide", command=summary["command"]))


def _cards(summary: dict[str, Any]) -> list[Card]:
    f, n, truth = summary["force"], summary["normal"], summary["truth"]
    if f is None:
        return [Card("Contact", "none", tone="fail")]
    mu, K = summary["friction"], summary["stiffness"]
    lost = summary["contact_lost"]
    low, high = (quantity(end, "N/m") for end in K["ci95"])
    half = 0.5 * (mu["ci95"][1] - mu["ci95"][0])
    off = f"median error {n['median_error_deg']:.2g}\N{DEGREE SIGN}"
    error, most = f"{100 * f['rms_share']:.2g}", f"largest {100 * f['largest_share']:.2g} %, after 0.5 s"
    true = quantity(truth["stiffness"], "N/m")
    return [
        Card("Contact", "lost" if lost else "kept", tone="fail" if lost else "ok"),
        Card("Force error", error, "% rms", why=most),
        Card("Normal", f"± {n['cone95_deg']:.2g}", "\N{DEGREE SIGN}", why=off),
        Card("Friction", f"{mu['value']:.2f}", half=f"{half:.2g}", why=f"truth {truth['friction']:g}"),
        Card("Stiffness", low, why=f"to {high}; truth {true}", colour="K"),
    ]


def _drawn(rows: Array, gains: Gains, summary: dict[str, Any]) -> Figure:
    """Force error, normal, friction, stiffness and speed against the path."""
    on = rows[:, COLUMNS.index("sliding")] > 0.0
    kept = rows[on] if on.any() else rows
    c = dict(zip(COLUMNS, kept[:: max(len(kept) // 2000, 1)].T, strict=True))
    drawing, (force, normal, friction, stiffness, speed) = style.figure(5, height=1.7)
    step = np.linalg.norm(np.diff(np.stack([c[a] for a in "xyz"], 1), axis=0), axis=1)
    way, nothing = 1e3 * np.append(0.0, np.cumsum(step)), np.zeros(len(step) + 1)
    truth, band, cone = summary["truth"], 0.05 * gains.force + nothing, np.degrees(CHI2_95 * c["cone"])
    for axes, label, value, low, high, color in (
        (force, "force error [N]", c["normal_force"] - gains.force, -band, band, style.F),
        (normal, "normal's error [deg]", np.degrees(c["normal_error"]), nothing, cone, style.INK),
        (friction, "friction [1]", c["mu"], *_interval(c, "mu"), style.INK),
        (stiffness, "K [N/m]", c["stiffness"], *_interval(c, "stiffness"), style.K),
        (speed, "speed [mm/s]", 1e3 * c["speed"], nothing, nothing, style.INK),
    ):  # fmt: skip
        axes.plot(way, value, color=color, linewidth=1.2)
        axes.fill_between(way, low, high, color=style.MEASURED, alpha=0.2, linewidth=0)
        axes.set_ylabel(label)
    friction.axhline(truth["friction"], **style.KNOWN)
    stiffness.axhline(truth["stiffness"], **style.KNOWN)
    speed.set_xlabel("path [mm]")
    return drawing


def _interval(c: dict[str, Array], name: str) -> tuple[Array, Array]:
    half = Z_95 * c[f"{name}_std"]
    return np.maximum(c[name] - half, 0.0), c[name] + half
