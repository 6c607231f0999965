"""Force sensor at rest in free motion, before every press and slide: its scale, noise and drift are checked."""

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Sensor
from palpate.force.gains import Gains

TARE = 0.5
"""Duration of the rest in free motion before a press [s]."""
SATURATED = 0.99
"""Fraction of a sensor's full scale from which on its force is not believed, as in the laws of `palpate.force`."""
SURE = 8.0
"""Standard deviations of a reading, which no reading of a press shows by chance."""


def check_range(reading: float, largest: float, full_scale: float) -> None:
    """Refuse a sensor that is saturated, or too far from zero.

    Args:
        reading: in free motion, the largest component [N].
        largest: that is to be read [N].
        full_scale: of the sensor [N].

    Raises:
        InputError: it stands at the end of its scale, or could not read that force.
    """
    if reading >= SATURATED * full_scale:
        raise InputError(
            f"the force sensor shows {reading:.3g} N in free motion, the end of its scale; unload it"
        )
    if reading + largest > full_scale:
        raise InputError(
            f"the force sensor shows {reading:.3g} N in free motion, so that it cannot read a force of up to"
            f" {largest:g} N (full scale {full_scale:g} N); tare it, or lower the force and its limit"
        )


DRIFT_PARTS = 10
DRIFT_SIGNIFICANCE = 4.5
"""Student's t of eight degrees of freedom at 99.9 %: a line through the means of ten parts."""
SETTLING_BAND = 0.05
"""Fraction of the desired force within which a press counts as settled; a drift may not leave it."""


def noise_and_drift(times: Array, force: Array) -> tuple[float, float, float]:
    """Noise [N], drift and the drift's standard deviation [N/s] of readings at rest.

    The drift is that of the means of ten parts, so that a hum, or the memory of a low-pass, counts once in each part.

    Args:
        times: of the readings [s], shape (n,), ten or more.
        force: [N], shape (n,).
    """
    t, f = (np.array([part.mean() for part in np.array_split(v, DRIFT_PARTS)]) for v in (times, force))
    t = t - t.mean()
    drift = float(t @ f / (t @ t))
    residual = f - f.mean() - drift * t
    about = force - force.mean() - drift * (times - times.mean())
    return float(about.std()), drift, float(np.sqrt(residual @ residual / (DRIFT_PARTS - 2) / (t @ t)))


def fitting(gains: Gains, noise: float, count: int) -> Gains | None:
    """The gains for a noise that was measured; None if they are for that already.

    No lag and no gain depends on the noise: it decides what counts as a touch.

    Args:
        gains: as they were tuned.
        noise: standard deviation of the readings at rest [N].
        count: of the readings.

    Raises:
        InputError: a noise that hides the force.
    """
    sensor = gains.arm.sensor
    if noise <= sensor.noise * (1.0 + SURE / np.sqrt(2.0 * count)):
        return None
    sensor = msgspec.structs.replace(sensor, noise=noise)
    return msgspec.structs.replace(gains, arm=msgspec.structs.replace(gains.arm, sensor=sensor))


def check_drift(drift: float, std: float, force: float, seconds: float, sensor: Sensor) -> None:
    """Refuse a sensor that surely drifts by more than its maker's figure, or than the press can bear.

    Args:
        drift: of the force at rest [N/s].
        std: its standard deviation [N/s].
        force: desired [N].
        seconds: that the press may last [s].
        sensor: of the gains; without a drift, so much is borne as leaves the force within 5 %.

    Raises:
        InputError: it drifts by more.
    """
    borne = SETTLING_BAND * force / seconds
    max_drift = borne if sensor.drift is None else max(sensor.drift, borne)
    if abs(drift) - DRIFT_SIGNIFICANCE * std > max_drift:
        raise InputError(
            f"the force drifts by {drift:.2g} N/s at rest, and at most {max_drift:.2g} N/s is borne: let the sensor"
            " warm up, tare again, or press for a shorter time"
        )
