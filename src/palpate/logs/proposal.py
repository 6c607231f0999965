"""The proposed `palpate identify` command of a log, from its names, units and values."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.logs.arm_logs import is_pose, is_wrench
from palpate.logs.bags import Bag, Topic
from palpate.logs.plausibility import epoch_unit, usual_unit
from palpate.logs.tables import Columns
from palpate.units import known_unit, unit, unit_in_name

_NAMES = {
    "time": r"^t$|time|stamp|zeit|temps|tiempo|tout|^x_value|^sec|clock",
    "position": (
        r"pos|disp|dist|depth|indent|height|travel|stroke|exten|length|weg|hub|path|probe|tip|lvdt"
        r"|^[xyz]$|^x_|_[xyz]$"
    ),
    "force": r"forc|^f$|^f[nxyz]$|[_.]f[nxyz]?$|^f_|load|kraft|fuerza|weight|scale|effort|torque|newton|press",
}
"""Usual names of columns in laboratories."""
_SIZES = {"length": (0.5, "m", "mm"), "force": (1000.0, "N", "g")}
"""Largest plausible range in SI units, and the assumed unit above it."""
_RATE = 1000
"""Of the example [Hz]; nothing is computed with it."""


@dataclass(frozen=True)
class Proposal:
    """Words after `palpate identify LOG`, and what of them is guessed.

    Args:
        words: of the command line; None if the log does not suffice.
        guesses: a sentence each.
    """

    words: tuple[str, ...] | None
    guesses: tuple[str, ...] = ()

    def command(self, log: Path) -> str | None:
        """The whole command, to be pasted into a shell."""
        if self.words is None:
            return None
        place = str(log) if not str(log).startswith("-") else f"./{log}"
        return " ".join(["palpate identify", *map(shlex.quote, (place, *self.words))])


@dataclass(frozen=True)
class Seen:
    """Properties of a column before its role is known.

    Args:
        place: from 0.
        name: as the file has it.
        values: in its own unit, shape (n,); NaN where there is none.
        unit: that the file states.
        clock: it holds dates and times.
    """

    place: int
    name: str
    values: Array
    unit: str | None
    clock: bool

    @cached_property
    def step(self) -> float:
        """From value to value, the typical one."""
        step = np.diff(self.values)
        return float(np.median(step)) if len(step) and np.isfinite(step).any() else 0.0

    @cached_property
    def is_time(self) -> bool:
        """Whether it grows in even steps, as a time does."""
        step = np.diff(self.values)
        return len(step) > 2 and bool((step > 0).all() and np.median(step) > 0.5 * np.mean(step))

    @cached_property
    def counts_rows(self) -> bool:
        """Whether it counts 0, 1, 2, ... or 1, 2, 3, ..."""
        return len(self.values) > 2 and self.values[0] in {0, 1} and bool((np.diff(self.values) == 1).all())

    @property
    def named_time(self) -> bool:
        """Whether its name, its unit or its kind is that of a time."""
        return self.clock or self.score("time", "time") > 0

    @cached_property
    def changes(self) -> bool:
        """Whether it holds more than two different numbers."""
        there = self.values[np.isfinite(self.values)]
        return len(np.unique(there[:100_000])) > 2

    @cached_property
    def span(self) -> float:
        """From its least to its largest, without a rare outlier on either side."""
        low, high = np.nanpercentile(self.values, [1, 99])
        return float(high - low)

    def score(self, role: str, quantity: str) -> int:
        """Evidence for a role: its unit, then its name."""
        own = self.unit or unit_in_name(self.name, quantity)
        fits = own is not None and known_unit(own) and unit(own).quantity == quantity
        contradicts = bool(self.unit) and not fits and self.unit != "1"
        return 2 * fits + bool(re.search(_NAMES[role], self.name, re.I)) - 3 * contradicts


def for_a_run() -> Proposal:
    """A record that palpate wrote says everything itself."""
    return Proposal(())


def from_columns(table: Columns, seen: Sequence[Seen], delimiter: str | None = None) -> Proposal:
    """The command for a log of columns."""
    guesses: list[str] = []
    length = max((len(own.values) for own in seen), default=0)
    own = [column for column in seen if len(column.values) == length]
    words = [] if delimiter is None else ["--delimiter", delimiter]
    timing, clock = _timing(table, own, guesses)
    others = [column for column in own if column is not clock and column.changes and not column.counts_rows]
    space = _in_space(table, others, guesses)
    if space:
        return Proposal((*words, *timing, *space), tuple(guesses))
    pair = _pair(others, guesses)
    if pair is None:
        return Proposal(None, ("no two columns are a position and a force",))
    position, force = pair
    words += [*timing, "--position", _with_unit(table, position, "length", guesses)]
    return Proposal((*words, "--force", _with_unit(table, force, "force", guesses)), tuple(guesses))


def clock_of(table: Columns, seen: Sequence[Seen]) -> Seen | None:
    """The column of the time: one with even steps, preferably with the name or the unit of a time.

    One that counts rows is none, unless it is called a time; where the file states its rate, it must be called so too.
    """
    times = [own for own in seen if own.is_time and (own.named_time or not own.counts_rows)]
    best = max(times, key=lambda own: (own.clock, own.score("time", "time")), default=None)
    return None if best and table.rate is not None and not best.named_time else best


def _timing(table: Columns, seen: Sequence[Seen], guesses: list[str]) -> tuple[list[str], Seen | None]:
    """The words for the time, and its column."""
    clock = clock_of(table, seen)
    if clock is None and table.rate is not None:
        return [], None
    if clock is None:
        guesses.append(f"the log does not state its rate: --rate {_RATE} is only an example")
        return ["--rate", f"{_RATE}"], None
    if not clock.named_time:
        guesses.append(f"{clock.name!r} is used as the time: it has even steps")
    call = _call(table, clock)
    symbol = clock.unit or unit_in_name(clock.name, "time")
    if symbol is None and not clock.clock:
        counted = "ms" if clock.counts_rows else usual_unit(clock.step)
        symbol = epoch_unit(float(clock.values[0]), clock.step) or counted
        if symbol != "s":
            guesses.append(
                f"the time is assumed to be in {symbol}: it would be {1 / clock.step:.3g} rows a second in s"
            )
    return ["--time", call if symbol in {None, "s"} else f"{call}:{symbol}"], clock


def _pair(seen: Sequence[Seen], guesses: list[str]) -> tuple[Seen, Seen] | None:
    """Position and force: by units and names, or else the two columns that move together most."""
    forces = _best(seen, lambda own: own.score("force", "force"))
    force = forces[0] if forces else None
    places = _best([own for own in seen if own is not force], lambda own: own.score("position", "length"))
    position = places[0] if places else None
    if position and force:
        if len(forces) > 1 or len(places) > 1:
            left = [own.name for own in (*forces[1:], *places[1:])]
            others = ", ".join(left[:8])
            text = f"{position.name!r} and {force.name!r} are used; the names of {others} fit too"
            guesses.append(text)
        return position, force
    known = position or force
    if known:
        other = max(
            (own for own in seen if own is not known), key=lambda own: _together(own, known), default=None
        )
        if other is None:
            return None
        guesses.append(f"{other.name!r} is used: of all columns it correlates most with {known.name!r}")
        return (known, other) if position else (other, known)
    pairs = [(a, b) for i, a in enumerate(seen[:40]) for b in seen[i + 1 : 40]]
    if not pairs:
        return None
    found = max(pairs, key=lambda pair: _together(*pair))
    smooth = sorted(found, key=_roughness)
    guesses.append(
        f"the columns have no names: {smooth[0].name!r} and {smooth[1].name!r} move together most,"
        " and the smoother is taken for the position"
    )
    return smooth[0], smooth[1]


def _best(seen: Sequence[Seen], score: Callable[[Seen], int]) -> list[Seen]:
    """The columns of the highest score, if one is above 0."""
    most = max(map(score, seen), default=0)
    return [own for own in seen if score(own) == most] if most > 0 else []


def _together(one: Seen, other: Seen) -> float:
    """How closely the ranks of two columns agree, from 0 to 1."""
    from scipy.stats import spearmanr

    there = np.isfinite(one.values) & np.isfinite(other.values)
    rows = np.flatnonzero(there)[:: max(1, int(there.sum()) // 5000)]
    if len(rows) < 4 or np.ptp(one.values[rows]) == 0 or np.ptp(other.values[rows]) == 0:
        return 0.0
    return abs(float(spearmanr(one.values[rows], other.values[rows]).statistic))


def _roughness(own: Seen) -> float:
    """The typical bend from row to row, as a share of the span."""
    values = own.values[np.isfinite(own.values)]
    return (
        float(np.mean(np.abs(np.diff(values, 2)))) / own.span if own.span > 0 and len(values) > 2 else np.inf
    )


def _with_unit(table: Columns, own: Seen, quantity: str, guesses: list[str]) -> str:
    """A column's name and unit; an unstated unit is guessed from the size of its values."""
    call = _call(table, own)
    symbol = own.unit or unit_in_name(own.name, quantity)
    if symbol:
        return f"{call}:{symbol}"
    tail = re.search(r"(?:[_\[(]\s*)([A-Za-z]{1,3})\s*[\])]?$", own.name)
    if tail and not known_unit(tail[1]) and tail[1][0].isupper():
        guesses.append(f"{own.name!r} is taken as plain numbers, as {tail[1]} is no unit of {quantity}")
        return f"{call}:1"
    limit, small, large = _SIZES[quantity]
    symbol = large if own.span > limit else small
    guesses.append(f"no unit is given for {own.name!r}, which goes over {own.span:.3g}: {symbol} is a guess")
    return f"{call}:{symbol}"


