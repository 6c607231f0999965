"""Messages between the wire to a Franka and the process that holds libfranka: one byte of kind, then the body."""

from __future__ import annotations

import struct

from palpate.wires.protocol import Sense, Triple

READY, STATE, FAILED, REFUSED, BEGUN, RESTED = b"rsfxbq"[:6]
BEGIN, MOVE, REST = b"BMR"
LARGEST = 4096

_STATE = struct.Struct("<B15d")
_MOVE = struct.Struct("<B3d")


def state(sense: Sense) -> bytes:
    """A reading."""
    s = sense
    return _STATE.pack(STATE, s.received, s.stamp, *s.force, *s.torque, *s.position, *s.quaternion)


def read_state(message: bytes) -> Sense:
    """The reading of a message of that kind."""
    _, received, stamp, *v = _STATE.unpack(message)
    return Sense(received, stamp, tuple(v[0:3]), tuple(v[3:6]), tuple(v[6:9]), tuple(v[9:13]))


def move(velocity: Triple) -> bytes:
    """A speed of the tool [m/s]."""
    return _MOVE.pack(MOVE, *velocity)


def read_move(message: bytes) -> Triple:
    """The speed of a message of that kind [m/s]."""
    _, x, y, z = _MOVE.unpack(message)
    return x, y, z


def text(kind: int, words: str) -> bytes:
    """A word or a reason."""
    return bytes([kind]) + words.encode(errors="replace")[: LARGEST - 1]


def read_text(message: bytes) -> str:
    """The words of a message."""
    return message[1:].decode(errors="replace")
