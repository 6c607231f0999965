"""The one door for files that anybody may have written: regular files of a sane size, text, TOML."""

import math
import os
import re
import stat
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from palpate.errors import InputError

T = TypeVar("T")
LARGEST, DEEPEST = 1_000_000, 20
"""Letters of a TOML file, and tables within tables; palpate's own files have some thousand, and four."""
_WHOLE = 2**63
"""Whole numbers of TOML are of 64 bits, by its specification."""
_DOTS = 200
"""In one key, as in a.b.c: the library's time grows with their square, and a file of such keys takes 4 s."""


def open_file(path: Path, what: str = "a file") -> BinaryIO:
    """Open a regular file for reading; whatever else would block or never end is refused.

    Args:
        path: of the file.
        what: to call it in an error, as "an arm".

    Raises:
        InputError: the path is a folder, a pipe or a device, or is no path.
        OSError: no such file.
    """
    if "\0" in str(path):
        raise InputError(f"{str(path)!r} is no path: it holds a zero byte; check it")
    # Without O_NONBLOCK, to open a pipe is to wait for its writer.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0))
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise InputError(f"{path} is a folder, and no file with {what}; check the path")
    raise InputError(f"{path} is a pipe or a device, and no file with {what}; save it as a file")


def read_bytes(path: Path, most: int, what: str) -> bytes:
    """A file of at most so many bytes.

    Args:
        path: of the file.
        most: bytes that it may have.
        what: it holds, as "an arm"; an error says it.

    Raises:
        InputError: it is larger, or no regular file.
        OSError: no such file.
    """
    with open_file(path, what) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise InputError(f"{path}: more than {most} bytes are not {what}; check the path")
    return data


def read_text(path: Path, what: str, most: int = LARGEST) -> str:
    """The text of such a file.

    Raises:
        InputError: it is larger, no regular file, or not UTF-8.
        OSError: no such file.
    """
    try:
        return read_bytes(path, most, what).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file ({error.reason}); check the path") from None


def read_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Args:
        text: of the file.
        where: names it in errors.

    Raises:
        InputError: it is no TOML, or larger or deeper than any that a person writes.
    """
    import tomllib

    if len(text) > LARGEST:
        raise InputError(f"{where}: {len(text)} letters; give a file of at most {LARGEST}")
    if any(part.count(".") > _DOTS for part in re.split(r"[\n,=\[\]{}]", text)):
        raise _too_deep(where)
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise _too_deep(where) from None
    except ValueError as error:  # a number of more digits than Python converts is one without a place
        raise InputError(f"{where}: not TOML: {error}") from None
    _check(tables, where, DEEPEST)
    return tables


def read_yaml(path: Path, what: str = "a file") -> tuple[dict[str, Any], Any]:
    """The names of a YAML file, and the parser that writes it again as it was, comments included.

    Args:
        path: of the file.
        what: of an error message.

    Raises:
        InputError: it is no YAML with names at its top; the extra that reads it is missing.
    """
    try:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    except ImportError:
        raise InputError(f"{what} in YAML needs ruamel.yaml: pip install palpate[bags]") from None
    parser = YAML()
    parser.width, parser.preserve_quotes = 4096, True
    try:
        file = parser.load(read_text(path, what))
    except (YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is no YAML file: {' '.join(str(error).split())}") from None
    if not isinstance(file, dict):
        raise InputError(f"{path} is no {what.removeprefix('a ')}: it has no names at its top")
    return file, parser


def read_table(
    text: str, where: str, kind: type[T], remedy: Callable[[str], str] = lambda _: "", *, finite: bool = True
) -> T:
    """A table of one kind from TOML.

    Args:
        text: of the file.
        where: names it in errors.
        kind: a structure of msgspec.
        remedy: of an error of msgspec, to be added to it.
        finite: refuse numbers that are not.

    Raises:
        InputError: TOML that does not parse, an unknown or missing key, a value out of range or not finite.
    """
    import msgspec

    tables = read_toml(text, where)
    try:
        if finite:
            _check_finite(tables, "")
        return msgspec.convert(tables, kind)
    except msgspec.ValidationError as error:
        raise InputError(f"{where}: {error}{remedy(str(error))}") from None
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _check_finite(value: object, path: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{path} must be finite, got {value}")
    for key, inner in _inner(value):
        _check_finite(inner, f"{path}.{key}".strip("."))


def _check(value: Any, where: str, depth: int) -> None:
    if isinstance(value, int) and not -_WHOLE <= value < _WHOLE:
        raise InputError(f"{where}: a whole number of {len(hex(value)) * 4} bits; TOML has those of 64")
    inner = [own for _, own in _inner(value)]
    if depth == 0:
        raise _too_deep(where)
    for own in inner:
        _check(own, where, depth - 1)


def _inner(value: object) -> Iterable[tuple[str, Any]]:
    if isinstance(value, dict):
        return value.items()
    return (("", own) for own in value) if isinstance(value, list) else ()


def _too_deep(where: str) -> InputError:
    return InputError(
        f"{where}: more than {DEEPEST} tables or lists within each other; give a plainer TOML file"
    )
