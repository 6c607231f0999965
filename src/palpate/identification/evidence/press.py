"""The press: force over depth on the way in and out, its tangents, the work that is lost, and what a hold relaxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.estimators.budget import NORMAL
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.relaxation import relaxation
from palpate.identification.evidence.slope import apart, line, slope_between
from palpate.identification.evidence.strokes import FEWEST, Stroke, of_speed, read_later, strokes_in
from palpate.identification.evidence.work import way_out
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.result import Press, Tangent

_LEVELS = (0.3, 0.5, 0.7, 0.9)

_WIDE = 0.15

_SHOWN = 400


def press_of(problem: Problem, lag: float, segments: list[Segment]) -> Press | None:
    """The press of a log; None without a way in."""
    strokes = strokes_in(problem, lag, segments)
    if not strokes:
        return None
    loading = max(strokes, key=lambda stroke: len(stroke.depth))
    later = read_later(problem, lag, segments, strokes)
    tangent = [t for level in _LEVELS if (t := _tangent(strokes, later, level)) is not None]
    back = way_out(problem, lag, segments)
    return Press(
        tuple(t for t in tangent if t.half < abs(t.stiffness)),
        _thin(loading.depth, loading.force),
        _thin(*back.curve),
        back.loss,
        relaxation(problem, lag, segments, slope_between(strokes, later)),
        back.late,
    )


def _tangent(strokes: list[Stroke], later: list[Stroke], level: float) -> Tangent | None:
    """Slope of the ways in about a share of the force; with it what it moves by if the force is later than assumed.

    Args:
        strokes: the ways in.
        later: the same, the force later by a deviation of the lag's prior.
        level: the share.
    """
    found, other = _tangent_of(strokes, level), _tangent_of(later, level)
    if found is None or other is None:
        return None
    by_lag = NORMAL * (other.stiffness - found.stiffness)
    return replace(found, half=float(np.hypot(found.half, by_lag)))


def _tangent_of(strokes: list[Stroke], level: float) -> Tangent | None:
    slopes, variances, forces, by_speed, by_filter = [], [], [], [], []
    for stroke in strokes:
        loss = of_speed(stroke)
        low, high = np.percentile(stroke.force, [2, 98])
        rows = _about(stroke.force, low, high, level)
        if len(rows) < FEWEST or np.ptp(stroke.depth[rows]) <= 0:
            continue
        slope, variance, _ = line(stroke.depth[rows], stroke.force[rows])
        at_rest, *_ = line(stroke.depth[rows], stroke.force[rows] - loss * stroke.speed[rows])
        slopes.append((slope + at_rest) / 2)
        variances.append(variance)
        by_speed.append((slope - at_rest) / 2)
        forces.append(float(low + level * (high - low)))
        if stroke.read is not None:
            depth, force = stroke.read
            by_filter.append(apart(depth, force, _about(force, low, high, level), slope, variance))
    if not slopes:
        return None
    mean = random_effects(np.array(slopes), np.array(variances))
    others = np.mean(by_speed), np.mean(by_filter) if by_filter else 0.0
    return Tangent(
        float(np.mean(forces)), mean.value, float(np.sqrt(mean.half**2 + sum(o**2 for o in others)))
    )


def _about(force: Array, low: float, high: float, level: float) -> NDArray[np.intp]:
    """Rows about a share of the force between two ends."""
    return np.flatnonzero(np.abs((force - low) / (high - low or 1.0) - level) < _WIDE)


def _thin(x: Array, f: Array) -> Array:
    step = max(len(x) // _SHOWN, 1)
    return np.stack([x[::step], f[::step]])
