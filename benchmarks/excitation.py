"""Designed excitations on the bench: the observed spread of the estimates over the predicted one.

    python benchmarks/excitation.py             # 20 runs of each

Columns: predicted standard deviation over the truth, and the observed one over the predicted.
20 s of 15 N with 5 N to each side, on foam and on rubber; noise and phase of the force sensor's clock are drawn anew
for each run, the lag is calibrated. The position is that of a sensor at the tip, or the one that the arm computes from
its encoders, whose wrist is coarse.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from palpate.bench import build, load
from palpate.bench.tables import parse, with_values
from palpate.excitation import Budget, Design, DesignProblem, HybridLoop, SurfaceRange, design
from palpate.excitation.report import experiment
from palpate.identification.contacts import contacts_of
from palpate.identification.descent import Descent
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.identification.options import Options
from palpate.identification.problem import build_problem
from palpate.identification.sampling import channels_of
from palpate.records import Record
from palpate.signals.low_pass import LowPass

RUNS = 20
SURFACES = ("foam", "rubber")
SENSOR = LowPass.parse("butterworth3:120")
START = (0.454, 0.0, 0.0208)
"""Brings the last link along the normal in contact: the coarse encoder of the wrist moves the tip along it little."""
NAMES = ("K", "B", "M")


def designed(name: str) -> Design:
    """The excitation for one of the bench's surfaces, exactly known, under that experiment's gains."""
    own = load(name)
    s, gains = own.surface, own.controller
    surfaces = SurfaceRange(*((value, value) for value in (s.stiffness, s.damping, s.mass)))
    loop = HybridLoop(gain=gains.kf, integral=1000 * gains.ki)
    asked = dict.fromkeys(NAMES, 0.1)
    return design(DesignProblem(surfaces, Budget(15.0, 20.0), asked, loop=loop, duration=20.0))


def errors(design_: Design, seed: int) -> dict[str, NDArray[np.float64]]:
    """Relative errors of K, B and M in one run, by the sensor of the position."""
    rng = np.random.default_rng(seed)
    change = {"force_sensor.phase": float(rng.uniform(0, 1 / 480)), "robot.start": START}
    asked = with_values(parse(experiment(design_), "the design"), change)
    run = build(asked).run(asked.run.duration, seed=seed, press=asked.run.press)
    rows = np.flatnonzero(run["phase"] == 1.0)
    rows = rows[rows >= rows[0] + round(1000 * design_.problem.settle)]
    step = design_.problem.sensors.position_step
    positions = {"tip": np.round(run["x"][rows] / step) * step, "arm": run["x_measured"][rows]}
    truth = np.array(design_.predictions[0].surface.values)
    return {at: identified(run, rows, position) / truth - 1 for at, position in positions.items()}


def identified(run: Record, rows: NDArray[np.intp], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """K, B and M by least squares in time over the rows in contact, behind the sensor's own low-pass."""
    columns = {"time": run["t"][rows], "position": position, "force": run["force_sampled"][rows]}
    lag = SENSOR.lag + run.meta["instruments"]["force"]["delay_s"]
    options = Options.of(lag=lag, force_filter=SENSOR, bonded=True)
    log = Record(columns, {"time": "s", "position": "m", "force": "N"})
    channels, chain, contacts = contacts_of(channels_of(log), options)
    pressed = build_problem(channels, chain, contacts, options)
    return Descent(KELVIN_VOIGT_MASS, pressed.motion, pressed.force, lag).at({}).theta[:3]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--surfaces", nargs="+", default=SURFACES, choices=SURFACES)
    asked = parser.parse_args()
    print("| | position from | " + " | ".join(NAMES) + " |")
    print("|---|---|" + "---|" * len(NAMES))
    for name in asked.surfaces:
        made = designed(f"{name}-hybrid")
        predicted = np.array([made.worst()[parameter] for parameter in NAMES]) / 1.96
        tried = [errors(made, seed) for seed in range(asked.runs)]
        for at in tried[0]:
            rms = np.sqrt(np.mean([np.square(one[at]) for one in tried], axis=0))
            cells = [f"{p:.2%}, {r / p:.2f}" for p, r in zip(predicted, rms, strict=True)]
            print(f"| {name} | the {at} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
