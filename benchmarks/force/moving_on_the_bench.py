"""The thesis' arm on surfaces that sway, or change under the force: cautious against what the bench has.

    python benchmarks/force/moving_on_the_bench.py [--seeds 3] [--controllers foam-cautious foam-pi ...] [--minutes 3.5]
    python benchmarks/force/moving_on_the_bench.py --seeds 24 --told 18 36 54

20 N asked. Neither the surfaces nor the seeds, from 200 on, were used for tuning; the gains of the others are the
bench's for foam. A sway moves the wall from 2 s after the touch on, its damper feeling the tip's rate alone. A change
keeps force and tip and takes another stiffness, 2 s after the touch. Lost: contact at any time of a run; over: of 20 N,
from then on, mean of 10 ms; kept: within 5 % during the last second. Every run is kept as it ends: the same command
goes on where it stopped.

With `--told`, the hardest change alone: by the cautious law as it is, and where K_u is put at the new stiffness so many
milliseconds after it, which no law knows. theta is 18 ms.
"""

from __future__ import annotations

import argparse
from math import pi, sin, sqrt
from pathlib import Path

import numpy as np
from touches import Key, resumed

from palpate.bench.force_input import COLUMNS
from palpate.bench.from_experiment import build
from palpate.bench.tables import load, with_values
from palpate.environments.surface import alone, join
from palpate.force.law import CautiousState

CONTROLLERS = ("foam-cautious", "foam-hybrid", "foam-pi", "foam-neural")
SWAYS = ((3.5e3, 1e-3, 0.4), (1.3e4, 3e-4, 0.7), (4.5e4, 1e-4, 0.7))
HARDEST = (1.5e3, 1.2e5)
CHANGES = ((4e3, 3e4), (3e4, 4e3), HARDEST, (1.2e5, 1.5e3))
RATIO, MASS, FORCE = 0.2, 0.05, 20.0
MOVES, PRESS, LOOK = 2.0, 6.0, 60.0
JUDGED = ("lost", "over", "rms", "kept")
_FORCE, _PHASE = (list(COLUMNS).index(name) for name in ("force", "phase"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    parser.add_argument("--told", nargs="+", type=int, default=[], metavar="MS")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path, default=Path("runs/moving_on_the_bench.jsonl"))
    told = parser.parse_args()
    seeds = range(200, 200 + told.seeds)
    print(f"{'':<50}  lost   most over   rms of the last second   kept")
    cases = dict(enumerate([*(("sways", c) for c in SWAYS), *(("changes", c) for c in CHANGES)]))
    if told.told:  # numbered by their delay, so that the rows that are kept stay those of their case
        told.controllers, hardest = ("foam-cautious",), len(SWAYS) + CHANGES.index(HARDEST)
        cases = {
            hardest: cases[hardest],
            **{100 + ms: ("changes", (*HARDEST, 1e-3 * ms)) for ms in told.told},
        }

    def run(key: Key) -> dict[str, float]:
        name, seed, case = key
        return dict(zip(JUDGED, one(name, *cases[case], seed), strict=True))

    keys = [(name, seed, i) for name in told.controllers for i in cases for seed in seeds]
    known = resumed(told.out, keys, run, told.minutes)
    for name in told.controllers:
        for i, (what, case) in cases.items():
            found = [row for key, row in known.items() if key[0] == name and key[2] == i]
            if not found:
                continue
            lost, over, rms, kept = (np.array([row[key] for row in found]) for key in JUDGED)
            print(
                f"{name:<16}{words(what, case):<34}{int(lost.sum()):3d} of {len(found)}{100.0 * over.max():8.1f} %"
                f"{np.median(rms):12.2f} N, most {rms.max():.2f}{int(kept.sum()):8d}"
            )


def words(what: str, case: tuple[float, ...]) -> str:
    """A case in words."""
    if what == "sways":
        return f"{case[0] / 1e3:g} kN/m, {1e3 * case[1]:g} mm at {case[2]:g} Hz"
    known = f", told {1e3 * case[2]:g} ms after" if len(case) > 2 else ""
    return f"{case[0] / 1e3:g} -> {case[1] / 1e3:g} kN/m{known}"


def one(name: str, what: str, case: tuple[float, ...], seed: int) -> tuple[float, float, float, float]:
    """Whether contact was lost, largest force over 20 N, rms error of the last second [N], whether it was kept."""
    K = case[0]
    surface = {"kind": "kelvin-voigt", "stiffness": K, "damping": float(2.0 * RATIO * sqrt(K)), "mass": MASS}
    bench = build(with_values(load(name), {"surface": surface, "run.losses": 0}))
    simulation, rows = bench.simulation(seed), []
    wall, moved, told = simulation.loop.plant.wall, np.inf, len(case) == 2 or what == "sways"
    while simulation.since_contact < PRESS and simulation.ticks * bench.loop.tick < LOOK:
        since = simulation.since_contact
        if since >= MOVES and what == "sways":
            put(simulation, wall=wall + case[1] * sin(2.0 * pi * case[2] * (since - MOVES)))
        if since >= MOVES and what == "changes" and moved == np.inf:
            moved = since
            change(simulation, K, case[1])
        if not told and since - moved > case[2] - 0.5 * bench.loop.tick:
            told = True
            simulation.state = knowing(simulation.state, case[1])
        rows.append(simulation.advance(1 if since >= MOVES and (what == "sways" or not told) else 50))
    run = np.concatenate(rows)
    if simulation.contact is None:
        return 1.0, 0.0, np.inf, 0.0
    after = run[simulation.contact + round(MOVES / bench.loop.tick) :]
    smooth = np.convolve(after[:, _FORCE], np.full(10, 0.1), "valid")
    lost = float((run[simulation.contact :, _PHASE] == 2.0).any())
    error = after[-1000:, _FORCE] - FORCE
    kept = float(np.abs(smooth[-990:] - FORCE).max() < 0.05 * FORCE and not lost)
    return lost, float(smooth.max() / FORCE - 1.0), float(np.sqrt(np.mean(error**2))), kept


def put(simulation, **changes) -> None:
    """Another wall, or another surface."""
    plant = simulation.loop.plant._replace(**changes)
    simulation.loop = simulation.loop._replace(plant=plant)


def knowing(state, stiffness: float):
    """The state of a part, the cautious law in it with K_u at this stiffness [N/m]."""
    if isinstance(state, CautiousState):
        return state._replace(bound=state.bound._replace(used=stiffness, held=stiffness))
    parts = {
        name: knowing(value, stiffness)
        for name, value in state._asdict().items()
        if hasattr(value, "_fields")
    }
    return state._replace(**parts)


def change(simulation, K: float, later: float) -> None:
    """Another stiffness and damping; the wall goes to where the spring's force stays as it is."""
    plant, state = simulation.loop.plant, simulation.state
    depth = state.plant.surface.deflection * K / later
    own = alone(plant.surface)._replace(stiffness=later, damping=2.0 * RATIO * sqrt(later))
    put(simulation, surface=join(own), wall=plant.wall + state.plant.surface.deflection - depth)
    touched = state.plant.surface._replace(deflection=depth)
    simulation.state = state._replace(plant=state.plant._replace(surface=touched))


if __name__ == "__main__":
    main()
