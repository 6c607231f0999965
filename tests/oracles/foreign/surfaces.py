"""What is pressed on: a sum of elements in parallel, of which a surface has some, and the contact with it.

    F = M a + B v + K s + K2 s^2 + K3 s^3 + C s^n (1 + D v) + Fc z + Kp (s - s_p) + sum of arms(s) or arms(s^n)

s is how deep the surface is dented [m], v and a its rates. The elements and where they are from: Hunt and Crossley
(1975) for C s^n (1 + D v); Dahl (1968), dz/ds = (1 - z sign v) / x_d, for the friction; linear hardening for the
plastic part, which yields at Fy + H s_p; Maxwell's spring and dashpot in series for each arm, of the depth or, as in
tissue that stiffens and relaxes (Q = 1; Fung 1993, quasi-linear), of its power. The contact is one-sided: the probe
pushes and never pulls. Where it would have to pull it leaves, and the surface comes back by itself, as its own law with
F = 0 says, until it meets the probe again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

ELEMENTS = ("M", "B", "K", "K2", "K3", "C", "n", "D", "Fc", "x_d", "Kp", "Fy", "H", "Q")
_ELEMENTS = len(ELEMENTS)
ARMS = 4
_BOUNCE = 2e-3
"""Half-sine of this length [s] in which the momentum of a surface's mass is handed over when the probe meets it."""


@dataclass(frozen=True)
class Surface:
    """A surface by its elements.

    Args:
        name: its kind.
        elements: of ELEMENTS, those that it has, in SI units.
        arms: stiffness [N/m, of a power N/m^n] and time [s] of each Maxwell arm.
        glued: whether the probe is fixed to it, so that it may pull.
    """

    name: str
    elements: Mapping[str, float]
    arms: tuple[tuple[float, float], ...] = ()
    glued: bool = False

    def __getitem__(self, element: str) -> float:
        return float(self.elements.get(element, 0.0))

    @property
    def numbers(self) -> Array:
        """What the compiled law takes: the elements, then the arms, shape (14 + 2 ARMS,)."""
        own = [self[name] for name in ELEMENTS]
        arms = [*self.arms, *[(0.0, 1.0)] * (ARMS - len(self.arms))]
        return np.array([*own, *np.ravel(arms)])

    @property
    def linear(self) -> bool:
        """Whether its dynamic stiffness is the same at every depth and amplitude."""
        return not any(self[name] for name in ("K2", "K3", "C", "Fc", "Kp"))

    def static(self, depth: Array) -> Array:
        """Force of a slow first press [N], relaxed, at depths of shape (n,)."""
        s = np.asarray(depth, float)
        force = self["K"] * s + self["K2"] * s**2 + self["K3"] * s**3
        force = force + self["C"] * np.maximum(s, 0.0) ** max(self["n"], 1.0) + self["Fc"]
        if self["Kp"]:
            dent = np.maximum((self["Kp"] * s - self["Fy"]) / (self["Kp"] + self["H"]), 0.0)
            force = force + self["Kp"] * (s - dent)
        return force

    def depth_of(self, force: float, deepest: float = 0.015) -> float:
        """Depth [m] at which a slow press reaches a force [N], at most `deepest`."""
        depth = np.geomspace(1e-6, deepest, 4000)
        reached = np.flatnonzero(self.static(depth) >= force)
        return float(depth[reached[0]]) if len(reached) else deepest

    def scaled(self, **elements: float) -> Surface:
        """The same with some elements changed."""
        return replace(self, elements={**self.elements, **elements})


@dataclass(frozen=True)
class Touched:
    """What happened at the surface: its own depth [m] and force [N], and whether the probe touches it, shape (n,)."""

    depth: Array
    force: Array
    contact: NDArray[np.bool_]


@njit(cache=True)
def _law(p, q, s0, s, v, dt, q_new):
    """Force of all elements but the mass when the surface goes from s0 to s; their new state goes to q_new."""
    _, b, k, k2, k3, c, n, d, fc, x_d, kp, fy, h, quasi = p[:_ELEMENTS]
    force = b * v + s * (k + s * (k2 + s * k3))
    ds = s - s0
    if c > 0.0 and s > 0.0:
        force += c * s**n * (1.0 + d * v)
    if fc > 0.0:
        way = 1.0 if ds >= 0.0 else -1.0
        q_new[0] = way + (q[0] - way) * np.exp(-abs(ds) / x_d)
        force += fc * q_new[0]
    if kp > 0.0:
        q_new[1] = q[1]
        if kp * (s - q[1]) > fy + h * q[1]:
            q_new[1] = (kp * s - fy) / (kp + h)
        force += kp * (s - q_new[1])
    du = max(s, 0.0) ** n - max(s0, 0.0) ** n if quasi > 0.0 else ds
    for i in range(ARMS):
        stiffness = p[_ELEMENTS + 2 * i]
        if stiffness > 0.0:
            tau = p[_ELEMENTS + 1 + 2 * i]
            fade = np.exp(-dt / tau)
            q_new[2 + i] = q[2 + i] * fade + stiffness * (du / dt) * tau * (1.0 - fade)
            force += q_new[2 + i]
    return force


