"""Where a command writes a file: found wrong before any work is done."""

from __future__ import annotations

from pathlib import Path

from palpate.errors import InputError

_KINDS = {".png": "the figure is a PNG", ".html": "the report is an HTML file"}


def own_place(path: Path, ending: str, option: str) -> Path:
    """The path of a figure or a page, if palpate may write it.

    Args:
        path: where it shall stand.
        ending: of its name, .png or .html.
        option: with which it is named.

    Raises:
        InputError: there is no such folder, the name has another ending, or a file of somebody else is there.
    """
    from palpate.report.ownership import check_ours

    check_folder(path)
    check_ours(path, option)
    if path.suffix.lower() != ending:
        raise InputError(f"{_KINDS[ending]}; name it {path.with_suffix(ending)} instead of {path}")
    return path


def check_folder(path: Path) -> None:
    """Refuse a file in a folder that is not there."""
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {path.parent}; make it first")
