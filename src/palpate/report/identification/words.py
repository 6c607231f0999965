"""An identification in words: the sentence, then each number and its limits."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.contact_frame.arm import LOWER_BOUND
from palpate.files import RECORD
from palpate.identification.causes import BRIEF, Cause, Code, cause_of
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
NO_NUMBER = "no number"

ADVICE = {
    Code.PAYLOAD_DOUBTFUL: "Weigh the tool again with palpate payload; tare the sensor in free motion before a press.",
    Code.FORCE_LAGS_POSITION: "Measure the lag, by a knock on something stiff or with a known mass, and give --lag.",
    Code.LAG_DAMPING_CONFOUNDED: "Give a measured --lag, or press again with a wider band, as a chirp has it.",
    Code.SERIES_COMPLIANCE: "Measure the position nearer to the surface, or calibrate what lies between more closely.",
    Code.LOW_EXCITATION: "Press faster, deeper or more often; for a mass, shake the probe in contact.",
    Code.NONLINEAR_STIFFNESS: "Use K only near the mean position.",
    Code.HELD_SAMPLES: "None; a log at the sensor's own rate would be as good.",
    Code.MISSING_SAMPLES: "Check the log where readings are missing; give other marks of no reading with --missing.",
    Code.IRREGULAR_TIME: "Log with the sensor's own clock if you can.",
    Code.SATURATED: "Press less, or use a sensor of a larger range.",
    Code.UNIT_GUESS: "Say the units, as in --position position_mm:mm.",
    Code.UNIT_DOUBTFUL: "Correct the unit; or name the column by its number, if its name is wrong.",
    Code.FORCE_DRIFTS: "Let the sensor warm up and tare it; it is removed as far as the log shows it.",
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


def sentence(found: Identification) -> str:
    """The stiffness, its place, its largest cause of uncertainty, and the next step; of a slide its friction."""
    if found.slide is not None:
        return found.slide.sentence
    if not found.contacts:
        return f"{no_contact_in('this log', found)}."
    point = found.working_point
    if point is None:
        return "The log shows no stiffness: no stretch in contact is long enough; log longer or press deeper."
    own, where = point.stiffness, place_of(found, point)
    if behind_the_arm(found):
        return (
            f"The stiffness of surface and arm in series is {full_number(own)} {where}, a lower bound of the surface's:"
            " give --robot-stiffness."
        )
    limit = limited_by(found)
    by_model = _known_by_model(found)
    if by_model is not None:
        return (
            by_model if own.value is None else f"{by_model} Without a model it is {full_number(own)} {where}."
        )
    if point.differs:
        return f"{len(point.each)} presses differ, {each_press(point)} {where}; {APART}."
    if own.value is None or own.ci95 is None or own.ci95[0] <= 0 <= own.ci95[1]:
        lost = loss_of(found, point)
        start = f"The log shows {lost}, but no stiffness" if lost else "The log shows no stiffness"
        return f"{start} {where} ({own.reason}); {limit.remedy}."
    if own.ci95[1] < 0 and own.verdict is not Verdict.IDENTIFIED:
        number = quantity(-own.value, own.unit, (own.ci95[1] - own.ci95[0]) / 2)
        return (
            f"The force falls by {number} as the probe goes in, {where}: either the surface yields, or it moves, and"
            " then this is the stiffness of the probe's own support."
        )
    only = "" if own.verdict is Verdict.IDENTIFIED else f", known to {_share(own)} only,"
    return f"The stiffness is {full_number(own)}{only} {where}; {_mostly(limit)}."


APART = "to identify one alone, give --start and --end"
_LISTED = 5


def each_press(point: WorkingPoint) -> str:
    """The stiffness of each press, in the order of time; of many, of the first."""
    more = ", ..." if len(point.each) > _LISTED else ""
    return ", ".join(quantity(own, point.stiffness.unit) for own in point.each[:_LISTED]) + more


def _known_by_model(found: Identification) -> str | None:
    """The stiffness of a model of one constant stiffness, where the working point is known less well."""
    if not by_the_model(found):
        return None
    K = found.parameters["K"]
    limit = cause_of(next(iter(K.budget), None))
    return f"By the model {found.model} the stiffness is {full_number(K)}; {_mostly(limit)}."


def _mostly(limit: Cause) -> str:
    return f"its uncertainty is mostly due to {limit.described}: {limit.remedy}"


def loss_of(found: Identification, point: WorkingPoint) -> str:
    """The loss, where the octave of the working point shows it: of a damper it is the answer."""
    own = next((o for o in found.dynamic_stiffness if o.frequency == point.frequency_Hz), None)
    if point.source != "octave" or own is None or not own.loss_half < own.loss:
        return ""
    return f"a loss of {quantity(own.loss, point.stiffness.unit, own.loss_half)}"


def place_of(found: Identification, point: WorkingPoint) -> str:
    """`at 13 N, 2.4 mm deep and 0.57 Hz`; a depth of zero is the middle of the motion."""
    force, depth, frequency = facts_of(found, point)
    deep = " deep" if point.from_surface and point.depth_m > 0 else " from the middle of the motion"
    if not point.from_surface and point.depth_m == 0:
        return f"at {force}, in the middle of the motion and at {frequency}"
    return f"at {force}, {depth}{deep} and {frequency}"


def facts_of(found: Identification, point: WorkingPoint) -> tuple[str, str, str]:
    """Force, depth and frequency of the working point, with their units."""
    force, position = units_of(found)
    return (
        quantity(point.force_N, force),
        quantity(abs(point.depth_m), position),
        f"{plain(point.frequency_Hz, 2)} Hz",
    )


def units_of(found: Identification) -> tuple[str, str]:
    """Units of force and position of the log."""
    if found.traces is not None:
        return found.traces.force_unit, found.traces.position_unit
    return ("1", "1") if any(p.unit == "1" for n, p in found.parameters.items() if n == "K") else ("N", "m")


def work_loss(share: float) -> str:
    """A sentence about the lost share of the work of a press."""
    if share < 0:
        return f"{-100 * share:.2g} % more work comes back than was put in: the force is probably read late"
    return f"{100 * share:.2g} % of the work of loading is lost"


def press_facts(found: Identification) -> list[str]:
    """Sentences on the press: the slope at each force, the lost work, the relaxation."""
    press, point = found.press, found.working_point
    if press is None:
        return []
    force, stiffness = units_of(found)[0], point.stiffness.unit if point else "1"
    slopes = [
        f"{quantity(t.stiffness, stiffness, t.half)} at {quantity(t.force, force)}" for t in press.tangent
    ]
    facts = [f"Slope by force: {', '.join(slopes)}."] if slopes else []
    if press.hysteresis_loss is not None:
        facts.append(f"{work_loss(press.hysteresis_loss)}.")
    if press.relaxation is not None:
        own = press.relaxation
        share = f"{100 * own.share:.2g} % of the force relaxes"
        facts.append(f"{share} in {own.duration:.3g} s, half of that in {own.half_time:.2g} s.")
    return facts


def limited_by(found: Identification) -> Cause:
    """Largest cause of the working point's interval."""
    point = found.working_point
    assert point is not None
    return cause_of(next(iter(point.stiffness.budget), None), point.source)


