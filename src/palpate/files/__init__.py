"""Files that palpate writes: whole or not at all, by one process at a time, and only over palpate's own."""

import os
import re
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files.reading import (
    open_file,
    parse_yaml,
    read_bytes,
    read_table,
    read_text,
    read_toml,
    read_yaml,
)
from palpate.text import printable

__all__ = [
    "FORCE",
    "MADE",
    "RECORD",
    "SIGNATURE",
    "WRITTEN",
    "as_json",
    "as_toml",
    "check_kept_folder",
    "check_place",
    "fresh_folder",
    "kept_folder",
    "open_file",
    "ours",
    "parse_yaml",
    "read_bytes",
    "read_table",
    "read_text",
    "read_toml",
    "read_yaml",
    "whole",
    "with_author",
    "write_json",
    "write_text",
]

HIDDEN = ".palpate-part"
"""Ending of the names of incomplete files and folders."""


def draft_path(path: Path, ending: str = HIDDEN) -> Path:
    """Path of a file or a folder while it is incomplete."""
    return path.with_name(f".{path.name}{ending}")


def locked(handle: int) -> bool:
    """Lock an open file or folder: False if another process has it, True where locks are not supported."""
    try:
        import fcntl
    except ImportError:  # two processes at one place are then their user's care
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


@contextmanager
def locking(path: Path, flags: int = os.O_RDONLY) -> Iterator[int | None]:
    """Open and lock a file or a folder, a link excepted; None while another process has it."""
    handle = os.open(path, flags | os.O_CLOEXEC | getattr(os, "O_NOFOLLOW", 0), 0o666)
    try:
        yield handle if locked(handle) and _stands(handle, path) else None
    finally:
        os.close(handle)


def _stands(handle: int, path: Path) -> bool:
    """True if the opened file is still at its path, and was not replaced in the meantime."""
    try:
        current = os.lstat(path)
    except FileNotFoundError:
        return False
    return os.path.samestat(os.fstat(handle), current)


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
    """Write a value as JSON, atomically; an object has to come from `with_author`."""
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


def as_toml(table: Mapping[str, Any], name: str = "") -> str:
    """A table as TOML; keys whose value is None are left out, and tables within it come last.

    Args:
        table: of texts, numbers, truth values, lists of them, and tables.
        name: of the table, with those that it is in.
    """
    plain = {key: value for key, value in table.items() if not isinstance(value, dict) and value is not None}
    lines = [f"[{name}]"] if name and plain else []
    lines += [f"{key} = {_toml_value(value)}" for key, value in plain.items()]
    text = "\n".join(lines) + "\n\n" if lines else ""
    tables = {key: value for key, value in table.items() if isinstance(value, dict)}
    return text + "".join(as_toml(inner, f"{name}.{key}".lstrip(".")) for key, inner in tables.items())


def _toml_value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml_value, value))}]"
    return as_json(value).decode() if isinstance(value, str | bool) else repr(value)


def with_author(value: Mapping[str, Any]) -> dict[str, Any]:
    """An object that is to be written as JSON, saying first who wrote it."""
    from importlib.metadata import version

    return {WRITTEN: f"{SIGNATURE} {version('palpate')}", **value}


RECORD = "record.parquet"
"""Name of the record in the folder of a run or a press."""
_OLD = ".palpate-old"


@contextmanager
def fresh_folder(path: Path, *, replace: bool) -> Iterator[Path]:
    """Yield a hidden folder beside `path` to write into; it takes its place when the block ends well.

    The place is checked before the block runs, so that no long run ends at a closed door. When the block
    raises, the hidden folder is removed and what stood at `path` is untouched. What a process that was killed left
    behind is put right first.

    Args:
        path: where the results shall stand.
        replace: replace existing results.

    Raises:
        InputError: `path` is taken, and `replace` is off or there is anything in it that palpate did not write; or
            another process of palpate is writing to it.
    """
    path = path.absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = draft_path(path)
    draft.mkdir(exist_ok=True)
    with locking(draft) as handle:
        if handle is None:
            raise _busy(path)
        try:
            _recover(path)
            _empty(draft)
            _check_fresh(path, replace)
            yield draft
            _check_fresh(path, replace)
            _take_place(draft, path)
        except OSError as error:
            if error.filename is not None:
                error.filename = str(error.filename).replace(str(draft), str(path))
            raise
        finally:
            shutil.rmtree(draft, ignore_errors=True)


