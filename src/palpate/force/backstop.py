"""The backstop of the force law: what it does about swings that do not decay and contacts that do not last."""

from math import pi
from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_evidence import FREE_MOTION
from palpate.force.stage import LOCKED, STEP

MOST = 3.0
"""Bounces after which the tip stays where it is."""
LEAST = 0.01
"""Least factor of the gain."""
RECOVERY = 10.0
"""Time in which the gain recovers by a factor of e [s]."""


@part
class Backstop(NamedTuple):
    """Factor of the gain, and what it follows from."""

    care: float  # factor of the gain, and of the approach
    sign: float  # of the error
    peak: float  # largest error since its sign changed [N]
    before: float  # largest error of the swing before [N]
    swings: float  # that did not decay
    top: float  # largest force of this contact [N]
    bounces: float  # contacts that were lost before the force was held


@law
def next_backstop(law, b, was, stage, w, desired, before):
    """The backstop of this tick: it sees contacts that end, then swings.

    Args:
        law: the law's numbers.
        b: backstop of the tick before.
        was: stage of the tick before.
        stage: of this tick.
        w: readings.
        desired: F_d [N].
        before: F_d of the tick before [N].
    """
    if law.backing == 0.0:
        return b
    care, felt = min(b.care * (1.0 + law.tick / RECOVERY), 1.0), w.mean - w.rest
    if stage.phase == FREE_MOTION:
        if was.phase not in (FREE_MOTION, LOCKED) and b.top > law.bias:
            return after_bounce(law, b)
        return Backstop(care, 0.0, 0.0, 0.0, 0.0, 0.0, b.bounces)
    top, bounces = max(b.top, felt), 0.0 if stage.phase == LOCKED else b.bounces
    error, level = desired - felt, max(0.07 * abs(desired), 4.0 * sqrt(w.variance))
    if abs(desired - before) > STEP * abs(desired):
        return Backstop(care, 0.0, 0.0, 0.0, 0.0, top, bounces)
    side = 1.0 if error > level else -1.0 if error < -level else 0.0
    if side in (0.0, b.sign):
        peak = max(b.peak, abs(error)) if side == b.sign else b.peak
        return Backstop(care, b.sign, peak, b.before, b.swings, top, bounces)
    swings = b.swings + 1.0 if b.before > 0.0 and b.peak > 0.8 * b.before else 0.0
    if swings >= 2.0:
        return Backstop(max(0.5 * care, LEAST), side, abs(error), 0.0, 0.0, top, bounces)
    return Backstop(care, side, abs(error), b.peak, swings, top, bounces)


@law
def after_bounce(law, b):
    """A contact that was lost: the loop was beyond its gain margin pi/(2 alpha), so that the gain falls by that."""
    care = max(b.care * 2.0 * law.alpha / pi, LEAST)
    return Backstop(care, 0.0, 0.0, 0.0, 0.0, 0.0, b.bounces + 1.0)
