"""A run's summary as tables, for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.identification.result import Identification
from palpate.report.identification.words import CALLED
from palpate.report.numbers import NONE, plain, quantity, with_half
from palpate.report.page import Table
from palpate.report.run.words import alerts, settling


def tables(summary: dict[str, Any], found: Identification | None) -> list[Table]:
    """The tables of a run: the force, the surface, the thesis' columns."""
    if summary["force"] is None:
        return []
    own = []
    if found is not None:
        title = f"Surface, by palpate identify: {found.model}"
        own = [surface_table(title, found.to_json()["parameters"], summary["truth"])]
    return [Table("Force", ("", "value"), force_rows(summary)), *own, thesis_table(summary)]


def notes(summary: dict[str, Any]) -> list[str]:
    """Warnings of the table."""
    return [alert_line(alert) for alert in alerts(summary)]


def alert_line(alert: Mapping[str, str]) -> str:
    """A warning's title, text and advice on one line."""
    return " ".join(part for part in (alert["title"], alert["text"], alert["advice"]) if part)


def force_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """How the force went, a number a row."""
    f, tip = summary["force"], summary["tip"]
    return [
        ("contact at", f"{summary['contact_at_s']:.3f} s"),
        ("desired at the end", f"{f['desired_N']:.2f} N"),
        ("error, mean over the last second", f"{f['error_N']:+.3f} N"),
        ("standard deviation in it", f"{f['std_N']:.3f} N"),
        ("error since contact, RMS", f"{f['rms_error_N']:.3f} N"),
        ("settling to 5 %", settling(f)),
        ("overshoot", NONE if f["overshoot_N"] is None else f"{f['overshoot_N']:.2f} N"),
        ("noise of the measured force", f"{f['measured_std_N']:.3f} N"),
        ("tip off in y", f"{tip['y_error_mm']:+.2f} mm"),
        ("angular error of the tip", f"{tip['phi_error_deg']:+.2f}°"),
    ]


def surface_table(title: str, found: Mapping[str, Any], truth: Mapping[str, Any]) -> Table:
    """Parameters of `palpate identify` for a record, as its JSON has them, beside the simulation's own."""
    rows, names = [], {"K", "B", "M", *truth}
    for name, p in found.items():
        if p["value"] is None and name not in names:
            continue
        low, high = p["ci95"] or (0.0, 0.0)
        number = "no number" if p["value"] is None else quantity(p["value"], p["unit"], (high - low) / 2)
        known = quantity(truth[name]["value"], p["unit"], digits=4) if name in truth else NONE
        called = f"{name}, {CALLED[name]}" if name in CALLED else name
        rows.append((called, number, p["verdict"], next(iter(p["budget"]), NONE), known))
    return Table(title, ("", "95 %", "verdict", "limited by", "truth"), rows)


def thesis_table(summary: dict[str, Any]) -> Table:
    """The estimators on line at the end, fed in three ways."""
    found, truth = summary["identified"], summary["truth"]
    names = {"K": "K [N/m]", "B": "B [N s/m]", "M": "M [kg]"}
    ratio = found["force_over_displacement"]
    own = found.get("identifier")
    rows = [
        (
            label,
            plain(found["thesis"][name]),
            plain(found["raw"][name]),
            with_half(found["matched"][name], 1.96 * found["matched_std"][name]),
            *([] if own is None else [_own(own[name], found["identifier_std"][name])]),
            plain(ratio.get(name)),
            plain(truth[name]["value"]) if name in truth else NONE,
        )
        for name, label in names.items()
    ]
    more = () if own is None else ("[identifier], 95 %",)
    head = ("", "thesis", "raw", "matched, 95 %", *more, "f / x", "truth")
    return Table(
        "On line, if it is a spring: least squares on the thesis' signals, raw, and matched in lag",
        head,
        rows,
    )


def _own(value: float | None, std: float | None) -> str:
    """Estimates of the experiment's own identifier."""
    if value is None or std is None:
        return plain(value)
    return with_half(value, 1.96 * std)
