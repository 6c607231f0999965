"""The proposed command of a log, from its names, units and values."""

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from itertools import combinations, islice
from pathlib import Path

import numpy as np

from palpate.logs import columns as statistics
from palpate.logs.columns import ColumnStatistics
from palpate.logs.naming import OTHER_UNITS
from palpate.logs.presets import preset, preset_among
from palpate.logs.roles import epoch_unit, usual_unit
from palpate.logs.tables.sheet import Sheet
from palpate.text import shorten
from palpate.units import unit, unit_in_name

_SIZES = {
    "length": (0.5, "m", "mm"),
    "force": (1000.0, "N", "g"),
    "torque": (np.inf, "Nm", "Nm"),
    "angle": (2 * np.pi, "rad", "deg"),
    "velocity": (5.0, "m/s", "mm/s"),
    "angular velocity": (20.0, "rad/s", "deg/s"),
}
"""Largest plausible range in SI units, and the assumed unit above it."""
_MIN_POSITION_STEPS = 20
"""Steps of its resolution that a position moves over at least: from fewer no stiffness is known to 5 %."""
_MIN_RANK_CORRELATION = 0.3
"""Rank correlation of a force with its position above which it follows: 1 - (1 - c)^3 where it follows in a share c of
the rows and is noise in the others, so that a contact over a ninth of the log is seen."""
_MIN_EXPLAINED_POWER = 0.5
"""Share of the power of a column that is named a force above which it follows a filtered position: of two columns of
noise it is under a tenth (`filtered_power`)."""
_MAX_PAIRS = 800
"""Most pairs of columns that are compared, the 780 of 40 columns without names among them: that takes seconds."""
_NO_PAIR = "no two columns are a position that moves and a force that follows it"
_UNNAMED = "the columns have no names, and their numbers do not tell the position from the force: name both"
_MAX_UNNAMED = 3
"""Columns without names that are told apart by their numbers: a position, and two that follow it."""
_MIN_ROUGHER = 2.0
"""Roughness of a force over that of its position, above which the smoother of two columns is taken for the position:
two readings of one quantity have 1.0, and a force has 15 and more in the tests."""
_JOINTS_ONLY = (
    "the columns are those of libfranka's logToCSV: joints and their torques, without wrench and pose of the tip;"
    " record O_F_ext_hat_K and O_T_EE of RobotState with its time, which --preset franka reads"
)
_MAX_STATE_RATE = 1000
"""Fastest rate at which an arm's controller gives its state [Hz]: that of libfranka; UR's is 500."""
_EXAMPLE_RATE = 1000
"""Rate in the printed example [Hz]; no result depends on it."""


MAX_LISTED = 8
"""Logs side by side in one table that are proposed each; of more, the first one and their number."""
PRESS = "identify it"
WEIGH = "weigh the tool on the sensor"
FRICTION = "identify the friction of the axis"
SLIDE = "identify the friction of the slide in it"
"""Purposes of a command."""


@dataclass(frozen=True)
class Proposal:
    """Options of `palpate identify LOG` or `palpate payload LOG`, and what of them is guessed.

    Args:
        options: by name, as `wrench_frame`; None if the log does not suffice.
        guesses: a sentence each.
        facts: what the log shows of itself, likewise.
        purpose: of the command, as words behind `to`.
        beside: logs side by side in the table, of which it is one.
        fallback: a second proposal, for a log that the first is refused for, or of which it identifies nothing.
    """

    options: Mapping[str, str] | None
    guesses: tuple[str, ...] = ()
    facts: tuple[str, ...] = ()
    purpose: str = PRESS
    fallback: "Proposal | None" = None
    beside: int = 1

    @property
    def verb(self) -> str:
        """The command: `identify` or `payload`."""
        return "payload" if self.purpose == WEIGH else "identify"

    @property
    def elsewhere(self) -> bool:
        """True if no surface is identified: a tool is weighed, or an axis has friction."""
        return self.purpose in {WEIGH, FRICTION}

    @property
    def words(self) -> tuple[str, ...] | None:
        """The options as words of the command line."""
        if self.options is None:
            return None
        named = ((f"--{name.replace('_', '-')}", value) for name, value in self.options.items())
        return tuple(word for pair in named for word in pair if word)

    def command(self, log: Path) -> str | None:
        """The whole command, to be pasted into a shell."""
        words = self.words
        if words is None:
            return None
        path = str(log) if not str(log).startswith("-") else f"./{log}"
        return " ".join([f"palpate {self.verb}", *map(shlex.quote, (path, *words))])


