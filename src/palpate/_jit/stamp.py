"""Hash of a cached kernel's sources: stale kernels are never run."""

import functools
import hashlib
import re
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from palpate._jit.registry import PACKAGE, foreign_files, foreign_laws, parts

STARTED = time.time()
"""When this process imported the package; a file that changed later is not the one whose code runs here [s]."""
_IMPORT = re.compile(r"^\s*(?:from|import) (palpate[\w.]*)(?: import (\([^)]*\)|[^\n]*))?", re.MULTILINE)


def sources_stamp(*files: Path) -> str:
    """A hash of these files and of all that they import of palpate and its companions, directly or not.

    A kernel is stale when any file that it may call has changed, which Numba, left alone, does not see.
    """
    digest = hashlib.sha256()
    for file, source in sorted(_sources(files).items()):
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
    own = (f for f in _sources(files) if PACKAGE in f.parents)
    return None if any(f.stat().st_ctime > STARTED for f in own) else sources_stamp(*files)


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
