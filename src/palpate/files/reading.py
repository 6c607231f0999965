"""The one door for files that anybody may have written: regular files, text, TOML, with limits of size and time."""

import math
import os
import re
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any, BinaryIO, TypeVar

from palpate.errors import InputError, how_to_install

T = TypeVar("T")
LARGEST, DEEPEST = 1_000_000, 20
"""Letters of a TOML file, and tables within tables; palpate's own files have some thousand, and four."""
_WHOLE = 2**63
"""Whole numbers of TOML are of 64 bits, by its specification."""
_DOTS = 200
"""Maximum dots in one key such as a.b.c: the parser's time grows with their square, to 4 s for a file of such
keys."""


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
    """Read a file of limited size.

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
    """Read a UTF-8 text file of limited size.

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


def read_yaml(path: Path, what: str = "a file") -> dict[str, Any]:
    """The names of a YAML file.

    Args:
        path: of the file.
        what: of an error message.

    Raises:
        InputError: it is no YAML with names at its top; the extra that reads it is missing.
    """
    return parse_yaml(read_text(path, what), str(path), what)


def parse_yaml(text: str, where: str, what: str = "a file") -> dict[str, Any]:
    """The names of a YAML text.

    Args:
        text: the file's.
        where: names it in errors.
        what: it should be, for errors.

    Raises:
        InputError: it is no YAML with names at its top; the extra that reads it is missing.
    """
    try:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    except ImportError:
        raise InputError(f"{what} in YAML needs ruamel.yaml: {how_to_install('palpate[yaml]')}") from None
    try:
        file = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{where} is no YAML file: {' '.join(str(error).split())}") from None
    if not isinstance(file, dict):
        raise InputError(f"{where} is no {what.removeprefix('a ')}: it has no names at its top")
    return file


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
        raise InputError(f"{where}: {error}{_known_fields(str(error), kind)}{remedy(str(error))}") from None
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _known_fields(error: str, kind: Any) -> str:
    """The fields of the table in which msgspec found an unknown one, as a remedy; empty of another error.

    Of a table of several kinds they are told by kind.
    """
    from msgspec.inspect import type_info

    what, _, path = error.partition(" - at `$")
    tables: list[Any] = [type_info(kind)] if "unknown field" in what else []
    for step in re.findall(r"[^.\[\]`]+", path):
        inside = [field.type for table in tables for field in table.fields if field.encode_name == step]
        tables = [table for fields in inside for table in _tables_in(fields)]
    fields = {table.tag: ", ".join(sorted(field.encode_name for field in table.fields)) for table in tables}
    listed = (
        [*fields.values()]
        if len(tables) == 1
        else [f"{names} ({kind})" for kind, names in fields.items() if kind]
    )
    return f"; there are: {'; '.join(listed)}" if listed else ""


def _tables_in(kind: Any) -> list[Any]:
    """The kinds of tables that values of a kind of msgspec are, or hold as a list or under keys."""
    if hasattr(kind, "fields"):
        return [kind]
    several = [*getattr(kind, "types", ()), *getattr(kind, "item_types", ())]
    inner = [getattr(kind, name) for name in ("item_type", "value_type") if hasattr(kind, name)]
    return [table for item in several + inner for table in _tables_in(item)]


