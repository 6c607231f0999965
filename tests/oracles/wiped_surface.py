"""Logs of a tip that slides, by a simulator of its own: nothing of palpate is in it.

The path and the pressing force are prescribed; so is the surface, a height over a plane that lies anyhow in the base.
The contact follows: the depth by the surface's spring, and friction by bristles that bend and slip (LuGre's law without
damping, Canudas de Wit et al., TAC 40, 1995), whose length of relaxation is the surface's. A sensor with a bias, a
payload's weight, a low-pass, noise and a sampling of its own reads the force in its axes, as action or reaction.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np

SHAPES = ("plane", "sphere", "bowl", "cylinder", "saddle", "waves")
PATHS = ("line", "back", "raster", "circle", "scribble")


@dataclass(frozen=True)
class Wipe:
    """One world, in SI units."""

    seed: int = 0
    shape: str = "sphere"
    radius: float = 0.15
    path: str = "raster"
    length: float = 0.05
    speed: float = 0.03
    seconds: float = 15.0
    stiffness: float = 2e4
    ratio: float = 0.8  # tangential over normal stiffness
    grade: float = 0.0  # relative change of stiffness along x [1/m]
    mu: float = 0.3
    stribeck: float = 0.0  # friction at rest above mu, share
    creep: float = 0.01  # Stribeck's speed
    force: float = 15.0
    ripple: float = 0.03  # of the controller, share
    dither: float = 0.0  # share
    dither_hz: float = 1.0
    noise: float = 0.1
    grain: float = 5e-6  # noise of the position
    rate: float = 500.0
    force_rate: float = 500.0
    low_pass: float = 3e-3
    delay: float = 2e-3
    bias: float = 1.0  # of the sensor, each axis
    weight: float = 0.0  # of a payload that is not taken off
    free: float = 1.0  # time in free motion before and after
    turns: bool = False  # the tool follows the normal
    action: bool = True
    tilted: bool = True  # the surface lies anyhow


def any_wipe(seed: int, **given) -> Wipe:
    """A world of the wide box."""
    rng = np.random.default_rng([seed, 77])

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    rate = float(rng.choice([100.0, 125.0, 250.0, 500.0, 1000.0]))
    world = Wipe(
        seed=seed, shape=str(rng.choice(SHAPES)), radius=between(0.06, 0.5), path=str(rng.choice(PATHS)),
        length=between(0.02, 0.08), speed=between(5e-3, 0.1), seconds=float(rng.uniform(6.0, 20.0)),
        stiffness=between(1e3, 6e4), ratio=float(rng.uniform(0.3, 1.5)), mu=float(rng.uniform(0.05, 0.9)),
        stribeck=float(rng.choice([0.0, 0.0, 0.0, 0.5])), creep=between(5e-3, 0.03), force=between(5.0, 30.0),
        ripple=between(0.005, 0.1), dither=float(rng.choice([0.0, 0.0, 0.1, 0.2])),
        dither_hz=between(0.5, 2.0), noise=between(0.02, 0.3), grain=between(1e-6, 3e-5), rate=rate,
        force_rate=rate / float(rng.choice([1.0, 1.0, 2.0])), low_pass=between(5e-4, 8e-3),
        delay=float(rng.uniform(0.0, 6e-3)), bias=between(0.1, 5.0), weight=float(rng.choice([0.0, 0.0, 8.0])),
        free=float(rng.choice([1.5, 1.5, 1.5, 0.0])), turns=bool(rng.random() < 0.3), action=bool(rng.random() < 0.7),
    )  # fmt: skip
    return replace(world, **given)


@dataclass(frozen=True, eq=False)
class WipeLog:
    """What is recorded, and the truth."""

    columns: dict[str, np.ndarray]
    inside: np.ndarray  # rows in which the tip slides
    normal: np.ndarray  # into the surface, in the base, shape (n, 3)
    mu: np.ndarray  # of each row, as it acts at that speed, shape (n,)
    place: np.ndarray
    speed: np.ndarray
    stiffness: np.ndarray
    world: Wipe = field(default_factory=Wipe)


def height(world: Wipe, x, y):
    """Height of the surface and its gradient [m], [1]."""
    R = world.radius
    if world.shape == "plane":
        return 0.0 * x, 0.0 * x, 0.0 * x
    if world.shape in ("sphere", "bowl"):
        s = -1.0 if world.shape == "sphere" else 1.0
        root = np.sqrt(np.maximum((1.5 * R) ** 2 - x**2 - y**2, 1e-6))
        return s * (1.5 * R - root), s * x / root, s * y / root
    if world.shape == "cylinder":
        return -(x**2) / (2 * R), -x / R, 0.0 * y
    if world.shape == "saddle":
        return (x**2 - y**2) / (2 * R), x / R, -y / R
    k, a = 2 * np.pi / 0.05, 0.2 * (0.05 / (2 * np.pi)) ** 2 / R * 2  # waves
    return (
        a * np.sin(k * x) * np.cos(k * y), a * k * np.cos(k * x) * np.cos(k * y),
        -a * k * np.sin(k * x) * np.sin(k * y),
    )  # fmt: skip


def path_of(world: Wipe, t, rng):
    """Places over the plane, shape (n, 2), t from 0."""
    L, v = world.length, world.speed
    s = v * t
    if world.path == "line":
        v = min(v, 2 * L / max(t[-1], 1e-9))
        return np.column_stack([v * t - L, 0 * t]) + 0.0
    if world.path == "back":
        return np.column_stack([np.abs((s / L) % 2.0 - 1.0) * L - L / 2, 0 * t])
    if world.path == "circle":
        r = L / 2
        return np.column_stack([r * np.sin(s / r), r * (np.cos(s / r) - 1.0)])
    if world.path == "raster":
        row, step = L, L / 8
        lap = row + step
        k, rest = np.floor(s / lap), s % lap
        along = np.minimum(rest, row)
        x = np.where(k % 2 == 0, along, row - along) - row / 2
        y = step * k + np.maximum(rest - row, 0.0)
        fold = np.abs((y / L) % 2.0 - 1.0)
        return np.column_stack([x, (1.0 - fold) * L - L / 2])
    w = v / L * rng.uniform(0.7, 1.6, 4)
    p = rng.uniform(0, 2 * np.pi, 4)
    x = np.sin(w[0] * t + p[0]) + 0.6 * np.sin(2.1 * w[1] * t + p[1])
    y = np.sin(w[2] * t + p[2]) + 0.6 * np.sin(1.7 * w[3] * t + p[3])
    return 0.5 * L * np.column_stack([x, y])


def wipe(world: Wipe) -> WipeLog:
    """The log of a world."""
    rng = np.random.default_rng(world.seed)
    h = 1e-3
    n = round(world.seconds / h)
    m = round(world.free / h)
    t = h * np.arange(n)
    warm = np.minimum(t / 0.4, 1.0) if m else np.ones(n)  # the tip starts and the force comes up
    way = path_of(world, np.cumsum(h * np.clip((t - 0.5) / 0.3, 0.0, 1.0)), rng)
    z, zx, zy = height(world, way[:, 0], way[:, 1])
    up = np.column_stack([-zx, -zy, np.ones(n)])
    into = -up / np.linalg.norm(up, axis=1)[:, None]
    slow = np.convolve(rng.standard_normal(n + 600), np.hanning(600), "valid")[:n]
    slow /= slow.std()
    N = world.force * (
        1 + world.ripple * slow + world.dither * np.sin(2 * np.pi * world.dither_hz * t)
    )  # of the press
    N = np.maximum(N, 0.1 * world.force) * warm
    K = world.stiffness * np.maximum(1.0 + world.grade * way[:, 0], 0.1)
    ground = np.column_stack([way, z])
    tip = ground + into * (N / K)[:, None]
    v = np.gradient(tip, h, axis=0)
    vt = v - np.einsum("ij,ij->i", v, into)[:, None] * into
    speed = np.linalg.norm(vt, axis=1)
    mu = world.mu * (1.0 + world.stribeck * np.exp(-((speed / world.creep) ** 2)))
    bend, friction = np.zeros(3), np.zeros((n, 3))
    for k in range(n):  # bristles: z' = v - |v| z / z_max
        most = max(mu[k] * N[k] / (world.ratio * K[k]), 1e-12)
        bend = bend - (bend @ into[k]) * into[k]
        gone = np.exp(-speed[k] * h / most)
        if speed[k] > 0.0:
            bend = bend * gone + vt[k] / speed[k] * most * (1.0 - gone)
        friction[k] = world.ratio * K[k] * bend
    force = N[:, None] * into + friction

    # Free motion before and after, 20 mm above, with an approach.
    def lift(rows, toward):
        s = np.linspace(1.0, 0.0, rows) if toward else np.linspace(0.0, 1.0, rows)
        return s[:, None]

    if m:
        above, below = (
            ground[0] - 0.02 * into[0] * lift(m, True),
            ground[-1] - 0.02 * into[-1] * lift(m, False),
        )
        tip = np.vstack([above, tip, below])
        into = np.vstack([np.repeat(into[:1], m, 0), into, np.repeat(into[-1:], m, 0)])
        force = np.vstack([np.zeros((m, 3)), force, np.zeros((m, 3))])
        mu, speed, K = (np.pad(own, m, mode="edge") for own in (mu, speed, K))
        speed[:m], speed[-m:] = 0.0, 0.0
    columns, every, into, tip = recorded(world, tip, into, force, rng)
    inside = (force**2).sum(1) > 0
    return WipeLog(columns, inside[every], into[every], mu[every], tip[every], speed[every], K[every], world)


def recorded(world: Wipe, tip, into, force, rng):
    """Columns of a log of a tip's places, normals and forces each millisecond, shape (n, 3); its rows; both turned."""
    from scipy.spatial.transform import Rotation

    h = 1e-3
    lies = Rotation.random(random_state=rng).as_matrix() if world.tilted else np.eye(3)
    tip, into, force = tip @ lies.T + rng.uniform(-0.5, 0.5, 3), into @ lies.T, force @ lies.T
    # The tool: its z into the surface, with an angle; it follows the normal, or stands.
    mean = into.mean(0) / np.linalg.norm(into.mean(0))
    axis = into if world.turns else np.repeat(mean[None], len(into), 0)
    x = np.cross(axis, rng.standard_normal(3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    R = np.stack([x, np.cross(axis, x), axis], 2)
    R = R @ Rotation.from_rotvec(0.2 * rng.standard_normal(3)).as_matrix()
    load = world.weight * np.array([0.0, 0.0, -1.0])
    sign = 1.0 if world.action else -1.0
    read = np.einsum("nji,nj->ni", R, sign * force + load) + world.bias * rng.standard_normal(3)
    # Low-pass and delay, noise, sampling.
    a = 1.0 - np.exp(-h / max(world.low_pass, 1e-9))
    from scipy.signal import lfilter

    read = np.column_stack([lfilter([a], [1.0, a - 1.0], r, zi=[(1.0 - a) * r[0]])[0] for r in read.T])
    late = round(world.delay / h)
    read = np.vstack([np.repeat(read[:1], late, 0), read])[: len(read)]
    every = np.arange(0, len(read), round(1.0 / world.rate / h))
    hold = round(1.0 / world.force_rate / h)
    noisy = read + world.noise * rng.standard_normal(read.shape)
    held = noisy[every // hold * hold]
    seen = tip[every] + world.grain * rng.standard_normal((len(every), 3))
    q = Rotation.from_matrix(R[every]).as_quat()
    columns = {"time": h * every}
    columns |= {f"force_{c}": held[:, i] for i, c in enumerate("xyz")}
    columns |= {f"position_{c}": seen[:, i] for i, c in enumerate("xyz")}
    columns |= {f"quaternion_{c}": q[:, i] for i, c in enumerate("xyzw")}
    return columns, every, into, tip


def changed(world: Wipe) -> dict[str, object]:
    """The numbers of a world that are not the usual ones."""
    return {f.name: getattr(world, f.name) for f in fields(world) if getattr(world, f.name) != f.default}


PRESSES = ("straight", "oblique", "hand", "taps", "sine", "held")
"""A motion to a depth and back; the same askew; by a hand that wanders; at several places; a sine; no free motion."""
MATERIALS = ("spring", "hardening", "relaxing")


@dataclass(frozen=True)
class Pressing(Wipe):
    """A press on a plane: `radius`, `path`, `length`, `ripple` and `dither` do not count."""

    kind: str = "straight"
    material: str = "spring"
    damping: float = 0.01  # B/K [s]
    askew: float = 0.0  # angle between the motion and the normal
    cycles: int = 3


def any_press(seed: int, **given) -> Pressing:
    """A press of the wide box."""
    rng = np.random.default_rng([seed, 78])
    wiped = any_wipe(seed, free=1.5, turns=False, weight=0.0)
    kind = given.get("kind", str(rng.choice(PRESSES)))
    own = {f.name: getattr(wiped, f.name) for f in fields(wiped)} | {
        "kind": kind, "material": str(rng.choice(MATERIALS)), "damping": float(np.exp(rng.uniform(-7.0, -3.5))),
        "askew": float(np.radians(rng.uniform(10.0, 60.0))) if kind == "oblique" else 0.0,
        "cycles": int(rng.integers(1, 6)), "grain": float(np.exp(rng.uniform(np.log(1e-6), np.log(1e-5)))),
        "noise": float(np.exp(rng.uniform(np.log(0.02), np.log(0.2)))),
    }  # fmt: skip
    return Pressing(**(own | given))


def press(world: Pressing) -> WipeLog:
    """The log of a press."""
    rng = np.random.default_rng(world.seed)
    h = 1e-3
    n = round(world.seconds / h)
    t = h * np.arange(n)
    full = world.force / world.stiffness
    turn = np.clip((t % (world.seconds / world.cycles)) / (world.seconds / world.cycles), 0.0, 1.0)
    ramp = np.clip(np.minimum(turn - 0.15, 0.85 - turn) / 0.15, -1.0, 1.0)
    lift = 5e-3 + 0.0 * t  # above the surface between the presses
    depth = np.where(ramp > 0.0, full * ramp, lift * ramp)
    along = np.zeros((n, 2))
    direction = rng.uniform(0.0, 2 * np.pi)
    side = np.array([np.cos(direction), np.sin(direction)])
    slow = [np.convolve(rng.standard_normal(n + 800), np.hanning(800), "valid")[:n] for _ in range(3)]
    slow = [s / s.std() for s in slow]
    if world.kind == "oblique":
        along = np.outer(depth * np.tan(world.askew), side)
    elif world.kind == "hand":
        depth = np.where(ramp > 0.0, full * ramp * (1.0 + 0.2 * slow[0]), depth)
        along = 5e-4 * np.column_stack(slow[1:])
    elif world.kind == "taps":
        place = np.floor(t / (world.seconds / world.cycles))
        at = np.interp(t, t[ramp <= -0.5] if (ramp <= -0.5).any() else t, 0.02 * place[ramp <= -0.5])
        along = np.outer(at, side)
    elif world.kind == "sine":
        held = np.clip(np.minimum(t - 0.5, world.seconds - 0.5 - t) / 0.5, -1.0, 1.0)
        wave = 0.6 + 0.35 * np.sin(2 * np.pi * world.dither_hz * t)
        depth = np.where(held > 0.0, full * np.minimum(held * 2.0, 1.0) * wave, 5e-3 * held)
    elif world.kind == "held":
        depth = full * (0.6 + 0.15 * slow[0])
    m = round(world.free / h) if world.kind != "held" else 0
    depth = np.r_[
        np.full(m, depth[0]) - np.linspace(0.02, 0.0, m), depth, depth[-1] - np.linspace(0.0, 0.02, m)
    ]
    along = np.vstack([np.repeat(along[:1], m, 0), along, np.repeat(along[-1:], m, 0)])
    N = _normal_force(world, depth, h)
    tip = np.column_stack([along, -depth])
    vt = np.gradient(along, h, axis=0)
    bend, friction = np.zeros(2), np.zeros((len(depth), 3))
    for k in range(len(depth)):
        most = max(world.mu * N[k] / (world.ratio * world.stiffness), 1e-12)
        size = float(np.hypot(*vt[k]))
        gone = np.exp(-size * h / most) if N[k] > 0.0 else 0.0
        bend = bend * gone + (vt[k] / size * most * (1.0 - gone) if size > 0.0 and N[k] > 0.0 else 0.0)
        friction[k, :2] = world.ratio * world.stiffness * bend
    into = np.repeat(np.array([[0.0, 0.0, -1.0]]), len(depth), 0)
    force = N[:, None] * into + friction
    columns, every, into, tip = recorded(world, tip, into, force, rng)
    one = np.ones(len(every))
    speed = np.hypot(*vt[every].T)
    return WipeLog(
        columns, N[every] > 0.0, into[every], world.mu * one, tip[every], speed, world.stiffness * one, world
    )


def _normal_force(world: Pressing, depth, h):
    """Of the surface's material, never below 0 [N]."""
    d = np.maximum(depth, 0.0)
    if world.material == "hardening":
        d = d * np.sqrt(d / (world.force / world.stiffness))
    N = world.stiffness * (d + world.damping * np.gradient(d, h))
    if world.material == "relaxing":  # half as stiff again while it is fast: a Maxwell branch of 1 s
        branch, gone = np.zeros(len(d)), np.exp(-h / 1.0)
        steps = np.diff(d, prepend=d[0])
        for k in range(1, len(d)):
            branch[k] = branch[k - 1] * gone + 0.5 * world.stiffness * steps[k]
        N = N + branch
    return np.where(depth > 0.0, np.maximum(N, 0.0), 0.0)
