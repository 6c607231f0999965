"""`palpate demo`: identify a log that comes with palpate, and say what to type next."""

import shlex
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from palpate.cli._terminal import print_lines
from palpate.cli.options.common import WRITTEN
from palpate.errors import InputError
from palpate.files import draft_path

NAME = "press.csv"
NEXT = {
    "palpate identify {log} --report press.html": "a page with the cause of each interval",
    "palpate tune {log} --arm ur5e --force 20:N --out gains.toml": "gains for that surface, with a proof",
    "palpate press --arm ur5e --force 20:N --surface K=5200,B=200 --out press": "a press, and a film of it",
}
"""Commands that go on from the log, each with its result."""


def demo(*, out: Annotated[Path, Parameter(group=WRITTEN)] = Path()) -> int:
    """Identify a log that comes with palpate, and say what to type next.

    Write press.csv, the log of a press on simulated foam, into the current folder, and identify it:

    palpate demo

    Parameters
    ----------
    out
        Folder for press.csv; the current one if not given.
    """
    from palpate.cli.identify import identify

    log, content = out / NAME, (files("palpate.logs") / NAME).read_bytes()
    if not out.is_dir():
        raise InputError(f"there is no folder {out}; make it first")
    if log.is_file() and log.read_bytes() != content:
        raise InputError(f"{log} is here already, and is not the demo's; run palpate demo in another folder")
    if not log.exists():
        draft = draft_path(log)
        draft.write_bytes(content)
        draft.replace(log)
    typed = shlex.quote(str(log))
    print_lines(f"$ palpate identify {typed}")
    code = identify(log)
    following = (f"  {command.format(log=typed)}\n      {result}" for command, result in NEXT.items())
    print_lines("", "Next:", *following)
    return code