@njit(cache=True)
def _alone(p, q, s0, v0, least, dt, q_new):
    """Where the surface goes by itself, F = 0, by bisection from `least` on, where it would have to pull."""
    low, high = least, max(s0, least)
    step = 1e-6 + abs(s0 - least)
    for _ in range(60):
        v = (high - s0) / dt
        if _law(p, q, s0, high, v, dt, q_new) + p[0] * (v - v0) / dt > 0.0:
            break
        low = high
        high += step
        step *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        v = (middle - s0) / dt
        if _law(p, q, s0, middle, v, dt, q_new) + p[0] * (v - v0) / dt > 0.0:
            high = middle
        else:
            low = middle
        if high - low < 1e-14:
            break
    return high


@njit(cache=True)
def _step(p, q, q_new, s0, v0, was, x, v, a, dt, glued):
    """One step with the probe at x: surface, its speed, force, whether it is touched, and momentum handed over."""
    if was or glued:
        force = _law(p, q, s0, x, v, dt, q_new) + p[0] * a
        if force > 0.0 or glued:
            return x, v, force, True, 0.0
    least = min(x, s0) - 1e-3
    trial = (x - s0) / dt
    if p[0] == 0.0 and _law(p, q, s0, x, trial, dt, q_new) <= 0.0:
        least = x
    at_rest = s0 == 0.0 and v0 == 0.0
    for value in q:
        at_rest = at_rest and value == 0.0
    s = 0.0 if at_rest else _alone(p, q, s0, v0, least, dt, q_new)
    speed = (s - s0) / dt
    if x >= s:
        force = max(_law(p, q, s0, x, v, dt, q_new) + p[0] * a, 0.0)
        return x, v, force, True, 0.0 if was else p[0] * max(v - v0, 0.0)
    _law(p, q, s0, s, speed, dt, q_new)
    if abs(s) < 1e-10 and abs(speed) < 1e-7:
        quiet = True
        for i in range(2 + ARMS):
            quiet = quiet and abs(q_new[i]) < 1e-6
        if quiet:
            q_new[:] = 0.0
            return 0.0, 0.0, 0.0, False, 0.0
    return s, speed, 0.0, False, 0.0


@njit(cache=True)
def _follow(p, x, v, a, dt, glued, depth, force, touches):
    q, q_new = np.zeros(2 + ARMS), np.zeros(2 + ARMS)
    s, speed, was = 0.0, 0.0, False
    bounce = max(int(_BOUNCE / dt), 1)
    blows = np.zeros(len(x) + bounce)
    for i in range(len(x)):
        s, speed, f, was, momentum = _step(p, q, q_new, s, speed, was, x[i], v[i], a[i], dt, glued)
        q[:] = q_new
        depth[i], force[i], touches[i] = s, f, was
        if momentum > 0.0:
            for j in range(bounce):
                blows[i + j] += momentum * np.pi / (2 * bounce * dt) * np.sin(np.pi * (j + 0.5) / bounce)
    return blows[: len(x)]


@njit(cache=True)
def _press(p, wanted, start, gain, speed_loop, dt, glued, x, v, a, depth, force, touches):
    """A robot whose speed follows gain (wanted - force): the probe's x, v, a go to their arrays."""
    q, q_new = np.zeros(2 + ARMS), np.zeros(2 + ARMS)
    s, speed, was, felt = 0.0, 0.0, False, 0.0
    x[0], v[0], a[0] = start, 0.0, 0.0
    for i in range(len(x)):
        if i:
            acceleration = speed_loop * (gain * (wanted[i - 1] - felt) - v[i - 1])
            v[i] = v[i - 1] + acceleration * dt
            x[i] = x[i - 1] + v[i - 1] * dt + 0.5 * acceleration * dt * dt
            a[i] = acceleration
        s, speed, f, was, _ = _step(p, q, q_new, s, speed, was, x[i], v[i], a[i], dt, glued)
        q[:] = q_new
        depth[i], force[i], touches[i] = s, f, was
        felt += dt * 2 * np.pi * 30.0 * (f - felt)


