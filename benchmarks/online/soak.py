"""Fifty million samples to each on-line estimator: does anything stop being finite, grow, or become slow?

    python benchmarks/online/soak.py                       # 5e7 samples each
    python benchmarks/online/soak.py --samples 5e6 --write # into docs/reliability.md

At 1 kHz, 5e7 samples are 14 hours. Every million of them is a press, a rest, and a press on a surface as stiff again.
`ContactIdentifier` takes its ticks one by one, and gets a hundredth of them.
"""

from __future__ import annotations

import argparse
import gc
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pressing import NOISE, REST, START, VAGUE, motion, regressors

from palpate.identifiers import (
    ContactIdentifier,
    Directional,
    Exponential,
    KalmanFilter,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)

CHUNK, TIMED = 1_000_000, 200_000
SURFACES = (7e3, 14e3)  # [N/m], in turn
PAGE = Path(__file__).resolve().parents[2] / "docs" / "reliability.md"
BEGIN, END = "<!-- soak: begin -->", "<!-- soak: end -->"
MAKERS: dict[str, Callable[[], Any]] = {
    "no forgetting": lambda: RecursiveLeastSquares(START, VAGUE),
    "exponential 0.998": lambda: RecursiveLeastSquares(START, VAGUE, Exponential(0.998)),
    "directional 0.994": lambda: RecursiveLeastSquares(START, VAGUE, Directional(0.994)),
    "SIFt 0.994": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.994)),
    "Kalman filter": lambda: KalmanFilter(START, VAGUE, [1.0, 30.0, 0.1]),
    "restarting": lambda: RestartingLeastSquares(START, VAGUE),
}


def samples(million: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Regressors and force of a press, a rest without any change, and a press on the other surface."""
    random = np.random.default_rng(million)
    x, v = motion(random, "four tones", CHUNK, 1000.0)
    x[CHUNK // 3 : 2 * CHUNK // 3], v[CHUNK // 3 : 2 * CHUNK // 3] = REST, 0.0
    K = np.where(np.arange(CHUNK) < CHUNK // 2, SURFACES[million % 2], SURFACES[1 - million % 2])
    phi = regressors(x, v)
    return phi, phi[:, 0] * 60.0 + phi[:, 1] * K + random.normal(0.0, NOISE, CHUNK)


def soaked(estimators: dict[str, Any], count: int) -> dict[str, tuple[bool, float]]:
    """Whether each stayed finite with no variance below zero, and its largest variance over the initial one."""
    found = dict.fromkeys(estimators, (True, 0.0))
    for million in range(max(count // CHUNK, 1)):
        phi, force = samples(million)
        for name, estimator in estimators.items():
            estimator.update_many(phi, force)
            variances = np.diag(estimator.covariance)
            good = (
                np.isfinite(estimator.theta).all()
                and np.isfinite(variances).all()
                and (variances >= 0.0).all()
            )
            share = float(np.max(variances / np.diag(VAGUE)))
            found[name] = found[name][0] and bool(good), max(found[name][1], share)
    return found


def slowest(update: Callable[[int], None], count: int = TIMED) -> tuple[float, float]:
    """Median and 99.9th percentile of one update [s of this thread: what else the machine does is not counted]."""
    took = np.empty(count)
    gc.disable()
    for k in range(count):
        begun = time.thread_time()
        update(k)
        took[k] = time.thread_time() - begun
    gc.enable()
    return float(np.median(took)), float(np.quantile(took, 0.999))


def contact(count: int) -> tuple[tuple[float, float], bool]:
    """What a tick of a `ContactIdentifier` takes, and whether it stays finite for so many."""
    identifier = ContactIdentifier("butterworth3:120", 1000.0, 0.0035)
    finite, timed = True, (0.0, 0.0)
    for million in range(max(count // CHUNK, 1)):
        phi, force = samples(million)
        x, f = phi[:, 1].tolist(), force.tolist()
        last = min(count, CHUNK)
        timed = slowest(lambda k, x=x, f=f: identifier.update(x[k], f[k]), last)
        finite = finite and bool(np.isfinite(identifier.estimator.theta).all())
    return timed, finite


def memory() -> float:
    """What this process holds [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def main() -> int:
    """Prints the table; 1 if anything was not finite, or grew."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=float, default=5e7)
    parser.add_argument("--write", action="store_true", help="put the result into docs/reliability.md")
    asked = parser.parse_args()
    count = int(asked.samples)
    estimators = {name: make() for name, make in MAKERS.items()}
    soaked(estimators, CHUNK)
    soaked(estimators, CHUNK)
    before = memory()
    found = soaked(estimators, count)
    grown = memory() - before
    rows = [
        "| estimator | samples | finite, no variance below 0 | largest variance of the initial | median | p99.9 |",
        "|---|---|---|---|---|---|",
    ]
    phi, force = samples(0)
    f = force.tolist()
    for name, estimator in estimators.items():
        median, p999 = slowest(lambda k, e=estimator: e.update(phi[k], f[k]))
        good, share = found[name]
        rows.append(
            f"| {name} | {count:.1e} | {'yes' if good else 'no'} | {share:.2g} | "
            f"{1e6 * median:.2f} us | {1e6 * p999:.1f} us |"
        )
    (median, p999), finite = contact(count // 100)
    rows.append(
        f"| ContactIdentifier | {count // 100:.1e} | {'yes' if finite else 'no'} | | "
        f"{1e6 * median:.2f} us | {1e6 * p999:.1f} us |"
    )
    rows += ["", f"`benchmarks/online/soak.py --samples {count:g}`; memory grew by {grown:.1f} MB."]
    print("\n".join(rows))
    if asked.write:
        head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        PAGE.write_text(
            f"{head}{BEGIN}\n\n" + "\n".join(rows) + f"\n\n{END}{rest.partition(END)[2]}", encoding="utf-8"
        )
    return 0 if finite and all(good for good, _ in found.values()) and grown < 50.0 else 1


if __name__ == "__main__":
    raise SystemExit(main())
