"""Reads spoiled files in a child process with limits of time and memory, and tells what became of each.

Time is that of the processor, which other programs on the machine do not change.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from grammar import GRAMMARS, prepare
from mutate import mutated
from samples import COVERED, HEAD, NAMES, SAMPLES, SHARES
from surroundings import run_in_environment

from palpate.cli import _streams
from palpate.errors import LONGEST

SECONDS, BYTES, HELD = 30.0, 6 << 30, 2 << 30
"""What one input may take of the processor's time, and a child of addresses and of memory."""
BY_COVERAGE = " by coverage"
"""Ending of a kind whose inputs descend from those that reached new lines."""
PATIENCE = 15.0
"""Times as long an input may take by the clock: a machine may be busy, but who sleeps hangs as well."""
IMPORTS = 60.0
"""What a child may take before its first input [s]."""
GOOD = ("read", "refused")
PACKAGE = f"{os.sep}src{os.sep}palpate{os.sep}"


@dataclass
class Told:
    """What became of the inputs of one kind."""

    counts: Counter[str] = field(default_factory=Counter)
    worst: float = 0.0
    defects: list[str] = field(default_factory=list)

    @property
    def inputs(self) -> int:
        """How many there were."""
        return self.counts.total()

    @property
    def bad(self) -> int:
        """How many were neither read nor refused in one line."""
        return self.inputs - sum(self.counts[word] for word in GOOD)


def kinds() -> dict[str, int]:
    """All kinds of inputs, each with its share."""
    by_coverage = {f"{kind}{BY_COVERAGE}": share for kind, share in COVERED.items()}
    return SHARES | {kind: share for kind, (share, _) in GRAMMARS.items()} | by_coverage


def attack(kind: str, seeds: range, folder: Path, seconds: float = SECONDS) -> Told:
    """Reads one kind's spoiled files; a child that dies or hangs is a defect, and the next goes on behind it."""
    told, left = Told(), seeds
    while left:
        for seed, outcome, took in _child(kind, left, folder, seconds):
            told.counts[outcome.partition(":")[0]] += 1
            told.worst = max(told.worst, took)
            if outcome not in GOOD:
                told.defects.append(f"{kind} {seed}: {outcome}")
            left = range(seed + 1, seeds.stop)
    return told


def _child(kind: str, seeds: range, folder: Path, seconds: float) -> Iterator[tuple[int, str, float]]:
    words = [sys.executable, __file__, kind, str(seeds.start), str(seeds.stop), str(folder)]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    at, allowed = seeds.start, IMPORTS + seconds
    try:
        while at < seeds.stop:
            begun = time.monotonic()
            ready = _answers(child, allowed)
            line = child.stdout.readline() if ready else b""
            if not line:
                if not ready:
                    child.kill()
                code = child.wait()
                said = (child.communicate()[1].decode(errors="replace").splitlines() or [""])[-1]
                ended = f"killed by signal {-code}" if code < 0 else f"ended with {code}: {said}"
                why = ended if ready else f"more than {seconds:g} s"
                yield at, f"{'died' if ready else 'hung'}: {why}", time.monotonic() - begun
                return
            outcome, took = json.loads(line)
            yield at, outcome, took
            at, allowed = at + 1, seconds
    finally:
        child.kill()
        child.communicate()


def _answers(child: subprocess.Popen[bytes], seconds: float) -> bool:
    """Whether a child says something, or ends, within so much time of its own."""
    begun, used = time.monotonic(), processor_time(child.pid)
    while not select.select([child.stdout], [], [], 0.5)[0]:
        if processor_time(child.pid) - used > seconds or time.monotonic() - begun > PATIENCE * seconds:
            return False
    return True


