"""How often a press at constant speed is seen, and its tangent holds, by each constant that decides on it.

    python benchmarks/identification/press_constants.py --worlds 60 --seed 700

Presses of `plain_presses.py`, and logs of the foreign simulator that are shaken. For each value of a constant: how many
of the presses are taken for one (seen), in how many of these the 95 % interval of the tangent holds the truth (hold);
of the shaken logs, how many are taken for a press (taken), and in how many of these the tangent there holds (hold). Of
the constant of the tangents beside these, the tangents are counted instead of the presses. The value in use is marked.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "oracles"))

from foreign.logs import CELLS, Log, make_log
from foreign.scoring import record_of, working_truth
from plain_presses import World, world_of

from palpate.errors import InputError
from palpate.identification import steady_press, strokes
from palpate.identification.contacts import Contacts, contacts_of
from palpate.identification.options import OPTION_NAMES, Options
from palpate.identification.sampling import Channels, channels_of

VALUES: dict[str, tuple[float, ...]] = {
    "MIN_STROKE_REACH": (0.05, 0.1, 0.2, 0.4),
    "_END_FRACTION": (0.005, 0.01, 0.02, 0.05, 0.1),
    "_MIN_SPEED_RATIO": (0.1, 0.2, 0.4, 0.6, 0.8),
    "_MAX_MIDDLE_SPEED_RATIO": (1.1, 1.3, 1.5, 1.8, 3.0),
    "_REST_SPEED_RATIO": (0.0, 0.05, 0.1, 0.3),
    "_MIN_STROKE_FRACTION": (0.4, 0.6, 0.8, 0.95),
    "_MIN_TRAVEL_STDS": (3.0, 5.0, 8.0, 16.0),
    "HALF_WINDOW": (0.1, 0.15, 0.2, 0.3),
}
Case = tuple[Channels, Options, Callable[[Contacts, float], tuple[float, float] | None]]


def pressed(world: World, seed: int) -> Case:
    """A press, and its true tangent at a force by what was found of it."""

    def truth(contacts: Contacts, force: float) -> tuple[float, float] | None:
        codes = {warn.code.word for warn in contacts.warnings}
        sign = -1.0 if "force-sign-reversed" in codes else 1.0
        slope = world.tangent(force, sign, not contacts.bonded)
        return None if slope is None else (slope, slope)

    record = world.log(np.random.default_rng([seed, 0]))
    return channels_of(record), Options.of(**world.told), truth


def shaken(log: Log) -> Case:
    """A log of the foreign simulator, and its true tangent at a force."""
    told = {name: value for name, value in log.options.items() if name in OPTION_NAMES}

    def truth(_: Contacts, force: float) -> tuple[float, float] | None:
        return working_truth(log, "press", None, force)

    return channels_of(record_of(log)), Options.of(**told), truth


def count(cases: list[Case], beside: bool) -> tuple[int, int]:
    """How many of some logs are taken for a press, and in how many of these the tangent holds; or of those beside."""
    seen = holds = 0
    for channels, options, truth_of in cases:
        try:
            contacts = contacts_of(channels, options)[2]
        except InputError:
            continue
        if contacts.press is None:
            continue
        for slopes in contacts.press.others if beside else (contacts.press.headline,):
            own, truth = slopes.stiffness, truth_of(contacts, slopes.force)
            seen += 1
            holds += (
                truth is not None and own.value - own.half <= truth[1] and own.value + own.half >= truth[0]
            )
    return seen, holds


def cases_of(make: Callable[[Any], Case], every: list[Any]) -> list[Case]:
    """The logs that can be read."""
    found = []
    for own in every:
        try:
            found.append(make(own))
        except InputError:
            continue
    return found


def main() -> None:
    """Print a row for each value of each constant."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--worlds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=700)
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.worlds)
    presses = cases_of(lambda seed: pressed(world_of(seed), seed), [*seeds])
    cells = CELLS[:: max(len(CELLS) // asked.worlds, 1)]
    others = cases_of(lambda own: shaken(make_log(*own)), [(cell, asked.seed) for cell in cells])
    print(f"{len(presses)} presses, {len(others)} shaken logs, from seed {asked.seed} on")
    for name, values in track(VALUES.items(), "constants", console=Console(stderr=True), transient=True):
        modules = [module for module in (strokes, steady_press) if hasattr(module, name)]
        own = getattr(modules[0], name)
        for value in values:
            for module in modules:
                setattr(module, name, value)
            mark = "*" if np.isclose(value, own) else " "
            (seen, hold), (taken, held) = (count(logs, name == "HALF_WINDOW") for logs in (presses, others))
            print(
                f"{mark} {name.strip('_').lower():8} {value:<5g} seen {seen:3d} hold {hold:3d}"
                f"   taken {taken:3d} hold {held:3d}", flush=True,
            )  # fmt: skip
        for module in modules:
            setattr(module, name, own)


if __name__ == "__main__":
    main()
