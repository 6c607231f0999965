"""Results of the scanners of bags, the intact part of a file, and decompression up to the stated size and the limit."""

from __future__ import annotations

import bz2
import sqlite3
import sys
from binascii import crc32
from collections.abc import Iterator
from contextlib import closing
from io import SEEK_CUR, SEEK_END, BytesIO
from pathlib import Path
from struct import unpack_from
from typing import IO, TYPE_CHECKING, Any, BinaryIO, NamedTuple
from urllib.parse import quote

from palpate.errors import InputError
from palpate.files.reading import LimitError, ReadingBudget

if TYPE_CHECKING:
    from rosbags.rosbag1.reader import Header

ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of whatever zstd packed."""


class TopicInFile(NamedTuple):
    """A topic as one file holds it.

    Args:
        number: its own in this file.
        topic: its name.
        kind: the type of its messages, as `geometry_msgs/msg/Pose`.
        encoding: of the definition: ros1msg, ros2msg, ros2idl; or something that cannot be read.
        definition: of the type.
    """

    number: int
    topic: str
    kind: str
    encoding: str
    definition: str


class RawMessage(NamedTuple):
    """A message as it lies in the file.

    Args:
        channel: the number of its topic in this file.
        received: when the recorder got it [ns].
        data: serialised.
    """

    channel: int
    received: int
    data: bytes


class End(NamedTuple):
    """The end of the readable part of a file.

    Args:
        finished: the recorder closed the file, and its end is there.
        share: of the file that is lost, 0 if only its index is; None if the file does not tell how long it was to be.
    """

    finished: bool
    share: float | None = None


def unpack_chunk(data: bytes, packing: str, size: int, budget: ReadingBudget) -> bytes:
    """Unpack a chunk.

    Args:
        data: packed.
        packing: how.
        size: that it says it unpacks to [bytes].
        budget: of the log.

    Raises:
        LimitError: that is more than the log may take.
        ValueError: it unpacks to more than it says, or is packed in a way that is not known.
    """
    if packing in {"", "none"}:
        return data
    budget.take(size)
    if packing == "bz2":
        unpacked = bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    elif packing == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        unpacked = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif packing == "zstd":
        unpacked = zstd().ZstdDecompressor().decompress(data, max_length=size + 1)
    else:
        raise ValueError(f"chunks packed by {packing!r} are not read")
    if len(unpacked) > size:
        raise ValueError(f"a chunk unpacks to more than the {size} bytes that it says")
    return bytes(unpacked)


def unpack_message(data: bytes, budget: ReadingBudget) -> bytes:
    """Unpack a message that was packed by itself, by zstd."""
    max_size = int(min(budget.limits.size, 2**40))
    unpacked = bytes(zstd().ZstdDecompressor().decompress(data, max_length=max_size))
    budget.take(len(unpacked))
    return unpacked


def unpack_file(packed: IO[bytes], to: IO[bytes], budget: ReadingBudget) -> None:
    """Unpack a whole file that was packed by zstd."""
    with zstd().open(packed, "rb") as source:
        while piece := source.read(1 << 20):
            budget.take(len(piece))
            to.write(piece)


def zstd() -> Any:
    """The library for zstd: Python's own, or what rosbags brings where Python has none yet."""
    if sys.version_info >= (3, 14):
        from compression import zstd as library
    else:
        from backports import zstd as library
    return library


_BAG1_MAGIC = b"#ROSBAG V2.0"


