"""Signals of a log, by the names of its columns or topics; what has no name is concluded where nothing is guessed."""

# No annotations from the future: the command line looks for those of a base class where it inherits them.
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from palpate.errors import InputError
from palpate.files.reading import ReadingLimits
from palpate.logs.formats import Kind, kind_of, open_table
from palpate.logs.presets import preset
from palpate.logs.read import is_run, read_run
from palpate.logs.read import read_log as read_named
from palpate.logs.roles import POSE, WRENCH
from palpate.logs.tables.parquet import stored_about
from palpate.logs.tables.sheet import read_frame
from palpate.records import Record
from palpate.units import split_spec

if TYPE_CHECKING:
    from palpate.logs.proposal import Proposal

Choice = Callable[[Path, "Proposal"], "Proposal"]
"""Picks a proposal for a log, or its fallback."""

Rotation = Literal["quaternion", "quaternion-wxyz", "rotation-vector", "rpy", "matrix", "matrix-by-columns"]
GB = 2.0
"""Largest unpacked size of a log [GB]; the default of `palpate.files.reading`."""
SLIDE_END = "slide_end_s"
"""Metadata of the record of a simulated slide: time from the first row [s] after which the rows are of the retreat."""
_SHOWN = 40


@dataclass(frozen=True, kw_only=True)
class Signals:
    """Columns or topics of a log, and which rows of it."""

    time: str | None = None
    "Column of the time, in s if no unit is given; dates and times (ISO 8601) too. A bag has its own."
    rate: float | None = None
    "Rows per second, for a log without a column of time."
    position: str | None = None
    "Column of the position, in m if no unit is given; the unit 1 does not convert. TOPIC.FIELD of a bag."
    force: str | None = None
    "Column of the force, in N if no unit is given; g is the reading of a scale. TOPIC.FIELD of a bag."
    wrench: str | None = None
    """Topic of the wrench in a bag, if it is not the only one; or columns fx,fy,fz or fx,fy,fz,tx,ty,tz; - for an
    axis without a column."""
    pose: str | None = None
    "Topic of the pose in a bag, if it is not the only one; or columns x,y,z or x,y,z,qx,qy,qz,qw."
    rotation: Rotation = "quaternion"
    """Representation of the orientation in the pose's columns: quaternion (qx,qy,qz,qw), quaternion-wxyz,
    rotation-vector (rx,ry,rz as UR does), rpy (roll,pitch,yaw about fixed axes), matrix (by rows) or
    matrix-by-columns."""
    start: float | None = None
    "Leave out the rows before this time, in seconds from the first row."
    end: float | None = None
    "Leave out the rows after this time, in seconds from the first row."
    missing: tuple[str, ...] = ()
    'A value that means "no reading", as -1; may be repeated. Common ones are detected.'
    join: Path | None = None
    "A second log with further columns, such as the forces; the time columns of both logs are of one clock."
    delimiter: str | None = None
    "Between two cells of a text log; detected if not given."
    max_size: float = GB
    "Largest unpacked size, in GB; a larger log is refused."
    max_seconds: float = 600.0
    "Longest time to read the log; a log that takes longer is refused."

    @property
    def plain(self) -> bool:
        """True if no signal is named."""
        named = (self.time, self.rate, self.position, self.force, self.wrench, self.pose)
        return all(name is None for name in named)

    @property
    def names(self) -> list[str]:
        """The named columns, without their units."""
        specs = [self.time, self.position, self.force]
        specs += [
            spec for specs_text in (self.wrench, self.pose) if specs_text for spec in specs_text.split(",")
        ]
        return [split_spec(spec)[0] for spec in specs if spec and spec != "-"]

    @property
    def limits(self) -> ReadingLimits:
        """Limits of size and time."""
        return ReadingLimits(self.max_size * 1e9, self.max_seconds)

    def complete(
        self, path: Path, *, known_frame: bool = False, choose: Choice | None = None
    ) -> tuple["Signals", dict[str, Any]]:
        """The signals with the names that a log's own names, units and values leave no doubt of.

        Args:
            path: of the log.
            known_frame: the axes of the wrench are given.
            choose: picks a proposal or its fallback, whose guesses are then used; None if nothing may be guessed.

        Returns:
            These signals; and the other options that follow from the names, as `wrench_frame` of a preset, with
            `guessed`, the command and its guesses.

        Raises:
            InputError: the log cannot be read, or lacks a signal, or something would have to be guessed.
        """
        bag = kind_of(path).is_bag
        about = stored_about(path) if kind_of(path) is Kind.PARQUET else None
        if self.end is None and about is not None and SLIDE_END in about.meta:
            cut = replace(self, end=_end_of_slide(path, about.meta))
            return cut.complete(path, known_frame=known_frame, choose=choose)
        own_frame = {"wrench_frame"} & (about.meta.keys() if about else set())
        if not self.plain or is_run(path) or (not bag and _is_record(self._names(path))):
            return self, {name: about.meta[name] for name in own_frame} if about else {}
        from palpate.logs.listing import list_log

        listing = list_log(path, self.delimiter, self.limits, self.join)
        if listing.proposal.beside > 1:
            raise InputError(_list_several(path, listing.proposals))
        proposal = listing.proposal if choose is None else choose(path, listing.proposal)
        guesses = [
            guess
            for guess in proposal.guesses
            if not ((known_frame or own_frame) and "--wrench-frame" in guess)
        ]
        if bag and (
            proposal.options is None or (guesses and (choose is None or "wrench" in proposal.options))
        ):
            return self, {}  # a bag's only wrench and pose need no names
        if proposal.options is None or proposal.elsewhere or (guesses and choose is None):
            raise InputError(_list_guesses(path, proposal))
        options: dict[str, Any] = dict(proposal.options)
        if "preset" in options:
            options = _with_underscores(preset(options.pop("preset"))) | options
        makers: dict[str, Callable[[str], Any]] = {"rate": float, "join": Path}
        fields = {
            name: makers.get(name, str)(value)
            for name, value in options.items()
            if name in Signals.__dataclass_fields__
        }
        remaining = {name: value for name, value in options.items() if name not in fields}
        if guesses:
            remaining["guessed"] = {"command": proposal.command(path), "guesses": guesses}
        return replace(self, **fields), remaining | {"read_as": shlex.join(proposal.words or ())}

    def read(self, path: Path, *, samples: bool = False) -> Record:
        """The record of a log: of force and position, or of wrench and pose.

        Args:
            path: of the log.
            samples: keep the force's readings at their own times, for a fit of the sensor's own samples.

        Raises:
            InputError: the file or an option is wrong.
        """
        cut: dict[str, Any] = {
            "start": self.start, "end": self.end, "missing": self.missing, "limits": self.limits,
        }  # fmt: skip
        if self.plain and is_run(path):
            return read_run(path, **cut)
        if kind_of(path).is_bag:
            return self._of_bag(path, cut, samples)
        reading = {"delimiter": self.delimiter, "rate": self.rate, "join": self.join}
        return self._of_table(path, cut | reading)

    def _names(self, path: Path) -> list[str]:
        return list(open_table(path, kind_of(path), self.delimiter, self.limits, self.join).names)

    def _of_bag(self, path: Path, cut: dict[str, Any], samples: bool) -> Record:
        from palpate.logs.arm_logs import read_wrench_and_pose

        axis = self._one_axis()
        if self.join is not None:
            raise InputError(f"{path} is a bag; --join is of files of columns, leave it out")
        if self.time or self.rate:
            raise InputError(f"the messages of {path} have their own times; leave out --time and --rate")
        if axis is None:
            hold = "force_x" if samples else None
            return read_wrench_and_pose(path, self.wrench, self.pose, self.rotation, held=hold, **cut)
        return read_named(path, held="force" if samples else None, **cut, **axis)

    def _of_table(self, path: Path, cut: dict[str, Any]) -> Record:
        table = open_table(path, kind_of(path), self.delimiter, cut["limits"], self.join)
        present = list(table.names)
        time = self.time or ("time" if "time" in present and self.rate is None else None)
        columns: dict[str, Any] = {} if time is None else {"time": time}
        saved = self.position is None and self.force is None and {*WRENCH[:3], *POSE[:3]} <= set(present)
        if self.wrench or self.pose or saved:
            from palpate.logs.arm_logs import read_wrench_and_pose

            self._one_axis()
            saved_columns = [
                ",".join(name for name in names if name in present) if saved else None
                for names in (WRENCH, POSE)
            ]
            rotation = "quaternion" if saved and self.pose is None else self.rotation
            return read_wrench_and_pose(
                path,
                self.wrench or saved_columns[0],
                self.pose or saved_columns[1],
                rotation,
                **cut,
                **columns,
            )
        names: dict[str, Any] = {
            role: getattr(self, role) or (role if role in present else None) for role in ("position", "force")
        }
        timed = bool(columns) or self.rate is not None or table.rate is not None
        lacking = [] if timed else ["time"]
        lacking += [role for role, name in names.items() if name is None]
        if lacking:
            named = {"force": "--force-column"}  # --force of palpate tune is a desired force
            flags = ", ".join(named.get(role, f"--{role}") for role in lacking)
            flags += " (or --rate)" if "time" in lacking else ""
            listed = f"{', '.join(present[:_SHOWN])}{', ...' if len(present) > _SHOWN else ''}"
            raise InputError(
                f"name the columns of {path} with {flags}; there are: {listed} (palpate topics {path} proposes a "
                "command)"
            )
        return read_named(path, **cut, **columns, **names)

    def _one_axis(self) -> dict[str, Any] | None:
        """Force and position of one axis, if these were named.

        Raises:
            InputError: they are mixed with wrench and pose, or one of them is missing.
        """
        axis = {"position": self.position, "force": self.force}
        named = {role: name for role, name in axis.items() if name is not None}
        if named and (self.wrench or self.pose):
            raise InputError(
                "give --force and --position of one axis, or --wrench and --pose in three, not of both"
            )
        if len(named) == 1:
            partner = "force" if "position" in named else "position"
            raise InputError(f"--{next(iter(named))} needs its --{partner}, as TOPIC.FIELD")
        return named or None