@contextmanager
def kept_folder(path: Path, begun: str, *, replace: bool) -> Iterator[None]:
    """Make a folder, or go on in one, and keep it for this process alone; drafts left in it are removed.

    Args:
        path: where the results are, or shall be.
        begun: the file that tells that what is to be done there was begun.
        replace: remove what palpate wrote there.

    Raises:
        InputError: it is no folder, or a link; another process has it; it holds other files, and `replace` is off or
            there is anything among them that palpate did not write.
    """
    check_kept_folder(path, begun, replace=replace)
    path.mkdir(parents=True, exist_ok=True)
    with locking(path) as handle:
        if handle is None:
            raise _busy(path)
        for draft in path.rglob(f".*{HIDDEN}"):
            if draft.is_file() and not draft.is_symlink():
                draft.unlink()
        check_kept_folder(path, begun, replace=replace)
        if replace:
            (path / begun).unlink(missing_ok=True)  # first: what is left after a kill is then no results
            _empty(path)
        yield


def check_kept_folder(path: Path, begun: str, *, replace: bool) -> None:
    """Refuse a folder that `kept_folder` would refuse, before the work: it may be another's only while it lasts.

    Raises:
        InputError: as `kept_folder`.
    """
    _check_folder(path)
    if not path.exists():
        return
    if replace:
        check_all_ours(path)
    elif not (path / begun).exists() and any(not entry.name.endswith(HIDDEN) for entry in path.iterdir()):
        raise InputError(
            f"{path} holds other files; choose another --out, or add --replace to replace results"
        )


def check_all_ours(folder: Path) -> None:
    """Refuse a folder in which there is anything that palpate did not write.

    Raises:
        InputError: there is, and which.
    """
    for parent, folders, files in os.walk(folder):
        inner = [Path(parent, name) for name in folders]
        for entry in (*(p for p in inner if p.is_symlink()), *(Path(parent, name) for name in files)):
            if entry.is_symlink() or not (entry.name.endswith(HIDDEN) or ours(entry)):
                name = entry.relative_to(folder)
                raise InputError(
                    f"{folder} holds {name}, which palpate did not write; move it, or choose another --out"
                )


def _check_folder(path: Path) -> None:
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        kind = "a link" if path.is_symlink() else "not a folder"
        raise InputError(f"{path} is {kind}; choose another --out")


def _check_fresh(path: Path, replace: bool) -> None:
    _check_folder(path)
    if not path.exists():
        return
    if not replace:
        raise InputError(f"{path} exists; choose another --out, or add --replace to replace it")
    check_all_ours(path)


def _recover(path: Path) -> None:
    """Puts back the results of a process that was killed between taking them away and putting new ones there."""
    old = draft_path(path, _OLD)
    if not old.is_dir() or old.is_symlink():
        return
    if path.exists():
        shutil.rmtree(old)
    else:
        old.rename(path)


def _take_place(draft: Path, path: Path) -> None:
    if not path.exists():
        draft.rename(path)
        return
    old = draft_path(path, _OLD)
    path.rename(old)
    try:
        draft.rename(path)
    except OSError:
        old.rename(path)
        raise
    shutil.rmtree(old)


def _empty(folder: Path) -> None:
    for inner in folder.iterdir():
        if inner.is_dir() and not inner.is_symlink():
            shutil.rmtree(inner)
        else:
            inner.unlink()


def _busy(path: Path) -> InputError:
    return InputError(f"another palpate is at work in {path}; wait for it, or choose another --out")


SIGNATURE = "palpate"
"""The `Software` of a PNG, the `generator` of a page, the key of a Parquet file's metadata."""
WRITTEN = "written_by"
"""The first key of a JSON object."""
MADE = f"# Made by {SIGNATURE}"
"""Begins a line of a TOML file or of any other that has such comments."""
FORCE = ("time_s", "force_desired_N")
"""The columns of a desired force in a CSV file, which takes no comment."""

_KINDS = {".json": "JSON file", ".png": "PNG", ".html": "HTML file", ".toml": "TOML file", ".csv": "CSV file",
          ".ply": "PLY file", ".mcap": "MCAP file", ".yaml": "YAML file"}  # fmt: skip
_HEAD, _FOOT, _TAIL = 4096, 1 << 20, 8
"""Bytes read at the start and at the end of a file, and those at the end that state the length of a Parquet footer."""
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
            rb'\A\[\s*(?:\]|\{\s*"id":[^}]*"claim":[^}]*"verdict":)',  # claims, whose form is fixed
        )
    ),
    re.MULTILINE,
)


def ours(path: Path) -> bool:
    """True if palpate wrote the file; False for a link, wherever it leads."""
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