def from_columns(
    table: Sheet, columns: Sequence[ColumnStatistics], given: Mapping[str, str]
) -> tuple[Proposal, ...]:
    """The commands for a table: of a preset, of a wrench and a pose, or of two columns, one for each log in it.

    Args:
        table: the names and what the file states.
        columns: of it, in its order.
        given: options that each command repeats.
    """
    lengths = sorted({len(column.values) for column in columns}, reverse=True)
    tables = [[column for column in columns if len(column.values) == length] for length in lengths]
    rows = next(filter(_presses, tables), tables[0] if tables else [])
    members = {_member(column.name): column for column in rows}
    name = preset_among(members)
    if name is not None:
        return (_by_preset(table, name, rows, members, given),)
    if all(f"{part}[{i}]" in members for part in ("q", "tau_ext_hat_filtered") for i in range(7)):
        return (Proposal(None, (_JOINTS_ONLY,)),)
    groups = side_by_side(rows)
    several = len(groups) > MAX_LISTED
    beside = f"one of {len(groups)} logs side by side"
    proposals = [
        replace(
            proposal,
            facts=(f"{label!r}, {beside}{', which differ by that word' if several else ''}", *proposal.facts),
            beside=len(groups),
        )
        for label, group in islice(groups.items(), 1 if several else None)
        if (proposal := _one_log(table, group, given)).options is not None
    ]
    return tuple(proposals) or (_one_log(table, rows, given),)


def _presses(rows: Sequence[ColumnStatistics]) -> bool:
    """True if the names of one table of a file, as a sheet or a group of channels, say a position and a force."""
    kinds = {column.named.kind for column in rows}
    return {"position", "force"} <= kinds and len(rows[0].values) >= _MIN_POSITION_STEPS


def _by_preset(
    table: Sheet,
    name: str,
    rows: Sequence[ColumnStatistics],
    members: Mapping[str, ColumnStatistics],
    given: Mapping[str, str],
) -> Proposal:
    """The command for a log that has all columns of a preset."""
    guesses: list[str] = []
    facts = _motion(name, members)
    if "time" in preset(name):
        return Proposal({**given, "preset": name}, (), facts)
    timing, clock = _timing(table, rows, guesses)
    timing, guesses = _state_time(clock) if clock else (timing, guesses)
    usual = {key: preset(name)[key] for key in ("wrench", "pose")}
    chosen = {
        key: ",".join(members[member].name for member in value.split(",")) for key, value in usual.items()
    }
    changed = {} if chosen == usual else chosen
    return Proposal({**given, "preset": name, **timing, **changed}, tuple(guesses), facts)


def _one_log(table: Sheet, rows: Sequence[ColumnStatistics], given: Mapping[str, str]) -> Proposal:
    """The command for columns that are of one log."""
    guesses: list[str] = []
    timing, clock = _timing(table, rows, guesses)
    usable = [column for column in rows if column is not clock and column.named.kind != "time"]
    space = _in_space(table, usable, {**given, **timing}, tuple(guesses))
    if space is not None:
        return space
    unique: dict[tuple[str | None, bytes], ColumnStatistics] = {}
    for column in usable:
        if column.changes and not column.counts_rows:
            unique.setdefault(_identity(column), column)
    other = None if table.spring else _friction(table, [*unique.values()], {**given, **timing}, (*guesses,))
    other = _in_plane(table, usable, {**given, **timing}, (*guesses,), other) or other
    pair = _pair([*unique.values()], guesses, certain=table.spring is not None)
    if pair is None:
        return other or Proposal(None, (_lacking(usable),))
    position, force = pair
    position_spec = _with_unit(table, position, "length", guesses)
    force_spec = _with_unit(table, force, "force", guesses)
    options = {**given, **timing, "position": position_spec, "force": force_spec}
    facts = []
    if table.spring and 0 < table.spring < np.inf:
        options["robot_stiffness"] = f"{table.spring:g}"
        facts.append(
            f"the cantilever of {table.spring:g} N/m, as the file states, is between position and surface"
        )
    return Proposal(options, tuple(guesses), tuple(facts), fallback=other)


