"""The program and its commands, each imported when it is used; an answer as JSON, with the call that made it."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.util import find_spec
from inspect import getdoc
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App, Group, Parameter

from palpate.cli._help import PhraseFormatter
from palpate.cli._terminal import place, print_json, show_answer
from palpate.cli.options.values import value_of
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.report.page import CommandAnswer

TYPED: ContextVar[tuple[str, ...]] = ContextVar("TYPED", default=())
"""The words after the program's name, as they were typed."""
EXPANDED: ContextVar[tuple[str, ...]] = ContextVar("EXPANDED", default=())
"""The same, with the options of an options file or a preset."""

# In the order of the help. Each is a function of its own name in the module of its own name,
# and returns its exit code. The line is repeated here so that the help imports none of them.
COMMANDS = {
    "identify": "Identify the touched surface from a log: stiffness, damping, mass.",
    "payload": "Identify a tool from a log of free motion: mass, centre, the sensor's bias.",
    "topics": "List the signals of a log: topics, variables, columns.",
    "tune": "Tune a force loop for an arm, and prove where it is stable.",
    "export": "Write an identified surface as the contact of a simulator's scene.",
    "press": "Press with a desired force: any serial arm in simulation, or a real one over its wire.",
    "run": "Run an experiment: the arm approaches, touches, presses.",
    "speed": "Measure the time of one tick of the closed loop on this machine.",
    "completion": "Print a shell's completion script for commands, options and files.",
}


_PROGRAM = Group("The program itself", sort_key=5)
GROUPS = {
    Group("From a log", sort_key=1): ("identify", "payload", "topics", "excite", "map"),
    Group("Force loop", sort_key=2): ("tune", "certify", "press", "slide"),
    Group("Simulate", sort_key=3): ("export", "run", "live", "study", "checks"),
    Group("Thesis and references", sort_key=4): ("benchmark", "laboratory", "references", "thesis"),
    _PROGRAM: ("speed", "completion"),
}
"""Commands by what a user begins with, in the order of the help."""
# Commands of other distributions, by the distribution that has them.
COMPANIONS = {
    "excite": "palpate-excitation",
    "certify": "palpate-certify",
    "checks": "palpate-checks",
    "live": "palpate-live",
    "map": "palpate-maps",
    "study": "palpate-studies",
    "thesis": "palpate-thesis",
    "laboratory": "palpate-laboratory",
    "references": "palpate-references",
    "benchmark": "palpate-benchmark",
    "slide": "palpate-slide",
}
ENTRY_POINTS = "palpate.commands"
"""The group of entry points by which a distribution adds a command: its name, and module:function."""


def command() -> str:
    """The whole command, as it can be typed again."""
    return shlex.join(["palpate", *TYPED.get()])


def _version() -> str:
    from importlib.metadata import version

    return version("palpate")


def _describe(place: str) -> str:
    """A command's docstring before its parameters, each paragraph on one line for the terminal to wrap."""
    module, _, function = place.partition(":")
    text = getdoc(getattr(import_module(module), function)) or ""
    description = re.split(r"\n(?:Parameters\n-|Args:\n|Returns:\n)", text)[0]
    return "\n\n".join(" ".join(part.split()) for part in description.split("\n\n")).strip()


def added_commands() -> dict[str, str]:
    """Commands of other installed distributions: by name, the place of the function as module:function."""
    from importlib.metadata import entry_points

    return {e.name: e.value for e in sorted(entry_points(group=ENTRY_POINTS)) if e.name not in COMMANDS}


def option_of(name: str, extra: str) -> Any:
    """The function of another distribution that does what an option of palpate's own commands asks for.

    Args:
        name: of the option, as `wire`.
        extra: of palpate, by which that distribution is installed.

    Raises:
        InputError: it is not installed.
    """
    from importlib.metadata import entry_points

    for entry in entry_points(group="palpate.options", name=name):
        return entry.load()
    raise InputError(f"--{name} is of palpate-{extra}, which is not installed: pip install palpate[{extra}]")


def _file_of(module: str) -> Path:
    """File of a module. Of its outermost package alone the import system is asked: for more it would import that."""
    package, *inner = module.split(".")
    spec = find_spec(package)
    origin = Path((spec and spec.origin) or "")
    return origin.parent.joinpath(*inner).with_suffix(".py") if inner else origin


def _first_line(place: str) -> str:
    """The first line of a function's docstring, from its source: neither the module nor its package is imported."""
    module, _, function = place.partition(":")
    with suppress(ImportError, OSError, SyntaxError, ValueError):
        for node in ast.parse(_file_of(module).read_bytes()).body:
            if isinstance(node, ast.FunctionDef) and node.name == function:
                return (ast.get_docstring(node) or "").partition("\n")[0]
    return "Not readable; install its distribution again."


def program(asked: str = "") -> App:
    """The whole command line; errors are raised, not printed, and results are returned.

    Args:
        asked: the typed command, whose help is its docstring with the examples. Other distributions are searched for
            commands only if it is none of palpate's own.

    Raises:
        InputError: a command of a distribution that is not installed.
    """
    app = App(
        name="palpate",
        help="Identify the surface that a robot touches, and press on it with exactly the desired force.",
        version=_version,
        help_format="plaintext",
        help_formatter=PhraseFormatter(),
        group_parameters=Group("Options", sort_key=0),
        group_commands=_PROGRAM,
        exit_on_error=False,
        print_error=False,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
        # A name that begins with a bracket is a name, not a list in JSON.
        default_parameter=Parameter(converter=value_of, json_list=False, json_dict=False),
    )
    own = {name: f"palpate.cli.{name.replace('-', '_')}:{name.replace('-', '_')}" for name in COMMANDS}
    added = {} if asked in COMMANDS else added_commands()
    if asked in COMPANIONS and asked not in added:
        package = COMPANIONS[asked]
        raise InputError(f"{asked} is a command of {package}, which is not installed: pip install {package}")
    order = [name for names in GROUPS.values() for name in names]
    for name, function in (own | added).items():
        group = next((group for group, names in GROUPS.items() if name in names), _PROGRAM)
        text = _describe(function) if name == asked else COMMANDS.get(name) or _first_line(function)
        key = order.index(name) if name in order else len(order)
        app.command(function, name=name, help=text, sort_key=key, group=group)
    return app


_WRITTEN = {"out", "report", "figure", "figures", "experiment", "save_options"}
"""Options that name what a command writes, not what it reads."""


def print_answer(found: Mapping[str, Any]) -> None:
    """Print the result as one JSON object, with everything needed to repeat the command.

    That is the `command`, palpate's `version`, the given `options`, and the input `files` with their SHA-256. Keys of
    these names in the result are kept; docs/json.md has the keys of each command.
    """
    from importlib.metadata import version

    options = given_options()
    head = {"command": command(), "version": version("palpate"), "options": _plain(options)}
    print_json({**head, **({} if "files" in found else {"files": _files(options)}), **found})


def print_result(answer: CommandAnswer, *, json: bool, files: Iterable[tuple[str, object]] = ()) -> None:
    """Print an answer as one JSON object, or as text with the written files.

    Args:
        answer: of the command.
        json: whether a program asks.
        files: the word before each path, and the path.
    """
    if json:
        print_answer(answer.json)
        return
    screen = show_answer(answer)
    for what, path in files:
        place(screen, what, path)


def given_options() -> dict[str, Any]:
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
    return str(value) if isinstance(value, Path | str) else value
