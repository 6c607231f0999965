"""Bags opened by the library that knows them, or, where they are cut, read as far as they are whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.errors import InputError
from palpate.logs.bags.scan_bag1 import scan_bag1
from palpate.logs.bags.scan_mcap import scan_mcap
from palpate.logs.bags.scan_sqlite import scan_sqlite
from palpate.logs.bags.scanning import End, Raw
from palpate.logs.kinds import STORAGES, Kind, kind_of

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

_SCANS = {Kind.BAG1: scan_bag1, Kind.MCAP: scan_mcap, Kind.SQLITE: scan_sqlite}


class Reader(Protocol):
    """What rosbags' readers and those of damaged bags have in common."""

    @property
    def connections(self) -> Collection[Connection]:
        """Topics with their types."""
        ...

    def messages(self, connections: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """Connection, time of recording [ns] and serialised message, of some connections."""
        ...

    def close(self) -> None:
        """Let the file go."""
        ...


class CutReader:
    """A bag read from its beginning to its end, or to where it is cut.

    Args:
        path: the file.
        kind: what it is.
    """

    def __init__(self, path: Path, kind: Kind) -> None:
        self.path = path
        self._scan = _SCANS[kind]
        self.end = End(finished=False)
        connections: dict[int, Connection] = {}
        counts: Counter[int] = Counter()
        for item in self._items():
            if isinstance(item, Raw):
                counts[item.channel] += 1
            elif isinstance(item, End):
                self.end = item
            else:
                connections[item.id] = item
        self.connections = [c._replace(msgcount=counts[c.id]) for c in connections.values()]
        self.count = sum(c.msgcount for c in self.connections)

    def messages(self, connections: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """The whole messages of some connections."""
        wanted = {c.id: c for c in connections}
        for item in self._items():
            if isinstance(item, Raw) and item.channel in wanted:
                yield wanted[item.channel], item.received, item.data

    def _items(self) -> Iterator[Connection | Raw | End]:
        """What the file holds up to its end, or to whatever in it cannot be read."""
        try:
            yield from self._scan(self.path)
        except (ImportError, PermissionError):
            raise
        except Exception:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
            return

    @property
    def said(self) -> str:
        """That it is cut, and how much is lost."""
        if self.end.share == 0:
            return (
                f"{self.path} has lost the end of its index; all {self.count} messages are there and are read"
            )
        lost = "what came after" if self.end.share is None else f"{self.end.share:.1%} of the file"
        whole = f"{self.count} messages are whole and are read"
        return f"{self.path} is cut short or was never closed: {whole}, {lost} is lost"

    def close(self) -> None:
        """Nothing is held open."""


class Parts:
    """The files of one ROS 2 bag, one after the other, where they cannot be read together."""

    def __init__(self, readers: Collection[Reader]) -> None:
        self._readers = list(readers)

    @property
    def connections(self) -> list[Connection]:
        """Of all files; each knows its own."""
        return [c for reader in self._readers for c in reader.connections]

    def messages(self, connections: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """File by file."""
        for reader in self._readers:
            own = [c for c in reader.connections if any(c is wanted for wanted in connections)]
            if own:
                yield from reader.messages(own)

    def close(self) -> None:
        """Close all files."""
        for reader in self._readers:
            reader.close()


def open_bag(path: Path, kind: Kind) -> tuple[Reader, list[str]]:
    """A reader of a bag, and what is wrong with the bag.

    Raises:
        InputError: nothing of it can be read, or the library that reads bags is not installed.
    """
    try:
        return _whole(path, kind), []
    except ImportError:
        raise InputError(
            "bags need the library rosbags; install it with: pip install 'palpate[bags]'"
        ) from None
    except PermissionError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
        return open_damaged(path, kind, first_line(error))


def open_damaged(path: Path, kind: Kind, trouble: str) -> tuple[Reader, list[str]]:
    """A reader of what is whole in a bag that the library does not read, and how much is lost.

    Raises:
        InputError: nothing is whole.
    """
    if kind is Kind.FOLDER:
        return _parts(path, trouble)
    reader = CutReader(path, kind)
    if not reader.count:
        raise InputError(f"{path} cannot be read as {kind.value} ({trouble}); record or copy it again")
    return reader, [] if reader.end.finished else [reader.said]


def _whole(path: Path, kind: Kind) -> Reader:
    from rosbags.rosbag1 import Reader as Bag1
    from rosbags.rosbag2 import Reader as Bag2
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    readers: dict[Kind, Any] = {
        Kind.BAG1: Bag1,
        Kind.FOLDER: Bag2,
        Kind.MCAP: McapReader,
        Kind.SQLITE: Sqlite3Reader,
    }
    reader = readers[kind](path)
    reader.open()
    return reader


def _parts(folder: Path, trouble: str) -> tuple[Reader, list[str]]:
    """The files of a bag by themselves, where its metadata is missing or one of them is damaged."""
    files = sorted(file for file in folder.iterdir() if file.suffix in STORAGES)
    if not files:
        raise InputError(
            f"{folder} cannot be read as a ROS 2 bag ({trouble}); it holds no .mcap or .db3 file"
        )
    readers: list[Reader] = []
    said = []
    for file in files:
        kind = kind_of(file)
        if not kind.is_bag:
            raise InputError(f"{file} is no storage of a bag; record or copy it again")
        cut = CutReader(file, kind)
        readers.append(cut)
        said += [] if cut.end.finished else [cut.said]
    return Parts(readers), said or [f"{folder}: {trouble}; its files are read one by one"]


def first_line(error: Exception) -> str:
    """What an error of a library says, in a line."""
    return (str(error).splitlines() or [""])[0].rstrip(".") or type(error).__name__
