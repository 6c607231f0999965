"""Slides judged by a simulator that was written from the contract of `SlidingLoop` alone, before its law was read.

A spherical probe on an exact sphere or on a mesh of triangles (saddle, waves; edges of 2 mm among the ordinary errors),
with a contact law F = a p^e and elastic-plastic Coulomb friction. The arm is a delay and two equal first-order lags
with the printed lag in total, in series with its compliance, or yielding to the force if torques control it; the
sensor has two poles, its own clock and white noise. Ordinary errors: bandwidth 20 % off, bias 0.15 N, drift 0.01 N/s,
cross-talk 2 %.

    python benchmarks/judge/slide_judge.py --slides 40

Each row: seconds from the first contact until the slide begins, the largest true normal force before it and during it,
slides within 3 % rms and 10 % half a second later, in the printed domain too, and how often the intervals hold.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numba
import numpy as np

from palpate.force import SlidingLoop

SUBSTEPS = 4
PROBE_RADIUS = 0.006
SECONDS_OF_SLIDE = 4.0
TIMEOUT = 40.0


@cache
def tuned(arm, force, speed):
    """The printed summary and the gains that `palpate tune --slide` writes for a case, as (dict, dict, path)."""
    path = Path(tempfile.gettempdir()) / f"slide-judge-{arm}-{force:g}-{speed:g}.toml"
    path.unlink(missing_ok=True)
    call = [
        "palpate",
        "tune",
        "--stiffness",
        "1e3:4e4",
        "--arm",
        arm,
        "--force",
        str(force),
        "--slide",
        "--json",
    ]
    call[0] = str(Path(sys.executable).parent / call[0])
    call += ["--mu-max", "0.9", "--speed", f"{1e3 * speed:g}:mm/s", "--radius", "100:mm", "--out", str(path)]
    printed = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)  # noqa: S603
    return printed, tomllib.loads(path.read_text(encoding="utf-8")), path


@dataclass(frozen=True)
class Case:
    """One slide: lengths in m, forces in N, angles in rad; `faults` scales the ordinary errors of arm and sensor."""

    arm: str
    force: float
    speed: float
    shape: str
    radius: float
    stiffness: float
    exponent: float
    friction: float
    tilt: tuple[float, float]
    heading: float
    faults: float
    seed: int


def draw_case(arm, exponent, faults, seed):
    """Draw a case within what the gains were made for."""
    rng = np.random.default_rng([seed, int(100 * exponent), int(faults)])
    return Case(
        arm,
        float(rng.choice([5.0, 15.0])),
        float(rng.choice([0.015, 0.03])),
        str(rng.choice(["sphere", "saddle", "waves"])),
        float(rng.uniform(0.12, 0.5)),
        float(np.exp(rng.uniform(np.log(3e3), np.log(3.5e4)))),
        exponent,
        float(rng.uniform(0.05, 0.8)),
        tuple(np.clip(rng.normal(0, np.radians(7.0), 2), -0.25, 0.25)),
        float(rng.uniform(0, 2 * np.pi)),
        faults,
        seed,
    )


def heights(case, x, y):
    """Height of the saddle or the waves [m]; the least radius of curvature is that of the case."""
    if case.shape == "saddle":
        return (x**2 - y**2) / (2 * case.radius)
    length = 0.06 / (2 * np.pi)
    return length**2 / case.radius * np.sin(x / length) * np.cos(y / (3 * length))


def make_mesh(case):
    """Nodes of a regular mesh over 160 mm x 160 mm, shape (n, n), and its spacing [m]; facets are 2 mm with faults."""
    spacing = 0.002 if case.faults else 0.001
    x = np.arange(-0.08, 0.08 + spacing / 2, spacing)
    return heights(case, x[:, None], x[None, :]), spacing


@numba.njit(cache=True)
def nearest_on_triangle(p, a, b, c):
    """Nearest point of a triangle: the foot of the perpendicular if inside, else the nearest one of its edges."""
    u, v, w = b - a, c - a, p - a
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    det = uu * vv - uv * uv
    s, t = (vv * uw - uv * vw) / det, (uu * vw - uv * uw) / det
    if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
        return a + s * u + t * v
    best, least = a, np.inf
    for begin, end in ((a, b), (b, c), (c, a)):
        edge = end - begin
        q = begin + min(max((p - begin) @ edge / (edge @ edge), 0.0), 1.0) * edge
        if (p - q) @ (p - q) < least:
            best, least = q, (p - q) @ (p - q)
    return best


@numba.njit(cache=True)
def depth_and_normal(p, radius, mesh, spacing):
    """Penetration of the probe's sphere at `p` [m], negative in free motion, and the unit normal into the surface."""
    if radius > 0.0:
        from_centre = p - np.array([0.0, 0.0, -radius])
        distance = np.sqrt(from_centre @ from_centre)
        return radius + PROBE_RADIUS - distance, -from_centre / distance
    i0, j0 = int((p[0] + 0.08) / spacing), int((p[1] + 0.08) / spacing)
    reach, best, least = int(0.003 / spacing) + 1, p, np.inf
    for i in range(max(i0 - reach, 0), min(i0 + reach + 1, len(mesh) - 1)):
        for j in range(max(j0 - reach, 0), min(j0 + reach + 1, len(mesh) - 1)):
            x, y = i * spacing - 0.08, j * spacing - 0.08
            corner = np.array([x, y, mesh[i, j]])
            far = np.array([x + spacing, y + spacing, mesh[i + 1, j + 1]])
            for side in (
                np.array([x + spacing, y, mesh[i + 1, j]]),
                np.array([x, y + spacing, mesh[i, j + 1]]),
            ):
                q = nearest_on_triangle(p, corner, side, far)
                if (p - q) @ (p - q) < least:
                    best, least = q, (p - q) @ (p - q)
    distance = np.sqrt(least)
    sign = 1.0 if p[2] >= best[2] else -1.0
    return PROBE_RADIUS - sign * distance, -sign * (p - best) / max(distance, 1e-12)


