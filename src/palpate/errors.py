"""Errors that palpate raises for wrong input."""

import shlex
from collections.abc import Iterable
from difflib import get_close_matches

from palpate.text import shorten

LONGEST = 400
"""Letters of an error: it may quote a stranger's file, of which nobody reads more."""


class PalpateError(Exception):
    """Base of every error that palpate raises on purpose.

    Args:
        text: the fault, the place, and the remedy; its middle is left out beyond `longest` letters.
    """

    longest = LONGEST

    def __init__(self, text: object = ""):
        super().__init__(shorten(str(text), self.longest))


class InputError(PalpateError, ValueError):
    """A file, a flag or a number from outside is wrong.

    The text is one line: the fault, the place, and the remedy.
    The command line prints it and exits with code 2.
    """


class PluginError(InputError):
    """Code of the user's that a file names cannot be used: whatever the file's numbers are, nothing can be run."""


class PartError(PalpateError, TypeError):
    """A part of the user's cannot run in a loop; the text says in one line where it fails, or what it may not do.

    Args:
        text: that line.
        compiler: the compiler's own account, which is long; "" where it has none.
    """

    def __init__(self, text: str, compiler: str = ""):
        super().__init__(text)
        self.compiler = compiler


def how_to_install(distribution: str) -> str:
    """The command that installs a distribution from palpate's sources: nothing is published yet.

    Args:
        distribution: its name, with an extra if one is needed, as `palpate-thesis` or `palpate[arms]`.
    """
    name, bracket, extra = distribution.partition("[")
    folder = "." if name == "palpate" else f"./packages/{name}"
    return f"{shlex.join(['pip', 'install', folder + bracket + extra])} in palpate's sources"


_LISTED = 240
"""Letters of the names that an error lists at most."""


def unknown(kind: str, name: str, known: Iterable[str]) -> InputError:
    """The error for a name that is not in a list: it names the nearest, or else all there are."""
    names = sorted(known)
    near = get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    listed = ", ".join(names)
    if len(listed) > _LISTED:
        listed = f"{listed[:_LISTED].rpartition(',')[0]}, ... ({len(names)} in all)"
    return InputError(f"unknown {kind} {name!r}; {hint}there are: {listed}")
