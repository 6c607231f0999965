"""K_u: the upper bound of the stiffness that the gain follows, and how it falls and rises."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.contact_estimate import AXIS_K, BOTH
from palpate.force.contact_evidence import EDGE, EVIDENT, FEWEST, FREE_MOTION, PLAIN
from palpate.force.stage import LOCKED

SHOWED = 3.0
"""Times the largest deviation that free motion has shown, and the largest rise within half of theta, that a surface has
to exceed: three steps of a cable never do.
Measured by benchmarks/force/free_motion.py: with 2.5 slow hums and coloured noise pass three times as often."""
STOPPED = 0.75
"""Of the approach: a servo's tip that was faster, and is slower than this, is held back by a surface, stiffer than a
third of the servo.
No error of a sensor slows the tip. Measured by benchmarks/arms/servos.py and benchmarks/force/free_motion.py."""
SURE = 4.0
"""Readings for which K_u stays where it was at a touch: what they refute was an edge, not a ramp.
Measured by benchmarks/force/first_touches.py: with none a stiff surface that was felt one reading ago counts as soft,
and is pressed 38 % too hard."""
DAMPED = 0.52
"""Least share of K + B/theta, beside the arm's own spring, that K_u has to be: above the half that the adapting law's
proof allows.
With alpha 0.42 the sensitivity is then below 1.56 for every B/K, 1.67 for a torque arm
(tests/force/test_sensitivity.py)."""
STIFFER = 1.3
"""Times K_u that the last theta has to show before a locked K_u rises: well within the half that the proof leaves."""
SHOWN = EVIDENT**0.5
"""Standard deviations by which a stiffer surface is as evident as a contact."""
AGAIN = 3.0
"""Lags after which a rise that the readings have not borne out is taken back: as long as an error has to be small
before the bound is held."""


@part
class Bound(NamedTuple):
    """Upper bound K_u of the stiffness."""

    used: float  # [N/m]
    held: float  # what is evident of it: `used` but for a suspicion while it is locked [N/m]
    most: float  # the cap, or what has refuted it [N/m]
    least: float  # half of what was held, until there is free motion: a surface that recedes looks soft [N/m]
    calm: float  # ticks since the last suspicion
    confirmed: float  # 1 where the force is surely a surface's, 0 while it may be the sensor's alone
    trail: float  # position of theta/2 ago, smoothed, until then [m]
    stroke: float  # of the tip in theta/2, at the end of free motion [m]


@law
def next_bound(law, bound, stage, estimate, w, f):
    """K_u at this tick: what all since the touch allows; locked, what was known then or has become evident since.

    Locked, it rises at once where the last theta alone is by `z` standard deviations for a stiffer surface. Noise is so
    too, now and then: the rise is taken back unless the readings bear it out, so that it adds up to nothing.
    """
    used, held, most, least = bound.used, bound.held, bound.most, bound.least
    calm, confirmed, trail, stroke = bound.calm, bound.confirmed, bound.trail, bound.stroke
    if confirmed == 0.0:
        trail += 2.0 * law.tick / law.theta * (f.y - trail)
    if stage.phase == FREE_MOTION:
        used, held, least, calm, confirmed, stroke = most, most, 0.0, 0.0, 0.0, f.y - trail
    elif estimate.since * law.tick >= law.blind and stage.since * law.tick >= SURE * law.period:
        p, alone, both = estimate.fast.solution(), estimate.fast.std(AXIS_K), estimate.fast.std(BOTH)
        most = max(most, (1.0 + law.eps) * highest(law, p, -SHOWN * alone, -SHOWN * both))
        upper = min((1.0 + law.eps) * highest(law, p, law.z * alone, law.z * both), most)
        if stage.phase == LOCKED:
            if highest(law, p, -SHOWN * alone, -SHOWN * both) > STIFFER * held:
                held = upper
            suspected = highest(law, p, -law.z * alone, -law.z * both)
            calm = 0.0 if suspected > STIFFER * held else calm + 1.0
            used = used if calm * law.tick < AGAIN * law.theta else held
            used = upper if suspected > STIFFER * used else max(used, held)
            least = 0.5 * held
        else:
            used = most
            if confirmed > 0.0 or is_surface(law, estimate, w, f.y - trail, stroke):
                confirmed = 1.0
                used = max(from_slow(law, estimate, most), least)
                used = upper if highest(law, p, -alone, -both) > used else used
            held, calm = used, 0.0
    return Bound(
        used=used, held=held, most=most, least=least, calm=calm, confirmed=confirmed, trail=trail, stroke=stroke
    )  # fmt: skip


@law
def is_surface(law, estimate, w, moved, stroke):
    """Whether the force is surely that of a surface, from which on the tip may be faster than its approach.

    The force is above the level, and above `SHOWED` times what free motion and any half of theta have shown, and it
    follows the tip. Of a servo's tip it is enough that it is held back.

    Args:
        law: the law's numbers.
        estimate: of the surface.
        w: readings.
        moved: way of the tip in the last theta/2 [m].
        stroke: the same at the end of free motion [m].
    """
    level = max(law.level, EDGE * sqrt(w.variance))
    if w.fresh <= FEWEST or w.mean - w.rest <= level:
        return False
    slow = STOPPED * 0.5 * law.theta * law.approach
    if law.lead > 0.0 and moved < slow < stroke:
        return True
    shown = w.mean - w.rest > SHOWED * w.steepest.rise and w.slow - w.rest > SHOWED * w.peak
    return shown and (estimate.value.x - EDGE * estimate.std.x) * law.cap * law.approach > law.drift


@law
def from_slow(law, estimate, most):
    """K_u as all since the touch allows: never below the bound, and the cap unless a surface is plain to see."""
    p, sd = estimate.value, estimate.std
    room = law.z / (1.0 + law.eps)
    plain = estimate.shown > 0.0 or p.x + p.y > PLAIN * sd.z or p.x > PLAIN * sd.x
    if not plain:
        return most
    return min(max((1.0 + law.eps) * highest(law, p, room * sd.x, room * sd.z), law.floor), most)


@law
def highest(law, p, alone, both):
    """K_u of an estimate with room for K alone, and for K + B/theta [N/m]."""
    return max(law.cap * (p.x + alone), least_for(law, max(law.cap * (p.x + p.y + both), 0.0)))


@law
def least_for(law, whole):
    """K_u at which 1/(1/K_s + 1/K_u) is the least share of that of K + B/theta that there may be [N/m]."""
    return DAMPED * whole / (1.0 + (1.0 - DAMPED) * law.compliance * whole)
