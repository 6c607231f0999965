"""Judge stiffness maps on surfaces that share nothing with the Gaussian process, and print tables of it.

    benchmarks/maps/coverage.py [--worlds 40] [--seed 1] [--parts coverage presses speed]

Surfaces: lumps with edges of a probe's width at random places, sizes and depths; smooth lumps; stripes; a random field.
Each press errs by what it states, times an unknown factor of .7 to 1.5, and by friction of 1 to 6 % that it does not
state.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import chain
from time import process_time

import numpy as np
from scipy.ndimage import gaussian_filter

from palpate.maps import StiffnessMap

SIDE, PIXELS = 0.1, 100
CENTRES = (np.arange(PIXELS) + 0.5) / PIXELS * SIDE
PLACES = np.stack(np.meshgrid(CENTRES, CENTRES), axis=-1).reshape(-1, 2)


@dataclass
class World:
    """A surface: the logarithm of its stiffness at each of `PLACES`, its edge, and how presses err."""

    field: np.ndarray
    edge: float
    stated: float
    factor: float
    friction: float

    def press(self, places: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and half-width of presses at places."""
        column, row = (np.clip((places / SIDE * PIXELS).astype(int), 0, PIXELS - 1)).T
        std = np.hypot(self.stated * self.factor, self.friction)
        value = np.exp(self.field[row * PIXELS + column] + std * rng.normal(size=len(places)))
        return value, 1.96 * self.stated * value


def lumps(rng: np.random.Generator, sharp: bool) -> tuple[np.ndarray, float]:
    """Ellipses on a sloping background, blurred by a probe of .5 to 2 mm where sharp, else bell-shaped."""
    x, y = PLACES.T
    field = rng.normal(0.0, 0.15) * (x / SIDE - 0.5) + rng.normal(0.0, 0.15) * (y / SIDE - 0.5)
    inside = np.zeros_like(field)
    rise = rng.uniform(0.5, 1.6)
    for _ in range(rng.integers(1, 4)):
        centre, size, turn = rng.uniform(0.02, 0.08, 2), rng.uniform(0.008, 0.02, 2), rng.uniform(0.0, np.pi)
        u = (x - centre[0]) * np.cos(turn) + (y - centre[1]) * np.sin(turn)
        v = (y - centre[1]) * np.cos(turn) - (x - centre[0]) * np.sin(turn)
        q = (u / size[0]) ** 2 + (v / size[1]) ** 2
        inside = np.maximum(inside, q < 1.0 if sharp else np.exp(-0.7 * q))
    width = rng.uniform(0.5e-3, 2e-3) / SIDE * PIXELS
    inside = gaussian_filter(inside.reshape(PIXELS, PIXELS), width).ravel() if sharp else inside
    return field + rise * inside, 0.5 * rise


