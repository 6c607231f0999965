"""Fifty million samples to each on-line estimator: does anything stop being finite, grow, or become slow?

    python benchmarks/online/soak.py                       # 5e7 samples each
    python benchmarks/online/soak.py --samples 5e6

At 1 kHz, 5e7 samples are 14 hours. Every million of them is a press, a rest, and a press on a surface as stiff again.
`ContactIdentifier` takes its ticks one by one: some minutes.

`--hostile 2e7` feeds so many hostile samples to each: numbers of any size and sign, not numbers, stuck and swapped
readings between stretches of an honest press. A refused sample is left out, as the error says. Each thousand samples
the estimate is asked for: it must be finite, with no variance below zero; in the honest press after each stretch none
may be refused; and nothing may be called identified beyond the range of a contact.
"""

from __future__ import annotations

import argparse
import copy
import gc
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pressing import NOISE, REST, START, VAGUE, motion, regressors

from palpate.errors import InputError
from palpate.identifiers import (
    ContactIdentifier,
    Exponential,
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
HOSTILE_HEAD = (
    "| estimator | hostile samples | exceptions other than a refusal | honest samples refused "
    "| estimates not finite | with a variance below 0 | identified beyond a contact |"
)
SURFACES = (7e3, 14e3)  # [N/m], in turn
MAKERS: dict[str, Callable[[], Any]] = {
    "no forgetting": lambda: RecursiveLeastSquares(START, VAGUE),
    "exponential 0.998": lambda: RecursiveLeastSquares(START, VAGUE, Exponential(0.998)),
    "SIFt 0.994": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.994)),
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


WHOLE = 1000
"""Samples from one look at a hostile stream's estimate to the next."""
LIMITS = {"M": 1e2, "B": 1e5, "K": 1e7}
"""No contact has more [kg], [N s/m], [N/m]."""


