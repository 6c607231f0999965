"""Phase of a press: free motion, learning the surface, or locked on its estimate."""

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
    if stage.phase == LEARNING and quiet * law.tick > 3.0 * law.theta and law.locking > 0.0:
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
