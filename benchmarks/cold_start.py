"""The first run after installation, with all its compiling, and the next: in a cache of its own.

Seconds of the processor stand beside those of the clock: they are what is left when nothing else runs.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import palpate.bench

COLD, WARM, RUN = 10.0, 0.6, 2.0
"""Budgets [s]: to compile the whole tick, to load it from the cache, and for `palpate run` of ten seconds."""
FIRST_PRESS, NEXT_PRESS = 12.0, 1.0
"""Budgets of a press [s]."""
COMMANDS = {
    "identify press.csv": 0.9, "identify press.csv --figure press.png": 1.6, "topics press.csv": 0.9,
    "tune --stiffness 5000:5500 --arm ur5e --force 20:N --out {run}.toml": 1.0, "certify 0.toml --out {run}.json": 1.0,
}  # fmt: skip
"""Budgets of a command [s]."""
PRESS = """
import time
from palpate.press.prepare import PressSpec, prepare_press, surface_of
wall, cpu = time.perf_counter(), time.process_time()
prepare_press(PressSpec(arm="fr3", force=20.0, surface=surface_of("K=5000,B=50"), seconds=0.1)).run()
print(time.perf_counter() - wall, time.process_time() - cpu)
"""
FIRST_CALL = """
import time
from palpate.bench import build, load
bench = build(load("{name}"))
wall, cpu = time.perf_counter(), time.process_time()
bench.run(0.01)
print(time.perf_counter() - wall, time.process_time() - cpu)
"""
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


def child(code: str, *arguments: str, **environment: str) -> tuple[float, float]:
    """Wall and processor seconds that a process of its own reports last."""
    done = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(done.stderr)
    wall, cpu = (done.stdout + done.stderr).split()[-2:]
    return float(wall), float(cpu)


def command(words: str, folder: str, repeats: int) -> tuple[float, float]:
    """Wall and processor seconds of a command as it is typed, the shortest of some runs."""
    seconds = []
    for run in range(repeats):
        typed = [sys.executable, "-m", "palpate", *words.format(run=run).split()]
        wall, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(typed, cwd=folder, capture_output=True, check=True)  # noqa: S603 - our own interpreter
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        processor = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        seconds.append((time.perf_counter() - wall, processor))
    return min(seconds, key=lambda pair: pair[1])


def row(title: str, seconds: tuple[float, float], budget: float) -> str:
    wall, cpu = seconds
    return f"| {title} | {wall:.2f} s | {cpu:.2f} s | {budget:g} s |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5, help="of what is not compiled")
    parser.add_argument("--loops", nargs="+", default=["foam-hybrid", "foam-neural"], help="by experiment")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cache = {"NUMBA_CACHE_DIR": str(Path(folder) / "cache"), "MPLBACKEND": "Agg"}
        print("| | clock | processor | wanted |\n|---|---|---|---|")
        for name in given.loops:
            code = FIRST_CALL.format(name=name)
            print(row(f"{name}, compiled", child(code, **cache), COLD))
            again = min(child(code, **cache) for _ in range(given.repeats))
            print(row(f"{name}, from the cache", again, WARM))
        for title, budget, repeats in (("first", FIRST_PRESS, 1), ("next", NEXT_PRESS, given.repeats)):
            seconds = min(child(PRESS, **cache) for _ in range(repeats))
            print(row(f"`palpate press`, the {title}", seconds, budget))
        (Path(folder) / "press.csv").write_bytes(
            (Path(palpate.bench.__file__).parents[1] / "logs/press.csv").read_bytes()
        )
        for words, budget in COMMANDS.items():
            print(
                row(
                    f"`palpate {words.split()[0]}`" + ", with a figure" * ("--figure" in words),
                    command(words, folder, given.repeats),
                    budget,
                )
            )
        experiment = Path(palpate.bench.__file__).parent / "experiments" / "foam-hybrid.toml"
        ten = min(child(TEN_SECONDS, str(experiment), folder, **cache) for _ in range(given.repeats))
        print(row("`palpate run`, ten seconds on the bench, with figures and report", ten, RUN))


if __name__ == "__main__":
    main()
