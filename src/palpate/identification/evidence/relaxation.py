"""Relaxation of the force while the probe is held."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.loadings import FEWEST, STILL
from palpate.identification.evidence.slope import Slope
from palpate.identification.least_squares import noise_of
from palpate.identification.problem import Problem
from palpate.identification.result import Relaxation
from palpate.signals.samples import runs


def relaxation(
    problem: Problem, lag: float, segments: list[Segment], slope: Slope | None
) -> Relaxation | None:
    """Of the longest hold after a loading, what the position gives back by its slope left aside."""
    depth = problem.motion.moved(0, lag)
    speed, force, time = problem.motion.moved(1, lag), problem.force, problem.time
    still = np.abs(speed) < STILL * float(np.percentile(np.abs(speed), 98))
    best: tuple[int, int] | None = None
    for s in segments:
        for a, b in runs(still[s.first : s.last]):
            if b - a >= 4 * FEWEST and a > 0 and (best is None or b - a > best[1] - best[0]):
                best = (s.first + a, s.first + b)
    if best is None:
        return None
    rows = slice(*best)
    moved = depth[rows] - depth[best[1] - 1]
    given, doubt = (0.0 * moved, 0.0) if slope is None else (slope.stiffness * moved, slope.half)
    return _relaxed(force[rows] - given, doubt * float(np.ptp(moved)), time[rows])


def _relaxed(force: Array, doubt: float, time: Array) -> Relaxation | None:
    """Relaxation of a force in a hold, as a monotone fall; None if that is within its noise and uncertainty.

    Args:
        force: less what the position gives back meanwhile, shape (n,) [N].
        doubt: what is not known of that [N].
        time: shape (n,) [s].
    """
    from scipy.optimize import isotonic_regression

    falls = np.asarray(isotonic_regression(force, increasing=False).x)
    noise = noise_of(force - falls, np.arange(len(force)), 2)
    few = max(len(force) // 20, 2)
    begin, end = float(np.median(falls[:few])), float(np.median(falls[-few:]))
    least = np.hypot(2 * np.sqrt(2 * noise.variance * len(force) / noise.effective / few), doubt)
    if begin <= 0 or begin - end <= least:
        return None
    half = int(np.argmax(falls <= (begin + end) / 2))
    return Relaxation((begin - end) / begin, float(time[half] - time[0]), float(time[-1] - time[0]))
