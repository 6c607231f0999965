"""Charts of a run: of its figures and of its page alike."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.bench.summary import CONTACT, LOST
from palpate.files import write_text
from palpate.records import Record
from palpate.report import style
from palpate.report.chart import KNOWN, Band, Chart, Interval, Mark, Series, figure_of, panels
from palpate.report.page import PageAnswer, Table, answer_page
from palpate.report.run.table import alerts, sentence, settling
from palpate.signals.types import NORMAL
from palpate.units import NONE, quantity

BEFORE = 1.0
"""Seconds before contact that are still shown."""
PARAMETERS = {"K": ("Stiffness K", "N/m"), "B": ("Damping B", "N s/m"), "M": ("Mass M", "kg")}
_MOST_STRETCHES = 40
"""Contacts, and losses of contact, that are marked."""
_FAR = 50.0
"""Times the range of nearly all values; what is farther leaves no resolution for the others, and is a gap."""
_NEAR_LIMIT = 0.7
"""Fraction of a motor's limit from which on the limit is shown."""


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
    for name, (charts, caption) in figures_of(record).items():
        figure = figure_of(charts)
        for ending in endings:
            style.save(figure, folder / f"{name}{ending}", dpi)
            captions[f"{name}{ending}"] = caption
    return captions


def figures_of(record: Record) -> dict[str, tuple[list[Chart], str]]:
    """Charts of each figure and its caption, by its name, in the order to be read."""
    charts = charts_of(record)
    window = window_of(record)
    shown = {name: replace(chart, xlim=window) for name, chart in charts.items()}
    approach = [_position(record), charts["force"]]
    approach_words = (
        "The whole run. The desired position moves in steps until contact; friction delays the tip."
    )
    found = {"approach": (approach, f"{approach_words} Shaded: force control, and loss of contact.")}
    if "K" in charts:
        words = "Contact force. The true force acts on the simulated surface; the controller receives the measured one."
        found["force"] = ([shown["force"]], words)
        words = (
            "Recursive least squares on channels matched in lag, its 95 % interval, and the stiffness from three kinds "
            "of signals. The initial transient of the estimates is cut off."
        )
        found["identification"] = ([shown[name] for name in (*PARAMETERS, "thesis")], words)
    torques = [chart for name, chart in charts.items() if name.startswith("motor")]
    found["torque"] = (torques, "Applied torque. Dashed: the limit, if the torque comes near it.")
    return found


def window_of(record: Record) -> tuple[float, float]:
    """From a little before the first contact to the end of the run [s]; all of a run without one."""
    t, contact = record["t"], record["phase"] == CONTACT
    first = float(t[np.argmax(contact)]) - BEFORE if contact.any() else float(t[0])
    return max(float(t[0]), first), float(t[-1])


def charts_of(record: Record) -> dict[str, Chart]:
    """Charts of force, motors, each parameter, and stiffness from three kinds of signals; the latter need contact."""
    t, marks = record["t"], _marks(record)
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)
    forces = [
        Series(t, record["force_measured"], "measured", "measured, filtered", 0.8),
        Series(t, record["force"], "F", "true"),
        Series(t, desired, label="desired", **KNOWN),
        *(_at_limit(record, i, record["force"], f"motor {i} at its limit") for i in (1, 2, 3)),
    ]
    charts = {"force": _chart("Force", "force [N]", forces, marks=marks)} | _torques(record)
    if not (record["phase"] == CONTACT).any():
        return charts
    truth = {name: float(known["value"]) for name, known in record.meta["truth"].items()}
    lost = [mark for mark in marks if mark.colour == "fail"]
    touched = np.maximum.accumulate(record["phase"]) > 0.0

    def estimate(name: str) -> Array:
        return _without_far(np.where(touched, record[name], np.nan))

    for name, (title, unit) in PARAMETERS.items():
        value, half = estimate(f"{name}_matched"), NORMAL * record[f"{name}_matched_std"]
        label = "95 % if the model holds"
        interval = Interval(t, _without_far(value - half), _without_far(value + half), name, label)
        late = [
            record[f"{name}_matched"] + sign * NORMAL * record[f"{name}_matched_std"] for sign in (-1.0, 1.0)
        ]
        charts[name] = _chart(
            title, f"{name} [{unit}]", [Series(t, value, name, "on line")], _true_value(truth.get(name)),
            intervals=[interval], ylim=_settled_range(record, late, truth.get(name)), marks=lost,
        )  # fmt: skip
    fronts = {"thesis": ("measured", "--", "thesis' signals"), "raw": ("measured", "", "raw signals")}
    fronts |= {"matched": ("K", "", "matched in lag")}
    charts["thesis"] = _chart(
        "Stiffness by signals", "K [N/m]",
        [
            Series(t, estimate(f"K_{front}"), colour, label, 1.6 if front == "matched" else 1.1, dash)
            for front, (colour, dash, label) in fronts.items()
        ],
        _true_value(truth.get("K")), marks=lost,
        ylim=_settled_range(record, [record[f"K_{front}"] for front in fronts], truth.get("K")),
    )  # fmt: skip
    return charts


