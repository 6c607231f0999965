"""The output of `palpate identify --json`, read from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files import read_bytes

_LARGEST = 1 << 26
"""Largest size in bytes: the output for a thousand contacts is a hundredth of it."""

_DIGITS = 18
"""Digits of a whole number that surely fits into 64 bits: 10^18 < 2^63 < 10^19. A longer one is read as a float."""


def read_found(path: Path) -> dict[str, Any]:
    """The object in a file.

    Raises:
        InputError: it is too large, no JSON, or no object.
        OSError: no such file.
    """
    from json import loads

    try:
        value = loads(read_bytes(path, _LARGEST, "the output of palpate identify"), parse_int=_whole)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}; give the output of palpate identify --json") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: not the output of palpate identify --json")
    return value


def _whole(text: str) -> int | float:
    """A whole number; one of more than 64 bits is what it is to most programs, a double, and infinite at last."""
    return int(text) if len(text) <= _DIGITS else float(text)
