"""Fields of a bag's messages in SI units: which clock times them, and one table of rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.logs.bags.bag import Bag
from palpate.logs.bags.reading import Stream
from palpate.logs.roles import POSE, Loaded, check_apart, check_quantity, family, si_unit
from palpate.signals.rotations import keep_sign
from palpate.signals.samples import fresh_rows
from palpate.units import split_spec, unit

_DELAY_BLOCKS = 20
"""Parts of a log in each of which the quickest message is looked for: a drift of the clocks shows between them."""
_MAX_STAMP_DIFFERENCE = 0.02
"""Largest difference of transport times to the recorder [s]."""
_MAX_TRANSPORT = 0.2
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
        return _overlapping(Clocks([_timed_at(s, s.received) for s in streams], said))
    lines = [_delay(stream) for stream in streams]
    warning, astray = _disagreement(streams, lines)
    if astray:
        times = [s.stamped + line.at(s.stamped) for s, line in zip(streams, lines, strict=True)]
        said = "timed by their own stamps, moved to the recorder's clock"
        return _overlapping(
            Clocks([_timed_at(s, t) for s, t in zip(streams, times, strict=True)], said, warning)
        )
    said = "timed by the stamps in their headers"
    return _overlapping(Clocks([_timed_at(s, s.stamped) for s in streams], said, warning))


@dataclass(frozen=True)
class _Delay:
    """Least delay of a stream's messages after their stamps, and its growth.

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
    """True if every message carries a stamp, and the stamps go on."""
    stamps = stream.stamped
    return bool(np.isfinite(stamps).all() and (len(stamps) < 2 or np.mean(np.diff(stamps) > 0) > 0.5))


def _delay(stream: Stream) -> _Delay:
    late = stream.received - stream.stamped
    middle = float(np.mean(stream.stamped))
    length = float(np.ptp(stream.stamped))
    blocks = [b for b in np.array_split(np.argsort(stream.stamped), _DELAY_BLOCKS) if len(b)]
    minima = np.array([b[np.argmin(late[b])] for b in blocks])
    if len(blocks) < 4 or not length:
        return _Delay(middle, float(late.min()), 0.0, length)
    drift, offset = np.polyfit(stream.stamped[minima] - middle, late[minima], 1)
    return _Delay(middle, float(offset), float(drift), length)


def _disagreement(streams: Sequence[Stream], delays: Sequence[_Delay]) -> tuple[str | None, bool]:
    """Message about clocks that seem to differ, and whether the difference is certain."""
    early = min(delays, key=lambda d: d.offset)
    late = max(delays, key=lambda d: d.offset)
    offset = late.offset - early.offset
    drift = max(d.drift for d in delays) - min(d.drift for d in delays)
    gone = drift * max(d.length for d in delays)
    if max(offset, gone) <= _MAX_STAMP_DIFFERENCE:
        return None, False
    first, second = (streams[list(delays).index(d)].topic for d in (late, early))
    text = f"the stamps of {first} stand {offset:.3g} s behind those of {second}"
    if gone > _MAX_STAMP_DIFFERENCE:
        text += f" and drift by {1e6 * drift:.3g} microseconds a second"
    if offset > _MAX_TRANSPORT or gone > _MAX_STAMP_DIFFERENCE or early.offset < _BEFORE:
        remedy = "both are moved to the recorder's clock; the transport times remain as a lag"
        return f"{text}: the clocks disagree; {remedy}", True
    return f"{text}: a clock error, or slow transport to the recorder; the stamps are used unchanged", False


def _timed_at(stream: Stream, time: Array) -> Timed:
    return Timed(stream.topic, time, stream.values)


def _overlapping(clocks: Clocks) -> Clocks:
    spans = [(float(s.time.min()), float(s.time.max())) for s in clocks.streams]
    if max(begin for begin, _ in spans) >= min(end for _, end in spans) and len(spans) > 1:
        listed = ", ".join(
            f"{s.topic} {begin:.6g} to {end:.6g} s"
            for s, (begin, end) in zip(clocks.streams, spans, strict=True)
        )
        raise InputError(
            f"the topics have no time in common ({listed}); record them together, with clocks that agree"
        )
    return clocks


_MIN_READINGS = 20
"""Readings of a stream: with fewer, a spline's ends are most of it, and identification refuses the log as well."""
_SIMILAR_RATE = 0.6
"""Smallest rate, as a fraction of the fastest, of a stream that is interpolated in all rows: above a half, no row
stands alone between two readings."""
_MAX_GAP_STEPS = 3.0
"""Usual steps: two lost readings in a row are bridged by the spline, more are a gap."""


