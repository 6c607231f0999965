"""The first run after installation, with all its compiling, and the next: in a cache of its own.

Seconds of the processor stand beside those of the clock: they are what is left when nothing else runs.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from compiling import LISTED, SPENT, listed

COLD, WARM, RUN = 10.0, 0.6, 2.0
"""Budgets [s]: to compile the whole tick, to load it from the cache, and for `palpate run` of ten seconds."""
FIRST_CALL = """
import time
from palpate.bench import build, load
bench = build(load("{name}"))
wall, cpu = time.perf_counter(), time.process_time()
bench.run(0.01)
print(time.perf_counter() - wall, time.process_time() - cpu)
"""
WHERE = (
    SPENT
    + """
from palpate.bench import build, load
bench = build(load("foam-neural"))
begin = time.process_time()
bench.run(0.01)
"""
    + LISTED
)
TEN_SECONDS = r"""
import sys, time
from pathlib import Path
wall, cpu = time.perf_counter(), time.process_time()
from palpate.cli import main
text = Path(sys.argv[1]).read_text()
changes = {"press = 8.0": "duration = 10.0\npress = 9.0", "hold = 5.0": "hold = 0.5", "first = 0.456": "first = 0.464"}
for old, new in changes.items():
    assert old in text
    text = text.replace(old, new)
path = Path(sys.argv[2]) / "ten.toml"
path.write_text(text)
code = main(["run", str(path), "--replace", "--out", str(Path(sys.argv[2]) / "run"), "--json"])
print(file=sys.stderr)
print(time.perf_counter() - wall, time.process_time() - cpu, file=sys.stderr)
"""


def ran(code: str, *arguments: str, **environment: str) -> str:
    """What a process of its own printed."""
    done = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout + done.stderr


def child(code: str, *arguments: str, **environment: str) -> tuple[float, float]:
    """Wall and processor seconds that a process of its own reports last."""
    wall, cpu = ran(code, *arguments, **environment).split()[-2:]
    return float(wall), float(cpu)


def told(what: str, seconds: tuple[float, float], budget: float) -> None:
    wall, cpu = seconds
    print(f"{what:58}{wall:7.2f} s{cpu:9.2f} s of the processor; the budget is {budget:g} s")


def main() -> None:
    import palpate.bench

    experiments = Path(palpate.bench.__file__).parent / "experiments"
    with tempfile.TemporaryDirectory() as folder:
        cache = {"NUMBA_CACHE_DIR": str(Path(folder) / "cache"), "MPLBACKEND": "Agg"}
        for name in ("foam-hybrid", "foam-neural"):
            code = FIRST_CALL.format(name=name)
            told(f"the loop of {name}, compiled", child(code, **cache), COLD)
            told(f"the loop of {name}, from the cache", min(child(code, **cache) for _ in range(5)), WARM)
        anew = {**cache, "NUMBA_CACHE_DIR": str(Path(folder) / "another")}
        print(listed(ran(WHERE, **anew), "the loop of foam-neural"))
        ten = [child(TEN_SECONDS, str(experiments / "foam-hybrid.toml"), folder, **cache) for _ in range(5)]
        told("palpate run, 10 s on the bench, with record and report", min(ten), RUN)


if __name__ == "__main__":
    main()
