"""The report of a slide: its summary in plain values, one figure, the record and one page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import INTERRUPTED
from palpate.files import RECORD, write_text
from palpate.force.gains import Gains
from palpate.force.sliding.slide_domain import slide_json, slide_sentence
from palpate.force.sliding.slide_state import AWAY, SLIDING_TROUBLES
from palpate.force.sliding.sliding_loop import CHI2_95, Z_95, Uncertain
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Mark, Series, build_figure, panels
from palpate.report.page import Answer, Card, answer_page
from palpate.slide.ground import Ground
from palpate.slide.world import COLUMNS, LONGEST, SETTLED, SlideRun, figures_of
from palpate.units import cone95, plain, quantity, quantity_between

_UNITS = (
    dict.fromkeys(("normal_force", "desired", "fx", "fy", "fz"), "N")
    | dict.fromkeys("xyz", "m")
    | {"tool": "rad", "normal_error": "rad", "cone": "rad", "stiffness": "N/m", "speed": "m/s", "t": "s"}
)


_DITHERED = (
    "the dither, followed late, takes the force off by a tenth, and halves the speed; a smaller one is faster"
)


def summarise(
    rows: Array, gains: Gains, ground: Ground, turned: bool = False, interrupted: bool = False
) -> dict[str, Any]:
    """Plain JSON values: how the force was held, normal, friction and stiffness with intervals, and the truth.

    Args:
        rows: of the slide without its retreat, as of `world.simulate`.
        gains: of the law.
        ground: the surface.
        turned: whether the tool was kept perpendicular.
        interrupted: by the user.
    """
    c = dict(zip(COLUMNS, rows.T, strict=True))
    figures = figures_of(rows, gains, ground)
    on = c["sliding"] > 0.0
    never = "no slide" if c["normal_force"].any() else "no contact"
    messages = SLIDING_TROUBLES | ({AWAY: _DITHERED} if figures.obeys and np.ptp(c["desired"][on]) else {})
    troubles = [messages[code] for code in dict.fromkeys(c["trouble"].tolist()) if code]
    felt_stiffness = gains.arm.seen(ground.stiffness) if gains.arm.kind == "position" else ground.stiffness
    summary: dict[str, Any] = {
        "arm": gains.arm.title, "mode": gains.arm.kind, "slide": slide_json(gains), "troubles": troubles,
        "end": INTERRUPTED if interrupted else "held" if figures.obeys else "not held" if figures.touched else never,
        "truth": {"friction": ground.friction, "stiffness": felt_stiffness},
        **dict.fromkeys(("force", "normal", "friction", "stiffness", "tool", "began_s")), "path_m": 0.0,
    }  # fmt: skip
    if not figures.touched:
        return summary
    where = np.stack([c[axis][on] for axis in "xyz"], 1)
    mu, K = (Uncertain(float(c[name][-1]), float(c[f"{name}_std"][-1])) for name in ("mu", "stiffness"))
    judged = np.flatnonzero(on)[round(SETTLED * gains.arm.rate) :]
    return summary | {
        "force": {
            "desired_N": gains.force, "rms_share": figures.rms, "largest_share": figures.most,
            "worst_N": figures.worst * gains.force,
        },
        "normal": {
            "median_error_deg": float(np.degrees(figures.normal)), "coverage": figures.cone,
            "cone95_deg": cone95(float(CHI2_95 * np.median(c["cone"][judged]))),
        },
        "friction": {"value": float(mu), "ci95": list(mu.ci95)},
        "stiffness": {"value": float(K), "ci95": list(K.ci95)},
        "began_s": gains.arm.tick * float(np.argmax(on) - np.argmax(c["normal_force"] > 0.0)),
        "path_m": float(np.linalg.norm(np.diff(where, axis=0), axis=1).sum()),
        "contact_lost": figures.lost,
        "tool": {
            "median_angle_deg": float(np.degrees(np.median(c["tool"][judged]))),
            "angle95_deg": float(np.degrees(np.percentile(c["tool"][judged], 95))),
        } if turned else None,
    }  # fmt: skip


def sentence(summary: dict[str, Any]) -> str:
    """The answer in a line."""
    f = summary["force"]
    if f is None:
        if summary["end"] == INTERRUPTED:
            return "The slide was interrupted before it could be judged."
        if summary["end"] == "no slide":
            return f"The force was not held within {LONGEST:g} s: the tip did not slide."
        return f"The surface was never touched in {LONGEST:g} s: does --normal point into it?"
    outcome = {"held": "held", INTERRUPTED: "until the interruption"}.get(summary["end"], "not held:")
    mu, half = _friction(summary)
    angle = (summary["tool"] or {}).get("angle95_deg")
    within = f"; tool within {angle:.2g}\N{DEGREE SIGN} of the normal for 95 % of the time" if angle else ""
    return (
        f"{plain(f['desired_N'], 3)} N {outcome} within {100 * f['rms_share']:.2g} % rms over "
        f"{1e3 * summary['path_m']:.3g} mm; normal {_normal(summary['normal'])}; friction {mu} "
        f"\N{PLUS-MINUS SIGN} {half}{within}."
    )


def _normal(normal: dict[str, Any]) -> str:
    cone = normal["cone95_deg"]
    return "unknown" if cone is None else f"\N{PLUS-MINUS SIGN} {plain(cone, 2)}\N{DEGREE SIGN}"


def _friction(summary: dict[str, Any]) -> tuple[str, str]:
    """Friction and its half-width."""
    low, high = summary["friction"]["ci95"]
    digits = 2 if high - low > 0.01 else 3
    return f"{summary['friction']['value']:z.{digits}f}", f"{0.5 * (high - low):.{digits}f}"


def write_report(run: SlideRun, gains: Gains, summary: dict[str, Any], folder: Path) -> None:
    """Writes the record, slide.png and report.html into a folder; the record alone has the retreat."""
    from palpate.logs import write_record
    from palpate.logs.signals import SLIDE_END

    rows = run.rows
    tick = gains.arm.tick
    table = dict(zip(COLUMNS, np.concatenate([rows, run.retreat]).T, strict=True))
    del table["sliding"]
    columns = {"t": tick * np.arange(len(run.phases)), "phase": run.phases, **table}
    columns = {name: column for name, column in columns.items() if not np.isnan(column).all()}
    units = {name: _UNITS.get(name, "1") for name in columns}
    about = {
        "command": summary["command"], "wrench_frame": "base", "unloaded": run.unloading.how,
        SLIDE_END: tick * (len(rows) - 0.5),
    }  # fmt: skip
    write_record(Record(columns, units, about), folder / RECORD)
    charts = _charts(rows, gains, summary)
    style.save(build_figure(charts), folder / "slide.png")
    charts_html = panels(charts)
    alerts = [
        {"tone": "warn", "title": "", "text": f"{text[0].upper()}{text[1:]}."} for text in summary["troubles"]
    ]
    if summary["end"] != "held":
        alerts.insert(0, {"tone": "fail", "title": "", "text": f"The force: {summary['end']}."})
    caption = "Along the path. Grey: 95 % interval; dashed: desired, or the truth of the simulation."
    answer = Answer(
        title=f"A slide of {1e3 * summary['path_m']:.0f} mm with {plain(gains.force, 3)} N",
        sentence=sentence(summary),
        about=f"{gains.arm.title}. Simulated, seed {summary['seed']}; {slide_sentence(gains)}."
        + " A flat tool's moment is not covered." * (summary["tool"] is not None),
        alerts=alerts, cards=_cards(summary), folds=_along(summary),
        figures=[{"panels": part, "caption": caption} for part in (charts_html[:-1], charts_html[-1:])],
        source=("The gains", gains.to_toml()),
    )  # fmt: skip
    write_text(folder / "report.html", answer_page(answer, room="slide", command=summary["command"]))


def _cards(summary: dict[str, Any]) -> list[Card]:
    f = summary["force"]
    n = summary["normal"]
    truth = summary["truth"]
    if f is None:
        return [] if summary["end"] == INTERRUPTED else [Card("Contact", "none", tone="fail")]
    K, (mu, half) = summary["stiffness"], _friction(summary)
    lost = summary["contact_lost"]
    off = f"median error {n['median_error_deg']:.2g}\N{DEGREE SIGN}"
    error, largest = f"{100 * f['rms_share']:.2g}", f"largest {100 * f['largest_share']:.2g} %, after 0.5 s"
    true = quantity(truth["stiffness"], "N/m") + ", with the arm in series" * (summary["mode"] == "position")
    began = f"the slide began {summary['began_s']:.2g} s after the first one"
    tool = [
        Card("Tool", f"{t['median_angle_deg']:.2g}", "\N{DEGREE SIGN}", why=f"95 %: {t['angle95_deg']:.2g}")
        for t in [summary["tool"]]
        if t
    ]
    return [
        Card("Contact", "lost" if lost else "kept", tone="fail" if lost else "ok", why=began),
        Card("Force error", error, "% rms", why=largest),
        Card("Normal", _normal(n), why=off),
        *tool,
        Card("Friction", mu, half=half, why=f"truth {truth['friction']:g}"),
        Card(
            "Stiffness", quantity_between(K["ci95"][0], K["ci95"][1], "N/m"), why=f"truth {true}", colour="K"
        ),
    ]


def _along(summary: dict[str, Any]) -> list[tuple[str, str, list[list[str]]]]:
    """The stiffness along the path of a dithered slide, folded."""
    rows = [
        [f"x {1e3 * p['x']:.3g}, y {1e3 * p['y']:.3g} mm", quantity(p["stiffness"], "N/m", p["half"])]
        for p in summary.get("along") or []
    ]
    return [("Stiffness along the path", f"{len(rows)} places, for palpate map --table places.csv", rows)]


def _charts(rows: Array, gains: Gains, summary: dict[str, Any]) -> list[Chart]:
    """Force error, speed, and of a slide the estimates against the path; stretches where it was slower."""
    on = rows[:, COLUMNS.index("sliding")] > 0.0
    sliding = rows[on] if on.any() else rows
    c = dict(zip(COLUMNS, sliding[:: max(len(sliding) // 2000, 1)].T, strict=True))
    step = np.linalg.norm(np.diff(np.stack([c[a] for a in "xyz"], 1), axis=0), axis=1)
    path = 1e3 * np.append(0.0, np.cumsum(step))
    within = 0.1 * gains.force
    truth = summary["truth"]
    speed = summary["slide"]["speed_m_s"]
    cone = np.degrees(CHI2_95 * c["cone"])
    slower = _slower(path, c["speed"], speed) if on.any() else []
    charts = []
    for label, value, ends, references, colour, low in (
        ("force error [N]", c["normal_force"] - c["desired"], (), (-within, within), "F", None),
        ("speed [mm/s]", 1e3 * c["speed"], (), (1e3 * speed,), "ink", 0.0),
        ("normal's error [deg]", np.degrees(c["normal_error"]), (cone,), (), "ink", 0.0),
        ("tool's angle [deg]", np.degrees(c["tool"]), (), (), "ink", 0.0),
        ("friction [1]", c["mu"], _interval(c, "mu"), (truth["friction"],), "ink", None),
        ("K [N/m]", c["stiffness"], _interval(c, "stiffness"), (truth["stiffness"],), "K", None),
    )[: None if on.any() else 2]:  # without a slide nothing was estimated
        series = [Series(path, value, colour, "estimate" if ends else "", 1.2)]
        series += [Series(path, end, "measured", "" if i else "95 %", 1.0) for i, end in enumerate(ends)]
        settled = [np.asarray(v)[path > 0.05 * path[-1]] for v in (value, *ends)]
        bands = [Band(level, level, **KNOWN) for level in references]
        marks = [Mark(slower, "warn")]
        ylim = _limits(np.concatenate([*settled, np.array(references)]), low)
        if np.isfinite(value).all():
            charts.append(Chart(label, series, bands, marks, ylim=ylim, height=1.7))
    return [*charts[:-1], replace(charts[-1], x="path [mm]")]


def _limits(values: Array, floor: float | None) -> tuple[float, float] | None:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low = float(finite.min()) if floor is None else floor
    high = float(finite.max())
    return low - 0.08 * (high - low) - 1e-9, high + 0.08 * (high - low) + 1e-9


def _slower(path: Array, speed: Array, wanted_speed: float) -> list[tuple[float, float]]:
    """Stretches of the path on which the slide was slower than asked by a tenth, but for its beginning [mm]."""
    slow = np.flatnonzero((speed < 0.9 * wanted_speed) & (path > 0.02 * path[-1]))
    parts = np.split(slow, np.flatnonzero(np.diff(slow) > 1) + 1)
    return [(float(path[part[0]]), float(path[part[-1]])) for part in parts if len(part)]


def _interval(c: dict[str, Array], name: str) -> tuple[Array, Array]:
    half = Z_95 * c[f"{name}_std"]
    return np.maximum(c[name] - half, 0.0), c[name] + half
