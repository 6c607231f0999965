"""Runs side by side in one register: how many ticks of foam-neural lanes give in the time of one run's tick in C.

The C of the yardstick is compiled once as it stands, and once with a vector of 4 or 8 runs in the place of each double
(`lanes.cpp`). All lanes take the branches of the first, and all runs are alike, so that none waits for another: runs
that differ would compute both sides of each branch. Bursts of the two take turns.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from compare import EXPERIMENT, HERE, TICKS, WIDTH, in_c, library, seconds

from palpate.bench import build, load

FLAGS = "-O3 -march=native -ffp-contract=off -fno-math-errno -std=c++17 -fpermissive -w -shared -fPIC"
NEEDED = {4: "avx2", 8: "avx512f"}
"""Lanes, and the processor's own instructions for them."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bursts", type=int, default=21)
    given = parser.parse_args()
    own = Path("/proc/cpuinfo").read_text().split()
    print(
        "| runs in a register | a tick of one in C [us] | a tick of all [us] | ticks in the time of one (middle half) |"
    )
    print("|---|---|---|---|")
    for lanes in [lanes for lanes, needed in NEEDED.items() if needed in own]:
        source = [*shlex.split(FLAGS), f"-DLANES={lanes}", str(HERE / "lanes.cpp"), "-lmvec"]
        with library("gcc") as one, library("g++", source) as several:
            times, apart = bursts(one, several, given.bursts)
        low, gain, high = np.percentile(lanes * times[0] / times[1], (25, 50, 75))
        c, all_lanes = 1e6 * np.median(times, axis=1)
        print(f"| {lanes} | {c:.2f} | {all_lanes:.2f} | **{gain:.2f}** ({low:.2f} to {high:.2f}) |")
    print(
        f"| largest difference of the last row from that of one run, of its largest number | | | {apart:.0e} |"
    )
    return 0


def bursts(one, several, count: int):
    """Times of a tick of one run and of all lanes in turns [s], shape (2, count); and the difference of their rows."""
    bench = build(load(EXPERIMENT))
    noise, rows = np.random.default_rng(0).standard_normal(TICKS), np.empty((2, TICKS, WIDTH))
    engines = [in_c(lib, bench.loop, bench.q) for lib in (one, several)]
    for _ in range(
        round(10.0 / bench.loop.tick / TICKS)
    ):  # into contact and learning first, as in compare.py
        for engine, out in zip(engines, rows, strict=True):
            engine(noise, out)
    times = [
        [seconds(engine, noise, out) / TICKS for engine, out in zip(engines, rows, strict=True)]
        for _ in range(count)
    ]
    first, other = rows[:, -1]
    return np.array(times).T, float(np.abs(first - other).max() / np.abs(first).max())


if __name__ == "__main__":
    sys.exit(main())
