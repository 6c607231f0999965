"""Simulated laboratories of the second judge: logs, their truth, and the precision of an estimator that knows them.

By an author who has not read the estimator; NumPy and SciPy alone. Ten worlds differ by surface, motion and
recording. Ten causes of time (the last one in three forms) act on a linear surface under an ordinary press. The force
is a function of the recorded position: what moves the surface or the position's zero is a shift of the surface.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, lfilter, sosfilt

Array = np.ndarray
Rng = np.random.Generator
Motion = tuple[Array, Array]
MAX_ROWS = 16000
PEAK_N, STIFFNESS_N_M = (0.5, 60.0), (200.0, 1e5)
PRIOR_LAG_S = 5e-3
"""Standard deviation of a lag that is not given, to the estimator that knows the world."""


@dataclass
class Scene:
    """One log before it is written: motion, surface, recording and causes; all SI.

    Attributes:
        p: parameters: K at the depth `scale`, B, M, x0, zero (of the force) and lag; r and tau (and r2, tau2) of
            a force that relaxes; n of a curved surface; step and depth of a layer; and the amplitudes of causes.
        shapes: over time, for the amplitudes `tone` (of the stiffness), `shift` (of the surface), `added` (to the
            force) and `gain` (of the sensor).
        truth: "meets": an interval is right if it meets the range of the definitions of stiffness; "covers": if it
            contains all of it, as with two surfaces in one log.
    """

    t: Array
    x: Array
    rate: float
    p: dict[str, float]
    scale: float
    kind: str = "linear"
    bonded: bool = False
    shapes: dict[str, Array] = field(default_factory=dict)
    averaged: str = ""
    low_pass: tuple[int, float] | None = None
    position_low_pass: float = 0.0
    options: dict[str, str] = field(default_factory=dict)
    given_lag_std: float = 0.0
    truth: str = "meets"
    judged: tuple[str, ...] = ("K", "B", "M")
    series: tuple[float, float] | None = None
    surface_stiffness: float | None = None
    max_noise: float = -1.9

    @property
    def dt(self) -> float:
        return float(self.t[1] - self.t[0])

    @property
    def stride(self) -> int:
        return max(round(1.0 / (self.rate * self.dt)), 1)


def log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def elastic(u: Array, p: dict[str, float], scene: Scene) -> Array:
    """Static force at a penetration u [m]."""
    if scene.kind == "sphere":
        return p["K"] * scene.scale / p["n"] * (np.maximum(u, 0.0) / scene.scale) ** p["n"]
    base = p["K"] * (u if scene.bonded else np.maximum(u, 0.0))
    if scene.kind == "layered":
        width = 0.12 * p["depth"]
        base = base + p["K"] * p["step"] * width * np.logaddexp(0.0, (u - p["depth"]) / width) * (u > 0.0)
    return base


def tangent(force: float, p: dict[str, float], scene: Scene) -> float:
    """Static stiffness at a force."""
    u = np.linspace(0.0, 2.0 * scene.scale, 4001)
    f = elastic(u, p, scene)
    return float(np.interp(abs(force), f, np.gradient(f, u))) if scene.kind != "linear" else p["K"]


def relaxing(e: Array, tau: float, dt: float) -> Array:
    """High-pass of first order: the part of a step that decays."""
    a = np.exp(-dt / tau)
    return lfilter([1.0, -1.0], [1.0, -a], e - e[0])


def contact_force(scene: Scene, p: dict[str, float]) -> tuple[Array, Array, Array]:
    """Force of the surface on the fine grid, its static part, and its part that relaxes."""
    shapes = scene.shapes
    u = scene.x - p["x0"] - p.get("shift", 0.0) * shapes.get("shift", 0.0)
    v = np.gradient(u, scene.dt)
    tone = 1.0 + p.get("tone", 0.0) * shapes.get("tone", 0.0)
    static = elastic(u, p, scene) * tone
    slow = sum(
        p[r] * relaxing(static, p[tau], scene.dt) for r, tau in (("r", "tau"), ("r2", "tau2")) if r in p
    )
    touched = scene.bonded | (u > 0.0)
    thickness = np.maximum(u / scene.scale, 0.0) ** p["n"] if scene.kind == "sphere" else 1.0
    force = static + slow + (p["B"] * thickness * v + p["M"] * np.gradient(v, scene.dt)) * touched
    suction = -0.3 * p["B"] * np.abs(v).max() if p["K"] == 0.0 else 0.0
    return (force if scene.bonded else np.maximum(force, suction) * touched), static, slow + 0.0 * u


def read_force(scene: Scene, p: dict[str, float]) -> Array:
    """Recorded force without noise, one a row."""
    f = contact_force(scene, p)[0]
    if "leak" in p:
        f = relaxing(f, p["leak"], scene.dt)
    if "creep" in p:
        f = f + p["creep"] * (f - relaxing(f, p["creep_tau"], scene.dt))
    f = f * (1.0 + p.get("gain", 0.0) * scene.shapes.get("gain", 0.0)) + p["zero"]
    f = f + p.get("added", 0.0) * scene.shapes.get("added", 0.0)
    if scene.low_pass and scene.low_pass[1] < 0.45 / scene.dt:
        f = sosfilt(butter(*scene.low_pass, fs=1.0 / scene.dt, output="sos"), f - f[0]) + f[0]
    f = np.interp(scene.t - p["lag"], scene.t, f)
    return sample(f, scene, bool(scene.averaged))


def sample(y: Array, scene: Scene, averaged: bool) -> Array:
    """Rows of the fine grid: every n-th value, or the mean of the n values up to it."""
    n = scene.stride
    return y[: len(y) // n * n].reshape(-1, n).mean(axis=1) if averaged else y[n - 1 :: n]


def read_position(scene: Scene) -> Array:
    y = scene.x
    if scene.position_low_pass:
        y = y - relaxing(y, 1.0 / (2 * np.pi * scene.position_low_pass), scene.dt)
    return sample(y, scene, scene.averaged == "both")


def known_half(scene: Scene, force: float, noise_f: float, noise_x: float, colour: float) -> float:
    """Relative 95 % half-width of K by weighted least squares with the model, its causes and the noise known."""
    sizes = {"x0": scene.scale, "zero": max(abs(force), 1e-9), "lag": PRIOR_LAG_S}
    names = [n for n in scene.p if scene.p[n] != 0.0 or n in sizes]
    prior = {"lag": (scene.given_lag_std or PRIOR_LAG_S) / PRIOR_LAG_S, "x0": 1e3, "zero": 1e3, "K": 1e3}

    def moved(name: str, by: float) -> dict[str, float]:
        change = scene.p[name] + by * sizes[name] if name in sizes else scene.p[name] * np.exp(by)
        return scene.p | {name: change}

    def slope(of: Callable, name: str) -> Array:
        return (of(moved(name, 1e-4)) - of(moved(name, -1e-4))) / 2e-4

    if scene.bonded:
        names.remove("x0")
    jacobian = np.column_stack([slope(partial(read_force, scene), n) for n in names])
    target = np.array([slope(lambda p: np.log(tangent(force, p, scene)), n) for n in names])
    white = jacobian[1:] - colour * jacobian[:-1]
    stiff = tangent(force, scene.p, scene)
    std = np.sqrt((1 - colour**2) * noise_f**2 + (1 + colour**2) * (stiff * noise_x) ** 2)
    information = white.T @ white / std**2 + np.diag([prior.get(n, 1.0) ** -2.0 for n in names])
    variance = float(target @ np.linalg.solve(information, target))
    if scene.series is None or scene.surface_stiffness is None:
        return 1.96 * float(np.sqrt(variance))
    over_apparent = scene.surface_stiffness / scene.p["K"]
    frame = scene.surface_stiffness / scene.series[0] * scene.series[1]
    return 1.96 * float(np.hypot(over_apparent * np.sqrt(variance), frame))


def relaxing_shares(scene: Scene, force: float, hertz: float, static: Array, slow: Array) -> list[float]:
    """Stiffness that relaxes over that at rest, by two definitions: at a frequency, and along a loading at a force."""
    p, omega = scene.p, 2 * np.pi * hertz
    pairs = [(p[r], p[tau]) for r, tau in (("r", "tau"), ("r2", "tau2")) if r in p]
    spectrum = sum(r * (omega * tau) ** 2 / (1 + (omega * tau) ** 2) for r, tau in pairs)
    total, rise = static + slow, np.gradient(static)
    loading = (rise > 0.1 * rise.max()) & (static > 0.1 * static.max())
    near = loading & (abs(total - force) < 0.15 * total.max())
    window = near if near.sum() > 20 else loading
    return [float(spectrum), float(np.polyfit(static[window], slow[window], 1)[0])]


def true_range(
    scene: Scene, name: str, force: float, hertz: float, octave: bool
) -> tuple[float, float] | None:
    """Range of the true values of K (or the working point) by its definitions, or of B and M; None: not judged."""
    p = scene.p
    if name in "BM":
        return (p[name], p[name]) if name in scene.judged else None
    base = tangent(force, p, scene)
    if name == "K at rest":  # of a model that relaxes itself: its fast branch may take the slow one's place
        return base, base * (1 + p.get("r2", 0.0))
    values = [base]
    _, static, slow = contact_force(scene, p)
    u = scene.x - p["x0"]
    if scene.kind != "linear" and octave:  # the spectrum of a curved surface is the chord of its loop
        inside = u > 0.0
        values.append(float(np.polyfit(u[inside], static[inside], 1)[0]))
    if "r" in p:
        values = [base * (1 + share) for share in relaxing_shares(scene, force, hertz, static, slow)]
    if "gain" in p:
        values += [
            base * (1 + p["gain"] * end) for end in (scene.shapes["gain"].min(), scene.shapes["gain"].max())
        ]
    if "tone" in p and scene.truth != "before the break":
        shape = scene.shapes["tone"]
        inside = shape[static > 0.1 * static.max()] if scene.truth == "meets" else shape
        ends = (0, 100) if scene.truth == "covers" else (25, 75)
        values = [v * (1 + p["tone"] * s) for v in values for s in np.percentile(inside, ends)]
    if name == "working point" and octave:
        mass = p["M"] * (2 * np.pi * hertz) ** 2
        values = [v - mass for v in values]
    if scene.surface_stiffness is not None:
        values = [scene.surface_stiffness]
    return min(values), max(values)


# Motions: position of the tip against the surface's place at 0 [m] on a fine grid.


def grid(duration: float, rate: float) -> Array:
    return np.arange(0.0, min(duration, MAX_ROWS / rate), 1.0 / (rate * max(4, min(round(1500 / rate), 16))))


def presses(rng: Rng, depth: float, rate: float, hold: bool = False, longest: float = 5.0) -> Motion:
    """One to four presses at constant speed, as a testing machine or a straight move does them."""
    gap, rise = depth * log_uniform(rng, 0.3, 3.0), log_uniform(rng, 0.3, longest)
    times, places, now = [0.0], [-gap], rng.uniform(0.3, 2.0)
    for _ in range(rng.integers(1, 5)):
        deep, travel = depth * rng.uniform(0.8, 1.0), rise * (1 + gap / depth)
        rest = log_uniform(rng, 1.0, 12.0) if hold else rng.uniform(0.0, 0.5)
        times += [now, now + travel, now + travel + rest, now + 2 * travel + rest]
        places += [-gap, deep, deep, -gap]
        now += 2 * travel + rest + rng.uniform(0.3, 2.0)
    t = grid(now + 0.5, rate)
    blur = max(rng.uniform(3e-3, 1e-2) / (t[1] - t[0]), 1.0)
    return t, gaussian_filter1d(np.interp(t, times, places), blur)


def shaken(rng: Rng, depth: float, rate: float) -> Motion:
    """A multisine about a mean depth, approached from free motion and left again."""
    t = grid(log_uniform(rng, 6.0, 25.0), rate)
    count, x = rng.integers(3, 8), np.zeros(len(t))
    for hertz in np.exp(rng.uniform(np.log(0.3), np.log(min(30.0, rate / 8)), count)):
        x += np.sin(2 * np.pi * (hertz * t + rng.random()))
    x *= 0.35 * depth / np.abs(x).max()
    ends = [1.0, 2.0, t[-1] - 2.0, t[-1] - 1.0]
    inside = gaussian_filter1d(np.interp(t, ends, [0.0, 1.0, 1.0, 0.0]), 0.1 / (t[1] - t[0]))
    return t, inside * (0.65 * depth + x) - (1 - inside) * 0.5 * depth


def ordinary(rng: Rng, depth: float, rate: float) -> Motion:
    """Presses, presses with holds, or a multisine."""
    kind = rng.integers(3)
    return shaken(rng, depth, rate) if kind == 2 else presses(rng, depth, rate, hold=kind == 1)


def surface(
    rng: Rng, peak: tuple = PEAK_N, stiffness: tuple = STIFFNESS_N_M, deepest: float = 2e-2
) -> tuple[dict, float]:
    """Parameters of a linear surface, and the depth of a press."""
    k, force = log_uniform(rng, *stiffness), log_uniform(rng, *peak)
    depth = float(np.clip(force / k, 5e-5, deepest))
    mass = k * depth / 9.81 * log_uniform(rng, 1e-3, 0.1) if rng.random() < 0.4 else 0.0
    zeros = dict.fromkeys(("x0", "zero", "lag"), 0.0)
    return zeros | {"K": k, "B": k * log_uniform(rng, 3e-4, 1e-2), "M": mass}, depth


def closed_loop(step: Callable, t: Array, x: float, v: float) -> Array:
    """Positions of a tip that is stepped by `step(k, x, v) -> acceleration or None, velocity`."""
    dt, out = float(t[1] - t[0]), np.empty(len(t))
    for k in range(len(t)):
        v = step(k, x, v)
        x += dt * v
        out[k] = x
    return out


# Worlds.


def force_loop(rng: Rng) -> Scene:
    """A robot presses by an integral force loop: stairs of force, with a sine in half of them."""
    p, depth = surface(rng)
    rate, response = float(rng.choice([100, 125, 250, 500, 1000])), log_uniform(rng, 0.05, 0.5)
    t = grid(rng.uniform(8.0, 16.0), rate)
    wanted = p["K"] * depth * rng.uniform(0.2, 1.0, 40)[(t / rng.uniform(1.0, 3.0)).astype(int)]
    if rng.random() < 0.5:
        wanted = wanted * (1 + 0.3 * np.sin(2 * np.pi * log_uniform(rng, 0.3, 2.0) * t))
    wanted[t > t[-1] - 1.5] = -0.3 * p["K"] * depth
    gain, limit = 1.0 / (p["K"] * response), depth / 0.4

    def step(k: int, x: float, v: float) -> float:
        force = max(p["K"] * x + p["B"] * v, 0.0) * (x > 0.0)
        return float(v + 0.02 * (np.clip(gain * (wanted[k] - force), -limit, limit) - v))

    x = gaussian_filter1d(closed_loop(step, t, -0.8 * depth, 0.0), 2.0)
    return Scene(
        t, x, rate, p, depth, position_low_pass=log_uniform(rng, 5, 50) if rng.random() < 0.3 else 0.0
    )


def testing_machine(rng: Rng) -> Scene:
    """Load and unload at constant speed; the frame yields, and its stiffness is given in half of the logs."""
    p, depth = surface(rng, (2.0, 400.0), (1e3, 3e5))
    rate = float(rng.choice([10, 20, 50, 100, 200]))
    t, x = presses(rng, depth, rate, longest=40.0)
    frame = p["K"] * log_uniform(rng, 4.0, 50.0)
    inside = frame / (frame + p["K"])
    is_given, k = rng.random() < 0.5, p["K"]
    p |= {"K": k * inside, "B": p["B"] * inside**2, "M": 0.0}
    scene = Scene(t, x, rate, p, depth, judged=("K",))
    if is_given:
        std = rng.uniform(0.01, 0.05)
        scene.series, scene.surface_stiffness = (frame, std), k
        scene.options["series_stiffness"] = f"{frame * (1 + std * rng.normal()):.6g}:{frame * std:.4g}"
    return scene


def tap(rng: Rng) -> Scene:
    """A light hammer on a soft handle taps several times; a laser reads its head."""
    k, hammer = log_uniform(rng, 3e3, 3e5), log_uniform(rng, 0.03, 0.5)
    p = {
        "K": k,
        "B": np.sqrt(k * hammer) * log_uniform(rng, 0.02, 0.4),
        "M": 0.0,
        "x0": 0.0,
        "zero": 0.0,
        "lag": 0.0,
    }
    rate = float(rng.choice([4000, 8000]))
    t = grid(2.0, rate)
    hand, soft = 0.012 * np.sin(2 * np.pi * rng.uniform(1.5, 3.0) * t) - 0.0085, (2 * np.pi * 6.0) ** 2
    dt = t[1] - t[0]

    def step(n: int, x: float, v: float) -> float:
        force = max(p["K"] * x + p["B"] * v, 0.0) if x > 0.0 else 0.0
        return v + dt * (soft * (hand[n] - x) - 30.0 * v - force / hammer)

    x = closed_loop(step, t, -0.008, 0.0)
    return Scene(t, gaussian_filter1d(x, 1.0), rate, p, float(x.max()))


def hand_held(rng: Rng) -> Scene:
    """An indenter in a hand: slow random motion, in and out of contact, under an optical tracker."""
    p, depth = surface(rng, (1.0, 20.0), (200.0, 1e4))
    rate = float(rng.choice([60, 100, 250]))
    t = grid(rng.uniform(15.0, 40.0), rate)
    x = gaussian_filter1d(rng.normal(size=len(t)), 0.16 / log_uniform(rng, 0.3, 3.0) / (t[1] - t[0]))
    return Scene(t, depth * (0.1 + 0.4 * x / x.std()), rate, p, depth, max_noise=-1.7)


def sweep(rng: Rng) -> Scene:
    """A shaker bonded to the specimen sweeps a sine."""
    p, depth = surface(rng)
    rate = float(rng.choice([500, 1000, 2000]))
    t = grid(rng.uniform(5.0, 16.0), rate)
    low, high = log_uniform(rng, 0.3, 2.0), log_uniform(rng, 8.0, 80.0)
    p["M"] = p["K"] / (2 * np.pi * high * log_uniform(rng, 0.5, 5.0)) ** 2
    cycles = low * t[-1] / np.log(high / low) * ((high / low) ** (t / t[-1]) - 1)
    x = depth * np.sin(2 * np.pi * cycles) * (low / high) ** (rng.uniform(0, 0.5) * t / t[-1])
    return Scene(t, x, rate, p, depth, bonded=True, options={"bonded": "True", "force_sign": "+1"})


def creep_test(rng: Rng) -> Scene:
    """A dead load on a solid that relaxes: the position creeps for minutes, then the load is taken off."""
    p, depth = surface(rng)
    rate, length = float(rng.choice([5, 10, 20])), log_uniform(rng, 30.0, 600.0)
    p |= {"r": rng.uniform(0.2, 1.5), "tau": log_uniform(rng, 0.02, 0.3) * length, "M": 0.0}
    t = np.arange(0.0, length + 20.0, 1.0 / (8 * rate))
    rise = rng.uniform(0.5, 3.0)
    load = p["K"] * depth * np.interp(t, [5.0, 5.0 + rise, 5.0 + length, 5.0 + length + rise], [0, 1, 1, 0])
    slow, x = 0.0, np.zeros(len(t))
    a = np.exp(-(t[1] - t[0]) / p["tau"])
    for k in range(1, len(t)):  # load = K x + r K y, where y relaxes
        x[k] = (load[k] / p["K"] - p["r"] * a * (slow - x[k - 1])) / (1 + p["r"])
        slow = a * (slow - x[k - 1]) + x[k]
    hover = 0.3 * depth * np.interp(t, [3.0, 5.0, 6.0 + length + rise, 8.0 + length + rise], [-1, 0, 0, -1])
    return Scene(t, gaussian_filter1d(x + hover, 3.0), rate, p, depth, judged=("K",))


def sphere(rng: Rng) -> Scene:
    """A ball on an elastic half-space: f grows with u^1.5."""
    p, depth = surface(rng)
    p |= {"n": 1.5, "M": 0.0}
    rate = float(rng.choice([100, 250, 500, 1000]))
    return Scene(*ordinary(rng, depth, rate), rate, p, depth, kind="sphere", judged=("K", "n"))


def layered(rng: Rng) -> Scene:
    """A soft layer on a stiffer ground."""
    p, depth = surface(rng)
    p |= {"step": log_uniform(rng, 0.5, 6.0), "depth": depth * rng.uniform(0.3, 0.8), "M": 0.0}
    rate = float(rng.choice([100, 250, 500, 1000]))
    return Scene(*ordinary(rng, depth, rate), rate, p, depth, kind="layered", judged=("K",))


def two_surfaces(rng: Rng) -> Scene:
    """The first surface is pressed, then another, higher or lower."""
    p, depth = surface(rng)
    rate = float(rng.choice([100, 250, 500]))
    t1, x1 = presses(rng, depth, rate)
    t2, x2 = presses(rng, depth, rate)
    t = np.arange(len(t1) + len(t2)) * (t1[1] - t1[0])
    second = (np.arange(len(t)) >= len(t1)).astype(float)
    height = depth * rng.uniform(-2.0, 2.0)
    bridge = np.concatenate([x1, x2 + x1[-1] - x2[0]])
    raised = np.roll(second, round(np.sign(height) * 0.2 / (t[1] - t[0])))  # above both surfaces
    raised[: len(t1) // 2], raised[-len(t2) // 2 :] = 0.0, 1.0
    shift = height + x1[-1] - x2[0]
    p |= {"tone": log_uniform(rng, 1.3, 4.0) ** rng.choice([-1, 1]) - 1.0, "shift": shift, "M": 0.0}
    x = bridge + height * gaussian_filter1d(raised, 0.04 / (t[1] - t[0]))
    shapes = {"tone": second, "shift": second}
    return Scene(t, x, rate, p, depth, shapes=shapes, truth="covers", judged=("K",))


def multi_rate(rng: Rng) -> Scene:
    """Force or both channels averaged over rows, aliasing without a filter, or a ground loop of the mains."""
    p, depth = surface(rng)
    rate = float(rng.choice([50, 100, 200]))
    t, x = ordinary(rng, depth, rate)
    scene = Scene(t, x, rate, p, depth)
    kind = rng.choice(["force", "both", "aliasing", "mains"])
    scene.averaged = str(kind) if kind in {"force", "both"} else ""
    if scene.averaged != "":
        return scene
    hertz = (
        rng.uniform(0.55, 3.0) * rate
        if kind == "aliasing"
        else 50.0 * rng.choice([1, 3]) * (1 + 2e-3 * rng.normal())
    )
    scene.shapes["added"] = np.sin(2 * np.pi * (hertz * t + rng.random()))
    scene.p["added"] = p["K"] * depth * log_uniform(rng, 3e-3, 0.05)
    return scene


# Causes of time.


def slow(s: Scene, g: Rng) -> Array:
    """Exponential approach from 0 to 1, as of a temperature."""
    return 1 - np.exp(-s.t / (s.t[-1] * log_uniform(g, 0.1, 3.0)))


def breath(s: Scene, g: Rng) -> Array:
    """Chest or belly: half a sine to an even power."""
    return np.sin(np.pi * (g.uniform(0.15, 0.4) * s.t + g.random())) ** (2 * g.integers(1, 4)) - 0.4


def wander(s: Scene, g: Rng) -> Array:
    """Random motion of unit variance within a fraction of a second to seconds."""
    y = gaussian_filter1d(g.normal(size=len(s.t)), log_uniform(g, 0.2, 2.0) / s.dt)
    return (y - y.mean()) / y.std()


def slips(s: Scene, g: Rng) -> Array:
    """One to three steps while the specimen is well loaded."""
    starts = g.choice(np.flatnonzero(s.x > 0.5 * s.x.max()), g.integers(1, 4))
    steps = sum(g.uniform(0.3, 1.0) * (np.arange(len(s.t)) >= start) for start in starts)
    return gaussian_filter1d(steps, 3e-3 / s.dt)


def warming(s: Scene, g: Rng, peak: float) -> tuple[dict, dict]:
    shape = slow(s, g)
    return {"added": 0.1 * peak * g.normal(), "gain": 0.01 * g.normal()}, {"added": shape, "gain": shape}


def sagging(s: Scene, g: Rng, peak: float) -> tuple[dict, dict]:
    ripple = np.sin(2 * np.pi * 100.0 * (1 + 1e-3 * g.normal()) * s.t)
    amplitudes = {"gain": g.uniform(0.0, 0.03), "added": peak * log_uniform(g, 1e-3, 0.02)}
    return amplitudes, {"gain": -s.t / s.t[-1], "added": ripple}


def relaxes(s: Scene, g: Rng, peak: float) -> tuple[dict, dict]:
    fast = {"r": g.uniform(0.1, 0.8), "tau": log_uniform(g, 0.05, 1.0)}
    return fast | {"r2": g.uniform(0.05, 0.4), "tau2": log_uniform(g, 2.0, 20.0)}, {}


def creeps(s: Scene, g: Rng, peak: float) -> tuple[dict, dict]:
    return {"creep": log_uniform(g, 2e-3, 0.03), "creep_tau": log_uniform(g, 0.5, 20.0)}, {}


SPOIL: dict[str, Callable] = {
    "charge_amplifier": lambda _s, g, _f: ({"leak": log_uniform(g, 1.0, 60.0)}, {}),
    "warming_sensor": warming,
    "breathing": lambda s, g, _f: ({"shift": s.scale * log_uniform(g, 0.01, 0.3)}, {"shift": breath(s, g)}),
    "muscle_tone": lambda s, g, _f: ({"tone": log_uniform(g, 0.01, 0.15)}, {"tone": wander(s, g)}),
    "relaxation": relaxes,
    "creeping_cell": creeps,
    "position_drift": lambda s, g, _f: (
        {"shift": s.scale * log_uniform(g, 0.01, 0.2) * g.choice([-1, 1])},
        {"shift": slow(s, g)},
    ),
    "sagging_supply": sagging,
    "slipping_clamp": lambda s, g, _f: (
        {"shift": s.scale * log_uniform(g, 0.02, 0.15)},
        {"shift": slips(s, g)},
    ),
    "fluid_film": lambda s, g, _f: ({"B": s.p["K"] * log_uniform(g, 0.03, 0.5), "K": 0.0, "M": 0.0}, {}),
}
"""Of each cause: changed or added parameters and the shapes over time, from a scene, random numbers and a force."""


def spoiled(name: str, rng: Rng) -> Scene:
    """An ordinary press on a linear surface, spoiled by a cause of time."""
    p, depth = surface(rng)
    rate = float(rng.choice([100, 200, 500, 1000]))
    scene = Scene(*ordinary(rng, depth, rate), rate, p, depth)
    amplitudes, scene.shapes = SPOIL[name](scene, rng, p["K"] * depth)
    scene.p = p | amplitudes
    scene.judged = ("K",) if name in {"relaxation", "fluid_film"} else scene.judged
    return scene


def slack_specimen(rng: Rng) -> Scene:
    """A strip that hangs slack is pulled slowly and released."""
    p, depth = surface(rng, (0.3, 5.0), (5.0, 1e3), 0.08)
    rate = float(rng.choice([5, 10, 20]))
    slack, rise = depth * rng.uniform(0.5, 4.0), log_uniform(rng, 20.0, 200.0)
    t = grid(2.2 * rise + 4.0, rate)
    x = np.interp(t, [1.0, 1.0 + rise, 2.0 + rise, 2.0 + 2 * rise], [-slack, depth, depth, -slack])
    return Scene(t, gaussian_filter1d(x, 0.05 / (t[1] - t[0])), rate, p | {"M": 0.0}, depth)


def fracture(rng: Rng) -> Scene:
    """The specimen breaks in the first loading, wholly or in part, and is loaded on."""
    p, depth = surface(rng)
    rate = float(rng.choice([50, 100, 200, 500]))
    t, x = presses(rng, depth, rate)
    scene = Scene(t, x, rate, p, depth, truth="before the break")
    start = np.flatnonzero(x > rng.uniform(0.6, 0.95) * 0.8 * depth)[0]
    scene.shapes["tone"] = (np.arange(len(t)) >= start).astype(float)
    p["tone"] = -rng.uniform(0.4, 1.0)
    return scene


WORLDS = {f.__name__: f for f in (
    force_loop, testing_machine, tap, hand_held, sweep, creep_test, sphere, layered, two_surfaces, multi_rate,
)}  # fmt: skip
CAUSES = {name: partial(spoiled, name) for name in SPOIL}
CAUSES |= {"slack_specimen": slack_specimen, "fracture": fracture}


@dataclass(frozen=True)
class Log:
    """One log as a laboratory writes it, its options, and what is true of it."""

    name: str
    text: str
    options: dict[str, str]
    scene: Scene
    known: float


def draw(name: str, index: int, seed: int) -> Log:
    """Log `index` of a world or a cause."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), index])
    scene = (WORLDS | CAUSES)[name](rng)
    p, peak = scene.p, float(np.abs(contact_force(scene, scene.p)[0]).max())
    record_chain(rng, scene, peak)
    x, f = read_position(scene), read_force(scene, p)
    noise_f = peak * 10 ** rng.uniform(-3.3, scene.max_noise)
    noise_x = scene.scale * 10 ** rng.uniform(-4.2, -2.5)
    colour = float(rng.choice([0.0, 0.0, rng.uniform(0.5, 0.95)]))
    force = float(contact_force(scene, p)[1].max()) / 2
    count_f, count_x = noise_f * rng.uniform(0.05, 2.0), noise_x * rng.uniform(0.05, 2.0)
    known = float("inf") if p["K"] == 0.0 or scene.truth == "covers" else known_half(
        scene, force, np.hypot(noise_f, count_f / 3.46), np.hypot(noise_x, count_x / 3.46), colour
    )  # fmt: skip
    f = f + lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], noise_f * rng.normal(size=len(f)))
    x = x + noise_x * rng.normal(size=len(x))
    f, x = np.round(f / count_f) * count_f, np.round(x / count_x) * count_x
    if not scene.bonded and rng.random() < 0.15:
        f = -f
    x = x * (-1.0 if not scene.bonded and rng.random() < 0.15 else 1.0) + rng.uniform(-0.3, 0.6)
    return Log(name, *written(rng, scene, x, f), scene, known)


