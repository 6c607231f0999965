"""Tare of a force sensor in free motion, and a check that it can still read the forces to come."""

from __future__ import annotations

from palpate.errors import InputError

TARE = 0.5
"""At rest in the air before a press [s]."""
SURE = 8.0
"""Standard deviations of a reading, which no reading of a press shows by chance."""


def check_range(shown: float, most: float, full_scale: float) -> None:
    """Refuse a sensor that is saturated, or too far from zero.

    Args:
        shown: in the air, the largest component [N].
        most: that is to be read [N].
        full_scale: of the sensor [N].

    Raises:
        InputError: it stands at the end of its scale, or could not read that force.
    """
    if shown >= 0.99 * full_scale:
        raise InputError(f"the force sensor shows {shown:.3g} N in the air, the end of its scale; unload it")
    if shown + most > full_scale:
        raise InputError(
            f"the force sensor shows {shown:.3g} N in the air, so that it cannot read a force of up to {most:g} N (full"
            f" scale {full_scale:g} N); tare it, or lower the force and its limit"
        )
