"""How long `palpate.identify` takes over a long log whose lag nobody knows.

    python benchmarks/identification/million_rows.py
    python benchmarks/identification/million_rows.py --rows 10000000

A probe dithers at 3 Hz about a slow way in and out of a Kelvin-Voigt surface, at 1 kHz. Printed are seconds of
wall time and of the processor, for the second of two runs: the first imports what it needs.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from palpate.identification import identify
from palpate.records import Record

STIFFNESS, DAMPING, NOISE = 5000.0, 30.0, 0.1


def log_of(rows: int, seed: int) -> Record:
    """A log of so many rows at 1 kHz: time [s], position [m], force [N]."""
    t = np.arange(rows) / 1000
    x = 3e-4 + 1e-3 * np.sin(2 * np.pi * 0.02 * t) + 2e-4 * np.sin(2 * np.pi * 3 * t)
    v = 2 * np.pi * (0.02e-3 * np.cos(2 * np.pi * 0.02 * t) + 6e-4 * np.cos(2 * np.pi * 3 * t))
    force = np.where(x > 0, np.maximum(STIFFNESS * x + DAMPING * v, 0.0), 0.0)
    force += NOISE * np.random.default_rng(seed).standard_normal(rows)
    return Record({"time": t, "position": x, "force": force}, {"time": "s", "position": "m", "force": "N"})


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    record = log_of(asked.rows, asked.seed)
    identify(log_of(20_000, asked.seed))
    wall, processor = time.perf_counter(), time.process_time()
    found = identify(record)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    k = found.parameters["K"]
    print(f"{asked.rows} rows, lag unknown: {wall:.2f} s, {processor:.2f} s of the processor")
    print(f"K {k.value} N/m {k.verdict}, 95 % {k.ci95}; true {STIFFNESS:g}")


if __name__ == "__main__":
    main()