@numba.njit(cache=True)
def tick_world(lags, bristle, filtered, force, command, dt, time_constant, contact, radius, mesh, spacing):
    """Move arm, contact and the sensor's filter on by a tick, in place: normal force [N] and true normal.

    `lags` (2, 3): the arm's two lags [m]; `bristle` (3,): deflection of the friction's spring [m]; `filtered` (2, 3)
    and the force on the surface `force` (3,) [N]; `contact`: coefficient, exponent, friction, tangential stiffness
    [N/m], compliance behind the encoders and yielding before them [m/N].
    """
    coefficient, exponent, friction, tangential, compliance, yielding = contact
    normal_force, normal = 0.0, np.zeros(3)
    for _ in range(SUBSTEPS):
        h = dt / SUBSTEPS
        before = lags[1].copy()
        gain = 1.0 - np.exp(-h / time_constant)
        lags[0] += gain * (command - yielding * force - lags[0])
        lags[1] += gain * (lags[0] - lags[1])
        depth, normal = depth_and_normal(lags[1], radius, mesh, spacing)
        normal_force = 0.0
        if depth > 0.0:
            low, high = 0.0, depth
            for _ in range(50):  # bisection: the arm yields by its compliance times the force
                middle = 0.5 * (low + high)
                if middle + compliance * coefficient * middle**exponent < depth:
                    low = middle
                else:
                    high = middle
            normal_force = coefficient * low**exponent
        bristle += lags[1] - before
        bristle -= (bristle @ normal) * normal
        length, longest = np.sqrt(bristle @ bristle), friction * normal_force / tangential
        if length > longest:
            bristle *= longest / length
        force[:] = normal_force * normal + tangential * bristle
        smoothing = 1.0 - np.exp(-h * 2 * np.pi * 120.0)
        filtered[0] += smoothing * (force - filtered[0])
        filtered[1] += smoothing * (filtered[0] - filtered[1])
    return normal_force, normal


