"""Faults at each change that a command makes on the disk: the n-th write or rename fails, for n = 1, 2, ...

A library that is loaded before the C library (`faults.c`) counts the changes in a command's folder and fails one: for
want of space, once or from then on, after half of a write, by the device, or by ending the process there. Or a signal
comes at any moment, or no file may be larger than some bytes. Afterwards each file is the old one or the new one,
nothing that was there is lost, and the same command once more gives what it gives undisturbed.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from samples import NAMES, ROOT, sources
from warm import NONE, Ended, Trouble, Warm

HOWS = ("once", "full", "short", "error", "kill")
COLUMNS = (f"--time={NAMES[0]}", f"--position={NAMES[1]}:mm", f"--force={NAMES[2]}:N")


class Command(NamedTuple):
    """What is disturbed.

    Args:
        words: of the command; it may be called again.
        earlier: of a call whose results are there before.
        prepare: makes further inputs in a folder.
        again: words of the next call where the file `broken` exists, which the command leaves to be mended; a command
            that has such words refuses a folder of results.
        broken: its name.
        kept: what it says where it keeps the new results without their pictures, however old ones were replaced.
        record: its name, and the summary's beside it, which says where there was no tick to record.
    """

    words: tuple[str, ...]
    earlier: tuple[str, ...] = ()
    prepare: Callable[[Path], None] = lambda _: None
    again: tuple[str, ...] = ()
    broken: str = ""
    kept: str = ""
    record: tuple[str, str] = ("", "")


def _cell(folder: Path) -> None:
    """A slow arm and gains for it, which a press over a wire uses."""
    from wires.slow_cell import cell

    place = folder / "cell"
    place.mkdir()
    cell(place)


def _turning(folder: Path) -> None:
    """A log of a tool that is turned."""
    import numpy as np

    from contact_frame.turning_tool import Tool, log_of, six
    from palpate.logs import write_record
    from palpate.records import Record

    units = {"time": "s", "force": "N", "torque": "N m", "position": "m", "quaternion": "1"}
    record = log_of(Tool(), six(), np.random.default_rng(0))
    named = {name: units[name.partition("_")[0]] for name in record.columns}
    write_record(Record(record.columns, named), folder / "turning.parquet")


_SEARCH = ("laboratory", "--tries=16", "--half", "--cores=1", "--out=out")


def _inference(folder: Path) -> None:
    """A search that has tried and judged all its laboratories, and has not written its result."""
    kept = ROOT / "build" / f"attack-laboratory-{sources()}"
    if not kept.is_dir():
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as place:
            subprocess.run(
                [sys.executable, "-m", "palpate", *_SEARCH], cwd=place, check=True, capture_output=True
            )
            Path(place, "out", "inferred.toml").unlink()
            Path(place, "out").rename(kept)
    shutil.copytree(kept, folder / "out")


_RUN = ("run", "e.toml", "--out=out", "--replace")
_IDENTIFY = ("identify", "whole.csv", *COLUMNS, "--report=r.html", "--figure=f.png", "--save-options=o.toml")
_MANY = ("identify", "whole.csv", "other.csv", *COLUMNS, "--report=r.html", "--table=t.csv")
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
_PAYLOAD = ("payload", "turning.parquet", "--wrench-frame=tool", "--out=p.toml", "--report=p.html")
_WIRE = ("press", "--wire=WIRE", "--gains=cell/gains.toml", "--yes", "--seconds=0.5", "--record=rec", "--force=10:N",
         "--normal=0,0,-1", "--force-limit=25:N", "--speed-limit=50:mm/s", "--travel-limit=30:mm", "--time-limit=20:s",
         "--ordinary-priority")  # fmt: skip
COMMANDS = {
    "certify": Command(("certify", "gains.toml", "--held-only", "--out=c.json", "--replace")),
    "export": Command((*_EXPORT, "--replace")),
    "identify": Command(_IDENTIFY, (*_IDENTIFY, "--start=0.01")),
    "identify, many": Command(_MANY, prepare=lambda f: _copy(f / "whole.csv", f / "other.csv")),
    "payload": Command((*_PAYLOAD, "--replace"), prepare=_turning),
    "tune": Command((*_TUNE, "--replace")),
    "excite": Command((*_EXCITE, "--figure=x.png", "--experiment=x.toml", "--replace")),
    "run": Command((*_RUN, "--seed=2"), (*_RUN, "--seed=1"), kept="the record is in out"),
    "press": Command((*_PRESS, "--replace")),
    "press --record": Command(
        _WIRE,
        prepare=_cell,
        again=("press", "--recover=rec"),
        broken="rec/rows.f64",
        record=("rec/record.parquet", "rec/press.json"),
    ),
    "study": Command(("study", "study.toml", "--out=out")),
    "thesis": Command(("thesis", "3.7", "--out=out")),
    "laboratory": Command(_SEARCH, prepare=_inference),
}
"""Every command that writes a file; palpate live writes none."""
OPTIONAL = {"thesis", "laboratory"}
"""Of palpate-thesis; where that is not installed, they are left out."""


def _copy(source: Path, target: Path) -> None:
    target.write_bytes(source.read_bytes())


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
    with place_of(kind, folder, library) as place:
        changes, told = place.changes, Counter[str]()
        every = [(n, how) for n in range(1, changes + 1) for how in HOWS]
        told["changes"] = changes
        for n, how in sorted(random.Random(seed).sample(every, min(trials, len(every)))):
            outcome = place.disturbed(Trouble(n, how))
            told["times"] += 1
            bad = outcome.startswith("defect")
            told[f"{outcome} (change {n} of {changes}, {how})" if bad else outcome] += 1
    return told


def killed(kind: str, trials: int, folder: Path, seed: int = 0) -> Counter[str]:
    """Sends a command SIGKILL or a Ctrl-C at a random moment, or lets no file exceed some bytes; outcomes, counted."""
    library = compiled(folder)
    if library is None:
        return Counter({"no C compiler": 1})
    chance, told = random.Random(f"{kind} {seed}"), Counter[str]()
    with place_of(kind, folder, library) as place:
        for number in range(trials):
            after = chance.uniform(0.0, place.duration)
            size = int(10 ** chance.uniform(1.5, 5.5))
            trouble = (
                Trouble(signal=signal.SIGKILL, after=after),
                Trouble(signal=signal.SIGINT, after=after),
                Trouble(largest=size),
            )[number % 3]
            outcome = place.disturbed(trouble)
            bad = outcome.startswith("defect")
            told[f"{outcome} {trouble}" if bad else outcome] += 1
    return told


@contextmanager
def place_of(kind: str, folder: Path, library: Path) -> Iterator[Place]:
    """A folder in which a command runs again and again."""
    place = Place(folder / "work", library, COMMANDS[kind])
    try:
        yield place
    finally:
        place.close()


class Place:
    """A folder in which one command runs again and again.

    Attributes:
        changes: that it makes on the disk undisturbed.
        duration: of it then [s].
    """

    def __init__(self, folder: Path, library: Path, command: Command):
        self._folder, self._command = folder, command
        self._inputs = folder.parent / "inputs"
        self._warm = Warm(library, folder.parent)
        self._count = folder.parent / "count"
        _write_inputs(self._inputs)
        command.prepare(self._inputs)
        self._begin()
        if command.earlier:
            ended = self._run(command.earlier)
            assert ended.code in {0, 1}, ended.said
            shutil.rmtree(self._inputs)
            shutil.copytree(folder, self._inputs)
        self._before = _tree(self._inputs)
        _, first = self._undisturbed()
        ended, self._whole = self._undisturbed()
        self._code, self.duration, self.changes = ended.code, ended.took, self._changes()
        assert set(first) == set(self._whole)
        self._varies = {name for name, digest in first.items() if digest != self._whole[name]}
        self._later: dict[frozenset[tuple[str, str]], str] = {frozenset(self._before.items()): ""}

    def close(self) -> None:
        """End the process that runs the commands."""
        self._warm.close()

    def disturbed(self, trouble: Trouble) -> str:
        """What becomes of the folder where a change fails, or a signal comes."""
        self._begin()
        ended = self._run(self._command.words, trouble)
        if (trouble.signal and not ended.sent) or self._changes() < trouble.change:
            return "was done before"
        after = _tree(self._folder)
        undrawn = bool(self._command.kept) and self._command.kept in ended.said
        if wrong := self._wrong_end(ended, trouble, after) or self._half(
            after, whole=not trouble.signal, undrawn=undrawn
        ):
            return f"defect: {wrong}"
        state = frozenset(after.items())
        if state not in self._later:  # what was so before gives what it gave
            self._later[state] = self._wrong_again()
        wrong = self._later[state]
        if wrong:
            return f"defect: {wrong}"
        return "the record kept without pictures" if undrawn else "whole, and the same again"

    def _undisturbed(self) -> tuple[Ended, dict[str, str]]:
        self._begin()
        ended = self._run(self._command.words)
        assert ended.code in {0, 1}, ended.said
        return ended, _tree(self._folder)

    def _wrong_end(self, ended: Ended, trouble: Trouble, after: dict[str, str]) -> str:
        """Whatever is wrong with the exit code, standard error and leftovers of a disturbed command."""
        if trouble.how == "kill" or trouble.signal == signal.SIGKILL:
            return ""
        errors = [line for line in ended.said.splitlines() if line.startswith("palpate: ")]
        allowed = {130, -signal.SIGINT, self._code} if trouble.signal else {2, self._code}
        if ended.code not in allowed or "Traceback" in ended.said or len(errors) > 1:
            return f"code {ended.code}: {ended.said[-300:]!r}"
        if ended.code == 2 and len(errors) != 1:
            return f"{len(errors)} lines: {ended.said[-300:]!r}"
        if ended.code == self._code and not trouble.signal and (other := self._unlike(after)):
            return f"code {ended.code}, and yet other {other}"
        strays = [name for name in after if _hidden(name)] if trouble.how != "error" else []
        return f"left behind {strays}" if strays else ""

    def _wrong_again(self) -> str:
        """Whatever is wrong when the command is called again."""
        command, words = self._command, self._command.words
        broken = self._folder / command.broken
        if command.again and broken.exists():
            words = command.again
        if not command.again or broken.exists() or not broken.parent.exists():
            ended = self._run(words)
            done = ended.code == 2 and not self._unlike(
                _tree(self._folder)
            )  # whole results, which are not replaced
            if ended.code not in {0, 1} and not done:
                return f"the next call ends with {ended.code}: {ended.said[-300:]!r}"
        other = self._unlike(_tree(self._folder))
        record, summary = command.record
        if other == [record] and json.loads((self._folder / summary).read_bytes())["lateness"]["ticks"] == 0:
            return ""
        return f"the next call gives other {other}" if other else ""

    def _unlike(self, after: dict[str, str]) -> list[str]:
        """Files that are not as the undisturbed command leaves them."""
        lacking = set(after) ^ set(self._whole)
        return sorted(
            lacking
            | {name for name in set(after) - lacking - self._varies if after[name] != self._whole[name]}
        )

    def _half(self, after: dict[str, str], *, whole: bool, undrawn: bool) -> str:
        """A file that is neither old nor new, or that is gone; a command that was interrupted may keep a part."""
        from palpate.files import ours

        seen = {name: digest for name, digest in after.items() if not _hidden(name)}
        for name, digest in seen.items():
            path = self._folder / name
            if digest in {self._before.get(name), self._whole.get(name)} or name == self._command.broken:
                continue
            if (whole and name not in self._varies and not _grows(name)) or not (
                ours(path) and _parses(path)
            ):
                return f"half-written {name}"
        hidden = {Path(name).name for name in after if _hidden(name)}
        if undrawn:
            return (
                "" if after["out/record.parquet"] == self._whole["out/record.parquet"] else "another record"
            )
        lost = [name for name in self._before if name not in seen and Path(name).name not in hidden]
        return f"lost {lost}" if lost else ""

    def _begin(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
        shutil.copytree(self._inputs, self._folder)

    def _changes(self) -> int:
        return self._count.stat().st_size if self._count.exists() else 0

    def _run(self, words: tuple[str, ...], trouble: Trouble = NONE) -> Ended:
        """Runs a command in the folder, and an arm beside it if it names its wire."""
        self._count.unlink(missing_ok=True)
        environment = {
            "ATTACK_FOLDER": f"{self._folder.resolve()}{os.sep}",
            "ATTACK_FAIL": str(trouble.change),
            "ATTACK_HOW": trouble.how,
            "ATTACK_COUNT": str(self._count),
        }
        with ExitStack() as stack:
            if "--wire=WIRE" in words:
                from wires.slow_cell import arm

                _, address = stack.enter_context(arm(self._inputs / "cell", "--stiffness", "4000"))
                words = tuple(word.replace("WIRE", address) for word in words)
            return self._warm.run(words, self._folder, environment, trouble)


def _write_inputs(folder: Path) -> None:
    from grammar import prepare

    prepare(folder)
    (folder / "link").unlink()
    from killing import experiment

    experiment(folder)


def _tree(folder: Path) -> dict[str, str]:
    """Hash of each file, by its name from the folder on; of a database that of its rows, a journal rolled back."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(_content(path)).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.is_symlink() and not path.name.endswith(".sqlite-journal")
    }


