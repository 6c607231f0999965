"""Designed excitations on the bench: the observed spread of the estimates over the predicted one.

    python benchmarks/excitation.py [RUNS]

20 s of 15 N with 5 N to each side, on foam and on rubber; noise and phase of the force sensor's clock are drawn anew
for each run, the lag is calibrated. The position is that of a sensor at the tip, or the one that the arm computes from
its encoders, whose wrist is coarse.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from palpate.bench import build, load
from palpate.bench.tables import changed, parse
from palpate.identification import identify
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate_excitation import Budget, Design, HybridLoop, Problem, SurfaceRange, design
from palpate_excitation.report.table import experiment

RUNS = 20
SENSOR = LowPass.parse("butterworth3:120")
START = (0.454, 0.0, 0.0208)
"""Brings the last link along the normal in contact: the coarse encoder of the wrist moves the tip along it little."""
NAMES = ("K", "B", "M")


def designed(name: str, kind: str) -> Design:
    """The excitation for one of the bench's surfaces, exactly known, under that experiment's gains."""
    own = load(name)
    s, gains = own.surface, own.controller
    surfaces = SurfaceRange(*((value, value) for value in (s.stiffness, s.damping, s.mass)))
    loop = HybridLoop(gain=gains.kf, integral=1000 * gains.ki)
    asked = dict.fromkeys(NAMES, 0.1)
    return design(Problem(surfaces, Budget(15.0, 20.0), asked, loop=loop, kind=kind, duration=20.0))


def errors(design_: Design, seed: int) -> dict[str, NDArray[np.float64]]:
    """Relative errors of K, B and M in one run, by the sensor of the position."""
    rng = np.random.default_rng(seed)
    change = {"force_sensor.phase": float(rng.uniform(0, 1 / 480)), "robot.start": START}
    asked = changed(parse(experiment(design_), "the design"), change)
    run = build(asked).run(asked.run.duration, seed=seed, press=asked.run.press)
    rows = np.flatnonzero(run["phase"] == 1.0)
    rows = rows[rows >= rows[0] + round(1000 * design_.settle)]
    step = design_.problem.sensors.position_step
    positions = {"tip": np.round(run["x"][rows] / step) * step, "arm": run["x_measured"][rows]}
    truth = np.array(design_.predictions[0].surface.values)
    return {at: identified(run, rows, position) / truth - 1 for at, position in positions.items()}


def identified(run: Record, rows: NDArray[np.intp], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """K, B and M by the log of a run, before any verdict."""
    columns = {"time": run["t"][rows], "position": position, "force": run["force_sampled"][rows]}
    told = identify(
        Record(columns, {"time": "s", "position": "m", "force": "N"}),
        model="kelvin-voigt-mass",
        force_filter=SENSOR,
        lag=SENSOR.lag + run.meta["instruments"]["force"]["delay_s"],
        bonded=True,
    ).estimate
    if told is None:
        raise RuntimeError("nothing was found to identify")
    return told.theta[[told.names.index(name) for name in NAMES]]


def main(runs: int) -> None:
    """Print a row for each surface, kind and sensor: the predicted deviation, the observed one, their ratio."""
    print(f"{'':34}" + "".join(f"{name:^32}" for name in NAMES))
    for name in ("foam-hybrid", "rubber-hybrid"):
        for kind in ("multisine", "chirp"):
            made = designed(name, kind)
            predicted = np.array([made.made.worst(made.seconds)[name] for name in NAMES]) / 1.96
            tried = [errors(made, seed) for seed in range(runs)]
            for at in tried[0]:
                rms = np.sqrt(np.mean([np.square(one[at]) for one in tried], axis=0))
                cells = (f"{a:7.2%} {b:7.2%} ratio {b / a:4.2f}" for a, b in zip(predicted, rms, strict=True))
                print(f"{f'{name}, {kind}, {at}':34}" + "".join(f"{cell:^32}" for cell in cells))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
