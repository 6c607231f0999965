"""Metrics of force control, from the force and the desired force of one run.

The quantities are those that NISTIR 8097 (Falco, Marvel, Norcross, Van Wyk: Benchmarking Robot Force Control
Capabilities, 2016) and the tree of robots (Nature Machine Intelligence, 2025, doi 10.1038/s42256-025-00995-y) ask for;
the definitions are those below, made so that one record gives one number.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.press.sequence import mean_over
from palpate_benchmark.plan import LINES, PERIOD, STEP_HEIGHT, SWAY, SWAYS, ForcePlan

BAND = 0.05
"""Of the desired force: settled is a force that stays within."""
STAYS = 0.3
"""Least time within the band before the end of the part that counts [s]."""
OVER = 0.1
"""Of the desired force: a touch that exceeds it by more has failed."""
FIRM = 0.5
"""Of the desired force: from there on a loss of contact counts as one."""


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
        """Whether it settled, was at most 10 % over, and kept contact."""
        return self.settling is not None and self.overshoot <= OVER and not self.lost


def touch(force: Array, desired: float, rate: float, free: float = 0.0, lag: float = 0.0) -> TouchMetrics:
    """Metrics of a touch.

    Args:
        force: on the surface [N], shape (n,), from free motion on.
        desired: F_d [N].
        rate: of the rows [Hz].
        free: largest force that counts as free motion [N].
        lag: over which the mean of readings has to settle [s]; 0 for each of them.
    """
    contact = force > free
    last = force[-round(rate) :]
    if not np.isfinite(force).all():
        return TouchMetrics(None, math.inf, 0, 0, math.nan, math.nan)
    if not contact.any():
        return TouchMetrics(None, 0.0, 0, 0, -desired, math.nan)
    start, over = int(np.argmax(contact)), force > FIRM * desired
    firm = int(np.argmax(over)) if over.any() else len(force)
    ends = np.flatnonzero(contact[:-1] & ~contact[1:])
    return TouchMetrics(
        settling_time(force[start:], desired, rate, lag),
        float(force.max() / desired - 1.0),
        int((ends < firm).sum()),
        int((ends >= firm).sum()),
        float(last.mean() - desired),
        float(last.std()),
    )


def settling_time(force: Array, desired: float, rate: float, lag: float = 0.0) -> float | None:
    """From the first row until the mean over a lag [s] stays within 5 % of F_d [s]; None if it is not so at the end."""
    force = mean_over(force, lag, 1.0 / rate)
    outside = np.flatnonzero(np.abs(force - desired) > BAND * desired)
    first = int(outside[-1]) + 1 if len(outside) else 0
    return first / rate if first <= len(force) - round(STAYS * rate) else None


@dataclass(frozen=True)
class ForceStep:
    """A step of the desired force in contact.

    Args:
        rise: from 10 to 90 % of the step [s]; None if it never came there.
        settling: until the force stays within 5 % of the new F_d [s]; None if it does not.
        overshoot: beyond the new F_d, over the step.
    """

    rise: float | None
    settling: float | None
    overshoot: float


def step(force: Array, before: float, after: float, rate: float, lag: float = 0.0) -> ForceStep:
    """Metrics of a step.

    Args:
        force: from the step on [N], shape (n,).
        before: F_d before it [N].
        after: F_d after it [N].
        rate: of the rows [Hz].
        lag: as of `touch`.
    """
    share = (force - before) / (after - before)
    at = [int(np.argmax(share >= level)) if (share >= level).any() else None for level in (0.1, 0.9)]
    rise = None if at[0] is None or at[1] is None else (at[1] - at[0]) / rate
    over = max(float(share.max()) - 1.0, 0.0)
    return ForceStep(rise, settling_time(force, after, rate, lag), over)


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
    part = (low - 0.5 * math.log(0.5)) / (low - high)
    return float(frequency[k - 1] * (frequency[k] / frequency[k - 1]) ** part)


@dataclass(frozen=True)
class RunMetrics:
    """Metrics of one run of the plan, and of one with a moving surface.

    Args:
        touch: the first contact.
        up, down: the steps.
        bandwidth: of force over desired force [Hz]; None beyond the plan's highest frequency.
        resonance: largest size of that ratio.
        disturbance: rms error while the surface moves, over the one of a tip that rests; None where nothing moved it.
    """

    touch: TouchMetrics
    up: ForceStep
    down: ForceStep
    bandwidth: float | None
    resonance: float
    disturbance: float | None


def of_run(
    plan: ForcePlan, force: Array, moving: Array | None, at_rest: float, free: float = 0.0
) -> RunMetrics:
    """Metrics of a run.

    Args:
        plan: of the desired force.
        force: on the surface in a run of it [N], shape (n,).
        moving: the same while the surface moves and F_d is constant [N]; None where there was no such run.
        at_rest: amplitude of the force that this motion causes on a tip that rests [N].
        free: largest force that counts as free motion [N].
    """
    first, second, third, _ = plan.starts
    high = (1.0 + STEP_HEIGHT) * plan.force
    begin = third + plan.ticks(PERIOD)
    periods = (len(force) - begin) // plan.ticks(PERIOD)
    ratio = response(force[begin:], plan.desired_force()[begin:], LINES, periods)
    return RunMetrics(
        touch(force[:first], plan.force, plan.rate, free),
        step(force[first:second], plan.force, high, plan.rate),
        step(force[second:third], high, plan.force, plan.rate),
        bandwidth(np.array(LINES) / PERIOD, ratio),
        float(np.abs(ratio).max()),
        None if moving is None else _disturbance(plan, moving, at_rest),
    )


def _disturbance(plan: ForcePlan, force: Array, at_rest: float) -> float:
    last = force[-plan.ticks(SWAYS / SWAY) :]
    return float(np.sqrt(np.mean((last - plan.force) ** 2)) / (at_rest / math.sqrt(2.0)))