_MIN_OPPOSED = 0.5
"""Correlation of a force with the direction of the motion above which it may be a friction."""
_SPEED = re.compile(r"vel|speed|twist|qd|dq|omega|rate", re.IGNORECASE)
"""Names of a speed."""


def _friction(
    table: Sheet, columns: Sequence[ColumnStatistics], options: Mapping[str, str], guesses: Sequence[str]
) -> Proposal | None:
    """The command for the friction of an axis: a force or a torque that changes its sign with the direction."""
    speeds = [c for c in columns if c.named.kind == "other" and _SPEED.search(c.name) and c.counts > 2]
    places = [c for c in columns if c.named.kind in {"position", "joint", "orientation"}]
    places = [c for c in places if c.counts >= _MIN_POSITION_STEPS]
    loads = [c for c in columns if c.named.kind in {"force", "torque"}]
    pairs = [
        (opposed, load, motion)
        for motion in (_measured(speeds) or _measured(places))
        for load in _measured(loads)
        if _of_one_number(motion, load)
        and not (load.named.kind == "torque" and motion.named.kind == "position" and motion.named.axis)
        and load.named.axis in {"", motion.named.axis or load.named.axis}
        and (opposed := statistics.direction_correlation(motion, load, speed=motion in speeds)) > _MIN_OPPOSED
    ]
    if not pairs:
        return None
    _, load, motion = max(pairs, key=lambda pair: pair[0])
    notes = [*guesses]
    turns = load.named.kind == "torque" or motion.named.kind in {"joint", "orientation"}
    if motion in speeds:
        name, spec = "velocity", _with_unit(table, motion, "angular velocity" if turns else "velocity", notes)
    else:
        name, spec = "position", _with_unit(table, motion, "angle" if turns else "length", notes)
    named = {name: spec, "force_column": _with_unit(table, load, "torque" if turns else "force", notes)}
    facts = [f"{load.name!r} has the direction of the motion: a friction"]
    across = [c for c in loads if c is not load and c.named.kind == "force" and load.named.kind == "force"]
    if len(across) == 1:
        facts.append(
            f"{across[0].name!r} is across the motion, {np.nanmean(across[0].values):.3g} on average: a slide's"
            " coefficient is Fc over it"
        )
    coupled = [c.name for c in speeds if not _of_one_number(motion, c) and statistics.moves_as(motion, c)]
    if coupled:
        facts.append(f"{coupled[0]!r} moves with it: if the two are coupled, the friction is that of both")
    none = Proposal(None, (_lacking(columns),))
    return Proposal({**options, **named, "friction": ""}, tuple(notes), tuple(facts), FRICTION, none)


def _lacking(columns: Sequence[ColumnStatistics]) -> str:
    """The signal that a log lacks, and what the log is good for."""
    forces = [column.name for column in columns if column.named.kind == "force"]
    places = [column.name for column in columns if column.named.kind == "position"]
    moving = [column for column in columns if column.counts >= _MIN_POSITION_STEPS]
    joints = [column.name for column in columns if column.named.kind == "joint"]
    if forces and not places and not any(column.may_be("position") for column in moving):
        listed = shorten(", ".join(forces), _LISTED)
        return (
            f"a force ({listed}) and no position that moves: join the log of the positions with --join FILE; with the"
            " orientation of the sensor in free motion, palpate payload weighs its tool"
        )
    if joints and not places and not forces:
        listed = shorten(", ".join(joints), _LISTED)
        return f"joints ({listed}) and no position and force of the tip: record these, or join them with --join FILE"
    if places and not forces and not any(column.may_be("force") for column in moving):
        listed = shorten(", ".join(places), _LISTED)
        return f"a position ({listed}) and no force: join the log of the force with --join FILE"
    return _UNNAMED if moving[1:] and all(column.named.kind is None for column in moving) else _NO_PAIR


