"""A folder of results: there whole, or not there at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from palpate.errors import InputError

MARK = "summary.json"  # every folder of results has it; only such a folder is ever replaced


@contextmanager
def fresh_folder(path: Path, *, force: bool) -> Iterator[Path]:
    """Yield a hidden folder beside `path` to write into; it takes its place when the block ends well.

    The place is checked before the block runs, so that no long run ends at a closed door. When the block
    raises, the hidden folder is removed and what stood at `path` is untouched.

    Args:
        path: where the results shall stand.
        force: replace the results that stand there already.

    Raises:
        InputError: `path` is taken, and `force` is off or what stands there was not written by palpate.
    """
    path = path.absolute()
    _check(path, force)
    path.parent.mkdir(parents=True, exist_ok=True)
    hidden = path.with_name(f".{path.name}.{os.getpid()}.part")
    hidden.mkdir()
    try:
        yield hidden
        _check(path, force)
        _take_place(hidden, path)
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def _check(path: Path, force: bool) -> None:
    if not path.exists() and not path.is_symlink():
        return
    if not path.is_dir() or path.is_symlink():
        raise InputError(f"{path} is not a folder; choose another --out")
    if not force:
        raise InputError(f"{path} exists; choose another --out, or add --force to replace it")
    if any(path.iterdir()) and not (path / MARK).is_file():
        raise InputError(
            f"{path} holds files that are no results of palpate (no {MARK}); choose another --out"
        )


def _take_place(hidden: Path, path: Path) -> None:
    if not path.exists():
        hidden.rename(path)
        return
    old = path.with_name(f".{path.name}.{os.getpid()}.old")
    path.rename(old)
    try:
        hidden.rename(path)
    except OSError:
        old.rename(path)
        raise
    shutil.rmtree(old)