def spoiled(random: np.random.Generator, numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers with a fault of some kind in a share of them; changed in place."""
    share = 10 ** random.uniform(-3.0, 0.0)
    hit = random.random(numbers.shape) < share
    kind = random.integers(7)
    if kind == 0:
        numbers[hit] = random.choice(
            [np.nan, np.inf, -np.inf, 1e308, -1e150, 1e30, 1e-308, 0.0], int(hit.sum())
        )
    elif kind == 1:
        numbers[hit] *= 10.0 ** random.uniform(-30, 30, int(hit.sum()))
    elif kind == 2:
        numbers[:] = numbers.flat[0]
    elif kind == 3:
        numbers *= 10.0 ** random.uniform(-12, 12)
    elif kind == 4:
        numbers[hit] = -numbers[hit]
    elif kind == 5:
        flipped = numbers.view(np.int64)
        flipped ^= np.where(hit, np.int64(1) << random.integers(0, 63, numbers.shape), 0)
    else:
        numbers[:] = random.normal(0.0, 10.0 ** random.uniform(-9, 9), numbers.shape)
    return numbers


@dataclass
class Hostile:
    """Faults of an estimator over hostile samples."""

    samples: int = 0
    exceptions: int = 0
    stuck: int = 0
    not_finite: int = 0
    below_zero: int = 0
    beyond: int = 0

    @property
    def bad(self) -> int:
        """Of all kinds."""
        return self.exceptions + self.stuck + self.not_finite + self.below_zero + self.beyond

    def take(self, estimator: Any, rows: Sequence[Any], force: list[float], honest: bool) -> None:
        """Feeds one by one; an honest sample that is refused has the estimator stuck."""
        for row, f in zip(rows, force, strict=True):
            try:
                estimator.update(row, f)
            except InputError:
                self.stuck += honest
            except Exception:  # noqa: BLE001 - any other is what is counted
                self.exceptions += 1
        self.samples += len(force)

    def look(self, estimator: Any, contact: bool) -> None:
        """Judges the present estimate."""
        try:
            found = estimator.estimate()
            verdicts = found.verdicts()
        except Exception:  # noqa: BLE001 - any other is what is counted
            self.exceptions += 1
            return
        variances = np.diag(found.covariance)
        self.not_finite += not (np.isfinite(found.theta).all() and np.isfinite(found.covariance).all())
        self.below_zero += bool((variances < 0.0).any())
        if contact:
            values = dict(zip(found.names, found.theta.tolist(), strict=True))
            known = [name for name in LIMITS if verdicts[name] == "identified"]
            self.beyond += any(not 0.0 < values[name] <= LIMITS[name] for name in known)


def attacked(name: str, count: int) -> Hostile:
    """A hostile stretch, an honest one, in turns; a new estimator every twenty of them."""
    found, number = Hostile(), 0
    while found.samples < count:
        random = np.random.default_rng([17, number])
        if number % 20 == 0:
            contact = name == "ContactIdentifier"
            estimator = (
                ContactIdentifier("butterworth3:120", 1000.0, 0.0035, touch=random.choice([None, 0.0, 3.0]))
                if contact
                else MAKERS[name]()
            )
        x, v = motion(random, "four tones", WHOLE, 1000.0)
        phi = regressors(x, v)
        force = phi @ [60.0, 7e3, 0.0] + random.normal(0.0, NOISE, WHOLE)
        rows: Any = x if contact else phi
        if number % 2 == 0:
            both = [rows, force]
            for one in both if random.random() < 0.5 else [both[random.integers(2)]]:
                spoiled(random, one)
        with np.errstate(all="ignore"):
            found.take(estimator, rows.tolist() if contact else list(rows), force.tolist(), number % 2 == 1)
            found.look(estimator, contact)
        number += 1
    return found


def memory() -> float:
    """What this process holds [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def hostilities(count: int) -> int:
    """Prints the table of hostile streams; how many faults there were."""
    print(HOSTILE_HEAD, "|" + "---|" * (HOSTILE_HEAD.count("|") - 1), sep="\n")
    bad = 0
    for name in (*MAKERS, "ContactIdentifier"):
        h = attacked(name, count)
        cells = (h.exceptions, h.stuck, h.not_finite, h.below_zero, h.beyond)
        print(f"| {name} | {h.samples:.1e} | " + " | ".join(map(str, cells)) + " |", flush=True)
        bad += h.bad
    return bad


def main() -> int:
    """Prints the table; 1 if anything was not finite, or grew."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=float, default=5e7)
    parser.add_argument("--hostile", type=float, help="so many hostile samples to each, and nothing else")
    asked = parser.parse_args()
    if asked.hostile:
        return int(hostilities(int(asked.hostile)) > 0)
    count = int(asked.samples)
    estimators = {name: make() for name, make in MAKERS.items()}
    for _ in range(2):
        soaked(estimators, min(CHUNK, count))
    before = memory()
    found = soaked(estimators, count)
    grown = memory() - before
    print(HEAD, "|" + "---|" * (HEAD.count("|") - 1), sep="\n")
    phi, force = samples(0)
    f = force.tolist()
    for name, estimator in estimators.items():
        took = Took()
        copies = [copy.deepcopy(estimator) for _ in range(COPIES)]
        took.time([lambda k, e=e: e.update(phi[k], f[k]) for e in copies], range(min(TIMED, count)))
        good, share = found[name]
        print(f"| {name} | {count:.1e} | {'yes' if good else 'no'} | {share:.2g} | {took.cells} |")
    contact = Contact.soaked(count)
    grown += contact.grown
    finite = "yes" if contact.good else "no"
    print(f"| ContactIdentifier | {count:.1e} | {finite} | | {contact.took.cells} |")
    took = Took()
    took.time([_nothing] * COPIES, range(min(TIMED, count)))
    print(f"| an empty loop | | | | {took.cells} |")
    print(f"\nMemory grew by {grown:.1f} MB.")
    return 0 if contact.good and all(good for good, _ in found.values()) and grown < 50.0 else 1


if __name__ == "__main__":
    raise SystemExit(main())