_LISTED = 80
"""Letters of a list of names."""
_NO_LABEL = {
    "x",
    "y",
    "z",
    "w",
    "raw",
    "filtered",
    "filt",
    "target",
    "actual",
    "measured",
    "desired",
    "cmd",
    "left",
    "right",
}
"""Tokens by which names differ within one log."""


def side_by_side(columns: Sequence[ColumnStatistics]) -> dict[str, list[ColumnStatistics]]:
    """The columns of each log of a table that holds several side by side, by label; none of a table of one log.

    Names repeat (Time, Extension, Load twice), or differ by one word (extend and retract) or number.
    """
    repeated = _repeats(columns)
    if len(repeated) > 1:
        return repeated
    families: dict[str, dict[tuple[str, ...], dict[str, ColumnStatistics]]] = {}
    for column in columns:
        kind, stem = column.named.kind, column.named.stem
        for i, token in enumerate(stem):
            rest = (*stem[:i], "", *stem[i + 1 :], column.named.axis)
            named = any(part.isalpha() for part in rest)
            if named and kind in {"time", "position", "force"} and token not in _NO_LABEL:
                families.setdefault(kind, {}).setdefault(rest, {}).setdefault(token, column)
    for places in families.get("position", {}).values():
        for forces in families.get("force", {}).values():
            if len(places) > 1 and places.keys() == forces.keys() and "0" not in places:
                times = next(
                    (
                        family
                        for family in families.get("time", {}).values()
                        if family.keys() == places.keys()
                    ),
                    {},
                )
                alone = [column for column in columns if column.named.kind == "time"] if not times else []
                return {
                    label: [*alone, *([times[label]] if times else []), places[label], forces[label]]
                    for label in places
                }
    return {}


def _repeats(columns: Sequence[ColumnStatistics]) -> dict[str, list[ColumnStatistics]]:
    """The columns of each repetition of a table's names, by the names' first and last."""
    counts: dict[str, int] = {}
    groups: dict[int, list[ColumnStatistics]] = {}
    bases = {column.name for column in columns}
    for column in columns:
        base = re.sub(r"\.\d+$", "", column.name)  # pandas numbers repeated names
        name = base if base in bases else column.name
        groups.setdefault(counts.get(name, 0), []).append(column)
        counts[name] = counts.get(name, 0) + 1
    kinds = [{column.named.kind for column in group} for group in groups.values()]
    if len(groups) < 2 or not all({"position", "force"} <= kind for kind in kinds):
        return {}
    alone = [column for column in groups[0] if column.named.kind == "time"]
    return {
        f"columns {group[0].place} to {group[-1].place}": group if "time" in kind else [*alone, *group]
        for group, kind in zip(groups.values(), kinds, strict=True)
    }


def _identity(column: ColumnStatistics) -> tuple[str | None, bytes]:
    """Kind of column, and a digest of its numbers: those of 1 N/mm are the same in two quantities."""
    numbers = np.where(np.isnan(column.values), np.nan, column.values) + 0.0  # one NaN, one zero
    return column.named.kind, blake2b(numbers.tobytes()).digest()


def _stem(column: ColumnStatistics) -> str:
    """The letters that a column's name begins with, which the channels of one device share: AI of AI0 and AI1."""
    letters = re.match(r"[^\W\d_]+", column.name)
    return letters[0] if letters else ""


