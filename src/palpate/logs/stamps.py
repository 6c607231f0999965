"""Which clock the messages of several topics are timed by, and whether their clocks agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.logs.bags import Stream

_BLOCKS = 20
"""Parts of a log in each of which the quickest message is looked for: a drift of the clocks shows between them."""
_AGREE = 0.02
"""Largest difference of transport times to the recorder [s]."""
_TRANSPORT = 0.2
"""No message is longer on its way [s]; a larger difference is one of clocks."""
_BEFORE = -0.005
"""A message that seems to come that much before it was stamped was stamped by another clock [s]."""


@dataclass(frozen=True)
class Timed:
    """Numbers of one topic on the clock that all streams share.

    Args:
        topic: where they come from.
        time: of each row [s], shape (n,).
        values: shape (n, k).
    """

    topic: str
    time: Array
    values: Array


@dataclass(frozen=True)
class Clocks:
    """Streams on one clock, what it is, and a warning about it if there is one."""

    streams: list[Timed]
    said: str
    warning: str | None = None


def on_one_clock(streams: Sequence[Stream]) -> Clocks:
    """Time the streams by the stamps in their headers, or by the recorder's clock where those are missing or disagree.

    Stamps are made where the measurement is, so they carry no delay of the transport; but only if the computers
    that made them kept the same time. Each stream's stamps are compared with the times at which the recorder got
    its messages: the least delay in each stretch of the log, and a line through them, give the offset and the drift.

    Raises:
        InputError: the streams have no time in common.
    """
    bare = [stream.topic for stream in streams if not _stamped(stream)]
    if bare:
        said = f"timed by the receipt at the recorder ({', '.join(bare)} has no stamps)"
        return _overlapping(Clocks([_at_times(s, s.received) for s in streams], said))
    lines = [_delay(stream) for stream in streams]
    warning, astray = _disagreement(streams, lines)
    if astray:
        times = [s.stamped + line.at(s.stamped) for s, line in zip(streams, lines, strict=True)]
        said = "timed by their own stamps, moved to the recorder's clock"
        return _overlapping(
            Clocks([_at_times(s, t) for s, t in zip(streams, times, strict=True)], said, warning)
        )
    said = "timed by the stamps in their headers"
    return _overlapping(Clocks([_at_times(s, s.stamped) for s in streams], said, warning))


@dataclass(frozen=True)
class _Delay:
    """How much later than their stamps say a stream's messages came at least, and by how much that grows.

    Args:
        middle: of the stamps [s].
        offset: there [s].
        drift: seconds per second.
        length: of the stream [s].
    """

    middle: float
    offset: float
    drift: float
    length: float

    def at(self, stamped: Array) -> Array:
        """The delay at some stamps [s]."""
        delay: Array = self.offset + self.drift * (stamped - self.middle)
        return delay


def _stamped(stream: Stream) -> bool:
    """Whether every message carries a stamp, and the stamps go on."""
    stamps = stream.stamped
    return bool(np.isfinite(stamps).all() and (len(stamps) < 2 or np.mean(np.diff(stamps) > 0) > 0.5))


def _delay(stream: Stream) -> _Delay:
    late = stream.received - stream.stamped
    middle, length = float(np.mean(stream.stamped)), float(np.ptp(stream.stamped))
    blocks = [b for b in np.array_split(np.argsort(stream.stamped), _BLOCKS) if len(b)]
    least = np.array([b[np.argmin(late[b])] for b in blocks])
    if len(blocks) < 4 or not length:
        return _Delay(middle, float(late.min()), 0.0, length)
    drift, offset = np.polyfit(stream.stamped[least] - middle, late[least], 1)
    return _Delay(middle, float(offset), float(drift), length)


def _disagreement(streams: Sequence[Stream], delays: Sequence[_Delay]) -> tuple[str | None, bool]:
    """Message about clocks that seem to differ, and whether the difference is certain."""
    early, late = min(delays, key=lambda d: d.offset), max(delays, key=lambda d: d.offset)
    offset = late.offset - early.offset
    drift = max(d.drift for d in delays) - min(d.drift for d in delays)
    gone = drift * max(d.length for d in delays)
    if max(offset, gone) <= _AGREE:
        return None, False
    first, second = (streams[list(delays).index(d)].topic for d in (late, early))
    found = f"the stamps of {first} stand {offset:.3g} s behind those of {second}"
    if gone > _AGREE:
        found += f" and drift by {1e6 * drift:.3g} microseconds a second"
    if offset > _TRANSPORT or gone > _AGREE or early.offset < _BEFORE:
        moved = "both are moved to the recorder's clock; the transport times remain as a lag"
        return f"{found}: the clocks disagree; {moved}", True
    return f"{found}: a clock error, or slow transport to the recorder; the stamps are used unchanged", False


def _at_times(stream: Stream, time: Array) -> Timed:
    return Timed(stream.topic, time, stream.values)


def _overlapping(clocks: Clocks) -> Clocks:
    spans = [(float(s.time.min()), float(s.time.max())) for s in clocks.streams]
    if max(begin for begin, _ in spans) >= min(end for _, end in spans) and len(spans) > 1:
        told = ", ".join(
            f"{s.topic} {begin:.6g} to {end:.6g} s"
            for s, (begin, end) in zip(clocks.streams, spans, strict=True)
        )
        raise InputError(
            f"the topics have no time in common ({told}); record them together, with clocks that agree"
        )
    return clocks
