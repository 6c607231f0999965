"""Logs to be judged on: a surface, a nuisance and a motion are a cell; a cell and a seed are a log."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foreign import worlds
from foreign.motions import BY_FORCE, MOTIONS, course, drifting, tracked
from foreign.recording import BEGIN, Recording, recorded
from foreign.surfaces import SURFACES, Surface, Touched, press, random_surface, touch
from foreign.truth import Dense, Range, parameters

Array = NDArray[np.float64]
Rng = np.random.Generator

_DENSE = 8000.0
_LATER = 0.15
"""By how much more a Butterworth delays below half of its cut-off than it delays what is slow, relative."""


@dataclass(frozen=True)
class Cell:
    """What a log is about, by name."""

    surface: str
    nuisance: str
    motion: str = "any"

    def __str__(self) -> str:
        return f"{self.surface}/{self.nuisance}/{self.motion}"


@dataclass(frozen=True)
class Plan:
    """All that is decided before the press is simulated.

    Args:
        surface, motion: what is pressed on, and how.
        recording: how it is written down.
        told: what `identify` is told.
        largest: force that a depth of one stands for [N].
        starts: air, rest or midst.
        leaves: whether the log goes on until the probe is in free motion again.
        moving: how far the surface's height wanders, over the depth.
        breathing: how far it rises and falls every few seconds, over the depth.
        repeats: by how much the force of one stretch differs from the next's, relative.
    """

    surface: Surface
    motion: str
    recording: Recording
    told: Mapping[str, Any] = field(default_factory=dict)
    largest: float = 10.0
    starts: str = "air"
    leaves: bool = True
    moving: float = 0.0
    breathing: float = 0.0
    repeats: float = 0.0


@dataclass(frozen=True)
class Log:
    """A log, its truth, and what is told of it.

    Args:
        cell, seed: what makes it again.
        plan: what was decided.
        time, position, force: columns [s], [m], [N], shape (n,).
        options: keyword arguments of `identify`.
        truth: lowest and highest of K, B, M.
        defined: those of them that the surface has as one number.
        lag: lowest and highest of the force's delay [s].
        dense: the press without sensors, within the span of the log.
    """

    cell: Cell
    seed: int
    plan: Plan
    time: Array
    position: Array
    force: Array
    options: dict[str, Any]
    truth: dict[str, Range]
    defined: frozenset[str]
    lag: Range
    dense: Dense


def make_log(cell: Cell, seed: int) -> Log:
    """The log of a cell and a seed: the same every time."""
    rng = np.random.default_rng([seed, zlib.crc32(str(cell).encode())])
    return log_of_plan(planned(cell, rng), rng, cell, seed)


def planned(cell: Cell, rng: Rng) -> Plan:
    """What is decided of a log, drawn at random within its cell."""
    surface = random_surface(cell.surface, rng)
    largest = float(np.exp(rng.uniform(np.log(3), np.log(25)))) * float(
        np.clip(surface_stiffness(surface) / 5e3, 1, 4)
    )
    largest = min(largest, float(np.max(surface.static(np.linspace(0, 0.015, 500)))))
    if surface.name == "falling":
        largest = float(surface.static(np.array([-2.0 * surface["K2"] / (2.35 * surface["K3"]) * 0.98]))[0])
    rate = float(rng.choice([250, 500, 1000, 1000, 2000]))
    noise = largest * float(np.exp(rng.uniform(np.log(5e-4), np.log(1e-2))))
    fine = surface.depth_of(largest) * float(np.exp(rng.uniform(np.log(5e-5), np.log(1e-3))))
    recording = Recording(rate, noise, position_noise=fine, bias=float(rng.normal()) * 0.05 * largest)
    motion = cell.motion if cell.motion != "any" else str(rng.choice(MOTIONS))
    told = {"lag": 0.0} if rng.uniform() < 0.5 else {}
    plan = Plan(surface, motion, recording, told, largest)
    if cell.nuisance == "mixture":
        chosen = rng.choice(len(MIXED), int(rng.integers(2, 5)), replace=False)
        for i in sorted(chosen):
            plan = NUISANCES[MIXED[i]](plan, rng)
        if cell.motion != "any":
            plan = replace(plan, motion=cell.motion)
        return plan
    plan = (NUISANCES | WORLDS)[cell.nuisance](plan, rng)
    return plan if cell.motion == "any" else replace(plan, motion=cell.motion)


def surface_stiffness(surface: Surface) -> float:
    """A number that says how stiff it is [N/m]: secant at 3 N."""
    depth = surface.depth_of(3.0)
    return float(surface.static(np.array([depth]))[0] / depth)


@dataclass(frozen=True)
class Pressed:
    """A press before it is written down.

    Args:
        dt: step [s].
        x, acceleration: of the probe against the surface at rest [m], [m/s^2], shape (n,).
        height: of the surface [m], (n,); the position that is written is x + height.
        touched: what happened at the surface.
        span: what of it the log shows [s].
    """

    dt: float
    x: Array
    acceleration: Array
    height: Array
    touched: Touched
    span: Range


def log_of_plan(plan: Plan, rng: Rng, cell: Cell, seed: int) -> Log:
    """Simulate the press, write it down, cut it, and say what is true of it."""
    rate = plan.recording.rate
    dt = 1 / (rate * np.ceil(_DENSE / rate))
    deep = plan.surface.depth_of(plan.largest)
    gap = float(rng.uniform(0.1, 0.5)) + 0.3e-3 / deep * float(rng.uniform(0, 1))
    way = course(plan.motion, rng, dt, rate, gap)
    t = np.arange(len(way.command)) * dt
    if way.by_force:
        gain = float(rng.uniform(6, 15)) * deep / plan.largest
        x, _, a, touched = press(plan.surface, plan.largest * way.command, -0.1 * deep, gain, dt)
    else:
        x, v, a = tracked(deep * way.command, float(rng.uniform(15, 40)), dt)
        touched = touch(plan.surface, x, v, a, dt)
    still = way.by_force or not plan.moving
    height = np.zeros_like(x) if still else drifting(t, plan.moving * deep, rng)
    touched = replace(touched, force=touched.force * _repeats(t, plan.repeats, rng))
    touched = replace(touched, force=plan.recording.world.felt(x, touched.force))
    height = height + float(rng.uniform(-0.05, 0.3))
    if plan.breathing:
        height = height + plan.breathing * deep * np.sin(2 * np.pi * float(rng.uniform(0.15, 0.4)) * t)
    span = _cut(plan, way.base, way.begin, way.end, t[-1], rng)
    return written(plan, Pressed(dt, x, a, height, touched, span), rng, cell, seed)


def written(plan: Plan, pressed: Pressed, rng: Rng, cell: Cell, seed: int) -> Log:
    """A press as its recording leaves it, with what is true of it."""
    r, dt, (begin, end) = plan.recording, pressed.dt, pressed.span
    seen = pressed.x + pressed.height
    times, position, newton = recorded(r, seen, pressed.acceleration, pressed.touched.force, dt, rng)
    rows = (times + BEGIN >= begin) & (times + BEGIN <= end)
    t = np.arange(len(pressed.x)) * dt
    inside = (t >= begin) & (t <= end)
    dense = Dense(
        dt, *(s[inside] for s in (pressed.touched.depth, pressed.touched.force, pressed.touched.contact))
    )
    truth, defined = parameters(plan.surface, dense, r.payload)
    if isfinite(r.series) and "series_stiffness" not in plan.told:
        truth = _through(r.series, truth)
    late = _LATER * (r.whole_lag - r.lag) if "force_filter" not in plan.told else 0.0
    early, later = r.world.lag
    between = 0.5 / r.position_rate if r.position_rate else 0.0
    lag = (
        r.whole_lag + early - between - (r.hold_position - 1) / r.rate,
        r.whole_lag + later + between + late + (r.hold_force - 1) / r.rate,
    )
    truth["K"] = truth["K"][0], truth["K"][1] + r.world.spring
    return Log(
        cell, seed, plan, times[rows] - times[rows][0], position[rows], newton[rows], dict(plan.told), truth,
        defined, lag, dense,
    )  # fmt: skip


def _through(arm: float, truth: Mapping[str, Range]) -> dict[str, Range]:
    """What K, B and M may be called through an arm that nobody told of: the surface's, or those of both in series.

    K s -> K k/(K + k), and the next terms of the series in s: B r^2 and M r^2 - B^2 r^2/(K + k) with r = k/(K + k).
    """
    k, b, m = (truth[name] for name in ("K", "B", "M"))
    share = arm / (max(k[1], 0.0) + arm)
    least = share**2 * (m[0] - b[1] ** 2 / (max(k[0], 0.0) + arm))
    return {"K": (k[0] * arm / (k[0] + arm), k[1]), "B": (b[0] * share**2, b[1]), "M": (least, m[1])}


def _repeats(t: Array, spread: float, rng: Rng) -> Array:
    """A factor that goes smoothly from one level to the next about every second, shape (n,)."""
    if not spread:
        return np.ones_like(t)
    knots = np.arange(0, t[-1] + 2, 1.0)
    return 1 + np.interp(t, knots, spread * rng.normal(size=len(knots)))


def _cut(plan: Plan, base: float, begin: float, end: float, last: float, rng: Rng) -> tuple[float, float]:
    first = {"air": 0.0, "rest": base + 0.1, "midst": begin + float(rng.uniform(0.1, 0.35)) * (end - begin)}
    stop = last if plan.leaves else end - float(rng.uniform(0.0, 0.1)) * (end - begin)
    return first[plan.starts], stop


def _record(plan: Plan, **changes: Any) -> Plan:
    return replace(plan, recording=replace(plan.recording, **changes))


def _tell(plan: Plan, **told: Any) -> Plan:
    """What is told, None for what is not."""
    return replace(plan, told={k: v for k, v in {**plan.told, **told}.items() if v is not None})


def _moves(plan: Plan, rng: Rng, *motions: str) -> Plan:
    return plan if plan.motion in motions else replace(plan, motion=str(rng.choice(motions)))


def _clean(plan: Plan, rng: Rng) -> Plan:
    return plan


def _low_rate(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, rate=float(rng.choice([65, 80, 100, 125])))


def _high_rate(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, rate=4000.0)


def _jitter(plan: Plan, rng: Rng) -> Plan:
    size = float(rng.uniform(0.1, 0.8))
    return _record(plan, jitter=size) if rng.uniform() < 0.5 else _record(plan, stamp_noise=0.5 * size)


def _stamps(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, stamp_count=1e-3)


def _held_force(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, hold_force=int(rng.integers(2, 9)))


def _held_position(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, hold_position=int(rng.integers(2, 9)))


def _held_steady(plan: Plan, rng: Rng) -> Plan:
    return _moves(_record(plan, hold_force=int(rng.integers(3, 9))), rng, "ramps", "ramp-hold")


def _lag_told(plan: Plan, rng: Rng) -> Plan:
    lag = float(rng.uniform(0.001, 0.02))
    return _tell(_record(plan, lag=lag), lag=lag, lag_std=None)


def _lag_std(plan: Plan, rng: Rng) -> Plan:
    lag = float(rng.uniform(0.002, 0.02))
    std = float(rng.uniform(0.05, 0.3)) * lag
    return _tell(_record(plan, lag=lag), lag=float(rng.normal(lag, std)), lag_std=std)


def _lag_unknown(plan: Plan, rng: Rng) -> Plan:
    return _tell(_record(plan, lag=float(rng.uniform(0.001, 0.02))), lag=None, lag_std=None)


def _filter(plan: Plan, rng: Rng) -> Plan:
    order = int(rng.integers(1, 5))
    cutoff = float(np.exp(rng.uniform(np.log(15), np.log(0.2 * plan.recording.rate))))
    return _record(
        plan, low_pass=(order, round(cutoff, 1)), lag=float(rng.choice([0.0, rng.uniform(0, 0.01)]))
    )


def _filter_told(plan: Plan, rng: Rng) -> Plan:
    plan = _filter(plan, rng)
    order, cutoff = plan.recording.low_pass
    return _tell(
        plan, force_filter=f"butterworth{order}:{cutoff:g}", lag=plan.recording.whole_lag, lag_std=None
    )


def _filter_unknown(plan: Plan, rng: Rng) -> Plan:
    plan = _filter(plan, rng)
    told = plan.recording.whole_lag if rng.uniform() < 0.5 else None
    return _tell(plan, lag=told, lag_std=None, force_filter=None)


def _coloured(plan: Plan, rng: Rng) -> Plan:
    noise = plan.largest * float(rng.uniform(2e-3, 1.5e-2))
    return _record(plan, colour=float(np.exp(rng.uniform(np.log(2e-3), np.log(0.2)))), force_noise=noise)


def _encoder(plan: Plan, rng: Rng) -> Plan:
    counts = float(np.exp(rng.uniform(np.log(4), np.log(60))))
    return _record(plan, position_count=plan.surface.depth_of(plan.largest) / counts)


def _drift(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, drift=float(rng.choice([-1, 1]) * rng.uniform(0.02, 0.25)) * plan.largest)


def _bias(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, bias=float(rng.choice([-1, 1]) * rng.uniform(0.2, 2)) * plan.largest)


def _spikes(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, spikes=float(np.exp(rng.uniform(np.log(5e-4), np.log(1e-2)))))


def _saturation(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, range=plan.largest * float(rng.uniform(0.55, 0.85)), bias=0.0)


def _payload(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, payload=float(rng.choice([-1, 1]) * rng.uniform(0.1, 1.0)))


def _series_told(plan: Plan, rng: Rng) -> Plan:
    arm = surface_stiffness(plan.surface) * float(rng.uniform(1.5, 15))
    return _tell(
        _record(plan, series=arm), series_stiffness=arm, series_std=float(rng.choice([0, 0.03])) * arm
    )


def _series_untold(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, series=surface_stiffness(plan.surface) * float(rng.uniform(8, 40)))


def _varying(plan: Plan, rng: Rng) -> Plan:
    return replace(plan, repeats=float(rng.uniform(0.01, 0.05)))


def _start_rest(plan: Plan, rng: Rng) -> Plan:
    return _steady(replace(plan, starts="rest"), rng)


def _start_midst(plan: Plan, rng: Rng) -> Plan:
    return replace(plan, starts="midst")


def _never_leaves(plan: Plan, rng: Rng) -> Plan:
    return _steady(replace(plan, starts=str(rng.choice(["rest", "midst"])), leaves=False), rng)


def _steady(plan: Plan, rng: Rng) -> Plan:
    away = ("taps", "ramps", "ramp-hold")
    return plan if plan.motion not in away else _moves(plan, rng, *[m for m in MOTIONS if m not in away])


def _moving(plan: Plan, rng: Rng) -> Plan:
    plan = _moves(plan, rng, "dither", "dither", "sine", "multisine")
    rate = float(rng.choice([65, 125, 500]))
    return replace(_record(plan, rate=rate), moving=float(rng.uniform(0.1, 0.5)))


def _glued(plan: Plan, rng: Rng) -> Plan:
    plan = _steady(replace(plan, surface=replace(plan.surface, glued=True)), rng)
    return _tell(replace(plan, starts="rest", leaves=False), bonded=True)


NUISANCES: dict[str, Callable[[Plan, Rng], Plan]] = {
    "clean": _clean,
    "low-rate": _low_rate,
    "high-rate": _high_rate,
    "jitter": _jitter,
    "ms-stamps": _stamps,
    "held-force": _held_force,
    "held-position": _held_position,
    "held-steady": _held_steady,
    "lag-told": _lag_told,
    "lag-std": _lag_std,
    "lag-unknown": _lag_unknown,
    "filter-told": _filter_told,
    "filter-unknown": _filter_unknown,
    "coloured": _coloured,
    "encoder": _encoder,
    "drift": _drift,
    "bias": _bias,
    "spikes": _spikes,
    "saturation": _saturation,
    "payload": _payload,
    "series-told": _series_told,
    "series-untold": _series_untold,
    "repeats": _varying,
    "start-rest": _start_rest,
    "start-midst": _start_midst,
    "never-leaves": _never_leaves,
    "moving": _moving,
    "glued": _glued,
}


def _world(plan: Plan, world: worlds.World) -> Plan:
    return _record(plan, world=world)


def _share(low: float, high: float, rng: Rng) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _deep(plan: Plan) -> float:
    return plan.surface.depth_of(plan.largest)


def _averaged(plan: Plan, rng: Rng) -> Plan:
    width = _share(0.02, 0.1, rng)
    plan = plan if rng.uniform() < 0.5 else _record(plan, rate=round(float(rng.choice([1, 2])) / width))
    return _world(plan, worlds.averaged(width))


def _summing(plan: Plan, rng: Rng) -> Plan:
    return _world(_tell(plan, lag=None), worlds.moving_average(_share(0.005, 0.03, rng)))


def _merged(plan: Plan, rng: Rng) -> Plan:
    return _tell(_record(plan, position_rate=float(rng.choice([50, 100, 125]))), lag=None)


def _position_end(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.at_end(float(rng.uniform(0.5, 0.9))))


def _decaying(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.decaying(_share(3, 60, rng)))


def _creeping(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.creeping(_share(0.002, 0.02, rng), _share(1, 20, rng)))


def _guided(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.guided(_share(0.02, 0.15, rng), _deep(plan) * _share(0.005, 0.04, rng)))


def _breathing(plan: Plan, rng: Rng) -> Plan:
    return replace(_moves(plan, rng, "dither", "sine", "multisine"), breathing=_share(0.02, 0.3, rng))


def _short(plan: Plan, rng: Rng) -> Plan:
    return _record(plan, rate=float(rng.uniform(8, 25)))


def _sticky(plan: Plan, rng: Rng) -> Plan:
    return _world(
        plan, worlds.sticky(plan.largest * _share(0.02, 0.2, rng), _deep(plan) * _share(0.02, 0.3, rng))
    )


def _cabled(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.cabled(plan.largest / _deep(plan) * _share(0.005, 0.05, rng)))


def _humming(plan: Plan, rng: Rng) -> Plan:
    size, phase = plan.largest * _share(0.003, 0.05, rng), float(rng.uniform(0, 6))
    return _world(plan, worlds.humming(size, float(rng.choice([50, 60])), phase))


def _playing(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.playing(_deep(plan) * _share(0.005, 0.1, rng)))


def _late_position(plan: Plan, rng: Rng) -> Plan:
    return _world(_tell(plan, lag=None), worlds.late_position(_share(0.001, 0.008, rng)))


def _networked(plan: Plan, rng: Rng) -> Plan:
    return _world(_tell(plan, lag=None), worlds.networked(_share(0.002, 0.02, rng), rng))


def _two_clocks(plan: Plan, rng: Rng) -> Plan:
    return _world(_tell(plan, lag=None), worlds.two_clocks(_share(1e-4, 2e-3, rng)))


def _ringing(plan: Plan, rng: Rng) -> Plan:
    return _world(plan, worlds.ringing(_share(30, 150, rng), _share(0.01, 0.1, rng)))


WORLDS: dict[str, Callable[[Plan, Rng], Plan]] = {
    "averaged": _averaged,
    "summing": _summing,
    "merged": _merged,
    "position-end": _position_end,
    "decaying": _decaying,
    "creeping": _creeping,
    "guided": _guided,
    "breathing": _breathing,
    "short": _short,
    "sticky": _sticky,
    "cabled": _cabled,
    "humming": _humming,
    "playing": _playing,
    "late-position": _late_position,
    "networked": _networked,
    "two-clocks": _two_clocks,
    "ringing": _ringing,
}
MIXED = tuple(name for name in NUISANCES if name not in ("clean", "glued"))
CELLS = tuple(Cell(s, n) for s in SURFACES for n in (*NUISANCES, "mixture"))
WORLD_CELLS = tuple(Cell(s, n) for s in SURFACES for n in WORLDS)
assert set(BY_FORCE) <= set(MOTIONS)
