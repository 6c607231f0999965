"""The proposed `palpate identify` command of a log, from its names, units and values."""

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import combinations, islice
from pathlib import Path

import numpy as np

from palpate.logs import columns as statistics
from palpate.logs.columns import NAMES, ColumnStatistics
from palpate.logs.presets import preset, preset_among
from palpate.logs.roles import epoch_unit, usual_unit
from palpate.logs.tables.sheet import Sheet
from palpate.units import known_unit, unit, unit_in_name

_SIZES = {"length": (0.5, "m", "mm"), "force": (1000.0, "N", "g")}
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
_JOINTS_ONLY = (
    "the columns are those of libfranka's logToCSV: joints and their torques, without wrench and pose of the tip;"
    " record O_F_ext_hat_K and O_T_EE of RobotState with its time, which --preset franka reads"
)
_MAX_STATE_RATE = 1000
"""Fastest rate at which an arm's controller gives its state [Hz]: that of libfranka; UR's is 500."""
_EXAMPLE_RATE = 1000
"""Rate in the printed example [Hz]; no result depends on it."""


@dataclass(frozen=True)
class Proposal:
    """Options of `palpate identify LOG`, and what of them is guessed.

    Args:
        options: by name, as `wrench_frame`; None if the log does not suffice.
        guesses: a sentence each.
        facts: what the log shows of itself, likewise.
    """

    options: Mapping[str, str] | None
    guesses: tuple[str, ...] = ()
    facts: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...] | None:
        """The options as words of the command line."""
        if self.options is None:
            return None
        return tuple(
            word for name, value in self.options.items() for word in (f"--{name.replace('_', '-')}", value)
        )

    def command(self, log: Path) -> str | None:
        """The whole command, to be pasted into a shell."""
        words = self.words
        if words is None:
            return None
        path = str(log) if not str(log).startswith("-") else f"./{log}"
        return " ".join(["palpate identify", *map(shlex.quote, (path, *words))])


def from_columns(table: Sheet, columns: Sequence[ColumnStatistics], delimiter: str | None = None) -> Proposal:
    """The command for a log of columns: a preset whose columns are all there, a wrench and a pose, or two columns."""
    guesses: list[str] = []
    length = max((len(column.values) for column in columns), default=0)
    rows = [column for column in columns if len(column.values) == length]
    options = {} if delimiter is None else {"delimiter": delimiter}
    timing, clock = _timing(table, rows, guesses)
    members = {_member(column.name): column for column in rows}
    name = preset_among(members)
    if name is not None:
        facts = _motion(name, members)
        if "time" in preset(name):
            return Proposal({**options, "preset": name}, (), facts)
        timing, guesses = _state_time(clock) if clock else (timing, guesses)
        usual = {key: preset(name)[key] for key in ("wrench", "pose")}
        chosen = {
            key: ",".join(members[member].name for member in value.split(",")) for key, value in usual.items()
        }
        changed = {} if chosen == usual else chosen
        return Proposal({**options, "preset": name, **timing, **changed}, tuple(guesses), facts)
    if all(f"{part}[{i}]" in members for part in ("q", "tau_ext_hat_filtered") for i in range(7)):
        return Proposal(None, (_JOINTS_ONLY,))
    varying = [column for column in rows if column is not clock and column.changes and not column.counts_rows]
    unique: dict[tuple[bool, bool, bytes], ColumnStatistics] = {}
    for column in varying:
        unique.setdefault(_identity(column), column)
    varying = list(unique.values())
    space = _in_space(table, varying, guesses)
    if space:
        return Proposal({**options, **timing, **space}, tuple(guesses))
    pair = _pair(varying, guesses)
    if pair is None:
        return Proposal(None, (_NO_PAIR,))
    position, force = pair
    position_spec = _with_unit(table, position, "length", guesses)
    force_spec = _with_unit(table, force, "force", guesses)
    return Proposal({**options, **timing, "position": position_spec, "force": force_spec}, tuple(guesses))


def _identity(column: ColumnStatistics) -> tuple[bool, bool, bytes]:
    """Quantities of a column's name, and a digest of its numbers: those of 1 N/mm are the same in two quantities."""
    position, force = (
        bool(re.search(NAMES[kind], column.name, re.IGNORECASE)) for kind in ("position", "force")
    )
    numbers = np.where(np.isnan(column.values), np.nan, column.values) + 0.0  # one NaN, one zero
    return position, force, blake2b(numbers.tobytes()).digest()


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
    times = [column for column in columns if column.is_time and (column.named_time or not column.counts_rows)]
    best = max(times, key=lambda column: (column.clock, column.score("time", "time")), default=None)
    return None if best and table.rate is not None and not best.named_time else best


def _timing(
    table: Sheet, columns: Sequence[ColumnStatistics], guesses: list[str]
) -> tuple[dict[str, str], ColumnStatistics | None]:
    """The option for the time, and its column."""
    clock = clock_of(table, columns)
    if clock is None and table.rate is not None:
        return {}, None
    if clock is None:
        named = [name for name in table.names if re.search(NAMES["time"], name, re.IGNORECASE)]
        none = f"{named[0]!r} is no time that is read, and " if named else ""
        guesses.append(f"{none}the log does not state its rate: --rate {_EXAMPLE_RATE} is only an example")
        return {"rate": f"{_EXAMPLE_RATE}"}, None
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
    return {"time": call if symbol in {None, "s"} else f"{call}:{symbol}"}, clock