def _call(table: Columns, own: Seen) -> str:
    """Identifier of a column: its name, or its number if the name would be misread."""
    plain = re.fullmatch(r"[^\W\d-][^\x00-\x1f\x7f-\x9f,:]*", own.name) is not None
    return own.name if plain and table.names.count(own.name) == 1 else str(own.place)


def _in_space(table: Columns, seen: Sequence[Seen], guesses: list[str]) -> list[str]:
    """The words for a wrench and a pose in three dimensions, where six columns or more are named so."""
    force = _triple(seen, r"(?:f|force)[_. ]?{}")
    place = _triple(seen, r"(?:(?:pos|position|p|x|tcp|tip)[_. ]?)?{}")
    if not (force and place):
        return []
    torque, turn = (
        _triple(seen, r"(?:t|m|torque|moment)[_. ]?{}"),
        _triple(seen, r"(?:q|quaternion|orientation)[_. ]?{}", "xyzw"),
    )
    guesses.append(
        "the wrench's axes are taken for the base's: say --wrench-frame tool if they are the tool's"
    )
    wrench = [_with_unit(table, own, "force", guesses) for own in force] + [
        _call(table, own) for own in torque
    ]
    pose = [_with_unit(table, own, "length", guesses) for own in place] + [_call(table, own) for own in turn]
    return ["--wrench", ",".join(wrench), "--pose", ",".join(pose), "--wrench-frame", "base"]


