"""Plug-ins: code of the user's that an experiment's or a study's file names as ``module:Name``.

A file is data, and may be a stranger's: a name in it is imported only if the user permits that, by `permit`, within
`consent`, or by ``--plugins``. A record, a journal or a folder of results never names code to run: they hold its name
as a text, and nothing that reads them comes here.
"""

import hashlib
import importlib
import importlib.util
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import Any

from palpate._jit.cache import PACKAGE, foreign_files
from palpate.errors import InputError, PluginError

_FOLDERS: dict[Path, None] = {}
"""Folders of the files that named plug-ins in this process; modules are the process' own, and so are these."""
_IMPORTING = threading.RLock()
_STAMPS: dict[str, str] = {}
"""Sources of each module when it was imported."""
_PERMITTED: set[str] = set()
"""Names that may be imported."""
_ASKS: list[Callable[[str], bool]] = []
"""Functions that are asked about any other name; the last one answers, and without one the answer is no."""


@dataclass(frozen=True)
class Plugin:
    """A name of the user's code, with what tells its sources from others; it may go to another process.

    Args:
        name: ``module:Name``.
        folder: where the module was found; "" for one that is installed.
        stamp: a hash of its sources.
    """

    name: str
    folder: str
    stamp: str

    def value(self) -> Any:
        """The object of that name.

        Raises:
            InputError: it cannot be imported here, or has other sources here.
        """
        permit(self.name)  # a value of this class comes from `plugin`, here or where this process was sent it
        if self.folder:
            look_in(Path(self.folder))
        here = plugin(self.name)
        if here.stamp != self.stamp:
            raise InputError(
                f"{self.name} has other sources here than where it was asked for; install the same on all machines"
            )
        return _attribute(*_parts(self.name))


def is_plugin(name: object) -> bool:
    """True if a word names the user's code rather than a part of palpate."""
    return isinstance(name, str) and ":" in name and not any(letter.isspace() for letter in name)


def look_in(folder: Path) -> None:
    """Modules are looked for in this folder, too: that of the file that names them."""
    _FOLDERS[folder.resolve()] = None


def permit(*names: str) -> None:
    """Lets files name this code, ``module:Name``, from now on: its import runs it with the rights of this process."""
    _PERMITTED.update(names)


@contextmanager
def consent(ask: Callable[[str], bool]) -> Iterator[None]:
    """Within the block, in every thread, a name that is not permitted may run if `ask` of it is true; asked once."""
    before = set(_PERMITTED)
    _ASKS.append(ask)
    try:
        yield
    finally:
        _ASKS.pop()
        _PERMITTED.intersection_update(before)


def plugin(name: str) -> Plugin:
    """Imports the object of a name.

    Modules that are installed come first, then those beside the file that names them, then the current folder's.

    Raises:
        PluginError: the user has not permitted it.
        InputError: no such module, no such name in it, or it raises when it is imported.
    """
    module_name, attribute = _parts(name)
    with _IMPORTING:
        _check_permitted(name)
    with _IMPORTING, _findable():
        module = _import(module_name, name)
        _attribute(module_name, attribute)
    file = Path(getattr(module, "__file__", None) or "").resolve()
    return Plugin(name, str(_top(module_name, file)), _STAMPS[module_name])


def _check_permitted(name: str) -> None:
    if name in _PERMITTED:
        return
    if not (_ASKS and _ASKS[-1](name)):
        raise PluginError(
            f"{name!r} names code, which would run with your rights: read the module, then add --plugins "
            f"(in a script: palpate.plugins.permit({name!r}))"
        )
    permit(name)


def where_it_fails(error: BaseException) -> str:
    """The user's own line that an error comes from, as ``student.py, line 12``; "" if none does."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{Path(error.filename).name}, line {error.lineno}"
    frames = [
        f for f in traceback.extract_tb(error.__traceback__) if _of_the_user(Path(f.filename).resolve())
    ]
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""


def _of_the_user(file: Path) -> bool:
    """True if a file belongs neither to palpate nor to an installed library."""
    if file in foreign_files:
        return True
    libraries = {Path(path) for path in (sys.prefix, sys.base_prefix)}
    return file.suffix == ".py" and PACKAGE not in file.parents and not libraries & set(file.parents)


def reason(error: BaseException) -> str:
    """An error of the user's code in one line: where, of which kind, and its own words."""
    location = where_it_fails(error)
    try:
        words = error.msg if isinstance(error, SyntaxError) else " ".join(str(error).split())
    except BaseException:  # noqa: BLE001 - the words are the user's code, too
        words = ""
    message = f"{type(error).__name__}: {words}" if words else type(error).__name__
    return f"{location}: {message}" if location else message


