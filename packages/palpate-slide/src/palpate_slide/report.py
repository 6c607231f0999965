"""The report of a slide: its summary in plain values, one figure, a film, the record and one page.

The film shows the surface from aside, the tip on it with the estimated normal, the force and friction.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.files import RECORD, write_text
from palpate.force.gains import Gains
from palpate.force.sliding.slide_domain import slide_json, slide_sentence
from palpate.force.sliding.slide_state import SLIDING_TROUBLES
from palpate.force.sliding.sliding_loop import CHI2_95, Z_95, Uncertain
from palpate.records import Record
from palpate.report import style
from palpate.report.answer import Card, PageAnswer, answer_page
from palpate.report.chart import KNOWN, Band, Chart, Mark, Series, figure_of, panels
from palpate.report.film import (
    FRAMES,
    FilmView,
    Panel,
    animation,
    coordinates,
    film_of,
    text,
    trace_panel,
    view_of,
)
from palpate.report.numbers import plain, quantity
from palpate.report.page import data_address
from palpate_slide.ground import Ground, surface_height
from palpate_slide.world import COLUMNS, SETTLED, figures_of

_UNITS = dict.fromkeys(("normal_force", "desired", "fx", "fy", "fz"), "N") | dict.fromkeys(
    ("x", "y", "z"), "m"
)
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
    n, held, (mu, half) = summary["normal"], summary["end"] == "held", _friction(summary)
    return (
        f"{plain(f['desired_N'], 3)} N {'held' if held else 'not held:'} within {100 * f['rms_share']:.2g} % rms over "
        f"{1e3 * summary['path_m']:.3g} mm; normal known to {n['cone95_deg']:.2g}\N{DEGREE SIGN}; friction {mu} "
        f"\N{PLUS-MINUS SIGN} {half}."
    )


def _friction(summary: dict[str, Any]) -> tuple[str, str]:
    """Friction and its half-width."""
    low, high = summary["friction"]["ci95"]
    digits = 2 if high - low > 0.01 else 3
    return f"{summary['friction']['value']:.{digits}f}", f"{0.5 * (high - low):.{digits}f}"


def write_report(rows: Array, gains: Gains, ground: Ground, summary: dict[str, Any], folder: Path) -> None:
    """Writes the record, film.svg, slide.png and report.html into a folder."""
    from palpate.logs import write_record

    columns = {"t": gains.arm.tick * np.arange(len(rows)), **dict(zip(COLUMNS, rows.T, strict=True))}
    units = {name: _UNITS.get(name, "1") for name in columns}
    write_record(Record(columns, units, {"command": summary["command"]}), folder / RECORD)
    charts = _charts(rows, gains, summary)
    style.save(figure_of(charts), folder / "slide.png")
    shown = panels(charts)
    alerts = [
        {"tone": "warn", "title": "", "text": f"{words[0].upper()}{words[1:]}."}
        for words in summary["troubles"]
    ]
    if summary["end"] != "held":
        alerts.insert(0, {"tone": "fail", "title": "", "text": f"The force: {summary['end']}."})
    caption = "Along the path. Grey: 95 % interval; dashed: desired, or the truth of the simulation."
    films = {half: slide_film(rows, gains.arm.tick, ground, half) for half in ("", "surface", "force")}
    write_text(folder / "film.svg", films[""])
    told = {"surface": "The path over the surface, in real time.", "force": "Force and friction."}
    pairs = [
        {"source": data_address(films[half].encode(), "image/svg+xml"), "caption": words}
        for half, words in told.items()
    ]
    answer = PageAnswer(
        title=f"A slide of {1e3 * summary['path_m']:.0f} mm with {plain(gains.force, 3)} N",
        sentence=sentence(summary),
        about=f"{gains.arm.title}. Simulated, seed {summary['seed']}; {slide_sentence(gains)}.",
        alerts=alerts, cards={"": _cards(summary)}, pairs=pairs, folds=_along(summary),
        figures=[{"panels": shown[:4], "caption": caption}, {"panels": shown[4:], "caption": caption}],
        source=("The gains", gains.to_toml()),
    )  # fmt: skip
    write_text(folder / "report.html", answer_page(answer, room="slide", command=summary["command"]))


def _cards(summary: dict[str, Any]) -> list[Card]:
    f, n, truth = summary["force"], summary["normal"], summary["truth"]
    if f is None:
        return [Card("Contact", "none", tone="fail")]
    K, (mu, half) = summary["stiffness"], _friction(summary)
    lost = summary["contact_lost"]
    low, high = (quantity(end, "N/m") for end in K["ci95"])
    off = f"median error {n['median_error_deg']:.2g}\N{DEGREE SIGN}"
    error, most = f"{100 * f['rms_share']:.2g}", f"largest {100 * f['largest_share']:.2g} %, after 0.5 s"
    true = quantity(truth["stiffness"], "N/m")
    return [
        Card("Contact", "lost" if lost else "kept", tone="fail" if lost else "ok"),
        Card("Force error", error, "% rms", why=most),
        Card("Normal", f"± {n['cone95_deg']:.2g}", "\N{DEGREE SIGN}", why=off),
        Card("Friction", mu, half=half, why=f"truth {truth['friction']:g}"),
        Card("Stiffness", low, why=f"to {high}; truth {true}", colour="K"),
    ]


def _along(summary: dict[str, Any]) -> list[tuple[str, str, list[list[str]]]]:
    """The stiffness along the path of a dithered slide, folded."""
    rows = [
        [f"x {1e3 * p['x']:.3g}, y {1e3 * p['y']:.3g} mm", quantity(p["stiffness"], "N/m", p["half"])]
        for p in summary.get("along") or []
    ]
    return [("Stiffness along the path", f"{len(rows)} places, for palpate map --table places.csv", rows)]


def _charts(rows: Array, gains: Gains, summary: dict[str, Any]) -> list[Chart]:
    """Force error, speed, normal, friction and stiffness against the path; stretches where the slide was slower."""
    on = rows[:, COLUMNS.index("sliding")] > 0.0
    kept = rows[on] if on.any() else rows
    c = dict(zip(COLUMNS, kept[:: max(len(kept) // 2000, 1)].T, strict=True))
    step = np.linalg.norm(np.diff(np.stack([c[a] for a in "xyz"], 1), axis=0), axis=1)
    way = 1e3 * np.append(0.0, np.cumsum(step))
    within = 0.1 * gains.force
    truth, asked, cone = (
        summary["truth"],
        1e3 * summary["slide"]["speed_m_s"],
        np.degrees(CHI2_95 * c["cone"]),
    )
    slower = _slower(way, c["speed"], summary["slide"]["speed_m_s"])
    charts = []
    for label, value, ends, known, colour, least in (
        ("force error [N]", c["normal_force"] - c["desired"], (), (-within, within), "F", None),
        ("speed [mm/s]", 1e3 * c["speed"], (), (asked,), "ink", 0.0),
        ("normal's error [deg]", np.degrees(c["normal_error"]), (cone,), (), "ink", 0.0),
        ("friction [1]", c["mu"], _interval(c, "mu"), (truth["friction"],), "ink", None),
        ("K [N/m]", c["stiffness"], _interval(c, "stiffness"), (truth["stiffness"],), "K", None),
    ):
        series = [Series(way, value, colour, "estimate" if ends else "", 1.2)]
        series += [Series(way, end, "measured", "" if i else "95 %", 1.0) for i, end in enumerate(ends)]
        settled = [np.asarray(v)[way > 0.05 * way[-1]] for v in (value, *ends)]
        bands, marks = [Band(level, level, **KNOWN) for level in known], [Mark(slower, "warn")]
        ylim = _limits(np.concatenate([*settled, np.array(known)]), least)
        charts.append(Chart(label, series, bands, marks, ylim=ylim, height=1.7))
    return [*charts[:-1], replace(charts[-1], x="path [mm]")]


def _limits(values: Array, least: float | None) -> tuple[float, float] | None:
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    low, high = float(known.min()) if least is None else least, float(known.max())
    return low - 0.08 * (high - low) - 1e-9, high + 0.08 * (high - low) + 1e-9


def _slower(way: Array, speed: Array, asked: float) -> list[tuple[float, float]]:
    """Stretches of the path on which the slide was slower than asked by a tenth, but for its beginning [mm]."""
    slow = np.flatnonzero((speed < 0.9 * asked) & (way > 0.02 * way[-1]))
    if not len(slow):
        return []
    cuts = np.flatnonzero(np.diff(slow) > 1)
    return [(float(way[part[0]]), float(way[part[-1]])) for part in np.split(slow, cuts + 1)]


def _interval(c: dict[str, Array], name: str) -> tuple[Array, Array]:
    half = Z_95 * c[f"{name}_std"]
    return np.maximum(c[name] - half, 0.0), c[name] + half


SURFACE: Panel = (20.0, 24.0, 480.0, 360.0)
"""Left, top, width and height of the surface's panel; then of the force's, and of friction's."""
FORCE: Panel = (540.0, 44.0, 340.0, 130.0)
FRICTION: Panel = (540.0, 244.0, 340.0, 130.0)
WIDE, HIGH = 900.0, 420.0
LINES = 13
"""Of the surface's grid, each way."""
ROD = 76.0
"""Length of the normal that is drawn at the tip."""
WIDER = 5.0
"""Times that a cone is drawn as wide as it is."""
BEFORE = 0.6
"""Time before the slide that is shown, or before the touch if there was no slide [s]."""
STICKS = 9
"""Normals that stay along the path."""


