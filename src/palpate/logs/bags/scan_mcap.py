"""An MCAP file read from its beginning, so that one without its end is read as well."""

from __future__ import annotations

from binascii import crc32
from collections.abc import Iterator
from io import SEEK_CUR, SEEK_END, BytesIO
from pathlib import Path
from struct import unpack_from
from typing import BinaryIO

from palpate.files.limits import Budget, LimitError
from palpate.logs.bags.scanning import Channel, End, Raw, unpack_chunk

_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x02, 0x03, 0x04, 0x05, 0x06
_MAGIC = 8


def scan_mcap(path: Path, budget: Budget) -> Iterator[Channel | Raw | End]:
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
                yield Channel(_number(data), topic, kind, *about[1:])
            elif operation == _MESSAGE:
                channel, _, received = unpack_from("<HIQ", data)
                yield Raw(channel, received, data[22:])
            else:
                finished = True
    yield End(finished)


def _records(file: BinaryIO, budget: Budget, *, packed: bool = False) -> Iterator[tuple[int, bytes]]:
    """Operations and data of all whole records that matter, those inside of chunks included.

    The records of a chunk that is not compressed are read where they stand, so that a cut in it costs one message.
    """
    begin, last = file.tell(), file.seek(0, SEEK_END)
    file.seek(begin)
    while len(head := file.read(9)) == 9:
        operation, size = head[0], unpack_from("<Q", head, 1)[0]
        if not operation or (operation == _CHUNK and packed):
            return
        if operation == _CHUNK:
            fixed = file.read(32)
            if len(fixed) < 32:
                return
            whole, crc, letters = unpack_from("<QII", fixed, 16)
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
        inside = _inside(data, packing, whole, crc, budget)
        if inside is None:
            return
        yield from _records(BytesIO(inside), budget, packed=True)


def _inside(data: bytes, packing: str, size: int, crc: int, budget: Budget) -> bytes | None:
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


def _strings(data: bytes, place: int, count: int) -> tuple[str, ...]:
    found = []
    for _ in range(count):
        (length,) = unpack_from("<I", data, place)
        found.append(data[place + 4 : place + 4 + length].decode(errors="replace"))
        place += 4 + length
    return tuple(found)
