"""The summary of a run in a sentence, warnings and tables, for the terminal and for the page."""

from collections.abc import Mapping, Sequence
from typing import Any

from palpate.identification.result import Identification
from palpate.report.identification.words import CALLED, CAUSES
from palpate.report.page import Answer, Table
from palpate.signals.types import NORMAL
from palpate.units import NONE, plain, quantity, with_half

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
    contact, desired, ring = _contact(summary), plain(force["desired_N"], 3), ringing(force)
    if force["settling_s"] is not None:
        side = "below" if force["error_N"] < 0 else "above"
        outcome = (
            f"The force settled within 5 % in {plain(force['settling_s'], 3)} s and ended "
            f"{abs(force['error_N']):.2f} N {side} the desired {desired} N"
        ) + (f", where it {ring}" if ring else "")
    elif force["overshoot_N"] is None:
        outcome = f"The force had an error of {plain(force['rms_error_N'], 2)} N (RMS) since contact"
    else:
        outcome = f"The force did not settle at {desired} N: it {ring or 'does not stay within 5 %'}"
    at_limit = _at_limit(summary)
    if at_limit:
        outcome += f"; the motor of {at_limit[0]} was at its limit in {at_limit[1]} of the ticks"
    return (
        f"{outcome}; {contact}." if end not in _FAILED else f"{contact.capitalize()}. {outcome} until then."
    )


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
    warnings = []
    end = summary["end"]
    if end != "done":
        tone = "fail" if end in _FAILED or end == "no contact" else "warn"
        text, advice = f"{summary['why'].removeprefix(f'{end} ')}.", _ADVICE.get(end, "")
        warnings.append({"tone": tone, "title": f"{end.capitalize()}:", "text": text, "advice": advice})
    if summary["contacts_lost"] and end != "lost contact":
        times = summary["contacts_lost"]
        text = f"{times} time{'s' if times > 1 else ''}."
        warnings.append(
            {"tone": "fail", "title": "Contact was lost", "text": text, "advice": _ADVICE["lost contact"]}
        )
    at_limit = _at_limit(summary)
    if at_limit:
        title = f"The motor of {at_limit[0]} was at its torque limit"
        text, advice = f"in {at_limit[1]} of the ticks.", "Ask for less force, or lower the gain."
        warnings.append({"tone": "warn", "title": title, "text": text, "advice": advice})
    ring = summary["force"] and ringing(summary["force"])
    if ring:
        settled = summary["force"]["settling_s"] is not None
        advice = "Lower the gain; palpate tune finds one that is proved stable."
        tone = "warn" if settled else "fail"
        warnings.append({"tone": tone, "title": f"The force {ring}.", "text": "", "advice": advice})
    return sorted(warnings, key=lambda alert: alert["tone"] != "fail")


def tables(summary: dict[str, Any], identification: Identification | None) -> list[Table]:
    """The tables of a run: the force, the surface, the thesis' columns."""
    if summary["force"] is None:
        return []
    surface = []
    if identification is not None:
        title = f"Surface, by palpate identify: {identification.model}"
        surface = [surface_table(title, identification.to_json()["parameters"], summary["truth"])]
    return [Table("Force", ("", "value"), force_rows(summary)), *surface, thesis_table(summary)]


def build_answer(title: str, summary: dict[str, Any], run_tables: Sequence[Table]) -> Answer:
    """The answer of a run, with the tables that its terminal shows."""
    context = f", seed {summary['seed']}, {summary['duration_s']:.1f} s simulated\n"
    return Answer(
        summary, title, context=context, sentence=sentence(summary), tables=run_tables, notes=notes(summary)
    )


def notes(summary: dict[str, Any]) -> list[str]:
    """Warnings of the table."""
    return [alert_line(alert) for alert in alerts(summary)]


def alert_line(alert: Mapping[str, str]) -> str:
    """A warning's title, text and advice on one line."""
    return " ".join(part for part in (alert["title"], alert["text"], alert["advice"]) if part)


def force_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Numbers of the force, one a row."""
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
        ("error of the tip in y", f"{tip['y_error_mm']:+.2f} mm"),
        ("angular error of the tip", f"{tip['phi_error_deg']:+.2f}°"),
    ]


def surface_table(title: str, parameters: Mapping[str, Any], truth: Mapping[str, Any]) -> Table:
    """Parameters of `palpate identify` for a record, as its JSON has them, beside the simulation's own."""
    rows, names = [], {"K", "B", "M", *truth}
    for name, p in parameters.items():
        if p["value"] is None and name not in names:
            continue
        low, high = p["ci95"] or (0.0, 0.0)
        number = "no number" if p["value"] is None else quantity(p["value"], p["unit"], (high - low) / 2)
        known = quantity(truth[name]["value"], p["unit"], digits=4) if name in truth else NONE
        called = f"{name}, {CALLED[name]}" if name in CALLED else name
        cause = next(iter(p["budget"]), NONE)
        rows.append((called, number, p["verdict"], CAUSES.get(cause, cause), known))
    return Table(title, ("", "95 %", "verdict", "limited by", "truth"), rows)


def thesis_table(summary: dict[str, Any]) -> Table:
    """The estimators on line at the end, fed in three ways."""
    estimates, truth = summary["identified"], summary["truth"]
    names = {"K": "K [N/m]", "B": "B [N s/m]", "M": "M [kg]"}
    ratio = estimates["force_over_displacement"]
    identifier = estimates.get("identifier")
    rows = [
        (
            label,
            plain(estimates["thesis"][name]),
            plain(estimates["raw"][name]),
            with_half(estimates["matched"][name], NORMAL * estimates["matched_std"][name]),
            *(
                []
                if identifier is None
                else [_with_interval(identifier[name], estimates["identifier_std"][name])]
            ),
            plain(ratio.get(name)),
            plain(truth[name]["value"]) if name in truth else NONE,
        )
        for name, label in names.items()
    ]
    column = () if identifier is None else ("[identifier], 95 %",)
    head = ("", "thesis", "raw", "matched, 95 %", *column, "f / x", "truth")
    return Table(
        "On-line estimates (spring-damper-mass model): least squares on the thesis' signals, raw, and matched in lag",
        head,
        rows,
    )


def _with_interval(value: float | None, std: float | None) -> str:
    """Estimates of the experiment's identifier identifier."""
    if value is None or std is None:
        return plain(value)
    return with_half(value, NORMAL * std)