def model_line(found: Identification) -> str:
    """The verdicts of the model's parameters, in one line."""
    if not found.contacts or not found.n:
        return ""
    verdicts = [
        f"{enumeration([CALLED.get(name, name) for name in names])} {'is' if len(names) == 1 else 'are'} {verdict}"
        for verdict in Verdict
        if (names := [name for name, p in found.parameters.items() if p.verdict is verdict])
    ]
    text = "; ".join(verdicts)
    return f"By the model {found.model}, {text}."


def subtitle(found: Identification) -> str:
    """The fit and what it is worth, in one line."""
    if not found.n:
        return "no contact"
    if found.slide is not None:
        return " ".join(found.slide.facts)
    count = len(found.contacts)
    force = units_of(found)[0]
    parts = [
        f"{found.model}, R² {found.r2:.4f}",
        f"rms misfit {quantity(found.rmse, force)}",
        f"{found.n} samples of {count} contact{'s' * (count != 1)}",
        f"filters {plain(found.cutoff, 3)} Hz",
    ]
    if found.lag:
        parts.append(lag_of(found))
    return ", ".join(parts)


def lag_of(found: Identification) -> str:
    """How late the force is, and who says so."""
    lag = found.lag
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
    """The same with its unit."""
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


def enumeration(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _share(p: Parameter) -> str:
    if p.value is None or p.ci95 is None or not p.value:
        return "?"
    return f"{50 * (p.ci95[1] - p.ci95[0]) / abs(p.value):.2g} %"


UNIT_WARNINGS = (Code.UNIT_DOUBTFUL, Code.TIME_DOUBTFUL, Code.COLUMNS_SWAPPED)
"""Warnings by which the answer may be in another unit, or of another column."""


def unit_warnings(found: Identification) -> list[str]:
    """The warnings that ask for a unit or a column to be corrected, the first of each kind of sentence."""
    return [warn.text for code in UNIT_WARNINGS for warn in found.warnings if warn.code is code]


def behind_the_arm(found: Identification) -> bool:
    """Whether the arm's own compliance is in the stiffness, which then is a lower bound of the surface's."""
    K = found.parameters.get("K")
    return Code.SERIES_COMPLIANCE.word in found.codes and K is not None and K.reason.startswith(LOWER_BOUND)


def by_the_model(found: Identification) -> bool:
    """Whether a model of one constant stiffness knows it, and the working point does not, or by the lag's prior alone.

    A lag moves the storage of an octave with its frequency; the model's K rests on the slowest motion as well.
    """
    K, point = found.parameters.get("K"), found.working_point
    constant = found.model in ("kelvin-voigt", "kelvin-voigt-mass")
    if K is None or point is None or not constant or K.verdict is not Verdict.IDENTIFIED:
        return False
    own = point.stiffness
    late = point.source == "octave" and next(iter(own.budget), "") == "lag" != next(iter(K.budget), "")
    return own.verdict is not Verdict.IDENTIFIED or (late and (K.std or 0.0) < (own.std or 0.0))


def no_contact_in(log: str, found: Identification) -> str:
    """Why a log has no contact."""
    own = next((warn.text for warn in found.warnings if warn.code is Code.NO_CONTACT), "")
    if own.startswith(BRIEF):
        return f"The contacts in {log} are too short: {own.replace(':', ';')}"
    reason = own.partition(":")[0].rstrip(".") or "the force does not leave its rest"
    return f"{UNTOUCHED.replace('this log', log)}: {reason}"


_CHUNK = 1 << 20


@dataclass(frozen=True)
class Source:
    """Where an identification is from.

    Args:
        file: the log, as it was named.
        options: what was said about it, as plain values.
        sha256: of the log; of a folder, of its files in the order of their names.
        command: that made the identification.
        made: when, in ISO 8601.
        notes: lines on how the log was read, such as the frame that a wrench was turned into.
    """

    file: str
    options: dict[str, Any] = field(default_factory=dict)
    sha256: str | None = None
    command: str = "palpate identify"
    made: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The log's own name, a run's with its folder, without characters that a page or a terminal would obey."""
        path = Path(self.file)
        own = f"{path.parent.name}/{path.name}" if path.name == RECORD else path.name
        return printable(own.removeprefix("/") or self.file)


def as_json(found: Identification, source: Source) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for one log."""
    from importlib.metadata import version

    own = found.to_json()
    return {
        "file": source.file,
        **own,
        "options": {**source.options, **own["options"]},
        "sha256": source.sha256,
        "version": version("palpate"),
    }


def sha256_of(path: Path) -> str:
    """Of a file; of a sheet, of its book; of a folder that is a log, of all its files in the order of their names."""
    total = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    files = [path.parent] if path.parent.is_file() else files  # a sheet of a book
    for name in files:
        with name.open("rb") as file:
            while chunk := file.read(_CHUNK):
                total.update(chunk)
    return total.hexdigest()
