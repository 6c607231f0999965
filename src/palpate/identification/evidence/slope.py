"""The slope of the loadings: of the upper part of the force, at rest, and what contradicts it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.estimators.budget import NORMAL
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.loadings import FEWEST, LINE, Loading, loadings_in, read_later
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem

_UPPER = 0.4
"""Share of the force above which a loading counts for its stiffness: below, a surface is still being met."""


@dataclass(frozen=True)
class Slope:
    """Slope of the upper part of all loadings.

    Args:
        stiffness, half: [N/m].
        rise: mean duration of a loading [s].
        each: slope of each loading [N/m].
        budget: half-width by cause [N/m]; their squares add up.
        force, depth: where it is, the means of the upper part [N], [m].
    """

    stiffness: float
    half: float
    rise: float
    each: tuple[float, ...]
    budget: dict[str, float]
    force: float
    depth: float


def slope_in(problem: Problem, segments: list[Segment]) -> Slope | None:
    """The slope of a log's loadings; with it what it moves by if the force is later than assumed.

    Args:
        problem: of the log.
        segments: of its rows.
    """
    loadings = loadings_in(problem, problem.lag.value, segments)
    return slope_between(loadings, read_later(problem, problem.lag.value, segments, loadings))


def slope_between(loadings: list[Loading], later: list[Loading]) -> Slope | None:
    """The slope of some loadings; its interval reaches that of the same with the force later.

    Args:
        loadings: the loadings.
        later: the same with the force later, or the same list if the lag is exact.
    """
    found = slope_of(loadings)
    other = slope_of(later) if found is not None and later is not loadings else None
    if found is None or other is None:
        return found
    by_lag = NORMAL * abs(other.stiffness - found.stiffness)
    return replace(found, half=float(np.hypot(found.half, by_lag)), budget=found.budget | {"lag": by_lag})


def slope_of(loadings: list[Loading]) -> Slope | None:
    """Slope in the upper part of the force; None without a loading that rises.

    Half way between the slope as it is and the slope at rest, less what the force has of the speed: both are told, and
    the interval reaches both. Beyond them it has the scatter of each loading, the change of the slope over the range,
    what it differs by from the slope of the channels as they were read, and the variance between loadings (a random
    effect, Student's t).
    """
    slopes, variances, rises, changes, speeds, filters, levels = [], [], [], [], [], [], []
    for loading in loadings:
        rows = _upper(loading.force)
        if len(rows) < FEWEST or np.ptp(loading.depth[rows]) <= 0:
            continue
        slope, variance, change = line(loading.depth[rows], loading.force[rows])
        at_rest = _at_rest(loading.whole or loading)
        slopes.append((slope + at_rest) / 2)
        variances.append(variance)
        changes.append(change)
        speeds.append(abs(slope - at_rest) / 2)
        filters.append(_by_filter(loading, slope, variance))
        rises.append(float(loading.time[-1] - loading.time[0]))
        levels.append((loading.force[rows].mean(), loading.depth[rows].mean()))
    if not slopes:
        return None
    mean = random_effects(np.array(slopes), np.array(variances))
    curvature, reach, by_filter = (float(np.mean(own)) for own in (changes, speeds, filters))
    others = float(np.sqrt(mean.half**2 + curvature**2 + by_filter**2))
    causes = {
        "repetition" if len(slopes) > 1 else "noise": mean.half,
        "curvature": curvature,
        "filter": by_filter,
        "speed": float(np.sqrt((others + reach) ** 2 - others**2)),
    }
    where = (float(own) for own in np.mean(levels, axis=0))
    return Slope(mean.value, others + reach, float(np.mean(rises)), tuple(slopes), causes, *where)


def _upper(force: Array) -> NDArray[np.intp]:
    """Rows of a loading after the last that was below the share: a force may fall before it rises for good."""
    low, high = np.percentile(force, [2, 98])
    below = np.flatnonzero(force <= low + _UPPER * (high - low))
    return np.arange(int(below[-1]) + 1 if len(below) else 0, len(force))


def _by_filter(loading: Loading, slope: float, variance: float) -> float:
    """By how much a slope contradicts that of the same loading before any filter [N/m]: beyond their 95 % interval.

    All of it, if the loading has too few readings for a slope of its own: its shape is then the filter's.
    """
    if loading.read is None:
        return 0.0
    depth, force = loading.read
    if len(depth) < LINE:
        return abs(slope)
    return apart(depth, force, _upper(force), slope, variance)


def apart(depth: Array, force: Array, rows: NDArray[np.intp], slope: float, variance: float) -> float:
    """By how much a slope contradicts that of some readings [N/m]; all of it, if they are too few for one."""
    if len(rows) < LINE or np.ptp(depth[rows]) <= 0:
        return abs(slope)
    own, doubt, _ = line(depth[rows], force[rows])
    return max(abs(own - slope) - NORMAL * float(np.sqrt(max(variance + doubt, 0.0))), 0.0)


def unseen(problem: Problem) -> float:
    """How far a stiffness may be off, relative, because the touch lies in a jump of the position between readings.

    Of the range g / (R - g), where no reading was taken in the part g of it; as far as the stiffness rests on the two
    sides of the jump rather than on what moves on either: by the share of the position's variance between them.
    """
    position = np.sort(problem.motion.position[problem.in_contact])
    gaps = np.diff(position)
    if not gaps.any():
        return 0.0
    below, above = np.split(position, [int(np.argmax(gaps)) + 1])
    gap = max(float(gaps.max()) - problem.motion.noise.count, 0.0)
    apart = len(below) * len(above) * float(above.mean() - below.mean()) ** 2 / len(position) ** 2
    rest = max(float(np.ptp(position)) - gap, 1e-3 * gap)
    return apart / float(position.var()) * gap / rest if rest else 0.0


def line(x: Array, f: Array) -> tuple[float, float, float]:
    """Slope, its variance under coloured noise, and half of what the slope changes by over the range."""
    middle, reach = float(x.mean()), float(np.ptp(x))
    u = (x - middle) / reach
    columns = np.column_stack([np.ones_like(u), u, u**2 - (u**2).mean()])
    theta, *_ = np.linalg.lstsq(columns, f, rcond=None)
    left = f - columns @ theta
    noise = noise_of(left, np.arange(len(f)), 3)
    gram = np.linalg.pinv(columns.T @ columns)
    variance = noise.variance * len(f) / max(noise.effective, 4.0) * np.diag(gram)
    curve = abs(float(theta[2]))
    return float(theta[1] / reach), float(variance[1] / reach**2), curve / reach


def _at_rest(loading: Loading) -> float:
    """Slope of the upper part less what the force has of the speed.

    Of the whole loading: within one advance that dies out the speed is the depth over again, and only rests between
    advances tell the two apart.
    """
    rows = _upper(loading.force)
    columns = np.column_stack([np.ones(len(rows)), loading.depth[rows], loading.speed[rows]])
    size = np.sqrt((columns**2).sum(axis=0))
    size[size == 0] = 1.0
    theta, *_ = np.linalg.lstsq(columns / size, loading.force[rows], rcond=1e-3)
    return float(theta[1] / size[1])
