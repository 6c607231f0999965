"""Where in a press the loop is: in the air, learning the surface, or locked on what it knows of it."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_evidence import AIR, CONTACT, PLAIN

LEARNING, LOCKED = 1.0, 2.0
"""Phases after `AIR`."""
STEP = 0.02
"""Relative change of the desired force in a tick above which it is a step, which the error follows."""


@part
class Stage(NamedTuple):
    """Where in a press the loop is."""

    phase: float
    since: float  # ticks in it
    quiet: float  # ticks for which the error has been small
    firm: float  # ticks for which the force has stood out of the noise


@law
def staged(law, state, w, desired, before, false):
    """Where in a press this tick is, `false` if what was taken for a touch was the sensor's bias."""
    stage, felt = state.stage, w.mean - w.rest
    since = stage.since + 1.0
    firm = stage.firm + 1.0 if felt > sqrt(w.variance) else 0.0
    if stage.phase == AIR:
        return Stage(LEARNING, 0.0, 0.0, firm) if w.evidence >= CONTACT else Stage(AIR, since, 0.0, firm)
    if w.evidence <= 0.0 or false:
        return Stage(AIR, 0.0, 0.0, 0.0)
    if stage.phase == LOCKED and abs(desired - before) > 0.2 * abs(before):
        return Stage(LEARNING, 0.0, 0.0, firm)
    quiet = stage.quiet + 1.0 if abs(desired - felt) < 0.07 * abs(desired) else 0.0
    if stage.phase == LEARNING and quiet * law.tick > 3.0 * law.theta and law.locking > 0.0:
        return Stage(LOCKED, 0.0, 0.0, firm)
    return Stage(stage.phase, since, quiet, firm)


@law
def is_false(law, state, w):
    """Whether what was taken for a touch is the sensor's bias."""
    return follows_no_tip(law, state) and abs(w.slow) < law.bias


@law
def follows_no_tip(law, state):
    """Whether the force of a touch neither rises nor falls with the tip by as much as the softest surface's would."""
    known = state.known
    if known.std.x == 0.0 or state.stage.phase == AIR or state.bound.sure.stiffness > 0.0:
        return False
    return (abs(known.found.x) + PLAIN * known.std.x) * law.cap * law.approach < law.drift
