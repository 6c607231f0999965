"""The on-line identifier against `palpate.identify` on the same samples.

    python benchmarks/online/as_the_batch.py                # one seed a cell: 100 streams, some minutes
    python benchmarks/online/as_the_batch.py --first 100

Streams are those of `streams.py`: each surface with each kind of position and of sensor; then surfaces that become
another. A parameter that is called identified holds if its 95 % interval has a right value in it; it is confidently
wrong if it is more than a quarter off, or more than three half-widths and 2 %.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from itertools import product
from typing import Any

import numpy as np
from streams import POSITIONS, RATE, SENSORS, SURFACES, Stream, stream

import palpate
from palpate.identifiers import ContactIdentifier
from palpate.records import Record

NAMES = ("M", "B", "K")
LOOK = 100
"""Ticks from one look at the verdict to the next."""


def on_line(made: Stream) -> tuple[Any, int]:
    """The estimate at the end, and at how many looks all were refused."""
    one = ContactIdentifier(made.low_pass, RATE, made.lag, lag_std=made.lag_std, sampling=made.sampling)
    one.update_many(made.position[:1000], made.force[:1000])
    refused = 0
    for k in range(1000, len(made.force), LOOK):
        one.update_many(made.position[k : k + LOOK], made.force[k : k + LOOK])
        refused += one.estimate().verdicts()["K"] == "rejected"
    return one.estimate(), refused


def batch(made: Stream) -> Any:
    """The batch answer, by parameter."""
    record = Record(
        {"time": np.arange(len(made.force)) / RATE, "position": made.position, "force": made.force},
        {"time": "s", "position": "m", "force": "N"},
    )
    given = {"lag": made.lag, "lag_std": made.lag_std, "force_filter": made.low_pass}
    return palpate.identify(record, **given).parameters


def judged(truth: tuple[float, float], value: float, half: float) -> tuple[bool, bool]:
    """Whether an interval holds, and whether it is confidently wrong."""
    error = max(truth[0] - value, value - truth[1], 0.0)
    scale = max(truth[0], 1e-12)
    return error <= half, error > 0.25 * scale or (error > 3 * half and error > 0.02 * scale)


class Tally:
    """Counts of a group of streams."""

    def __init__(self) -> None:
        self.n: Counter[str] = Counter()

    def add(self, made: Stream) -> None:
        """Judges a stream both ways."""
        found, looks = on_line(made)
        log = batch(made)
        verdicts, n = found.verdicts(), self.n
        n["streams"] += 1
        n["refused"] += bool(found.rejected)
        n["looks"] += looks
        for i, name in enumerate(found.names[:3]):
            both = log[name].verdict == "identified" if name in log else False
            own = verdicts[name] == "identified"
            n[f"batch {name}"] += both
            n[f"both {name}"] += own and both
            if own:
                half = 1.96 * float(found.std[i])
                holds, wrong = judged(made.truth[name], float(found.theta[i]), half)
                n["known"] += 1
                n["holds"] += holds
                n["wrong"] += wrong

    def row(self, name: str) -> str:
        """As a row of the table."""
        n = self.n
        cells = [str(n["streams"])]
        cells += [f"{n[f'both {p}']} of {n[f'batch {p}']}" for p in ("K", "B")]
        cells += [f"{n['refused']}, {n['looks']}"]
        cells += [f"{100 * n['holds'] / max(n['known'], 1):.1f} % of {n['known']}", str(n["wrong"])]
        return f"| {name} | " + " | ".join(cells) + " |"


HEAD = (
    "| | streams | K of the batch's | B of the batch's | refused at the end, at looks | 95 % intervals hold |"
    " confidently wrong |"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="number by which other streams are drawn")
    parser.add_argument("--only", default="", help="a surface, a position or a sensor")
    asked = parser.parse_args()
    tallies: dict[str, Tally] = {}
    cells = [cell for cell in product(SURFACES, POSITIONS, SENSORS) if not asked.only or asked.only in cell]
    for number, (surface, position, sensor) in enumerate(cells):
        made = stream(1000 * asked.first + 7 * number, surface, position, sensor)
        own = Tally()
        own.add(made)
        for name in ("all", surface):
            tallies.setdefault(name, Tally()).n.update(own.n)
    if not asked.only:
        for number in range(10):
            made = stream(
                1000 * asked.first + 900 + number, "spring-damper", "counts 1", "each tick", changes=True
            )
            tallies.setdefault("surface changes", Tally()).add(made)
    print(HEAD)
    print("|" + "---|" * (HEAD.count("|") - 1))
    for name, tally in tallies.items():
        print(tally.row(name))


if __name__ == "__main__":
    sys.exit(main())
