"""Contents of a log: topics, variables or columns, and their names on the command line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.files.reading import ReadingLimits
from palpate.logs import bags
from palpate.logs.arm_logs import is_pose, is_wrench
from palpate.logs.columns import NAMES, ColumnStatistics, read_columns
from palpate.logs.formats import Kind, kind_of, open_table
from palpate.logs.presets import preset_among
from palpate.logs.proposal import MAX_LISTED, Proposal, clock_of, from_columns, time_factor
from palpate.logs.read import is_run
from palpate.logs.tables.sheet import Sheet
from palpate.logs.tables.spreadsheet import equal_sheets
from palpate.text import shorten


@dataclass(frozen=True)
class SignalEntry:
    """One topic, variable or column.

    Args:
        name: as the file has it.
        kind: the type of a topic's messages; number, date or text of a column.
        count: of messages, or of rows that hold something.
        rate: a second [1/s]; None where it is not known.
        first, last: time of the first and the last [s], on the log's own clock; None likewise.
        about: its name in `palpate identify`, or its range of values.
        fields: the numbers in a topic's messages.
    """

    name: str
    kind: str
    count: int
    rate: float | None
    first: float | None
    last: float | None
    about: str
    fields: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The listing as plain JSON values."""
        return asdict(self)


@dataclass(frozen=True)
class Listing:
    """Contents of a log.

    Args:
        entries: of the log, in its order.
        troubles: its faults, a sentence each.
        proposals: how to identify it; several if it holds logs side by side.
        facts: its statements about itself.
    """

    entries: list[SignalEntry]
    troubles: list[str]
    proposals: tuple[Proposal, ...]
    facts: list[str] = field(default_factory=list)

    @property
    def proposal(self) -> Proposal:
        """The first of the proposals."""
        return self.proposals[0]


def list_log(
    path: str | Path,
    delimiter: str | None = None,
    limits: ReadingLimits | None = None,
    join: Path | None = None,
) -> Listing:
    """Contents of a log, its faults, and a command to identify it.

    Args:
        path: of the log.
        delimiter: of a text log; found when None.
        limits: of unpacked size and time; those of `read_log` when None.
        join: a second log with further columns of the same time.

    Raises:
        InputError: the file is missing or unreadable.
    """
    path = Path(path)
    kind = kind_of(path)
    if kind.is_bag:
        with bags.Bag(path, kind, limits) as bag:
            fields = {name: _fields(bag, name) for name in bag.topics}
            entries = [_of_topic(bag, name, fields[name]) for name in bag.topics]
            return Listing(entries, bag.troubles, (from_topics(bag, fields),))
    table = open_table(path, kind, delimiter, limits, join)
    columns, unread = read_columns(table)
    clock = clock_of(table, columns)
    entries = [_of_column(column, clock) for column in columns]
    entries += [SignalEntry(name, "-", 0, None, None, None, what) for name, what in table.left_out.items()]
    given = {"delimiter": delimiter, "join": None if join is None else str(join)}
    words = {name: word for name, word in given.items() if word is not None}
    proposals = (Proposal({}),) if is_run(path) else from_columns(table, columns, words)
    repeats = equal_sheets(path, limits or ReadingLimits()) if kind is Kind.SHEETS and path.is_file() else []
    if repeats:
        first = list_log(repeats[0], limits=limits).proposal
        text = f"{len(repeats)} sheets have the same columns and are pooled, as repeats of one test: "
        named = shorten(", ".join(sheet.name for sheet in repeats), 120)
        proposals = (replace(first, guesses=(*first.guesses, text + named)),)
    if proposals[0].beside > MAX_LISTED:
        used = {word.rpartition(":")[0] or word for word in proposals[0].words or ()}
        shown = [c for c in columns if not {c.name, str(c.place)}.isdisjoint(used)]
        entries = [_of_column(column, clock) for column in shown]
        entries.append(SignalEntry(f"{len(columns) - len(shown)} more", "-", 0, None, None, None, "likewise"))
    facts = [f"{table.rate:g} rows a second, as the file states"] if table.rate else []
    return Listing(entries, unread + [note["text"] for note in table.notes], proposals, facts)


def propose(table: Sheet) -> Proposal:
    """Options that identify a table of columns."""
    return from_columns(table, read_columns(table)[0], {})[0]


def _fields(bag: bags.Bag, name: str) -> tuple[str, ...]:
    topic = bag.topics[name]
    if not (topic.known and topic.count):
        return ()
    return tuple(path for path, _ in bags.leaves(bag.first(name)))


def _of_topic(bag: bags.Bag, name: str, fields: tuple[str, ...]) -> SignalEntry:
    topic = bag.topics[name]
    first, last = topic.times or (None, None)
    long = first is not None and last is not None and last > first
    rate = (topic.count - 1) / (last - first) if long and first is not None and last is not None else None
    return SignalEntry(name, topic.kind, topic.count, rate, first, last, _use(bag, name, fields), fields)


def _use(bag: bags.Bag, name: str, fields: tuple[str, ...]) -> str:
    """Option of the command line that names a topic, by its type."""
    topic = bag.topics[name]
    if not topic.known:
        return "unknown type: the bag does not define it"
    if not topic.count:
        return ""
    uses = [f"--wrench {name}"] if is_wrench(topic.kind) else []
    uses += [f"--pose {name}"] if is_pose(topic.kind) else []
    if not uses:
        return f"{name}.FIELD" if fields else "no numbers"
    return " ".join(uses) + (f" (in {topic.parent})" if topic.parent else "")


