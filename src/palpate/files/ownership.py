"""Whose file is it? Every file that palpate writes bears a mark, and only such a file is ever replaced or removed."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

from palpate.errors import InputError

SIGNATURE = "palpate"
"""The `Software` of a PNG, the `generator` of a page, the key of a Parquet file's metadata."""
WRITTEN = "written_by"
"""The first key of a JSON object."""
MADE = f"# Made by {SIGNATURE}"
"""Begins a line of a TOML file or of any other that has such comments."""
SQLITE_ID = int.from_bytes(b"palp", "big")
"""The application id of an SQLite file."""
FORCE = ("time_s", "force_desired_N")
"""The columns of a desired force in a CSV file, which takes no comment."""

_KINDS = {".json": "JSON file", ".png": "PNG", ".html": "HTML file", ".toml": "TOML file", ".csv": "CSV file",
          ".ply": "PLY file", ".mcap": "MCAP file", ".yaml": "YAML file"}  # fmt: skip
_HEAD, _FOOT, _TAIL = 4096, 1 << 20, 8
"""Bytes that are looked at; the last ones of a Parquet file say how long what stands before them is."""
_FEET = {
    b"PAR1": b"\x18\x07palpate\x18",  # a key and its value, as Thrift writes them
    b"%PDF-": b"/Creator (palpate)",
}
"""Marks at the end of a file, by its first bytes."""
_MARKS = re.compile(
    rb"|".join(
        (
            rb"Software\x00palpate",
            rb'<meta name="generator" content="palpate">',
            rb'\A\s*\{\s*"written_by": ?"palpate',
            rb"^(?:#|//|<!--|%|comment) Made by palpate",
            rb"\A\x89MCAP0\r\n\x01(?s:.{12})palpate",  # the profile, behind two lengths
            rb"\A(?:log|map) \(palpate\),",  # a table of identifications, a map
            rb"\A%s\r?\n" % ",".join(FORCE).encode(),
            rb"\ASQLite format 3\x00(?s:.{52})palp",  # where the application id stands
            rb'\A[0-9a-f]{8} \{"title":.*"palpate":',  # the head of a journal of runs
            rb'\A\{"op_code":[^\n]*:"palpate ',  # a search, by Optuna
            rb'\A\[\s*(?:\]|\{\s*"id":[^}]*"claim":[^}]*"verdict":)',  # claims, whose form is fixed
        )
    ),
    re.MULTILINE,
)


def ours(path: Path) -> bool:
    """Whether it is a file that palpate wrote; a link is not, wherever it leads."""
    if not stat.S_ISREG(os.lstat(path).st_mode):
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD)
        foot = next((mark for kind, mark in _FEET.items() if head.startswith(kind)), None)
        if foot is None:
            return _MARKS.search(head) is not None
        size, length = path.stat().st_size, _FOOT
        if head.startswith(b"PAR1"):
            file.seek(max(size - _TAIL, 0))
            length = int.from_bytes(file.read(4), "little") + _TAIL
        file.seek(max(size - length, 0))
        return foot in file.read()


def check_place(path: Path, option: str = "", *, ending: str = "") -> None:
    """Refuse a place where palpate may not write a file: before any work is done, and again when it is written.

    Args:
        path: where the file shall stand.
        option: with which it is named.
        ending: that the name must have, such as .png.

    Raises:
        InputError: there is no such folder, or it cannot be written in; the name has another ending; there is a
            folder, a link or a file of somebody else.
    """
    remedy = f"name another with {option}" if option else "choose another place"
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}; make it first")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"cannot write {path}: the folder {path.parent} may not be written in; {remedy}")
    if path.is_symlink():
        raise InputError(f"{path} is a link, and palpate does not write through links; {remedy}")
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file{' with ' + option if option else ' in it'}")
    if ending and path.suffix.lower() != ending:
        raise InputError(f"it is a {_KINDS[ending]}; name it {path.with_suffix(ending)} instead of {path}")
    if path.exists() and not ours(path):
        raise InputError(f"{path} is there and palpate did not write it; move it, or {remedy}")
