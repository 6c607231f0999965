"""A tempered sequential Monte Carlo sampler on the unit cube, for likelihoods that cost seconds and are steps."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Mask
from palpate_studies.plan import Sobol

Evaluate = Callable[[Array, Array], Array]
"""Log-likelihoods of points, shape (n, d) -> (n,). Where one falls below its floor, the second argument of shape (n,),
any number below the floor will do: the point is refused either way."""
Begun = Callable[[float, int], None]
"""Told at each temperature the power of the likelihood, and of how many points it will be asked there."""
JITTER = 0.02
"""Added to each coordinate that moves, as a share of its prior: without it differences span what they began with."""
LEAP = 0.1
"""Share of the moves that go by a whole difference, from one mode to another (ter Braak, 2006)."""
TOGETHER = 0.25
"""Share of the coordinates that move at once."""

LAST = 3
"""Times as many moves at the last temperature: there each of them adds to the posterior."""


@dataclass(frozen=True)
class Settings:
    """Of the sampler.

    Args:
        particles: how many; even.
        first: points of the prior to begin with, for each particle.
        moves: of each particle at each temperature.
        seed: of everything drawn.
    """

    particles: int = 128
    first: int = 4
    moves: int = 2
    seed: int = 1

    def at(self, power: float) -> int:
        """Moves of each particle at this power of the likelihood; where it stands after the last is the posterior."""
        return self.moves if power < 1.0 else LAST * self.moves


@dataclass(frozen=True)
class TemperatureStage:
    """One temperature of the search."""

    beta: float  # power of the likelihood, 0 is the prior, 1 the posterior
    effective: float  # points that the weights were worth before resampling
    accepted: float  # share of the moves
    distinct: int  # particles that differ, after the moves
    ancestors: int  # points of the prior that they come from


@dataclass(frozen=True)
class Sample:
    """The posterior as points of equal weight.

    Args:
        points: where the particles stand in the end, shape (particles, d).
        likelihood: logarithms, shape (particles,).
        stages: the temperatures.
        visited: where they stood after each move at the last temperature, shape (n, d): the posterior.
        ancestors: the point of the prior that each of these comes from, shape (n,).
    """

    points: Array
    likelihood: Array
    stages: tuple[TemperatureStage, ...]
    visited: Array
    ancestors: NDArray[np.int64]


def sample(
    evaluate: Evaluate,
    redrawn: Mask,
    settings: Settings,
    begun: Begun = lambda _power, _count: None,
) -> Sample:
    """Points of the posterior under an even prior on the unit cube (Del Moral, Doucet and Jasra, 2006).

    From points of Sobol's sequence the likelihood's power grows from 0 to 1 so fast that the weights stay worth half
    of the points (at first, as many as there are particles); then resampling, and moves that leave the posterior at
    this power as it is: differences of two particles of the other half (ter Braak, 2006).

    Args:
        evaluate: the likelihood; asked in the same order whenever the settings are the same.
        redrawn: coordinates whose neighbours mean nothing, shape (d,); they are drawn anew.
        settings: sizes and seed.
        begun: told of each temperature, the prior's too.
    """
    rng = np.random.default_rng(settings.seed)
    points = prior(settings, len(redrawn))
    begun(0.0, len(points))
    likelihood = evaluate(points, np.full(len(points), -np.inf))
    stages: list[TemperatureStage] = []
    beta, ancestor = 0.0, np.arange(len(points))
    while beta < 1.0:
        wanted = settings.particles if not stages else 0.5 * len(points)
        step = _step(likelihood, 1.0 - beta, wanted)
        beta, weights = beta + step, _weights(step * likelihood)
        effective = 1.0 / float(np.sum(weights**2))
        kept = _resample(weights, settings.particles, rng)
        points, likelihood, ancestor = points[kept], likelihood[kept], ancestor[kept]
        begun(beta, settings.at(beta) * settings.particles)
        accepted, visited = [], []
        for _ in range(settings.at(beta)):
            accepted.append(_sweep(evaluate, points, likelihood, redrawn, beta, rng))
            visited.append(points.copy())
        distinct = len(np.unique(points, axis=0))
        stages.append(
            TemperatureStage(beta, effective, float(np.mean(accepted)), distinct, len(np.unique(ancestor)))
        )
    return Sample(points, likelihood, tuple(stages), np.vstack(visited), np.tile(ancestor, len(visited)))


@cache
def prior(settings: Settings, dimensions: int) -> Array:
    """The points of the prior that sampling begins with, shape (n, d); not to be written to."""
    sobol = Sobol(dimensions, settings.seed)
    points = np.array([sobol.point(i) for i in range(settings.first * settings.particles)])
    points.flags.writeable = False
    return points


def _step(likelihood: Array, room: float, wanted: float) -> float:
    """How far the power may grow until the weights are worth no more than `wanted` points; at most `room`."""
    if _worth(room * likelihood) >= wanted:
        return room
    low, high = 0.0, room
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _worth(middle * likelihood) >= wanted else (low, middle)
    return high


def _worth(logarithms: Array) -> float:
    return 1.0 / float(np.sum(_weights(logarithms) ** 2))


def _weights(logarithms: Array) -> Array:
    weights = np.exp(logarithms - logarithms.max())
    return np.asarray(weights / weights.sum())


def _resample(weights: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Systematic resampling: which points are kept, and how often."""
    marks = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks), len(weights) - 1)


def _sweep(
    evaluate: Evaluate,
    points: Array,
    likelihood: Array,
    redrawn: Mask,
    beta: float,
    rng: np.random.Generator,
) -> float:
    """Moves every particle once, in place, one half after the other; the share that was accepted."""
    order, accepted = rng.permutation(len(points)), 0
    halves = np.array_split(order, 2)
    for moving, others in (halves, halves[::-1]):
        proposed = np.array([_move(points[i], points[others], redrawn, rng) for i in moving])
        floor = likelihood[moving] + np.log(rng.random(len(moving))) / beta
        found = evaluate(proposed, floor)
        good = found >= floor
        points[moving[good]], likelihood[moving[good]] = proposed[good], found[good]
        accepted += int(good.sum())
    return accepted / len(points)


def _move(point: Array, others: Array, redrawn: Mask, rng: np.random.Generator) -> Array:
    """A point some of whose coordinates have gone by a difference of two others, mirrored at the cube's faces."""
    moving = rng.random(len(point)) < TOGETHER
    moving[rng.integers(len(point))] = True
    a, b = others[rng.choice(len(others), 2, replace=False)]
    far = 1.0 if rng.random() < LEAP else 2.38 / np.sqrt(2.0 * moving.sum())
    by = far * (a - b) + JITTER * rng.standard_normal(len(point))
    there = 1.0 - np.abs(1.0 - np.mod(point + by, 2.0))
    drawn = rng.random(len(point))
    return np.where(moving, np.where(redrawn, drawn, np.minimum(there, np.nextafter(1.0, 0.0))), point)
