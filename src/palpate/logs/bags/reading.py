"""The files of a bag read from their beginnings, as far as they are whole."""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from operator import attrgetter
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.files.reading import ReadingBudget
from palpate.logs.bags.scanning import (
    ZSTD,
    End,
    RawMessage,
    TopicInFile,
    scan_bag1,
    scan_mcap,
    scan_sqlite,
    unpack_file,
    unpack_message,
)
from palpate.logs.formats import PACKED, STORAGES, Kind, kind_of
from palpate.signals.rotations import quaternion_from_columns

_SCANS = {Kind.BAG1: scan_bag1, Kind.MCAP: scan_mcap, Kind.SQLITE: scan_sqlite}
_LATEST = 2**63
_MAX_METADATA = 10_000_000
"""No metadata is longer [bytes]."""


class Storage:
    """One file of a bag, read to its end, or to where it is cut.

    Args:
        path: the file.
        kind: what it is.
        budget: of the log.
        packed: whether each message is packed by itself.

    Raises:
        InputError: nothing of it can be read.
        ImportError: the library that reads bags is not installed.
    """

    def __init__(self, path: Path, kind: Kind, budget: ReadingBudget, *, packed: bool = False) -> None:
        self.path, self._budget, self._packed = path, budget, packed
        self._scan = _SCANS[kind]
        self.end = End(finished=False)
        self.channels: dict[int, TopicInFile] = {}
        self.counts: Counter[int] = Counter()
        self.spans: dict[int, tuple[int, int]] = {}
        trouble = self._look()
        if not self.counts and not (self.end.finished and self.channels):
            trouble = trouble or "it has no complete message"
            raise InputError(f"{path} cannot be read as {kind.value} ({trouble}); record or copy it again")

    def _look(self) -> str:
        """Find channels, counts and times; what ended it early."""
        try:
            for item in self._items():
                if isinstance(item, RawMessage):
                    self.counts[item.channel] += 1
                    first, last = self.spans.get(item.channel, (item.received, item.received))
                    self.spans[item.channel] = min(first, item.received), max(last, item.received)
                elif isinstance(item, End):
                    self.end = item
                else:
                    self.channels[item.number] = item
        except _DamageError as error:
            return str(error)
        return ""

    def messages(self, topics: Collection[str]) -> Iterator[tuple[TopicInFile, int, bytes]]:
        """Channel, time of recording [ns] and serialised message, of some topics."""
        try:
            for item in self._items():
                if isinstance(item, RawMessage) and self.channels[item.channel].topic in topics:
                    yield self.channels[item.channel], item.received, self._unpack(item)
        except _DamageError:
            return

    def _unpack(self, item: RawMessage) -> bytes:
        """A message; one that its bag's metadata calls packed may be plain, as recorders pack what gains by it."""
        if not (self._packed and item.data.startswith(ZSTD)):
            return item.data
        try:
            return unpack_message(item.data, self._budget)
        except (ImportError, InputError):
            raise
        except Exception as error:  # noqa: BLE001 - a damaged message fails in as many ways as there are bytes
            topic = self.channels[item.channel].topic
            text = (
                f"{self.path}: a message on {topic} cannot be unpacked ({first_line(error)}); record it again"
            )
            raise InputError(text) from None

    def _items(self) -> Iterator[TopicInFile | RawMessage | End]:
        """Content of the file up to its end, or to the first unreadable part."""
        try:
            for item in self._scan(self.path, self._budget):
                if isinstance(item, RawMessage) and not (
                    item.channel in self.channels and 0 <= item.received < _LATEST
                ):
                    return
                yield item
        except (ImportError, PermissionError, InputError):
            raise
        except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
            raise _DamageError(first_line(error)) from None

    @property
    def count(self) -> int:
        """Number of its complete messages."""
        return self.counts.total()

    @property
    def complaint(self) -> str | None:
        """The sentence that says how much of the file is lost; None if it is whole."""
        if self.end.finished:
            return None
        if self.end.share == 0:
            return f"{self.path} has a truncated index; all {self.count} messages are there and are read"
        lost = "what came after" if self.end.share is None else f"{self.end.share:.1%} of the file"
        complete = f"{self.count} complete messages are read"
        return f"{self.path} is cut short or was never closed: {complete}, {lost} is lost"


class _DamageError(Exception):
    """Something in the file cannot be read."""


def open_files(
    path: Path, kind: Kind, budget: ReadingBudget, unpacked: TemporaryDirectory[str]
) -> tuple[list[Storage], list[str]]:
    """The files of a bag in the order of time, and what is wrong with them.

    Args:
        path: of the file or the folder.
        kind: what it is.
        budget: of the log.
        unpacked: where files that are packed as a whole are unpacked to.

    Raises:
        InputError: nothing of it can be read.
        ImportError: the library that reads bags is not installed.
    """
    if kind is not Kind.FOLDER:
        files = [Storage(path, kind, budget)]
        return files, [file.complaint for file in files if file.complaint]
    about, troubles = _metadata(path)
    places = sorted(entry for entry in path.iterdir() if _is_storage(entry))
    if not places:
        raise InputError(f"{path} cannot be read as a ROS 2 bag; it holds no .mcap or .db3 file")
    missing = {PurePath(name).name for name in about.relative_file_paths} - {entry.name for entry in places}
    troubles += [f"{path}: {name} is missing, which its metadata.yaml names" for name in sorted(missing)]
    files = []
    for entry in places:
        file = _unpack_whole(entry, budget, unpacked) if entry.suffix == PACKED else entry
        found = kind_of(file)
        if found not in _SCANS:
            raise InputError(f"{entry} is no storage of a bag; record or copy it again")
        files.append(Storage(file, found, budget, packed=about.compression_mode.lower() == "message"))
    files.sort(key=lambda file: min((first for first, _ in file.spans.values()), default=0))
    return files, [*troubles, *(file.complaint for file in files if file.complaint)]


