"""A bag: its topics, and numbers of them over time."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import InputError, how_to_install, unknown
from palpate.files.reading import ReadingBudget, ReadingLimits
from palpate.logs.bags.reading import Stream, finder, first_line, leaves, no_field, open_files
from palpate.logs.bags.scanning import TopicInFile
from palpate.logs.formats import Kind

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

_TRANSFORMS = {"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"}
"""Messages that are lists of transforms, each of a frame of its own."""


@dataclass(frozen=True)
class Topic:
    """One topic of a bag.

    Args:
        name: as `/wrench`.
        kind: the type of its messages, as `geometry_msgs/msg/WrenchStamped`.
        count: of its messages.
        known: whether the messages can be read: their type is defined in the bag, or is one of ROS 2's own.
        times: when the recorder got the first and the last [s since 1970]; None if there is none.
        parent: the frame that a frame's transforms are given in; empty for other topics.
    """

    name: str
    kind: str
    count: int
    known: bool
    times: tuple[float, float] | None = None
    parent: str = ""


class Bag:
    """A bag of ROS 1 or ROS 2, whole or cut; open within `with`.

    A topic of transforms, such as `/tf`, gives one topic more for each frame, `/tf.tool0`.

    Args:
        path: a file or a folder.
        kind: what it is.
        limits: of size and time.

    Raises:
        InputError: nothing of it can be read, or the library that reads bags is not installed.
    """

    def __init__(self, path: Path, kind: Kind, limits: ReadingLimits | None = None) -> None:
        self.path, self.kind = path, kind
        self._unpacked = TemporaryDirectory()
        try:
            self._files, self.troubles = open_files(
                path, kind, ReadingBudget(path, limits or ReadingLimits()), self._unpacked
            )
            self._types = _types([channel for file in self._files for channel in file.channels.values()])
            self.topics = {topic.name: topic for topic in self._list_topics()}
            self._add_frames()
        except ImportError:
            self.close()
            raise InputError(f"bags need the library rosbags: {how_to_install('palpate[bags]')}") from None
        except BaseException:
            self.close()
            raise
        if not any(topic.count for topic in self.topics.values()):
            self.close()
            raise InputError(f"{path} holds no messages; record it again")

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let the file go."""
        self._unpacked.cleanup()

    def _list_topics(self) -> Iterator[Topic]:
        members = [(file, channel) for file in self._files for channel in file.channels.values()]
        for name in sorted({channel.topic for _, channel in members}):
            channels = [(file, channel) for file, channel in members if channel.topic == name]
            kinds = sorted({channel.kind for _, channel in channels})
            readable = len(kinds) == 1 and kinds[0] in self._types.fielddefs
            spans = [file.spans[c.number] for file, c in channels if c.number in file.spans]
            times = (min(a for a, _ in spans) / 1e9, max(b for _, b in spans) / 1e9) if spans else None
            count = sum(file.counts[channel.number] for file, channel in channels)
            yield Topic(name, " and ".join(kinds), count, readable, times)

    def _add_frames(self) -> None:
        """A topic for each frame of a topic of transforms."""
        lists = [
            topic
            for topic in self.topics.values()
            if topic.kind in _TRANSFORMS and topic.known and topic.count
        ]
        frames: dict[str, tuple[int, int, int, str]] = {}
        for name, received, transform in self._messages([f"{topic.name}." for topic in lists]):
            count, first, last, _ = frames.get(name, (0, received, received, ""))
            parent = str(transform.header.frame_id)
            frames[name] = (count + 1, min(first, received), max(last, received), parent)
        for name, (count, first, last, parent) in frames.items():
            self.topics[name] = Topic(
                name, "geometry_msgs/msg/TransformStamped", count, True, (first / 1e9, last / 1e9), parent
            )

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
                f"{self.path}: the type of {name}, {topic.kind}, is not defined in the bag, and its layout is not "
                "guessed; record it as a type of geometry_msgs or sensor_msgs, or into an MCAP file, which contains "
                "definitions"
            )
        return topic

    def first(self, name: str) -> Any:
        """The first message of a topic."""
        self.topic(name)
        return next(self._messages([name]))[2]

    def streams(self, fields: Mapping[str, Sequence[str]]) -> tuple[dict[str, Stream], float]:
        """Numbers of some topics, by topic the paths of its fields; and the time that they are counted from.

        Returns:
            A stream for each topic, and the bag's beginning [s since 1970].

        Raises:
            InputError: a topic or a field is missing, or its type is not known.
        """
        for name in fields:
            self.topic(name)
        rows = self._rows(fields)
        for name, topic_rows in rows.items():
            if not topic_rows.received:
                raise InputError(f"{self.path}: no message on {name} is complete; record or copy it again")
        origin = min(min(topic_rows.received) for topic_rows in rows.values())
        streams = {name: topic_rows.stream(name, origin) for name, topic_rows in rows.items()}
        for name, paths in fields.items():
            for path, column in zip(paths, streams[name].values.T, strict=True):
                if np.isnan(column).all():
                    raise _no_reading(name, path, self.first(name))
        return streams, origin / 1e9

    def _rows(self, fields: Mapping[str, Sequence[str]]) -> dict[str, _TopicRows]:
        rows = {name: _TopicRows() for name in fields}
        finders: dict[str, Callable[[Any], Sequence[float]]] = {}
        for name, received, message in self._messages(list(fields)):
            if name not in finders:
                finders[name] = finder(fields[name], name, message)
            rows[name].values.extend(finders[name](message))
            rows[name].add(received, getattr(message, "header", None))
        return rows

    def split(self, spec: str) -> tuple[str, str]:
        """The longest topic that a name begins with, and what follows it: a field; empty if nothing does."""
        at = [i for i, letter in enumerate(spec) if letter == "."] + [len(spec)]
        end = next((end for end in reversed(at) if spec[:end] in self.topics), at[0])
        return spec[:end], spec[end + 1 :]

    def _messages(self, names: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
        """Messages of some topics, of the frames of transforms, or, by `/tf.`, of all frames of one topic."""
        read = self._types.deserialize_ros1 if self.kind is Kind.BAG1 else self._types.deserialize_cdr
        topics = set(names)
        lists = {name for name, topic in self.topics.items() if topic.kind in _TRANSFORMS}
        plain = topics | {
            name for name in lists if any(name_inside.startswith(f"{name}.") for name_inside in topics)
        }
        for channel, received, data in (item for file in self._files for item in file.messages(plain)):
            name = channel.topic
            kind = channel.kind
            try:
                message: Any = read(data, kind)
            except Exception as error:  # noqa: BLE001 - whatever its bytes make of the library's own code
                text = f"{self.path}: a message on {name} is no {kind} ({first_line(error)}); record it again"
                raise InputError(text) from None
            if name in topics:
                yield name, received, message
            if name in lists:
                for transform in message.transforms:
                    frame = f"{name}.{str(transform.child_frame_id).lstrip('/')}"
                    if frame in topics or f"{name}." in topics:
                        yield frame, received, transform


@dataclass
class _TopicRows:
    """The messages of a topic: times of recording and of their headers [ns], numbers row by row, the first frame.

    A stamp of 0 means no stamp.
    """

    received: array[int] = field(default_factory=lambda: array("q"))
    stamped: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    frame: str | None = None

    def add(self, received: int, header: Any) -> None:
        """Keep one more message of the topic."""
        self.received.append(received)
        stamp = 0 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)
        self.stamped.append(stamp)
        if self.frame is None:
            self.frame = getattr(header, "frame_id", "")

    def stream(self, topic: str, origin: int) -> Stream:
        """The rows as numbers, in seconds from an origin [ns]."""
        received = np.array(self.received)
        stamped = np.array(self.stamped)
        stamps = np.where(stamped != 0, (stamped - origin) / 1e9, math.nan)
        values = np.array(self.values).reshape(len(received), -1)
        return Stream(topic, (received - origin) / 1e9, stamps, values, self.frame or "")


def _types(channels: Sequence[TopicInFile]) -> Typestore:
    """The types that the bag defines; those of ROS 2 itself where it defines none, as bags before 2023 did."""
    from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

    types: dict[str, Any] = {}
    for channel in channels:
        try:
            if channel.encoding in {"ros1msg", "ros2msg"}:
                types.update(get_types_from_msg(channel.definition, channel.kind))
            elif channel.encoding in {"ros2idl", "omgidl"}:
                types.update(get_types_from_idl(channel.definition))
        except (TypesysError, RecursionError):
            continue
    store = get_typestore(Stores.EMPTY if types else Stores.LATEST)
    if types:
        store.register(types)
    return store


def _no_reading(topic: str, path: str, message: Any) -> InputError:
    if path in dict(leaves(message)):
        return InputError(f"{topic}: {path} holds no reading at all; name another field")
    return no_field(topic, path, message)
