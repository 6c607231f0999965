"""Desired force of the test, and the metrics of a run of it."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import BAND, settling_time
from palpate.errors import InputError

TOUCH, STEP, PERIOD, PERIODS = 4.0, 3.0, 2.0, 4
"""Durations of the touch with its approach and of each step, period of the sines [s]; number of periods."""
STEP_HEIGHT = 0.25
"""Height of a step over the desired force."""
LINES = (1, 2, 3, 5, 7, 11, 15, 21, 29, 41)
"""Frequencies of the sum, in units of 1/PERIOD: 0.5 to 20.5 Hz."""
LINE = 0.03
"""Amplitude of each sine, of the desired force."""
SWAY, SWAYS = 0.5, 3
"""Frequency of the surface's own motion [Hz], and periods of it that count."""
SWAY_FORCE = 0.25
"""Amplitude of the force that the surface's motion would cause on a tip that rests, of the desired force."""

LAYER = 0.75
"""Force at which the hardest surface of the test is met behind each other one, of the desired force."""
CABLE = 0.1
"""Force of a cable on the tool just before it lets go, at the surface, of the desired force."""


@dataclass(frozen=True)
class ForcePlan:
    """The test for one force and one rate.

    Args:
        force: F_d [N].
        rate: of the loop [Hz].

    Raises:
        InputError: a force or a rate that is not above 0.
    """

    force: float
    rate: float

    def __post_init__(self) -> None:
        for name, value in (("force", self.force), ("rate", self.rate)):
            if not 0.0 < value < np.inf:
                raise InputError(f"the {name} of the test must be above 0, got {value:g}")

    def ticks(self, seconds: float) -> int:
        """Ticks in a time."""
        return round(seconds * self.rate)

    @property
    def starts(self) -> tuple[int, int, int, int]:
        """First ticks of the step up, of the step down, of the sum of sines, and the end."""
        up = self.ticks(TOUCH)
        down = up + self.ticks(STEP)
        sines = up + 2 * self.ticks(STEP)
        return up, down, sines, sines + PERIODS * self.ticks(PERIOD)

    def desired_force(self) -> Array:
        """F_d at each tick [N], shape (n,)."""
        up, down, sines, end = self.starts
        force = np.full(end, self.force)
        force[up:down] *= 1.0 + STEP_HEIGHT
        force[sines:] += self.sines()
        return force

    def sines(self) -> Array:
        """The sum of sines [N], with Schroeder's phases, shape (PERIODS * period,)."""
        period = self.ticks(PERIOD)
        turn = 2.0 * np.pi * np.arange(PERIODS * period) / period
        phases = -np.pi * np.arange(len(LINES)) ** 2 / len(LINES)
        return LINE * self.force * sum(np.sin(k * turn + p) for k, p in zip(LINES, phases, strict=True))

    def steady(self) -> Array:
        """F_d while the surface moves [N], shape (n,)."""
        return np.full(self.ticks(TOUCH + SWAYS / SWAY), self.force)


MAX_OVERSHOOT = 0.1
"""Largest overshoot of a touch that passes, over the desired force."""
FIRM_CONTACT = 0.5
"""Force over the desired one from which a loss of contact counts."""


@dataclass(frozen=True)
class TouchMetrics:
    """The transition from free motion to contact.

    Args:
        settling: from the first contact until the force stays within 5 % of F_d [s]; None if it does not.
        overshoot: largest force over F_d, less 1.
        bounces: losses of contact between the first contact and half of F_d.
        lost: losses of contact after that.
        error: mean of the force less F_d over the last second [N].
        deviation: standard deviation of the force over the last second [N].
    """

    settling: float | None
    overshoot: float
    bounces: int
    lost: int
    error: float
    deviation: float

    @property
    def passed(self) -> bool:
        """True if the force settled, was at most 10 % over, and kept contact."""
        return self.settling is not None and self.overshoot <= MAX_OVERSHOOT and not self.lost


def touch(force: Array, desired: float, rate: float) -> TouchMetrics:
    """Metrics of a touch.

    Args:
        force: on the surface [N], shape (n,), from free motion on.
        desired: F_d [N].
        rate: of the rows [Hz].
    """
    contact = force > 0.0
    last_second = force[-round(rate) :]
    if not np.isfinite(force).all():
        return TouchMetrics(None, math.inf, 0, 0, math.nan, math.nan)
    if not contact.any():
        return TouchMetrics(None, 0.0, 0, 0, -desired, math.nan)
    start = int(np.argmax(contact))
    firm = force > FIRM_CONTACT * desired
    first_firm = int(np.argmax(firm)) if firm.any() else len(force)
    ends = np.flatnonzero(contact[:-1] & ~contact[1:])
    return TouchMetrics(
        _settling(force[start:], desired, rate),
        float(force.max() / desired - 1.0),
        int((ends < first_firm).sum()),
        int((ends >= first_firm).sum()),
        float(last_second.mean() - desired),
        float(last_second.std()),
    )


