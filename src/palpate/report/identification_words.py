"""What an identification says, in words: a headline, what each parameter is, what to do about a warning."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.identification.result import Identification, Parameter, Verdict
from palpate.identification.warning_codes import Code
from palpate.report.numbers import plain, with_half

CALLED = {
    "K": "stiffness",
    "B": "damping",
    "M": "mass",
    "K1": "second stiffness",
    "K2": "quadratic stiffness",
    "K3": "cubic stiffness",
    "tau": "relaxation time",
    "n": "exponent",
    "Fc": "Coulomb friction",
    "x0": "place of the surface",
}
MARKS = {Verdict.IDENTIFIED: "✓", Verdict.NOT_IDENTIFIABLE: "?", Verdict.REJECTED: "✕"}
NO_NUMBER = "no number"

ADVICE = {
    Code.FORCE_LAGS_POSITION: "Measure the lag, by a knock on something stiff or with a known mass, and give --lag.",
    Code.LAG_DAMPING_CONFOUNDED: "Give a measured --lag, or press again with a wider band, as a chirp has it.",
    Code.SERIES_COMPLIANCE: "Measure the position nearer to the surface, or calibrate what lies between more closely.",
    Code.LOW_EXCITATION: "Press faster, deeper or more often; for a mass, shake the probe in contact.",
    Code.MODEL_REJECTED: "Take no number here for a constant of the surface; try a stretch of it (--start, --end).",
    Code.NONLINEAR_STIFFNESS: "Use K only near the mean position, and K2 and K3 with it elsewhere.",
    Code.HELD_SAMPLES: "Nothing; a log at the sensor's own rate would be as good.",
    Code.MISSING_SAMPLES: "Check the log where readings are missing; name other marks of none with --missing.",
    Code.IRREGULAR_TIME: "Log with the sensor's own clock if you can.",
    Code.SATURATED: "Press less, or use a sensor of a larger range.",
    Code.UNIT_GUESS: "Say the units, as in --position position_mm:mm.",
    Code.FORCE_SIGN_REVERSED: "Nothing, if the column is the right one.",
    Code.POSITION_SIGN_REVERSED: "Nothing, if the column is the right one.",
    Code.LOW_RATE: "Log faster: damping and mass need it first.",
    Code.NO_CONTACT: "Check the column of the force; say --bonded if the probe is fixed to the surface.",
    Code.CONTACT_AT_START: "Begin the log a second before the touch.",
    Code.NEGATIVE_STIFFNESS: "Check the signs and the columns.",
    Code.CLOCKS_DISAGREE: "Stamp both topics with one clock, or measure the lag between them and give --lag.",
    Code.LOG_CUT_SHORT: "Nothing, if the contacts are whole; else record again and close the bag.",
    Code.FRAME_GUESS: "Say it with --wrench-frame.",
    Code.NORMAL_UNCERTAIN: "Give the contact's normal, or press harder along it and slide less.",
}
"""What to do about a warning."""


def headline(found: Identification) -> str:
    """The outcome in one sentence or two."""
    if not found.contacts or not found.n:
        return "Nothing is touched in this log."
    start = "No model describes this log. " if Code.MODEL_REJECTED.word in found.codes else ""
    said = [
        f"{listed([CALLED.get(name, name) for name in names])} {'is' if len(names) == 1 else 'are'} {verdict}"
        for verdict in Verdict
        if (names := [name for name, p in found.parameters.items() if p.verdict is verdict])
    ]
    text = "; ".join(said)
    return f"{start}{text[:1].upper()}{text[1:]}."


def subtitle(found: Identification) -> str:
    """The model and what its fit is worth, in one line."""
    if not found.n:
        return "no contact"
    count = len(found.contacts)
    parts = [
        f"{found.model}, R² {found.r2:.4f}",
        f"rms misfit {plain(found.rmse, 3)}{_of(_force_unit(found))}",
        f"{found.n} samples of {count} contact{'s' * (count != 1)}",
        f"filters {plain(found.cutoff, 3)} Hz",
    ]
    if found.lag:
        value, std = (1e3 * part for part in found.lag)
        parts.append(f"force late by {with_half(value, 1.96 * std) if std else plain(value)} ms")
    return ", ".join(parts)


def number(p: Parameter) -> str:
    """A parameter's value and the half-width of its 95 % interval; or that there is none."""
    if p.value is None:
        return NO_NUMBER
    return with_half(p.value, (p.ci95[1] - p.ci95[0]) / 2) if p.ci95 else plain(p.value)


def advice(code: Code) -> str:
    """What to do about a warning; what it means, where nobody has written that down."""
    return ADVICE.get(code, code.value)


def unit(p: Parameter) -> str:
    """A unit as it is shown: nothing for plain numbers."""
    return "" if p.unit == "1" else p.unit


def listed(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _force_unit(found: Identification) -> str:
    return found.traces.force_unit if found.traces else "1"


def _of(text: str) -> str:
    return "" if text == "1" else f" {text}"
