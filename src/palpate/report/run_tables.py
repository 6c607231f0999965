"""A run's summary as tables, for the terminal and for the page."""

from __future__ import annotations

from typing import Any

from palpate.report.numbers import NONE, plain, with_half
from palpate.report.page import Table


def tables(summary: dict[str, Any]) -> list[Table]:
    """The tables of a run: force first, then what was identified."""
    if summary["force"] is None:
        return []
    return [_force(summary), _identified(summary)]


def notes(summary: dict[str, Any]) -> list[str]:
    """What a reader must not miss."""
    advice = {"no contact": "; move the wall, or give the run more time ([run] duration)"}
    end = summary["end"]
    found = [] if end == "done" else [f"{end}: {summary['why']}{advice.get(end, '')}."]
    if summary["contacts_lost"] and end != "lost contact":
        found.append(f"Contact was lost {summary['contacts_lost']} times.")
    worst, share = max(summary["saturated"].items(), key=lambda item: item[1])
    if share > 0.01:
        found.append(f"The motor of {worst} was at its torque limit in {100 * share:.1f} % of the ticks.")
    return found


def _force(summary: dict[str, Any]) -> Table:
    f, tip = summary["force"], summary["tip"]
    never = NONE if f["overshoot_N"] is None else "not within the run"
    settling = never if f["settling_s"] is None else f"{f['settling_s']:.3f} s"
    return Table(
        "Force",
        ("", "value"),
        (
            ("contact at", f"{summary['contact_at_s']:.3f} s"),
            ("desired at the end", f"{f['desired_N']:.2f} N"),
            ("error, last second", f"{f['error_N']:+.3f} ± {f['std_N']:.3f} N"),
            ("error since contact, RMS", f"{f['rms_error_N']:.3f} N"),
            ("settling to 5 %", settling),
            ("overshoot", NONE if f["overshoot_N"] is None else f"{f['overshoot_N']:.2f} N"),
            ("noise of the measured force", f"{f['measured_std_N']:.3f} N"),
            ("tip off in y", f"{tip['y_error_mm']:+.2f} mm"),
            ("tip off in angle", f"{tip['phi_error_deg']:+.2f}°"),
        ),
    )


def _identified(summary: dict[str, Any]) -> Table:
    found, truth = summary["identified"], summary["truth"]
    names = {"K": "K [N/m]", "B": "B [N s/m]", "M": "M [kg]"}
    ratio = found["force_over_displacement"]
    rows = []
    for name, label in names.items():
        half = 1.96 * found["matched_std"][name]
        rows.append(
            (
                label,
                plain(found["thesis"][name]),
                plain(found["raw"][name]),
                with_half(found["matched"][name], half),
                found["matched_verdict"][name],
                plain(ratio.get(name)),
                plain(truth[name]["value"]) if name in truth else NONE,
            )
        )
    head = ("", "thesis", "raw", "matched, 95 %", "verdict", "f / x", "truth")
    return Table(
        "The surface, by recursive least squares on the thesis' signals, on raw ones, and on matched channels",
        head,
        rows,
    )
