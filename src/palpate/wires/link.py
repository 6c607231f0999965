"""Messages between a wire and the process that holds the maker's library: one byte of kind, then the body."""

from __future__ import annotations

import struct

from palpate.wires.protocol import Command, Sense

STARTED, READY, STATE, FAILED, REFUSED, BEGUN, TARED, RESTED = b"arsfxbtq"
TARE, BEGIN, MOVE, REST = b"TBMR"
LARGEST = 4096

_STATE = struct.Struct("<B15d")
_MOVE = struct.Struct("<B6d")
_BEGIN = struct.Struct("<Bd")


def state(sense: Sense) -> bytes:
    """A reading."""
    s = sense
    return _STATE.pack(STATE, s.received, s.stamp, *s.force, *s.torque, *s.position, *s.quaternion)


def read_state(message: bytes) -> Sense:
    """The reading of a message of that kind."""
    _, received, stamp, *v = _STATE.unpack(message)
    return Sense(received, stamp, tuple(v[0:3]), tuple(v[3:6]), tuple(v[6:9]), tuple(v[9:13]))


def move(command: Command) -> bytes:
    """A command."""
    return _MOVE.pack(MOVE, *command.velocity, *command.position)


def read_move(message: bytes) -> Command:
    """The command of a message of that kind."""
    _, a, b, c, x, y, z = _MOVE.unpack(message)
    return Command((a, b, c), (x, y, z))


def begin(silence: float) -> bytes:
    """The wish to move, and the silence after which the arm is to stop by itself [s]."""
    return _BEGIN.pack(BEGIN, silence)


def read_begin(message: bytes) -> float:
    """The silence of a message of that kind [s]."""
    return float(_BEGIN.unpack(message)[1])


def text(kind: int, words: str = "") -> bytes:
    """A word or a reason."""
    return bytes([kind]) + words.encode(errors="replace")[: LARGEST - 1]


def read_text(message: bytes) -> str:
    """The words of a message."""
    return message[1:].decode(errors="replace")