def slide_film(rows: Array, tick: float, ground: Ground, half: str = "") -> str:
    """The film of a slide as SVG.

    Args:
        rows: as of `world.simulate`, shape (n, 21).
        tick: between two rows [s].
        ground: the surface.
        half: `surface` or `force` for that half alone, which is legible on a telephone; both if empty.
    """
    c = dict(zip(COLUMNS, rows.T, strict=True))
    began = (
        np.flatnonzero(c["sliding"] > 0.0) if c["sliding"].any() else np.flatnonzero(c["normal_force"] > 0.0)
    )
    first = max(int(began[0]) - round(BEFORE / tick), 0) if len(began) else 0
    shown = np.linspace(first, len(rows) - 1, FRAMES).astype(int)
    c, t = {name: np.nan_to_num(column[shown]) for name, column in c.items()}, tick * shown
    left, width = {"": (0.0, WIDE), "surface": (0.0, 520.0), "force": (520.0, 380.0)}[half]
    parts = _surface_panel(c, float(t[-1] - t[0]), ground) if half != "force" else []
    if half != "surface":
        seconds, on = float(t[-1] - t[0]), c["sliding"] > 0.0
        words = f"force, up to {c['normal_force'].max():.3g} N in {seconds:.3g} s; dashed: desired"
        parts += trace_panel(t, c["normal_force"], c["desired"], FORCE, words)
        mu = np.where(on, c["mu"], 0.0)
        words = (
            f"friction, {mu[-1]:.2f} at the end; dashed: truth"
            if on.any()
            else "friction: the tip did not slide"
        )
        parts += trace_panel(t, mu, c["mu_true"], FRICTION, words)
    return film_of([_STYLE, *parts], left, width, HIGH)


