"""An identification in words: the sentence, then each number and its limits."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.contact_frame.arm import LOWER_BOUND
from palpate.files import RECORD
from palpate.identification.causes import BRIEF_CONTACT, Cause, Code, cause_of
from palpate.identification.result import Identification, WorkingPoint
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.text import printable
from palpate.units import plain, quantity, quantity_between, with_half

CALLED = {
    "K": "stiffness",
    "B": "damping",
    "M": "mass",
    "E": "Young's modulus",
    "K1": "second stiffness",
    "tau": "relaxation time",
    "n": "exponent",
    "mu": "friction coefficient",
    "Fc": "Coulomb friction",
    "x0": "place of the surface",
}
STYLES = {Verdict.IDENTIFIED: "green", Verdict.NOT_IDENTIFIABLE: "yellow", Verdict.REJECTED: "red"}
MARKS = {Verdict.IDENTIFIED: "✓", Verdict.NOT_IDENTIFIABLE: "?", Verdict.REJECTED: "✕"}
TONES = {Verdict.IDENTIFIED: "ok", Verdict.NOT_IDENTIFIABLE: "warn", Verdict.REJECTED: "fail"}
"""Colours of a verdict on a terminal, its mark, and its class on a page."""
NO_NUMBER = "no number"

ADVICE = {
    Code.PAYLOAD_DOUBTFUL: "Weigh the tool again with palpate payload; tare the sensor in free motion before a press.",
    Code.FORCE_LAGS_POSITION: "Measure the lag, by a knock on something stiff or with a known mass, and give --lag.",
    Code.LAG_DAMPING_CONFOUNDED: "Give a measured --lag, or press again with more frequencies, such as a chirp.",
    Code.SERIES_COMPLIANCE: "Measure the position nearer to the surface, or calibrate what lies between more closely.",
    Code.LOW_EXCITATION: "Press faster, deeper or more often; for a mass, shake the probe in contact.",
    Code.NONLINEAR_STIFFNESS: "Use K only near the mean position.",
    Code.HELD_SAMPLES: "None; a log at the sensor's own rate would be as good.",
    Code.MISSING_SAMPLES: "Check the log where readings are missing; give other marks of no reading with --missing.",
    Code.IRREGULAR_TIME: "Log with the sensor's own clock if you can.",
    Code.SATURATED: "Press less, or use a sensor of a larger range.",
    Code.UNIT_GUESS: "Say the units, as in --position position_mm:mm.",
    Code.SIGNALS_GUESSED: "Identify again by the printed command, with the right columns, units and axes.",
    Code.UNIT_DOUBTFUL: "Correct the unit; or name the column by its number, if its name is wrong.",
    Code.FORCE_DRIFTS: "Let the sensor warm up and tare it; it is removed as far as the log shows it.",
    Code.FORCE_DROPS: "None, if it breaks; to identify what is left, give --start.",
    Code.FORCE_FLOWS: "Press at other speeds for its damping; a fluid has no stiffness.",
    Code.FORCE_RIPPLES: "Remove its cause, such as mains, vibration or interference; or record more free motion.",
    Code.TOOL_INERTIA: "None, if the tool moves beyond the sensor; below zero: correct its compensation.",
    Code.FORCE_SIGN_REVERSED: "None, if the column is the right one.",
    Code.POSITION_SIGN_REVERSED: "None, if the column is the right one.",
    Code.LOW_RATE: "Log faster: damping and mass need it first.",
    Code.NO_CONTACT: "Check the column of the force; say --bonded if the probe is fixed to the surface.",
    Code.CONTACT_AT_START: "Begin the log a second before the touch.",
    Code.NEGATIVE_STIFFNESS: "Check the signs and the columns.",
    Code.CLOCKS_DISAGREE: "Stamp both topics with one clock, or measure the lag between them and give --lag.",
    Code.LOG_CUT_SHORT: "None, if the contacts are whole; else record again and close the bag.",
    Code.UNIT_STATED: "None, if the file is right; else say the unit, as in --force force_mN:mN.",
    Code.TIME_DOUBTFUL: "Say the unit of the time, as --time t:ms, or give --rate.",
    Code.LINES_SKIPPED: "Look at these lines; if they are rows, correct them and identify again.",
    Code.COLUMNS_SWAPPED: "Check --position and --force-column; exchange them if they are swapped.",
    Code.FRAME_GUESS: "Say it with --wrench-frame.",
    Code.NORMAL_UNCERTAIN: "Give the contact's normal, or press harder along it and slide less.",
}
"""The remedy of a warning."""

UNTOUCHED = "Nothing is touched in this log"
CAUSES = {
    "other forces": "drift or friction",
    "blocks": "parts of the log differ",
    "repetition": "parts of the log differ",
    "loadings": "loadings differ",
    "octaves": "frequencies differ",
    "touch": "the touch",
    "unseen way": "the first reading",
}
"""Causes whose names in a budget need an explanation."""
FLOWS = "What is touched flows: its force follows the speed and is gone at rest, so it has no stiffness."


def sentence(result: Identification) -> str:
    """A break, the stiffness, its place, its largest cause of uncertainty, the next step; of a slide its friction."""
    breaks = [f"{warn.text}." for warn in result.warnings if warn.code is Code.FORCE_DROPS]
    if result.slide is not None:
        answer = result.slide.sentence
    else:
        answer = FLOWS if Code.FORCE_FLOWS.word in result.codes else _sentence_of_contact(result)
    return " ".join([*breaks, answer])


def _sentence_of_contact(result: Identification) -> str:
    """The stiffness of a contact, or why there is none."""
    if not result.contacts:
        return f"{no_contact_in('this log', result)}."
    point = result.working_point
    if point is None:
        K = result.parameters.get("K")
        if K is not None and K.verdict is Verdict.IDENTIFIED:
            return _stiffness_of_model(result.model, K)
        return "The log shows no stiffness: no stretch in contact is long enough; log longer or press deeper."
    stiffness, where = point.stiffness, point_place(result, point)
    if behind_the_arm(result):
        return (
            f"The stiffness of surface and arm in series is {full_number(stiffness)} {where}, a lower bound of the"
            " surface's: give --robot-stiffness."
        )
    limit = limited_by(result)
    by_model = _stiffness_of_model(result.model, result.parameters["K"]) if by_the_model(result) else ""
    if by_model:
        return (
            by_model
            if stiffness.value is None
            else f"{by_model} Without a model it is {full_number(stiffness)} {where}."
        )
    if point.differs:
        return f"{len(point.each)} presses differ, {each_press(point)} {where}; {APART}."
    if stiffness.value is None or stiffness.ci95 is None or stiffness.ci95[0] <= 0 <= stiffness.ci95[1]:
        lost = loss_words(result, point)
        start = f"The log shows {lost}, but no stiffness" if lost else "The log shows no stiffness"
        return f"{start} {where} ({stiffness.reason}); {limit.remedy}."
    if stiffness.ci95[1] < 0 and stiffness.verdict is not Verdict.IDENTIFIED:
        number = quantity(-stiffness.value, stiffness.unit, (stiffness.ci95[1] - stiffness.ci95[0]) / 2)
        return (
            f"The force falls by {number} as the probe goes in, {where}: either the surface yields, or it moves, and"
            " then this is the stiffness of the probe's own support."
        )
    only = (
        ""
        if stiffness.verdict is Verdict.IDENTIFIED
        else f", known to {_relative_half_width(stiffness)} only,"
    )
    return f"The stiffness is {full_number(stiffness)}{only} {where}; {_mostly(limit)}."


APART = "to identify one alone, give --start and --end"
_MAX_PRESSES = 5


def each_press(point: WorkingPoint) -> str:
    """The stiffness of each press, in the order of time; of many, of the first."""
    ending = ", ..." if len(point.each) > _MAX_PRESSES else ""
    return ", ".join(quantity(value, point.stiffness.unit) for value in point.each[:_MAX_PRESSES]) + ending


def _stiffness_of_model(model: str, stiffness: Parameter) -> str:
    limit = cause_of(next(iter(stiffness.budget), None))
    return f"By the model {model} the stiffness is {full_number(stiffness)}; {_mostly(limit)}."


def _mostly(limit: Cause) -> str:
    return f"its uncertainty is mostly due to {limit.described}: {limit.remedy}"


def loss_words(result: Identification, point: WorkingPoint) -> str:
    """The loss at the working point's octave, in words; "" if it is not significant."""
    octave = next(
        (octave for octave in result.dynamic_stiffness if octave.frequency == point.frequency_Hz), None
    )
    if point.source != "octave" or octave is None or not octave.loss_half < octave.loss:
        return ""
    return f"a loss of {quantity(octave.loss, point.stiffness.unit, octave.loss_half)}"


