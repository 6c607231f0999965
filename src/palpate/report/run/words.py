"""A run in words: what came of it in a sentence, what failed, and what each number is."""

from __future__ import annotations

from typing import Any

from palpate.report.numbers import NONE, plain

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
    """Warnings, failures first."""
    found = []
    end = summary["end"]
    if end != "done":
        tone = "fail" if end in _FAILED or end == "no contact" else "warn"
        text, advice = f"{summary['why']}.", _ADVICE.get(end, "")
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
