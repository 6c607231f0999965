"""An arm at rest before a press: rate, bias and noise, and the faults with which no press should begin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.press.tare import SURE, TARE, check_range
from palpate.wires.order import Order
from palpate.wires.protocol import Sense, Wire

_FEWEST = 20
"""Readings, at least: they tell the noise's deviation to 1/sqrt(2 n), 16 %, and `_check` wants eight of them."""
_TRIES = 4
"""Half seconds more in which a busy computer may get readings that follow on each other: starved, it misses most."""
_PATIENCE = 10.0
"""For which that many readings may take: nothing moves yet, and a busy computer may be starved for a while [s]."""


@dataclass(frozen=True)
class AtRest:
    """Readings of the arm at rest, before contact.

    Args:
        position: [m], shape (3,).
        bias: of the force [N], shape (3,).
        noise: of the force along the direction [N].
        rate: readings a second [Hz].
        last: the last reading.
    """

    position: Array
    bias: Array
    noise: float
    rate: float
    last: Sense


def look(wire: Wire, order: Order) -> AtRest:
    """Read an arm at rest in the air, and refuse what no press should begin with.

    Raises:
        InputError: another rate than the gains', an arm that moves, a sensor that is saturated, untared or too noisy.
        LostError: no readings.
    """
    gains = order.loop.gains
    sensed = _readings(wire)
    rate = rate_of(np.array([s.stamp for s in sensed]))
    for _ in range(_TRIES):
        if rate * gains.arm.tick > 1.0 - gains.arm.tick / gains.theta:
            break
        sensed = _readings(wire)
        rate = max(rate, rate_of(np.array([s.stamp for s in sensed])))
    # Over the lag theta a rate that is off by this moves a reading by one tick, which is what is proved.
    if abs(rate * gains.arm.tick - 1.0) > gains.arm.tick / gains.theta:
        raise InputError(
            f"the arm gives {rate:.4g} readings a second, and the gains are for {gains.arm.rate:g}: tune for this rate"
        )
    force, place = np.array([s.force for s in sensed]), np.array([s.position for s in sensed])
    if not (np.isfinite(force).all() and np.isfinite(place).all()):
        raise InputError("the arm gives readings that are no numbers; is its sensor switched on?")
    along = force @ np.array(order.task.direction)
    found = AtRest(place[-1], force.mean(axis=0), float(along.std()), rate, sensed[-1])
    _check(found, float(np.ptp(place, axis=0).max()), order)
    return found


def rate_of(stamps: Array) -> float:
    """Readings a second that the arm takes [Hz], by its own clock [s], shape (n,), though some never came.

    A step between two stamps is a tick or several. One of the shortest is taken for a tick, by which the others are
    counted.
    """
    steps = np.diff(stamps)
    tick = max(float(np.quantile(steps, 0.1)), 1e-9)
    return float(np.maximum(np.round(steps / tick), 1.0).sum() / max(float(steps.sum()), 1e-9))


def _readings(wire: Wire) -> list[Sense]:
    """Those of half a second, and enough of them."""
    sensed = [wire.read(1.0)]
    while (span := sensed[-1].received - sensed[0].received) < TARE or len(sensed) < _FEWEST:
        if span > _PATIENCE:
            raise InputError(f"only {len(sensed)} readings came in {span:.3g} s; is the arm switched on?")
        sensed.append(wire.read(1.0))
    return sensed


def _check(found: AtRest, moved: float, order: Order) -> None:
    task, limits, gains = order.task, order.limits, order.loop.gains
    check_range(float(np.abs(found.bias).max()), limits.force, gains.arm.sensor.full_scale)
    if moved > max(gains.approach * TARE, 1e-5):
        raise InputError(f"the arm moved by {1e3 * moved:.3g} mm in {TARE:g} s; let it rest first")
    lowest = task.force * (1.0 - task.probe)
    if SURE * found.noise > lowest:
        raise InputError(
            f"the force's noise is {found.noise:.2g} N in the air: {lowest:g} N is below 8 standard deviations of it"
        )