def _settling(force: Array, desired: float, rate: float) -> float | None:
    return settling_time(np.arange(len(force)) / rate, np.abs(force - desired) > BAND * desired)


@dataclass(frozen=True)
class StepMetrics:
    """A step of the desired force in contact.

    Args:
        rise: from 10 to 90 % of the step [s]; None if it never came there.
        settling: until the force stays within 5 % of the new F_d [s]; None if it does not.
        overshoot: beyond the new F_d, over the step.
    """

    rise: float | None
    settling: float | None
    overshoot: float


def step(force: Array, before: float, after: float, rate: float) -> StepMetrics:
    """Metrics of a step.

    Args:
        force: from the step on [N], shape (n,).
        before: F_d before it [N].
        after: F_d after it [N].
        rate: of the rows [Hz].
    """
    progress = (force - before) / (after - before)
    reached = [progress >= level for level in (0.1, 0.9)]
    rise = None
    if all(rows.any() for rows in reached):
        start, end = (int(np.argmax(rows)) for rows in reached)
        rise = (end - start) / rate
    return StepMetrics(rise, _settling(force, after, rate), max(float(progress.max()) - 1.0, 0.0))


def response(force: Array, desired: Array, lines: tuple[int, ...], periods: int) -> Array:
    """Complex ratio of force to desired force at lines of a periodic signal, shape (lines,).

    Args:
        force: over a whole number of periods [N], shape (n,).
        desired: likewise [N], shape (n,).
        lines: frequencies in units of one over the period.
        periods: in n.
    """
    at = periods * np.array(lines)
    return np.fft.rfft(force)[at] / np.fft.rfft(desired)[at]


def bandwidth(frequency: Array, ratio: Array) -> float | None:
    """Lowest frequency at which |ratio| falls to 1/sqrt(2) [Hz], logarithmic between lines; None above the last."""
    size = np.abs(ratio)
    below = np.flatnonzero(size < math.sqrt(0.5))
    if not len(below):
        return None
    k = int(below[0])
    if k == 0:
        return float(frequency[0])
    low, high = np.log(size[k - 1 : k + 1])
    fraction = (low - 0.5 * math.log(0.5)) / (low - high)
    return float(frequency[k - 1] * (frequency[k] / frequency[k - 1]) ** fraction)


@dataclass(frozen=True)
class RunMetrics:
    """Metrics of one run of the plan, and of one with a moving surface.

    Args:
        touch: the first contact.
        up, down: the steps.
        bandwidth: of force over desired force [Hz]; None beyond the plan's highest frequency.
        resonance: largest size of that ratio.
        disturbance: rms error while the surface moves, over the one of a tip that rests.
        layers: the first contact where something hard lies behind the surface.
        cable: the first contact where a cable pulls at the tool before it.
    """

    touch: TouchMetrics
    up: StepMetrics
    down: StepMetrics
    bandwidth: float | None
    resonance: float
    disturbance: float
    layers: TouchMetrics
    cable: TouchMetrics


def run_metrics(
    plan: ForcePlan, force: Array, moving: Array, at_rest: float, layers: Array, cable: Array
) -> RunMetrics:
    """Metrics of a run.

    Args:
        plan: of the desired force.
        force: on the surface in a run of it [N], shape (n,).
        moving: the same while the surface moves and F_d is constant [N], shape (m,).
        at_rest: amplitude of the force that this motion causes on a tip that rests [N].
        layers: on something hard behind the surface, F_d constant [N], shape (m,).
        cable: on the surface, while a cable pulls at the tool [N], shape (m,).
    """
    first, second, third, _ = plan.starts
    high = (1.0 + STEP_HEIGHT) * plan.force
    begin = third + plan.ticks(PERIOD)
    periods = (len(force) - begin) // plan.ticks(PERIOD)
    ratio = response(force[begin:], plan.desired_force()[begin:], LINES, periods)
    last = moving[-plan.ticks(SWAYS / SWAY) :]
    return RunMetrics(
        touch(force[:first], plan.force, plan.rate),
        step(force[first:second], plan.force, high, plan.rate),
        step(force[second:third], high, plan.force, plan.rate),
        bandwidth(np.array(LINES) / PERIOD, ratio),
        float(np.abs(ratio).max()),
        float(np.sqrt(np.mean((last - plan.force) ** 2)) / (at_rest / math.sqrt(2.0))),
        touch(layers, plan.force, plan.rate),
        touch(cable, plan.force, plan.rate),
    )
