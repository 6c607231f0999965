"""Datagrams between a simulated arm and its master, over UDP on the loopback."""

from __future__ import annotations

import struct
from typing import NamedTuple

MAGIC = b"palpate1"
HELLO, WELCOME, BUSY, STATE, MOVE, STOP = range(6)

_HEAD = struct.Struct("<8sBI")
_STATE = struct.Struct("<Id13d")
_MOVE = struct.Struct("<I3d")
_WELCOME = struct.Struct("<d")


class State(NamedTuple):
    """A reading: its number, the arm's time [s], force [N], torque [N m], position [m], quaternion."""

    number: int
    time: float
    values: tuple[float, ...]


def packed(kind: int, session: int, body: bytes = b"") -> bytes:
    """A datagram."""
    return _HEAD.pack(MAGIC, kind, session) + body


def unpacked(data: bytes) -> tuple[int, int, bytes] | None:
    """Kind, session and body of a datagram; None of one that is none."""
    if len(data) < _HEAD.size:
        return None
    magic, kind, session = _HEAD.unpack_from(data)
    if magic != MAGIC or kind > STOP:
        return None
    return kind, session, data[_HEAD.size :]


def state(number: int, time: float, values: tuple[float, ...]) -> bytes:
    """The body of a reading."""
    return _STATE.pack(number, time, *values)


def read_state(body: bytes) -> State | None:
    """A reading; None of a body that is none."""
    if len(body) != _STATE.size:
        return None
    number, time, *values = _STATE.unpack(body)
    return State(number, time, tuple(values))


def move(number: int, velocity: tuple[float, float, float]) -> bytes:
    """The body of a command: its number and the tool's speed [m/s]."""
    return _MOVE.pack(number, *velocity)


def read_move(body: bytes) -> tuple[int, tuple[float, float, float]] | None:
    """A command's number and speed; None of a body that is none."""
    if len(body) != _MOVE.size:
        return None
    number, x, y, z = _MOVE.unpack(body)
    return number, (x, y, z)


def welcome(rate: float) -> bytes:
    """The body of a welcome: readings a second."""
    return _WELCOME.pack(rate)


def read_welcome(body: bytes) -> float | None:
    """Readings a second."""
    return float(_WELCOME.unpack(body)[0]) if len(body) == _WELCOME.size else None
