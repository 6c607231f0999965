"""From a log file to an identification in one call: its signals, the arm between sensors and surface, the indenter."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.contact_frame.arm import ArmDynamics, robot_stiffness
from palpate.contact_frame.payload import Payload, load_payload
from palpate.contact_frame.press_or_slide import identify_contact
from palpate.contact_frame.signals_in_base import ContactFrame
from palpate.errors import InputError, unknown
from palpate.identification import Code, Identification, Warn
from palpate.identification.indenter import Indenter, with_modulus
from palpate.identification.options import OPTION_NAMES
from palpate.logs.formats import log_of
from palpate.logs.presets import preset
from palpate.logs.read import is_run, measured_by, read_log
from palpate.logs.roles import quantity
from palpate.logs.signals import Signals, read_as
from palpate.records import Record
from palpate.units import split_spec, unit_in_name

if TYPE_CHECKING:
    from palpate.logs.proposal import Proposal

_SIDES = {None: None, "action": 1, "reaction": -1}


@dataclass(frozen=True)
class LogIdentifier:
    """Everything that an identification takes besides the log.

    Args:
        signals: columns or topics, and which rows.
        frame: of wrench and pose.
        arm: between sensors and surface.
        payload: on the sensor, if it was weighed.
        wall: a log of a press on a rigid wall, from which the arm's stiffness is identified.
        indenter: shape of the probe, for Young's modulus.
        poisson: Poisson's ratio with its standard deviation; None for 0 to 0.5.
        options: of `palpate.identify`.
        guess: use columns, units and axes that are guessed, and say so in a warning, in place of refusing the log.
    """

    signals: Signals = field(default_factory=Signals)
    frame: ContactFrame = field(default_factory=ContactFrame)
    arm: ArmDynamics = field(default_factory=ArmDynamics)
    payload: Payload | None = None
    wall: Path | None = None
    indenter: Indenter | None = None
    poisson: tuple[float, float] | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    guess: bool = False

    def identify(self, log: Path) -> tuple[Identification, Record]:
        """Read and identify a log.

        Returns:
            The identification, and the record of force and position along the normal that it is of.

        Raises:
            InputError: the log or an option is wrong, in one line.
        """
        job, words, guessed = self._complete(log)
        options: dict[str, Any] = measured_by(log) if job.signals.plain and is_run(log) else {}
        options |= self.options
        samples = str(options.get("force_filter") or "none") != "none"
        record = read_as(job.signals.read(log, samples=samples), words, guessed)
        in_space = "force_x" in record.columns
        if not in_space:
            if replace(self.frame, force_sign=None) != ContactFrame():
                raise InputError(
                    "--wrench-frame, --tcp, --normal and the like need a wrench and a pose; this log has one axis"
                )
            options["force_sign"] = _SIDES[self.frame.force_sign]
        frame = replace(job.frame, payload=self.payload) if in_space else None
        result, along = identify_contact(record, frame, _between(job, options, samples), **options)
        if not any("is a guess" in guess for guess in (guessed or {}).get("guesses", ())):
            result = accept_stated_units(result, record, _specs(job.signals))
        if guessed is not None:
            text = f"{'; '.join(guessed['guesses'])}. If that is right: {guessed['command']}"
            result = replace(result, warnings=(Warn(Code.SIGNALS_GUESSED, text), *result.warnings))
        if self.indenter is not None:
            result = with_modulus(result, self.indenter, self.poisson, options.get("tolerance", 0.25), along)
        return result, along

    def _complete(self, log: Path) -> "tuple[LogIdentifier, str, Mapping[str, Any] | None]":
        """These with what the log's own names leave no doubt of, the words for it, and the guesses, if any is allowed.

        What is given goes first.
        """
        signals, remaining = self.signals.complete(
            log,
            known_frame=self.frame.wrench_frame is not None,
            choose=choose_proposal if self.guess else None,
        )
        frame = self.frame
        arm = self.arm
        if frame.wrench_frame is None and "wrench_frame" in remaining:
            frame = replace(frame, wrench_frame=remaining["wrench_frame"])
        if remaining.get("gravity_compensated"):
            frame = replace(frame, gravity_compensated=True)
        if arm.position_from is None and "position_from" in remaining:
            arm = replace(arm, position_from=remaining["position_from"])
        if arm.stiffness is None and "robot_stiffness" in remaining:
            arm = replace(arm, stiffness=(float(remaining["robot_stiffness"]), 0.0))
        job = replace(self, signals=signals, frame=frame, arm=arm)
        return job, remaining.get("read_as", ""), remaining.get("guessed")


_MAX_TRIED_BYTES = 200e6
"""Largest log that a proposed command is tried on: a bag of gigabytes is listed at once."""


def try_proposal(log: Path, proposal: "Proposal") -> "Proposal":
    """A proposal whose command answers, or else its fallback; the reason in place of a command that is refused."""
    from palpate.logs.formats import sheets_as_logs

    return _tried(sheets_as_logs((log,), (), Signals().limits)[0], proposal)[0]


def choose_proposal(log: Path, proposal: "Proposal") -> "Proposal":
    """The proposal that is to be run: with a fallback, the first of both that answers."""
    return proposal if proposal.fallback is None else try_proposal(log, proposal)


def _tried(log: Path, proposal: "Proposal") -> "tuple[Proposal, bool]":
    """A proposal or its fallback, tried; and True if its command answers."""
    from palpate.logs.proposal import PRESS, SLIDE

    fallback = proposal.fallback
    if not proposal.options or (log.is_file() and log.stat().st_size > _MAX_TRIED_BYTES):
        return proposal, False
    slide = fallback is not None and fallback.purpose == SLIDE
    if fallback is not None and slide:  # one axis of a slide may look like a press
        other, answers = _tried(log, replace(fallback, fallback=None))
        if answers:
            return other, True
    try:
        tried, answers = _try(log, proposal)
    except (InputError, MemoryError) as error:
        reason = f"{proposal.verb} refuses what the names suggest: {' '.join(str(error).split())}"
        tried, answers = replace(proposal, options=None, guesses=(reason,), facts=()), False
    if answers or fallback is None:
        return tried, answers
    other, answers = _tried(log, fallback.fallback or fallback if slide else fallback)
    return (
        (other, answers) if answers or proposal.purpose != PRESS or tried.options is None else (tried, False)
    )


def _try(log: Path, proposal: "Proposal") -> "tuple[Proposal, bool]":
    """A proposal with what its answer shows, and True if its command answers.

    Raises:
        InputError: the command refuses the log.
    """
    from palpate.logs.proposal import FRICTION, PRESS, SLIDE, WEIGH

    options: dict[str, Any] = dict(proposal.options or {})
    if "rate" in options:
        options["rate"] = float(options["rate"])
    if "robot_stiffness" in options:
        options["robot_stiffness"] = (float(options["robot_stiffness"]), 0.0)
    if "join" in options:
        options["join"] = Path(options["join"])
    if proposal.purpose == WEIGH:
        from palpate.contact_frame.tool_payload import weigh

        frame = ContactFrame(wrench_frame=options.pop("wrench_frame"))
        return proposal, weigh(Signals(**options).read(log), frame).payload is not None
    if proposal.purpose == FRICTION:
        from palpate.contact_frame.axis_friction import identify_friction

        del options["friction"]
        options["force"] = options.pop("force_column")
        return proposal, identify_friction(read_log(log, **options)).identified
    result, _ = log_identifier(options).identify(log)
    if result.slide is not None:
        return replace(proposal, purpose=SLIDE), True
    return proposal, result.identified and proposal.purpose == PRESS


def accept_stated_units(
    result: Identification, record: Record, specs: Mapping[str, str | None]
) -> Identification:
    """Remove doubts about units that rest on the size of the numbers alone, where the log or the user states all units.

    Cells and cantilevers have 1e-5 to 1 N/m. A unit that contradicts the file stays in doubt.

    Args:
        result: of the record.
        record: its notes say what the file states.
        specs: name of each column as `NAME` or `NAME:UNIT`, by role.
    """
    notes = record.meta.get("notes", ())
    stated = [note["text"] for note in notes if note["code"] == "unit-stated"]
    for role, spec in specs.items():
        name, symbol = split_spec(spec or role)
        by_file = any(text.startswith((repr(name), f"no unit was given for {name!r}")) for text in stated)
        if spec is None or not (symbol or unit_in_name(name, quantity(role)) or by_file):
            return result
    texts = {note["text"] for note in notes}
    warnings = [warn for warn in result.warnings if warn.code is not Code.UNIT_DOUBTFUL or warn.text in texts]
    return replace(result, warnings=tuple(warnings))


def _specs(signals: Signals) -> dict[str, str | None]:
    return {"position": signals.position, "force": signals.force}


def _between(job: LogIdentifier, options: dict[str, Any], samples: bool) -> ArmDynamics:
    """The arm; with the stiffness from a press on a wall, if one is given."""
    if job.wall is None:
        return job.arm
    press = replace(job.signals, start=None, end=None).read(job.wall, samples=samples)
    in_space = "force_x" in press.columns
    frame = replace(job.frame, payload=job.payload, free=None) if in_space else None
    pressed, _ = identify_contact(press, frame, replace(job.arm, position_from="tip"), **options)
    return replace(job.arm, stiffness=robot_stiffness(pressed, job.wall.name))


_OWN = {
    "payload",
    "robot_stiffness",
    "robot_mass",
    "robot_stiffness_from",
    "indenter",
    "poisson",
    "preset",
}


def identify_log(path: str | Path, **options: Any) -> Identification:
    """Read a log and identify what was touched, as `palpate identify` does.

    `identify_log("press.csv")` is enough where the names of the columns, their units and values leave nothing to guess;
    `identify_log("press.csv", time="t", position="x:mm", force="f:N", lag=(5e-3, 1e-3))` names them.

    Args:
        path: of the log, as for `read_log`; or of the record of a run or a press, or its folder.
        options: columns, topics and rows as for `read_log` and `read_wrench_and_pose`, and `preset`; the fields of
            `contact_frame.ContactFrame`; `tool_mass`, `robot_stiffness` and `robot_mass`, each (value, std) [kg, N/m,
            kg], `position_from`, `payload` and `robot_stiffness_from` (files); `indenter` as "sphere:5:mm" and
            `poisson`; the options of `palpate.identify`, where `lag` may be (value, std) [s].

    Raises:
        InputError: the log or an option is wrong, or something would have to be guessed, in one line.
    """
    names = {f.name for kind in (Signals, ContactFrame, ArmDynamics) for f in fields(kind)} - {"stiffness"}
    names |= _OWN | {*OPTION_NAMES}
    for name in options:
        if name not in names:
            raise unknown("option", name, names)
    return log_identifier(options).identify(log_of(Path(path)))[0]


def log_identifier(options: Mapping[str, Any]) -> LogIdentifier:
    """The options of `identify_log`, sorted by what they are of."""
    settings = dict(options)
    if "preset" in settings:
        preset_options = preset(settings.pop("preset"))
        settings = {name.replace("-", "_"): value for name, value in preset_options.items()} | settings

    def take(*names: str) -> dict[str, Any]:
        return {name: settings.pop(name) for name in names if name in settings}

    signals = Signals(**take(*Signals.__dataclass_fields__))
    payload = settings.pop("payload", None)
    payload = load_payload(Path(payload)) if isinstance(payload, str | Path) else payload
    frame = ContactFrame(**take(*ContactFrame.__dataclass_fields__))
    wall = settings.pop("robot_stiffness_from", None)
    shape = settings.pop("indenter", None)
    arm = ArmDynamics(
        stiffness=settings.pop("robot_stiffness", None),
        mass=settings.pop("robot_mass", None),
        tool_mass=settings.pop("tool_mass", payload.beyond if payload else None),
        **take("position_from"),
    )
    if isinstance(settings.get("lag"), tuple):
        settings["lag"], settings["lag_std"] = settings["lag"]
    return LogIdentifier(
        signals, frame, arm, payload, None if wall is None else Path(wall),
        Indenter.parse(shape) if isinstance(shape, str) else shape, settings.pop("poisson", None), settings,
    )  # fmt: skip