def _check_finite(value: object, path: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{path} must be finite, got {value}")
    for key, inner in _inner(value):
        _check_finite(inner, f"{path}.{key}".strip("."))


def _check(value: Any, where: str, depth: int) -> None:
    if isinstance(value, int) and not -_WHOLE <= value < _WHOLE:
        raise InputError(f"{where}: a whole number of {len(hex(value)) * 4} bits; TOML has those of 64")
    inner = [item for _, item in _inner(value)]
    if depth == 0:
        raise _too_deep(where)
    for item in inner:
        _check(item, where, depth - 1)


def _inner(value: object) -> Iterable[tuple[str, Any]]:
    if isinstance(value, dict):
        return value.items()
    return (("", item) for item in value) if isinstance(value, list) else ()


def _too_deep(where: str) -> InputError:
    return InputError(
        f"{where}: more than {DEEPEST} tables or lists within each other; give a plainer TOML file"
    )


GB = 10**9
OWN = 2 * GB
"""Address space of the interpreter and its libraries themselves [bytes]: with less, they abort."""
COPIES = 3
"""Memory per unpacked byte: the data exist packed, unpacked and as the answer."""


def address_space() -> float:
    """Most of the memory that this process may address [bytes]: `ulimit -v`; infinite without such a limit."""
    try:
        import resource
    except ImportError:  # not on Windows
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return math.inf if limit == resource.RLIM_INFINITY else limit


def check_address_space() -> None:
    """Refuse to begin where a library would abort the process.

    Raises:
        InputError: this process may address less memory than the libraries need.
    """
    if address_space() < OWN:
        raise InputError(
            f"this process may address {address_space() / GB:.2g} GB of memory, and its libraries need {OWN / GB:g} GB;"
            " raise the limit with: ulimit -v unlimited"
        )


MIN_OPEN_FILES = 64
"""Files that a process may have open at least: of a figure, matplotlib keeps open some 15 fonts and libraries."""


def check_open_files() -> None:
    """Refuse to begin where a library would fail, or abort the process, for want of open files.

    Raises:
        InputError: this process may open fewer files than the libraries need.
    """
    try:
        import resource
    except ImportError:  # there are no such limits
        return
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if 0 <= limit < MIN_OPEN_FILES:
        raise InputError(
            f"this process may have {limit} files open, and its libraries need {MIN_OPEN_FILES};"
            " raise the limit with: ulimit -n 1024"
        )


@dataclass(frozen=True)
class ReadingLimits:
    """The most that reading one file may take.

    Args:
        size: of what it unpacks to [bytes]; of a file that is not packed, its own size.
        seconds: to read it [s].
        what: the file is, as "a log"; errors say it.
        larger, longer: remedies where it is too large, and where it takes too long.
    """

    size: float = 2.0 * GB
    seconds: float = 600.0
    what: str = "a log"
    larger: str = "if this size is intended, raise the limit with --max-size GB"
    longer: str = "if it is whole and merely long, raise the limit with --max-seconds S"

    def __post_init__(self) -> None:
        for name, value in (("--max-size", self.size), ("--max-seconds", self.seconds)):
            if not value > 0:
                raise InputError(f"{name} must be above 0, got {value:g}")


class LimitError(InputError):
    """A file takes more than it may; unlike damage, this is never read around."""


@dataclass
class ReadingBudget:
    """Remaining limits while one file is read.

    Args:
        path: the file.
        limits: of it.
    """

    path: Path
    limits: ReadingLimits = field(default_factory=ReadingLimits)
    _spent: float = 0.0
    _begun: float = field(default_factory=monotonic)

    def check(self, size: float) -> None:
        """Refuse something of this size [bytes] before it is unpacked or read into memory.

        Raises:
            LimitError: it is more than may still come.
        """
        if COPIES * (self._spent + size) + OWN > address_space():
            raise LimitError(
                f"{self.path} needs {(COPIES * (self._spent + size) + OWN) / GB:.4g} GB of memory to be read, and this"
                f" process may address {address_space() / GB:.4g} GB; raise the limit with: ulimit -v unlimited"
            )
        if self._spent + size > self.limits.size:
            raise LimitError(
                f"{self.path} holds more than {self.limits.size / GB:.4g} GB unpacked,"
                f" the limit for {self.limits.what}; {self.limits.larger}"
            )

    def take(self, size: float) -> None:
        """Count something that was unpacked [bytes], and the time so far.

        Raises:
            LimitError: that is more than may be.
        """
        self.check(size)
        self._spent += size
        if self.seconds_left <= 0:
            raise self.too_long()

    @property
    def seconds_left(self) -> float:
        """Until the limit of time [s]."""
        return self.limits.seconds - (monotonic() - self._begun)

    def too_long(self) -> LimitError:
        """The error for a file that takes too long."""
        return LimitError(
            f"{self.path} takes more than {self.limits.seconds:g} s to read, the limit for {self.limits.what};"
            f" {self.limits.longer}"
        )