_STYLE = (
    "<style>.net{fill:none;stroke:var(--quiet);stroke-opacity:.45;stroke-width:.8} .rod{stroke:var(--ink);"
    "stroke-width:6;stroke-linecap:round} .cone{fill:var(--quiet);fill-opacity:.35} .stick{stroke:var(--ink);"
    "stroke-width:1.2} .way{fill:none;stroke:var(--tip);stroke-width:3;stroke-linejoin:round}</style>"
)


def _surface_panel(c: dict[str, Array], seconds: float, ground: Ground) -> list[str]:
    tip, n = (np.stack([c[name] for name in names], 1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    net = _net(tip, ground)
    view = view_of(
        np.vstack([line for line in net if len(line)]), SURFACE, np.radians(-65.0), np.radians(28.0)
    )
    seen, size = view(tip), ROD / view.scale
    ends, on = view(tip - size * n), c["sliding"] > 0.0
    cones = [coordinates(_cone(view, *one, size)) for one in zip(tip, n, c["cone"], strict=True)]
    way = np.linalg.norm(np.diff(tip, axis=0), axis=1) * on[1:]
    gone = np.append(0.0, np.cumsum(way)) / max(float(way.sum()), 1e-9)
    path = seen[on] if on.any() else seen[:1]
    places = np.searchsorted(gone, np.linspace(0.0, 1.0, STICKS + 2)[1 : -1 if on.any() else 1])
    moving = "".join(
        animation(name, [f"{v:.1f}" for v in values], seconds)
        for name, values in (("x1", seen[:, 0]), ("y1", seen[:, 1]), ("x2", ends[:, 0]), ("y2", ends[:, 1]))
    )
    return [
        *(f'<polyline class="net" points="{coordinates(view(line))}"/>' for line in net if len(line) > 1),
        *(stick for k in places for stick in _stick(view, tip[k], n[k], float(c["cone"][k]), 0.6 * size)),
        f'<polyline class="way" pathLength="1" stroke-dasharray="1 1" points="{coordinates(path)}">',
        f"{animation('stroke-dashoffset', [f'{1.0 - g:.4f}' for g in gone], seconds)}</polyline>",
        f'<polygon class="cone" points="{cones[-1]}">{animation("points", cones, seconds)}</polygon>',
        f'<line class="rod" {_ends(seen[-1], ends[-1])}>{moving}</line>',
        text(SURFACE[0], HIGH - 8, f"to scale; cones of 95 % are drawn {WIDER:g} times as wide"),
    ]


def _stick(view: FilmView, at: Array, n: Array, deviation: float, size: float) -> list[str]:
    """A normal that stays, with its cone."""
    cone = coordinates(_cone(view, at, n, deviation, size))
    return [
        f'<polygon class="cone" points="{cone}"/>',
        f'<line class="stick" {_ends(*view(np.array([at, at - size * n])))}/>',
    ]


def _ends(one: Array, two: Array) -> str:
    return f'x1="{one[0]:.1f}" y1="{one[1]:.1f}" x2="{two[0]:.1f}" y2="{two[1]:.1f}"'


def _cone(view: FilmView, at: Array, n: Array, deviation: float, size: float) -> Array:
    """The outline of a normal's cone."""
    half = size * np.tan(min(WIDER * CHI2_95 * deviation, 0.6))
    aside = np.cross(n, np.cross(view.right, view.up))
    aside /= max(float(np.linalg.norm(aside)), 1e-9)
    return view(np.array([at, at - size * n + half * aside, at - size * n - half * aside]))


def _net(tip: Array, ground: Ground) -> list[Array]:
    """Lines of a grid on the surface around the path, each of shape (m, 3) [m]."""
    low, high = tip[:, :2].min(axis=0), tip[:, :2].max(axis=0)
    middle, reach = 0.5 * (low + high), 0.62 * max(float((high - low).max()), 0.02)
    own = np.linspace(-reach, reach, LINES)
    places = np.array(
        [[[x, y, surface_height(ground, x, y)] for y in middle[1] + own] for x in middle[0] + own]
    )
    lines = [*places, *places.transpose(1, 0, 2)]
    return [line[np.isfinite(line[:, 2])] for line in lines]
