"""The registry of laws and parts, and the cache of the kernels that are made of them.

Numba is not imported before a kernel is needed. The cache has hashed files, a stamp of the sources that a kernel
depends on, and one process at a time that compiles.

A spoiled file is compiled again, never executed; a kernel of other sources is never run.
"""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from palpate._vector import Mat3, Vec3, Vec6

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)

laws: list[Callable[..., Any]] = []
foreign_laws: list[Callable[..., Any]] = []
parts: dict[type, None] = {}
stored: dict[Callable[..., Any], tuple[type, bool]] = {}
"""Functions that read (true), or write, a part's numbers in an array: `palpate._jit.overloads`."""
foreign_files: set[Path] = set()
"""Sources of the user's plug-ins, and what they import from beside them."""
PACKAGE = Path(__file__).resolve().parent.parent


def law(function: F) -> F:
    """Marks a plain function as usable inside kernels. It stays a plain function."""
    laws.append(function)
    if PACKAGE not in Path(function.__code__.co_filename).parents:
        foreign_laws.append(function)
    return function


def part(cls: C) -> C:
    """Marks a NamedTuple whose methods are usable inside kernels. It stays a plain class."""
    parts[cls] = None
    return cls


part(Vec3)
part(Mat3)
part(Vec6)


_HASH = hashlib.sha256().digest_size


def _unpickle(data: bytes) -> Any:
    return pickle.loads(data)  # noqa: S301 - as Numba does, but only of a file that is as it was written


@cache
def hashed_files() -> type:
    """Numba's class of a kernel's cache files, with hashes; Numba is imported at the first call.

    A data file holds machine code as a pickle, and the index names it: a bit that flips in either may execute anything.
    The index begins with its own hash and holds that of each data file, so a data file of other sources, which a power
    cut between two writes leaves behind, is not taken either.
    """
    from numba.core.caching import IndexDataCacheFile

    class HashedFiles(IndexDataCacheFile):  # type: ignore[misc]
        """Index: hash, then a pickle of (version, stamp, {key: (file, hash of the file)})."""

        def load(self, key: Any) -> Any:
            """The kernel of a key; None where there is none, or its file is not as it was written."""
            name, digest = self._load_index().get(key, ("", b""))
            data = self._read(name) if name else b""
            return _unpickle(data) if hashlib.sha256(data).digest() == digest else None

        def save(self, key: Any, data: Any) -> None:
            """Adds a kernel: its data first, so that no index names a file that is not there yet."""
            overloads = self._load_index()
            taken = {name for other, (name, _) in overloads.items() if other != key}
            name = next(name for name in map(self._data_name, count(1)) if name not in taken)
            dumped = self._dump(data)
            self._write(name, dumped)
            self._save_index({**overloads, key: (name, hashlib.sha256(dumped).digest())})

        def _load_index(self) -> dict[Any, tuple[str, bytes]]:
            data = self._read(self._index_name)
            digest, held = data[:_HASH], data[_HASH:]
            if hashlib.sha256(held).digest() != digest:
                return {}
            version, dumped = _unpickle(held)
            if version != self._version:  # another Numba's pickle may not even be readable
                return {}
            stamp, overloads = _unpickle(dumped)
            return dict(overloads) if stamp == self._source_stamp else {}

        def _save_index(self, overloads: dict[Any, tuple[str, bytes]]) -> None:
            held = pickle.dumps((self._version, self._dump((self._source_stamp, overloads))))
            self._write(self._index_name, hashlib.sha256(held).digest() + held)

        def _read(self, name: str) -> bytes:
            with suppress(OSError):  # never there, or unreadable: compiled again
                return Path(self._data_path(name)).read_bytes()
            return b""

        def _write(self, name: str, data: bytes) -> None:
            with self._open_for_write(self._data_path(name)) as file:
                file.write(data)

    return HashedFiles


class CompileLock:
    """A lock on the file that defines a kernel, from a miss in the cache until the kernel is there.

    Without it, processes that start together each compile the same, and two that save at the same moment may give
    different kernels the same file, since Numba's cache has no lock of its own. The lock ends with its process, however
    that ends. Where a system or a file system has none, each process compiles for itself.
    """

    def __init__(self, source: Path):
        self._source = source
        self._handle: int | None = None
        self._holder: int | None = None

    def wait(self) -> None:
        """Return when no other process compiles a kernel of this file."""
        if self._handle is not None:
            return
        with suppress(ImportError, OSError):  # not on Windows, nor on every file system
            import fcntl

            handle = os.open(self._source, os.O_RDONLY | os.O_CLOEXEC)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX)
            except BaseException:
                os.close(handle)
                raise
            self._handle, self._holder = handle, threading.get_ident()

    def release(self) -> None:
        """Let the next process in, if it is this thread that keeps it out."""
        if self._handle is not None and self._holder == threading.get_ident():
            handle, self._handle = self._handle, None
            os.close(handle)


