"""Kills, Ctrl-C and full disks at any moment of a command: what is on the disk afterwards is whole.

A run and a study are processes of their own, imports included; the other commands begin with everything imported
(`warm`), so that a moment lies within their work.
"""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from faults import COMMANDS, killed
from reading import processor_time
from samples import SAMPLES

PROGRAM = (sys.executable, "-m", "palpate")
JUST_DONE = 0.5
"""A command that ends well with so little of the processor's time after a Ctrl-C had only to end [s]."""


def run_killed(count: int, folder: Path, seed: int = 0) -> Counter[str]:
    """`palpate run --replace` over results, killed: the old ones or the new ones are there at the next start."""
    experiment(folder)
    _warm()
    begun = time.monotonic()
    _ran("run", "e.toml", "--seed", "1", "--out", "out", cwd=folder)
    told: Counter[str] = Counter()
    for chance in _moments(count, seed, time.monotonic() - begun):
        _interrupted(
            signal.SIGKILL, chance, "run", "e.toml", "--seed", "2", "--out", "out", "--replace", cwd=folder
        )
        again = _ran(
            "run", "e.toml", "--seed", "3", "--out", "out", cwd=folder
        )  # refused, and puts things right
        told["refused as it should" if again.returncode == 2 else f"defect: code {again.returncode}"] += 1
        told[_results(folder / "out")] += 1
        told[_strays(folder, "out")] += 1
    return told


def run_interrupted(count: int, folder: Path, seed: int = 0) -> Counter[str]:
    """`palpate run`, Ctrl-C: code 130 and what was simulated, or nothing because nothing was yet."""
    experiment(folder)
    _warm()
    begun = time.monotonic()
    _ran("run", "e.toml", "--out", "whole", cwd=folder)
    told: Counter[str] = Counter()
    for number, chance in enumerate(_moments(count, seed, time.monotonic() - begun)):
        out = folder / f"out{number}"
        child = _interrupted(signal.SIGINT, chance, "run", "e.toml", "--out", out.name, cwd=folder)
        told[_heard(child)] += 1
        told[_results(out) if out.exists() else "nothing simulated yet"] += 1
        told[_strays(folder, out.name)] += 1
    return told


def study_killed(count: int, folder: Path, seed: int = 0) -> Counter[str]:
    """`palpate study`, killed and gone on with until it is done: the table is the same to the byte."""
    ending, make = SAMPLES["study"]
    make(folder / f"study{ending}")
    text = (folder / "study.toml").read_text().replace("points = 3", "points = 60")
    (folder / "study.toml").write_text(text)
    _warm()
    begun = time.monotonic()
    _ran("study", "study.toml", "--out", "whole", cwd=folder)
    took = time.monotonic() - begun
    whole, told = (folder / "whole/results.parquet").read_bytes(), Counter[str]()
    for number, chance in enumerate(_moments(count, seed, took)):
        out = f"out{number // 4}"
        signal_ = signal.SIGINT if number % 2 else signal.SIGKILL
        child = _interrupted(signal_, chance, "study", "study.toml", "--out", out, cwd=folder)
        told["killed" if signal_ == signal.SIGKILL else _heard(child)] += 1
        if number % 4 == 3 or number == count - 1:
            done = _ran("study", "study.toml", "--out", out, cwd=folder)
            same = done.returncode == 0 and (folder / out / "results.parquet").read_bytes() == whole
            told["resumed to the same table" if same else f"defect: {done.stderr[-200:]}"] += 1
            told[_strays(folder / out, "")] += 1
    return told


def disks_full(count: int, folder: Path, seed: int = 0) -> Counter[str]:
    """`palpate run` and `palpate study` where no file may be larger than some bytes: one line, code 2, nothing half."""
    experiment(folder)
    SAMPLES["study"][1](folder / "study.toml")
    told: Counter[str] = Counter()
    chance = random.Random(seed)
    for number in range(count):
        command = ("run", "e.toml") if number % 2 else ("study", "study.toml")
        out = folder / f"full{number}"
        size = int(10 ** chance.uniform(1.5, 6.5))
        done = _ran(*command, "--out", out.name, cwd=folder, largest=size)
        lines = [line for line in done.stderr.splitlines() if line.startswith("palpate: ")]
        if done.returncode == 2 and "Traceback" not in done.stderr and len(lines) == 1:
            told["one line and code 2"] += 1
        elif done.returncode == 0:
            told["there was room"] += 1
        else:
            told[f"defect: code {done.returncode} at {size} bytes: {done.stderr[-200:]}"] += 1
        if out.exists():
            told[_whole_files(out)] += 1
    return told


