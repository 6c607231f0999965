"""Presses with their places: from a table, or from logs that hold the pose."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, PalpateError
from palpate.from_log import LogIdentifier
from palpate.logs.formats import kind_of, open_table
from palpate.logs.read import is_run, read_log
from palpate.logs.roles import POSE, WRENCH
from palpate.logs.signals import Signals
from palpate.logs.tables.parquet import stored_about
from palpate.logs.tables.sheet import Sheet
from palpate.units import split_spec, unit, unit_in_name

if TYPE_CHECKING:
    from palpate.identification.result import Identification

AXES = ("x", "y", "z")
_NAMES = {"stiffness": ("stiffness", "K", "k"), "half": ("half", "half_width", "K_half")}
_QUANTITIES = {"stiffness": "stiffness", "half": "stiffness"} | dict.fromkeys(AXES, "length")


@dataclass(frozen=True)
class Presses:
    """Presses at places.

    Args:
        places: (n, 2) or (n, 3) [m].
        stiffness: (n,) [N/m].
        half: half-width of each 95 % interval (n,) [N/m].
        names: of the presses: a log's name, or a row of the table.
        refused: logs that give no stiffness, by name, each with the reason.
        line: number of the line or log of each press, whose presses share an error (n,); None without.
        frames: of the places, where logs name them, each with a press in it; more than one is refused.

    Raises:
        InputError: the places are in two frames.
    """

    places: Array
    stiffness: Array
    half: Array
    names: Sequence[str]
    refused: dict[str, str] = field(default_factory=dict)
    line: Array | None = None
    frames: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.frames) > 1:
            (frame, first), (second_frame, second), *_ = self.frames.items()
            raise InputError(
                f"{first} has its place in the frame {frame!r}, {second} in {second_frame!r}; a map has one frame: "
                "map them apart, or give both poses in one frame"
            )


def merge_presses(parts: Sequence[Presses]) -> Presses:
    """The presses of several readings.

    Raises:
        InputError: the places have two and three coordinates, or are in two frames.
    """
    if len({part.places.shape[1] for part in parts}) > 1:
        raise InputError(
            "some places have two coordinates and some three: a map has one frame; map them apart"
        )
    line = None
    if any(p.line is not None for p in parts):
        lines = [np.zeros(len(p.stiffness)) if p.line is None else p.line - p.line.min() for p in parts]
        ends = np.cumsum([0.0, *(numbers.max() + 1.0 for numbers in lines)])
        line = np.concatenate([numbers + end for numbers, end in zip(lines, ends[:-1], strict=True)])
    return Presses(
        places=np.vstack([p.places for p in parts]),
        stiffness=np.concatenate([p.stiffness for p in parts]),
        half=np.concatenate([p.half for p in parts]),
        names=[name for p in parts for name in p.names],
        refused={name: why for p in parts for name, why in p.refused.items()},
        line=line,
        frames={frame: name for p in reversed(parts) for frame, name in p.frames.items()},
    )


def read_table(path: Path, columns: Sequence[str] = ()) -> Presses:
    """Presses from a table with a row each.

    Args:
        path: of text, Parquet, a spreadsheet or a MATLAB file.
        columns: of x, y, stiffness and half, or of x, y, z, stiffness and half, each NAME or NAME:UNIT; by the names
            x, y, z, stiffness or K, and half if none are given. A name such as x_mm carries its unit.

    A column `frame` or `frame_id` names the frame of each place.

    Raises:
        InputError: a column is missing, a number is none, or the places are in two frames.
    """
    sheet = open_table(path, kind_of(path))
    roles = _roles(sheet, columns)
    places = [sheet.resolve(split_spec(spec)[0]) for spec in roles.values()]
    values = {}
    for (role, spec), place, numbers in zip(roles.items(), places, sheet.numbers(places, ()), strict=True):
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise InputError(f"{path}: row {bad[0] + 1} has no {role}; remove the row, or fill it in")
        values[role] = numbers * _factor(role, spec, sheet.names[place])
    where = np.column_stack([values[axis] for axis in AXES if axis in values])
    names = [f"row {i + 1}" for i in range(len(where))]
    line = sheet.numbers([sheet.resolve("line")], ())[0] if "line" in sheet.names else None
    return Presses(where, values["stiffness"], values["half"], names, line=line, frames=_frames(sheet))


def _frames(sheet: Sheet) -> dict[str, str]:
    """Frames that a column of the table names, each with its first row; two at most, which already are one too many."""
    frames: dict[str, str] = {}
    for name in {"frame", "frame_id"} & {*sheet.names}:
        while len(frames) < 2:
            (cells,), _ = sheet.read([sheet.resolve(name)], tuple(frames))
            if cells.wrong is None:  # every word is one of these frames
                break
            row, frame = cells.wrong
            frames[frame] = row
    return frames


def _roles(sheet: Sheet, columns: Sequence[str]) -> dict[str, str]:
    if columns:
        if len(columns) not in (4, 5):
            raise InputError(
                f"--columns needs x,y,stiffness,half or x,y,z,stiffness,half, got {len(columns)} names"
            )
        return dict(zip((*AXES[: len(columns) - 2], "stiffness", "half"), columns, strict=True))
    plain = {_without_unit(name, _QUANTITIES[role]): name for role in _QUANTITIES for name in sheet.names}
    roles = {role: plain[name] for role in _QUANTITIES for name in _NAMES.get(role, (role,)) if name in plain}
    lacking = [role for role in ("x", "y", "stiffness", "half") if role not in roles]
    if lacking:
        raise InputError(
            f"{sheet.path} has no column {', '.join(lacking)}; name them with --columns x,y,stiffness,half; there are: "
            f"{', '.join(sheet.names[:12])}"
        )
    return {role: roles[role] for role in _QUANTITIES if role in roles}


def _without_unit(name: str, quantity: str) -> str:
    symbol = unit_in_name(name, quantity)
    return (
        name
        if symbol is None
        else name.rstrip(" ])").replace("[", "_").replace("(", "_").rsplit("_", 1)[0].strip()
    )


def _factor(role: str, spec: str, name: str) -> float:
    symbol = split_spec(spec)[1] or unit_in_name(name, _QUANTITIES[role])
    if symbol is None:
        return 1.0
    if unit(symbol).quantity != _QUANTITIES[role]:
        raise InputError(
            f"{symbol!r} of {name!r} is a unit of {unit(symbol).quantity}; {role} needs one of {_QUANTITIES[role]}"
        )
    return unit(symbol).factor


def read_logs(
    logs: Sequence[Path],
    identifier: LogIdentifier,
    place: Sequence[str] = (),
    each_contact: bool = False,
    track: Callable[[Sequence[Path]], Iterable[Path]] = iter,
) -> Presses:
    """Identify presses, each at the place of its pose while it presses.

    Args:
        logs: their paths.
        identifier: options of reading and identification.
        place: columns of the place, x,y or x,y,z, each NAME or NAME:UNIT; the pose's position if none are given.
        each_contact: whether each contact of a log is a press of its own; else a log is one press.
        track: shows the progress.

    Returns:
        The presses with a stiffness; a log or a contact without one is refused with its reason.

    Raises:
        InputError: no log has a place and a stiffness.
    """
    places = []
    numbers = []
    names = []
    refused = dict[str, str]()
    frames: dict[str, str] = {}
    lines = list[int]()
    twice = len({log.name for log in logs}) < len(logs)
    for number, log in enumerate(track(logs)):
        title = f"{log.parent.name}/{log.name}" if twice else log.name
        try:
            parts = _contacts(log, identifier, title) if each_contact else {title: identifier}
        except (PalpateError, OSError) as error:
            parts, refused[title] = {}, " ".join(str(error).split())
        for name, part in parts.items():
            try:
                where, frame = (_named_place(log, part, place), "") if place else _pose_of(log, part)
                numbers.append(_stiffness(part.identify(log)[0]))
            except (PalpateError, OSError) as error:
                refused[name] = " ".join(str(error).split())
                continue
            frames.setdefault(frame, name)
            places.append(where)
            names.append(name)
            lines.append(number)
    if not places:
        raise InputError(
            f"none of {len(logs)} logs gives a press with a place: {next(iter(refused.values()))}"
        )
    stiffness, half = np.array(numbers).T
    line = np.array(lines, dtype=float) if each_contact else None
    return Presses(np.array(places), stiffness, half, names, refused, line, frames)


def _contacts(log: Path, identifier: LogIdentifier, title: str) -> dict[str, LogIdentifier]:
    """An identifier of each contact with half of the free motion before and after it."""
    contacts = identifier.identify(log)[0].contacts
    ends = [0.5 * (before + after) for (_, before), (after, _) in pairwise(contacts)]
    first = identifier.signals.start or 0.0
    cuts = [identifier.signals.start, *(first + end for end in ends), identifier.signals.end]
    return {
        f"{title}, contact {k + 1}": replace(
            identifier, signals=replace(identifier.signals, start=start, end=end)
        )
        for k, (start, end) in enumerate(pairwise(cuts))
    }


def _stiffness(result: Identification) -> tuple[float, float]:
    """Stiffness and half-width at the working point, else of the model."""
    point = result.working_point
    for parameter in ([point.stiffness] if point else []) + [result.parameters.get("K")]:
        if parameter is not None and parameter.value is not None and parameter.ci95 is not None:
            low, high = parameter.ci95
            return float(parameter.value), 0.5 * float(high - low)
    raise InputError("its stiffness is not identified; palpate identify says why")


def _named_place(log: Path, identifier: LogIdentifier, columns: Sequence[str]) -> Array:
    """The median of each column of the place over the rows that are read."""
    if len(columns) not in (2, 3):
        raise InputError(f"--place needs the columns x,y or x,y,z, got {len(columns)}")
    signals = _completed_signals(log, identifier)
    reading = ("start", "end", "missing", "limits", "rate", "delimiter", *(["time"] if signals.time else []))
    options: dict[str, Any] = {name: getattr(signals, name) for name in reading}
    named: dict[str, Any] = dict(zip(POSE, columns, strict=False))
    record = read_log(log, **options, **named)
    return np.array([np.nanmedian(record[role]) for role in named])


def _pose_of(log: Path, identifier: LogIdentifier) -> tuple[Array, str]:
    """A press' place, and its frame or "".

    The place is the median position of the pose while the force is above half of its largest; of a simulated press the
    one that it states, in the base of its arm.
    """
    signals = _completed_signals(log, identifier)
    about = stored_about(log) if is_run(log) else None
    if about is not None and "place_m" in about.meta:
        return np.array(about.meta["place_m"], dtype=float), str(about.meta["arm"])
    columns = (*WRENCH[:3], *POSE[:3])
    if about is not None and {*columns} <= {*about.units}:
        named: dict[str, Any] = {name: name for name in ("t", *columns)}
        record = read_log(log, start=signals.start, end=signals.end, time=named.pop("t"), **named)
    else:
        record = signals.read(log)
    if "force_x" not in record.columns:
        raise InputError(
            f"{log} has no place: it holds one axis; name its columns with --place x,y, or give a log with a pose"
        )
    force = np.column_stack([record[name] for name in columns[:3]])
    size = np.linalg.norm(force - np.nanmedian(force[: max(len(force) // 50, 1)], axis=0), axis=1)
    pressed = size >= 0.5 * np.nanmax(size)
    position = np.array([np.nanmedian(record[name][pressed]) for name in columns[3:]])
    return position, record.meta.get("frames", {}).get(POSE[0], "")


def _completed_signals(log: Path, identifier: LogIdentifier) -> Signals:
    """The signals with what the log's own names leave no doubt of."""
    known_frame = identifier.frame.wrench_frame is not None
    return identifier.signals.complete(log, known_frame=known_frame)[0]
