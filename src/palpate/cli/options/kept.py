"""Options of a cell, saved in a TOML file; the command line overrides them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cyclopts import App

from palpate.cli.options.values import options_given
from palpate.errors import InputError, unknown
from palpate.files import MADE, as_toml, read_text, read_toml, write_text

_FILE_OPTIONS = {"--options": "options", "--preset": "preset"}
_CALL_OPTIONS = {
    "options",
    "preset",
    "save-options",
    "figure",
    "report",
    "json",
    "out",
    "replace",
    "wire",
    "yes",
    "dry-run",
    "record",
    "recover",
}
"""Options of a single call rather than of a cell, above all those that move an arm."""
_HELP_WORDS = {"--help", "-h"}
"""Words that ask for a page of help, which no file of options changes."""
_CALL_OPTIONS_BY_COMMAND = {"press": {"force", "position", "seconds"}}
"""Options of a single call by command, which are options of the cell in other commands."""
_PATHS = {"payload", "robot-stiffness-from", "gains", "certificate"}
"""Options that name a file: beside the options' own file, unless the path is absolute."""
_KNOWN_BY = ("identify", "press")
"""Commands that take one file together: what one of them knows is no mistake to the other."""


def save_options(path: Path, parts: Iterable[Any], command: str) -> None:
    """Write options that are of a cell, rather than of a single call of the command."""
    once = _CALL_OPTIONS | _CALL_OPTIONS_BY_COMMAND.get(command, set())
    table = {name: _plain(value) for name, value in options_given(parts).items() if name not in once}
    write_text(path, f"{MADE} --save-options; --options takes it.\n{as_toml(table).rstrip()}\n")


def expand(argv: Sequence[str], app: App) -> list[str]:
    """The words of a command, followed by those of its options file and preset.

    Raises:
        InputError: no such file or preset, an unknown option, an invalid value.
    """
    words = list(argv)
    given = {name: _flag_value(words, flag) for flag, name in _FILE_OPTIONS.items()}
    is_plain = given["options"] is None and given["preset"] is None
    if not words or is_plain or words[0] not in _commands(app) or _HELP_WORDS & set(words):
        return words
    flags = _flags(app, words[0])
    if "options" not in flags:
        return words
    known = set(flags).union(*(_flags(app, name) for name in _KNOWN_BY))
    saved: dict[str, Any] = {}
    if given["preset"] is not None:
        saved |= _preset(given["preset"], known)
    if given["options"] is not None:
        saved |= _file(Path(given["options"]), known)
    typed = {word.partition("=")[0] for word in words if word.startswith("--")}
    allowed = set(flags) - _CALL_OPTIONS_BY_COMMAND.get(words[0], set())
    saved = {key: value for key, value in saved.items() if key in allowed and not typed & set(flags[key])}
    return [*words, *(word for key, value in saved.items() for word in _write(key, value))]


def _commands(app: App) -> list[str]:
    return [str(name) for name in app if not str(name).startswith("-")]


def _flags(app: App, command: str) -> dict[str, tuple[str, ...]]:
    """The options of a command: by plain name, all names that they go by."""
    arguments = app[command].assemble_argument_collection()
    return {
        name.removeprefix("--"): tuple(argument.names)
        for argument in arguments
        for name in argument.names
        if name.startswith("--") and not name.startswith("--no-")
    }


def _flag_value(words: Sequence[str], flag: str) -> str | None:
    """The value of a flag; None if it is absent, or has none."""
    for i, word in enumerate(words):
        if word.startswith(f"{flag}="):
            return word.partition("=")[2]
        if word == flag and i + 1 < len(words):
            return words[i + 1]
    return None


def _preset(name: str, known: set[str]) -> dict[str, Any]:
    from palpate.logs.presets import preset

    return _check(preset(name), f"preset {name}", known)


def _file(path: Path, known: set[str]) -> dict[str, Any]:
    table = read_toml(read_text(path, "options"), str(path))
    saved = _check(table, str(path), known)
    if "preset" in table:
        saved = _preset(str(table["preset"]), known) | saved
    for key in _PATHS & set(saved):
        saved[key] = str(path.parent / str(saved[key]))
    return saved


def _check(table: Mapping[str, Any], where: str, known: set[str]) -> dict[str, Any]:
    checked = {}
    for key, value in table.items():
        name = key.replace("_", "-")
        if name == "preset":
            continue
        if name in _CALL_OPTIONS or name not in known:
            try:
                raise unknown("option", name, known - _CALL_OPTIONS)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
        plain = isinstance(value, str | bool | int | float)
        if not plain and not (
            isinstance(value, list) and all(isinstance(v, str | int | float) for v in value)
        ):
            raise InputError(f"{where}: {key} must be a text, a number, true or false, got {value!r}")
        checked[name] = value
    return checked


def _write(key: str, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [f"--{key}"] if value else []
    if isinstance(value, list):
        return [f"--{key}={item}" for item in value]
    return [f"--{key}={value}"]


def _plain(value: Any) -> Any:
    return str(value.absolute()) if isinstance(value, Path) else value