def _content(path: Path) -> bytes:
    """Bytes of a file; of a database its rows, which are the same whatever the order they came in."""
    if path.suffix != ".sqlite":
        return path.read_bytes()
    with tempfile.TemporaryDirectory() as place:
        for name in (path.name, f"{path.name}-journal"):
            if (path.parent / name).exists():
                shutil.copy(path.parent / name, place)
        try:
            with closing(sqlite3.connect(Path(place, path.name))) as table:
                return "\n".join(sorted(table.iterdump())).encode()
        except sqlite3.Error:
            return path.read_bytes()


def _hidden(name: str) -> bool:
    return any(part.startswith(".") for part in Path(name).parts)


def _grows(name: str) -> bool:
    """Journals, which are whole at each line or transaction."""
    return name.endswith((".jsonl", ".journal", ".sqlite"))


def _parses(path: Path) -> bool:
    """Whether a file is whole by its format."""
    try:
        match path.suffix:
            case ".json":
                json.loads(path.read_bytes())
            case ".toml":
                tomllib.loads(path.read_text(encoding="utf-8"))
            case ".svg" | ".xml":
                ElementTree.parse(path)  # noqa: S314 - of palpate itself
            case ".html":
                return path.read_text(encoding="utf-8").rstrip().endswith("</html>")
            case ".png":
                return path.read_bytes().endswith(b"IEND\xaeB`\x82")
            case ".parquet":
                import polars

                polars.read_parquet(path)
            case ".sqlite":
                with closing(sqlite3.connect(path)) as table:
                    return table.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    except (ValueError, OSError, ElementTree.ParseError, sqlite3.Error):
        return False
    return True
