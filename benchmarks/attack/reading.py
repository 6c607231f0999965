"""Reads spoiled files in a child process with limits of time and memory, and tells what became of each.

Time is that of the processor, which other programs on the machine do not change.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
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

from mutate import mutated
from samples import HEAD, NAMES, SAMPLES

SECONDS, BYTES = 20.0, 4 << 30
"""What one input may take of the processor's time, and a child of memory."""
PATIENCE = 15.0
"""Times as long an input may take by the clock: a machine may be busy, but who sleeps hangs as well."""
IMPORTS = 60.0
"""What a child may take before its first input [s]."""
GOOD = ("read", "refused")


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
                child.kill()
                why = f"killed by signal {-child.wait()}" if ready else f"more than {seconds:g} s"
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
        if kind == "experiment":
            from palpate.bench import build
            from palpate.bench.experiments.tables import load

            build(load(str(path)))
        elif kind == "study":
            from palpate.studies.definition.plan import plan
            from palpate.studies.definition.study import load as load_study

            plan(load_study(str(path)), str(path))
        elif kind == "journal":
            from palpate.studies.running import journal

            with journal.opened(path, HEAD()) as book:
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
            codes.append(main(words))
        if codes[-1] not in {0, 1, 2} or (codes[-1] == 2 and err.getvalue().count("\n") != 1):
            return f"defect: {words[0]} ended with {codes[-1]}: {(err.getvalue().splitlines() or ['?'])[-2:]}"
        if any(ord(letter) < 32 and letter not in "\n\t" for letter in out.getvalue() + err.getvalue()):
            return f"defect: {words[0]} printed a control character"
    return "refused" if codes[0] == 2 else "read"


def _columns(path: Path, columns: tuple[str, ...]) -> tuple[str, ...]:
    return columns if path.suffix in {".csv", ".parquet", ".mat"} else ()


def _serve(kind: str, seeds: range, folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ending, make = SAMPLES[kind]
    whole = folder / f"whole-{kind.replace(' ', '')}{ending}"
    if not whole.exists():
        make(whole)
    data = whole.read_bytes()
    with os.fdopen(os.dup(1), "w") as told, tempfile.TemporaryFile() as chatter:
        for stream in (1, 2):
            os.dup2(chatter.fileno(), stream)
        assert _read(kind, whole) == "read", "what is not spoiled has to be read"
        for seed in seeds:
            path = folder / f"log{ending}"
            path.write_bytes(mutated(data, seed))
            begun = sum(os.times()[:4])
            try:
                outcome = _read(kind, path)
            except BaseException as error:  # noqa: BLE001 - whatever it is, it is a finding
                outcome = f"defect: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
            if size := os.fstat(chatter.fileno()).st_size:
                outcome = f"defect: a library printed {os.pread(chatter.fileno(), 200, 0)!r}, {size} bytes"
                chatter.truncate(0)
            told.write(json.dumps((outcome, sum(os.times()[:4]) - begun)) + "\n")
            told.flush()


if __name__ == "__main__":
    _serve(sys.argv[1], range(int(sys.argv[2]), int(sys.argv[3])), Path(sys.argv[4]))
