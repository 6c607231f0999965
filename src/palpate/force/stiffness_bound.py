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
EARNED = 3.0
"""Times as fast as before the tip may be where the readings bear the stiffness out: twice as fast costs a tenth of a
second on the softest surfaces, four times as fast lets a sensor that lies once come to twice the peak.
Measured by benchmarks/force/free_motion.py."""
BORNE = 2.0
"""Standard deviations by which a rise that is foretold has to stand out of the noise to count as a test."""
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
class Sure(NamedTuple):
    """The force as surely that of a surface."""

    stiffness: float  # with which it became so, in caps; 0 while the force may be the sensor's alone
    x: float  # position at the last test of it; until it is sure, a servo's of theta/2 ago, smoothed [m]
    force: float  # mean force there [N]
    limit: float  # of the speed [m/s]
    refuted: float  # 1 in the tick in which it became unsure again
    way: float  # of a servo's tip in theta/2, at the end of free motion [m]


@part
class Bound(NamedTuple):
    """Upper bound K_u of the stiffness."""

    used: float  # [N/m]
    held: float  # what is evident of it: `used` but for a suspicion while it is locked [N/m]
    most: float  # the cap, or what has refuted it [N/m]
    least: float  # half of what was held, until there is free motion: a surface that recedes looks soft [N/m]
    calm: float  # ticks since the last suspicion
    sure: Sure


@law
def next_bound(law, bound, stage, estimate, w, f):
    """K_u at this tick: what all since the touch allows; locked, what was known then or has become evident since.

    Locked, it rises at once where the last theta alone is by `z` standard deviations for a stiffer surface. Noise is so
    too, now and then: the rise is taken back unless the readings bear it out, so that it adds up to nothing.
    """
    if stage.phase == FREE_MOTION:
        x = trail(law, bound.sure, f)
        return Bound(
            bound.most, bound.most, bound.most, 0.0, 0.0, Sure(0.0, x, 0.0, law.approach, 0.0, f.y - x)
        )
    if bound.sure.stiffness == 0.0:
        unsure = Sure(
            0.0, trail(law, bound.sure, f), 0.0, bound.sure.limit, bound.sure.refuted, bound.sure.way
        )
        bound = Bound(bound.used, bound.held, bound.most, bound.least, bound.calm, unsure)
    if estimate.since * law.tick < law.blind or stage.since * law.tick < SURE * law.period:
        return bound
    p, alone, both = estimate.fast.solution(), estimate.fast.std(AXIS_K), estimate.fast.std(BOTH)
    most = max(bound.most, (1.0 + law.eps) * highest(law, p, -SHOWN * alone, -SHOWN * both))
    upper = min((1.0 + law.eps) * highest(law, p, law.z * alone, law.z * both), most)
    if stage.phase != LOCKED:
        sure = borne_out(law, bound.sure, estimate, w, f)
        if sure.stiffness == 0.0:
            return Bound(most, most, most, bound.least, 0.0, sure)
        now = max(from_slow(law, estimate, most), bound.least)
        now = upper if highest(law, p, -alone, -both) > now else now
        return Bound(now, now, most, bound.least, 0.0, sure)
    held = bound.held
    if highest(law, p, -SHOWN * alone, -SHOWN * both) > STIFFER * held:
        held = upper
    suspected = highest(law, p, -law.z * alone, -law.z * both)
    calm = 0.0 if suspected > STIFFER * held else bound.calm + 1.0
    used = bound.used if calm * law.tick < AGAIN * law.theta else held
    return Bound(
        upper if suspected > STIFFER * used else max(used, held), held, most, 0.5 * held, calm, bound.sure
    )


@law
def borne_out(law, sure, estimate, w, f):
    """Whether the force is surely that of a surface, and how fast the tip may be.

    It becomes so above the level, and above `SHOWED` times what free motion and any half of theta have shown, where the
    force follows the tip. From there on each part of the way is a test: the force has to rise by half of what the
    stiffness foretells, where that stands out of the noise. If it does, the speed may be `EARNED` times as high; if
    not, nothing is sure.
    """
    sigma = sqrt(w.variance)
    if sure.stiffness > 0.0:
        noise = max(BORNE * 0.7 * sigma, w.peak)
        expected, rise = 0.5 * sure.stiffness * law.cap * (f.y - sure.x), w.mean - sure.force
        if rise < expected - noise:
            return Sure(0.0, f.y, 0.0, law.approach, 1.0, 0.0)
        if expected > noise or sure.limit >= law.speed:
            return Sure(sure.stiffness, f.y, w.mean, min(EARNED * sure.limit, law.speed), 0.0, 0.0)
        return sure
    level = max(law.level, EDGE * sigma, SHOWED * w.steepest.rise)
    slow = STOPPED * 0.5 * law.theta * law.approach
    stopped = law.lead > 0.0 and f.y - sure.x < slow < sure.way
    if (
        stopped
        and w.fresh > FEWEST
        and w.mean - w.rest > max(law.level, EDGE * sigma)
        and estimate.value.x > 0.0
    ):
        return Sure(estimate.value.x, f.y, w.mean, min(EARNED * law.approach, law.speed), 0.0, 0.0)
    follows = (estimate.value.x - EDGE * estimate.std.x) * law.cap * law.approach > law.drift
    shown = w.mean - w.rest > level and w.slow - w.rest > SHOWED * w.peak
    if w.fresh > FEWEST and shown and follows:
        return Sure(estimate.value.x, f.y, w.mean, min(EARNED * law.approach, law.speed), 0.0, 0.0)
    return Sure(0.0, sure.x, 0.0, law.approach, 0.0, sure.way)


@law
def trail(law, sure, f):
    """Position of theta/2 ago, smoothed, as long as nothing is sure; where the tip is when that begins [m]."""
    return f.y if sure.stiffness > 0.0 else sure.x + 2.0 * law.tick / law.theta * (f.y - sure.x)


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
