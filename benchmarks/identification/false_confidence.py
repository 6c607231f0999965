"""How often a parameter is called identified by logs that do not carry it.

    python benchmarks/identification/false_confidence.py --trials 200
    nice python benchmarks/identification/false_confidence.py --trials 10000 steady free

Each trial is a given motion on a foam or a rubber of its own, through the bench's encoder and the whole chain of its
force sensor, with a noise and a phase of its own. "told" knows the sensor's low-pass and its calibrated lag, "untold"
nothing. The limit is the largest share of which so few hits would still be one case in twenty (Clopper and Pearson).
"bound" is the least Cramer-Rao bound of the parameter's deviation in all trials, as a share of the parameter: an
interval as narrow as `identified` asks for, a quarter to each side, needs 0.13.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).parent))

from poor_presses import KINDS, SURFACES, PoorLog, poor_log

from palpate.errors import InputError
from palpate.identification import Identification, identify

TELLINGS = ("told", "untold")
SHOWN = 5  # seeds of a line's false verdicts


@dataclass(frozen=True)
class Trial:
    """What one log was said to show.

    Args:
        seed, material: of the log.
        bound: of each parameter that it lacks, over its truth.
        claimed: by telling, the parameters that it lacks and that were called identified all the same.
        held: by telling, those of them whose interval holds the truth.
        refused: tellings under which there was no contact to see, or an input error.
        seconds: by telling, what the identification took.
    """

    seed: int
    material: str
    bound: dict[str, float]
    claimed: dict[str, tuple[str, ...]]
    held: dict[str, tuple[str, ...]]
    refused: tuple[str, ...]
    seconds: dict[str, float]


def trial(kind: str, model: str | None, seed: int, material: str) -> Trial:
    """One log, identified under every telling."""
    poor = poor_log(kind, material, seed)
    claimed, held, refused, seconds = {}, {}, [], {}
    for telling in TELLINGS:
        begin = time.perf_counter()
        found = _identified(poor, telling, model)
        seconds[telling] = time.perf_counter() - begin
        if found is None or not found.contacts:
            refused.append(telling)
        claimed[telling], held[telling] = _claims(poor, found) if found else ((), ())
    return Trial(seed, material, poor.bound, claimed, held, tuple(refused), seconds)


def _identified(poor: PoorLog, telling: str, model: str | None) -> Identification | None:
    known = {"force_filter": poor.low_pass, "lag": poor.lag} if telling == "told" else {}
    try:
        return identify(poor.log, model=model, **known)
    except InputError:
        return None


def _claims(poor: PoorLog, found: Identification) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What is called identified of the parameters that the log lacks, and what of that is true."""
    ours = {name: found.parameters[name] for name in poor.bound if name in found.parameters}
    claimed = {name: p.ci95 for name, p in ours.items() if p.verdict == "identified"}
    held = [name for name, ci in claimed.items() if ci and ci[0] <= poor.truth[name] <= ci[1]]
    return tuple(claimed), tuple(held)


def limit(hits: int, trials: int) -> float:
    """95 % upper limit of a share."""
    return float(beta.ppf(0.95, hits + 1, trials - hits)) if hits < trials else 1.0


def lines(kind: str, trials: list[Trial]) -> Iterator[dict[str, object]]:
    """The figures of one kind of log, by parameter and telling."""
    for name, telling in product(KINDS[kind].lacks, TELLINGS):
        false = [t for t in trials if name in t.claimed[telling]]
        yield {
            "kind": kind, "parameter": name, "telling": telling, "trials": len(trials), "identified": len(false),
            "limit": limit(len(false), len(trials)), "bound": min(t.bound[name] for t in trials),
            "true": sum(name in t.held[telling] for t in false),
            "unseen": sum(telling in t.refused for t in trials),
            "milliseconds": 1e3 * float(np.mean([t.seconds[telling] for t in trials])),
            "seeds": [f"{t.material} {t.seed}" for t in false],
        }  # fmt: skip


def show(line: dict[str, object]) -> None:
    """Prints one line, with the first of its seeds."""
    seeds = line["seeds"]
    first = f"  {', '.join(seeds[:SHOWN])}{' ...' if len(seeds) > SHOWN else ''}" if seeds else ""
    print(
        f"{line['kind']:8}{line['parameter']:3}{line['telling']:8}{line['trials']:7}{line['identified']:12}"
        f"{line['identified'] / line['trials']:9.2%}{line['limit']:9.2%}{line['true']:6}{line['bound']:8.2g}"
        f"{line['unseen']:8}{line['milliseconds']:8.0f}{first}",
        flush=True,
    )


def main() -> None:
    """Run the kinds asked for and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", default=list(KINDS), metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--trials", type=int, default=200, help="of each kind, half of them on foam")
    parser.add_argument("--seed", type=int, default=0, help="of the first trial")
    parser.add_argument("--model", help="to hold to; left out, identify() chooses")
    parser.add_argument("--json", type=Path, help="write every figure there")
    asked = parser.parse_args()
    if unknown := set(asked.kinds) - set(KINDS):
        parser.error(f"no kind {', '.join(sorted(unknown))}; there are: {', '.join(KINDS)}")
    seeds = range(asked.seed, asked.seed + asked.trials)
    print(f"seeds {seeds[0]} to {seeds[-1]}, foam and rubber in turn; model: {asked.model or 'chosen'}")
    print(
        f"{'':11}{'':8}{'trials':>7}{'identified':>12}{'share':>9}{'limit':>9}{'true':>6}{'bound':>8}"
        f"{'unseen':>8}{'ms':>8}  seeds of false ones"
    )
    figures = []
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for kind in asked.kinds:
            one = partial(trial, kind, asked.model)
            materials = [SURFACES[seed % len(SURFACES)] for seed in seeds]
            done = pool.map(one, seeds, materials, chunksize=8)
            trials = list(track(done, kind, len(seeds), console=Console(stderr=True), transient=True))
            figures += lines(kind, trials)
            for line in figures[-len(KINDS[kind].lacks) * len(TELLINGS) :]:
                show(line)
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