def record_chain(rng: Rng, scene: Scene, peak: float) -> None:
    """Draw zero, filter and lag of the force, and what of the lag is given."""
    fast = scene.rate > 2000
    scene.p["zero"] = peak * rng.normal() * 0.2
    scene.p["x0"] = 0.0
    scene.p["lag"] = log_uniform(rng, 2e-5, 5e-4) if fast else log_uniform(rng, 2e-4, 1.5e-2)
    delay = scene.p["lag"]
    if rng.random() < 0.5 and not scene.averaged and "added" not in scene.p:
        order, hertz = int(rng.integers(1, 4)), log_uniform(rng, 30, 300) * (15 if fast else 1)
        scene.low_pass = (order, hertz)
        delay += {1: 1.0, 2: 1.414, 3: 2.0}[order] / (2 * np.pi * hertz) if hertz < 0.45 / scene.dt else 0.0
    if scene.position_low_pass:
        delay -= 1 / (2 * np.pi * scene.position_low_pass)
    if scene.averaged:
        delay += 0.5 * (scene.stride - 1) * scene.dt * (scene.averaged == "force")
    if rng.random() < 0.5:
        scene.given_lag_std = log_uniform(rng, 1e-5, 5e-5) if fast else log_uniform(rng, 1e-4, 1e-3)
        scene.options["lag"] = f"{delay + scene.given_lag_std * rng.normal():.7f}:{scene.given_lag_std:.7f}"
        if scene.low_pass and rng.random() < 0.5:
            scene.options["force_filter"] = "butterworth{}:{:.6g}".format(*scene.low_pass)


def written(rng: Rng, scene: Scene, x: Array, f: Array) -> tuple[str, dict[str, str]]:
    """Text of the CSV file with stated units, and the options that name its columns."""
    ms, (unit, per_m) = rng.random() < 0.3, [("m", 1.0), ("mm", 1e3), ("um", 1e6)][rng.integers(3)]
    newton, per_n = [("N", 1.0), ("mN", 1e3), ("kN", 1e-3)][rng.integers(3)]
    time = np.arange(len(x)) / scene.rate * (1e3 if ms else 1.0)
    rows = zip(time, x * per_m, f * per_n, strict=True)
    lines = ["clock,travel,load", *(f"{a:.10g},{b:.10g},{c:.10g}" for a, b, c in rows)]
    columns = {
        "time": "clock:ms" if ms else "clock:s",
        "position": f"travel:{unit}",
        "force": f"load:{newton}",
    }
    return "\n".join(lines) + "\n", columns | scene.options