def experiment(folder: Path) -> None:
    """Writes the experiment that is killed."""
    from palpate.bench import source

    text = source("foam-hybrid").replace("press = 10.0", "press = 20.0")
    (folder / "e.toml").write_text(text, encoding="utf-8")


@cache
def _warm() -> None:
    """Has the loop compiled, so that a moment within a run is not one within that."""
    with TemporaryDirectory() as folder:
        experiment(Path(folder))
        _ran("run", "e.toml", cwd=Path(folder))


def _moments(count: int, seed: int, longest: float) -> list[float]:
    chance = random.Random(seed)
    return [chance.uniform(0.0, longest) for _ in range(count)]


def _ran(*words: str, cwd: Path, largest: int | None = None) -> subprocess.CompletedProcess[str]:
    def limit() -> None:
        if largest is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    return subprocess.run(
        [*PROGRAM, *words],
        cwd=cwd,
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},  # half of it would be read by every later process
        preexec_fn=limit,
    )


class Ended(NamedTuple):
    """How a command ended, and how much of the processor's time after the signal [s]; None if that came too late."""

    code: int
    after: float | None


def _interrupted(number: int, after: float, *words: str, cwd: Path) -> Ended:
    child = subprocess.Popen(
        [*PROGRAM, *words],
        cwd=cwd,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    time.sleep(after)
    used = processor_time(child.pid)
    sent = child.poll() is None
    if not sent:
        return Ended(child.returncode, None)
    child.send_signal(number)
    _, status, took = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return Ended(child.returncode, took.ru_utime + took.ru_stime - used)


def _heard(ended: Ended) -> str:
    """Whether a Ctrl-C ended a command."""
    match ended:
        case Ended(0, None):
            return "was done before"
        case Ended(0, float(after)):
            return "was just done" if after < JUST_DONE else f"defect: Ctrl-C was lost, {after:.1f} s went by"
        case Ended(130, _):
            return "ended with 130"
        case Ended(code, _) if code == -signal.SIGINT:
            return "ended before Python had begun"
    return f"defect: code {ended.code}"


def _results(folder: Path) -> str:
    from palpate.logs import read_record

    try:
        rows = len(read_record(folder / "record.parquet"))
        told = json.loads((folder / "summary.json").read_text())
        page = (folder / "report.html").read_text().rstrip().endswith("</html>") if rows else True
    except (OSError, ValueError) as error:
        return f"defect: {type(error).__name__} {error}"
    return "whole results" if page and told["written_by"].startswith("palpate") else "defect: half results"


def _strays(folder: Path, name: str) -> str:
    found = sorted(path.name for path in folder.iterdir() if path.name.startswith(f".{name}"))
    return f"defect: left behind {found}" if found else "nothing left behind"


def _whole_files(folder: Path) -> str:
    from palpate.files import ours

    spoiled = [path.name for path in folder.rglob("*") if path.is_file() and not ours(path)]
    return f"defect: half-written {spoiled}" if spoiled else "whole files only"


LONG, SHORT = 1, 5
"""Shares of commands that take some seconds or compile, and of those that take less."""
_QUICK = {"certify", "export", "payload", "tune", "excite"}
KINDS: dict[str, tuple[int, Callable[[int, Path, int], Counter[str]]]] = {
    "run killed": (LONG, run_killed),
    "run, Ctrl-C": (LONG, run_interrupted),
    "study killed": (LONG, study_killed),
    "disk full": (LONG, disks_full),
    **{
        kind: (SHORT if kind in _QUICK else LONG, partial(killed, kind))
        for kind in COMMANDS
        if kind not in {"run", "study"}
    },
}
"""By kind: its share of the kills, and who does it: (count, folder, seed) -> outcomes, counted."""

os.environ.setdefault("MPLBACKEND", "Agg")