def from_topics(bag: bags.Bag, fields: Mapping[str, Sequence[str]]) -> Proposal:
    """The command for a bag."""
    readable = [topic for topic in bag.topics.values() if topic.count and topic.known]
    guesses: list[str] = []
    wrench = _topic([topic for topic in readable if is_wrench(topic.kind)], "wrench", guesses)
    pose = _topic([topic for topic in readable if is_pose(topic.kind)], "pose", guesses)
    name = preset_among(bag.topics)
    if name is not None:
        return Proposal({"preset": name}, (), (f"the topics are those of the preset {name}",))
    if wrench and pose:
        options = {"wrench": wrench.name, "pose": pose.name}
        if not all(_frame(bag, topic) for topic in (wrench, pose)):
            options["wrench_frame"] = "tool"
            guesses.append(
                "the wrench's axes are taken for the tool's: say --wrench-frame base if they are the base's"
            )
        return Proposal(options, tuple(guesses))
    pair = _joint(bag, fields, guesses) or _fields_by_name(fields, guesses)
    if not pair:
        return Proposal(None, ("no two topics are a position and a force",))
    still = [name for spec in pair.values() if not _changes(bag, name := spec.rpartition(":")[0])]
    return (
        Proposal(None, (f"{still[0]} never changes: no contact shows",))
        if still
        else Proposal(pair, tuple(guesses))
    )


def _changes(bag: bags.Bag, name: str) -> bool:
    """True if a field, TOPIC.FIELD, holds more than one number."""
    topic = max((topic for topic in bag.topics if name.startswith(f"{topic}.")), key=len)
    streams, _ = bag.streams({topic: [name.removeprefix(f"{topic}.")]})
    return bool(np.ptp(streams[topic].values) > 0)


def _topic(topics: Sequence[bags.Topic], what: str, guesses: list[str]) -> bags.Topic | None:
    """The topic with most messages; one of the base's own frames before another's."""
    if len(topics) > 1:
        listed = ", ".join(topic.name for topic in topics[:8])
        best = max(topics, key=lambda topic: (not topic.parent, topic.count))
        guesses.append(f"{best.name} is taken for the {what}; there are {listed}")
        return best
    return topics[0] if topics else None


def _frame(bag: bags.Bag, topic: bags.Topic) -> str:
    header = getattr(bag.first(topic.name), "header", None)
    return str(getattr(header, "frame_id", ""))


def _joint(bag: bags.Bag, fields: Mapping[str, Sequence[str]], guesses: list[str]) -> dict[str, str] | None:
    """Position and effort of the joint whose effort changes most."""
    for name, paths in fields.items():
        if not bag.topics[name].kind.endswith("/JointState"):
            continue
        joints = [path.partition(".")[2] for path in paths if path.startswith("effort.")]
        joints = [joint for joint in joints if f"position.{joint}" in paths]
        if not joints:
            continue
        streams, _ = bag.streams({name: [f"effort.{joint}" for joint in joints]})
        joint = joints[int(np.argmax(np.ptp(streams[name].values, axis=0)))]
        guesses.append(
            f"joint {joint!r} is taken, whose effort changes most, and to slide: say :rad and :Nm if it turns"
        )
        return {"position": f"{name}.position.{joint}:m", "force": f"{name}.effort.{joint}:N"}
    return None


def _fields_by_name(fields: Mapping[str, Sequence[str]], guesses: list[str]) -> dict[str, str] | None:
    """Two fields that are called as a force and a position are."""
    paths = [f"{name}.{path}" for name, inner in fields.items() for path in inner]
    pair = []
    for role in ("position", "force"):
        named = re.compile(NAMES[role], re.I)
        unused = [path for path in paths if path not in pair]
        fits = [path for path in unused if named.search(path.rpartition(".")[2])]  # z and fz of one topic
        fits = fits or [path for path in unused if named.search(path)]
        if not fits:
            return None
        pair += [next((path for path in fits if path.endswith("z")), fits[0])]
    guesses.append("the two fields are taken by their names")
    return {"position": f"{pair[0]}:m", "force": f"{pair[1]}:N"}


def _of_column(column: ColumnStatistics, clock: ColumnStatistics | None) -> SignalEntry:
    finite = np.isfinite(column.values)
    count = int(finite.sum())
    if not count:
        return SignalEntry(column.name, "text", 0, None, None, None, "not numbers")
    kind = "date" if column.clock else "number"
    about = f"{column.values[finite].min():.6g} to {column.values[finite].max():.6g}"
    about += f" {column.unit}" if column.unit not in {None, "1"} else ""
    if clock is None or count < 2 or len(clock.values) != len(column.values):
        return SignalEntry(column.name, kind, count, None, None, None, about)
    time = clock.values[finite & np.isfinite(clock.values)] * time_factor(clock)
    if len(time) < 2:
        return SignalEntry(column.name, kind, count, None, None, None, about)
    rate = (count - 1) / float(time[-1] - time[0]) if time[-1] > time[0] else None
    about += " (time?)" if column is clock else ""
    return SignalEntry(column.name, kind, count, rate, float(time[0]), float(time[-1]), about)
