"""Judge `palpate.identify` by logs of a simulator that shares nothing with the project's bench.

    python tests/oracles/foreign/judge.py --trials 3
    python tests/oracles/foreign/judge.py --cells '^mass/(drift|jitter)' --trials 20 --json scores.json
    python tests/oracles/foreign/judge.py --show 7/mass/drift --save-log drift.csv

A cell is a surface, a nuisance and a motion (any: drawn). "id hold wrong": how many parameters were called identified,
the share of their 95 % intervals that hold the truth, how many are confidently wrong (more than 25 % off, or more than
three half-widths and 2 %). "apparent" is what a linear model says of a surface that has no such number: it holds if the
interval meets the range of what the surface does over the depths touched. "K known" is how often K is identified of the
logs in which an estimator that knows model, lag, low-pass and noise has it to 5 %, "sharp" how often to three times
that bound or 1 %. "width" is the median half-width of K over that bound, "lag" the lags invented where there is none,
"none" logs without a contact found or refused.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

sys.path.insert(0, str(Path(__file__).parents[1]))

from foreign.logs import CELLS, WORLD_CELLS, Cell, make_log
from foreign.scoring import Score, record_of, score
from foreign.tables import HEAD, line, markdown, summary, tables
from palpate.identification import identify


def main() -> None:
    """Run the cells asked for and print the tables; or show one log."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--trials", type=int, default=3, help="logs of each cell")
    parser.add_argument("--seed", type=int, default=0, help="of the first log of each cell")
    parser.add_argument("--cells", default="", help="regular expression: SURFACE/NUISANCE/any")
    parser.add_argument(
        "--worlds", action="store_true", help="causes that are no sensor's noise, instead of the nuisances"
    )
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--json", type=Path, help="write every score and every table there")
    parser.add_argument("--markdown", action="store_true", help="print the tables as a document has them")
    parser.add_argument(
        "--show", help="SEED/SURFACE/NUISANCE[/MOTION]: one log, its truth, options and answer"
    )
    parser.add_argument("--save-log", type=Path, help="with --show, write the log there as CSV")
    asked = parser.parse_args()
    if asked.show:
        show(asked.show, asked.save_log)
        return
    cells = [cell for cell in (WORLD_CELLS if asked.worlds else CELLS) if re.search(asked.cells, str(cell))]
    if not cells:
        parser.error(f"no cell matches {asked.cells!r}; there are {CELLS[0]}, {CELLS[1]}, ...")
    if asked.trials < 1:
        parser.error(f"--trials must be 1 or more, got {asked.trials}")
    scores = judged(cells, range(asked.seed, asked.seed + asked.trials), asked.workers)
    command = f"tests/oracles/foreign/judge.py --trials {asked.trials} --seed {asked.seed}"
    command += f" --cells '{asked.cells}'" if asked.cells else ""
    command += " --worlds" if asked.worlds else ""
    every = tables(scores)
    if asked.markdown:
        print(markdown(scores))
    else:
        for name, rows in every.items():
            print(f"\n{name}\n{HEAD}", *(line(figures) for figures in rows), sep="\n")
        print(f"\n{len(scores)} of {len(cells) * asked.trials} logs, {command}", *summary(scores), sep="\n")
    if asked.json:
        found = {"command": command, "scores": [s.to_json() for s in scores], "tables": every}
        asked.json.write_text(json.dumps(found, indent=1))
    if len(scores) < len(cells) * asked.trials:
        sys.exit(130)


def judged(cells: list[Cell], seeds: range, workers: int) -> list[Score]:
    """The scores of all logs, in their order; of those done, if the user interrupts or ends the program."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    order = {(str(c), s): i for i, (c, s) in enumerate((c, s) for s in seeds for c in cells)}
    done: list[Score] = []
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=_deaf) as pool:
        jobs = [pool.submit(score, c, s) for s in seeds for c in cells]
        console = Console(stderr=True)
        try:
            for job in track(as_completed(jobs), "logs", len(jobs), console=console, transient=True):
                done += [job.result()]
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            console.print(f"interrupted after {len(done)} of {len(jobs)} logs")
    return sorted(done, key=lambda s: order[s.cell, s.seed])


def _deaf() -> None:
    """Workers leave an interrupt to the process that started them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def show(what: str, save: Path | None) -> None:
    """One log: its truth, what is told, and what is answered."""
    seed, *names = what.split("/")
    log = make_log(Cell(*names), int(seed))
    print(*_about(log), sep="\n")
    if save:
        table = np.column_stack([log.time, log.position, log.force])
        np.savetxt(save, table, "%.9g", ",", header="time_s,position_m,force_N", comments="")
    found = identify(record_of(log), **log.options)
    plain = found.to_json()
    print(json.dumps({**plain, "contacts": len(plain["contacts"])}, indent=1, default=str))


def _about(log: object) -> Iterator[str]:
    yield f"surface   {log.plan.surface}"
    yield f"motion    {log.plan.motion}, up to {log.dense.force.max():.3g} N at {1e3 * log.dense.depth.max():.3g} mm"
    yield f"recording {log.plan.recording}"
    yield f"begins    {log.plan.starts}, {'leaves' if log.plan.leaves else 'never leaves'}; {len(log.time)} rows"
    yield f"told      {log.options}"
    yield f"truth     {log.truth}, of the surface's own: {', '.join(sorted(log.defined))}; lag {log.lag}"


if __name__ == "__main__":
    main()
