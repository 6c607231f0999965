"""What surrounds a command: variables, streams and limits of its process, the user's own code, and tables of places."""

from __future__ import annotations

import json
import os
import random
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from palpate.errors import InputError

Words = list[list[str]]
PRESS = ("identify", "whole.csv", "--time=time_s", "--position=position_mm:mm", "--force=force_N:N")
COMMANDS = (
    PRESS,
    (*PRESS, "--json"),
    (*PRESS, "--figure=made.png", "--report=made.html"),
    ("topics", "whole.csv"),
    ("certify", "--check", "certificate.json"),
    ("run", "foam-neural", "--print"),
    ("--help",),
    ("identify", "--help"),
    ("excite", "--stiffness=5000", "--damping=100", "--force=15", "--peak=20", "--duration=2"),
)
VARIABLES = {
    "COLUMNS": ("0", "1", "40", "-1", "x", "9" * 30),
    "LINES": ("0", "x"),
    "TERM": ("", "dumb", "xterm-256color", "nonsense"),
    "MPLBACKEND": ("nonsense", "qtagg", "module://nowhere", ""),
    "HOME": ("/proc/nobody", "", "~"),
    "LANG": ("C", "xx_YY.nonsense", "de_DE.UTF-8"),
    "LC_ALL": ("C", "tr_TR"),
    "PYTHONIOENCODING": ("ascii", "latin-1", "utf-16"),
    "TZ": ("nonsense", ""),
    "TMPDIR": ("/proc/nobody",),
    "XDG_CACHE_HOME": ("/proc/nobody", ""),
    "MPLCONFIGDIR": ("/proc/nobody",),
    "NUMBA_CACHE_DIR": ("/proc/nobody",),
    "NO_COLOR": ("1",),
    "FORCE_COLOR": ("1",),
    "POLARS_MAX_THREADS": ("0", "x", "-3"),
    "OMP_NUM_THREADS": ("0", "x"),
}
STREAMS = (
    *[""] * 12,
    ">&-",
    "2>&-",
    "<&-",
    ">&- 2>&- <&-",
    ">/dev/full",
    "2>/dev/full",
    ">/dev/full 2>/dev/full",
)
DESCRIPTORS = (*[None] * 12, 5, 6, 8, 12, 16, 32, 63, 64)
"""Files that the process may have open; with fewer than 5, Python itself does not start."""


def environment(chance: random.Random, folder: Path) -> Words:
    """A command under variables, streams and a limit that hardly anybody has."""
    names = chance.sample(sorted(VARIABLES), chance.choice((0, 1, 1, 2, 4)))
    case = {
        "words": chance.choice(COMMANDS),
        "variables": {name: chance.choice(VARIABLES[name]) for name in names},
        "streams": chance.choice(STREAMS),
        "descriptors": chance.choice(DESCRIPTORS),
    }
    (folder / "case.json").write_text(json.dumps(case), encoding="utf-8")
    return [["@environment", "case.json"]]


def run_in_environment(path: str) -> None:
    """Run the command of a case, which prints its answer, or a line that says why it does not.

    Raises:
        InputError: it refused.
        AssertionError: another code, an answer that is lost, or a refusal that is not one line.
    """
    case = json.loads(Path(path).read_text(encoding="utf-8"))
    streams, command = case["streams"], shlex.join([sys.executable, "-m", "palpate", *case["words"]])
    limit = f"ulimit -n {case['descriptors']}; " if case["descriptors"] else ""
    ran = subprocess.run(
        ["/bin/sh", "-c", f"exec {streams}; {limit}exec {command}"],
        check=False,
        capture_output=True,
        env={"PATH": os.environ["PATH"], **case["variables"]},
    )
    ascii_text = ran.stderr.replace(b"\xff\xfe", b"").replace(b"\0", b"")  # of UTF-16, too
    lines, heard = ascii_text.splitlines(), "2>" not in streams
    silent = ran.returncode == 0 and not ran.stdout
    told = ran.returncode != 2 or not heard or (len(lines) == 1 and lines[0].startswith(b"palpate: "))
    assert ran.returncode in {0, 1, 2}, f"code {ran.returncode}: {case} {lines[-2:]}"
    assert not silent, f"no answer: {case}"
    assert told, f"no line: {case} {lines[-2:]}"
    if ran.returncode == 2:
        raise InputError(f"refused: {case}")


