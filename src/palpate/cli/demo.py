"""`palpate demo`: identify a log that comes with palpate, and say what to type next."""

from importlib.resources import files
from pathlib import Path

from palpate.cli._terminal import print_lines
from palpate.errors import InputError
from palpate.files import draft_path

LOG = Path("press.csv")
NEXT = {
    "palpate identify press.csv --report press.html": "a page with the cause of each interval",
    "palpate tune press.csv --arm ur5e --force 20:N --out gains.toml": "gains for that surface, with a proof",
    "palpate press --arm ur5e --force 20:N --surface K=5200,B=200 --out press": "a press, and a film of it",
}
"""Commands that go on from the log, each with its result."""


def demo() -> int:
    """Identify a log that comes with palpate, and say what to type next.

    Write press.csv, the log of a press on simulated foam, into the current folder, and identify it:

    palpate demo
    """
    from palpate.cli.identify import identify

    log = (files("palpate.logs") / LOG.name).read_bytes()
    if LOG.is_file() and LOG.read_bytes() != log:
        raise InputError(f"{LOG} is here already, and is not the demo's; run palpate demo in another folder")
    if not LOG.exists():
        draft = draft_path(LOG)
        draft.write_bytes(log)
        draft.replace(LOG)
    print_lines(f"$ palpate identify {LOG}")
    code = identify(LOG)
    print_lines("", "Next:", *(f"  {typed}\n      {result}" for typed, result in NEXT.items()))
    return code
