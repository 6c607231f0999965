"""A run in words: what came of it in a sentence, what failed, and what each number is."""

from __future__ import annotations

from typing import Any

from palpate.report.numbers import plain

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
    contact = _contact(summary)
    if force["settling_s"] is None:
        went = f"The force had an error of {plain(force['rms_error_N'], 2)} N (RMS) since contact"
        if force["overshoot_N"] is not None:
            went = f"The force did not settle within 5 % of {plain(force['desired_N'], 3)} N"
    else:
        side = "below" if force["error_N"] < 0 else "above"
        went = (
            f"The force settled within 5 % in {plain(force['settling_s'], 3)} s and ended "
            f"{abs(force['error_N']):.2f} N {side} the {plain(force['desired_N'], 3)} N asked for"
        )
    return f"{went}; {contact}." if end not in _FAILED else f"{contact.capitalize()}. {went} until then."


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
    worst, share = max(summary["saturated"].items(), key=lambda item: item[1], default=("", 0.0))
    if share > 0.01:
        text = f"in {100 * share:.1f} % of the ticks."
        title = f"The motor of {worst} was at its torque limit"
        found.append({"tone": "warn", "title": title, "text": text, "advice": ""})
    return found


def motors(summary: dict[str, Any]) -> str:
    """Whether they were at their limits."""
    at = [name for name, share in summary["saturated"].items() if share > 0.0]
    if not at:
        return "never at their limits"
    return f"{', '.join(at)} at the limit for a moment or longer"