def _pair(
    columns: Sequence[ColumnStatistics], guesses: list[str]
) -> tuple[ColumnStatistics, ColumnStatistics] | None:
    """Position and force: by units and names, or else the two columns that move together most.

    A column that hardly moves is no position, and one that does not follow it is no force.
    """
    moving = [column for column in columns if column.counts >= _MIN_POSITION_STEPS]
    forces = _best(columns, lambda column: column.score("force", "force"))
    places = _best(
        [column for column in moving if column not in forces[:1]],
        lambda column: column.score("position", "length"),
    )
    places = places[:_MAX_PAIRS]
    places = [
        candidate
        for candidate in places
        if not any(candidate is not p and statistics.is_rate(candidate, p) for p in places)
    ]
    candidates = ((a, b) for a in places or moving for b in forces or columns if a is not b)
    by_name = bool(places and forces)
    follow = [
        pair
        for pair in islice(candidates if places or forces else combinations(moving[:40], 2), _MAX_PAIRS)
        if statistics.rank_correlation(*pair) > _MIN_RANK_CORRELATION
        or (by_name and statistics.explained_power(*pair) > _MIN_EXPLAINED_POWER)
    ]
    pairs = [pair for pair in follow if not statistics.is_one_reading(*pair)]
    if not pairs:
        return None
    position, force = max(
        pairs, key=lambda pair: (_stem(pair[0]) == _stem(pair[1]), statistics.rank_correlation(*pair))
    )
    unused = dict.fromkeys(
        column.name for pair in pairs for column in pair if column not in (position, force)
    )
    if by_name and unused:
        listed = ", ".join([*unused][:8])
        guesses.append(f"{position.name!r} and {force.name!r} are used; the names of {listed} fit too")
    elif not by_name and (places or forces):
        reference, partner = (position, force) if places else (force, position)
        guesses.append(f"{partner.name!r} is used: of all columns it correlates most with {reference.name!r}")
    elif not by_name:
        smooth, rough = sorted((position, force), key=statistics.roughness)
        cause = _cause(moving, smooth, rough)
        position, force = (smooth, rough) if cause is None else (cause, smooth)
        why = "the smoother is" if cause is None else f"both follow the motion of {cause.name!r}, which is"
        guesses.append(
            f"the columns have no names: {smooth.name!r} and {rough.name!r} move together most, and {why} taken for"
            " the position"
        )
    return position, force


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
    if symbol:
        return f"{call}:{symbol}"
    tail = re.search(r"(?:[_\[(]\s*)([A-Za-z]{1,3})\s*[\])]?$", column.name)
    if tail and not known_unit(tail[1]) and tail[1][0].isupper():
        guesses.append(f"{column.name!r} is taken as plain numbers, as {tail[1]} is no unit of {quantity}")
        return f"{call}:1"
    limit, small, large = _SIZES[quantity]
    symbol = large if column.span > limit else small
    guesses.append(
        f"no unit is given for {column.name!r}, which goes over {column.span:.3g}: {symbol} is a guess"
    )
    return f"{call}:{symbol}"


def _call(table: Sheet, column: ColumnStatistics) -> str:
    """Identifier of a column: its name, or its number if the name would be misread."""
    plain = re.fullmatch(r"[^\W\d-][^\x00-\x1f\x7f-\x9f,:]*", column.name) is not None
    return column.name if plain and table.names.count(column.name) == 1 else str(column.place)


def _in_space(table: Sheet, columns: Sequence[ColumnStatistics], guesses: list[str]) -> dict[str, str]:
    """The options for a wrench and a pose in three dimensions, where six columns or more are named so."""
    force = _triple(columns, r"(?:f|force)[_. ]?{}")
    position = _triple(columns, r"(?:(?:pos|position|p|x|tcp|tip)[_. ]?)?{}")
    if not (force and position and max(column.counts for column in position) >= _MIN_POSITION_STEPS):
        return {}
    torque = _triple(columns, r"(?:t|m|torque|moment)[_. ]?{}")
    turn = _triple(columns, r"(?:q|quaternion|orientation)[_. ]?{}", "xyzw")
    guesses.append(
        "the wrench's axes are taken for the base's: say --wrench-frame tool if they are the tool's"
    )
    wrench = [_with_unit(table, column, "force", guesses) for column in force] + [
        _call(table, column) for column in torque
    ]
    pose = [_with_unit(table, column, "length", guesses) for column in position] + [
        _call(table, column) for column in turn
    ]
    return {"wrench": ",".join(wrench), "pose": ",".join(pose), "wrench_frame": "base"}


def _triple(columns: Sequence[ColumnStatistics], pattern: str, axes: str = "xyz") -> list[ColumnStatistics]:
    """The columns of all axes whose names end as a pattern does, before a unit; none if one is missing."""
    triple = []
    for axis in axes:
        ends = re.compile(rf"(?:^|.*[_. ]){pattern.format(axis)}(?:[_ ]*[\[(]?[A-Za-z]{{1,3}}[\])]?)?", re.I)
        match = next(
            (column for column in columns if ends.fullmatch(column.name) and column not in triple), None
        )
        if match is None:
            return []
        triple.append(match)
    return triple
