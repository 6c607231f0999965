"""The files of a bag read from their beginnings, as far as they are whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from palpate.errors import InputError
from palpate.files.limits import Budget
from palpate.logs.bags.scan_bag1 import scan_bag1
from palpate.logs.bags.scan_mcap import scan_mcap
from palpate.logs.bags.scan_sqlite import scan_sqlite
from palpate.logs.bags.scanning import ZSTD, Channel, End, Raw, unpack_file, unpack_message
from palpate.logs.kinds import PACKED, STORAGES, Kind, kind_of

_SCANS = {Kind.BAG1: scan_bag1, Kind.MCAP: scan_mcap, Kind.SQLITE: scan_sqlite}
_LATEST = 2**63
_METADATA = 10_000_000
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

    def __init__(self, path: Path, kind: Kind, budget: Budget, *, packed: bool = False) -> None:
        self.path, self._budget, self._packed = path, budget, packed
        self._scan = _SCANS[kind]
        self.end = End(finished=False)
        self.channels: dict[int, Channel] = {}
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
                if isinstance(item, Raw):
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

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Channel, int, bytes]]:
        """Channel, time of recording [ns] and serialised message, of some topics."""
        try:
            for item in self._items():
                if isinstance(item, Raw) and self.channels[item.channel].topic in topics:
                    yield self.channels[item.channel], item.received, self._unpack(item)
        except _DamageError:
            return

    def _unpack(self, item: Raw) -> bytes:
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

    def _items(self) -> Iterator[Channel | Raw | End]:
        """Content of the file up to its end, or to the first unreadable part."""
        try:
            for item in self._scan(self.path, self._budget):
                if isinstance(item, Raw) and not (
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
        """Of its whole messages."""
        return self.counts.total()

    @property
    def complaint(self) -> str | None:
        """That it is cut, and how much is lost; None if it is whole."""
        if self.end.finished:
            return None
        if self.end.share == 0:
            return f"{self.path} has a truncated index; all {self.count} messages are there and are read"
        lost = "what came after" if self.end.share is None else f"{self.end.share:.1%} of the file"
        whole = f"{self.count} complete messages are read"
        return f"{self.path} is cut short or was never closed: {whole}, {lost} is lost"


class _DamageError(Exception):
    """Something in the file cannot be read."""


def open_files(
    path: Path, kind: Kind, budget: Budget, unpacked: TemporaryDirectory[str]
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
    places = sorted(place for place in path.iterdir() if _is_storage(place))
    if not places:
        raise InputError(f"{path} cannot be read as a ROS 2 bag; it holds no .mcap or .db3 file")
    missing = {PurePath(name).name for name in about.relative_file_paths} - {place.name for place in places}
    troubles += [f"{path}: {name} is missing, which its metadata.yaml names" for name in sorted(missing)]
    files = []
    for place in places:
        file = _unpack_whole(place, budget, unpacked) if place.suffix == PACKED else place
        found = kind_of(file)
        if found not in _SCANS:
            raise InputError(f"{place} is no storage of a bag; record or copy it again")
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
    if not path.is_file() or path.stat().st_size > _METADATA:
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


def _unpack_whole(path: Path, budget: Budget, to: TemporaryDirectory[str]) -> Path:
    """A file that was packed as a whole, unpacked."""
    kind_of(path)
    place = Path(to.name) / path.stem
    try:
        with path.open("rb") as source, place.open("wb") as file:
            unpack_file(source, file, budget)
    except (ImportError, InputError, PermissionError):
        raise
    except Exception as error:  # noqa: BLE001 - likewise
        if not place.stat().st_size:
            raise InputError(
                f"{path} cannot be unpacked ({first_line(error)}); record or copy it again"
            ) from None
    return place


def first_line(error: Exception) -> str:
    """Message of a library's error, in a line."""
    return (str(error).splitlines() or [""])[0].rstrip(".") or type(error).__name__