class World:
    """Arm, surface and sensor of a case."""

    def __init__(self, case, gains):
        self.rng = rng = np.random.default_rng([case.seed, 1])
        inner, sensor = gains["arm"]["inner"], gains["arm"]["sensor"]
        self.dt = 1.0 / gains["arm"]["rate"]
        torque = inner["kind"] == "torque"
        lag = (
            inner["damping"] / inner["stiffness"]
            if torque
            else inner["damping"] / (np.pi * inner["bandwidth"])
        )
        self.time_constant = 0.5 * lag / (1 + 0.2 * case.faults * rng.choice([-1.0, 1.0]))
        self.sampling, self.noise = sensor["sampling"], sensor["noise"]
        direction = rng.normal(size=3)
        self.bias = 0.15 * case.faults * direction / np.linalg.norm(direction)
        self.drift = 0.01 * case.faults * rng.choice([-1.0, 1.0], 3) / np.sqrt(3)
        self.crosstalk = np.eye(3) + 0.02 * case.faults * rng.uniform(-1, 1, (3, 3)) * (1 - np.eye(3))
        compliance, yielding = (
            0.0 if inside != torque else 1.0 / inner["stiffness"] for inside in (False, True)
        )
        depth = case.exponent * case.force / case.stiffness
        coefficient = case.force / depth**case.exponent
        tangential = 1.0 / (1.0 / (0.8 * case.stiffness) + compliance)
        self.contact = (coefficient, case.exponent, case.friction, tangential, compliance, yielding)
        self.felt = 1.0 / (1.0 / case.stiffness + compliance)
        self.radius = case.radius if case.shape == "sphere" else -1.0
        self.mesh, self.spacing = make_mesh(case) if self.radius < 0 else (np.zeros((2, 2)), 1.0)
        top = 0.0 if self.radius > 0 else float(heights(case, 0.0, 0.0))
        start = np.array([0.0, 0.0, top + PROBE_RADIUS + 0.0015])
        self.lags, self.command = np.array([start, start]), start.copy()
        self.queue = [start.copy()] * round(inner["delay"] / self.dt)
        self.bristle, self.filtered, self.force, self.reading = (
            np.zeros(3),
            np.zeros((2, 3)),
            *np.zeros((2, 3)),
        )
        self.time, self.next_sample = 0.0, 0.0

    def step(self, velocity):
        """Command a velocity for a tick: true normal force [N] and normal, then `reading` and `position` are new."""
        self.command = self.command + self.dt * velocity
        self.queue.append(self.command)
        state = (
            self.lags,
            self.bristle,
            self.filtered,
            self.force,
            self.queue.pop(0),
            self.dt,
            self.time_constant,
        )
        force, normal = tick_world(*state, self.contact, self.radius, self.mesh, self.spacing)
        self.time += self.dt
        if self.time >= self.next_sample:
            self.next_sample += 1.0 / self.sampling
            clean = self.crosstalk @ self.filtered[1] + self.bias + self.drift * self.time
            self.reading = clean + self.noise * self.rng.normal(size=3)
        return force, normal

    @property
    def position(self):
        """Position of the tip by the encoders [m]: without the yielding of the arm."""
        return self.lags[1].copy()


