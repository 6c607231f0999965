"""Whose file is it? A figure or a page is written over an older one of palpate's own, and over nothing else."""

from __future__ import annotations

from pathlib import Path

from palpate.errors import InputError

SIGNATURE = "palpate"
"""What palpate writes as the `Software` of its PNG files, and as the `generator` of its pages."""


def check_ours(path: Path, option: str = "--figure") -> None:
    """Refuse to write over a file that palpate did not write.

    Args:
        path: of the figure or the page.
        option: with which it is named.

    Raises:
        InputError: there is such a file, or a folder.
    """
    if path.is_dir():
        raise InputError(f"{path} is a folder; name a file with {option}")
    if path.exists() and not any(mark in _head(path) for mark in _MARKS):
        raise InputError(
            f"{path} is there and palpate did not write it; move it, or name another with {option}"
        )


_MARKS = (
    f"Software\x00{SIGNATURE}".encode(),
    f'<meta name="generator" content="{SIGNATURE}">'.encode(),
)


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(4096)