def _parts(name: str) -> tuple[str, str]:
    module, _, attribute = name.partition(":")
    if module.endswith(".py") or "/" in module or "\\" in module:
        good = Path(module.replace("\\", "/")).name.removesuffix(".py")
        raise InputError(f"{name!r}: a module is named without folder and .py; write '{good}:{attribute}'")
    words = [*module.split("."), attribute]
    if not all(word.isidentifier() for word in words):
        raise InputError(f"{name!r} names no code: write module:Name, as in student:Damped")
    return module, attribute


@contextmanager
def _findable() -> Iterator[None]:
    """The folders at the end of the path, so that no file in them takes the place of an installed module."""
    added = [folder for folder in map(str, _search()) if folder not in sys.path]
    sys.path.extend(added)
    importlib.invalidate_caches()
    try:
        yield
    finally:
        for folder in added:
            if folder in sys.path:
                sys.path.remove(folder)


def _search() -> Sequence[Path]:
    return list(dict.fromkeys([*reversed(_FOLDERS), Path.cwd()]))


def _import(module: str, name: str) -> ModuleType:
    before = set(sys.modules)
    top = module.partition(".")[0]
    candidates = [
        f for folder in _search() for f in (folder / f"{top}.py", folder / top / "__init__.py") if f.is_file()
    ]
    try:
        with redirect_stdout(sys.stderr):  # what it prints is no part of a command's output
            loaded = importlib.import_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        missing = str(error.name) if isinstance(error, ModuleNotFoundError) else ""
        if missing == module or (missing and module.startswith(f"{missing}.")):
            raise InputError(_not_there(module, name)) from None
        foreign_files.update(f.resolve() for f in candidates)
        raise InputError(f"{name} cannot be imported: {reason(error)}") from error
    _check_place(top, candidates)
    if module not in _STAMPS:
        files = _sources(module, loaded, before)
        foreign_files.update(files)
        _STAMPS[module] = _hash(files)
    return loaded


def _check_place(top: str, candidates: Sequence[Path]) -> None:
    """Refuses a module that another one of its name has taken the place of."""
    got = Path(getattr(sys.modules[top], "__file__", None) or "").resolve()
    if candidates and got not in {f.resolve() for f in candidates}:
        raise InputError(
            f"{candidates[0]} is hidden by another module of its name, {got}; give it another name"
        )
    if len(candidates) > 1 and got != candidates[0].resolve():
        raise InputError(
            f"{candidates[0]} is hidden by {got}, imported before it; give one of them another name"
        )


def _sources(module: str, plugin: ModuleType, before: set[str]) -> list[Path]:
    """The file of a module, and those beside it that it imported."""
    main_file = getattr(plugin, "__file__", None)
    if main_file is None:
        return []
    folder = Path(main_file).resolve().parent
    top = module.partition(".")[0]
    files = {Path(main_file).resolve()}
    for name, imported in list(sys.modules.items()):
        file = getattr(imported, "__file__", None)
        if file is None or (name in before and name.partition(".")[0] != top):
            continue
        if folder in Path(file).resolve().parents:
            files.add(Path(file).resolve())
    return sorted(files)


def _hash(files: Sequence[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _top(module: str, file: Path) -> Path | str:
    """The folder that a module is imported from; "" where that is on the path anyway."""
    for _ in range(module.count(".") + 1 if file.name != "__init__.py" else module.count(".") + 2):
        file = file.parent
    return "" if str(file) in sys.path else file


def _attribute(module: str, attribute: str) -> Any:
    loaded = sys.modules[module]
    try:
        return getattr(loaded, attribute)
    except AttributeError:
        names = sorted(k for k in vars(loaded) if not k.startswith("_"))
        near = get_close_matches(attribute, names, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"it has: {', '.join(names) or 'nothing'}"
        raise InputError(f"the module {module!r} has no {attribute!r}; {hint}") from None


def _not_there(module: str, name: str) -> str:
    here = {f.stem for folder in _search() for f in folder.glob("*.py")}
    near = get_close_matches(module, sorted(here), n=1)
    hint = f"did you mean '{near[0]}:{name.partition(':')[2]}'? " if near else ""
    places = " and ".join(dict.fromkeys(map(str, _search())))
    return (
        f"{name}: there is no module {module!r}; {hint}looked for among the installed ones, and in {places}"
    )
