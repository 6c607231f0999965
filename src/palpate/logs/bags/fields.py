"""Numbers out of messages: by a path such as `wrench.force.z` or `position.elbow`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, unknown

_SHOWN = 64
_TRANSFORM = 16
"""Numbers of a homogeneous transform; its quaternion is `O_T_EE.qx` to `O_T_EE.qw`."""
_NUMBER = (int, float, np.number)


@dataclass(frozen=True)
class Stream:
    """Numbers of one topic over time.

    Args:
        topic: where they come from.
        received: when the recorder got each message [s], from the bag's beginning, shape (n,).
        stamped: the time in each message's own header on the same count [s], shape (n,); NaN without one.
        values: shape (n, k); NaN where there is no reading.
        frame: the frame that the first header names; empty without one.
    """

    topic: str
    received: Array
    stamped: Array
    values: Array
    frame: str = ""


def finder(paths: Sequence[str], topic: str, message: Any) -> Callable[[Any], Sequence[float]]:
    """A function that finds the numbers at some paths in messages of one type.

    A step of a path is a field's name. In a list it is a place from 0, or a name among the message's own `name`, as in
    `effort.elbow` of a JointState; NaN where that message does not hold it.

    Args:
        paths: of the fields.
        topic: of the messages.
        message: the first of them.

    Raises:
        InputError: a path leads to no number in it.
    """
    for path in paths:
        try:
            _number_at(path, message)
        except (AttributeError, TypeError, ValueError):
            raise no_field(topic, path, message) from None
    if len(paths) > 1 and not any(_passes_list(path, message) for path in paths):
        return attrgetter(*paths)  # many times as fast, where every message has the same fields
    return lambda other: [_number_at(path, other) for path in paths]


def _number_at(path: str, message: Any) -> float:
    owner = value = message
    steps = path.split(".")
    for at, step in enumerate(steps):
        if _is_list(value):
            return _in_list(value, getattr(owner, "name", ()), ".".join(steps[at:]))
        owner, value = value, getattr(value, step)
    return float(value)


def _passes_list(path: str, message: Any) -> bool:
    value = message
    for step in path.split("."):
        if _is_list(value):
            return True
        value = getattr(value, step)
    return False


def no_field(topic: str, path: str, message: Any) -> InputError:
    """The error for a path that leads to no number; the numbers that there are, are listed."""
    there = [name for name, _ in leaves(message)]
    if not there:
        return InputError(f"{topic}: its messages hold no number; name another topic")
    return InputError(f"{topic}: {unknown('field', path, there)}")


def leaves(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """The paths of all numbers in a message, with their values; the header left out."""
    for field in fields(message):
        value = getattr(message, field.name)
        path = f"{prefix}{field.name}"
        if field.name == "header":
            continue
        if is_dataclass(value):
            yield from leaves(value, f"{path}.")
        elif _is_list(value):
            yield from _leaves_of_list(path, value, getattr(message, "name", ()))
        elif isinstance(value, _NUMBER):
            yield path, float(value)


def _leaves_of_list(path: str, value: Sequence[Any], names: Sequence[str]) -> Iterator[tuple[str, float]]:
    if len(value) and isinstance(value[0], _NUMBER):
        steps = names if len(names) == len(value) else range(min(len(value), _SHOWN))
        yield from ((f"{path}.{step}", float(number)) for step, number in zip(steps, value, strict=False))


def _is_list(value: Any) -> bool:
    return isinstance(value, np.ndarray | list | tuple)


_TURNS = ("qx", "qy", "qz", "qw")


def _turn(columns: Sequence[float], step: str) -> float:
    """A component of the quaternion of a homogeneous transform, 16 numbers column by column."""
    r = [[float(columns[4 * j + i]) for j in range(3)] for i in range(3)]
    squares = (
        1 + r[0][0] - r[1][1] - r[2][2],
        1 - r[0][0] + r[1][1] - r[2][2],
        1 - r[0][0] - r[1][1] + r[2][2],
        1 + r[0][0] + r[1][1] + r[2][2],
    )  # four times the square of each component
    largest = max(range(4), key=squares.__getitem__)
    products = {
        frozenset((0, 1)): r[0][1] + r[1][0],
        frozenset((0, 2)): r[0][2] + r[2][0],
        frozenset((1, 2)): r[1][2] + r[2][1],
        frozenset((0, 3)): r[2][1] - r[1][2],
        frozenset((1, 3)): r[0][2] - r[2][0],
        frozenset((2, 3)): r[1][0] - r[0][1],
    }  # four times the product of two
    own = _TURNS.index(step)
    most = math.sqrt(max(squares[largest], 0.0))
    return (
        most / 2 if own == largest else products[frozenset((own, largest))] / (2 * most) if most else math.nan
    )


def _in_list(values: Sequence[Any], names: Sequence[str], step: str) -> float:
    if step in _TURNS and len(values) == _TRANSFORM:
        return _turn(values, step)
    if step.isascii() and step.isdigit():
        place = int(step)
    elif step in names:
        place = list(names).index(step)
    else:
        return math.nan
    return float(values[place]) if place < len(values) else math.nan