def scan_bag1(path: Path, budget: ReadingBudget) -> Iterator[TopicInFile | RawMessage | End]:
    """Connections and messages of a ROS 1 bag (format 2.0) as far as they are whole."""
    from rosbags.rosbag1.reader import Header, RecordType
    from rosbags.typesys.msg import normalize_msgtype

    index = complete = 0
    with path.open("rb") as file:
        begin = file.readline(100)
        if not begin.startswith(_BAG1_MAGIC):
            version = begin.partition(b"V")[2].decode(errors="replace").strip()
            raise InputError(
                f"{path} cannot be read as a ROS 1 bag (version {version} is not supported); rosbag fix mends it"
            )
        for header, data, complete in _bag1_records(file, budget):  # noqa: B007 - where the last whole record ends
            match header.get_uint8("op"):
                case RecordType.BAGHEADER:
                    index = header.get_uint64("index_pos")
                case RecordType.CONNECTION:
                    about = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
                    kind = about.get_string("type")
                    definition = about.get_string("message_definition")
                    number = header.get_uint32("conn")
                    topic = header.get_string("topic")
                    yield TopicInFile(number, topic, normalize_msgtype(kind), "ros1msg", definition)
                case RecordType.MSGDATA:
                    yield RawMessage(header.get_uint32("conn"), header.get_time("time"), data)
        position = file.tell()
    size = path.stat().st_size
    missing = None if not index else max(1 - size / index, 0.0) if position == size else None
    yield End(finished=0 < index < size == complete, share=missing)


def _bag1_records(
    file: BinaryIO, budget: ReadingBudget, *, packed: bool = False
) -> Iterator[tuple[Header, bytes, int]]:
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
                for fields, content, _ in _bag1_records(BytesIO(inside), budget, packed=True):
                    yield fields, content, file.tell()
            elif len(data) == size:
                yield header, data, file.tell()
        except LimitError:
            raise
        except (ReaderError, ValueError, KeyError, OSError, EOFError, RuntimeError):
            return
        if len(data) < size:
            return


_FOOTER = 0x02
_SCHEMA = 0x03
_CHANNEL = 0x04
_MESSAGE = 0x05
_CHUNK = 0x06
_MAGIC = 8


def scan_mcap(path: Path, budget: ReadingBudget) -> Iterator[TopicInFile | RawMessage | End]:
    """Channels and messages of an MCAP file as far as they are whole."""
    schemas: dict[int, tuple[str, str, str]] = {}
    finished = False
    with path.open("rb") as file:
        file.seek(_MAGIC)
        for operation, data in _records(file, budget):
            if operation == _SCHEMA:
                name, encoding, definition = _strings(data, 2, 3)
                schemas[_number(data)] = (name, encoding, definition)
            elif operation == _CHANNEL:
                about = schemas.get(unpack_from("<H", data, 2)[0], ("", "", ""))
                topic, coding = _strings(data, 4, 2)
                kind = about[0] if coding == "cdr" else f"{about[0]} as {coding}"
                yield TopicInFile(_number(data), topic, kind, *about[1:])
            elif operation == _MESSAGE:
                channel, _, received = unpack_from("<HIQ", data)
                yield RawMessage(channel, received, data[22:])
            else:
                finished = True
    yield End(finished)


def _records(file: BinaryIO, budget: ReadingBudget, *, packed: bool = False) -> Iterator[tuple[int, bytes]]:
    """Operations and data of all whole records that matter, those inside of chunks included.

    The records of a chunk that is not compressed are read where they stand, so that a cut in it costs one message.
    """
    begin = file.tell()
    last = file.seek(0, SEEK_END)
    file.seek(begin)
    while len(head := file.read(9)) == 9:
        operation = head[0]
        size = unpack_from("<Q", head, 1)[0]
        if not operation or (operation == _CHUNK and packed):
            return
        if operation == _CHUNK:
            fixed = file.read(32)
            if len(fixed) < 32:
                return
            length, crc, letters = unpack_from("<QII", fixed, 16)
            packing = file.read(min(letters, 64) + 8)[:-8].decode(errors="replace")
            if not packing:
                continue
            size -= 32 + letters + 8
        if not 0 <= size <= last - file.tell():
            return
        if operation not in {_SCHEMA, _CHANNEL, _MESSAGE, _FOOTER, _CHUNK}:
            file.seek(size, SEEK_CUR)
            continue
        budget.take(0)
        data = file.read(size)
        if operation != _CHUNK:
            yield operation, data
            continue
        inside = _inside(data, packing, length, crc, budget)
        if inside is None:
            return
        yield from _records(BytesIO(inside), budget, packed=True)


