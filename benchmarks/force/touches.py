"""Draws of first touches, and how one is judged: what the studies of this folder share."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from rich.progress import track

from palpate.force.arm import load_arm
from palpate.force.gains import LAW, Gains, gains_for, known_lag
from palpate.force.lag import sum_of_lags
from palpate.force.simulated_press import pressed, surface, world_of

SECONDS = 4.0
BAND = 0.05
"""Of F_d: settled is what stays within, by the true force."""


@dataclass(frozen=True)
class Draw:
    """One first touch: stiffness, damping, desired force, noise, phase of the sensor's clock, damping ratio."""

    K: float
    B: float
    F: float
    noise: float
    phase: float
    zeta: float


@dataclass(frozen=True)
class Judged:
    """Settling time [s] (NaN if not), overshoot, losses of contact, least K_eff(K_u)/K_eff(K + B/theta) above F_d/3."""

    settling: float
    overshoot: float
    lost: int
    least: float


class Rig:
    """An arm with its lag, worked out once."""

    def __init__(self, name: str):
        self.arm = load_arm(name)
        self.theta, self.added = known_lag(self.arm), sum_of_lags(self.arm)

    def draw(self, rng, stiffness=(1e2, 1e6), noise=(0.05, 0.2)) -> Draw:
        """Stiffness, damping ratio and noise even in their logarithms; force and phase even."""
        K = float(np.exp(rng.uniform(*np.log(stiffness))))
        zeta = float(np.exp(rng.uniform(np.log(0.01), 0.0)))
        mass = self.arm.inner.mass if self.arm.kind == "torque" else 1.0
        force, sigma = float(rng.uniform(10.0, 40.0)), float(np.exp(rng.uniform(*np.log(noise))))
        phase = float(rng.uniform(0.0, 1.0 / self.arm.sensor.sampling))
        return Draw(K, 2.0 * zeta * np.sqrt(K * mass), force, sigma, phase, zeta)

    def gains(self, force, noise, cap=None, theta=None) -> Gains:
        """For this press; cap and theta may be wrong on purpose."""
        arm = msgspec.structs.replace(self.arm, sensor=msgspec.structs.replace(self.arm.sensor, noise=noise))
        return gains_for(arm, force, cap=cap, theta=theta)

    def run(self, draw, control, seed, seconds=SECONDS, desired=None, approach=0.002, **others):
        """The rows of a press with any law."""
        world = world_of(self.arm, noise=draw.noise, phase=draw.phase)
        wanted = np.full(round(seconds * self.arm.rate), draw.F) if desired is None else desired
        return pressed(world, surface(draw.K, draw.B, **others), control, 0.3 * approach, wanted, seed)

    def judge(self, draw, rows) -> Judged:
        """What a run came to."""
        force, rate = rows[:, 0], self.arm.rate
        if not (force > 0.0).any() or not np.isfinite(force).all():
            return Judged(np.nan, np.inf if not np.isfinite(force).all() else 0.0, 0, np.nan)
        start = int(np.argmax(force > 0.0))
        outside = np.flatnonzero(np.abs(force - draw.F) > BAND * draw.F)
        last = outside[-1] + 1 if len(outside) else start
        settled = last < len(force) - round(0.3 * rate)
        firm = int(np.argmax(force > 0.5 * draw.F)) if (force > 0.5 * draw.F).any() else len(force)
        lost = int(((force[firm:-1] > 0.0) & (force[firm + 1 :] <= 0.0)).sum())
        felt = draw.K if self.arm.kind == "torque" else self.arm.seen(draw.K)
        felt *= 1.0 + draw.B / draw.K / self.theta
        pressing = rows[force > draw.F / 3.0, 1]
        own = 1.0 / self.arm.series if self.arm.kind == "torque" else 0.0
        least = float((own + 1.0 / felt) / (own + 1.0 / pressing.min())) if len(pressing) else np.nan
        return Judged(
            (last - start) / rate if settled else np.nan, float(force.max() / draw.F - 1.0), lost, least
        )

    def travel(self, draw) -> float:
        """F/(K v_max) [s]."""
        return draw.F / draw.K / self.arm.limits.speed


def share(value: float) -> str:
    """As a percentage."""
    return f"{100.0 * value:.2f} %"


Key = tuple[str, int, int]
"""Arm, seed and number of a run."""


def resumed(
    path: Path, keys: Iterable[Key], one: Callable[[Key], dict[str, float]], minutes: float
) -> dict[Key, dict[str, float]]:
    """What `one` makes of each key, each row kept as it is made: the same call goes on where it stopped.

    Rows of another form of the law are left where they are, and count for nothing.

    Args:
        path: a JSON row a run.
        keys: of all runs.
        one: a run.
        minutes: after which no other is begun.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    known, wanted = _rows(path), list(keys)
    began = time.monotonic()
    with path.open("a", encoding="utf-8") as file:
        for key in track([key for key in wanted if key not in known], "runs", transient=True):
            if time.monotonic() - began > 60.0 * minutes:
                break
            known[key] = one(key)
            file.write(json.dumps({"law": LAW, "key": key, **known[key]}) + "\n")
            file.flush()
    return {key: known[key] for key in wanted if key in known}


def _rows(path: Path) -> dict[Key, dict[str, float]]:
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines if line.endswith("}")]
    return {tuple(row.pop("key")): row for row in rows if row.pop("law") == LAW}
