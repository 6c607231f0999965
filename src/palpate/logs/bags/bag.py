"""A bag: its topics, and numbers of them over time."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from palpate.errors import InputError, unknown
from palpate.logs.bags.fields import Stream, finder, leaves, no_field
from palpate.logs.bags.reading import Reader, first_line, open_bag, open_damaged
from palpate.logs.kinds import Kind

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

T = TypeVar("T")


@dataclass(frozen=True)
class Topic:
    """One topic of a bag.

    Args:
        name: as `/wrench`.
        kind: the type of its messages, as `geometry_msgs/msg/WrenchStamped`.
        count: of its messages.
        known: whether the messages can be read: their type is defined in the bag, or is one of ROS 2's own.
    """

    name: str
    kind: str
    count: int
    known: bool


class Bag:
    """A bag of ROS 1 or ROS 2, whole or cut; open within `with`.

    Args:
        path: a file or a folder.
        kind: what it is.

    Raises:
        InputError: nothing of it can be read, or the library that reads bags is not installed.
    """

    def __init__(self, path: Path, kind: Kind) -> None:
        self.path, self.kind = path, kind
        self._take(*open_bag(path, kind))
        if not any(topic.count for topic in self.topics.values()):
            self.close()
            raise InputError(f"{path} holds no messages; record it again")

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let the file go."""
        self._reader.close()

    def _take(self, reader: Reader, troubles: list[str]) -> None:
        self._reader, self.troubles = reader, troubles
        self._types = _types(self._connections())
        self.topics = {name: self._topic(name) for name in sorted({c.topic for c in self._connections()})}

    def _connections(self) -> list[Connection]:
        return list(self._reader.connections)

    def _topic(self, name: str) -> Topic:
        own = [c for c in self._connections() if c.topic == name]
        kinds = sorted({c.msgtype for c in own})
        known = all(kind in self._types.fielddefs for kind in kinds)
        return Topic(name, " and ".join(kinds), sum(c.msgcount for c in own), known and len(kinds) == 1)

    def topic(self, name: str) -> Topic:
        """A topic that can be read.

        Raises:
            InputError: there is none of the name, it holds no messages, or their type is not known.
        """
        if name not in self.topics:
            raise InputError(f"{self.path}: {unknown('topic', name, self.topics)}")
        topic = self.topics[name]
        if not topic.count:
            raise InputError(f"{self.path}: no message came on {name}; name another topic")
        if not topic.known:
            raise InputError(
                f"{self.path}: the type of {name}, {topic.kind}, is not defined in the bag, and is not guessed at;"
                " record it as a type of geometry_msgs or sensor_msgs, or into an MCAP file, which holds definitions"
            )
        return topic

    def first(self, name: str) -> Any:
        """The first message of a topic."""
        self.topic(name)
        return self._unhurt(lambda: next(self._messages([name]))[2])

    def times(self) -> dict[str, tuple[float, float]]:
        """When the recorder got the first and the last message of each topic [s since 1970]."""

        def look() -> dict[str, tuple[int, int]]:
            found: dict[str, tuple[int, int]] = {}
            for name, received, _ in self._raw(list(self.topics)):
                first, last = found.get(name, (received, received))
                found[name] = (min(first, received), max(last, received))
            return found

        return {name: (first / 1e9, last / 1e9) for name, (first, last) in self._unhurt(look).items()}

    def streams(self, wanted: Mapping[str, Sequence[str]]) -> tuple[dict[str, Stream], float]:
        """Numbers of some topics, by topic the paths of its fields; and the time that they are counted from.

        Returns:
            A stream for each topic, and the bag's beginning [s since 1970].

        Raises:
            InputError: a topic or a field is missing, or its type is not known.
        """
        for name in wanted:
            self.topic(name)
        rows = self._unhurt(lambda: self._rows(wanted))
        for name, own in rows.items():
            if not own.received:
                raise InputError(f"{self.path}: no message on {name} is whole; record or copy it again")
        origin = min(min(own.received) for own in rows.values())
        streams = {name: own.stream(name, origin) for name, own in rows.items()}
        for name, paths in wanted.items():
            for path, column in zip(paths, streams[name].values.T, strict=True):
                if np.isnan(column).all():
                    raise _no_reading(name, path, self.first(name))
        return streams, origin / 1e9

    def _rows(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, _Rows]:
        rows = {name: _Rows() for name in wanted}
        finders: dict[str, Callable[[Any], Sequence[float]]] = {}
        for name, received, message in self._messages(list(wanted)):
            if name not in finders:
                finders[name] = finder(wanted[name], name, message)
            rows[name].values.extend(finders[name](message))
            rows[name].add(received, getattr(message, "header", None))
        return rows

    def _unhurt(self, look: Callable[[], T]) -> T:
        """What a look into the bag finds; where it meets damage, the bag is opened as a damaged one."""
        try:
            return look()
        except _DamageError as error:
            reader, troubles = open_damaged(self.path, self.kind, str(error))
            self.close()
            self._take(reader, troubles)
            return look()

    def _messages(self, names: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
        read = self._types.deserialize_ros1 if self.kind is Kind.BAG1 else self._types.deserialize_cdr
        for name, received, data in self._raw(names):
            kind = self.topics[name].kind
            try:
                message = read(data, kind)
            except Exception as error:  # noqa: BLE001 - whatever its bytes make of the library's own code
                text = f"{self.path}: a message on {name} is no {kind} ({first_line(error)}); record it again"
                raise InputError(text) from None
            yield name, received, message

    def _raw(self, names: Sequence[str]) -> Iterator[tuple[str, int, bytes]]:
        wanted = [c for c in self._connections() if c.topic in names]
        try:
            for connection, received, data in self._reader.messages(wanted):
                yield connection.topic, received, data
        except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
            raise _DamageError(first_line(error)) from None


class _DamageError(Exception):
    """The library met something in the file that it cannot read."""


@dataclass
class _Rows:
    """The messages of a topic: times of recording and of their headers [ns], numbers row by row, the first frame.

    A stamp of 0 is none.
    """

    received: array[int] = field(default_factory=lambda: array("q"))
    stamped: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    frame: str | None = None

    def add(self, received: int, header: Any) -> None:
        """One more message."""
        self.received.append(received)
        stamp = 0 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)
        self.stamped.append(stamp)
        if self.frame is None:
            self.frame = getattr(header, "frame_id", "")

    def stream(self, topic: str, origin: int) -> Stream:
        """As numbers in seconds from an origin [ns]."""
        received, stamped = np.array(self.received), np.array(self.stamped)
        stamps = np.where(stamped != 0, (stamped - origin) / 1e9, math.nan)
        values = np.array(self.values).reshape(len(received), -1)
        return Stream(topic, (received - origin) / 1e9, stamps, values, self.frame or "")


def _types(connections: Sequence[Connection]) -> Typestore:
    """The types that the bag defines; those of ROS 2 itself where it defines none, as bags before 2023 did."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

    found: dict[str, Any] = {}
    for connection in connections:
        form, text = connection.msgdef
        try:
            if form is MessageDefinitionFormat.MSG:
                found.update(get_types_from_msg(text, connection.msgtype))
            elif form is MessageDefinitionFormat.IDL:
                found.update(get_types_from_idl(text))
        except TypesysError:
            continue
    store = get_typestore(Stores.EMPTY if found else Stores.LATEST)
    if found:
        store.register(found)
    return store


def _no_reading(topic: str, path: str, message: Any) -> InputError:
    if path in dict(leaves(message)):
        return InputError(f"{topic}: {path} holds no reading at all; name another field")
    return no_field(topic, path, message)