def _inside(data: bytes, packing: str, size: int, crc: int, budget: ReadingBudget) -> bytes | None:
    """Content of a chunk; None if it is damaged."""
    try:
        inside = unpack_chunk(data, packing, size, budget)
    except LimitError:
        raise
    except Exception:  # noqa: BLE001 - a damaged chunk fails in as many ways as there are bytes
        return None
    return inside if len(inside) == size and (not crc or crc32(inside) == crc) else None


def _number(data: bytes) -> int:
    number: int = unpack_from("<H", data)[0]
    return number


def _strings(data: bytes, offset: int, count: int) -> tuple[str, ...]:
    texts = []
    for _ in range(count):
        (length,) = unpack_from("<I", data, offset)
        texts.append(data[offset + 4 : offset + 4 + length].decode(errors="replace"))
        offset += 4 + length
    return tuple(texts)


_TABLES = "SELECT name FROM sqlite_master WHERE type = 'table' AND sql LIKE 'CREATE TABLE%'"
_OTHERS = "SELECT name, type FROM sqlite_master WHERE name IN ('topics', 'messages', 'message_definitions')"
# A column of SQLite holds values of any type: what is no name, no number or no message makes no topic.
_TOPICS = (
    "SELECT id, name, type FROM topics"
    " WHERE typeof(id) = 'integer' AND typeof(name) = 'text' AND typeof(type) = 'text'"
)
_TYPES = (
    "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    " WHERE typeof(topic_type) = 'text' AND typeof(encoding) = 'text'"
    " AND typeof(encoded_message_definition) = 'text'"
)
_MESSAGES = "SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id"
_SQLITE_MESSAGE = (int, int, bytes)
_STEPS = 100_000
"""Instructions of SQLite between two looks at the clock."""


def scan_sqlite(path: Path, budget: ReadingBudget) -> Iterator[TopicInFile | RawMessage | End]:
    """Topics and messages of a ROS 2 bag in SQLite as far as its pages are there."""
    with closing(_open_database(path, budget)) as database:
        types = {kind: (encoding, text) for kind, encoding, text in _rows(database, _TYPES)}
        for number, topic, kind in _rows(database, _TOPICS):
            yield TopicInFile(number, topic, kind, *types.get(kind, ("", "")))
        hurt = False
        remaining = path.stat().st_size
        try:
            for row in database.execute(_MESSAGES):
                plain = all(isinstance(value, kind) for value, kind in zip(row, _SQLITE_MESSAGE, strict=True))
                remaining -= len(row[2]) if plain else 0
                if (
                    hurt := not plain or remaining < 0
                ):  # a page that is there in part is read as if zeros followed
                    break
                yield RawMessage(*row)
        except sqlite3.DatabaseError:
            if budget.seconds_left <= 0:
                raise budget.too_long() from None
            hurt = True
    missing = _missing_pages(path)
    yield End(finished=not (hurt or missing), share=missing)


def _open_database(path: Path, budget: ReadingBudget) -> sqlite3.Connection:
    """The database, to be read only, and no longer than the log may take."""
    database = sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(path.stat().st_size + 1_000_000, 2**31 - 1))
    database.set_progress_handler(lambda: budget.seconds_left <= 0, _STEPS)
    # SQLite refuses a file that is shorter than its first page says, unless a repair seems to be under way.
    database.execute("PRAGMA writable_schema = ON")
    database.execute("PRAGMA trusted_schema = OFF")
    tables = {name for (name,) in _rows(database, _TABLES)}
    for name, kind in _rows(database, _OTHERS):
        if name not in tables:
            database.close()
            raise InputError(
                f"{path} is no ROS 2 bag: its {name} is not a plain table but a {kind}; record it again"
            )
    return database


def _rows(database: sqlite3.Connection, question: str) -> list[tuple[Any, ...]]:
    """The rows; none if there is no such table."""
    try:
        return database.execute(question).fetchall()
    except sqlite3.DatabaseError:
        return []


def _missing_pages(path: Path) -> float | None:
    """The share of the file's pages that are not there; None if all are."""
    with path.open("rb") as file:
        head = file.read(32)
    page = int.from_bytes(head[16:18], "big")
    meant = (65536 if page == 1 else page) * int.from_bytes(head[28:32], "big")
    size = path.stat().st_size
    return 1 - size / meant if size < meant else None