def _member(name: str) -> str:
    """The member of a driver's state that a column holds: `O_T_EE[3]` of `state.O_T_EE[3]` and `O_T_EE_3`."""
    return re.sub(
        r"^(?:state\.)?((?:O_T_EE|O_F_ext_hat_K|q|tau_ext_hat_filtered))[\[_.](\d+)\]?$", r"\1[\2]", name
    )


def _state_time(clock: ColumnStatistics) -> tuple[dict[str, str], list[str]]:
    """The time of a driver's states: no controller gives them faster than `_MAX_STATE_RATE`, which leaves one unit."""
    symbol = next((s for s in ("us", "ms") if clock.step * unit(s).factor * _MAX_STATE_RATE > 0.5), "s")
    return {"time": clock.name if symbol == "s" else f"{clock.name}:{symbol}"}, []


def _motion(name: str, members: Mapping[str, ColumnStatistics]) -> tuple[str, ...]:
    """Sentence on the motion and the force in a log of a preset's columns."""
    options = preset(name)
    used = [members[column] for key in ("wrench", "pose") for column in options[key].split(",")]
    count = f"all {len(used) + ('time' in options)} columns of the preset {name} are there"
    forces = used[:3]
    places = used[6:]
    if options["rotation"].startswith("matrix"):
        places = [
            places[i] for i in ((12, 13, 14) if options["rotation"] == "matrix-by-columns" else (3, 7, 11))
        ]
    axis = int(np.argmax([place.span for place in places[:3]]))
    travel = 1e3 * places[axis].span
    force = forces[axis].span
    return (f"{count}; the tool moves {travel:.3g} mm along {'xyz'[axis]}, with a force of {force:.3g} N",)


def clock_of(table: Sheet, columns: Sequence[ColumnStatistics]) -> ColumnStatistics | None:
    """The column of the time: one with even steps, preferably with the name or the unit of a time.

    One that counts rows is none, unless it is called a time; where the file states its rate, it must be called so too.
    """
    times = [
        column
        for column in columns
        if column.may_be("time") and column.is_time and (column.named_time or not column.counts_rows)
    ]
    best = max(times, key=lambda column: (column.clock, column.score("time", "time")), default=None)
    return None if best and table.rate is not None and not best.named_time else best


def time_factor(clock: ColumnStatistics) -> float:
    """Factor from a time's own unit to seconds."""
    if clock.clock:
        return 1.0
    symbol = clock.unit or unit_in_name(clock.name, "time") or epoch_unit(float(clock.finite[0]), clock.step)
    return unit(symbol).factor if symbol and unit(symbol).quantity == "time" else 1.0


def _timing(
    table: Sheet, columns: Sequence[ColumnStatistics], guesses: list[str]
) -> tuple[dict[str, str], ColumnStatistics | None]:
    """The option for the time, and its column."""
    clock = clock_of(table, columns)
    if clock is None and table.rate is not None:
        return {}, None
    if clock is None:
        place = next(
            (column for column in columns if column.named.kind == "position" and column.changes), None
        )
        if table.speed and place:
            length = unit(place.unit or unit_in_name(place.name, "length") or "m").factor
            step = float(np.median(np.abs(np.diff(place.finite)))) * length
            if step > 0:
                return {"rate": f"{table.speed / step:.4g}"}, None
        named = [column.name for column in columns if column.named.kind == "time"]
        none = f"{named[0]!r} is no time that is read, and " if named else ""
        guesses.append(f"{none}the log does not state its rate: --rate {_EXAMPLE_RATE} is only an example")
        return {"rate": f"{_EXAMPLE_RATE}"}, None
    if not clock.named_time:
        guesses.append(f"{clock.name!r} is used as the time: it has even steps")
    call = _call(table, clock)
    symbol = clock.unit or unit_in_name(clock.name, "time")
    if symbol is None and not clock.clock:
        counted = "ms" if clock.counts_rows else usual_unit(clock.step)
        symbol = epoch_unit(float(clock.finite[0]), clock.step) or counted
        if symbol != "s":
            guesses.append(
                f"the time is assumed to be in {symbol}: it would be {1 / clock.step:.3g} rows a second in s"
            )
    return {"time": call if symbol in {None, "s"} else f"{call}:{symbol}"}, clock


