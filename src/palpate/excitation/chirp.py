"""A sweep between the two most informative frequencies."""

from __future__ import annotations

from itertools import product

import numpy as np

from palpate.arrays import Array
from palpate.excitation.budget import used_up
from palpate.excitation.prediction import Made, Prediction
from palpate.excitation.problem import Problem
from palpate.excitation.rounding import error_of_sweep
from palpate.references.waves import Chirp

_ENDS = 6  # places for each end of the sweep
_FINE = 64  # frequencies of a sweep that are looked at


def make(problem: Problem, seconds: float) -> Made:
    """The best sweep of so many seconds: from where to where, and whether evenly or logarithmically."""
    budget = problem.budget
    grid = np.geomspace(budget.lowest, budget.highest, _ENDS)
    sweeps = [
        Chirp(float(low), float(high), seconds, 1.0, logarithmic)
        for low, high, logarithmic in product(grid, grid, (False, True))
        if low < high and low * seconds >= 1
    ] or [Chirp(budget.lowest, budget.highest, seconds, 1.0, False)]
    made = (_predicted(problem, _within_budget(problem, sweep)) for sweep in sweeps)
    return min(made, key=lambda found: found.excess(seconds, problem.precision))


def _frequencies(sweep: Chirp) -> Array:
    """Frequencies of the sweep at even times [rad/s], shape (_FINE,)."""
    share = (np.arange(_FINE) + 0.5) / _FINE
    if sweep.logarithmic:
        return 2 * np.pi * sweep.low * (sweep.high / sweep.low) ** share
    return 2 * np.pi * (sweep.low + share * (sweep.high - sweep.low))


def _within_budget(problem: Problem, sweep: Chirp) -> Chirp:
    omega = _frequencies(sweep)

    def share(amplitude: float) -> float:
        felt = float(np.abs(problem.forces(omega, np.full(_FINE, amplitude))).max())
        return min(_share(problem, sweep._replace(amplitude=amplitude)), problem.budget.swing / felt)

    return sweep._replace(amplitude=used_up(share, problem.budget.desired_swing))


def _share(problem: Problem, sweep: Chirp) -> float:
    return problem.budget.share(sweep.amplitude, 2 * np.pi * sweep.high * sweep.amplitude)


def _predicted(problem: Problem, sweep: Chirp) -> Made:
    omega = _frequencies(sweep)
    forces = problem.forces(omega, np.full(_FINE, sweep.amplitude))
    sensors, predictions = problem.sensors, []
    for surface, force in zip(problem.surfaces.surfaces(), forces, strict=True):
        motion = force / surface.impedance(omega)
        error = error_of_sweep(motion, omega, sweep.seconds, sensors.rate, sensors.position_step)
        known = problem.predicted(surface, omega, force, error, sweep.seconds, together=False)
        felt = float(np.abs(force).max())
        travel = 2 * float(np.abs(force / surface.impedance(omega)).max())
        between = (problem.budget.mean - felt, problem.budget.mean + felt)
        predictions.append(
            Prediction(surface, problem.surfaces.names, known[0], problem.prior, *known[1:], between, travel)
        )
    return Made(sweep, tuple(predictions), gap=0.0)
