"""An arm at rest before a press: rate, bias and noise, and the faults with which no press should begin."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.free_motion import has_wrong_sign, wrong_sign_text
from palpate.contact_frame.payload import Payload
from palpate.errors import InputError
from palpate.force import ForceLoop, Gains
from palpate.press.at_rest import SURE, TARE, check_drift, check_range, fitting, noise_and_drift
from palpate.signals.rotations import rotate
from palpate.wires.order import Order, check_order
from palpate.wires.wire import ArmReading, Wire, unreadable

_MIN_READINGS = 20
"""Minimum number of readings; they give the noise's standard deviation to 1/sqrt(2 n), 16 %."""
_MAX_RETRIES = 4
"""Further half seconds in which a busy computer may get consecutive readings, and an arm come to rest."""
_READING_TIMEOUT = 10.0
"""Time for those readings [s]; nothing moves yet, and a busy computer may be starved for a while."""


@dataclass(frozen=True)
class AtRest:
    """Readings of the arm at rest, before contact.

    Args:
        position: [m], shape (3,).
        bias: of the force [N], shape (3,).
        noise: of the force along the direction, about its drift [N].
        drift: of the force along the direction [N/s].
        drift_std: its standard deviation [N/s].
        rate: readings a second [Hz].
        last: the last reading.
        offset: of this computer's clock from the arm's, the least that was seen [s].
    """

    position: Array
    bias: Array
    noise: float
    drift: float
    drift_std: float
    rate: float
    last: ArmReading
    offset: float

    def to_json(self) -> dict[str, Any]:
        """Bias, noise, drift and rate as plain JSON values."""
        return {
            "bias_N": self.bias.tolist(),
            "noise_N": self.noise,
            "drift_N_per_s": self.drift,
            "rate_Hz": self.rate,
        }


def check_at_rest(wire: Wire, order: Order) -> AtRest:
    """Read an arm at rest in free motion, and refuse what no press should begin with.

    Raises:
        InputError: another rate than the gains', another clock, an arm that moves, a sensor that is saturated, untared,
            too noisy or that drifts.
        ConnectionLostError: no readings.
    """
    gains = order.loop.gains
    sensed = _readings(wire)
    rate = sampling_rate(np.array([s.stamp for s in sensed]))
    for _ in range(_MAX_RETRIES):
        if rate * gains.arm.tick > 1.0 - gains.arm.tick / gains.theta and _largest_move(sensed) <= _max_move(
            gains
        ):
            break
        sensed = _readings(wire)
        rate = max(rate, sampling_rate(np.array([s.stamp for s in sensed])))
    # Over the lag theta a rate that is off by this moves a reading by one tick, which is what is proved.
    if abs(rate * gains.arm.tick - 1.0) > gains.arm.tick / gains.theta:
        raise InputError(
            f"the arm gives {rate:.4g} readings a second, and the gains are for {gains.arm.rate:g}: tune for this rate"
        )
    broken = next(filter(None, map(unreadable, sensed)), None)
    if broken is not None:
        raise InputError(f"{broken}; is its sensor switched on?")
    apart = position_lag_fault(min(sensed, key=lambda s: abs(s.position_lag)), gains.theta)
    if apart is not None:
        raise InputError(apart)
    offsets = np.array([s.received - s.stamp for s in sensed])
    _check_clock(offsets, gains.theta)
    force = np.array([s.force for s in sensed])
    along = force @ np.array(order.task.direction)
    noise, drift, drift_std = noise_and_drift(np.array([s.stamp for s in sensed]), along)
    rest = AtRest(
        np.array(sensed[-1].position),
        force.mean(axis=0),
        noise,
        drift,
        drift_std,
        rate,
        sensed[-1],
        float(offsets.min()),
    )
    _check(rest, _largest_move(sensed), order)
    return rest


def retune_for_noise(rest: AtRest, order: Order) -> tuple[Order, str | None]:
    """The order for the noise that was measured, and a sentence if that is another one than the gains'.

    Raises:
        InputError: the noise is above that of the gains, and a certificate or the force does not allow another.
    """
    gains = fitting(order.loop.gains, rest.noise, max(round(TARE * rest.rate), _MIN_READINGS))
    if gains is None:
        return order, None
    expected = order.loop.gains.arm.sensor.noise
    message = f"the force's noise is {rest.noise:.2g} N at rest, and the gains are for {expected:g} N"
    if order.loop.certificate is not None:
        raise InputError(
            f"{message}: the certificate is of other gains; tune for this noise, and certify again"
        )
    retuned = check_order(ForceLoop(gains), order.task, order.limits)
    return retuned, f"{message}: tuned again for {gains.arm.sensor.noise:.2g} N"


