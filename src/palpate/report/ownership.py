"""Whose file is it? A figure is written over an older one of palpate's own, and over nothing else."""

from __future__ import annotations

from pathlib import Path

from palpate.errors import InputError

SIGNATURE = "palpate"
"""What palpate writes as the `Software` of its PNG files."""


def check_ours(path: Path) -> None:
    """Refuse to write over a file that palpate did not write.

    Raises:
        InputError: there is such a file, or a folder.
    """
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file with --figure")
    if path.exists() and f"Software\x00{SIGNATURE}".encode() not in _head(path):
        raise InputError(
            f"{path} is there and palpate did not write it; move it, or name another with --figure"
        )


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(4096)
