"""Readers for formats with crash-prone libraries, in a separate process with limits.

SciPy leaves the process by a segmentation fault at some MATLAB files, polars aborts it at some of Parquet, a small
file may unpack to any size, and MuJoCo may compile a short model for days. What the process answers is arrays and
words, never objects.
"""

import io
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import AnyArray
from palpate.errors import InputError
from palpate.files.reading import COPIES, OWN, ReadingBudget

_FEW_THREADS = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "POLARS_MAX_THREADS": "2"}
"""Threads that libraries would start, one for each core, take address space of their own."""
_MOST = 2**60
_TOO_LARGE = 3
"""The exit code of the process where the file unpacks to more than it may."""


def read_confined(
    reader: str, path: Path, what: str, budget: ReadingBudget, question: Any = None
) -> tuple[dict[str, AnyArray], Any]:
    """Read a file in a process of its own.

    Args:
        reader: a module of palpate with a function `unpack(path, size, question)`.
        path: of the file.
        what: to call its kind.
        budget: of the log.
        question: what is to be read, as JSON has it; all of it when None.

    Returns:
        Arrays by name, and what else the reader says, as JSON has it.

    Raises:
        InputError: the file cannot be read, or is too large.
    """
    start = f"import sys; from {__name__} import main; sys.exit(main(*sys.argv[1:]))"
    size = str(int(min(budget.limits.size, _MOST)))
    command = [sys.executable, "-P", "-c", start, reader, str(path.absolute()), size]
    try:
        done = subprocess.run(  # noqa: S603 - this interpreter, this module
            command,
            input=json.dumps(question).encode(),
            env=os.environ | _FEW_THREADS,
            capture_output=True,
            timeout=max(budget.seconds_left, 0.1),
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise budget.too_long() from None
    if done.returncode == _TOO_LARGE:
        budget.check(np.inf)
    error = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode:
        trouble = error[-1] if done.returncode > 0 and error else "it is damaged"
        if done.returncode == 2:
            raise InputError(trouble)
        raise InputError(f"{path} cannot be read as {what} ({trouble}); is it whole?")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as answer:
        about = json.loads(answer["about"].tobytes())
        arrays = {name: answer[str(i)] for i, name in enumerate(about["names"])}
    budget.take(sum(array.nbytes for array in arrays.values()))
    return arrays, about["also"]


def _answer(arrays: Mapping[str, AnyArray], also: Any) -> bytes:
    about = np.frombuffer(json.dumps({"names": list(arrays), "also": also}).encode(), np.uint8)
    file = io.BytesIO()
    np.savez(file, about=about, **{str(i): array for i, array in enumerate(arrays.values())})  # type: ignore[arg-type]
    return file.getvalue()


def _confine(size: int) -> None:
    """Leave this process no more memory than the limit allows, where the system can."""
    try:
        import resource
    except ImportError:  # not on Windows
        return
    _, allowed = resource.getrlimit(resource.RLIMIT_AS)
    limit = OWN + COPIES * size
    limit = limit if allowed == resource.RLIM_INFINITY else min(limit, allowed)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main(reader: str, path: str, size: str) -> int:
    """Read one file and write the answer to standard output."""
    from importlib import import_module

    _confine(int(size))
    unpack = import_module(reader).unpack
    try:
        answer = _answer(*unpack(Path(path), int(size), json.load(sys.stdin)))
        sys.stdout.buffer.write(answer)
        sys.stdout.buffer.flush()
    except MemoryError:
        return _TOO_LARGE
    except InputError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2
    except Exception as error:  # noqa: BLE001 - a damaged file fails in as many ways as there are bytes
        line = (str(error).splitlines() or [""])[0] or type(error).__name__
        print(line, file=sys.stderr)  # noqa: T201
        return 1
    return 0
