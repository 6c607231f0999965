"""Options of a cell, saved in a TOML file; the command line overrides them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cyclopts import App

from palpate.cli.options.values import options_given
from palpate.errors import InputError, unknown
from palpate.files import MADE, read_text, read_toml, write_text

_SAID = {"--options": "options", "--preset": "preset"}
_NEVER = {
    "options", "preset", "save-options", "figure", "no-figure", "report", "json", "out", "replace",
    "wire", "yes", "dry-run", "record", "recover",
}  # fmt: skip
"""Options of a single call rather than of a cell, above all those that move an arm."""
_ASKS_HELP = {"--help", "-h"}
"""Words that ask for a page of help, which no file of options changes."""
_TYPED = {"press": {"force", "position", "seconds"}}
"""By command, what is of a call there, though the same word is of the cell elsewhere."""
_PATHS = {"payload", "robot-stiffness-from", "gains", "certificate"}
"""Options that name a file: beside the options' own file, unless the path is absolute."""
_KNOWN_BY = ("identify", "press")
"""Commands that take one file together: what one of them knows is no mistake to the other."""


def save_options(path: Path, parts: Iterable[Any], command: str) -> None:
    """Write options that are of a cell, rather than of a single call of the command."""
    once = _NEVER | _TYPED.get(command, set())
    write_text(path, _toml({name: value for name, value in options_given(parts).items() if name not in once}))


def expand(argv: Sequence[str], app: App) -> list[str]:
    """The words of a command, followed by those of its options file and preset.

    Raises:
        InputError: no such file or preset, an unknown option, an invalid value.
    """
    words = list(argv)
    given = {name: _value_of(words, flag) for flag, name in _SAID.items()}
    nothing = given["options"] is None and given["preset"] is None
    if not words or nothing or words[0] not in _commands(app) or _ASKS_HELP & set(words):
        return words
    flags = _flags(app, words[0])
    if "options" not in flags:
        return words
    known = set(flags).union(*(_flags(app, name) for name in _KNOWN_BY))
    kept: dict[str, Any] = {}
    if given["preset"] is not None:
        kept |= _preset(given["preset"], known)
    if given["options"] is not None:
        kept |= _file(Path(given["options"]), known)
    typed = {word.partition("=")[0] for word in words if word.startswith("--")}
    own = set(flags) - _TYPED.get(words[0], set())
    kept = {key: value for key, value in kept.items() if key in own and not typed & set(flags[key])}
    return [*words, *(word for key, value in kept.items() for word in _write(key, value))]


def _commands(app: App) -> list[str]:
    return [str(name) for name in app if not str(name).startswith("-")]


def _flags(app: App, command: str) -> dict[str, tuple[str, ...]]:
    """The options of a command: by plain name, all names that they go by."""
    arguments = app[command].assemble_argument_collection()
    return {
        name.removeprefix("--"): tuple(one.names)
        for one in arguments
        for name in one.names
        if name.startswith("--") and not name.startswith("--no-")
    }


def _value_of(words: Sequence[str], flag: str) -> str | None:
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
    kept = _check(table, str(path), known)
    if "preset" in table:
        kept = _preset(str(table["preset"]), known) | kept
    for key in _PATHS & set(kept):
        kept[key] = str(path.parent / str(kept[key]))
    return kept


def _check(table: Mapping[str, Any], where: str, known: set[str]) -> dict[str, Any]:
    kept = {}
    for key, value in table.items():
        name = key.replace("_", "-")
        if name == "preset":
            continue
        if name in _NEVER or name not in known:
            try:
                raise unknown("option", name, known - _NEVER)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
        plain = isinstance(value, str | bool | int | float)
        if not plain and not (
            isinstance(value, list) and all(isinstance(v, str | int | float) for v in value)
        ):
            raise InputError(f"{where}: {key} must be a text, a number, true or false, got {value!r}")
        kept[name] = value
    return kept


def _write(key: str, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [f"--{key}"] if value else []
    if isinstance(value, list):
        return [f"--{key}={one}" for one in value]
    return [f"--{key}={value}"]


def _toml(table: Mapping[str, Any]) -> str:
    import msgspec

    def plain(value: Any) -> Any:
        if isinstance(value, Path):
            return str(value.absolute())
        return list(value) if isinstance(value, tuple) else value

    lines = [f"{key} = {msgspec.json.encode(plain(value)).decode()}" for key, value in table.items()]
    return "\n".join([f"{MADE} --save-options; --options takes it.", *lines]) + "\n"
