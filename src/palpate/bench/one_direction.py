"""A press along one direction: one TOML file with every number of a run, and the bench that makes its record.

Every time counts from the first touch.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from palpate._jit import kernel, law
from palpate.arrays import Array
from palpate.bench.summary import APPROACH, CONTACT, DONE, LOST, NO_CONTACT
from palpate.errors import InputError
from palpate.force.arm import Arm, TorqueLoop, load_arm
from palpate.force.gains import Gains, gains_for, known_lag
from palpate.force.simulated_press import pressed, surface, world_of
from palpate.force.touching import Surface
from palpate.records import Record
from palpate.references import ForceSchedule
from palpate.signals.types import NotNegative, Positive, Table


class TouchedSurface(Table):
    """A spring and a damper; they may change under the force, and the surface may sway by itself."""

    stiffness: Positive
    """K [N/m]."""
    damping_ratio: NotNegative = 0.1
    """B/(2 sqrt(K m)), m the mass of a torque arm's tip, or 1 kg."""
    later: Positive | None = None
    """K from `changes` on [N/m], the force kept; as before when left out."""
    changes: NotNegative = 2.0
    """Seconds after the touch."""
    sway: NotNegative = 0.0
    """Amplitude of the surface's own motion [m]."""
    sway_frequency: NotNegative = 0.5
    """Frequency of that motion [Hz]."""


class StepsAndSine(Table):
    """Desired force from the touch on: steps between two forces [N] each period [s], and a sine [N], [Hz]."""

    first: Positive = 20.0
    second: Positive | None = None
    """Force of every other interval [N]; the first if left out."""
    period: Positive = 2.0
    amplitude: NotNegative = 0.0
    frequency: NotNegative = 0.5


class Priors(Table):
    """Factors of the law's prior over the truth; 1 is the truth."""

    cap: Positive = 1.0
    """Factor of the stiffest surface considered."""
    lag: Positive = 1.0
    """Factor of the loop's whole lag."""


class Duration(Table):
    """Duration of a press and of its run."""

    press: Positive = 4.0
    """Seconds from the touch on."""
    duration: Annotated[float, Meta(gt=0, le=3600)] = 60.0
    """Seconds after which it ends in any case."""


class OneDirection(Table, kw_only=True):
    """Every number of a press along one direction."""

    title: str
    about: str = ""
    arm: str
    """ur5e, fr3, ... or a TOML file, as `palpate tune --arm` takes it."""
    surface: TouchedSurface
    force: StepsAndSine = StepsAndSine()
    priors: Priors = Priors()
    noise: NotNegative | None = None
    """Standard deviation of a force reading [N]; that of the arm's file if left out."""
    run: Duration = Duration()


COLUMNS = {
    "t": "s",
    "phase": "1",
    "x": "m",  # of the tip, from the undeformed surface
    "speed": "m/s",  # of the commanded position
    "force": "N",  # true, mean of the tick
    "force_measured": "N",  # the sensor's reading, as the law has it
    "force_desired": "N",
    "bound": "N/m",  # K_u
}
AHEAD = 0.3
"""Time that the approach takes at the law's own speed [s]."""
FIRM_CONTACT = 0.5
"""Fraction of the desired force from which on a vanishing force is a loss; below it a touch may bounce."""


@law
def desired_forces(schedule, tick, touch, out):
    """Desired force at each tick, its clock starting at the touch; before, its first value."""
    for k in range(len(out)):
        out[k] = schedule.force(max(k - touch, 0) * tick)


_compiled_desired_forces = kernel(desired_forces)


