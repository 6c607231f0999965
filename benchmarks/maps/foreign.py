"""Judge the intervals of stiffness maps on surfaces and presses that break what the Gaussian process assumes.

    benchmarks/maps/foreign.py [--worlds 20] [--seed 5] [--counts 40 150]

Each kind is one way to differ: of the field (jumps, sparse bumps, a gradient, two length scales that differ by the
direction, one small lump), of the presses' errors (heavy tails, one side, some presses ten times worse, an interval
that says little of the error), or of the design (repeats at few places, lines that share an error). Of every five
presses one is left out, and the map of the others gives the interval of that press and of the surface there.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.distance import cdist

from palpate.maps import StiffnessMap

SIDE, PIXELS, FOLDS = 0.1, 200, 5
Draw = Callable[[np.ndarray, np.random.Generator], np.ndarray]
LEAST = 1e-4
"""Standard deviation that a press states at least."""


def blurred(rng: np.random.Generator, across: float, along: float) -> np.ndarray:
    """White noise of unit variance, blurred to two length scales [share of the side]."""
    field = gaussian_filter(rng.normal(size=(PIXELS, PIXELS)), [across * PIXELS, along * PIXELS])
    return (field - field.mean()) / field.std()


def pixel(field: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The field (PIXELS, PIXELS) at places (n, 2) [m]."""
    column, row = np.clip((places / SIDE * PIXELS).astype(int), 0, PIXELS - 1).T
    return field[row, column]


