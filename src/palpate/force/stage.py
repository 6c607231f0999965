"""Phase of a press: free motion, learning the surface, or locked on its estimate; and the backstop of the law.

The backstop lowers the gain on swings that do not decay, and stops the tip on contacts that do not last.
"""

from math import pi
from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_evidence import CONTACT, FREE_MOTION, PLAIN

LEARNING, LOCKED = 1.0, 2.0
"""Phases after free motion."""
STEP = 0.02
"""Relative change of the desired force in a tick above which it is a step, which the error follows."""


@part
class Stage(NamedTuple):
    """Phase of a press, and how long it has lasted."""

    phase: float
    since: float  # ticks in it
    quiet: float  # ticks for which the error has been small
    firm: float  # ticks for which the force has stood out of the noise


@law
def next_stage(law, state, w, desired, before, false_touch):
    """Phase of this tick; `false_touch` says that a suspected touch was the sensor's bias."""
    stage, felt = state.stage, w.mean - w.rest
    since = stage.since + 1.0
    firm = stage.firm + 1.0 if felt > sqrt(w.variance) else 0.0
    if stage.phase == FREE_MOTION:
        return (
            Stage(LEARNING, 0.0, 0.0, firm) if w.evidence >= CONTACT else Stage(FREE_MOTION, since, 0.0, firm)
        )
    if w.evidence <= 0.0 or false_touch:
        return Stage(FREE_MOTION, 0.0, 0.0, 0.0)
    if stage.phase == LOCKED and abs(desired - before) > 0.2 * abs(before):
        return Stage(LEARNING, 0.0, 0.0, firm)
    quiet = stage.quiet + 1.0 if abs(desired - felt) < 0.07 * abs(desired) else 0.0
    if stage.phase == LEARNING and quiet * law.tick > 3.0 * law.theta:
        return Stage(LOCKED, 0.0, 0.0, firm)
    return Stage(stage.phase, since, quiet, firm)


@law
def is_false_touch(law, state, w):
    """Whether what was taken for a touch is the sensor's bias."""
    return follows_no_tip(law, state) and abs(w.slow) < law.bias


@law
def follows_no_tip(law, state):
    """Whether the force of a touch neither rises nor falls with the tip by as much as the softest surface's would."""
    estimate = state.estimate
    if estimate.std.x == 0.0 or state.stage.phase == FREE_MOTION or state.bound.sure.stiffness > 0.0:
        return False
    return (abs(estimate.value.x) + PLAIN * estimate.std.x) * law.cap * law.approach < law.drift


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
