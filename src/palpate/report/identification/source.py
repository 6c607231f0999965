"""Where an identification is from: what a reader needs to make it again."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.files import RECORD
from palpate.identification.result import Identification
from palpate.text import printable

_CHUNK = 1 << 20


@dataclass(frozen=True)
class Source:
    """Where an identification is from.

    Args:
        file: the log, as it was named.
        options: what was said about it, as plain values.
        sha256: of the log; of a folder, of its files in the order of their names.
        command: that made the identification.
        made: when, in ISO 8601.
        notes: lines on how the log was read, such as the frame that a wrench was turned into.
    """

    file: str
    options: dict[str, Any] = field(default_factory=dict)
    sha256: str | None = None
    command: str = "palpate identify"
    made: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The log's own name, a run's with its folder, without characters that a page or a terminal would obey."""
        path = Path(self.file)
        own = f"{path.parent.name}/{path.name}" if path.name == RECORD else path.name
        return printable(own.removeprefix("/") or self.file)


def as_json(found: Identification, source: Source) -> dict[str, Any]:
    """The object that `palpate identify --json` prints for one log."""
    from palpate import __version__

    own = found.to_json()
    return {
        "file": source.file,
        **own,
        "options": {**source.options, **own["options"]},
        "sha256": source.sha256,
        "version": __version__,
    }


def sha256_of(path: Path) -> str:
    """Of a file; of a sheet, of its book; of a folder that is a log, of all its files in the order of their names."""
    total = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    files = [path.parent] if path.parent.is_file() else files  # a sheet of a book
    for name in files:
        with name.open("rb") as file:
            while chunk := file.read(_CHUNK):
                total.update(chunk)
    return total.hexdigest()
