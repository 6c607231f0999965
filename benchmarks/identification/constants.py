"""What an answer owes to each constant of identification: every number is halved and doubled in turn.

    python benchmarks/identification/constants.py --logs 16 --presses 6 --seed 60

Logs of the foreign simulator, one of every so many cells, and plain presses of `plain_presses.py`. A constant is a
number of a module of `palpate.identification`, by an upper-case name; a whole one stays whole. A process of its own
reads the module with the other number, so that whatever is made of it follows. Against the answers as they are: logs in
which K's verdict changes, logs in which K moves by over a tenth of its half-width, logs in which K is identified, and
intervals that miss the truth. A change that ends in an error counts as a changed verdict. Constants that change nothing
are only counted.
"""

from __future__ import annotations

import argparse
import ast
import importlib.util
import math
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1] / "src" / "palpate"
FACTORS = (0.5, 2.0)


class Constant(NamedTuple):
    """A number of a module, by name."""

    module: str
    name: str
    value: float


class Answer(NamedTuple):
    """Of one log: K's verdict, value and half-width; intervals that miss the truth."""

    verdict: str
    value: float
    half: float
    missed: int


def constants() -> list[Constant]:
    """Every number that a module of identification names."""
    found = []
    for path in sorted((ROOT / "identification").rglob("*.py")):
        module = ".".join(("palpate", *path.relative_to(ROOT).with_suffix("").parts))
        assigned = (node for node in ast.parse(path.read_text()).body if isinstance(node, ast.Assign))
        found += [Constant(module, *own) for node in assigned if (own := _number(node)) is not None]
    return found


def _number(node: ast.Assign) -> tuple[str, float] | None:
    [target], value = node.targets[:1], node.value
    if isinstance(target, ast.Name) and target.id.isupper() and isinstance(value, ast.Constant):
        number = value.value
        if isinstance(number, int | float) and not isinstance(number, bool):
            return target.id, number
    return None


class Loader(SourceFileLoader):
    """A module in which one number is another."""

    def __init__(self, constant: Constant, value: float) -> None:
        path = ROOT.parent.joinpath(*constant.module.split(".")).with_suffix(".py")
        super().__init__(constant.module, str(path))
        self._constant, self._value = constant, value

    def get_code(self, fullname: str) -> Any:
        tree = ast.parse(self.get_data(self.path))
        for node in tree.body:
            if isinstance(node, ast.Assign) and (own := _number(node)) and own[0] == self._constant.name:
                node.value = ast.copy_location(ast.Constant(self._value), node.value)
        return compile(tree, self.path, "exec")


class Finder(MetaPathFinder):
    """Finds that one module."""

    def __init__(self, constant: Constant, value: float) -> None:
        self._module, self._loader = constant.module, Loader(constant, value)

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if fullname != self._module:
            return None
        return importlib.util.spec_from_file_location(fullname, self._loader.path, loader=self._loader)


def answers(logs: int, presses: int, seed: int, changed: tuple[Constant, float] | None) -> list[Answer]:
    """The answers to the logs, by a process that has read no module yet, with a constant changed or as it is."""
    if changed is not None:
        sys.meta_path.insert(0, Finder(*changed))
    sys.path[:0] = [str(HERE), str(HERE.parents[1] / "tests" / "oracles")]
    import numpy as np
    from foreign.logs import CELLS, make_log
    from foreign.scoring import judge_found, record_of
    from plain_presses import judged, world_of

    from palpate.errors import InputError
    from palpate.identification import identify

    def answer(record: Any, told: Any, misses: Any) -> Answer:
        try:
            found = identify(record, **told)
        except InputError:
            return Answer("refused", math.nan, math.nan, 0)
        low, high = found.K.ci95 or (math.nan, math.nan)
        return Answer(str(found.K.verdict), found.K.value or math.nan, (high - low) / 2, misses(found))

    every = []
    for cell in CELLS[:: -(-len(CELLS) // logs)]:
        log = make_log(cell, seed)
        every.append(answer(record_of(log), log.options, lambda found, log=log: len(judge_found(log, found))))
    for own in range(seed, seed + presses):
        world = world_of(own)
        record = world.log(np.random.default_rng([own, 0]))
        every.append(answer(record, world.told, lambda found, world=world: _missed(judged(world, found))))
    return every


def _missed(press: Any) -> int:
    return int(abs(press.value - press.truth) > press.half)


def tried(asked: tuple[int, int, int], change: tuple[Constant, float]) -> list[Answer] | str:
    """The answers with a constant changed; an error's text."""
    try:
        return answers(*asked, change)
    except Exception as error:  # noqa: BLE001 - a number that breaks the code is a finding
        return f"{type(error).__name__}: {error}"


def cells_of(asked: list[Answer], found: list[Answer] | str) -> tuple[str, ...] | None:
    """What a change did: verdicts, moves, identified, missed; None for nothing."""
    if isinstance(found, str):
        return (found.splitlines()[0][:60], "-", "-", "-")
    both = list(zip(asked, found, strict=True))
    verdicts = sum(a.verdict != b.verdict for a, b in both)
    moved = sum(
        abs(a.value - b.value) > 0.1 * a.half or not 0.9 < b.half / a.half < 1.1
        for a, b in both
        if a.half > 0
    )
    if not verdicts and not moved:
        return None
    known = sum(b.verdict == "identified" for b in found)
    return str(verdicts), str(moved), str(known), str(sum(b.missed for b in found))


def main() -> None:
    """Print a row for each change that changes an answer."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--logs", type=int, default=16, help="of the foreign simulator, about")
    parser.add_argument("--presses", type=int, default=6)
    parser.add_argument("--seed", type=int, default=60)
    parser.add_argument("--only", default="", help="constants whose module or name has this in it")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    counts = asked.logs, asked.presses, asked.seed
    every = [c for c in constants() if asked.only in f"{c.module}.{c.name}"]
    changes = [(c, v) for c in every for f in FACTORS if (v := _other(c.value, f)) != c.value]
    context = get_context("spawn")
    with ProcessPoolExecutor(asked.jobs, mp_context=context, max_tasks_per_child=1) as pool:
        plain = pool.submit(answers, *counts, None)
        done = pool.map(partial(tried, counts), changes)
        base = plain.result()
        known, missed = sum(a.verdict == "identified" for a in base), sum(a.missed for a in base)
        print(
            "| constant | value | another | verdicts that change | K that moves | K identified | intervals missed |"
        )
        print("| --- | --- | --- | --- | --- | --- | --- |")
        print(f"| as they are | | | | | {known} of {len(base)} | {missed} |")
        moving = set()
        for (constant, value), found in zip(changes, done, strict=True):
            if (cells := cells_of(base, found)) is not None:
                moving.add(constant)
                where = f"{constant.module.removeprefix('palpate.identification.')}.{constant.name}"
                print(f"| `{where}` | {constant.value:g} | {value:g} | {' | '.join(cells)} |", flush=True)
    print(f"\n{len(every) - len(moving)} of {len(every)} constants change no answer when halved or doubled.")


def _other(value: float, factor: float) -> float:
    other = value * factor
    return max(round(other), 1) if isinstance(value, int) else other


if __name__ == "__main__":
    main()
