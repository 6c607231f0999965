"""Files that anybody may have written."""

from __future__ import annotations

from pathlib import Path

from palpate.errors import InputError


def read_bytes(path: Path, most: int, what: str) -> bytes:
    """A file of at most so many bytes; `what` says in an error what a larger one is not.

    Raises:
        InputError: it is larger.
        OSError: no such file.
    """
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise InputError(f"{path}: more than {most} bytes are {what}; check the path")
    return data
