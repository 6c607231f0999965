"""Largest stiffness on which hybrid control of the thesis' arm is stable, by the gains and the surface's damping.

    python benchmarks/stable_stiffness.py           # seven minutes

A surface of 0.05 kg, the tip at 0.469 m under 20 N. "A tip by itself" is the force loop in one direction: an arm whose
rotors weigh nothing, and a wall without friction along it. "Joints stuck" are held by their friction at rest.
"""

from __future__ import annotations

import argparse
from itertools import product

from palpate.bench import load
from palpate.bench.tables import Experiment, with_values
from palpate.studies.analysis import stable_stiffness

AT, LOW, HIGH = 0.469, 1e3, 3e6  # m, N/m
DAMPING, GAINS = (60.0, 480.0), ((1.0, 0.003), (0.25, 0.0015))
ALONE = {"robot.rotor_inertia": (0.0, 0.0, 0.0), "wall.side_friction": 0.0}


def experiment(damping: float, gain: float, integral: float) -> Experiment:
    """Hybrid control of a surface with a damping [N s/m], a force gain and an integral gain per tick."""
    surface = {"surface.damping": damping, "surface.mass": 0.05}
    return with_values(load("foam-hybrid"), {**surface, "controller.kf": gain, "controller.ki": integral})


def limit(of: Experiment, friction: bool = False) -> str:
    """The upper end of the first stable interval [kN/m], as a cell of the table."""
    high = stable_stiffness(of, LOW, HIGH, x=AT, force=20.0, friction=friction)[1]
    return f"over {1e-3 * HIGH:.0f}" if high >= HIGH else f"{1e-3 * high:.3g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=4, help="so many of the four, from the first on")
    cases = list(product(DAMPING, GAINS))[: parser.parse_args().cases]
    print("| B_e [N s/m] | K_fp, K_fi | stable up to [kN/m] | a tip by itself [kN/m] | joints stuck [kN/m] |")
    print("|---|---|---|---|---|")
    for damping, (gain, integral) in cases:
        own = experiment(damping, gain, integral)
        limits = limit(own), limit(with_values(own, ALONE)), limit(own, friction=True)
        print(f"| {damping:g} | {gain:g}, {integral:g} | {' | '.join(limits)} |")


if __name__ == "__main__":
    main()
