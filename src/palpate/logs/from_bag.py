"""Fields of a bag's messages in SI units, on one table of rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from palpate.arrays import Array, Mask
from palpate.errors import InputError
from palpate.logs.bags import Bag, Stream
from palpate.logs.roles import POSE, Loaded, check_apart, check_quantity, family, si_unit
from palpate.logs.stamps import Timed, on_one_clock
from palpate.signals.samples import fresh_rows
from palpate.units import split_spec, unit

_FEWEST = 20
"""Readings of a stream: with fewer, a spline's ends are most of it, and identification refuses the log as well."""
_SIMILAR = 0.6
"""Of the fastest rate: above a half, no row between two readings of a stream stands alone."""
_GAP = 3.0
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
    cleaned = [_fresh(_sort(stream, missing, notes), notes) for stream in streams]
    rates = [_rate(stream) for stream in cleaned]
    fastest = int(np.argmax(rates))
    begin, end = max(s.time[0] for s in cleaned), min(s.time[-1] for s in cleaned)
    inside = (cleaned[fastest].time >= begin) & (cleaned[fastest].time <= end)
    time = cleaned[fastest].time[inside]
    if len(time) < _FEWEST:
        raise InputError(f"the topics have {len(time)} readings in common; at least {_FEWEST} are needed")
    table = Aligned(time, [], notes)
    for number, (stream, rate) in enumerate(zip(cleaned, rates, strict=True)):
        if number == fastest:
            table.values.append(stream.values[inside])
        elif stream.topic == held:
            table.values.append(_place_readings(stream, time))
        else:
            table.values.append(_interpolate(stream, time, all_rows=rate > _SIMILAR * rates[fastest]))
        if rate <= _SIMILAR * rates[fastest]:
            text = f"{stream.topic} has {rate:.4g} readings a second, {cleaned[fastest].topic} {rates[fastest]:.4g}"
            notes.append(
                {"code": "missing-samples", "text": f"{text}: the rows between two readings are interpolated"}
            )
    return table


def _sort(stream: Timed, missing: Sequence[float], notes: list[dict[str, Any]]) -> Timed:
    """In the order of time, one row a time, without rows that hold no reading."""
    values = np.where(np.isin(stream.values, missing), np.nan, stream.values)
    time, rows = np.unique(stream.time, return_index=True)
    values = values[rows]
    there = np.isfinite(values).all(axis=1)
    lost, twice = int((~there).sum()), len(stream.time) - len(time)
    if lost:
        text = f"{lost} of {len(time)} messages of {stream.topic} hold no reading; they are interpolated"
        notes.append({"code": "missing-samples", "text": text})
    if twice:
        text = f"{twice} messages of {stream.topic} repeat the time of another; the first of each is kept"
        notes.append({"code": "irregular-time", "text": text})
    if there.sum() < _FEWEST:
        raise InputError(f"{stream.topic} has {int(there.sum())} readings; at least {_FEWEST} are needed")
    return replace(stream, time=time[there], values=values[there])


def _fresh(stream: Timed, notes: list[dict[str, Any]]) -> Timed:
    """Without the messages that only repeat a held reading."""
    liveliest = int(np.argmax(np.ptp(stream.values, axis=0)))
    fresh = fresh_rows(stream.values[:, liveliest])
    if fresh is None or fresh.sum() < _FEWEST:
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
    there = rows < len(time)
    values = np.full((len(time), stream.values.shape[1]), np.nan)
    values[rows[there]] = stream.values[there]
    return values


def _interpolate(stream: Timed, time: Array, all_rows: bool) -> Array:
    """The stream's values at some rows; NaN in gaps and, unless all are asked for, far from its readings."""
    from scipy.interpolate import CubicSpline

    values: Array = CubicSpline(stream.time, stream.values, axis=0, extrapolate=False)(time)
    return np.where(_near(stream.time, time, all_rows)[:, None], values, np.nan)


def _near(readings: Array, time: Array, all_rows: bool) -> Mask:
    """Rows that a value is given to: those nearest to a reading, or all that are not in a gap between readings."""
    if all_rows:
        after = np.clip(np.searchsorted(readings, time), 1, len(readings) - 1)
        step = np.diff(readings)
        near: Mask = step[after - 1] <= _GAP * np.median(step)
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
    wanted: dict[str, list[str]] = {}
    for topic, path in fields.values():
        wanted.setdefault(topic, []).append(path)
    streams, origin = bag.streams(wanted)
    for topic, stream in streams.items():
        _steady(stream, [role for role, field in fields.items() if field[0] == topic])
    clocks = on_one_clock(list(streams.values()))
    table = align(clocks.streams, _numbers(missing), fields[held][0] if held in fields else None)
    found = {
        (stream.topic, path): values[:, i]
        for stream, values in zip(clocks.streams, table.values, strict=True)
        for i, path in enumerate(wanted[stream.topic])
    }
    loaded = Loaded({"time": table.time - table.time[0]}, {"time": "s"}, origin + float(table.time[0]))
    for role, spec in columns.items():
        symbol = split_spec(spec)[1] or si_unit(role)
        loaded.units[role] = unit(symbol).si
        loaded.columns[role] = found[fields[role]] * unit(symbol).factor
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


def _steady(stream: Stream, roles: Sequence[str]) -> None:
    """A quaternion and its negative are one rotation; between messages they must not change places."""
    from palpate.signals.samples import continuous

    places = [roles.index(role) for role in _TURN if role in roles]
    if len(places) == len(_TURN):
        stream.values[:, places] = continuous(stream.values[:, places])


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
