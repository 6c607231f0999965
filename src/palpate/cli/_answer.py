"""The one JSON object that a command prints with `--json`: the result and the command."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from palpate.cli._program import EXPANDED, command, program
from palpate.cli._terminal import print_json

_WRITTEN = {"out", "report", "figure", "figures", "experiment", "save_options"}
"""Options that name what a command writes, not what it reads."""


def print_answer(found: Mapping[str, Any]) -> None:
    """Print the result as one JSON object, with everything needed to repeat the command.

    That is the `command`, palpate's `version`, the given `options`, and the input `files` with their SHA-256. Keys of
    these names in the result are kept; docs/json.md has the keys of each command.
    """
    from palpate import __version__

    options = given()
    head = {"command": command(), "version": __version__, "options": _plain(options)}
    print_json({**head, **({} if "files" in found else {"files": _files(options)}), **found})


def given() -> dict[str, Any]:
    """All given options that differ from their defaults, by their names in the help."""
    words = list(EXPANDED.get())
    bound = program(*words[:1]).parse_args(words, print_error=False, exit_on_error=False)[1]
    found: dict[str, Any] = {}
    for name, value in bound.arguments.items():
        found |= _of_group(value) if is_dataclass(value) else {name: value}
    return {name.rstrip("_"): value for name, value in found.items() if name != "json"}


def _of_group(group: Any) -> dict[str, Any]:
    values = {own.name: (getattr(group, own.name), own.default) for own in fields(group)}
    return {name: value for name, (value, default) in values.items() if value != default}


def _files(options: Mapping[str, Any]) -> list[dict[str, str]]:
    from palpate.report.identification.words import sha256_of

    named = [path for name, value in options.items() if name not in _WRITTEN for path in _paths(value)]
    return [{"file": str(path), "sha256": sha256_of(path)} for path in dict.fromkeys(named) if path.is_file()]


def _paths(value: Any) -> Iterator[Path]:
    """Possible input files: a path, or a name with an ending, as of an arm's or an experiment's own file."""
    for one in value if isinstance(value, tuple | list) else (value,):
        if isinstance(one, Path) or (isinstance(one, str) and Path(one).suffix and "\0" not in one):
            yield Path(one)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value
