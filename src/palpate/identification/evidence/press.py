"""The press: force over depth in loading and unloading, its tangents, the lost work, and the relaxation of a hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.estimators.budget import NORMAL
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.loadings import FEWEST, Loading, loadings_in, of_speed, read_later
from palpate.identification.evidence.relaxation import relaxation
from palpate.identification.evidence.slope import apart, line, slope_between
from palpate.identification.evidence.work import unloading_of
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.result import Press, Tangent
from palpate.identification.tangents import SteadyPress

_LEVELS = (0.3, 0.5, 0.7, 0.9)

_WIDE = 0.15
"""Half of the share of the force about a level over which its slope is taken: the levels lie .2 apart."""

_SHOWN = 400
"""Points of a curve that are kept at most, to be drawn."""


def press_of(problem: Problem, lag: float, segments: list[Segment]) -> Press | None:
    """The press of a log; None without a loading."""
    loadings = loadings_in(problem, lag, segments)
    if not loadings:
        return None
    loading = max(loadings, key=lambda loading: len(loading.depth))
    later = read_later(problem, lag, segments, loadings)
    tangent = [t for level in _LEVELS if (t := _tangent(loadings, later, level)) is not None]
    back = unloading_of(problem, lag, segments)
    return Press(
        tuple(t for t in tangent if t.half < abs(t.stiffness)),
        _thin(loading.depth, loading.force),
        _thin(*back.curve),
        back.loss,
        relaxation(problem, lag, segments, slope_between(loadings, later)),
        back.late,
    )


def at_constant_speed(steady: SteadyPress, seen: Press | None, origin: float) -> Press:
    """A press at constant speed, with the lost work and the relaxation that its log shows.

    Args:
        steady: its strokes' tangents and curves.
        seen: the press by the filtered contact, if that shows one.
        origin: position of the surface [m].
    """
    tangents = [Tangent(own.force, own.stiffness, own.half) for own in (*steady.others, steady.headline)]
    surface = np.array([[origin], [0.0]])
    ordered = tuple(sorted(tangents, key=lambda own: own.force))
    curves = steady.loading - surface, steady.unloading - surface
    if seen is None:
        return Press(ordered, *curves)
    return replace(seen, tangent=ordered, loading=curves[0], unloading=curves[1])


def _tangent(loadings: list[Loading], later: list[Loading], level: float) -> Tangent | None:
    """Slope of the loadings about a share of the force; with it what it moves by if the force is later than assumed.

    Args:
        loadings: the loadings.
        later: the same, the force later by a deviation of the lag's prior.
        level: the share.
    """
    found, other = _tangent_of(loadings, level), _tangent_of(later, level)
    if found is None or other is None:
        return None
    by_lag = NORMAL * (other.stiffness - found.stiffness)
    return replace(found, half=float(np.hypot(found.half, by_lag)))


def _tangent_of(loadings: list[Loading], level: float) -> Tangent | None:
    slopes, variances, forces, by_speed, by_filter = [], [], [], [], []
    for loading in loadings:
        loss = of_speed(loading)
        low, high = np.percentile(loading.force, [2, 98])
        rows = _about(loading.force, low, high, level)
        if len(rows) < FEWEST or np.ptp(loading.depth[rows]) <= 0:
            continue
        slope, variance, _ = line(loading.depth[rows], loading.force[rows])
        at_rest, *_ = line(loading.depth[rows], loading.force[rows] - loss * loading.speed[rows])
        slopes.append((slope + at_rest) / 2)
        variances.append(variance)
        by_speed.append((slope - at_rest) / 2)
        forces.append(float(low + level * (high - low)))
        if loading.read is not None:
            depth, force = loading.read
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
