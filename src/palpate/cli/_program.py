"""The program and its commands, each imported only when it is used."""

from __future__ import annotations

import re
import shlex
from contextvars import ContextVar
from importlib import import_module
from inspect import getdoc

from cyclopts import App, Group

from palpate.cli._help import PhraseFormatter

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
    "excite": "Design a force that identifies a surface, and predict the uncertainty.",
    "tune": "Tune a force loop for an arm, and prove where it is stable.",
    "export": "Write an identified surface as the contact of a simulator's scene.",
    "certify": "Prove where a tuned force loop is stable, or check such a proof.",
    "press": "Press with a desired force: any serial arm in simulation, or a real one over its wire.",
    "run": "Run an experiment: the arm approaches, touches, presses.",
    "live": "Show a pressing arm, or a log, in the browser.",
    "study": "Run an experiment many times: grids, random points, a search; resumable.",
    "checks": "Check a controller, surface or identifier of your own.",
    "thesis": "Measure every figure and every claim of the thesis again.",
    "laboratory": "Infer the thesis' laboratory from its own sentences; resumable.",
    "speed": "Measure the time of one tick of the closed loop on this machine.",
    "completion": "Print a shell's completion script for commands, options and files.",
}


def command() -> str:
    """The whole command, as it can be typed again."""
    return shlex.join(["palpate", *TYPED.get()])


def _version() -> str:
    from palpate import __version__

    return str(__version__)


def _described(own: str) -> str:
    """A command's docstring before its parameters, each paragraph on one line for the terminal to wrap."""
    text = getdoc(getattr(import_module(f"palpate.cli.{own}"), own)) or ""
    said = re.split(r"\n(?:Parameters\n-|Args:\n|Returns:\n)", text)[0]
    return "\n\n".join(" ".join(part.split()) for part in said.split("\n\n")).strip()


def program(asked: str = "") -> App:
    """The whole command line; errors are raised, not printed, and results are returned.

    Args:
        asked: the typed command, whose help is its docstring with the examples.
    """
    app = App(
        name="palpate",
        help="Identify the surface that a robot touches, and press on it with exactly the desired force.",
        version=_version,
        help_format="plaintext",
        help_formatter=PhraseFormatter(),
        group_parameters=Group("Options", sort_key=0),
        exit_on_error=False,
        print_error=False,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    for order, (name, line) in enumerate(COMMANDS.items()):
        own = name.replace("-", "_")
        text = _described(own) if name == asked else line
        app.command(f"palpate.cli.{own}:{own}", name=name, help=text, sort_key=order)
    return app