@dataclass
class Aligned:
    """A table made of streams.

    Args:
        time: of the rows [s], shape (n,).
        values: of each stream on these rows, shape (n, k); NaN where it has no reading near by.
        notes: findings and corrections, as in a record's meta.
    """

    time: Array
    values: list[Array]
    notes: list[dict[str, Any]] = field(default_factory=list)


def align(streams: Sequence[Timed], missing: Sequence[float] = (), held: str | None = None) -> Aligned:
    """Put streams on the rows of the fastest of them.

    Held readings are left out first, so that the fastest is the one with the most fresh ones. A stream that is about as
    fast is read between its readings by a cubic spline; a slower one has a value only in the row nearest to each of its
    readings, moved there by the spline, so that what follows sees how rarely it is read.

    Args:
        streams: on one clock.
        missing: values that mean that there is no reading.
        held: topic whose readings are not moved: each stands, as it is, in the first row that is not before it.

    Raises:
        InputError: a stream has too few readings where all have some.
    """
    notes: list[dict[str, Any]] = []
    cleaned = [_drop_held(_sort_by_time(stream, missing, notes), notes) for stream in streams]
    rates = [_rate(stream) for stream in cleaned]
    fastest = int(np.argmax(rates))
    begin = max(s.time[0] for s in cleaned)
    end = min(s.time[-1] for s in cleaned)
    inside = (cleaned[fastest].time >= begin) & (cleaned[fastest].time <= end)
    time = cleaned[fastest].time[inside]
    if len(time) < _MIN_READINGS:
        raise InputError(
            f"the topics have {len(time)} readings in common; at least {_MIN_READINGS} are needed"
        )
    table = Aligned(time, [], notes)
    for number, (stream, rate) in enumerate(zip(cleaned, rates, strict=True)):
        if number == fastest:
            table.values.append(stream.values[inside])
        elif stream.topic == held:
            table.values.append(_place_readings(stream, time))
        else:
            table.values.append(_interpolate(stream, time, all_rows=rate > _SIMILAR_RATE * rates[fastest]))
        if rate <= _SIMILAR_RATE * rates[fastest]:
            text = f"{stream.topic} has {rate:.4g} readings a second, {cleaned[fastest].topic} {rates[fastest]:.4g}"
            notes.append(
                {"code": "missing-samples", "text": f"{text}: the rows between two readings are interpolated"}
            )
    return table


def _sort_by_time(stream: Timed, missing: Sequence[float], notes: list[dict[str, Any]]) -> Timed:
    """The stream in the order of time, one row for each time, without rows that hold no reading."""
    values = np.where(np.isin(stream.values, missing), np.nan, stream.values)
    time, rows = np.unique(stream.time, return_index=True)
    values = values[rows]
    finite = np.isfinite(values).all(axis=1)
    lost = int((~finite).sum())
    twice = len(stream.time) - len(time)
    if lost:
        text = f"{lost} of {len(time)} messages of {stream.topic} hold no reading; they are interpolated"
        notes.append({"code": "missing-samples", "text": text})
    if twice:
        text = f"{twice} messages of {stream.topic} repeat the time of another; the first of each is kept"
        notes.append({"code": "irregular-time", "text": text})
    if finite.sum() < _MIN_READINGS:
        raise InputError(
            f"{stream.topic} has {int(finite.sum())} readings; at least {_MIN_READINGS} are needed"
        )
    return replace(stream, time=time[finite], values=values[finite])


def _drop_held(stream: Timed, notes: list[dict[str, Any]]) -> Timed:
    """The stream without the messages that only repeat a held reading."""
    liveliest = int(np.argmax(np.ptp(stream.values, axis=0)))
    fresh = fresh_rows(stream.values[:, liveliest])
    if fresh is None or fresh.sum() < _MIN_READINGS:
        return stream
    every = len(fresh) / int(fresh.sum())
    text = f"{stream.topic} is fresh in one of {every:.3g} messages; the others are left out"
    notes.append({"code": "held-samples", "text": text})
    return replace(stream, time=stream.time[fresh], values=stream.values[fresh])


def _rate(stream: Timed) -> float:
    return float(1 / np.median(np.diff(stream.time)))


def _place_readings(stream: Timed, time: Array) -> Array:
    """Each reading in the first row that is not before it."""
    rows = np.searchsorted(time, stream.time)
    inside = rows < len(time)
    values = np.full((len(time), stream.values.shape[1]), np.nan)
    values[rows[inside]] = stream.values[inside]
    return values


def _interpolate(stream: Timed, time: Array, all_rows: bool) -> Array:
    """The stream's values at some rows; NaN in gaps and, unless all are asked for, far from its readings."""
    from scipy.interpolate import CubicSpline

    values: Array = CubicSpline(stream.time, stream.values, axis=0, extrapolate=False)(time)
    return np.where(_rows_near(stream.time, time, all_rows)[:, None], values, np.nan)


