"""The program and its commands, each imported when it is used; an answer as JSON, with the call that made it."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import is_dataclass
from importlib import import_module
from importlib.util import find_spec
from inspect import getdoc
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cyclopts import App, Group, Parameter

from palpate.cli._help import HelpFormatter
from palpate.cli._terminal import console, guard_picture, place, print_json
from palpate.cli.options.values import changed_fields, convert_value, plain_value
from palpate.errors import InputError, how_to_install
from palpate.report.terminal import show_answer

if TYPE_CHECKING:
    from palpate.report.page import Answer

TYPED: ContextVar[tuple[str, ...]] = ContextVar("TYPED", default=())
"""The words after the program's name, as they were typed."""
EXPANDED: ContextVar[tuple[str, ...]] = ContextVar("EXPANDED", default=())
"""The typed words, with the options of an options file or a preset."""

# In the order of the help. Each is a function of its own name in the module of its own name,
# and returns its exit code. The line is repeated here so that the help imports none of them.
COMMANDS = {
    "demo": "Identify a log that comes with palpate, and say what to type next.",
    "identify": "Identify the touched surface from a log: stiffness, damping, mass.",
    "payload": "Identify a tool from a log of free motion: mass, centre, the sensor's bias.",
    "topics": "List the signals of a log: topics, variables, columns.",
    "tune": "Tune a force loop for an arm, and prove where it is stable.",
    "export": "Write an identified surface as the contact of a simulator's scene.",
    "press": "Press with a desired force: any serial arm in simulation, or a real one over its wire.",
    "run": "Run an experiment: the arm approaches, touches, presses.",
    "excite": "Design a force that identifies a surface, and predict the uncertainty.",
    "map": "Map the stiffness of a surface from presses at places, and choose the next presses.",
    "certify": "Prove where a tuned force loop is stable, or check such a proof.",
    "slide": "Hold a force while the tip moves along an unknown curved surface, in simulation or with a real arm.",
    "live": "Show a pressing arm in the browser; Ctrl-C ends it.",
    "study": "Run an experiment many times: grids, random points; resumable.",
    "checks": "Check a controller, surface, identifier or wire of your own.",
    "benchmark": "Test force control by metrics over a range of stiffness.",
    "references": "Check solvers against 44 contact logs with parameters certified to 11 digits.",
    "speed": "Measure the time of one tick of the closed loop on this machine.",
    "completion": "Print a shell's completion script for commands, options and files.",
}


_PROGRAM = Group("The program itself", sort_key=5)
GROUPS = {
    Group("From a log", sort_key=1): ("demo", "identify", "payload", "topics", "excite", "map"),
    Group("Force loop", sort_key=2): ("tune", "certify", "press", "slide"),
    Group("Simulate", sort_key=3): ("export", "run", "live", "study", "checks"),
    Group("Thesis and references", sort_key=4): ("benchmark", "laboratory", "references", "thesis"),
    _PROGRAM: ("speed", "completion"),
}
"""Commands by what a user begins with, in the order of the help."""
COMPANIONS = {
    "thesis": "palpate-thesis",
    "laboratory": "palpate-thesis",
}
"""Commands of other distributions, by the distribution that has them."""
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


def _module_file(module: str) -> Path:
    """File of a module. Of its outermost package alone the import system is asked: for more it would import that."""
    package, *inner = module.split(".")
    spec = find_spec(package)
    origin = Path((spec and spec.origin) or "")
    return origin.parent.joinpath(*inner).with_suffix(".py") if inner else origin


def _first_line(place: str) -> str:
    """The first line of a function's docstring, from its source: neither the module nor its package is imported."""
    module, _, function = place.partition(":")
    with suppress(ImportError, OSError, SyntaxError, ValueError):
        for node in ast.parse(_module_file(module).read_bytes()).body:
            if isinstance(node, ast.FunctionDef) and node.name == function:
                return (ast.get_docstring(node) or "").partition("\n")[0]
    return "Not readable; install its distribution again."


