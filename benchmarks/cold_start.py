"""The first run after installation, with all its compiling, and the next: in a cache of its own."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BUDGET = 10.0
CODE = """
import time
from palpate.bench import build, load
bench = build(load("foam-hybrid"))
wall, cpu = time.perf_counter(), time.process_time()
bench.run(0.01)
print(time.perf_counter() - wall, time.process_time() - cpu)
"""


def seconds(*command: str, **environment: str) -> tuple[float, str]:
    begun = time.perf_counter()
    ran = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, *command],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return time.perf_counter() - begun, ran.stdout


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        cache = {"NUMBA_CACHE_DIR": str(Path(folder) / "cache"), "MPLBACKEND": "Agg"}
        bare = min(seconds("-c", "pass")[0] for _ in range(5))
        _, told = seconds("-c", CODE, **cache)
        wall, cpu = map(float, told.split())
        print(
            f"compiling the loop: {wall:.1f} s, of which {cpu:.1f} s on the processor; the budget is {BUDGET:.0f} s"
        )
        run = ["-m", "palpate", "run", "foam-hybrid", "--force", "--out", str(Path(folder) / "run")]
        warm = min(seconds(*run, **cache)[0] for _ in range(3))
        print(
            f"palpate run foam-hybrid, warm: {warm:.2f} s, {warm / bare:.0f} bare starts of the interpreter"
        )


if __name__ == "__main__":
    main()
