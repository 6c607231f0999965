"""K_u: the upper bound of the stiffness that the gain follows, and how it falls and rises."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate.force.contact_evidence import AIR, EVIDENT
from palpate.force.regression import AXIS_K, BOTH
from palpate.force.stage import LOCKED

PLAIN = 2.5
"""Standard deviations above which a stiffness, or a damping, is a surface and not noise in the air.

Measured by benchmarks/force/first_touches.py: with 2 noise passes for a soft surface once in some thousand touches
(22 % over, --arms ur5e --touches 1000 --seed 2), with 1.5 oftener (37 %).
"""
SURE = 4.0
"""Readings for which K_u stays where it was at a touch: what they refute was an edge, not a ramp.

Measured by benchmarks/force/first_touches.py: with none a stiff surface that was felt one reading ago counts as soft,
and is pressed 38 % too hard.
"""
DAMPED = 0.52
"""Least share of K + B/theta, beside the arm's own spring, that K_u has to be: above the half that the adapting law's
proof allows.

With alpha 0.42 the sensitivity is then below 1.56 for every B/K, 1.67 for a torque arm
(tests/force/test_sensitivity.py).
"""
STIFFER = 1.3
"""Times K_u that the last theta has to show before a locked K_u rises: well within the half that the proof leaves."""
SHOWN = EVIDENT**0.5
"""Standard deviations by which a stiffer surface is as evident as a contact."""
AGAIN = 3.0
"""Lags after which a rise that the readings have not borne out is taken back: as long as an error has to be small
before the bound is held."""


@part
class Bound(NamedTuple):
    """K_u."""

    used: float  # [N/m]
    held: float  # what is evident of it: `used` but for a suspicion while it is locked [N/m]
    calm: float  # ticks since the last suspicion


@law
def bounded(law, bound, stage, known):
    """K_u at this tick: what all since the touch allows; locked, what was known then or has become evident since.

    Locked, it rises at once where the last theta alone is by `z` standard deviations for a stiffer surface. Noise is so
    too, now and then: the rise is taken back unless the readings bear it out, so that it adds up to nothing.
    """
    if stage.phase == AIR:
        return Bound(law.cap, law.cap, 0.0)
    if known.since * law.tick < law.blind or stage.since * law.tick < SURE * law.period:
        return bound
    p, alone, both = known.fast.solved(), known.fast.std(AXIS_K), known.fast.std(BOTH)
    upper = min((1.0 + law.eps) * highest(law, p, law.z * alone, law.z * both), law.cap)
    if stage.phase != LOCKED:
        now = from_slow(law, known)
        now = upper if highest(law, p, -alone, -both) > now else now
        return Bound(now, now, 0.0)
    held = bound.held
    if highest(law, p, -SHOWN * alone, -SHOWN * both) > STIFFER * held:
        held = upper
    suspected = highest(law, p, -law.z * alone, -law.z * both)
    calm = 0.0 if suspected > STIFFER * held else bound.calm + 1.0
    used = bound.used if calm * law.tick < AGAIN * law.theta else held
    return Bound(upper if suspected > STIFFER * used else max(used, held), held, calm)


@law
def from_slow(law, known):
    """K_u as all since the touch allows: never below the bound, and the cap unless a surface is plain to see."""
    p, sd = known.found, known.std
    room = law.z * law.bounding / (1.0 + law.eps)
    plain = known.shown > 0.0 or p.x + p.y > PLAIN * sd.z or p.x > PLAIN * sd.x
    if law.bounding > 0.0 and not plain:
        return law.cap
    return min(max((1.0 + law.eps) * highest(law, p, room * sd.x, room * sd.z), law.floor), law.cap)


@law
def highest(law, p, alone, both):
    """K_u of an estimate with room for K alone, and for K + B/theta [N/m]."""
    return max(law.cap * (p.x + alone), least_for(law, max(law.cap * (p.x + p.y + both), 0.0)))


@law
def least_for(law, whole):
    """K_u at which 1/(1/K_s + 1/K_u) is the least share of that of K + B/theta that there may be [N/m]."""
    return DAMPED * whole / (1.0 + (1.0 - DAMPED) * law.compliance * whole)