def _triple(seen: Sequence[Seen], pattern: str, axes: str = "xyz") -> list[Seen]:
    """The columns of all axes whose names end as a pattern does, before a unit; none if one is missing."""
    found = []
    for axis in axes:
        ends = re.compile(rf"(?:^|.*[_. ]){pattern.format(axis)}(?:[_ ]*[\[(]?[A-Za-z]{{1,3}}[\])]?)?", re.I)
        own = next((column for column in seen if ends.fullmatch(column.name) and column not in found), None)
        if own is None:
            return []
        found.append(own)
    return found


def from_topics(bag: Bag, fields: Mapping[str, Sequence[str]]) -> Proposal:
    """The command for a bag."""
    there = [topic for topic in bag.topics.values() if topic.count and topic.known]
    guesses: list[str] = []
    wrench = _topic([topic for topic in there if is_wrench(topic.kind)], "wrench", guesses)
    pose = _topic([topic for topic in there if is_pose(topic.kind)], "pose", guesses)
    if wrench and pose:
        words = ["--wrench", wrench.name, "--pose", pose.name]
        named = all(_frame(bag, topic) for topic in (wrench, pose))
        if not named:
            guesses.append(
                "the wrench's axes are taken for the tool's: say --wrench-frame base if they are the base's"
            )
        return Proposal((*words, *(() if named else ("--wrench-frame", "tool"))), tuple(guesses))
    found = _joint(bag, fields, guesses) or _fields_by_name(fields, guesses)
    return (
        Proposal(found, tuple(guesses))
        if found
        else Proposal(None, ("no two topics are a position and a force",))
    )


def _topic(topics: Sequence[Topic], what: str, guesses: list[str]) -> Topic | None:
    """The topic with most messages; one of the base's own frames before another's."""
    if len(topics) > 1:
        others = ", ".join(topic.name for topic in topics[:8])
        best = max(topics, key=lambda topic: (not topic.parent, topic.count))
        guesses.append(f"{best.name} is taken for the {what}; there are {others}")
        return best
    return topics[0] if topics else None


def _frame(bag: Bag, topic: Topic) -> str:
    header = getattr(bag.first(topic.name), "header", None)
    return str(getattr(header, "frame_id", ""))


def _joint(bag: Bag, fields: Mapping[str, Sequence[str]], guesses: list[str]) -> tuple[str, ...] | None:
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
        return "--position", f"{name}.position.{joint}:m", "--force", f"{name}.effort.{joint}:N"
    return None


def _fields_by_name(fields: Mapping[str, Sequence[str]], guesses: list[str]) -> tuple[str, ...] | None:
    """Two fields that are called as a force and a position are."""
    paths = [f"{name}.{path}" for name, own in fields.items() for path in own]
    found = []
    for role in ("position", "force"):
        fits = [path for path in paths if re.search(_NAMES[role], path, re.I) and path not in found]
        if not fits:
            return None
        found += [next((path for path in fits if path.endswith("z")), fits[0])]
    guesses.append("the two fields are taken by their names")
    return "--position", f"{found[0]}:m", "--force", f"{found[1]}:N"
