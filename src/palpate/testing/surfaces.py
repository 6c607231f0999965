"""Laws of every surface of any model: it is passive, one-sided, and stable at any step."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate._jit import kernel
from palpate._jit import part as registered
from palpate.arrays import Array
from palpate.environments import SurfaceState, contact_force, impact, part_from, touch
from palpate.testing.check import Check, require

DT = 50e-6
"""A step of the physics [s]."""
_SEEDS = range(5)


def surface_checks(surface: Any) -> list[Check]:
    """The checks of a surface: a part with ``start``, ``force``, ``relax``, ``free`` and a mass."""
    registered(type(surface))
    return [Check(law, surface) for law in LAWS]


@kernel
def follow(surface, p, v, a, dt, out):
    """A tip in contact on a given path: at each sample the force [N], then deflection, rate and branch's stretch."""
    state = surface.start()
    for k in range(p.size):
        state = surface.relax(state, p[k], v[k], dt)
        out[k, 0] = surface.force(state, p[k], v[k]) + surface.mass * a[k]
        out[k, 1], out[k, 2], out[k, 3] = state.deflection, state.rate, state.internal


@kernel
def recover(surface, state, dt, out):
    """A free surface: deflection, rate and the branch's stretch after each step."""
    for k in range(out.shape[0]):
        state = surface.free(state, dt)
        out[k, 0] = state.deflection
        out[k, 1] = state.rate
        out[k, 2] = state.internal


@kernel
def press(surface, tip_mass, p, v, push, dt, out):
    """A tip of some mass under a push: penetration, rate, contact force, energy given to the surface."""
    state = surface.start()
    given = 0.0
    for k in range(push.size):
        force = 0.0
        if state.contact == 1.0:
            own = surface.force(state, p, v)
            force = contact_force(own, surface.mass, tip_mass, push[k] / tip_mass)
            if force < 0.0:
                force = 0.0
                state = part_from(state)
        before = v
        v += dt * (push[k] - force) / tip_mass
        p += dt * v
        given += dt * force * 0.5 * (before + v)
        if state.contact == 1.0:
            state = surface.relax(state, p, v, dt)
        else:
            state = surface.free(state, dt)
            if p >= state.deflection and v > state.rate:
                common, impulse = impact(tip_mass, surface.mass, v, state.rate)
                given += impulse * 0.5 * (v + common)
                v = common
                state = touch(state, common)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = p, v, force, given
    return state


def path(
    amplitudes: Sequence[float], frequencies: Sequence[float], depth: float, steps: int, dt: float
) -> tuple[Array, Array, Array]:
    """A smooth closed path, at rest at p = 0 at both ends, with rate and acceleration, each (steps,)."""
    time = np.arange(steps) * dt
    length = time[-1]
    window = np.sin(np.pi * time / length) ** 4
    p = np.zeros(steps)
    for amplitude, frequency in zip(amplitudes, frequencies, strict=True):
        p += amplitude * np.sin(2 * np.pi * frequency * time)
    p = depth * window * (1.0 + p)
    v = np.gradient(p, dt, edge_order=2)
    return p, v, np.gradient(v, dt, edge_order=2)


def gives_back_no_more(
    surface: Any, amplitudes: Sequence[float], frequencies: Sequence[float], depth: float
) -> None:
    """Check that the surface returns no more energy than it received, on a closed path of the tip."""
    p, v, a = path(amplitudes, frequencies, depth, 10000, DT)
    out = np.empty((p.size, 4))
    follow(surface, p, v, a, DT, out)
    force = out[:, 0]
    require(np.isfinite(force).all(), "pressed, its force is not finite")
    work = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(p))))
    # What the trapezoidal sums leave: they are second order in the step.
    slack = 2e-4 * np.max(np.abs(work))
    lost = work[::10]
    if hasattr(surface, "stored_energy"):
        lost = lost - np.array(
            [surface.stored_energy(SurfaceState(s, v, z, 1.0)) for _, s, v, z in out[::10]]
        )
    worst = float(min(np.min(lost) if hasattr(surface, "stored_energy") else 0.0, work[-1]))
    message = f"pressed by {1e3 * depth:.3g} mm it gives or stores {-worst:.3g} J more than it was given"
    require(worst >= -slack, message)


def never_gains_when_free(surface: Any, start: SurfaceState, dt: float, slack: float) -> None:
    """Check that the energy of a released surface only falls, within a relative slack."""
    out = np.empty((2000, 3))
    recover(surface, start, dt, out)
    states = [start, *(SurfaceState(s, v, z, 0.0) for s, v, z in out)]
    energy = np.array([surface.stored_energy(state) for state in states])
    require(np.isfinite(energy).all(), "released, its energy is not finite")
    require(np.all(np.diff(energy) <= slack * energy[0] + 1e-30), "released, it gains energy")


