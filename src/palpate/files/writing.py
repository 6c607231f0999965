"""Files are written atomically: whole, or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files.locks import draft_path, locking
from palpate.files.ownership import SIGNATURE, WRITTEN, check_place, ours
from palpate.text import printable


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a draft beside `path` to write to; it takes the place in one step when the block ends well.

    When the block raises, the draft is removed and what stood at `path` is untouched. The draft of a process that was
    killed is written over by the next.

    Raises:
        InputError: palpate may not write there (`check_place`), or another process of palpate is doing so.
    """
    check_place(path)
    draft = draft_path(path)
    with locking(draft, os.O_RDWR | os.O_CREAT) as handle:
        if handle is None:
            raise InputError(f"another palpate is writing {path}; wait for it, or choose another place")
        try:
            os.ftruncate(handle, 0)
            yield draft
            assert ours(draft), f"{path.name} was written without a mark of palpate"
            check_place(path)
            draft.replace(path)
        except BaseException as error:
            draft.unlink(missing_ok=True)
            if isinstance(error, OSError) and error.filename in {None, str(draft)}:
                error.filename = str(path)  # a full disk tells not even whose write it was
            raise


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8, atomically."""
    with whole(path) as draft:
        draft.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON, atomically; an object has to be `signed`."""
    import msgspec

    with whole(path) as draft:
        draft.write_bytes(msgspec.json.format(as_json(value), indent=2) + b"\n")


def as_json(value: Any) -> bytes:
    """A value as JSON in UTF-8; what a file's name has that is no letter of it stands there as a visible escape."""
    import msgspec

    try:
        return msgspec.json.encode(value)
    except UnicodeEncodeError:
        return msgspec.json.encode(_encodable(msgspec.to_builtins(value)))


def _encodable(value: Any) -> Any:
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, dict):
        return {_encodable(key): _encodable(inner) for key, inner in value.items()}
    return [_encodable(inner) for inner in value] if isinstance(value, list | tuple) else value


def with_author(value: Mapping[str, Any]) -> dict[str, Any]:
    """An object that is to be written as JSON, saying first who wrote it."""
    from palpate import __version__

    return {WRITTEN: f"{SIGNATURE} {__version__}", **value}