def program(typed_command: str = "") -> App:
    """The whole command line; errors are raised, not printed, and results are returned.

    Args:
        typed_command: command whose help shows its docstring with the examples. Other distributions are searched
            for commands unless it is one of palpate's own.

    Raises:
        InputError: a command of a distribution that is not installed.
    """
    app = App(
        name="palpate",
        help="Identify the surface that a robot touches, and press on it with exactly the desired force.",
        version=_version,
        help_format="plaintext",
        help_formatter=HelpFormatter(),
        group_parameters=Group("Options", sort_key=0),
        group_commands=_PROGRAM,
        exit_on_error=False,
        print_error=False,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
        # A name that begins with a bracket is a name, not a list in JSON.
        default_parameter=Parameter(converter=convert_value, json_list=False, json_dict=False),
    )
    builtin = {name: f"palpate.cli.{name.replace('-', '_')}:{name.replace('-', '_')}" for name in COMMANDS}
    added = {} if typed_command in COMMANDS else added_commands()
    if typed_command in COMPANIONS and typed_command not in added:
        package = COMPANIONS[typed_command]
        raise InputError(
            f"{typed_command} is a command of {package}, which is not installed: {how_to_install(package)}"
        )
    order = [name for names in GROUPS.values() for name in names]
    for name, function in (builtin | added).items():
        group = next((group for group, names in GROUPS.items() if name in names), _PROGRAM)
        text = _describe(function) if name == typed_command else COMMANDS.get(name) or _first_line(function)
        key = order.index(name) if name in order else len(order)
        app.command(function, name=name, help=text, sort_key=key, group=group)
    return app


_WRITTEN = {"out", "report", "figure", "figures", "experiment", "save_options"}
"""Options that name what a command writes, not what it reads."""


def print_answer(answer: Mapping[str, Any]) -> None:
    """Print the result as one JSON object, with everything needed to repeat the command.

    That is the `command`, palpate's `version`, the given `options`, and the input `files` with their SHA-256. Keys of
    these names in the result are kept; docs/json.md has the keys of each command.
    """
    from importlib.metadata import version

    options = given_options()
    head = {"command": command(), "version": version("palpate"), "options": plain_value(options)}
    print_json({**head, **({} if "files" in answer else {"files": _files(options)}), **answer})


class OutputFile(NamedTuple):
    """A file of results.

    Args:
        label: the word before its path.
        path: of the file.
        write: draws and writes it; None where it is written already.
    """

    label: str
    path: object
    write: Callable[[], object] | None = None


def print_result(answer: Answer, *, json: bool, files: Iterable[tuple[Any, ...]] = ()) -> None:
    """Print an answer as one JSON object or as text; then write its files, so that it depends on no picture.

    The files are written even where the reader of the answer has gone. A picture that cannot be drawn is one line on
    standard error.

    Args:
        answer: of the command.
        json: whether a program asks.
        files: each an `OutputFile`, or its label and path.

    Raises:
        PalpateError, OSError, MemoryError: a file that the user can have written elsewhere.
    """
    written: list[OutputFile] = []
    screen = None
    try:
        if json:
            print_answer(answer.json)
        else:
            screen = console()
            show_answer(answer, screen)
    finally:
        for file in starmap(OutputFile, files):
            with guard_picture(file.path):
                if file.write is not None:
                    file.write()
                written.append(file)
    if screen is not None:
        for file in written:
            place(screen, file.label, file.path)


def given_options() -> dict[str, Any]:
    """All given options that differ from their defaults, by their names in the help."""
    words = list(EXPANDED.get())
    bound = program(*words[:1]).parse_args(words, print_error=False, exit_on_error=False)[1]
    given: dict[str, Any] = {}
    for name, value in bound.arguments.items():
        given |= changed_fields(value) if is_dataclass(value) else {name: value}
    return {name.rstrip("_"): value for name, value in given.items() if name != "json"}


def _files(options: Mapping[str, Any]) -> list[dict[str, str]]:
    from palpate.report.identification.words import file_digest

    named = [path for name, value in options.items() if name not in _WRITTEN for path in _paths(value)]
    return [
        {"file": str(path), "sha256": file_digest(path)} for path in dict.fromkeys(named) if path.is_file()
    ]


def _paths(value: Any) -> Iterator[Path]:
    """Possible input files: a path, or a name with an ending, as of an arm's or an experiment's own file."""
    for item in value if isinstance(value, tuple | list) else (value,):
        if isinstance(item, Path) or (isinstance(item, str) and Path(item).suffix and "\0" not in item):
            yield Path(item)