def point_place(result: Identification, point: WorkingPoint) -> str:
    """`at 13 N, 2.4 mm deep and 0.57 Hz`; a depth of zero is the middle of the motion."""
    force, depth, frequency = point_facts(result, point)
    deep = " deep" if point.from_surface and point.depth_m > 0 else " from the middle of the motion"
    if not point.from_surface and point.depth_m == 0:
        return f"at {force}, in the middle of the motion and at {frequency}"
    return f"at {force}, {depth}{deep} and {frequency}"


def point_facts(result: Identification, point: WorkingPoint) -> tuple[str, str, str]:
    """Force, depth and frequency of the working point, with their units."""
    force, position = force_and_depth_units(result)
    return (
        quantity(point.force_N, force),
        quantity(abs(point.depth_m), position),
        f"{plain(point.frequency_Hz, 2)} Hz",
    )


def force_and_depth_units(result: Identification) -> tuple[str, str]:
    """Units of force and position of the log."""
    if result.traces is not None:
        return result.traces.force_unit, result.traces.position_unit
    return ("1", "1") if any(p.unit == "1" for n, p in result.parameters.items() if n == "K") else ("N", "m")


def work_loss(fraction: float) -> str:
    """A sentence about the lost share of the work of a press."""
    if fraction < 0:
        return (
            f"{-100 * fraction:.2g} % more work comes back than was put in: the force is probably read late"
        )
    return f"{100 * fraction:.2g} % of the work of loading is lost"