class _About(msgspec.Struct, frozen=True):
    """The used part of a bag's metadata."""

    relative_file_paths: list[str] = []
    compression_mode: str = ""


def _metadata(folder: Path) -> tuple[_About, list[str]]:
    """The bag's metadata.yaml, and its fault."""
    path = folder / "metadata.yaml"
    if not path.is_file() or path.stat().st_size > _MAX_METADATA:
        return _About(), [f"{folder} has no metadata.yaml; its files are read one by one"]
    try:
        from ruamel.yaml import YAML

        content: Any = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
        return msgspec.convert(content["rosbag2_bagfile_information"], _About), []
    except (ImportError, PermissionError):
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
        return _About(), [f"{path} is spoiled ({first_line(error)}); the bag's files are read one by one"]


def _is_storage(path: Path) -> bool:
    return path.suffix in STORAGES or (path.suffix == PACKED and path.with_suffix("").suffix in STORAGES)


def _unpack_whole(path: Path, budget: ReadingBudget, to: TemporaryDirectory[str]) -> Path:
    """A file that was packed as a whole, unpacked."""
    kind_of(path)
    target = Path(to.name) / path.stem
    try:
        with path.open("rb") as source, target.open("wb") as file:
            unpack_file(source, file, budget)
    except (ImportError, InputError, PermissionError):
        raise
    except Exception as error:  # noqa: BLE001 - likewise
        if not target.stat().st_size:
            raise InputError(
                f"{path} cannot be unpacked ({first_line(error)}); record or copy it again"
            ) from None
    return target


def first_line(error: Exception) -> str:
    """Message of a library's error, in a line."""
    return (str(error).splitlines() or [""])[0].rstrip(".") or type(error).__name__


_MAX_LISTED = 64
_TRANSFORM_NUMBERS = 16
"""Numbers of a homogeneous transform; its quaternion is `O_T_EE.qx` to `O_T_EE.qw`."""
_NUMBER = (int, float, np.number)


@dataclass(frozen=True)
class Stream:
    """Numbers of one topic over time.

    Args:
        topic: where they come from.
        received: when the recorder got each message [s], from the bag's beginning, shape (n,).
        stamped: the time in each message's own header on the same count [s], shape (n,); NaN without one.
        values: shape (n, k); NaN where there is no reading.
        frame: the frame that the first header names; empty without one.
    """

    topic: str
    received: Array
    stamped: Array
    values: Array
    frame: str = ""


def finder(paths: Sequence[str], topic: str, message: Any) -> Callable[[Any], Sequence[float]]:
    """A function that finds the numbers at some paths in messages of one type.

    A step of a path is a field's name. In a list it is a place from 0, or a name among the message's own `name`, as in
    `effort.elbow` of a JointState; NaN where that message does not hold it.

    Args:
        paths: of the fields.
        topic: of the messages.
        message: the first of them.

    Raises:
        InputError: a path leads to no number in it.
    """
    for path in paths:
        try:
            _number_at(path, message)
        except (AttributeError, TypeError, ValueError):
            raise no_field(topic, path, message) from None
    if len(paths) > 1 and not any(_passes_list(path, message) for path in paths):
        return attrgetter(*paths)  # many times as fast, where every message has the same fields
    return lambda other: [_number_at(path, other) for path in paths]


def _number_at(path: str, message: Any) -> float:
    owner = value = message
    steps = path.split(".")
    for at, step in enumerate(steps):
        if _is_list(value):
            return _in_list(value, getattr(owner, "name", ()), ".".join(steps[at:]))
        owner = value
        value = getattr(value, step)
    return float(value)


def _passes_list(path: str, message: Any) -> bool:
    value = message
    for step in path.split("."):
        if _is_list(value):
            return True
        value = getattr(value, step)
    return False


def no_field(topic: str, path: str, message: Any) -> InputError:
    """The error for a path that leads to no number; the numbers that there are, are listed."""
    names = [name for name, _ in leaves(message)]
    if not names:
        return InputError(f"{topic}: its messages hold no number; name another topic")
    return InputError(f"{topic}: {unknown('field', path, names)}")


def leaves(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """The paths of all numbers in a message, with their values; the header left out."""
    for field in fields(message):
        value = getattr(message, field.name)
        path = f"{prefix}{field.name}"
        if field.name == "header":
            continue
        if is_dataclass(value):
            yield from leaves(value, f"{path}.")
        elif _is_list(value):
            yield from _leaves_of_list(path, value, getattr(message, "name", ()))
        elif isinstance(value, _NUMBER):
            yield path, float(value)


def _leaves_of_list(path: str, value: Sequence[Any], names: Sequence[str]) -> Iterator[tuple[str, float]]:
    if len(value) and isinstance(value[0], _NUMBER):
        steps = names if len(names) == len(value) else range(min(len(value), _MAX_LISTED))
        yield from ((f"{path}.{step}", float(number)) for step, number in zip(steps, value, strict=False))


def _is_list(value: Any) -> bool:
    return isinstance(value, np.ndarray | list | tuple)


_QUATERNION = ("qx", "qy", "qz", "qw")


def _in_list(values: Sequence[Any], names: Sequence[str], step: str) -> float:
    if step in _QUATERNION and len(values) == _TRANSFORM_NUMBERS:
        return quaternion_from_columns(values)[_QUATERNION.index(step)]
    if step.isascii() and step.isdigit():
        index = int(step)
    elif step in names:
        index = list(names).index(step)
    else:
        return math.nan
    return float(values[index]) if index < len(values) else math.nan