@wraps(read_named)
def read_log(path: str | Path | Any, **options: Any) -> Record:
    """Read a log as `palpate.logs.read.read_log` does, or as what its own names say where no column is named."""
    if not isinstance(path, str | Path):
        return read_named(path, **(options | _columns_of(path, options)))
    path = Path(path)
    fields: dict[str, Any] = {
        name: options[name]
        for name in ("rate", "start", "end", "missing", "delimiter", "join")
        if name in options
    }
    named = set(options) - {*fields, "held", "limits"}
    if named or (kind_of(path) is Kind.PARQUET and stored_about(path) is not None):
        return read_named(path, **options)
    if "limits" in options:
        fields |= {"max_size": options["limits"].size / 1e9, "max_seconds": options["limits"].seconds}
    signals, remaining = Signals(**fields).complete(path)
    return read_as(signals.read(path), remaining.get("read_as", ""))


def _columns_of(table: Any, options: Mapping[str, Any]) -> dict[str, str]:
    """Time, position and force of a table in memory, if its names, units and values leave nothing to guess."""
    sheet = read_frame(table)
    if {"rate", "time", "position", "force"} & {*options} or {"position", "force"} & {*sheet.names}:
        return {}
    from palpate.logs.listing import propose

    proposal = propose(sheet)
    alone = proposal.options is not None and not proposal.guesses and "preset" not in proposal.options
    return (
        dict(proposal.options or {}) if alone and {"position", "force"} <= {*(proposal.options or {})} else {}
    )


