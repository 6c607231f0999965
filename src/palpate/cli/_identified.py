"""The output of `palpate identify --json`, read from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files import read_bytes

_LARGEST = 1 << 26
"""Largest size in bytes: the output for a thousand contacts is a hundredth of it."""


def read_found(path: Path) -> dict[str, Any]:
    """The object in a file.

    Raises:
        InputError: it is too large, no JSON, or no object.
        OSError: no such file.
    """
    from json import JSONDecodeError, loads

    try:
        value = loads(read_bytes(path, _LARGEST, "not the output of palpate identify"))
    except (JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}; give the output of palpate identify --json") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: not the output of palpate identify --json")
    return value
