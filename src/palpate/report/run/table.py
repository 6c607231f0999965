"""A run's summary as tables, for the terminal and for the page."""

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.identification.result import Identification
from palpate.report.identification.words import CALLED
from palpate.report.page import Card, CommandAnswer, Table
from palpate.signals.types import NORMAL
from palpate.text import printable
from palpate.units import NONE, plain, quantity, with_half


def force_cards(summary: dict[str, Any]) -> list[Card]:
    """Contact, settling, overshoot and error, of a summary whose contact was made."""
    f = summary["force"]
    cards = [_contact_card(summary), _settling(f)]
    if f["overshoot_N"] is not None:
        fraction = 100 * f["overshoot_N"] / abs(f["desired_N"]) if f["desired_N"] else 0.0
        cards.append(Card("Overshoot", plain(f["overshoot_N"], 2), "N", why=f"{fraction:.0f} % of the step"))
    error = f"{f['error_N']:+z.2f}".replace("-", "\N{MINUS SIGN}")
    why = f"RMS since contact {plain(f['rms_error_N'], 2)} N"
    return [*cards, Card("Error, last second", error, "N", why=why)]


def _contact_card(summary: dict[str, Any]) -> Card:
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


_FAILED = ("lost contact", "diverged")
_ADVICE = {
    "no contact": "Move the wall, or extend the run ([run] duration).",
    "lost contact": "Lower the gain or the learning rate, or approach more slowly.",
    "diverged": "Lower the gain or the learning rate.",
}


def sentence(summary: dict[str, Any]) -> str:
    """Outcome of the run."""
    force, end = summary["force"], summary["end"]
    if force is None:
        return f"The arm touched nothing: {summary['why']}."
    contact, asked, ring = _contact(summary), plain(force["desired_N"], 3), ringing(force)
    if force["settling_s"] is not None:
        side = "below" if force["error_N"] < 0 else "above"
        went = (
            f"The force settled within 5 % in {plain(force['settling_s'], 3)} s and ended "
            f"{abs(force['error_N']):.2f} N {side} the {asked} N asked for"
        ) + (f", where it {ring}" if ring else "")
    elif force["overshoot_N"] is None:
        went = f"The force had an error of {plain(force['rms_error_N'], 2)} N (RMS) since contact"
    else:
        went = f"The force did not settle at {asked} N: it {ring or 'does not stay within 5 %'}"
    at_limit = _at_limit(summary)
    if at_limit:
        went += f"; the motor of {at_limit[0]} was at its limit in {at_limit[1]} of the ticks"
    return f"{went}; {contact}." if end not in _FAILED else f"{contact.capitalize()}. {went} until then."


def ringing(force: dict[str, Any]) -> str:
    """The oscillation at the end, as a predicate; "" if there is none."""
    ring = force["ringing"]
    return (
        ""
        if ring is None
        else f"rings by ± {plain(ring['amplitude_N'], 2)} N at {plain(ring['frequency_Hz'], 2)} Hz"
    )


def settling(force: dict[str, Any]) -> str:
    """The time of settling, or why there is none."""
    if force["settling_s"] is not None:
        return f"{force['settling_s']:.3f} s"
    if force["overshoot_N"] is None:
        return NONE
    return ringing(force) or "not within the run"


def _at_limit(summary: dict[str, Any]) -> tuple[str, str] | None:
    """The motor that was most at its limit, and in what part of the ticks; None where no motor was for long."""
    worst, fraction = max(summary["saturated"].items(), key=lambda item: item[1], default=("", 0.0))
    return (worst, f"{100 * fraction:.1f} %") if fraction > 0.01 else None


def _contact(summary: dict[str, Any]) -> str:
    if summary["end"] in _FAILED:
        return f"the run ended early: {summary['why']}"
    lost = summary["contacts_lost"]
    return "contact was kept" if not lost else f"contact was lost {lost} time{'s' if lost > 1 else ''}"


def alerts(summary: dict[str, Any]) -> list[dict[str, str]]:
    """Warnings of a run, failures first."""
    found = []
    end = summary["end"]
    if end != "done":
        tone = "fail" if end in _FAILED or end == "no contact" else "warn"
        text, advice = f"{summary['why'].removeprefix(f'{end} ')}.", _ADVICE.get(end, "")
        found.append({"tone": tone, "title": f"{end.capitalize()}:", "text": text, "advice": advice})
    if summary["contacts_lost"] and end != "lost contact":
        times = summary["contacts_lost"]
        text = f"{times} time{'s' if times > 1 else ''}."
        found.append(
            {"tone": "fail", "title": "Contact was lost", "text": text, "advice": _ADVICE["lost contact"]}
        )
    at_limit = _at_limit(summary)
    if at_limit:
        title = f"The motor of {at_limit[0]} was at its torque limit"
        text, advice = f"in {at_limit[1]} of the ticks.", "Ask for less force, or lower the gain."
        found.append({"tone": "warn", "title": title, "text": text, "advice": advice})
    ring = summary["force"] and ringing(summary["force"])
    if ring:
        settled = summary["force"]["settling_s"] is not None
        advice = "Lower the gain; palpate tune finds one that is proved stable."
        tone = "warn" if settled else "fail"
        found.append({"tone": tone, "title": f"The force {ring}.", "text": "", "advice": advice})
    return sorted(found, key=lambda alert: alert["tone"] != "fail")


def motors(summary: dict[str, Any]) -> str:
    """Whether they were at their limits."""
    at = [name for name, share in summary["saturated"].items() if share > 0.0]
    if not at:
        return "never at their limits"
    return f"{', '.join(at)} at the limit for a moment or longer"


def tables(summary: dict[str, Any], found: Identification | None) -> list[Table]:
    """The tables of a run: the force, the surface, the thesis' columns."""
    if summary["force"] is None:
        return []
    own = []
    if found is not None:
        title = f"Surface, by palpate identify: {found.model}"
        own = [surface_table(title, found.to_json()["parameters"], summary["truth"])]
    return [Table("Force", ("", "value"), force_rows(summary)), *own, thesis_table(summary)]


def answer_of(title: str, summary: dict[str, Any], shown: Sequence[Table]) -> CommandAnswer:
    """The answer of a run, with the tables that its terminal shows."""
    head = f", seed {summary['seed']}, {summary['duration_s']:.1f} s simulated"
    return CommandAnswer(summary, title, f"{head}\n{sentence(summary)}", shown, notes(summary))


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
            with_half(found["matched"][name], NORMAL * found["matched_std"][name]),
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
    return with_half(value, NORMAL * std)