def press_facts(result: Identification) -> list[str]:
    """Sentences on the press: the slope at each force, the lost work, the relaxation."""
    press, point = result.press, result.working_point
    if press is None:
        return []
    force, stiffness = force_and_depth_units(result)[0], point.stiffness.unit if point else "1"
    slopes = [
        f"{quantity(t.stiffness, stiffness, t.half)} at {quantity(t.force, force)}" for t in press.tangent
    ]
    facts = [f"Slope by force: {', '.join(slopes)}."] if slopes else []
    if press.hysteresis_loss is not None:
        facts.append(f"{work_loss(press.hysteresis_loss)}.")
    if press.pull_off is not None:
        facts.append(
            f"The surface holds the leaving probe with up to {quantity(press.pull_off, force)} (adhesion)."
        )
    if press.relaxation is not None:
        relaxation = press.relaxation
        relaxed = f"{100 * relaxation.share:.2g} % of the force relaxes"
        facts.append(
            f"{relaxed} in {relaxation.duration:.3g} s, half of that in {relaxation.half_time:.2g} s."
        )
    return facts


def limited_by(result: Identification) -> Cause:
    """Largest cause of the working point's interval."""
    point = result.working_point
    assert point is not None
    return cause_of(next(iter(point.stiffness.budget), None), point.source)


def reasons(result: Identification) -> list[str]:
    """Reasons of parameters that are not identified, and the warnings, each with its name."""
    parameters = [
        f"{name}: {p.reason}"
        for name, p in result.parameters.items()
        if p.verdict is not Verdict.IDENTIFIED or name == "E"
    ]
    return [*parameters, *(f"{warn.code.word}: {warn.text}" for warn in result.warnings)]


def subtitle(result: Identification) -> str:
    """The model and the quality of its fit, in one line."""
    if not result.n:
        return "no contact"
    if result.slide is not None:
        return " ".join(result.slide.facts)
    count = len(result.contacts)
    force = force_and_depth_units(result)[0]
    parts = [
        f"{result.model}, R² {result.r2:.4f}",
        f"rms misfit {quantity(result.rmse, force)}",
        f"{result.n} samples of {count} contact{'s' * (count != 1)}",
        f"filters {plain(result.cutoff, 3)} Hz",
    ]
    if result.lag:
        parts.append(describe_lag(result))
    return ", ".join(parts)


def describe_lag(result: Identification) -> str:
    """The lag of the force and its source."""
    lag = result.lag
    if lag is None:
        return "no lag known"
    value = with_half(1e3 * lag.value, 1e3 * lag.bound) if lag.bound else plain(1e3 * lag.value, 3)
    who = {"told": "as given", "measured": "measured in this log", "prior": "assumed, typical of sensors"}
    return f"force late by {value} ms ({who.get(lag.kind, lag.kind)})"


def number(p: Parameter) -> str:
    """A parameter's value and the half-width of its 95 % interval; or that there is none."""
    if p.value is None:
        return NO_NUMBER
    return with_half(p.value, (p.ci95[1] - p.ci95[0]) / 2) if p.ci95 else plain(p.value)


def full_number(p: Parameter) -> str:
    """A parameter's value, half-width and unit; or that there is none."""
    if p.value is None:
        return NO_NUMBER
    return quantity(p.value, p.unit, (p.ci95[1] - p.ci95[0]) / 2 if p.ci95 else None, 4)


def interval(ends: tuple[float, float] | None, unit: str) -> str:
    """The ends of an interval with their unit; nothing if there is none."""
    return "" if ends is None else quantity_between(*ends, unit)


def advice(code: Code) -> str:
    """The remedy of a warning; its meaning, if it has none."""
    return ADVICE.get(code, code.value)