def never_pulls(surface: Any, tip_mass: float, speed: float, pushes: Sequence[float]) -> None:
    """Check that the contact force is one-sided under a push, and that the surface creates no energy."""
    push = np.interp(np.arange(8000) * DT, np.arange(8) * 0.05, pushes)
    out = np.empty((push.size, 4))
    press(surface, tip_mass, -1e-4, speed, push, DT, out)
    force = out[:, 2]
    energy = out[:, 3]
    require(np.all(np.isfinite(out)), "pressed, its numbers are not finite")
    require(np.all(force >= 0.0), f"it pulls with {-force.min():.3g} N")
    # The loop's own integration is first order: its error is a part of the energy that went through.
    through = 0.5 * tip_mass * np.max(out[:, 1] ** 2) + np.max(np.abs(energy))
    require(np.all(energy >= -0.02 * through), f"it gives {-energy.min():.3g} J more than it received")


def surface_is_passive(surface: Any) -> None:
    """The surface is passive on random closed paths."""
    for seed in _SEEDS:
        random = np.random.default_rng(seed)
        gives_back_no_more(
            surface,
            random.uniform(-0.5, 0.5, 3).tolist(),
            random.uniform(0.3, 40.0, 3).tolist(),
            float(random.uniform(1e-4, 5e-3)),
        )


def surface_never_pulls_or_adds_energy(surface: Any) -> None:
    """A surface under random pushes never pulls and gives no energy."""
    for seed in _SEEDS:
        random = np.random.default_rng(seed)
        mass = float(random.uniform(0.3, 10.0))
        speed = float(random.uniform(0.0, 0.3))
        never_pulls(surface, mass, speed, random.uniform(-30.0, 30.0, 8).tolist())


def thrown_tip_returns_slower(surface: Any) -> None:
    """And not at all faster than it came."""
    for speed in (0.01, 0.2):
        out = np.empty((20000, 4))
        press(surface, 1.0, -1e-6, speed, np.zeros(20000), DT, out)
        require(np.isfinite(out).all(), "after an impact, the tip's motion is not finite")
        require(np.max(out[:, 2]) > 0.0, "an impacting tip feels no force")
        require(out[-1, 1] < 0.0 and out[-1, 0] < 0.0, "an impacting tip does not rebound")
        require(abs(out[-1, 1]) <= speed * (1 + 2e-3), f"a tip rebounds at {-out[-1, 1]:.4g} m/s of {speed}")


def free_recovery_allows_any_step(surface: Any) -> None:
    """Steps of a millisecond to a quarter of an hour."""
    for dt in (1e-3, 1.0, 1e3):
        out = np.empty((200, 3))
        recover(surface, SurfaceState(1e-3, 0.0, 0.0, 0.0), dt, out)
        require(np.all(np.isfinite(out)), f"released, it is not finite after steps of {dt:g} s")
        require(np.max(np.abs(out[:, 0])) <= 1e-3 * (1 + 1e-9), f"released, it grows in steps of {dt:g} s")


def untouched_surface_stays_at_rest(surface: Any) -> None:
    """Without contact it does not move."""
    state = surface.start()
    for _ in range(5):
        state = surface.free(state, DT)
    require(tuple(state) == (0.0, 0.0, 0.0, 0.0), f"without contact, it moves to {tuple(state)}")


def compiled_surface_agrees_with_python(surface: Any) -> None:
    """Compiled, a surface gives the forces of plain Python bit for bit."""
    push = 15.0 * np.sin(np.arange(3000) * 0.004)
    plain = np.empty((3000, 4))
    compiled = np.empty((3000, 4))
    press.plain(surface, 1.5, -1e-4, 0.1, push, DT, plain)
    press(surface, 1.5, -1e-4, 0.1, push, DT, compiled)
    off = float(np.max(np.abs(plain - compiled)))
    require(np.array_equal(plain, compiled), f"compiled it differs by {off:.2g} from plain Python")


def truth_has_values_and_units(surface: Any) -> None:
    """The truth, if stated, has finite values with units."""
    if not hasattr(surface, "truth"):
        return
    for name, (value, unit) in surface.truth().items():
        require(math.isfinite(value), f"its {name} is {value}")
        require(isinstance(unit, str) and unit, f"its {name} has no unit")


LAWS = (
    untouched_surface_stays_at_rest,
    truth_has_values_and_units,
    surface_is_passive,
    surface_never_pulls_or_adds_energy,
    thrown_tip_returns_slower,
    free_recovery_allows_any_step,
    compiled_surface_agrees_with_python,
)
