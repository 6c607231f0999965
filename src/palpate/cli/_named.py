"""What `run` and `study` share: a TOML file named on the command line, which may only be listed or printed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from palpate.cli._terminal import print_lines
from palpate.errors import InputError
from palpate.text import shown

if TYPE_CHECKING:
    from palpate.bench.experiments.toml_files import TomlFiles


def listed(files: TomlFiles, title: Callable[[str], str]) -> None:
    """Prints the names of all that come with palpate, each with its title."""
    width = 2 + max(map(len, files.names()))
    for name in files.names():
        print_lines(f"{name:<{width}}{title(name)}")


def source_of(files: TomlFiles, name: str | None, verb: str, printed: bool) -> str | None:
    """The text of the file named; None if it was only to be printed, and has been.

    Raises:
        InputError: no name, or none that there is.
    """
    if name is None:
        raise InputError(
            f"{verb} what? Name {files.article} {files.kind} (palpate {verb} --list shows them) or a TOML file"
        )
    source = files.source(name)
    if not printed:
        return source
    sys.stdout.write(shown(source))
    return None