def run_slide(case):
    """Run a case: its figures as a dict."""
    printed, gains, path = tuned(case.arm, case.force, case.speed)
    into = np.array([*np.tan(case.tilt), -1.0])
    loop, world = SlidingLoop.load(path, into / np.linalg.norm(into)), World(case, gains)
    heading = np.array([np.cos(case.heading), np.sin(case.heading), 0.0])
    turn = min(0.04, 0.5 * case.speed * SECONDS_OF_SLIDE) / case.speed
    contact, began, rows, peak, said = None, None, [], 0.0, set()
    while world.time < TIMEOUT and (began is None or world.time < began + SECONDS_OF_SLIDE):
        sign = 1.0 if began is None or (world.time - began) % (2 * turn) < turn else -1.0
        force, normal = world.step(loop.update(world.reading, world.position, sign * heading))
        contact = world.time if contact is None and force > 0 else contact
        said |= {loop.trouble} - {""}
        if began is None:
            peak = max(peak, force)
            began = world.time if loop.sliding else None
        else:
            angle = float(np.arccos(np.clip(normal @ loop.normal, -1, 1)))
            cone = loop.normal_cone95
            rows.append((world.time - began, force, angle <= cone, *estimates(loop, case, world)))
    judged = np.array([row for row in rows if row[0] > 0.5], dtype=float).reshape(-1, 5)
    error = judged[:, 1] / case.force - 1.0
    domain = printed["slide"]["domain"]["stiffness"]
    worst = float(np.abs(error).max()) if len(error) else np.inf
    return {
        "start": (began or TIMEOUT) - (contact or 0.0),
        "printed": printed["slide"].get("start_s", np.nan),
        "peak": peak / case.force,
        "worst": max((row[1] for row in rows), default=np.nan) / case.force,
        "obeys": worst <= 0.1 and np.sqrt(np.mean(error**2)) <= 0.03,
        "in_domain": domain[0] <= case.stiffness <= domain[1],
        "beyond": worst > 0.1,
        "said": bool(said),
        "holds": judged[:, 2:].mean(axis=0) if len(judged) else np.full(3, np.nan),
    }


def estimates(loop, case, world):
    """Whether the intervals of friction and stiffness hold the true values."""
    for quantity, truth in ((loop.friction, case.friction), (loop.stiffness, world.felt)):
        low, high = quantity.ci95 if quantity is not None else (np.nan, np.nan)
        yield low <= truth <= high


def print_row(name, results):
    """Print the row of a group of results."""
    column = {key: np.array([result[key] for result in results]) for key in results[0]}
    inside, beyond = column["in_domain"], column["beyond"]
    cells = [
        f"{np.median(column['start']):.2g} ({np.percentile(column['start'], 95):.2g})",
        f"{np.max(column['printed']):.2g}",
        f"{column['peak'].max():.2f}",
        f"{np.nanmax(column['worst']):.2f}",
        f"{column['obeys'].sum()} of {len(results)}",
        f"{column['obeys'][inside].sum()} of {inside.sum()}",
        ", ".join(f"{100 * fraction:.0f}" for fraction in np.nanmean(column["holds"], axis=0)) + " %",
        f"{(beyond & column['said']).sum()} of {beyond.sum()}",
    ]
    print("|", " | ".join([name, str(len(results)), *cells]), "|", flush=True)


def main():
    """Run all groups and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slides", type=int, default=20)
    parser.add_argument("--arms", nargs="*", default=["ur5e", "fr3"])
    arguments = parser.parse_args()
    heads = "start: median, 95 % [s]|printed|press: worst [F]|slide: worst [F]|obeys|in the domain"
    heads = f"arm, exponent, errors|slides|{heads}|cone, mu, K hold|said, where beyond 10 %".split("|")
    print("|", " | ".join(heads), "|\n" + "| --- " * len(heads) + "|")
    groups = list(product(arguments.arms, [(1.0, 0.0), (1.25, 0.0), (1.5, 0.0), (1.0, 1.0)]))
    for arm, (exponent, faults) in groups:
        name = f"{arm}, {exponent:g}, {'ordinary' if faults else 'none'}"
        cases = [draw_case(arm, exponent, faults, seed) for seed in range(arguments.slides)]
        print_row(name, [run_slide(case) for case in cases])


if __name__ == "__main__":
    main()