def cells(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Regions, each of its own stiffness, that meet in jumps."""
    seeds = rng.uniform(0.0, SIDE, (rng.integers(3, 9), 2))
    return (0.4 * rng.normal(size=len(seeds)))[cdist(places, seeds).argmin(axis=1)]


def bumps(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sparse bumps whose heights and widths have heavy tails."""
    field = np.zeros(len(places))
    for _ in range(rng.integers(4, 15)):
        width = 0.004 * (1.0 + rng.pareto(2.5))
        height = 0.2 * rng.pareto(2.0)
        far = cdist(places, rng.uniform(0.0, SIDE, (1, 2)))[:, 0]
        field += height * np.exp(-0.5 * (far / width) ** 2)
    return np.minimum(field, 3.0)


def gradient(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A steep slope with a little texture."""
    slope = rng.normal(0.0, 1.0, 2)
    return places @ slope / SIDE + 0.03 * pixel(blurred(rng, 0.03, 0.03), places)


def fibres(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Length scales that differ eightfold by the direction."""
    return 0.3 * pixel(blurred(rng, 0.03, 0.24), places)


def one_lump(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One small lump on a plain surface."""
    radius = rng.uniform(0.008, 0.02)
    far = cdist(places, rng.uniform(0.02, 0.08, (1, 2)))[:, 0]
    return rng.uniform(0.3, 1.2) / (1.0 + np.exp((far - radius) / 1e-3))


def cloud(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A random field."""
    scale = rng.uniform(0.06, 0.2)
    return 0.3 * pixel(blurred(rng, scale, scale), places)


def rough(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A random field with grain far below the spacing of presses."""
    return cloud(places, rng) + 0.08 * pixel(rng.normal(size=(PIXELS, PIXELS)), places)


def scattered(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random places, each of its own group."""
    return rng.uniform(0.0, SIDE, (count, 2)), np.arange(count)


def repeats(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Four presses at each of few places."""
    group = np.arange(count) // 4
    return rng.uniform(0.0, SIDE, (group[-1] + 1, 2))[group], group


def lines(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Ten lines of presses, each line an error of its own."""
    group, long = np.arange(count) * 10 // count, count // 10
    height = (np.arange(group[-1] + 1) + 0.5) / (group[-1] + 1) * SIDE
    x = (np.arange(count) % long + 0.5) / long * SIDE
    return np.column_stack([x, height[group]]) + 5e-4 * rng.normal(size=(count, 2)), group


def normal(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Normal errors of 1 to 6 %, of which each press states less or more alike."""
    std = rng.uniform(0.01, 0.06)
    return std * rng.normal(size=count), np.full(count, std * np.exp(0.5 * rng.normal()))


def heavy(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Errors with the tails of Student's distribution of three degrees of freedom."""
    std = rng.uniform(0.01, 0.05)
    return std * rng.standard_t(3, size=count), np.full(count, std)


def outliers(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One press in fifteen is ten times worse, and does not say so."""
    std = rng.uniform(0.01, 0.04)
    return std * rng.normal(size=count) * np.where(rng.random(count) < 1 / 15, 10.0, 1.0), np.full(count, std)


def one_sided(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Friction that only adds, of an exponential distribution."""
    std = rng.uniform(0.02, 0.08)
    return std * (rng.exponential(size=count) - 1.0), np.full(count, 0.3 * std)


def vague(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Intervals that differ a thousandfold from press to press and say nothing of the errors."""
    std = rng.uniform(0.01, 0.06)
    return std * rng.normal(size=count), np.maximum(0.3 * std * np.exp(1.2 * rng.normal(size=count)), LEAST)


def graded(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Errors that differ from press to press, as the intervals say."""
    std = rng.uniform(0.01, 0.04) * np.exp(0.7 * rng.normal(size=count))
    return std * rng.normal(size=count), std


def shared(count: int, group: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Errors of which half the variance is common to a group."""
    std = rng.uniform(0.02, 0.06)
    return std * np.sqrt(0.5) * (rng.normal(size=count) + rng.normal(size=group[-1] + 1)[group]), np.full(
        count, 0.5 * std
    )


KINDS = {
    "jumps": (cells, scattered, normal), "sparse bumps": (bumps, scattered, normal),
    "gradient": (gradient, scattered, normal), "fibres": (fibres, scattered, normal),
    "one lump": (one_lump, scattered, normal), "grain": (rough, scattered, normal),
    "heavy tails": (cloud, scattered, heavy), "outliers": (cloud, scattered, outliers),
    "one-sided": (cloud, scattered, one_sided), "vague intervals": (cloud, scattered, vague),
    "graded": (cloud, scattered, graded), "repeats": (cloud, repeats, normal),
    "repeats, jumps": (cells, repeats, heavy), "repeats, grain": (rough, repeats, normal),
    "lines": (cloud, lines, shared), "lines, one lump": (one_lump, lines, shared),
}  # fmt: skip


def judge(kind: str, count: int, seed: int) -> tuple[float, float]:
    """Shares of the surface and of presses in their intervals, at the places that were left out."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), count])
    field, design, errors = KINDS[kind]
    places, group = design(count, rng)
    truth = np.log(rng.uniform(300.0, 5000.0)) + field(places, rng)
    error, stated = errors(count, group, rng)
    value = np.exp(truth + error)
    left_out = rng.integers(0, FOLDS, count) if design is not lines else group % FOLDS
    surface, press = np.empty(count, bool), np.empty(count, bool)
    for fold in range(FOLDS):
        out = left_out == fold
        result = StiffnessMap()
        line = group[~out] if errors is shared else None
        result.update(places[~out], value[~out], 1.96 * stated[~out] * value[~out], line)
        seen = result.predict(places[out])
        for found, ends, true in ((surface, seen.ci95, np.exp(truth[out])), (press, seen.next95, value[out])):
            found[out] = (ends[:, 0] <= true) & (true <= ends[:, 1])
    return float(surface.mean()), float(press.mean())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--counts", type=int, nargs="+", default=(40, 150))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS))
    asked = parser.parse_args()
    print("| kind | " + " | ".join(f"{c}: surface | next press" for c in asked.counts) + " |")
    print("|---" * (1 + 2 * len(asked.counts)) + "|", flush=True)
    with ProcessPoolExecutor(2) as pool:
        for kind in asked.kinds:
            cells = []
            for count in asked.counts:
                seeds = [asked.seed * 1000 + k for k in range(asked.worlds)]
                found = np.mean(list(pool.map(partial(judge, kind, count), seeds)), axis=0)
                cells += [f"{100 * found[0]:.1f} %", f"{100 * found[1]:.1f} %"]
            print(f"| {kind} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