def _pair(
    columns: Sequence[ColumnStatistics], guesses: list[str], *, certain: bool
) -> tuple[ColumnStatistics, ColumnStatistics] | None:
    """Position and force: by units and names, or else the two columns that move together most.

    A column that hardly moves is no position, and one that does not follow it is no force, unless it is certain that
    the named ones are a press, as in a file of force curves.
    """
    moving = [
        column for column in columns if column.may_be("position") and column.counts >= _MIN_POSITION_STEPS
    ]
    loads = [column for column in columns if column.may_be("force")]
    forces = _best(_measured(loads), lambda column: column.score("force", "force"))
    places = _best(_measured(moving), lambda column: column.score("position", "length"))
    places = places[:_MAX_PAIRS]
    places = [
        candidate
        for candidate in places
        if not any(candidate is not p and statistics.is_rate(candidate, p) for p in places)
    ]
    candidates = (
        (a, b) for a in places or moving for b in forces or loads if a is not b and _of_one_number(a, b)
    )
    by_name = bool(places and forces)
    follow = [
        pair
        for pair in islice(candidates if places or forces else combinations(moving[:40], 2), _MAX_PAIRS)
        if (by_name and certain)
        or statistics.rank_correlation(*pair) > _MIN_RANK_CORRELATION
        or (by_name and statistics.explained_power(*pair) > _MIN_EXPLAINED_POWER)
    ]
    pairs = [pair for pair in follow if not statistics.is_one_reading(*pair)]
    if not pairs:
        return None
    position, force = max(
        pairs,
        key=lambda pair: (
            _stem(pair[0]) == _stem(pair[1]),
            _of_one_axis(*pair),
            statistics.rank_correlation(*pair),
        ),
    )
    if _of_one_axis(position, force):
        pairs = [pair for pair in pairs if _of_one_axis(*pair)]
    others = [column for pair in pairs for column in pair if column not in (position, force)]
    if by_name and others:
        listed = ", ".join([*dict.fromkeys(column.name for column in others)][:8])
        guesses.append(f"{position.name!r} and {force.name!r} are used; the names of {listed} fit too")
    elif not by_name and (places or forces):
        reference, partner = (position, force) if places else (force, position)
        guesses.append(f"{partner.name!r} is used: of all columns it correlates most with {reference.name!r}")
    elif not by_name:
        return _pair_without_names((position, force), moving, others, guesses)
    return position, force


def _pair_without_names(
    pair: tuple[ColumnStatistics, ColumnStatistics],
    moving: Sequence[ColumnStatistics],
    others: Sequence[ColumnStatistics],
    guesses: list[str],
) -> tuple[ColumnStatistics, ColumnStatistics] | None:
    """Position and force of two columns that move together: the smoother is the position, or what moves both."""
    smooth, rough = sorted(pair, key=statistics.roughness)
    cause = _cause(moving, smooth, rough)
    alike = statistics.roughness(rough) < _MIN_ROUGHER * statistics.roughness(smooth)
    if (alike and not cause) or (len(moving) > _MAX_UNNAMED and not _other_units(others, (smooth, rough))):
        return None
    position, force = (smooth, rough) if cause is None else (cause, smooth)
    longest_travel = _SIZES["length"][0] / unit(_SIZES["length"][2]).factor  # of a probe, in m or mm
    if position.span > longest_travel:
        return None
    why = "the smoother is" if cause is None else f"both follow the motion of {cause.name!r}, which is"
    guesses.append(
        f"the columns have no names: {smooth.name!r} and {rough.name!r} move together most, and {why} taken for"
        " the position"
    )
    return position, force


def _other_units(columns: Sequence[ColumnStatistics], chosen: Sequence[ColumnStatistics]) -> bool:
    """True if each of the columns is one of the chosen ones in another unit."""
    return all(any(statistics.is_one_reading(a, b) for b in chosen) for a in columns)


