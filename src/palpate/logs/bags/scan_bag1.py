"""A ROS 1 bag read from its beginning, so that one whose index is missing because it was cut is read as well."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from palpate.errors import InputError
from palpate.files.limits import Budget, LimitError
from palpate.logs.bags.scanning import Channel, End, Raw, unpack_chunk

if TYPE_CHECKING:
    from rosbags.rosbag1.reader import Header

_MAGIC = b"#ROSBAG V2.0"


def scan_bag1(path: Path, budget: Budget) -> Iterator[Channel | Raw | End]:
    """Connections and messages of a ROS 1 bag (format 2.0) as far as they are whole."""
    from rosbags.rosbag1.reader import Header, RecordType
    from rosbags.typesys.msg import normalize_msgtype

    index = whole = 0
    with path.open("rb") as file:
        begin = file.readline(100)
        if not begin.startswith(_MAGIC):
            version = begin.partition(b"V")[2].decode(errors="replace").strip()
            raise InputError(
                f"{path} cannot be read as a ROS 1 bag (version {version} is not supported); rosbag fix mends it"
            )
        for header, data, whole in _records(file, budget):  # noqa: B007 - where the last whole record ends
            match header.get_uint8("op"):
                case RecordType.BAGHEADER:
                    index = header.get_uint64("index_pos")
                case RecordType.CONNECTION:
                    about = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
                    kind, definition = about.get_string("type"), about.get_string("message_definition")
                    number, topic = header.get_uint32("conn"), header.get_string("topic")
                    yield Channel(number, topic, normalize_msgtype(kind), "ros1msg", definition)
                case RecordType.MSGDATA:
                    yield Raw(header.get_uint32("conn"), header.get_time("time"), data)
        reached = file.tell()
    size = path.stat().st_size
    share = None if not index else max(1 - size / index, 0.0) if reached == size else None
    yield End(finished=0 < index < size == whole, share=share)


def _records(file: BinaryIO, budget: Budget, *, packed: bool = False) -> Iterator[tuple[Header, bytes, int]]:
    """Headers and data of all whole records, those inside of chunks included, and where each ends."""
    from rosbags.rosbag1.reader import Header, ReaderError, RecordType, read_uint32

    while True:
        try:
            header = Header.read(file)
            size = read_uint32(file)
            budget.take(0)
            data = file.read(size)
            if header.get_uint8("op") == RecordType.CHUNK and not packed:
                packing = header.get_string("compression")
                if len(data) < size and packing != "none":
                    return
                inside = unpack_chunk(data, packing, header.get_uint32("size"), budget)
                for own, content, _ in _records(BytesIO(inside), budget, packed=True):
                    yield own, content, file.tell()
            elif len(data) == size:
                yield header, data, file.tell()
        except LimitError:
            raise
        except (ReaderError, ValueError, KeyError, OSError, EOFError, RuntimeError):
            return
        if len(data) < size:
            return
