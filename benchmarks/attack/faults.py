"""Faults at each change that a command makes on the disk: the n-th write or rename fails, for n = 1, 2, ...

A library that is loaded before the C library (`faults.c`) counts the changes in a command's folder and fails one: for
want of space, once or from then on, after half of a write, by the device, or by ending the process there. Afterwards
each file is the old one or the new one, nothing that was there is lost, and the same command once more gives what it
gives undisturbed.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from samples import NAMES

HOWS = ("once", "full", "short", "error", "kill")
PATIENCE = 300.0
"""How long a command may take [s]."""
COLUMNS = (f"--time={NAMES[0]}", f"--position={NAMES[1]}:mm", f"--force={NAMES[2]}:N")


class Command(NamedTuple):
    """What is disturbed: its words, and those of an earlier call whose results are there; it may be called again."""

    words: tuple[str, ...]
    earlier: tuple[str, ...] = ()


_RUN = ("run", "e.toml", "--out=out", "--replace")
_IDENTIFY = ("identify", "whole.csv", *COLUMNS, "--report=r.html", "--figure=f.png", "--save-options=o.toml")
_EXCITE = (
    "excite",
    "--stiffness=5000",
    "--damping=100",
    "--force=15",
    "--peak=20",
    "--duration=2",
    "--out=e.csv",
)
_TUNE = ("tune", "--arm=ur5e", "--force=10", "--stiffness=500:20000", "--out=g.toml", "--report=t.html")
_EXPORT = ("export", "found.json", "--to=mjcf-spring", "--damping=50", "--mass=0.01", "--out=s.xml")
_PRESS = ("press", "--arm=ur5e", "--force=20:N", "--surface=K=5000,B=50", "--seconds=0.2", "--out=out")
COMMANDS = {
    "certify": Command(("certify", "gains.toml", "--held-only", "--out=c.json", "--replace")),
    "export": Command((*_EXPORT, "--replace")),
    "identify": Command(_IDENTIFY, (*_IDENTIFY, "--start=0.01")),
    "run": Command((*_RUN, "--seed=2"), (*_RUN, "--seed=1")),
    "study": Command(("study", "study.toml", "--out=out", "--yes")),
    "tune": Command((*_TUNE, "--replace")),
    "excite": Command((*_EXCITE, "--report=x.html", "--figure=x.png", "--experiment=x.toml", "--replace")),
    "press": Command((*_PRESS, "--replace")),
    "thesis": Command(("thesis", "6.1", "--seeds=1", "--out=out", "--replace")),
    "laboratory": Command(("laboratory", "--particles=2", "--moves=1", "--half", "--out=out")),
}
OPTIONAL = {"thesis", "laboratory"}
"""Of palpate-thesis; where that is not installed, they are left out."""


def compiled(folder: Path) -> Path | None:
    """The library that makes the faults; None where there is no C compiler, or no such loader."""
    compiler = shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        return None
    library = folder / "faults.so"
    source = Path(__file__).with_name("faults.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True)
    return library


def faulted(kind: str, trials: int, folder: Path, seed: int = 0) -> Counter[str]:
    """Disturbs a command at up to so many of its changes, drawn from all; what came of it, counted."""
    library = compiled(folder)
    if library is None:
        return Counter({"no C compiler": 1})
    place = Place(folder / "work", library, COMMANDS[kind])
    whole, changes = place.reference()
    every = [(n, how) for n in range(1, changes + 1) for how in HOWS]
    told: Counter[str] = Counter(changes=changes)
    for n, how in sorted(random.Random(seed).sample(every, min(trials, len(every)))):
        outcome = place.disturbed(n, how, whole)
        told["times"] += 1
        told[
            outcome if not outcome.startswith("defect") else f"{outcome} (change {n} of {changes}, {how})"
        ] += 1
    return told


class Place:
    """A folder in which one command runs again and again."""

    def __init__(self, folder: Path, library: Path, command: Command):
        self._folder, self._library, self._command = folder, library, command
        self._inputs = folder.parent / "inputs"
        _write_inputs(self._inputs)
        self._begin()
        if command.earlier:
            code, _, said = self._run(command.earlier)
            assert code in {0, 1}, said
            shutil.rmtree(self._inputs)
            shutil.copytree(folder, self._inputs)
        self._before = _tree(self._inputs)
        self._varies: set[str] = set()

    def reference(self) -> tuple[dict[str, str], int]:
        """What the command gives undisturbed, and how many changes it makes; files that vary are found by two calls."""
        found = []
        for _ in range(2):
            self._begin()
            code, changes, said = self._run(self._command.words)
            assert code in {0, 1}, said
            found.append(_tree(self._folder))
        first, second = found
        assert set(first) == set(second)
        self._varies = {name for name in first if first[name] != second[name]}
        return first, changes

    def disturbed(self, n: int, how: str, whole: dict[str, str]) -> str:
        """What becomes of the folder where the n-th change fails."""
        self._begin()
        code, changes, said = self._run(self._command.words, n, how)
        errors = [line for line in said.splitlines() if line.startswith("palpate: ")]
        if changes < n:
            return "was done before"
        if how != "kill" and (code not in {0, 1, 2} or "Traceback" in said or len(errors) > 1):
            return f"defect: code {code}: {said[-300:]!r}"
        if how != "kill" and code == 2 and len(errors) != 1:
            return f"defect: {len(errors)} lines: {said[-300:]!r}"
        half = self._half(_tree(self._folder), whole)
        if half:
            return f"defect: {half}"
        code, _, said = self._run(self._command.words)
        if code not in {0, 1}:
            return f"defect: the next call ends with {code}: {said[-300:]!r}"
        after = _tree(self._folder)
        wrong = (set(after) ^ set(whole)) | {
            name
            for name in set(after) & set(whole)
            if after[name] != whole[name] and name not in self._varies
        }
        return f"defect: the next call gives other {sorted(wrong)}" if wrong else "whole, and the same again"

    def _half(self, after: dict[str, str], whole: dict[str, str]) -> str:
        """What is neither old nor new, or gone."""
        from palpate.files import ours

        seen = {name: digest for name, digest in after.items() if not _hidden(name)}
        for name, digest in seen.items():
            if digest in {self._before.get(name), whole.get(name)}:
                continue
            if not (name in self._varies or _grows(name)) or not ours(self._folder / name):
                return f"half-written {name}"
        hidden = {Path(name).name for name in after if _hidden(name)}
        lost = [name for name in self._before if name not in seen and Path(name).name not in hidden]
        return f"lost {lost}" if lost else ""

    def _begin(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
        shutil.copytree(self._inputs, self._folder)

    def _run(self, words: tuple[str, ...], n: int = 0, how: str = "") -> tuple[int, int, str]:
        """Exit code, changes made, and standard error."""
        with tempfile.TemporaryDirectory() as outside:
            count = Path(outside) / "count"
            environment = {
                **os.environ,
                "LD_PRELOAD": str(self._library),
                "ATTACK_FOLDER": f"{self._folder.resolve()}{os.sep}",
                "ATTACK_FAIL": str(n),
                "ATTACK_HOW": how,
                "ATTACK_COUNT": str(count),
                "PYTHONDONTWRITEBYTECODE": "1",
                "MPLBACKEND": "Agg",
            }
            command = [sys.executable, "-m", "palpate", *words]
            ran = subprocess.run(
                command,
                cwd=self._folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=PATIENCE,
                check=False,
            )
            return ran.returncode, len(count.read_bytes()) if count.exists() else 0, ran.stderr


def _write_inputs(folder: Path) -> None:
    from grammar import prepare

    prepare(folder)
    (folder / "link").unlink()
    from killing import experiment

    experiment(folder)


def _tree(folder: Path) -> dict[str, str]:
    """Hash of each file, by its name from the folder on."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.is_symlink()
    }


def _hidden(name: str) -> bool:
    return any(part.startswith(".") for part in Path(name).parts)


def _grows(name: str) -> bool:
    """Journals, which are whole at each line."""
    return name.endswith((".jsonl", ".journal"))
