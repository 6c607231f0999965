"""Given motions that do not carry a parameter, and what a log of them holds; how little they carry is in the bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from presses import FIELDS, NAMES, SPREAD, log_of

from palpate.bench import ForceSensorTable, given_motion, load
from palpate.environments import KelvinVoigt
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate_excitation.spectra import ForceChain, cramer_rao_bound, phase_std

Array = NDArray[np.float64]
Path = Callable[[Array], Array]

SURFACES = ("foam", "rubber")
SAMPLING, RATE, NOISE = 480, 1000, 0.6  # of the force sensor and of the log [Hz]; of a force sample [N]
AIR = 0.4  # of the log before the touch [s]
EASE = 0.2  # in which a motion takes up its speed, or loses it [s]


@dataclass(frozen=True)
class Motion:
    """A path of the tip [m], the surface being at 0, and for how long [s]."""

    path: Path
    duration: float


@dataclass(frozen=True)
class Poor:
    """A kind of log that does not carry some of the parameters.

    Args:
        drawn: a motion for a surface and a generator.
        lacks: the parameters that it does not carry.
        touches: whether the surface is touched.
    """

    drawn: Callable[[np.random.Generator, KelvinVoigt], Motion]
    lacks: tuple[str, ...]
    touches: bool = True


@dataclass(frozen=True)
class PoorLog:
    """One log with its truth.

    Args:
        log: time, position, force.
        truth: by parameter.
        low_pass, lag: of the force sensor; the lag of a fresh reading, low-pass included [s].
        bound: Cramer-Rao bound of the deviation over the truth, by parameter that it lacks; infinite in free motion.
    """

    log: Record
    truth: dict[str, float]
    low_pass: LowPass
    lag: float
    bound: dict[str, float]


def ramp(t: Array, begin: float, ease: float, run: float) -> Array:
    """A way at speed 1, taken up and lost in `ease` [s] each, kept for `run` [s]; its acceleration has no jumps."""

    def risen(u: Array) -> Array:
        """The integral of a speed that rises from 0 to 1 over u in [0, 1]."""
        inner = np.clip(u, 0.0, 1.0)
        return inner**3 * (1.0 - 0.5 * inner) + np.maximum(u - 1.0, 0.0)

    return ease * (risen((t - begin) / ease) - risen((t - begin - ease - run) / ease))


def still(rng: np.random.Generator, surface: KelvinVoigt) -> Motion:
    """Pressed to 5 to 15 N so slowly that the damper bears a tenth of a newton at most; then at rest for 1 to 3 s."""
    speed = rng.uniform(0.03, 0.1) / surface.damping
    depth = rng.uniform(5.0, 15.0) / surface.stiffness
    way = depth + AIR * speed
    run = way / speed - EASE
    return Motion(
        lambda t: speed * ramp(t, 0.0, EASE, run) - AIR * speed, run + 2 * EASE + float(rng.uniform(1.0, 3.0))
    )


def steady(rng: np.random.Generator, surface: KelvinVoigt) -> Motion:
    """Pressed at a constant speed, and the log ends while it goes on; every other log begins in contact.

    Where the touch is in the log, the force jumps by what the damper bears: a fifth of a newton at most.
    """
    cut = bool(rng.integers(2))
    speed = (rng.uniform(0.5, 2.0) if cut else rng.uniform(0.05, 0.2)) / surface.damping
    first = rng.uniform(0.5, 5.0) / surface.stiffness if cut else -AIR * speed
    last = rng.uniform(10.0, 20.0) / surface.stiffness
    if cut:
        return Motion(lambda t: first + speed * t, (last - first) / speed)
    return Motion(lambda t: first + speed * ramp(t, -EASE / 2, EASE, np.inf), (last - first) / speed)


def slow(rng: np.random.Generator, surface: KelvinVoigt) -> Motion:
    """Pressed to 12 N, and about that by four tones below 0.5 to 2 Hz of 2 to 6 N together."""
    speed = rng.uniform(4.0, 10.0) / surface.stiffness
    depth = 12.0 / surface.stiffness
    run = (depth + AIR * speed) / speed - EASE
    top, count = rng.uniform(0.5, 2.0), 4
    hertz = top * rng.uniform(0.2, 1.0, count)
    share = rng.dirichlet(np.ones(count)) * rng.uniform(2.0, 6.0) / surface.stiffness
    phases = rng.uniform(0.0, 2 * np.pi, count)

    def path(t: Array) -> Array:
        since = np.maximum(t - run - 2 * EASE, 0.0)
        eased = 1.0 - np.exp(-((since * top) ** 3))
        tones = share @ np.sin(2 * np.pi * np.outer(hertz, since) + phases[:, None])
        return speed * ramp(t, 0.0, EASE, run) - AIR * speed + eased * tones

    return Motion(path, run + 2 * EASE + float(rng.uniform(3.0, 6.0)))


def free(rng: np.random.Generator, _surface: KelvinVoigt) -> Motion:
    """In the air, by tones up to 20 Hz, or to and fro like a press without a surface."""
    duration = float(rng.uniform(2.0, 5.0))
    size = float(np.exp(rng.uniform(np.log(1e-4), np.log(2e-2))))
    count = int(rng.integers(1, 6))
    hertz = np.exp(rng.uniform(np.log(0.2), np.log(20.0), count))
    share, phases = size * rng.dirichlet(np.ones(count)), rng.uniform(0.0, 2 * np.pi, count)
    return Motion(
        lambda t: share @ np.sin(2 * np.pi * np.outer(hertz, t) + phases[:, None]) - 2 * size, duration
    )


KINDS = {
    "still": Poor(still, ("B", "M")),
    "steady": Poor(steady, ("B", "M")),
    "slow": Poor(slow, ("M",)),
    "free": Poor(free, NAMES, touches=False),
}


def poor_log(kind: str, material: str, seed: int) -> PoorLog:
    """A log of its own surface, motion, noise and phase of the force sensor's clock."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), SURFACES.index(material)])
    surface = _surface(material, rng)
    motion = KINDS[kind].drawn(rng, surface)
    rig = given_motion(surface, sensor=ForceSensorTable(phase=float(rng.uniform(0.0, 1.0 / SAMPLING))))
    record = rig.run(motion.path, motion.duration, seed=int(rng.integers(2**31)))
    told = record.meta["instruments"]["force"]
    low_pass = LowPass.parse(told["filter"])
    truth = {"K": surface.stiffness, "B": surface.damping, "M": surface.mass}
    return PoorLog(
        log_of(record), truth, low_pass, low_pass.lag + told["delay_s"], _bound(record, truth, low_pass, kind)
    )


def _surface(material: str, rng: np.random.Generator) -> KelvinVoigt:
    nominal = load(f"{material}-hybrid").surface
    factors = np.exp(rng.uniform(-np.log(SPREAD), np.log(SPREAD), len(NAMES)))
    return KelvinVoigt(*(getattr(nominal, FIELDS[n]) * f for n, f in zip(NAMES, factors, strict=True)))


def _bound(record: Record, truth: dict[str, float], low_pass: LowPass, kind: str) -> dict[str, float]:
    """Of what the motion in contact says at best about what it is held to lack, lag and phase known."""
    lacks = KINDS[kind].lacks
    inside = np.flatnonzero(record["x"] > 0.0)
    if not len(inside):
        return dict.fromkeys(lacks, np.inf)
    span = float(record["t"][inside[0]]), float(record["t"][inside[-1]])
    chain = ForceChain(low_pass, SAMPLING, NOISE, phase_std(SAMPLING, RATE))
    best = cramer_rao_bound(record["t"], np.maximum(record["x"], 0.0), truth, chain, span=span)
    return {name: float(best.std[best.names.index(name)]) / truth[name] for name in lacks}
