"""Where in a press the loop is: in the air, learning the surface, or locked on what it knows of it."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_evidence import AIR, CONTACT

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
def staged(law, stage, w, desired, before, force):
    """Where in a press this tick is."""
    since = stage.since + 1.0
    firm = stage.firm + 1.0 if w.mean - w.rest > sqrt(w.variance) else 0.0
    if stage.phase == AIR:
        return Stage(LEARNING, 0.0, 0.0, firm) if w.evidence >= CONTACT else Stage(AIR, since, 0.0, firm)
    if w.evidence <= 0.0:
        return Stage(AIR, 0.0, 0.0, 0.0)
    if stage.phase == LOCKED and abs(desired - before) > 0.2 * abs(before):
        return Stage(LEARNING, 0.0, 0.0, firm)
    quiet = stage.quiet + 1.0 if abs(desired - w.mean) < 0.07 * abs(desired) else 0.0
    if stage.phase == LEARNING and quiet * law.tick > 3.0 * law.theta and law.locking > 0.0:
        return Stage(LOCKED, 0.0, 0.0, firm)
    return Stage(stage.phase, since, quiet, firm)
