"""A file that was right, spoiled: by chance, and as one does who means it."""

from __future__ import annotations

import random
import struct

_NUMBERS = tuple(
    struct.pack(code, value)
    for code, value in (
        ("<I", 0xFFFFFFFF),
        ("<I", 0x7FFFFFFF),
        ("<I", 0),
        ("<Q", 0xFFFFFFFFFFFFFFFF),
        ("<Q", 1 << 40),
        ("<H", 0xFFFF),
        ("<d", float("nan")),
        ("<d", float("inf")),
        ("<d", 1e300),
        ("<d", 5e-324),
    )
)
_WORDS = (
    *(b"nan", b"inf", b"-1e308", b"1e-320", b"9" * 400, b"0x10", b"", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf"),
    *(
        b"\x1b]0;palpate\x07",
        b"\x1b[2J",
        b"<script>alert(1)</script>",
        b"$x^{$",
        b"[bold]",
        b"'; DROP TABLE messages;--",
    ),
    *(
        b"[" * 2000,
        b"{a=" * 300,
        b"a." * 500,
        b"\n" * 1000,
        b"," * 3000,
        b'"',
        b"'''",
        b"../../../etc/passwd",
        b"\\u0000",
    ),
    *(
        "\u202egnp.exe".encode(),
        "µ".encode("latin-1"),
        b"1970-01-01T00:00:00",
        b"!!python/object/apply:os.system [id]",
    ),
)


def mutated(data: bytes, seed: int) -> bytes:
    """The data after one to four changes, the same for the same seed."""
    chance = random.Random(seed)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        data = chance.choice(_CHANGES)(data, chance)
    return data


def _place(data: bytes, chance: random.Random) -> int:
    """Anywhere; as often near the begin or the end, where formats keep what they say of themselves."""
    where = chance.randrange(4)
    near = min(len(data), 400)
    if where == 0:
        return chance.randint(0, near)
    if where == 1:
        return len(data) - chance.randint(0, near)
    return chance.randint(0, len(data))


def _flip(data: bytes, chance: random.Random) -> bytes:
    at = min(_place(data, chance), len(data) - 1)
    return data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :] if data else data


def _cut(data: bytes, chance: random.Random) -> bytes:
    return data[: _place(data, chance)]


def _lose(data: bytes, chance: random.Random) -> bytes:
    at = _place(data, chance)
    return data[:at] + data[at + chance.choice((1, 2, 8, 100, 1000)) :]


def _double(data: bytes, chance: random.Random) -> bytes:
    at, length = _place(data, chance), chance.choice((1, 8, 64, 1000, len(data)))
    return data[:at] + data[at : at + length] * chance.choice((2, 3, 20)) + data[at + length :]


def _number(data: bytes, chance: random.Random) -> bytes:
    at, number = _place(data, chance), chance.choice(_NUMBERS)
    return data[:at] + number + data[at + len(number) :]


def _word(data: bytes, chance: random.Random) -> bytes:
    at, word = _place(data, chance), chance.choice(_WORDS)
    return data[:at] + word + data[at + chance.choice((0, len(word))) :]


def _noise(data: bytes, chance: random.Random) -> bytes:
    at, length = _place(data, chance), chance.choice((1, 4, 40))
    return data[:at] + chance.randbytes(length) + data[at + length :]


_CHANGES = (_flip, _flip, _cut, _lose, _double, _number, _number, _word, _word, _noise)