STARTED = time.time()
"""When this process imported the package; a file that changed later is not the one whose code runs here [s]."""
_IMPORT = re.compile(r"^\s*(?:from|import) (palpate[\w.]*)(?: import (\([^)]*\)|[^\n]*))?", re.MULTILINE)


def sources_stamp(*files: Path) -> str:
    """A hash of these files and of all that they import of palpate and its companions, directly or not.

    A kernel is stale when any file that it may call has changed, which Numba, left alone, does not see.
    """
    return _digest(_sources(files))


def _digest(sources: dict[Path, bytes]) -> str:
    digest = hashlib.sha256()
    for file, source in sorted(sources.items()):
        digest.update(str(file).encode() + b"\0" + source)
    return digest.hexdigest()


def _sources(files: Iterable[Path]) -> dict[Path, bytes]:
    """The text of these files and of all that they import, by their places."""
    reached: dict[Path, bytes] = {}
    waiting = [f.resolve() for f in files]
    while waiting:
        file = waiting.pop()
        if file not in reached and file.exists():
            reached[file] = file.read_bytes()
            text = reached[file].decode("utf-8", "replace")
            waiting.extend(p for root in {PACKAGE.parent, _root_of(file)} for p in _imports(text, root))
    return reached


def _root_of(file: Path) -> Path:
    """The folder that holds the file's outermost package: beside palpate's own that of a companion."""
    return next(folder for folder in file.parents if not (folder / "__init__.py").is_file())


@functools.cache
def _imports(text: str, root: Path) -> list[Path]:
    """Files under the root that a source imports names from, or as modules."""
    found = []
    for module, names in _IMPORT.findall(text):
        place = root.joinpath(*module.split("."))
        modules = [place, *(place / name.split(" as ")[0].strip(" ()\n\t") for name in names.split(","))]
        for m in modules:
            found += [p for p in (m.with_suffix(".py"), m / "__init__.py") if m.name and p.is_file()]
    return found


def stamp_of(function: Callable[..., Any], types_of_arguments: tuple[Any, ...]) -> str | None:
    """A hash of all that a kernel given such arguments may depend on; None where it cannot be kept.

    A kernel of the package that is given only the package's parts depends on its own file, theirs, and what those
    import. With something of the user's among them it may call any law and part registered from outside. Without a
    file there is nothing to ask; and a class of a script is another class the next time that the script runs. The
    package's own files count where those import them, whatever else this process has imported so far. After an upgrade
    under a running process the old code in its memory would be kept as that of the new files: it keeps none.
    """
    classes = set(parts_among(types_of_arguments))
    if any(cls.__module__ == "__main__" for cls in classes):
        return None
    things = {function, *classes}
    beside: set[Path] = set()
    if any(_foreign(x) for x in things):
        things |= {x for x in (*foreign_laws, *parts) if _foreign(x)}
        beside = foreign_files
    files = {home_of(x) for x in things} | beside
    if not all(f.is_file() for f in files):
        return None
    sources = _sources(files)
    own = (f for f in sources if PACKAGE in f.parents)
    return None if any(f.stat().st_ctime > STARTED for f in own) else _digest(sources)


def _foreign(thing: Any) -> bool:
    return PACKAGE not in home_of(thing).parents


def home_of(thing: Any) -> Path:
    """The file that defines a function or a class."""
    return Path(getattr(sys.modules.get(thing.__module__), "__file__", None) or "nowhere").resolve()


def parts_among(numba_types: Any) -> Any:
    """The classes of the parts among these types, those inside other parts too."""
    for kind in numba_types:
        cls = getattr(kind, "instance_class", None)
        if cls is not None and cls in parts:
            yield cls
        members = getattr(kind, "types", None)
        if members is not None:
            yield from parts_among(members)


def text_of(numba_types: Any) -> str:
    """The types in words, with the home of every part's class."""
    classes = (f"{cls.__module__}.{cls.__qualname__}" for cls in parts_among(numba_types))
    return "; ".join([*map(str, numba_types), *classes])
