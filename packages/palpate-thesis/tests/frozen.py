"""Every claim's verdict and numbers as they were last measured, and what has changed since.

`make claims` takes a whole measurement of `palpate thesis` into runs/claims, and
`python packages/palpate-thesis/tests/frozen.py runs/claims` compares and keeps it; of some figures alone, those.
Studies that take long are kept with two seeds, too: tests repeat these, and leave the other seeds to `make claims`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from palpate_thesis.claims import ThesisClaim
from palpate_thesis.figure import studies, study
from palpate_thesis.laboratory import load_laboratory
from palpate_thesis.measure import STATE, runs_for
from palpate_thesis.runs import Runs

FILE = Path(__file__).with_name("claims.json")
FEW = Path(__file__).with_name("claims_of_two_seeds.json")
"""The studies that take longest, with the first two seeds alone: what the tests repeat of them."""
NUMBER = r"[-±]?\d+(?:\.\d+)?(?:e[-+]\d+)?"
SPREAD = re.compile(
    rf"(?P<middle>{NUMBER})(?P<unit>[^()\d]*) \((?P<low>{NUMBER}) to (?P<high>{NUMBER}), (?P<of>\d+ seeds[^)]*)\)"
)


class Spread(NamedTuple):
    """Median and range over the seeds, as `palpate_thesis.claims.spread` writes them."""

    middle: str
    low: str
    high: str

    def holds(self, other: Spread) -> bool:
        """Whether the other's median lies in this range; rounding, which keeps the order, makes no difference."""
        return value(self.low) <= value(other.middle) <= value(self.high)


def value(number: str) -> float:
    return float(number.lstrip("±"))


def parts(measured: str) -> tuple[str, list[Spread]]:
    """The sentence without its spreads, and these."""
    spreads = [Spread(found["middle"], found["low"], found["high"]) for found in SPREAD.finditer(measured)]
    return SPREAD.sub(r"<\g<unit>, \g<of>>", measured), spreads


def told(claim: ThesisClaim) -> str:
    """What became of a claim, in one line."""
    return f"{claim.verdict}: {claim.measured}"


def differences(before: Mapping[str, str], claims: Sequence[ThesisClaim]) -> Iterator[str]:
    """A line for each claim of a study that is not what it was.

    A number with a range over the seeds may move within it: each median lies in the other's range. Verdicts, words and
    numbers that stand without a range are as they were: they do not depend on the processor (with and without fused
    multiplication and vectors, every digit is the same).
    """
    now = {claim.id: told(claim) for claim in claims}
    for name in sorted(before.keys() ^ now.keys()):
        yield f"{name}: {'new' if name in now else 'gone'}"
    for name in sorted(before.keys() & now.keys()):
        (words, old), (new_words, new) = parts(before[name]), parts(now[name])
        if words != new_words or not all(a.holds(b) and b.holds(a) for a, b in zip(old, new, strict=True)):
            yield f"{name} was {before[name]!r}, and is {now[name]!r}"


def kept(file: Path = FILE) -> dict[str, dict[str, str]]:
    """By study and claim, what became of it."""
    return json.loads(file.read_text("utf-8"))


def of_two_seeds(number: str) -> list[ThesisClaim]:
    """The claims of a study, measured with the first two seeds."""
    one = study(number)
    return list(one.check(one.run(runs_of(number, 2))))


def runs_of(number: str, seeds: int = 10) -> Runs:
    """The runs of a study as `palpate thesis` has them when no laboratory is named."""
    return runs_for(number, Runs(range(seeds), laboratory=load_laboratory("inferred")))


def keep(file: Path, measured: Mapping[str, Sequence[ThesisClaim]]) -> None:
    """Keep a measurement, and say what is not what it was."""
    before = kept(file)
    for number, claims in measured.items():
        for line in differences(before.get(number, {}), claims):
            sys.stdout.write(f"{line}\n")
    new = before | {
        number: {claim.id: told(claim) for claim in claims} for number, claims in measured.items()
    }
    kept_now = {one.NUMBER: new[one.NUMBER] for one in studies() if one.NUMBER in new}
    file.write_text(json.dumps(kept_now, indent=1, ensure_ascii=False) + "\n", "utf-8")


def main(folder: str) -> None:
    """Keep a measurement of all seeds, and measure and keep what the tests repeat of it."""
    done = json.loads((Path(folder) / STATE).read_text("utf-8"))["done"]
    keep(FILE, {number: [ThesisClaim(**claim) for claim in one["claims"]] for number, one in done.items()})
    keep(FEW, {number: of_two_seeds(number) for number in kept(FEW) if number in done})


if __name__ == "__main__":
    main(sys.argv[1])
