"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from palpate.errors import InputError


def write_whole(path: Path, text: str) -> None:
    """Writes a text beside its place and puts it there in one step.

    Raises:
        InputError: there is no such folder.
    """
    if not path.parent.is_dir():
        raise InputError(f"{path.parent} is no folder; make it, or choose another place")
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        draft.write_text(text, encoding="utf-8")
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
