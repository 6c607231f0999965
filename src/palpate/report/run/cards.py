"""The force of a run or a press, a card a number."""

from __future__ import annotations

from typing import Any

from palpate.report.answer import Card
from palpate.report.numbers import plain
from palpate.text import printable


def force_cards(summary: dict[str, Any]) -> list[Card]:
    """Contact, settling, overshoot and error, of a summary whose contact was made."""
    f = summary["force"]
    cards = [_contact(summary), _settling(f)]
    if f["overshoot_N"] is not None:
        fraction = 100 * f["overshoot_N"] / abs(f["desired_N"]) if f["desired_N"] else 0.0
        cards.append(Card("Overshoot", plain(f["overshoot_N"], 2), "N", why=f"{fraction:.0f} % of the step"))
    error = f"{f['error_N']:+.2f}".replace("-", "\N{MINUS SIGN}")
    why = f"RMS since contact {plain(f['rms_error_N'], 2)} N"
    return [*cards, Card("Error, last second", error, "N", why=why)]


def _contact(summary: dict[str, Any]) -> Card:
    kept = not summary["contacts_lost"] and summary["end"] not in {"lost contact", "diverged"}
    why = f"from {summary['contact_at_s']:.2f} s on" if kept else printable(summary["why"])
    return Card("Contact", "kept" if kept else "lost", why=why, tone="ok" if kept else "fail")


def _settling(force: dict[str, Any]) -> Card:
    if force["settling_s"] is not None:
        return Card("Settled in", plain(force["settling_s"], 3), "s", why="within 5 % of the first force")
    if force["overshoot_N"] is None:
        return Card("Settled in", why="of a changing force there is none")
    if force["ringing"] is None:
        return Card("Settled in", why="not within the run", tone="fail")
    amplitude, hertz = (plain(force["ringing"][key], 2) for key in ("amplitude_N", "frequency_Hz"))
    return Card(
        "Rings by", f"± {amplitude}", "N", why=f"at {hertz} Hz; it did not settle within 5 %", tone="fail"
    )
