"""Options that `run` and `study` share: a TOML file named on the command line, to run, list or print."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli._terminal import print_lines
from palpate.cli.options.flags import FLAG
from palpate.errors import InputError
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.bench.toml_parts import TomlFiles


@Parameter(name="*", group=Group("Known names", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class KnownOptions:
    """List or print, without a run.

    Parameters
    ----------
    list_
        List the known names and stop.
    print_
        Print the named file, to copy and edit, and stop.
    """

    list_: Annotated[bool, FLAG, Parameter(name="--list")] = False
    print_: Annotated[bool, FLAG, Parameter(name="--print")] = False


@Parameter(name="*", group=Group("Output", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class FolderOptions:
    """Files to write.

    Parameters
    ----------
    out
        Folder for results; when left out, one in runs/ with the name of the run.
    replace
        Replace existing results.
    json
        Print the summary as JSON and nothing else.
    """

    out: Path | None = None
    replace: Annotated[bool, FLAG] = False
    json: Annotated[bool, FLAG] = False


def listed(files: TomlFiles, title: Callable[[str], str]) -> None:
    """Print the names that come with palpate, each with its title."""
    width = 2 + max(map(len, files.names()))
    for name in files.names():
        print_lines(f"{name:<{width}}{title(name)}")


def source_of(files: TomlFiles, name: str | None, verb: str, printed: bool) -> str | None:
    """The text of the named file; None if it was only printed.

    Raises:
        InputError: no name, or an unknown one.
    """
    if name is None:
        raise InputError(
            f"no {files.kind} is named; name one (palpate {verb} --list lists them) or a TOML file"
        )
    source = files.source(name)
    if not printed:
        return source
    sys.stdout.write(printable(source))
    return None