RAISED = (
    'ValueError("\\x1b[2J\\x07")', 'Boom("\\x1b]0;x\\x07")', "SystemExit(0)", "SystemExit(70)", "GeneratorExit()",
    "Mute()", "MemoryError()", "RecursionError()", "StopIteration(1)", 'OSError(28, "no room")', 'ImportError("a\\nb")',
    "BrokenPipeError()",
)  # fmt: skip
RETURNED = (
    "None",
    "float('nan')",
    "1e308",
    "-1e308",
    "'x'",
    "[]",
    "{}",
    "object()",
    "1j",
    "10**400",
    "self",
    "type",
    "lambda: 0",
)
MODULE = """
class Boom(BaseException): ...
class Mute(BaseException):
    def __str__(self): raise Boom("mute")
def fail(): raise {raised}
def give(self=None): return {returned}
{at_import}
class Identifier:
    def __init__(self, {argument}): {at_start}
    def update(self, regressor, force): {at_update}
    def estimate(self): {at_estimate}
def metric(look): {at_metric}
"""
PLACED = ("at_start", "at_update", "at_estimate", "at_metric")
EXPERIMENT = """title = "T"
surface = {{ kind = "kelvin-voigt", stiffness = 5e3, damping = 50.0 }}
identifier = {{ kind = "{}:Identifier" }}
run = {{ press = 0.05 }}
"""


def plug_in(chance: random.Random, folder: Path) -> Words:
    """The user's own identifier, which fails or gives nonsense at one of its places, and what runs it."""
    name = f"own_{chance.getrandbits(64):x}"  # a module is imported once
    acts = {
        place: chance.choice(
            ("pass", "return give(self)" if place != "at_metric" else "return give()", "fail()")
        )
        for place in PLACED
    }
    acts["at_start"] = acts["at_start"].replace("return ", "")
    text = MODULE.format(
        raised=chance.choice(RAISED), returned=chance.choice(RETURNED),
        at_import="fail()" if chance.random() < 0.1 else "", argument=chance.choice(("a=1.0", "a=1.0", "*, b")), **acts,
    )  # fmt: skip
    (folder / f"{name}.py").write_text(text, encoding="utf-8")
    (folder / "own.toml").write_text(EXPERIMENT.format(name), encoding="utf-8")
    ways = (
        ["checks", f"{name}:Identifier"],
        ["checks", f"{name}:metric"],
        ["run", "own.toml", "--plugins", "--print"],
    )
    return [chance.choice(ways)]


CELLS = ("", "nan", "inf", "-1", "0", "1e308", "1e-308", "x", "1,2", "\x1b[2J", "9" * 400, "<img src=x>")


def places(chance: random.Random, folder: Path) -> Words:
    """A table of presses at places, some of its cells nonsense, and what is asked of its map."""
    count, broken = chance.choice((0, 2, 3, 9, 30, 30)), chance.choice((0.0, 0.0, 0.02, 0.3))
    names = [
        chance.choice(("x_mm", "x", "")),
        "y_mm",
        "K_N/mm",
        *chance.choice((*[["half_N/mm"]] * 9, [], ["z_mm"], ["x_mm"])),
    ]
    spread = chance.choice((50.0, 50.0, 0.0, 1e-9, 1e9))
    sizes = [spread, spread, 5.0, *([0.2 if "half_N/mm" in names else spread] * (len(names) - 3))]
    rows = [names, *([f"{size * chance.random():.9g}" for size in sizes] for _ in range(count))]
    rows[1:] = [
        [chance.choice(CELLS) if chance.random() < broken else cell for cell in row] for row in rows[1:]
    ]
    (folder / "places.csv").write_text("\n".join(map(",".join, rows)), encoding="utf-8")
    asked = (
        [], ["--json"], ["--stiffer-than=2:kN/m"], ["--stiffer-than=nan:N/m"], ["--next=3"], ["--next=0"],
        ["--until=10"], ["--until=1e-9"], ["--report=map.html", "--replace"], ["--next=-1"],
        ["--stiffer-than=1e308:N/m", "--next=2"],
    )  # fmt: skip
    return [["map", "--table", "places.csv", *chance.choice(asked)]]


GRAMMARS: dict[str, tuple[int, Callable[[random.Random, Path], Words]]] = {
    "environments": (4, environment),
    "plug-ins": (6, plug_in),
    "tables of places": (6, places),
}
"""By kind: its share of the inputs, and what makes one."""
