"""The first press after installation, with all its compiling, and the next: in a cache of its own.

Seconds of the processor stand beside those of the clock: they are what is left when nothing else runs. The bench's own
first tick is compiled beside it, for a measure of the machine.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from cold_start import child, ran
from compiling import LISTED, SPENT, listed

COLD, WARM = 12.0, 1.0
"""Budgets [s of the processor]."""
PRESS = """
import time
from palpate.press.prepare import Question, prepared, surface_of
wall, cpu = time.perf_counter(), time.process_time()
prepared(Question(arm="fr3", force=20.0, surface=surface_of("K=5000,B=50"), seconds=0.1)).run()
print(time.perf_counter() - wall, time.process_time() - cpu)
"""
WHERE = (
    SPENT
    + """
from palpate.press.prepare import Question, prepared, surface_of
begin = time.process_time()
prepared(Question(arm="fr3", force=20.0, surface=surface_of("K=5000,B=50"), seconds=0.1)).run()
"""
    + LISTED
)
BENCH = """
import time
from palpate.bench import build, load
bench = build(load("foam-neural"))
wall, cpu = time.perf_counter(), time.process_time()
bench.run(0.01)
print(time.perf_counter() - wall, time.process_time() - cpu)
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as cache:
        for what, code, budget in (
            ("the first press", PRESS, COLD),
            ("the next", PRESS, WARM),
            ("the bench's first tick", BENCH, 10.0),
        ):
            wall, cpu = child(code, NUMBA_CACHE_DIR=cache)
            print(f"{what:28}{wall:7.2f} s{cpu:9.2f} s of the processor; the budget is {budget:g} s")
    with tempfile.TemporaryDirectory() as another:
        print(listed(ran(WHERE, NUMBA_CACHE_DIR=another), "the first press"))


if __name__ == "__main__":
    main()
