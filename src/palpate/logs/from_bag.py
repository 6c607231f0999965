"""Fields of a bag's messages in SI units, on one table of rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from palpate.errors import InputError
from palpate.logs.aligning import align
from palpate.logs.bags import Bag, Stream
from palpate.logs.roles import POSE, Loaded, check_apart, check_quantity, family, si_unit
from palpate.logs.stamps import on_one_clock
from palpate.units import split_spec, unit

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