def _measured(columns: Sequence[ColumnStatistics]) -> Sequence[ColumnStatistics]:
    """The columns of measured values; those of desired ones where there are no others."""
    return [column for column in columns if not column.named.command] or columns


def _of_one_axis(position: ColumnStatistics, force: ColumnStatistics) -> bool:
    """True if the names of a position and a force say the same axis."""
    return bool(position.named.axis) and position.named.axis == force.named.axis


def _of_one_number(position: ColumnStatistics, force: ColumnStatistics) -> bool:
    """False if the names of a position and a force are words for both with different numbers: two devices, or axes."""
    numbers = [re.findall(r"\d+", " ".join(column.named.stem)) for column in (position, force)]
    worded = position.named.worded and force.named.worded
    return not (worded and all(numbers) and numbers[0] != numbers[1])


def _cause(moving: Sequence[ColumnStatistics], *pair: ColumnStatistics) -> ColumnStatistics | None:
    """The finest of the smoother columns whose motion both of a pair follow, as friction does, and not its place."""
    causes = [
        column
        for column in moving[:40]
        if statistics.roughness(column) < min(map(statistics.roughness, pair))
        and all(statistics.rank_correlation(column, response) <= _MIN_RANK_CORRELATION for response in pair)
        and all(statistics.filtered_power(column, response) > _MIN_EXPLAINED_POWER for response in pair)
    ]
    return max(causes, key=lambda column: column.counts, default=None)


def _best(
    columns: Sequence[ColumnStatistics], score: Callable[[ColumnStatistics], int]
) -> list[ColumnStatistics]:
    """The columns of the highest score, if one is above 0."""
    best = max(map(score, columns), default=0)
    return [column for column in columns if score(column) == best] if best > 0 else []


def _with_unit(table: Sheet, column: ColumnStatistics, quantity: str, guesses: list[str]) -> str:
    """A column's name and unit; an unstated unit is guessed from the size of its values."""
    call = _call(table, column)
    symbol = column.unit or unit_in_name(column.name, quantity)
    if symbol is None and _MESSAGE.search(column.name):
        symbol = {"length": "m", "force": "N"}[quantity]
    if symbol:
        return f"{call}:{symbol}"
    tail = re.search(r"(?:[_\[(]\s*)([A-Za-z]{1,3})\s*[\])]?$", column.name)
    if tail and tail[1].lower() in OTHER_UNITS:
        guesses.append(f"{column.name!r} is taken as plain numbers, as {tail[1]} is no unit of {quantity}")
        return f"{call}:1"
    limit, small, large = _SIZES[quantity]
    symbol = large if column.span > limit else small
    guesses.append(
        f"no unit is given for {column.name!r}, which goes over {column.span:.3g}: {symbol} is a guess"
    )
    return f"{call}:{symbol}"


_MESSAGE = re.compile(r"wrench\.force\.[xyz]$|(?:pose\.position|transform\.translation)\.[xyz]$")
"""Fields of ROS messages, which are SI by their definition."""


def _call(table: Sheet, column: ColumnStatistics) -> str:
    """Identifier of a column: its name, or its number if the name would be misread."""
    plain = re.fullmatch(r"[^\W\d-][^\x00-\x1f\x7f-\x9f,:]*", column.name) is not None
    return column.name if plain and table.names.count(column.name) == 1 else str(column.place)


