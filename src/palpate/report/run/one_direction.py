"""A run along one direction with the cautious force law: its tables and charts."""

from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate.report.chart import KNOWN, Chart, Series
from palpate.report.page import Table
from palpate.report.run.table import settling
from palpate.units import NONE, quantity

_BEFORE_CONTACT = 0.1
"""Seconds before the touch that are still shown."""


def one_direction_tables(record: Record, summary: dict[str, Any]) -> list[Table]:
    """The force first, then the loop and the surface."""
    f = summary["force"]
    if f is None:
        return []
    overshoot = NONE
    if f["overshoot_N"] is not None:
        first = float(record["force_desired"][record["phase"] == CONTACT][0])
        overshoot = f"{f['overshoot_N']:.2f} N, {100.0 * f['overshoot_N'] / first:.1f} %"
    force = (
        ("touch at", f"{summary['contact_at_s']:.3f} s"),
        ("settling to 5 %", settling(f)),
        ("overshoot", overshoot),
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
    since = record["t"] - record["t"][np.argmax(record["phase"] == CONTACT)]
    in_window = since >= -_BEFORE_CONTACT
    since = since[in_window]
    below = "time since the touch [s]"
    desired = np.where(record["phase"] == CONTACT, record["force_desired"], np.nan)[in_window]
    forces = [
        Series(since, record["force_measured"][in_window], "measured", "reading", 0.8),
        Series(since, record["force"][in_window], "F", "true"),
        Series(since, desired, label="desired", **KNOWN),
    ]
    speed = Series(since, 1e3 * record["speed"][in_window], "ink", width=0.9)
    true = Series(
        since,
        _true_stiffness(record)[in_window],
        label="truth, with respect to the measured position",
        **KNOWN,
    )
    bound = Series(since, record["bound"][in_window], "K", "K_u, the law's upper bound")
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


def _true_stiffness(record: Record) -> Array:
    """K as the measured position feels it at each row [N/m]."""
    surface, loop = record.meta["experiment"]["surface"], record.meta["loop"]
    since = record["t"] - record["t"][np.argmax(record["phase"] == CONTACT)]
    later = surface["later"] or surface["stiffness"]
    stiffness = np.where(since < surface["changes"], surface["stiffness"], later)
    return stiffness / (1.0 + stiffness / loop["series"]) if loop["kind"] == "position" else stiffness
