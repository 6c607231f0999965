"""Presses at constant speed as testing machines and arms make them: whether the tangent at the named force holds.

    python benchmarks/identification/plain_presses.py --worlds 60 --repeats 4 --seed 0

A world is a material (spring, Hertz, power law, exponential; elastic, or relaxing as a standard linear solid, a Prony
series or a power law of time), a motion at constant speed (loading, loading and unloading, unloading, ramp and hold,
cycles, tension), and a machine (free motion or none, offset, drift, noise, last digits, compliance, sampling rate,
signs). Its repeats differ by their noise alone. The truth is the slope of the noise-free force over the noise-free
position at the force that the answer names, in loading; in unloading where the log has no loading.

The table says how many logs are answered (a working point from the press, or K, identified), the share of 95 %
intervals that hold the truth, and the median of the half-width over that of the repeats' spread.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parent))


from palpate.errors import InputError
from palpate.identification import Identification, identify
from palpate.records import Record

Array = NDArray[np.float64]
Rng = np.random.Generator

LAWS = ("spring", "hertz", "power", "exponential")
TIMES = ("elastic", "solid", "prony", "power-law")
MOTIONS = ("loading", "loading-unloading", "unloading", "ramp-hold", "cycles", "tension")
_FEWEST = 300
_MOST = 60_000


@dataclass(frozen=True)
class World:
    """All of a press but its noise.

    Args:
        law, times, motion: of `LAWS`, `TIMES` and `MOTIONS`.
        free: whether the log begins in free motion (of an unloading: ends there).
        rate: rows a second [Hz].
        time: of each row [s], shape (n,).
        position, force: without noise, as the log counts them [m], [N], shape (n,).
        rest: the force in free motion [N]; the offset of the sensor.
        strokes: first and past-the-last row of each stroke at constant speed that is named.
        noise: deviations of position [m] and force [N].
        digits: last digits of position [m] and force [N]; 0 for none.
        drift: of the force over the log [N].
        told: what `identify` is told.
    """

    law: str
    times: str
    motion: str
    free: bool
    rate: float
    time: Array
    position: Array
    force: Array
    rest: float
    strokes: tuple[tuple[int, int], ...]
    noise: tuple[float, float]
    digits: tuple[float, float]
    drift: float
    told: dict[str, float]

    def log(self, rng: Rng) -> Record:
        """The log with the noise of one repeat."""
        drift = self.drift * self.time / self.time[-1]
        columns = [self.position.copy(), self.force + drift]
        for i, (noise, digit) in enumerate(zip(self.noise, self.digits, strict=True)):
            columns[i] = columns[i] + noise * rng.normal(size=len(self.time))
            columns[i] = digit * np.round(columns[i] / digit) if digit else columns[i]
        table = {"time": self.time, "position": columns[0], "force": columns[1]}
        return Record(table, {"time": "s", "position": "m", "force": "N"})

    def tangent(self, force: float, sign: float, from_rest: bool) -> float | None:
        """Slope at a force that an answer names [N/m], the mean over the strokes; None where the log never has it.

        Args:
            force: as named [N].
            sign: by which the answer counts the log's force.
            from_rest: whether it counts from the force in free motion, and not as the log has it.
        """
        level = sign * force + (self.rest if from_rest else 0.0)
        found = []
        for first, last in self.strokes:
            x, f = self.position[first:last], self.force[first:last]
            crossed = np.flatnonzero(np.diff(np.sign(f - level)))
            if len(crossed):
                at = int(crossed[len(crossed) // 2])
                near = slice(max(at - 2, 0), at + 4)
                slope, here = np.gradient(f[near], x[near]), f[near]
                order = np.argsort(here)
                found.append(abs(float(np.interp(level, here[order], slope[order]))))
        return float(np.mean(found)) if found else None


def world_of(seed: int) -> World:
    """A world drawn at random: the same for the same seed."""
    rng = np.random.default_rng([seed, 2311])
    law, times = str(rng.choice(LAWS)), str(rng.choice(TIMES))
    motion, free = str(rng.choice(MOTIONS)), bool(rng.uniform() < 0.5)
    free = free and motion != "tension"
    depth, largest = _log(rng, 2e-4, 2e-2), _log(rng, 0.5, 500.0)
    rate, stroke = _log(rng, 65, 5000), _log(rng, 0.5, 30.0)
    stroke = float(np.clip(stroke, _FEWEST / rate, _MOST / rate / 4))
    way, strokes = _way(motion, free, stroke, rate, rng)
    elastic = largest * _law(law, rng)(np.maximum(way, 0.0))
    force = _relaxed(elastic, _arms(times, stroke, rng), 1 / rate)
    force = np.maximum(force, 0.0) if free else force  # glued, where it never leaves
    compliance = float(rng.choice([0.0, rng.uniform(0.02, 0.5)])) * depth / largest
    position = depth * way + compliance * force
    cut = strokes[0][0] if motion == "unloading" or not free else 0
    begin = max(cut - int(0.1 * stroke * rate), 0) if motion == "unloading" else cut
    strokes = tuple((a - begin, b - begin) for a, b in strokes)
    signs = rng.choice([-1.0, 1.0], 2)
    rest = float(rng.normal()) * 0.1 * largest
    rows = slice(begin, None)
    return World(
        law, times, motion, free, rate, np.arange(len(way[rows])) / rate,
        float(signs[0]) * position[rows] + float(rng.uniform(-0.1, 0.1)), float(signs[1]) * force[rows] + rest,
        rest, strokes, (depth * _log(rng, 1e-6, 1e-3), largest * _log(rng, 1e-4, 5e-3)),
        (_perhaps(rng, depth * _log(rng, 1e-5, 2e-3)), _perhaps(rng, largest * _log(rng, 1e-5, 2e-3))),
        float(rng.choice([0.0, rng.normal() * 1e-3])) * largest if free else 0.0,
        {"lag": 0.0} if rng.uniform() < 0.5 else {},
    )  # fmt: skip


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _perhaps(rng: Rng, value: float) -> float:
    return float(rng.choice([0.0, value]))


def _way(
    motion: str, free: bool, stroke: float, rate: float, rng: Rng
) -> tuple[Array, tuple[tuple[int, int], ...]]:
    """Depth over the deepest by row, and the strokes whose slope an answer names."""
    bottom = -float(rng.uniform(0.15, 1.0)) if free else float(rng.uniform(0.0, 0.15))
    rest = float(rng.uniform(0.05, 0.4)) * stroke
    hold = float(rng.uniform(0.5, 3.0)) * stroke
    back = bottom if free else bottom + float(rng.uniform(0.0, 0.2))
    corners = [(0.0, bottom), (rest, bottom), (rest + stroke, 1.0)]
    named = [(rest, rest + stroke)]
    if motion == "loading-unloading":
        corners += [(corners[-1][0] + stroke, back), (corners[-1][0] + stroke + rest, back)]
    if motion == "ramp-hold":
        corners += [(corners[-1][0] + hold, 1.0)]
    if motion == "unloading":
        top = corners[-1][0] + hold
        corners += [(top, 1.0), (top + stroke, back), (top + stroke + rest, back)]
        named = [(top, top + stroke)]
    if motion == "cycles":
        for _ in range(int(rng.integers(2, 5))):
            now = corners[-1][0]
            corners += [(now + stroke, back), (now + 2 * stroke, 1.0)]
            named += [(now + stroke, now + 2 * stroke)]
    times, depths = np.array(corners).T
    count = int(times[-1] * rate)
    if count > _MOST:
        times, named = times * _MOST / count, [(a * _MOST / count, b * _MOST / count) for a, b in named]
        count = _MOST
    way = np.interp(np.arange(count) / rate, times, depths)
    rows = tuple((int(np.ceil(a * rate)), min(int(b * rate), count)) for a, b in named)
    return _rounded(way, max(int(0.01 * stroke * rate), 1)), rows


def _rounded(way: Array, width: int) -> Array:
    """A machine needs a while to reach its speed: means over some rows."""
    padded = np.concatenate([np.full(width, way[0]), way, np.full(width, way[-1])])
    return np.convolve(padded, np.ones(2 * width + 1) / (2 * width + 1), "valid")


def _law(name: str, rng: Rng) -> Callable[[Array], Array]:
    """Force over the largest by depth over the deepest."""
    n, bend = float(rng.uniform(1.2, 2.5)), float(rng.uniform(0.5, 3.0))
    if name == "spring":
        return lambda d: d
    if name == "exponential":
        return lambda d: np.expm1(bend * d) / np.expm1(bend)
    return lambda d: d ** (1.5 if name == "hertz" else n)


def _arms(times: str, stroke: float, rng: Rng) -> list[tuple[float, float]]:
    """Share of the instantaneous force and time constant [s] of each relaxing arm."""
    share = float(rng.uniform(0.1, 0.6))
    if times == "elastic":
        return []
    if times == "solid":
        return [(share, stroke * _log(rng, 0.1, 5.0))]
    if times == "prony":
        weights = rng.dirichlet(np.ones(3))
        return [(share * float(w), stroke * _log(rng, 0.03, 10.0)) for w in weights]
    decades = stroke * np.logspace(-3, 3, 13)
    weights = decades ** -float(rng.uniform(0.05, 0.25))
    return [(float(0.9 * w / weights.sum()), float(tau)) for w, tau in zip(weights, decades, strict=True)]


def _relaxed(elastic: Array, arms: list[tuple[float, float]], dt: float) -> Array:
    """Boltzmann's superposition: each arm remembers the elastic force's changes for its time constant."""
    from scipy.signal import lfilter

    found = (1 - sum(share for share, _ in arms)) * elastic
    change = np.diff(elastic, prepend=0.0)
    for share, tau in arms:
        keep = np.exp(-dt / tau)
        found = found + share * lfilter([tau / dt * (1 - keep)], [1.0, -keep], change)
    return np.asarray(found, np.float64)


@dataclass(frozen=True)
class Judged:
    """One log: what is answered at which force [N], with its 95 % half-width, and the truth [N/m]."""

    what: str
    value: float = float("nan")
    half: float = float("nan")
    force: float = float("nan")
    truth: float = float("nan")

    @property
    def error(self) -> float:
        """Of the value, relative."""
        return self.value / self.truth - 1

    @property
    def holds(self) -> bool:
        """Whether the interval has the truth in it."""
        return abs(self.value - self.truth) <= self.half


def judged(world: World, found: Identification) -> Judged:
    """The headline of an answer against the tangent at its force."""
    point = found.working_point
    if not found.contacts:
        return Judged("nothing is touched")
    if point is None or point.stiffness.value is None or point.stiffness.ci95 is None:
        return Judged("no working point")
    own = point.stiffness
    assert own.ci95 is not None
    assert own.value is not None
    sign = -1.0 if "force-sign-reversed" in found.codes else 1.0
    truth = world.tangent(point.force_N, sign, point.from_surface)
    half = (own.ci95[1] - own.ci95[0]) / 2
    if truth is None:
        return Judged("names a force that the log never has", own.value, half, point.force_N)
    what = "answered" if own.verdict == "identified" else "not identified"
    return Judged(what, own.value, half, point.force_N, truth)


def repeats_of(job: tuple[int, int]) -> tuple[int, list[Judged]]:
    """All repeats of a world by its seed."""
    seed, count = job
    world = world_of(seed)
    found = []
    for k in range(count):
        try:
            found.append(judged(world, identify(world.log(np.random.default_rng([seed, k])), **world.told)))
        except InputError as error:
            found.append(Judged(f"refused: {error}"[:60]))
    return seed, found


def ratio(found: Sequence[Judged]) -> float:
    """Median half-width over 1.96 deviations of the repeats, both relative; nan for fewer than three answers."""
    own = [j for j in found if np.isfinite(j.truth)]
    if len(own) < 3:
        return float("nan")
    spread = 1.96 * float(np.std([j.error for j in own], ddof=1))
    return float(np.median([j.half / j.truth for j in own])) / spread if spread else float("nan")


def table(every: Sequence[tuple[World, Sequence[Judged]]]) -> list[str]:
    """Lines of the figures: of all worlds, and by motion, law, relaxation and free motion."""
    kinds: dict[str, list[tuple[World, Sequence[Judged]]]] = {"all": list(every)}
    for world, found in every:
        names = (world.motion, world.law, world.times, "free motion" if world.free else "no free motion")
        for name in names:
            kinds.setdefault(name, []).append((world, found))
    head = f"{'':20} {'logs':>5} {'answered':>9} {'hold':>7} {'half-width':>11} {'over repeats':>18}"
    return [head, *(_line(name, rows) for name, rows in kinds.items())]


def _line(name: str, rows: Sequence[tuple[World, Sequence[Judged]]]) -> str:
    logs = [j for _, found in rows for j in found]
    told = [j for j in logs if j.what == "answered"]
    wrong = [j for j in logs if j.what.startswith("names")]
    holds = sum(j.holds for j in told) / max(len(told) + len(wrong), 1)
    width = float(np.median([j.half / j.truth for j in told])) if told else float("nan")
    ratios = [r for _, found in rows if np.isfinite(r := ratio(found))]
    low, middle, high = np.percentile(ratios, [25, 50, 75]) if ratios else [float("nan")] * 3
    spread = f"{middle:.2f} ({low:.2f}-{high:.2f})"
    return f"{name:20} {len(logs):5} {len(told) / len(logs):9.1%} {holds:7.1%} {width:11.2%} {spread:>18}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--worlds", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0, help="of the first world")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    asked = parser.parse_args()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    jobs = [(seed, asked.repeats) for seed in range(asked.seed, asked.seed + asked.worlds)]
    with ProcessPoolExecutor(asked.workers, get_context("spawn")) as pool:
        every = [(world_of(seed), found) for seed, found in pool.map(repeats_of, jobs)]
    print(*table(every), sep="\n")


if __name__ == "__main__":
    sys.exit(main())