def _rows_near(readings: Array, time: Array, all_rows: bool) -> Mask:
    """Rows that a value is given to: those nearest to a reading, or all that are not in a gap between readings."""
    if all_rows:
        after = np.clip(np.searchsorted(readings, time), 1, len(readings) - 1)
        step = np.diff(readings)
        near: Mask = step[after - 1] <= _MAX_GAP_STEPS * np.median(step)
        return near
    after = np.clip(np.searchsorted(time, readings), 1, len(time) - 1)
    nearest = np.where(readings - time[after - 1] < time[after] - readings, after - 1, after)
    close = np.abs(time[nearest] - readings) <= np.median(np.diff(time))
    near = np.zeros(len(time), bool)
    near[nearest[close]] = True
    return near


_TURN = POSE[3:]


def from_bag(
    bag: Bag, columns: Mapping[str, str], missing: Sequence[str | float], held: str | None
) -> Loaded:
    """The fields asked for, by role as `TOPIC.FIELD` or `TOPIC.FIELD:UNIT`.

    Args:
        bag: what to read.
        columns: the fields; the time is that of the messages.
        missing: values that mean that there is no reading.
        held: role whose readings are left as they are where another topic has more of them; the others are moved.

    Raises:
        InputError: a fault in the bag or with these arguments.
    """
    if "time" in columns:
        raise InputError(f"the messages of {bag.path} have their own times; leave out --time")
    fields = {role: _field(role, spec, bag) for role, spec in columns.items()}
    check_apart(fields, {role: ".".join(field) for role, field in fields.items()}, bag.path)
    paths: dict[str, list[str]] = {}
    for topic, path in fields.values():
        paths.setdefault(topic, []).append(path)
    streams, origin = bag.streams(paths)
    for topic, stream in streams.items():
        _keep_quaternion_sign(stream, [role for role, field in fields.items() if field[0] == topic])
    clocks = on_one_clock(list(streams.values()))
    table = align(clocks.streams, _numbers(missing), fields[held][0] if held in fields else None)
    readings = {
        (stream.topic, path): values[:, i]
        for stream, values in zip(clocks.streams, table.values, strict=True)
        for i, path in enumerate(paths[stream.topic])
    }
    loaded = Loaded({"time": table.time - table.time[0]}, {"time": "s"}, origin + float(table.time[0]))
    for role, spec in columns.items():
        symbol = split_spec(spec)[1] or si_unit(role)
        loaded.units[role] = unit(symbol).si
        loaded.columns[role] = readings[fields[role]] * unit(symbol).factor
        loaded.frames[role] = streams[fields[role][0]].frame
    troubles = [{"code": "log-cut-short", "text": text} for text in bag.troubles]
    warnings = [{"code": "clocks-disagree", "text": clocks.warning}] if clocks.warning else []
    loaded.notes = [*troubles, *warnings, *table.notes, *_guessed_units(columns, fields, bag)]
    loaded.facts = [clocks.said]
    loaded.joints = "position" in fields and _of_joints(bag, fields["position"][0])
    return loaded


def _of_joints(bag: Bag, topic: str) -> bool:
    return bag.topics[topic].kind.endswith("/JointState")


def _field(role: str, spec: str, bag: Bag) -> tuple[str, str]:
    """Topic and path of a field."""
    name, symbol = split_spec(spec)
    topic, path = bag.split(name)
    if symbol is not None:
        check_quantity(role, name, symbol)
    bag.topic(topic)
    if not path:
        raise InputError(
            f"{role} needs a field of {topic}, as {topic}.wrench.force.z; palpate topics {bag.path} lists them"
        )
    return topic, path


def _keep_quaternion_sign(stream: Stream, roles: Sequence[str]) -> None:
    """A quaternion and its negative are one rotation; between messages they must not change places."""
    places = [roles.index(role) for role in _TURN if role in roles]
    if len(places) == len(_TURN):
        stream.values[:, places] = keep_sign(stream.values[:, places])


def _guessed_units(
    columns: Mapping[str, str], fields: Mapping[str, tuple[str, str]], bag: Bag
) -> list[dict[str, str]]:
    """A JointState does not state whether a joint turns or slides."""
    notes = []
    for role, (topic, _) in fields.items():
        if _of_joints(bag, topic) and split_spec(columns[role])[1] is None:
            turning = "rad" if family(role) == "position" else "Nm"
            text = f"{role} is taken in {si_unit(role)}, as of a joint that slides; of one that turns say :{turning}"
            notes.append({"code": "unit-guess", "text": text})
    return notes


def _numbers(missing: Sequence[str | float]) -> list[float]:
    try:
        return [float(word) for word in missing]
    except ValueError:
        raise InputError(f"in a bag, --missing needs numbers, got {', '.join(map(str, missing))}") from None
