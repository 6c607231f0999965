"""A ROS 1 bag read from its beginning, for one whose index is missing because it was cut or never closed."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from palpate.logs.bags.scanning import End, Raw, connection

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag1.reader import Header


def scan_bag1(path: Path) -> Iterator[Connection | Raw | End]:
    """Connections and messages of a ROS 1 bag (format 2.0) as far as they are whole."""
    from rosbags.rosbag1.reader import Header, RecordType
    from rosbags.typesys.msg import normalize_msgtype

    index = 0
    with path.open("rb") as file:
        file.readline()
        for header, data in _records(file):
            match header.get_uint8("op"):
                case RecordType.BAGHEADER:
                    index = header.get_uint64("index_pos")
                case RecordType.CONNECTION:
                    about = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
                    kind, definition = about.get_string("type"), about.get_string("message_definition")
                    number, topic = header.get_uint32("conn"), header.get_string("topic")
                    yield connection(number, topic, normalize_msgtype(kind), "ros1msg", definition)
                case RecordType.MSGDATA:
                    yield Raw(header.get_uint32("conn"), header.get_time("time"), data)
        reached = file.tell()
    size = path.stat().st_size
    share = None if not index else max(1 - size / index, 0.0) if reached == size else None
    yield End(finished=False, share=share)


def _records(file: BinaryIO) -> Iterator[tuple[Header, bytes]]:
    """Headers and data of all whole records, those inside of chunks included."""
    from rosbags.rosbag1.reader import (
        Compression,
        Header,
        ReaderError,
        RecordType,
        decompressors,
        read_uint32,
    )

    while True:
        try:
            header = Header.read(file)
            size = read_uint32(file)
            data = file.read(size)
            if header.get_uint8("op") == RecordType.CHUNK:
                packed = header.get_string("compression")
                if len(data) < size and packed != Compression.NONE.value:
                    return
                yield from _records(BytesIO(decompressors[packed](data)))
            elif len(data) == size:
                yield header, data
        except (ReaderError, ValueError, KeyError, OSError, EOFError, RuntimeError):
            return
        if len(data) < size:
            return
