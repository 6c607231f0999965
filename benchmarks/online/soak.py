"""Fifty million samples to each on-line estimator: does anything stop being finite, grow, or become slow?

    python benchmarks/online/soak.py                       # 5e7 samples each
    python benchmarks/online/soak.py --samples 5e6 --write # into docs/reliability.md

At 1 kHz, 5e7 samples are 14 hours. Every million of them is a press, a rest, and a press on a surface as stiff again.
`ContactIdentifier` takes its ticks one by one: some minutes.
"""

from __future__ import annotations

import argparse
import copy
import gc
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
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
EACH = 4_000
"""Of a million ticks, those that are timed."""
COPIES = 5
HEAD = (
    "| estimator | samples | finite, no variance below 0 | largest variance of the initial "
    "| median | p99.9 | largest | p99.9, busy |"
)
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


class Took:
    """What single updates take of this thread's own time.

    A machine that others use stops a loop at any moment, and part of that is charged to whoever was running. So each
    update is done by several copies of the estimator, and the fastest counts: what is slow in all is the estimator.
    """

    def __init__(self) -> None:
        self._took: list[NDArray[np.float64]] = []

    def time(self, updates: Sequence[Callable[[int], None]], ks: range) -> None:
        """Times `update(k)` for each k, of each copy."""
        clock, took = time.thread_time_ns, np.empty((len(ks), len(updates)))
        gc.disable()
        for i, k in enumerate(ks):
            for j, update in enumerate(updates):
                begun = clock()
                update(k)
                took[i, j] = clock() - begun
        gc.enable()
        self._took.append(took / 1e3)

    @property
    def cells(self) -> str:
        """Median, 99.9th percentile and largest of the fastest copies; the 99.9th percentile of any copy [us]."""
        took = np.concatenate(self._took)
        median, high, most = np.quantile(took.min(axis=1), [0.5, 0.999, 1.0])
        return f"{median:.2f} us | {high:.1f} us | {most:.1f} us | {np.quantile(took, 0.999):.1f} us"


def _nothing(_: int) -> None:
    """What takes about as long as an update, and can do nothing wrong."""
    for _ in range(60):
        pass


@dataclass
class Contact:
    """What became of a `ContactIdentifier` over so many ticks, fed one by one."""

    took: Took
    good: bool = True
    grown: float = 0.0

    @classmethod
    def soaked(cls, count: int) -> Contact:
        """Feeds it, and asks it each million ticks for its estimate."""
        identifier = ContactIdentifier("butterworth3:120", 1000.0, 0.0035)
        found, before = cls(Took()), 0.0
        for million in range(max(count // CHUNK, 1)):
            phi, force = samples(million)
            x, f = phi[:, 1].tolist(), force.tolist()
            copies = [identifier, *(copy.deepcopy(identifier) for _ in range(COPIES - 1))]
            found.took.time([lambda k, i=i, x=x, f=f: i.update(x[k], f[k]) for i in copies], range(EACH))
            identifier.update_many(x[EACH:], f[EACH:])
            estimate = identifier.estimate()
            variances = np.diag(estimate.covariance)
            finite = np.isfinite(estimate.theta).all() and np.isfinite(variances).all()
            found.good = found.good and bool(finite and (variances >= 0.0).all())
            del x, f, copies  # a million samples as Python's floats are larger than all that is looked for
            before = memory() if million < 2 else before
        found.grown = memory() - before
        return found


def memory() -> float:
    """What this process holds [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def _tell(rows: list[str], row: str) -> None:
    rows.append(row)
    print(row, flush=True)


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
    rows: list[str] = []
    for line in (HEAD, "|" + "---|" * (HEAD.count("|") - 1)):
        _tell(rows, line)
    phi, force = samples(0)
    f = force.tolist()
    for name, estimator in estimators.items():
        took = Took()
        copies = [copy.deepcopy(estimator) for _ in range(COPIES)]
        took.time([lambda k, e=e: e.update(phi[k], f[k]) for e in copies], range(TIMED))
        good, share = found[name]
        _tell(rows, f"| {name} | {count:.1e} | {'yes' if good else 'no'} | {share:.2g} | {took.cells} |")
    contact = Contact.soaked(count)
    grown += contact.grown
    finite = "yes" if contact.good else "no"
    _tell(rows, f"| ContactIdentifier | {count:.1e} | {finite} | | {contact.took.cells} |")
    took = Took()
    took.time([_nothing] * COPIES, range(TIMED))
    _tell(rows, f"| an empty loop | | | | {took.cells} |")
    _tell(rows, "")
    _tell(
        rows,
        f"`benchmarks/online/soak.py --samples {count:g}`, {datetime.now(UTC):%Y-%m-%d}; memory grew by"
        f" {grown:.1f} MB.",
    )
    if asked.write:
        head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        PAGE.write_text(
            f"{head}{BEGIN}\n\n" + "\n".join(rows) + f"\n\n{END}{rest.partition(END)[2]}", encoding="utf-8"
        )
    return 0 if contact.good and all(good for good, _ in found.values()) and grown < 50.0 else 1


if __name__ == "__main__":
    raise SystemExit(main())
