"""Monte Carlo of the uncertainty budget (JCGM 101): the spread of estimates against what the budget states.

    python benchmarks/identification/uncertainty.py --draws 60
    python benchmarks/identification/uncertainty.py --draws 60 --logs kelvin-voigt-2

Of each certified log whose model is linear the force is drawn again: the certified model's force,
with normal noise of the certified residual standard deviation; then also with a lag that errs by a normal deviate of
1 ms, while the identification is given its mean and that standard deviation. A ratio is a standard uncertainty, root
mean square over the draws, over the standard deviation of its estimates: 1 is exact, more is cautious. A cell has
two: of the budget by the sources that noise reaches, `noise` and `other forces`, and `lag` where it is drawn; and of
the budget's combined standard uncertainty, in which is also what nobody drew. The standard error of a ratio is
1/sqrt(2 draws).
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.certified_logs.models import FLOATS, CertifiedProblem, motion_and_force, problems
from palpate.identification import Identification, identify
from palpate.records import Record

Array = NDArray[np.float64]

LAG_STD = 1e-3
"""Standard uncertainty of the lag in the second part [s]."""
CLOSE = 0.05
"""Largest deviation of a ratio from 1 that counts as agreement."""
MANY = 10.0
"""Ratio from which on it is written without decimals."""


class Ratios(NamedTuple):
    """Standard uncertainties of one parameter of a log over the standard deviation of the estimates.

    Args:
        drawn: of the budget, by the sources that were drawn.
        combined: of the budget, by all.
    """

    drawn: float
    combined: float

    def __str__(self) -> str:
        return " / ".join(f"{one:.2f}" if one < MANY else f"{one:.0f}" for one in self)


def record_of(problem: CertifiedProblem, lag: float, rng: np.random.Generator) -> Record:
    """A log of the certified motion and model with noise of its own.

    Args:
        problem: of the log.
        lag: of the force behind the position, beyond the certified one [s].
        rng: of the noise.
    """
    motion, _ = motion_and_force(problem)
    values = {name: float(own.value) for name, own in problem.certified.items()}
    late = values | {"lag": values.get("lag", 0.0) + lag}
    columns = problem.law.columns(motion, late, FLOATS)
    force = sum(values[name] * column for name, column in zip(problem.law.linear, columns, strict=True))
    force = force + rng.normal(0.0, float(problem.residual_std), len(motion.time))
    position = motion.derivative(0, FLOATS)
    return Record(
        {"time": motion.time, "position": position, "force": force},
        {"time": "s", "position": "m", "force": "N"},
    )


def drawn(problem: CertifiedProblem, draws: int, lag_std: float) -> Iterator[Identification]:
    """Identifications of a log drawn again and again.

    Args:
        problem: of the log.
        draws: how often.
        lag_std: standard deviation of the lag, which the identification is given [s].
    """
    lag = float(problem.certified["lag"].value) if "lag" in problem.certified else 0.0
    model = "kelvin-voigt-mass" if "M" in problem.certified else "kelvin-voigt"
    for seed in range(draws):
        rng = np.random.default_rng([seed, len(problem.name)])
        record = record_of(problem, lag_std * rng.normal(), rng)
        yield identify(record, model=model, lag=lag, lag_std=lag_std, bonded=True)


def ratios(found: list[Identification], sources: tuple[str, ...]) -> dict[str, Ratios]:
    """Of each parameter that every draw bounds.

    Args:
        found: one of each draw.
        sources: causes that were drawn.
    """
    own: dict[str, Ratios] = {}
    for name in "KBM":
        parts = [one.parameters[name] for one in found if name in one.parameters]
        if len(parts) < len(found) or any(p.ci95 is None or not p.contributions for p in parts):
            continue
        spread = float(np.std([sum(p.ci95) / 2 for p in parts if p.ci95], ddof=1))
        by_drawn = [sum(p.contributions[c].std ** 2 for c in sources if c in p.contributions) for p in parts]
        whole = [sum(c.std**2 for c in p.contributions.values()) for p in parts]
        own[name] = Ratios(*(float(np.sqrt(np.mean(variance))) / spread for variance in (by_drawn, whole)))
    return own


def row(problem: CertifiedProblem, draws: int) -> tuple[str, list[Ratios]]:
    """A row of the table, and its ratios."""
    cells: list[str] = []
    every: list[Ratios] = []
    for sources, lag_std in (
        (("noise", "other forces"), 0.0),
        (("noise", "other forces", "lag"), LAG_STD),
    ):
        found = ratios(list(drawn(problem, draws, lag_std)), sources)
        cells += [str(found[name]) if name in found else "-" for name in "KBM"]
        every += found.values()
    return line(problem.name, cells), every


def line(name: str, cells: list[str]) -> str:
    """A line of the table."""
    return f"{name:24}{''.join(f'{cell:>20}' for cell in cells)}"


def main() -> int:
    """Print the table and how many ratios agree."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--draws", type=int, default=60, help="of each log and part")
    parser.add_argument("--logs", default=".", help="regular expression of their names")
    asked = parser.parse_args()
    own = [p for p in problems() if set(p.law.nonlinear) <= {"lag"} and re.search(asked.logs, p.name)]
    print(line("log", ["K, noise", "B", "M", "K, noise and lag", "B", "M"]))
    every: list[Ratios] = []
    for problem in own:
        text, found = row(problem, asked.draws)
        every += found
        print(text, flush=True)
    counts = [
        f"{sum(abs(one[i] - 1) <= CLOSE for one in every)} within {CLOSE:.0%},"
        f" {sum(one[i] >= 1 - CLOSE for one in every)} not below, by {name}"
        for i, name in enumerate(("the sources drawn", "all sources"))
    ]
    print(
        f"\nOf {len(every)} ratios: {'; '.join(counts)}."
        f" {asked.draws} draws, standard error of a ratio {1 / np.sqrt(2 * asked.draws):.2f}."
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
