"""The test of force control (`palpate benchmark force --shipped`) as tables: an arm, then a row a controller.

python benchmarks/force/metrics.py [--arms ur5e fr3] [--surfaces 5] [--repeats 20] [--seed 0] [--controllers NAME ...]
"""

from __future__ import annotations

import argparse

from rich.progress import track

from palpate_benchmark.entry import ForceEntry, shipped_controllers
from palpate_benchmark.simulated import Surfaces, press_surfaces
from palpate_benchmark.summary import leaderboard

FORCE = 20.0


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--surfaces", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--controllers", nargs="+", help="all that are shipped, if left out")
    asked = parser.parse_args()
    surfaces = Surfaces(count=asked.surfaces, repeats=asked.repeats, seed=asked.seed)
    for arm in asked.arms:
        entries = [
            ForceEntry({"kind": name}, arm=arm) for name in asked.controllers or shipped_controllers(arm)
        ]
        results = [press_surfaces(e, FORCE, surfaces) for e in track(entries, arm, transient=True)]
        table = leaderboard(results)
        print(f"### {results[0].arm}")
        for row in (table.head, ["---"] * len(table.head), *table.rows):
            print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