def read_as(record: Record, words: str, guessed: Mapping[str, Any] | None = None) -> Record:
    """A record that says as which signals it was read, and what of that was guessed; as it is without words."""
    if not words:
        return record
    meta = {**record.meta, "guessed": guessed} if guessed else record.meta
    facts = [f"read as {words}", *meta.get("facts", ())]
    return Record(record.columns, record.units, {**meta, "facts": facts})


def _end_of_slide(path: Path, about: Mapping[str, Any]) -> float:
    """Time after which the rows are of the retreat [s]."""
    try:
        return float(about[SLIDE_END])
    except (TypeError, ValueError):
        raise InputError(f"{path}: the end of its slide is no number of seconds; slide again") from None


def _is_record(names: list[str]) -> bool:
    """True if the columns are named as a record's own."""
    columns = set(names)
    return {"force", "position"} <= columns or {*WRENCH[:3], *POSE[:3]} <= columns


def _with_underscores(options: dict[str, Any]) -> dict[str, Any]:
    return {name.replace("-", "_"): value for name, value in options.items()}


def _list_guesses(path: Path, proposal: "Proposal") -> str:
    """The guesses of a log whose signals nobody named, and the command that would be tried."""
    if proposal.elsewhere:
        return f"{path}: {'; '.join(proposal.facts)}. To {proposal.purpose}: {proposal.command(path)}"
    guesses = "; ".join(proposal.guesses)
    if proposal.options is None:
        return f"{path}: {guesses} (palpate topics {path} lists them; --time, --position and --force-column name them)"
    return f"{path}: {guesses}. If that is right: {proposal.command(path)}"


def _list_several(path: Path, proposals: "Sequence[Proposal]") -> str:
    """The commands for the logs that a table holds side by side."""
    commands = "; or: ".join(str(proposal.command(path)) for proposal in proposals)
    return f"{path} holds {proposals[0].beside} logs side by side; identify one: {commands}"