def stripes(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """A sine across the surface."""
    turn, wave = rng.uniform(0.0, np.pi), rng.uniform(0.03, 0.08)
    across = PLACES @ [np.cos(turn), np.sin(turn)]
    return rng.uniform(0.2, 0.5) * np.sin(2.0 * np.pi * across / wave + rng.uniform(0.0, 6.0)), 0.0


def cloud(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """White noise, blurred to a random scale."""
    width = rng.uniform(0.08, 0.25) * PIXELS
    field = gaussian_filter(rng.normal(size=(PIXELS, PIXELS)), width, mode="wrap").ravel()
    return rng.uniform(0.2, 0.5) * field / field.std(), 0.0


KINDS: dict[str, Callable[[np.random.Generator], tuple[np.ndarray, float]]] = {
    "lumps with edges": lambda rng: lumps(rng, sharp=True),
    "smooth lumps": lambda rng: lumps(rng, sharp=False),
    "stripes": stripes,
    "random field": cloud,
}


def world(kind: str, rng: np.random.Generator) -> World:
    """A surface of a kind."""
    field, edge = KINDS[kind](rng)
    level = rng.uniform(np.log(200.0), np.log(2e4))
    friction, stated = rng.uniform(0.01, 0.06), rng.uniform(0.01, 0.05)
    return World(level + field, level + edge, stated, rng.uniform(0.7, 1.5), friction)


def explore(surface: World, count: int, rng: np.random.Generator, goal: str) -> StiffnessMap:
    """A map from a coarse grid and then from places that it chooses in fives; or from random places."""
    result = StiffnessMap()
    if goal == "random":
        places = np.vstack([rng.uniform(0.0, SIDE, (count - 4, 2)), CORNERS])
        result.update(places, *surface.press(places, rng))
        return result
    *_, result = growth(surface, count, rng, goal)
    return result


def growth(surface: World, count: int, rng: np.random.Generator, goal: str) -> Iterator[StiffnessMap]:
    """A map that grows by five presses at a time from a coarse grid, at each of its sizes."""
    result = StiffnessMap()
    steps = (np.arange(4) + 0.5) / 4 * SIDE
    places = np.vstack([np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2), CORNERS])
    while True:
        result.update(places, *surface.press(places, rng))
        yield result
        if len(result) >= count:
            return
        threshold = float(np.exp(surface.edge)) if goal == "edge" else None
        places = result.next(min(5, count - len(result)), stiffer_than=threshold).places


CORNERS = np.array([[0.0, 0.0], [0.0, SIDE], [SIDE, 0.0], [SIDE, SIDE]])


@dataclass
class Score:
    """What a map got right on a surface."""

    mean: float
    next: float
    error: float
    overlap: float
    probability: np.ndarray
    exceeds: np.ndarray


def judge(surface: World, result: StiffnessMap, rng: np.random.Generator) -> Score:
    """Coverage, error, overlap with the region above the edge, and probabilities with what was true."""
    seen = result.predict(PLACES)
    truth = np.exp(surface.field)
    stated, _ = surface.press(PLACES, rng)
    held, foretold = ((low <= value) & (value <= high) for value, (low, high) in (
        (truth, seen.ci95.T), (stated, seen.next95.T),
    ))  # fmt: skip
    probability, above = seen.exceeds(float(np.exp(surface.edge))), surface.field > surface.edge
    guess = probability > 0.5
    overlap = 2.0 * np.sum(guess & above) / max(np.sum(guess) + np.sum(above), 1)
    error = float(np.sqrt(np.mean((seen.mean - surface.field) ** 2)))
    return Score(float(held.mean()), float(foretold.mean()), error, float(overlap), probability, above)


def calibration(scores: Sequence[Score]) -> float:
    """Mean distance of stated probabilities from frequencies, over ten bins."""
    stated = np.concatenate([score.probability for score in scores])
    true = np.concatenate([score.exceeds for score in scores])
    bins = np.minimum((10 * stated).astype(int), 9)
    parts = [(bins == k) for k in range(10)]
    return float(sum(abs(stated[p].mean() - true[p].mean()) * p.mean() for p in parts if p.any()))


def table(worlds: int, seed: int, counts: Sequence[int]) -> list[str]:
    """Rows of the table, one a kind, a way to choose and a number of presses."""
    rows = [
        "| surface | chosen by | presses | 95 %: surface | 95 %: next press | rms of log K | F1 of lumps | P off |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind in KINDS:
        for goal in ("random", "interval", "edge"):
            if goal == "edge" and "lumps" not in kind:
                continue
            for count in counts:
                scores = []
                for k in range(worlds):
                    rng = np.random.default_rng([seed, list(KINDS).index(kind), k])
                    surface = world(kind, rng)
                    scores.append(judge(surface, explore(surface, count, rng, goal), rng))
                names = ("mean", "next", "error", "overlap")
                row = [np.mean([getattr(s, name) for s in scores]) for name in names]
                rows.append(
                    f"| {kind} | {goal} | {count} | {100 * row[0]:.1f} % | {100 * row[1]:.1f} % | {row[2]:.3f} | "
                    f"{row[3]:.3f} | {calibration(scores):.3f} |"
                )
    return rows


def errors(kind: str, goal: str, seed: int, world_number: int) -> np.ndarray:
    """Root mean squares of log K: of 100 random presses, and of 35, 40, ... 100 chosen ones."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), world_number])
    surface = world(kind, rng)
    maps = (found for found in growth(surface, 100, rng, goal) if len(found) >= 35)
    return np.array([
        np.sqrt(np.mean((found.predict(PLACES[::3]).mean - surface.field[::3]) ** 2))
        for found in chain([explore(surface, 100, rng, "random")], maps)
    ])  # fmt: skip


def presses_for_random(worlds: int, seed: int) -> list[str]:
    """Rows of a table: how many chosen presses have the error of 100 random ones."""
    rows = ["| surface | chosen by | presses for the rms of 100 random ones |", "|---|---|---|"]
    with ProcessPoolExecutor(2) as pool:
        for kind in KINDS:
            for goal in ("interval", "edge") if "lumps" in kind else ("interval",):
                found = pool.map(partial(errors, kind, goal, seed), range(worlds))
                random, *chosen = np.mean(list(found), axis=0)
                count = np.interp(-random, -np.minimum.accumulate(chosen), np.arange(35, 101, 5))
                rows.append(f"| {kind} | {goal} | {count:.0f} |")
    return rows


def speed(counts: Sequence[int]) -> list[str]:
    """Rows of a table: processor time of 10,000 places and the next press, the median of nine, fitted before."""
    rows = ["| presses | fit | 10,000 places | next press |", "|---|---|---|---|"]
    for count in counts:
        rng = np.random.default_rng(count)
        surface = world("lumps with edges", rng)
        result = explore(surface, count, rng, "random")
        fit = duration(lambda result=result: result.process.z95)
        times = [(duration(partial(result.predict, PLACES)), duration(result.next)) for _ in range(9)]
        places, following = np.median(times, axis=0)
        rows.append(f"| {count} | {fit:.0f} ms | {places:.0f} ms | {following:.0f} ms |")
    return rows


def duration(call: Callable[[], object]) -> float:
    """Processor time of a call [ms]."""
    begin = process_time()
    call()
    return 1e3 * (process_time() - begin)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--counts", type=int, nargs="+", default=(30, 100))
    parser.add_argument("--parts", nargs="+", default=("coverage", "presses"))
    asked = parser.parse_args()
    parts = {
        "coverage": lambda: table(asked.worlds, asked.seed, asked.counts),
        "presses": lambda: presses_for_random(asked.worlds, asked.seed),
        "speed": lambda: speed(asked.counts),
    }
    for name in asked.parts:
        print(*parts[name](), sep="\n", flush=True)


if __name__ == "__main__":
    main()