def _chart(
    title: str, y: str, series: Sequence[Series | None], bands: Sequence[Band] = (), **more: Any
) -> Chart:
    return Chart(y, [one for one in series if one is not None], bands, title=title, x="time [s]", **more)


def _true_value(value: float | None) -> list[Band]:
    return [] if value is None else [Band(value, value, label="truth", **KNOWN)]


def _position(record: Record) -> Chart:
    t, wall = record["t"], 1e3 * record.meta["experiment"]["wall"]["x"]
    series = [
        Series(t, 1e3 * record["x_desired"], label="desired", **KNOWN),
        Series(t, 1e3 * record["x"], "F", "tip"),
    ]
    at_rest = Band(wall, wall, "quiet", "surface at rest", 1.0, ":")
    return _chart("Position", "x [mm]", series, [at_rest], marks=_marks(record))


def _torques(record: Record) -> dict[str, Chart]:
    """A chart a motor, and its limit if the torque comes near it."""
    charts = {}
    for i, limit in enumerate(record.meta["experiment"]["robot"]["torque_limits"], 1):
        torque = record[f"torque{i}"]
        is_near = len(torque) and np.max(np.abs(torque)) > _NEAR_LIMIT * limit
        bands = [Band(end, end, "fail", "", 0.8, "--") for end in ((-limit, limit) if is_near else ())]
        series = [Series(record["t"], torque, "ink", width=0.8), _at_limit(record, i, torque, "at the limit")]
        title, marks = f"Motor {i}", _marks(record)
        charts[f"motor{i}"] = _chart(title, "torque [N m]", series, bands, marks=marks, height=1.9)
    return charts


def _at_limit(record: Record, motor: int, values: Array, label: str) -> Series | None:
    """Dots on a line where a motor is at its limit; None where it never is."""
    up = record[f"saturated{motor}"] > 0.0
    return Series(record["t"][up], values[up], "fail", label, dots=2.0) if up.any() else None


def _marks(record: Record) -> list[Mark]:
    """Where force is controlled, and where contact is lost."""
    t, phase = record["t"], record["phase"]
    kinds = ((CONTACT, "F", "force control"), (LOST, "fail", "contact lost"))
    found = [Mark(_stretches(t, phase == kind), colour, label) for kind, colour, label in kinds]
    return [mark for mark in found if mark.spans]


def _stretches(t: Array, inside: Mask) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(inside.astype(int), prepend=0, append=0))
    ends = zip(edges[::2], edges[1::2], strict=True)
    return [(float(t[a]), float(t[b - 1])) for a, b in ends][:_MOST_STRETCHES]


def _without_far(values: Array) -> Array:
    """Values with gaps in place of the few that are far from all others."""
    known = values[np.isfinite(values)]
    if not len(known):
        return values
    low, high = np.quantile(known, (0.02, 0.98))
    room = _FAR * (high - low) or np.inf
    return np.where((values < low - room) | (values > high + room), np.nan, values)


def _settled_range(record: Record, parts: Sequence[Array], truth: float | None) -> tuple[float, float]:
    """Range of a chart: where the estimates come to rest, and the truth, not where they come from."""
    pressed = np.flatnonzero(record["phase"] == CONTACT)
    late = pressed[len(pressed) // 4 :]
    ends = [float(np.quantile(part[late], q)) for part in parts for q in (0.02, 0.98)]
    ends += [] if truth is None else [truth]
    room = 0.25 * (max(ends) - min(ends)) or 1.0
    return min(ends) - room, max(ends) + room


def around_contact(record: Record, before: float = BEFORE) -> tuple[Array, Mask]:
    """Time since contact [s] where it is shown, and which rows those are."""
    t = record["t"]
    start = t[np.argmax(record["phase"] == CONTACT)]
    shown = t >= start - before
    return (t - start)[shown], shown


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
    answer = PageAnswer(
        title=experiment["title"],
        sentence=sentence(summary),
        about=experiment["about"],
        alerts=alerts(summary),
        tables=one_direction_tables(record, summary),
        figures=figures,
        source=("The experiment", source),
    )
    write_text(folder / "report.html", answer_page(answer, room="run", command=summary["command"]))


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