def processor_time(pid: int) -> float:
    """The processor's time that a process and those it began took so far [s]."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:  # it has ended
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def _read(kind: str, path: Path) -> str:
    """What a command makes of the file: read, refused in one line, or anything else."""
    from palpate.errors import InputError

    try:
        if f"@{kind}" in LOADED:
            LOADED[f"@{kind}"](str(path))
        elif kind == "journal":
            from palpate.studies.journal import open_journal

            with open_journal(path, HEAD()) as book:
                list(book.rows())
        elif kind == "gains":
            _press(path)
        else:
            words = [["certify", "--check", str(path)]] if kind == "certificate" else _about(path)
            return _read_by(words)
    except InputError as error:
        return "refused" if str(error).strip() else "silent: an error without a word"
    return "read"


def _press(path: Path) -> None:
    """Some ticks of the force loop, whose speed stays within its limit."""
    from palpate.force import ForceLoop

    loop = ForceLoop.load(path)
    for k in range(20):
        assert abs(loop.update(0.5 * k, 1e-4 * k)) <= loop.gains.arm.limits.speed


def _about(path: Path) -> list[list[str]]:
    """What is asked about a log."""
    columns = (f"--time={NAMES[0]}", f"--position={NAMES[1]}:mm", f"--force={NAMES[2]}:N")
    return [["topics", str(path)], ["identify", str(path), *_columns(path, columns), "--end", "0", "--json"]]


def _read_by(commands: list[list[str]]) -> str:
    """By the program, which turns whatever happens into a code and a line."""
    from palpate.cli import main

    codes = []
    for words in commands:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            codes.append(_by_library(words) if words[0] in LOADED else main(words))
        said = err.getvalue().splitlines()
        if codes[-1] not in {0, 1, 2} or (codes[-1] == 2 and len(_errors(said)) != 1):
            return f"defect: {words} ended with {codes[-1]}: {(said or ['?'])[-3:]}"
        if any(len(line) > LONGEST + len("palpate: ") for line in _errors(said)):
            return f"defect: {words[0]} wrote an error of {max(map(len, said))} letters"
        if any(ord(letter) < 32 and letter not in "\n\t" for letter in out.getvalue() + err.getvalue()):
            return f"defect: {words[0]} printed a control character"
    return "refused" if codes[0] == 2 else "read"


def _errors(lines: list[str]) -> list[str]:
    """The lines of errors: others say what is compiled, or proved."""
    return [line for line in lines if line.startswith("palpate: ")]


def _load_arm(path: str) -> None:
    """An arm from its file, and its dynamics at home."""
    from palpate.press.prepare import arm_of

    arm = arm_of(path, "l2" if path.endswith("urdf") else None)
    arm.forward_kinematics(arm.home)
    arm.mass_matrix(arm.home)


def _load_experiment(path: str) -> None:
    from palpate.bench import build
    from palpate.bench.tables import load

    build(load(path))


def _load_study(path: str) -> None:
    from palpate.studies.plan import plan_runs
    from palpate.studies.study import load

    plan_runs(load(path), path)


LOADED = {
    "@arm": _load_arm,
    "@experiment": _load_experiment,
    "@study": _load_study,
    "@environment": run_in_environment,
}
"""Files that are read by the library alone, as a command would do more than read them."""


def _by_library(words: list[str]) -> int:
    """The exit code of reading a file, with the program's edge around it."""
    from palpate.cli._streams import run_guarded

    return run_guarded(lambda: LOADED[words[0]](words[1]))


def _columns(path: Path, columns: tuple[str, ...]) -> tuple[str, ...]:
    return columns if path.suffix in {".csv", ".parquet", ".mat", ".xlsx"} else ()


class Spoiled:
    """Inputs of a kind whose bytes are spoiled; by coverage, descendants of those that reached new lines."""

    def __init__(self, kind: str, folder: Path):
        self.kind = kind.removesuffix(BY_COVERAGE)
        self.covers = kind != self.kind
        ending, make = SAMPLES[self.kind]
        whole = folder / f"whole-{self.kind.replace(' ', '')}{ending}"
        if not whole.exists():
            make(whole)
        self.path, self.corpus, self.reached = (
            folder / f"log{ending}",
            [whole.read_bytes()],
            set[tuple[str, int]](),
        )
        assert _read(self.kind, whole) == "read", "what is not spoiled has to be read"

    def read(self, seed: int) -> str:
        """What becomes of one."""
        data = mutated(self.corpus[seed % len(self.corpus)] if self.covers else self.corpus[0], seed)
        self.path.write_bytes(data)
        if not self.covers:
            return _read(self.kind, self.path)
        known = len(self.reached)
        sys.settrace(self._traced)
        try:
            return _read(self.kind, self.path)
        finally:
            sys.settrace(None)
            if len(self.reached) > known and len(data) < 1 << 20:
                self.corpus.append(data)

    def _traced(self, frame: FrameType, event: str, _: object) -> Any:
        if PACKAGE not in frame.f_code.co_filename:
            return None
        self.reached.add((frame.f_code.co_filename, frame.f_lineno))
        return self._traced


class Formed:
    """Inputs of a kind that a grammar makes."""

    def __init__(self, kind: str, folder: Path):
        import webbrowser

        self.kind, self.make, self.folder = kind, GRAMMARS[kind][1], folder
        prepare(folder)
        os.chdir(folder)
        webbrowser.open = lambda *_, **__: True  # type: ignore[assignment]

    def read(self, seed: int) -> str:
        """What becomes of one."""
        return _read_by(self.make(random.Random(f"{self.kind} {seed}"), self.folder))


def most_memory() -> int:
    """Most memory that this program has held [bytes]; `getrusage` counts what started it, too, if that was larger."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024 * int(re.search(r"VmHWM:\s+(\d+) kB", status).group(1))  # type: ignore[union-attr]


def _serve(kind: str, seeds: range, folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with os.fdopen(os.dup(1), "w") as told, tempfile.TemporaryFile() as chatter:
        os.dup2(chatter.fileno(), 1)
        inputs = Formed(kind, folder) if kind in GRAMMARS else Spoiled(kind, folder)
        chatter.truncate(0)
        _streams.prepare()  # as the program begins
        for seed in seeds:
            begun = sum(os.times()[:4])
            try:
                outcome = inputs.read(seed)
            except BaseException as error:  # noqa: BLE001 - whatever it is, it is a finding
                outcome = f"defect: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
            if size := os.fstat(chatter.fileno()).st_size:
                outcome = f"defect: a library printed {os.pread(chatter.fileno(), 200, 0)!r}, {size} bytes"
                chatter.truncate(0)
            held = most_memory()
            if held > HELD:
                outcome = f"defect: {held / (1 << 30):.1f} GiB of memory"
            told.write(json.dumps((outcome, sum(os.times()[:4]) - begun)) + "\n")
            told.flush()
            if held > HELD:
                return


if __name__ == "__main__":
    _serve(sys.argv[1], range(int(sys.argv[2]), int(sys.argv[3])), Path(sys.argv[4]))