def position_lag_fault(sense: ArmReading, theta: float) -> str | None:
    """Reason why position and force of a reading are not simultaneous; None if they are.

    Args:
        sense: as it came.
        theta: the loop's lag [s].
    """
    lag = sense.position_lag
    if abs(lag) <= theta:
        return None
    return (
        f"the tool's position was taken {abs(lag):.3g} s {'before' if lag > 0.0 else 'after'} the force, more than the"
        f" loop's lag of {1e3 * theta:.3g} ms; have the positions ended, or are their clocks not set alike?"
    )


def _check_clock(offsets: Array, theta: float) -> None:
    """Refuse two clocks that run apart while the arm rests; readings that are late make no offset smaller [s]."""
    half = len(offsets) // 2
    apart = float(offsets[half:].min() - offsets[:half].min())
    if abs(apart) > theta / 2.0:
        speed = "slow" if apart > 0.0 else "fast"
        raise InputError(
            f"the arm's clock runs too {speed}: it and this computer's came {1e3 * abs(apart):.3g} ms apart within"
            f" {TARE / 2.0:g} s; is it a simulation that is not in real time?"
        )


def sampling_rate(stamps: Array) -> float:
    """Readings a second that the arm takes [Hz], by its own clock [s], shape (n,), though some never came.

    A step between two stamps is a tick or several. One of the shortest is taken for a tick, by which the others are
    counted.
    """
    steps = np.diff(stamps)
    tick = max(float(np.quantile(steps, 0.1)), 1e-9)
    return float(np.maximum(np.round(steps / tick), 1.0).sum() / max(float(steps.sum()), 1e-9))


def _readings(wire: Wire) -> list[ArmReading]:
    """Readings of half a second, at least the minimum number."""
    sensed = [wire.read(1.0)]
    while (span := sensed[-1].received - sensed[0].received) < TARE or len(sensed) < _MIN_READINGS:
        if span > _READING_TIMEOUT:
            raise InputError(f"only {len(sensed)} readings came in {span:.3g} s; is the arm switched on?")
        sensed.append(wire.read(1.0))
    return sensed


def _largest_move(sensed: list[ArmReading]) -> float:
    """Largest change of a coordinate of the tool over some readings [m]; infinite if one is not a number."""
    distance = float(np.ptp(np.array([s.position for s in sensed]), axis=0).max())
    return distance if math.isfinite(distance) else math.inf


def _max_move(gains: Gains) -> float:
    """Largest move of a tool that counts as at rest [m]."""
    return max(gains.approach * TARE, 1e-5)


def _check(rest: AtRest, distance: float, order: Order) -> None:
    task, limits, gains = order.task, order.limits, order.loop.gains
    check_range(float(np.abs(rest.bias).max()), limits.force, gains.arm.sensor.full_scale)
    if distance > _max_move(gains):
        raise InputError(f"the arm moved by {1e3 * distance:.3g} mm in {TARE:g} s; let it rest first")
    lowest = task.force * (1.0 - task.probe)
    if SURE * rest.noise > lowest:
        raise InputError(
            f"the force's noise is {rest.noise:.2g} N in free motion: {lowest:g} N is below 8 standard deviations"
        )
    check_drift(rest.drift, rest.drift_std, task.force, limits.seconds, gains.arm.sensor)


_SIGNIFICANCE = 3.0
"""Standard deviations of the weighed tool beyond which a difference is significant."""


def tool_notes(tool: Payload, rest: AtRest) -> list[str]:
    """Notes for the user before the arm moves.

    Args:
        tool: from `palpate payload`.
        rest: what the arm shows at rest.
    """
    message = weight_mismatch(tool, rest) or "the sensor shows the tool as it was weighed"
    if tool.inertia_followed is None or not has_wrong_sign(tool.inertia_followed):
        return [message]
    return [message, f"when it was weighed: {wrong_sign_text(tool.inertia_followed)}"]


def weight_mismatch(tool: Payload, rest: AtRest) -> str | None:
    """Difference of the sensor's reading at rest from the weighed tool, in words; None if there is none.

    The force of a wire is what the tool exerts, that of a payload is as its log had it: either sign is tried.

    Args:
        tool: from `palpate payload`.
        rest: what the arm shows at rest.
    """
    expected = np.array(tool.weight) + np.array(rotate(rest.last.quaternion, tool.bias))
    sure = _SIGNIFICANCE * math.hypot(tool.weight_std, tool.bias_std, tool.noise)
    apart = min(float(np.abs(rest.bias - sign * expected).max()) for sign in (1.0, -1.0))
    if apart <= sure:
        return None
    return (
        f"the sensor shows {_show(rest.bias)} N in free motion, and the tool as weighed makes {_show(expected)} N,"
        f" {apart:.2g} N apart in one axis: the sensor was zeroed since or drifts, the tool is another, or wrench and"
        " pose are of other frames. The tare takes it off as long as the tool does not turn"
    )


def _show(force: np.ndarray) -> str:
    return ", ".join(f"{value:.3g}" for value in force)
