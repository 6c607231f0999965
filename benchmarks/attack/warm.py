"""Commands of palpate, each in a process forked from one that has imported everything: none waits for imports.

The process that is forked has the library of faults (`faults.c`) loaded, and makes no change of the disk itself.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

PATIENCE = 300.0
"""Longest time of a command [s]."""
LOOK = 0.01
"""Time between two looks at a command [s]."""


class Trouble(NamedTuple):
    """What disturbs a command.

    Args:
        change: number of the change of the disk that fails; 0 for none.
        how: it fails, a word of `faults.c`.
        signal: sent to the process; 0 for none.
        after: when it is sent [s].
        largest: size that a file may have [bytes]; 0 for any.
    """

    change: int = 0
    how: str = ""
    signal: int = 0
    after: float = 0.0
    largest: int = 0


NONE = Trouble()


class Ended(NamedTuple):
    """How a command ended: exit code, standard error, duration [s], and whether the signal came in time."""

    code: int
    said: str
    took: float
    sent: bool


class Warm:
    """Runs commands one after the other.

    Args:
        library: the compiled `faults.c`, loaded before the C library.
        outside: a folder for what the commands print.
    """

    def __init__(self, library: Path, outside: Path):
        self._said = outside / "said"
        environment = {"LD_PRELOAD": str(library), "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "Agg"}
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(self._said)],
            env={**os.environ, **environment, "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(
        self, words: Sequence[str], folder: Path, environment: dict[str, str], trouble: Trouble = NONE
    ) -> Ended:
        """Run one command in a folder."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        stdin.write(json.dumps([list(words), str(folder), environment, trouble]) + "\n")
        stdin.flush()
        code, took, sent = json.loads(stdout.readline())
        return Ended(code, self._said.read_text(encoding="utf-8", errors="replace"), took, sent)

    def close(self) -> None:
        """End the process."""
        with self._process:  # closes both pipes, at which the process ends, and waits for it
            pass


def _serve(said: Path) -> None:
    """Forks a process for each line of standard input; in such a process, returns to run the command."""
    imported: set[str] = set()
    for line in sys.stdin:
        words, folder, environment, trouble = json.loads(line)
        begun = time.monotonic()
        process = os.fork()
        if not process:
            _become(words, folder, environment, Trouble(*trouble), said)
            return
        code, sent = _wait(process, Trouble(*trouble))
        answer: list[Any] = [code, time.monotonic() - begun, sent]
        with contextlib.suppress(OSError):
            for name in json.loads(said.with_suffix(".modules").read_text()):
                if name not in imported:
                    imported.add(name)
                    with contextlib.suppress(Exception):
                        import_module(name)
        print(json.dumps(answer), flush=True)
    os._exit(0)


def _become(words: list[str], folder: str, environment: dict[str, str], trouble: Trouble, said: Path) -> None:
    os.chdir(folder)
    os.setpgid(0, 0)
    os.environ.update(environment, ATTACK_LEARN="1" if trouble == NONE else "")
    nowhere = os.open(os.devnull, os.O_RDWR)
    errors = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    for number, target in enumerate((nowhere, nowhere, errors)):
        os.dup2(target, number)
    sys.argv = ["palpate", *words]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if trouble.largest:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (trouble.largest, trouble.largest))


def _wait(process: int, trouble: Trouble) -> tuple[int, bool]:
    """Its exit code, and whether the signal was sent in time; whatever it started is ended with it."""
    begun, sent = time.monotonic(), False
    while True:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            break
        after = time.monotonic() - begun
        if trouble.signal and not sent and after > trouble.after:
            os.kill(process, trouble.signal)
            sent = True
        if after > PATIENCE:
            os.kill(process, signal.SIGKILL)
        time.sleep(LOOK)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)
    return os.waitstatus_to_exitcode(status), sent


def _run(said: Path) -> int:
    from palpate.cli import main

    code = main()
    if os.environ["ATTACK_LEARN"]:  # a disturbed command may not write even this
        said.with_suffix(".modules").write_text(json.dumps(sorted(sys.modules)))
    return code


if __name__ == "__main__":
    SAID = Path(sys.argv[1])
    _serve(SAID)
    sys.exit(_run(SAID))