def _in_plane(
    table: Sheet,
    columns: Sequence[ColumnStatistics],
    options: Mapping[str, str],
    timing: tuple[str, ...],
    friction: Proposal | None,
) -> Proposal | None:
    """The command for a slide with a force and a position along two axes; if it is none, its friction."""
    for axes in ("xz", "yz", "xy"):
        guesses = [*timing]
        force = _triple(columns, "force", guesses, axes)
        position = _triple(columns, "position", guesses, axes)
        if force and position and all(column.changes for column in (*force, *position)):
            named = {
                option: ",".join(
                    _with_unit(table, vector[axes.index(axis)], quantity, guesses) if axis in axes else "-"
                    for axis in "xyz"
                )
                for option, vector, quantity in (("wrench", force, "force"), ("pose", position, "length"))
            }
            named |= {"wrench_frame": "base"}
            none = friction or Proposal(None, (_lacking(columns),))
            return Proposal({**options, **named}, (*guesses, _AXES_OF_BASE), (), SLIDE, none)
    return None


_AXES_OF_BASE = "the wrench's axes are taken for the base's: say --wrench-frame tool if they are the tool's"


def _in_space(
    table: Sheet, columns: Sequence[ColumnStatistics], options: Mapping[str, str], timing: tuple[str, ...]
) -> Proposal | None:
    """The command for a wrench and a pose in three dimensions: a tool that turns is weighed, a press identified."""
    guesses = [*timing]
    force = _triple(columns, "force", guesses)
    position = _triple(columns, "position", guesses)
    if not (force and position and any(column.changes for column in force)):
        return None
    torque = _triple(columns, "torque", [])
    turn = _triple(columns, "orientation", [], "xyzw")
    turned = bool(turn) and _turn(turn) > _MIN_TURN
    if not turned and max(column.counts for column in position) < _MIN_POSITION_STEPS:
        return None
    wrench = [_with_unit(table, column, "force", guesses) for column in force]
    wrench += [_call(table, column) for column in torque]
    pose = [_with_unit(table, column, "length", guesses) for column in position]
    pose += [_call(table, column) for column in turn]
    named = {**options, "wrench": ",".join(wrench), "pose": ",".join(pose)}
    moves = max(column.counts for column in position) >= _MIN_POSITION_STEPS
    press = Proposal({**named, "wrench_frame": "base"}, (*guesses, _AXES_OF_BASE)) if moves else None
    if not turned:
        return press
    axes = "the wrench's axes are taken for the tool's: say --wrench-frame base if they are the base's"
    angle = f"the tool turns by up to {np.degrees(_turn(turn)):.0f} degrees"
    return Proposal({**named, "wrench_frame": "tool"}, (*guesses, axes), (angle,), WEIGH, press)


_MIN_TURN = np.radians(30.0)
"""Smallest turn of a log by which a tool may be weighed [rad]: that which `palpate payload` asks for."""


def _turn(quaternion: Sequence[ColumnStatistics]) -> float:
    """Largest angle between the first orientation and another [rad]."""
    rows = np.column_stack([column.values for column in quaternion])
    rows = rows[np.isfinite(rows).all(axis=1)]
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    if len(rows) < 2 or not (np.abs(size - 1.0) < 0.1).all():
        return 0.0
    cosines = np.abs((rows / size) @ (rows[0] / size[0]))
    return float(2 * np.arccos(np.clip(cosines.min(), 0.0, 1.0)))


def _triple(
    columns: Sequence[ColumnStatistics], kind: str, guesses: list[str], axes: str = "xyz"
) -> list[ColumnStatistics]:
    """The columns of a quantity along all axes; none if one is missing.

    Of several such sets it is the first that was measured and changes.
    """
    sets: dict[tuple[str, ...], dict[str, ColumnStatistics]] = {}
    for column in columns:
        if column.named.kind == kind and column.named.axis and len(column.finite):
            sets.setdefault(column.named.stem, {}).setdefault(column.named.axis, column)
    whole = [[axis_of[axis] for axis in axes] for axis_of in sets.values() if {*axes} <= axis_of.keys()]
    if not whole:
        return []
    best = max(
        whole,
        key=lambda triple: (not triple[0].named.command, any(column.changes for column in triple)),
    )
    if len(whole) > 1:
        others = ", ".join(triple[0].name for triple in whole if triple is not best)
        guesses.append(f"{best[0].name!r} and its axes are used; those of {shorten(others, _LISTED)} fit too")
    return best
