"""How often free motion is found right, by each constant that decides on it.

    python benchmarks/identification/free_motion_constants.py --trials 2 --seed 40

Logs of the foreign simulator, clean, with a tool's payload, and such as never leave the surface. For each value of a
constant: of the logs with more than a second out of contact, how many show free motion (found); of those that never
leave, how many do so wrongly (false); of those with a payload, how many show one of its sign (payload); and how many
show one where there is none (invented). The value in use is marked.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "oracles"))

from foreign.logs import Cell, Log, make_log
from foreign.scoring import record_of

from palpate.errors import InputError
from palpate.identification import free_motion
from palpate.identification.contacts import contacts_of
from palpate.identification.options import Options
from palpate.identification.sampling import channels_of

SURFACES = ("kelvin-voigt", "mass", "arms", "hunt-crossley", "stiffening", "friction", "plastic")
NUISANCES = ("clean", "payload", "never-leaves")
VALUES: dict[tuple[Any, str], tuple[Any, ...]] = {
    (free_motion, "MAX_SLOPE_RATIO"): (0.1, 0.2, 0.4, 0.6, 0.8),
    (free_motion, "_MIN_FRACTION_RATIO"): (1.0, 1.5, 2.0, 4.0),
    (free_motion, "_MAX_NOISE_STDS"): (3.0, 5.0, 8.0),
    (free_motion, "_MIN_EXPLAINED_POWER"): (0.3, 0.5, 0.7, 0.9),
    (free_motion, "_MIN_ADVANTAGE"): (1.0, 1.5, 2.0, 4.0),
}


@dataclass(frozen=True)
class Found:
    """Of one log: a second out of contact, any at all, the payload [kg]; free motion and payload as found."""

    air: bool
    leaves: bool
    payload: float
    found_air: bool
    found_payload: float


def found_in(log: Log) -> Found | None:
    """What the contacts of a log show; None if it is refused."""
    told = {name: value for name, value in log.options.items() if name in Options.__dataclass_fields__}
    free = ~log.dense.contact
    travels = bool(free.sum() * log.dense.dt > 1.0)
    try:
        contacts = contacts_of(channels_of(record_of(log)), Options.of(**told))[2]
    except InputError:
        return None
    carried = log.plan.recording.payload
    seen = contacts.payload.mass if contacts.payload else 0.0
    return Found(travels, bool(free.any()), carried, not contacts.bonded, seen)


def row(every: list[Found]) -> str:
    """The four shares."""
    air = [f for f in every if f.air]
    never = [f for f in every if not f.leaves]
    loaded = [f for f in air if f.payload]
    bare = [f for f in every if not f.payload]
    parts = (
        ("found", sum(f.found_air for f in air), len(air)),
        ("false", sum(f.found_air for f in never), len(never)),
        ("payload", sum(f.found_payload * f.payload > 0 for f in loaded), len(loaded)),
        ("invented", sum(f.found_payload != 0 for f in bare), len(bare)),
    )
    return "  ".join(f"{name} {count:3d} of {of:3d}" for name, count, of in parts)


def main() -> None:
    """Print a row for each value of each constant."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--trials", type=int, default=2, help="logs of each surface and nuisance")
    parser.add_argument("--seed", type=int, default=40)
    parser.add_argument("--surfaces", nargs="+", choices=SURFACES, default=SURFACES)
    asked = parser.parse_args()
    cells = [Cell(surface, nuisance) for surface in asked.surfaces for nuisance in NUISANCES]
    seeds = range(asked.seed, asked.seed + asked.trials)
    console = Console(stderr=True)
    logs = [make_log(c, s) for c in track(cells, "logs", console=console, transient=True) for s in seeds]
    print(f"{len(logs)} logs, seeds {seeds[0]} to {seeds[-1]}")
    for (module, name), values in track(VALUES.items(), "constants", console=console, transient=True):
        own = getattr(module, name)
        for value in values:
            setattr(module, name, value)
            mark = "*" if np.isclose(value, own) else " "
            every = [found for log in logs if (found := found_in(log)) is not None]
            print(f"{mark} {name.strip('_').lower():9} {value:<4g} {row(every)}", flush=True)
        setattr(module, name, own)


if __name__ == "__main__":
    main()
