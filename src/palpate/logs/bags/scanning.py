"""Results of the scanners of bags, the intact part of a file, and decompression up to the stated size and the limit."""

from __future__ import annotations

import bz2
import sys
from typing import IO, Any, NamedTuple

from palpate.files.limits import Budget

ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of whatever zstd packed."""


class Channel(NamedTuple):
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


class Raw(NamedTuple):
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
    """Where the whole part of a file ends.

    Args:
        finished: the recorder closed the file, and its end is there.
        share: of the file that is lost, 0 if only its index is; None if the file does not tell how long it was to be.
    """

    finished: bool
    share: float | None = None


def unpack_chunk(data: bytes, packing: str, size: int, budget: Budget) -> bytes:
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
        found = bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    elif packing == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        found = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif packing == "zstd":
        found = zstd().ZstdDecompressor().decompress(data, max_length=size + 1)
    else:
        raise ValueError(f"chunks packed by {packing!r} are not read")
    if len(found) > size:
        raise ValueError(f"a chunk unpacks to more than the {size} bytes that it says")
    return bytes(found)


def unpack_message(data: bytes, budget: Budget) -> bytes:
    """Unpack a message that was packed by itself, by zstd."""
    most = int(min(budget.limits.size, 2**40))
    found = bytes(zstd().ZstdDecompressor().decompress(data, max_length=most))
    budget.take(len(found))
    return found


def unpack_file(packed: IO[bytes], to: IO[bytes], budget: Budget) -> None:
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
