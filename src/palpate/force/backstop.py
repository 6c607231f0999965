"""The backstop of the force law: swings that do not decay halve the gain, whatever their cause."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_evidence import AIR
from palpate.force.stage import STEP


@part
class Backstop(NamedTuple):
    """Swings that do not decay."""

    care: float
    sign: float  # of the error
    peak: float  # since its last change [N]
    before: float  # of the swing before [N]
    swings: float
    calm: float  # ticks since it acted


@law
def guarded(law, b, stage, w, desired, before):
    """The backstop: two swings that do not decay halve the gain; ten seconds later it has recovered."""
    if law.backing == 0.0:
        return b
    error = desired - w.mean
    calm = b.calm + 1.0
    care = min(b.care * (1.0 + law.tick / 10.0), 1.0)
    level = max(0.07 * abs(desired), 4.0 * sqrt(w.variance))
    if stage.phase == AIR or abs(desired - before) > STEP * abs(desired):
        return Backstop(care, 0.0, 0.0, 0.0, 0.0, calm)
    side = 1.0 if error > level else -1.0 if error < -level else 0.0
    if side in (0.0, b.sign):
        peak = max(b.peak, abs(error)) if side == b.sign else b.peak
        return Backstop(care, b.sign, peak, b.before, b.swings, calm)
    swings = b.swings + 1.0 if b.before > 0.0 and b.peak > 0.8 * b.before else 0.0
    if swings >= 2.0:
        return Backstop(max(0.5 * care, 0.05), side, abs(error), 0.0, 0.0, 0.0)
    return Backstop(care, side, abs(error), b.peak, swings, calm)