def unit(p: Parameter) -> str:
    """A unit as it is shown: nothing for plain numbers."""
    return "" if p.unit == "1" else p.unit


def _relative_half_width(p: Parameter) -> str:
    if p.value is None or p.ci95 is None or not p.value:
        return "?"
    return f"{50 * (p.ci95[1] - p.ci95[0]) / abs(p.value):.2g} %"


UNIT_WARNINGS = (
    Code.SIGNALS_GUESSED,
    Code.UNIT_DOUBTFUL,
    Code.TIME_DOUBTFUL,
    Code.COLUMNS_SWAPPED,
    Code.UNIT_GUESS,
)
"""Warnings by which the answer may be in another unit, or of another column; a guess is one until it is stated."""


def unit_warnings(result: Identification) -> list[str]:
    """The warnings that ask for a unit or a column to be corrected, the first of each kind of sentence."""
    return [warn.text for code in UNIT_WARNINGS for warn in result.warnings if warn.code is code]


def behind_the_arm(result: Identification) -> bool:
    """True if the stiffness includes the arm's compliance, and so is a lower bound of the surface's."""
    K = result.parameters.get("K")
    return Code.SERIES_COMPLIANCE.word in result.codes and K is not None and K.reason.startswith(LOWER_BOUND)


def by_the_model(result: Identification) -> bool:
    """True if a model of constant stiffness identifies K, and the working point does not, or by the lag's prior alone.

    A lag moves the storage of an octave with its frequency; the model's K rests on the slowest motion as well.
    """
    K, point = result.parameters.get("K"), result.working_point
    constant = result.model in ("kelvin-voigt", "kelvin-voigt-mass")
    if K is None or point is None or not constant or K.verdict is not Verdict.IDENTIFIED:
        return False
    stiffness = point.stiffness
    late = point.source == "octave" and next(iter(stiffness.budget), "") == "lag" != next(iter(K.budget), "")
    return stiffness.verdict is not Verdict.IDENTIFIED or (late and (K.std or 0.0) < (stiffness.std or 0.0))


def no_contact_in(log: str, result: Identification) -> str:
    """The reason why a log has no contact."""
    text = next((warn.text for warn in result.warnings if warn.code is Code.NO_CONTACT), "")
    if text.startswith(BRIEF_CONTACT):
        return f"The contacts in {log} are too short: {text.replace(':', ';')}"
    reason = text.partition(":")[0].rstrip(".") or "the force does not leave its rest"
    return f"{UNTOUCHED.replace('this log', log)}: {reason}"


_CHUNK = 1 << 20


@dataclass(frozen=True)
class Source:
    """Origin of an identification: log, options, command.

    Args:
        file: the log, as it was named.
        options: what was said about it, as plain values.
        sha256: of the log; of a folder, of its files in the order of their names.
        command: that made the identification.
        made: when, in ISO 8601.
        notes: lines on how the log was read, such as the frame that a wrench was turned into.
        guessed: `{"command", "guesses"}` if columns, units or axes were guessed.
    """

    file: str
    options: dict[str, Any] = field(default_factory=dict)
    sha256: str | None = None
    command: str = "palpate identify"
    made: str | None = None
    notes: tuple[str, ...] = ()
    guessed: Mapping[str, Any] | None = None

    @property
    def title(self) -> str:
        """The log's own name, a run's with its folder, without characters that a page or a terminal would obey."""
        path = Path(self.file)
        name = f"{path.parent.name}/{path.name}" if path.name == RECORD else path.name
        return printable(name.removeprefix("/") or self.file)


def as_json(result: Identification, source: Source) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for one log; a unit in doubt identifies nothing."""
    from importlib.metadata import version

    values = result.to_json()
    if doubts := unit_warnings(result):
        point = values["working_point"]
        for parameter in [*values["parameters"].values(), *([point["stiffness"]] if point else [])]:
            if parameter["verdict"] == Verdict.IDENTIFIED:
                parameter |= {"verdict": str(Verdict.NOT_IDENTIFIABLE), "reason": f"in doubt: {doubts[0]}"}
    return {
        "file": source.file,
        **values,
        "guessed": source.guessed,
        "options": {**source.options, **values["options"]},
        "sha256": source.sha256,
        "version": version("palpate"),
    }


def file_digest(path: Path) -> str:
    """Digest of a file, of the book of a sheet, or of all files of a folder in the order of their names."""
    total = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    files = [path.parent] if path.parent.is_file() else files  # a sheet of a book
    for name in files:
        with name.open("rb") as file:
            while chunk := file.read(_CHUNK):
                total.update(chunk)
    return total.hexdigest()
