"""What is predicted before the arm moves is what is found after it has: runs of the bench, identified."""

from __future__ import annotations

import numpy as np
import pytest

from identification.problems import problem
from palpate.bench import build
from palpate.bench.tables import parse, with_values
from palpate.excitation import Budget, DesignProblem, SurfaceRange, design
from palpate.excitation.report import experiment
from palpate.identification.descent import Descent
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.records import Record
from palpate.signals.low_pass import LowPass

FOAM = {"K": 5200.0, "B": 200.0, "M": 0.1}
RUNS = 8


@pytest.mark.long
def test_the_spread_over_seeds_is_the_predicted_one():
    surfaces = SurfaceRange(*((value, value) for value in FOAM.values()))
    found = design(DesignProblem(surfaces, Budget(15.0, 20.0), dict.fromkeys("KBM", 0.1), duration=10.0))
    asked = parse(experiment(found), "the design")
    sensor = LowPass.parse("butterworth3:120")
    rng = np.random.default_rng(5)
    values = []
    for seed in range(RUNS):
        phase = {"force_sensor.phase": float(rng.uniform(0, 1 / 480))}
        run = build(with_values(asked, phase)).run(asked.run.duration, seed=seed, press=asked.run.press)
        rows = np.flatnonzero(run["phase"] == 1.0)
        rows = rows[rows >= rows[0] + round(1000 * found.problem.settle)]
        # A position sensor at the tip; the arm's own angles bend the motion in ways of their own.
        position = np.round(run["x"][rows] / 1.6e-6) * 1.6e-6
        columns = {"time": run["t"][rows], "position": position, "force": run["force_sampled"][rows]}
        lag = sensor.lag + run.meta["instruments"]["force"]["delay_s"]
        record = Record(columns, {"time": "s", "position": "m", "force": "N"})
        pressed = problem(record, lag, force_filter=sensor, bonded=True)
        fit = Descent(KELVIN_VOIGT_MASS, pressed.motion, pressed.force, lag).at({})
        values.append([value / FOAM[name] - 1 for name, value in zip("KBM", fit.theta, strict=False)])
    predicted = [found.worst()[name] / 1.96 for name in FOAM]
    ratio = np.sqrt(np.mean(np.square(values), axis=0)) / predicted
    # Eight runs know a standard deviation to a quarter.
    assert (ratio > 0.5).all(), ratio
    assert (ratio < 1.5).all(), ratio