def touch(surface: Surface, x: Array, v: Array, a: Array, dt: float) -> Touched:
    """What a probe of known motion meets.

    Args:
        surface: what is pressed on.
        x: depth of the probe below the surface at rest [m], shape (n,).
        v: its rate [m/s].
        a: its second rate [m/s^2].
        dt: step [s].
    """
    depth, force, touches = np.empty_like(x), np.empty_like(x), np.empty(len(x), bool)
    blows = _follow(surface.numbers, x, v, a, dt, surface.glued, depth, force, touches)
    return Touched(depth, force + blows, touches)


def press(
    surface: Surface, wanted: Array, start: float, gain: float, dt: float
) -> tuple[Array, Array, Array, Touched]:
    """What a force-controlled robot does on it.

    Args:
        surface: what is pressed on.
        wanted: force asked for [N], shape (n,).
        start: where the probe begins [m], below 0 in free motion.
        gain: speed that one newton of missing force asks for [m/s/N].
        dt: step [s].

    Returns:
        The probe's depth [m] and its rates, and what happened at the surface.
    """
    x, v, a, depth, force = (np.empty_like(wanted) for _ in range(5))
    touches = np.empty(len(x), bool)
    _press(
        surface.numbers, wanted, start, gain, 150.0, dt, surface.glued, x, v, a, depth, force, touches
    )  # fmt: skip
    return x, v, a, Touched(depth, force, touches)


def _spring(rng: np.random.Generator) -> tuple[float, float]:
    """A stiffness [N/m] and a damping [N s/m] that loses 5 to 60 % of a radian at 5 Hz."""
    k = float(np.exp(rng.uniform(np.log(200), np.log(60e3))))
    return k, k * float(np.exp(rng.uniform(np.log(1.5e-3), np.log(2e-2))))


def random_surface(name: str, rng: np.random.Generator) -> Surface:
    """One surface of a kind, its numbers drawn.

    Raises:
        KeyError: no such kind.
    """
    k, b = _spring(rng)
    return _MAKERS[name](name, k, b, rng)


def _kelvin_voigt(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    return Surface(name, {"K": k, "B": b})


def _with_mass(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    mass = float(np.clip(k / (2 * np.pi * rng.uniform(6, 20)) ** 2, 0.05, 3.0))
    return Surface(name, {"K": k, "B": b, "M": mass})


def _standard(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    arm = k * rng.uniform(0.15, 1.0), float(np.exp(rng.uniform(np.log(0.03), np.log(1.0))))
    return Surface(name, {"K": k, "B": 0.05 * b}, (arm,))


def _arms(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    times = np.sort(np.exp(rng.uniform(np.log(0.02), np.log(5.0), int(rng.integers(2, ARMS + 1)))))
    return Surface(name, {"K": k, "B": 0.1 * b}, tuple((k * rng.uniform(0.08, 0.5), float(t)) for t in times))


def _hunt_crossley(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    n, depth = rng.uniform(1.3, 2.0), 3e-3
    return Surface(name, {"C": k * depth ** (1 - n), "n": n, "D": b / k, "B": 0.0})


def _stiffening(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    own = Surface(name, {"K": k, "B": b})
    depth = own.depth_of(15.0)
    return own.scaled(K3=k * rng.uniform(0.2, 1.0) / depth**2)


def _falling(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    depth = rng.uniform(1.5e-3, 6e-3)
    return Surface(name, {"K": k, "K2": -2.35 * k / depth, "K3": 1.5 * k / depth**2, "B": b})


def _friction(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    own = Surface(name, {"K": k, "B": b})
    depth = own.depth_of(15.0)
    return own.scaled(Fc=k * depth * rng.uniform(0.03, 0.12), x_d=depth * rng.uniform(0.01, 0.04))


def _plastic(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    own = Surface(name, {"K": k})
    load = k * own.depth_of(15.0)
    return Surface(
        name, {"Kp": k, "Fy": load * rng.uniform(0.2, 0.5), "H": k * rng.uniform(0.3, 1.5), "B": b}
    )


def _tissue(name: str, k: float, b: float, rng: np.random.Generator) -> Surface:
    n, depth = rng.uniform(1.3, 2.0), 3e-3
    own = k * depth ** (1 - n)
    arm = own * rng.uniform(0.3, 1.5), float(np.exp(rng.uniform(np.log(0.03), np.log(1.0))))
    return Surface(name, {"C": own, "n": n, "Q": 1.0}, (arm,))


_MAKERS = {
    "kelvin-voigt": _kelvin_voigt,
    "mass": _with_mass,
    "standard-linear": _standard,
    "arms": _arms,
    "hunt-crossley": _hunt_crossley,
    "stiffening": _stiffening,
    "falling": _falling,
    "friction": _friction,
    "plastic": _plastic,
    "tissue": _tissue,
}
SURFACES = tuple(_MAKERS)
