"""A rig without arm and control: a tip on a prescribed path presses a surface, and the bench's instruments watch."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law
from palpate.arrays import Array
from palpate.bench.force_input import ForceInput, ForceInputState, force_input
from palpate.bench.tables import ForceSensorTable
from palpate.environments import SurfaceState, join
from palpate.environments.surface import follow, members, rest_for
from palpate.errors import InputError
from palpate.records import Record
from palpate.signals.samples import quantise

Path = Callable[[Array], Array] | ArrayLike
"""A function of times [s], or positions [m] at ticks, shape (n,)."""
MIN_TICKS = 4
"""Ticks that a path must have: a cubic spline needs so many."""


def positions(path: Path, duration: float | None, tick: float, steps: int) -> Array:
    """Positions [m] at each step of n ticks, and at one step before and after: shape (n steps + 2,).

    Raises:
        InputError: no finite numbers, another shape, a duration that is missing, too short or not asked for.
    """
    if callable(path):
        x = _sample_function(path, duration, tick, steps)
    else:
        if duration is not None:
            raise InputError(
                "duration belongs to a path that is a function; an array has its own, leave it out"
            )
        x = _interpolate(np.asarray(path, dtype=np.float64), steps)
    if not np.isfinite(x).all():
        raise InputError("path must be finite numbers, got some that are not; look for NaN in it")
    return x


def _sample_function(
    path: Callable[[Array], Array],
    duration: float | None,
    tick: float,
    steps: int,
) -> Array:
    if duration is None or not duration >= MIN_TICKS * tick:
        raise InputError(
            f"duration must be at least {MIN_TICKS * tick:g} s for a path that is a function, got {duration}"
        )
    times: Array = np.arange(-1.0, round(duration / tick) * steps + 1) * (tick / steps)
    x = np.asarray(path(times), dtype=np.float64)
    if x.shape != times.shape:
        raise InputError(f"path must give one position for each time, {times.shape}, got {x.shape}")
    return x


def _interpolate(at_ticks: Array, steps: int) -> Array:
    """Interpolate by a cubic spline, whose acceleration has no jumps."""
    from scipy.interpolate import CubicSpline

    if at_ticks.ndim != 1 or len(at_ticks) < MIN_TICKS:
        raise InputError(
            f"path must be of shape (n,), one position a tick, with n at least {MIN_TICKS}; got {at_ticks.shape}"
        )
    if not np.isfinite(at_ticks).all():
        return at_ticks
    spline = CubicSpline(np.arange(len(at_ticks)), at_ticks)
    powers = (np.arange(steps) / steps) ** np.arange(3, -1, -1)[:, None]
    inside = (spline.c.T @ powers).ravel()
    before = spline(-1.0 / steps)
    last = spline(len(at_ticks) - 1 + np.arange(steps + 1) / steps)
    return np.concatenate([[before], inside, last])


COLUMNS = {
    "t": "s",
    "x": "m",  # true, of the tip
    "x_measured": "m",
    "force": "N",  # true, at t; an impact's impulse has no value at an instant and is in the sampled force only
    "force_sampled": "N",
}
SENSOR = ForceSensorTable()
RIGID = 1e12
"""Effective mass of a tip that nothing turns from its path [kg]."""


@law
def march_path(surface, line, state, way, x, rest, k, steps, noise, out):
    """len(noise) ticks, the first being the k-th; of each the true force and the reading, into a row of `out`.

    `x` holds the path at the steps of the physics, one more before the first and after the last.
    """
    dt = 1.0 / line.sensor.rate
    for i in range(len(noise)):
        for j in range(steps):
            n = i * steps + j
            before, now, after = x[n] - rest, x[n + 1] - rest, x[n + 2] - rest
            force = 0.0
            if state.contact == 1.0:
                force = surface.force(state, now, (after - before) / (2.0 * dt))
                force += surface.mass * (after - 2.0 * now + before) / (dt * dt)
            if j == 0:
                out[i, 0], out[i, 1] = max(force, 0.0), line.reading(way)
            state, impulse = follow(surface, state, force, after, (after - now) / dt, RIGID, dt)
            way = line.advance(way, max(force, 0.0) + impulse / dt, k * steps + n, noise[i])
    return state, way


compiled_march = kernel(march_path)


@dataclass(frozen=True)
class GivenMotion:
    """A tip on a given path, surfaces in turn, and instruments; `given_motion` makes it.

    Args:
        surfaces: each with the time from which on it is there [s], in their order, the first from 0.
        wall: where the first is undeformed [m].
        line: the force's way to its reading.
        resolution: of the position's encoder [m]; 0: none.
        steps: of the physics between ticks.
    """

    surfaces: tuple[tuple[float, Any], ...]
    wall: float
    line: ForceInput
    resolution: float
    steps: int

    @property
    def tick(self) -> float:
        """Time between two rows [s]."""
        return self.steps / self.line.sensor.rate

    def run(
        self, path: Path, duration: float | None = None, seed: int = 0, *, compiled: bool = True
    ) -> Record:
        """Move the tip along a path that grows into the surface.

        A path that starts in contact starts as after a long rest there.

        Args:
            path: x of the tip [m]: a function of an array of times [s] (also of a step before 0 and after the end);
                or an array, (n,) with one value a tick, between which it is interpolated by a cubic spline.
            duration: [s]; of a function only, an array has its own.
            seed: of the noise; the same seed gives the same record, bit for bit.
            compiled: False runs the same code in plain Python.

        Returns:
            One row a tick, from 0 on. ``meta["surfaces"]`` has each surface's start, rest position and truth.

        Raises:
            InputError: a path without finite numbers or of another shape, a duration that is missing or too short.
        """
        x = positions(path, duration, self.tick, self.steps)
        ticks = (len(x) - 2) // self.steps
        noise = np.random.default_rng(seed).standard_normal(ticks + 2)
        rows = np.empty((ticks, 2))
        rests = self._march(x, noise, rows, compiled)
        t: Array = np.arange(float(ticks)) * self.tick
        at = x[1 : 1 + ticks * self.steps : self.steps].copy()
        read = quantise(at, self.resolution) if self.resolution > 0.0 else at.copy()
        columns = (t, at, read, rows[:, 0].copy(), rows[:, 1].copy())
        return Record(
            dict(zip(COLUMNS, columns, strict=True)), COLUMNS, {**self._description(rests), "seed": seed}
        )

    def _march(self, x: Array, noise: Array, rows: Array, compiled: bool) -> list[float]:
        """Fill the rows, surface by surface; return the rest positions of the reached surfaces [m]."""
        march = compiled_march if compiled else march_path
        rest_position, rests = self.wall, []
        state, line_state = self._start(x, noise)
        for i, (first, last) in enumerate(self._spans(len(rows))):
            surface = self.surfaces[i][1]
            if i > 0 and state.contact == 1.0:
                rest_position, state = self._next_surface(i, state, x[first * self.steps :], rest_position)
            rests.append(rest_position)
            piece = x[first * self.steps : last * self.steps + 2]
            numbers = noise[first:last], rows[first:last]
            state, line_state = march(
                surface, self.line, state, line_state, piece, rest_position, first, self.steps, *numbers
            )
        return rests

    def _spans(self, ticks: int) -> list[tuple[int, int]]:
        """First and last tick of each surface that is reached."""
        starts = [round(since / self.tick) for since, _ in self.surfaces]
        return list(pairwise([*(start for start in starts if start < ticks), ticks]))

    def _start(self, x: Array, noise: Array) -> tuple[SurfaceState, ForceInputState]:
        surface = self.surfaces[0][1]
        now, rate, second = self._motion(x, self.wall)
        state, force = surface.start(), 0.0
        if now > 0.0:
            state = SurfaceState(now, rate, 0.0, 1.0)
            force = max(surface.force(state, now, rate) + surface.mass * second, 0.0)
        return state, self.line.settled_at(force, noise[-1], noise[-2])

    def _next_surface(
        self, i: int, state: SurfaceState, x: Array, rest_position: float
    ) -> tuple[float, SurfaceState]:
        """Rest position [m] and state of the i-th surface, relaxed, under the force that there is already."""
        old, new = self.surfaces[i - 1][1], self.surfaces[i][1]
        now, rate, second = self._motion(x, rest_position)
        force = old.force(state, now, rate) + old.mass * second
        depth = rest_for(new, force - new.mass * second, rate)
        return rest_position + now - depth, SurfaceState(depth, rate, 0.0, 1.0)

    def _motion(self, x: Array, rest_position: float) -> tuple[float, float, float]:
        """Penetration, rate and acceleration at the second of these positions."""
        physics = float(self.line.sensor.rate)
        before, now, after = (float(at) - rest_position for at in x[:3])
        return now, (after - before) * 0.5 * physics, (after - 2.0 * now + before) * physics * physics

    def _description(self, rests: list[float]) -> dict[str, Any]:
        """Metadata of the record, in plain values."""
        described = [
            {"from_s": since, "rest_m": rest_position, "truth": _truth(surface)}
            for (since, surface), rest_position in zip(self.surfaces, rests, strict=False)
        ]
        instruments = {"force": self.line.description(), "position": {"lag_s": 0.0}}
        return {"truth": described[-1]["truth"], "surfaces": described, "instruments": instruments}


def given_motion(
    surface: Any | list[tuple[float, Any]],
    *,
    wall: float = 0.0,
    resolution: float = 5e-6,
    sensor: ForceSensorTable = SENSOR,
    rate: int = 1000,
    steps: int = 20,
) -> GivenMotion:
    """A tip on a given path, before the thesis' instruments.

    Args:
        surface: one of `palpate.environments` or your own part; or a list of several in turn,
            each with the time [s] from which on it is there, the first from 0. A surface that comes while another is
            pressed has the rest length that leaves the force as it is.
        wall: where the first surface is undeformed [m].
        resolution: of the encoder, in the tip's position [m]; 0: none.
        sensor: of the force, as an experiment's `[force_sensor]` has it; the thesis' own if not given.
        rate: rows a second.
        steps: of the physics between them.

    Raises:
        InputError: a number out of range, surfaces out of order.
    """
    for name, value, least in (("rate", rate, 1), ("steps", steps, 1), ("resolution", resolution, 0.0)):
        if not value >= least:
            raise InputError(f"{name} must be at least {least}, got {value}")
    line = force_input(sensor, rate * steps, sensor.full_scale)
    return GivenMotion(_in_turn(surface), float(wall), line, float(resolution), int(steps))


def _in_turn(surface: Any | list[tuple[float, Any]]) -> tuple[tuple[float, Any], ...]:
    turns = surface if isinstance(surface, list) else [(0.0, surface)]
    if not turns or turns[0][0] != 0.0 or any(b <= a for (a, _), (b, _) in pairwise(turns)):
        raise InputError(
            f"surfaces must start at growing times [s], the first at 0, got {[t for t, _ in turns]}"
        )
    return tuple(
        (float(since), join(part) if type(part) in map(type, members()) else part) for since, part in turns
    )


def _truth(surface: Any) -> dict[str, dict[str, Any]]:
    """{name: {"value", "unit"}}; empty for a part without `truth`."""
    truth = surface.truth() if hasattr(surface, "truth") else {}
    return {name: {"value": value, "unit": unit} for name, (value, unit) in truth.items()}