@dataclass(frozen=True)
class OneDirectionBench:
    """An arm before a surface, ready to press.

    Args:
        gains: of the law, with its priors.
        arm: as it is.
        surface: that it touches.
        schedule: desired force, from the touch on.
        change: seconds from the touch to the surface's change; infinite for none.
        meta: additional metadata of the record.
    """

    gains: Gains
    arm: Arm
    surface: Surface
    schedule: ForceSchedule
    change: float
    meta: dict[str, Any]

    def run(
        self,
        duration: float,
        seed: int = 0,
        *,
        press: float | None = None,
        progress: Callable[[float, str], None] | None = None,
        waiting: Callable[[], None] | None = None,
    ) -> Record:
        """Run from free motion; arguments and record as for `Bench.run`.

        Raises:
            InputError: a duration or a press of less than a tick.
        """
        tick = self.arm.tick
        for name, time in (("duration", duration), ("press", duration if press is None else press)):
            if not time >= tick:
                raise InputError(f"{name} must be at least one tick ({tick} s), got {time}")
        longest = round(duration / tick)
        touch = self._touch(longest, seed, waiting)
        if touch is None:
            return self._record(np.zeros((0, 5)), np.zeros(0), seed, NO_CONTACT, "no contact was detected")
        n = longest if press is None else min(longest, touch + round(press / tick))
        if progress is not None:
            progress(touch * tick, "approach")
        desired = np.empty(n)
        _compiled_desired_forces(self.schedule, self.arm.tick, touch, desired)
        rows = self._rows(desired, seed, touch * tick + self.change)
        if progress is not None:
            progress(n * tick, "contact")
        return self._record(rows, desired, seed, DONE, "as asked for")

    def _touch(self, longest: int, seed: int, waiting: Callable[[], None] | None) -> int | None:
        """The first tick with a force; nothing that counts from the touch can change it."""
        n = min(longest, round(4.0 * AHEAD * self.arm.rate))
        while True:
            force = self._rows(np.full(n, self.schedule.first), seed, inf, waiting)[:, 0]
            if (force > 0.0).any():
                return int(np.argmax(force > 0.0))
            if n == longest:
                return None
            n = min(longest, 4 * n)

    def _rows(
        self, desired: Array, seed: int, change: float, waiting: Callable[[], None] | None = None
    ) -> Array:
        rng = np.random.default_rng([seed, 1])
        phase = float(rng.uniform(0.0, 1.0 / self.arm.sensor.sampling))
        world = world_of(self.arm, noise=self.arm.sensor.noise, phase=phase)
        touched = self.surface._replace(change=min(change, 1e9))
        gap = AHEAD * self.gains.approach
        return pressed(world, touched, self.gains.cautious(), gap, desired, [seed, 2], waiting)

    def _record(self, rows: Array, desired: Array, seed: int, end: str, why: str) -> Record:
        force = rows[:, 0]
        touched = np.maximum.accumulate(force > 0.0) if len(force) else force > 0.0
        firm_contact = np.maximum.accumulate(force > FIRM_CONTACT * desired) if len(force) else touched
        phase = np.where(touched, CONTACT, APPROACH)
        phase[firm_contact & (force <= 0.0)] = LOST
        columns = {
            "t": self.arm.tick * np.arange(len(rows)),
            "phase": phase,
            "x": rows[:, 2],
            "speed": rows[:, 3],
            "force": force,
            "force_measured": rows[:, 4],
            "force_desired": np.where(touched, desired, 0.0),
            "bound": rows[:, 1],
        }
        return Record(columns, COLUMNS, {**self.meta, "seed": seed, "end": end, "why": why})


def build_one_direction(experiment: OneDirection) -> OneDirectionBench:
    """The bench of a press along one direction.

    Raises:
        InputError: no such arm, or numbers that no loop can be tuned for.
    """
    e = experiment
    arm = load_arm(e.arm)
    if e.noise is not None:
        noise = max(e.noise, 1e-9)
        arm = msgspec.structs.replace(arm, sensor=msgspec.structs.replace(arm.sensor, noise=noise))
    second = e.force.first if e.force.second is None else e.force.second
    smallest_force = min(e.force.first, second) - e.force.amplitude
    cap, theta = e.priors.cap * arm.limits.stiffness, e.priors.lag * known_lag(arm)
    gains = gains_for(arm, smallest_force, cap=cap, theta=theta)
    f = e.force
    schedule = ForceSchedule(*map(float, (f.first, second, f.period, f.amplitude, f.frequency, 0.0)))
    truth = {
        "K": {"value": e.surface.stiffness, "unit": "N/m"},
        "B": {"value": _damping(arm, e.surface), "unit": "N s/m"},
    }
    loop = {
        "arm": arm.title,
        "kind": arm.kind,
        "rate_hz": arm.rate,
        "theta_s": gains.theta,
        "cap": gains.cap,
        "approach_m_s": gains.approach,
        "series": arm.series,
    }
    meta = {"experiment": msgspec.to_builtins(e), "truth": truth, "loop": loop}
    change = inf if e.surface.later is None else e.surface.changes
    return OneDirectionBench(gains, arm, _surface(arm, e), schedule, change, meta)


def _damping(arm: Arm, of: TouchedSurface) -> float:
    mass = arm.inner.mass if isinstance(arm.inner, TorqueLoop) else 1.0
    return 2.0 * of.damping_ratio * sqrt(of.stiffness * mass)


def _surface(arm: Arm, e: OneDirection) -> Surface:
    of = e.surface
    later = of.stiffness if of.later is None else of.later
    return surface(
        of.stiffness,
        _damping(arm, of),
        sway=of.sway,
        frequency=2.0 * pi * of.sway_frequency,
        later=later,
        depth=e.force.first / of.stiffness,
    )
