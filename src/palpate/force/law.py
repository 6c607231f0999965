"""The cautious law: presses with the gain that an upper bound of the stiffness allows, and learns that bound.

    v = g (F_d - F_m) + dF_d/dt / K_u,        x_cmd += T v
    g = alpha / (theta (1 - rho (K_u + K_s/2)/(K_u + K_s)) K_eff(K_u))
    K_u = max of (1 + eps) K^ + z sd and 0.52 ((1 + eps)(K^ + B^/theta) + z sd)

Damping is lead, so that a bound of the stiffness alone is enough until B/K is above 0.9 theta. In the air K_u is the
stiffest surface that there may be, so that approach and touch follow from the same law. It is written once, in
operators: compiled in `ForceLoop`, in the simulator and on the bench, plain in a debugger.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, sqrt
from palpate.force.contact_evidence import (
    AIR,
    CONTACT,
    EDGE,
    LEVEL,
    Watch,
    behind,
    listened,
    spread_of,
    watched,
)
from palpate.force.onset import NO_STARTS, Starts, explained, latest
from palpate.force.regression import AXIS_B, AXIS_K, BOTH, NOTHING, Fit, fit_of, fit_through, without_offset

LEARNING, LOCKED = 1.0, 2.0
"""Phases after `AIR`."""
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
STEP = 0.02
"""Relative change of the desired force in a tick above which it is a step, which the error follows."""


@part
class Cautious(NamedTuple):
    """The law's numbers.

    Args:
        tick: T [s].
        theta: whole lag of the loop [s].
        alpha: gain in units of 1/theta.
        compliance: of the spring between commanded and measured position [m/N]; 0 where the measured position is
            the one before it.
        relief: rho, see `relief_of`; 0 for a position arm.
        cap: largest K + B/theta that there may be, as the measured position feels it [N/m].
        floor: lowest K_u that is used [N/m].
        speed: the arm's limit [m/s].
        approach: speed in the air [m/s].
        noise: standard deviation of a reading, until the air has told better [N].
        memory: time in which the sensor's low-pass forgets [s].
        period: between two readings [s].
        E, e0, e1: the sensor's low-pass on the position, from tick to tick: z' = E z + e0 x + e1 x'.
        c: its output is c z + d x.
        d: see c.
        z: standard deviations between estimate and bound.
        eps: relative room of the bound.
        full_scale: of the sensor [N].
        force_limit: above which the tip withdraws [N].
        locking: 1; 0 learns always.
        bounding: 1; 0 takes the estimate itself.
        backing: 1; 0 leaves the backstop out.
    """

    tick: float
    theta: float
    alpha: float
    compliance: float
    relief: float
    cap: float
    floor: float
    speed: float
    approach: float
    noise: float
    memory: float
    period: float
    E: Mat3
    e0: Vec3
    e1: Vec3
    c: Vec3
    d: float
    z: float
    eps: float
    full_scale: float
    force_limit: float
    locking: float
    bounding: float
    backing: float

    def start(self):
        """In the air, knowing nothing."""
        fit, variance = Fit(NOTHING, ZERO3), self.noise * self.noise
        return CautiousState(
            0.0,
            0.0,
            Watch(0.0, 0.0, 0.0, 0.0, variance, 0.5 * variance * self.period / self.theta, 0.0, 0.0, 0.0),
            Follow(ZERO3, 0.0, 0.0, 0.0, 0.0),
            Stage(AIR, 0.0, 0.0, 0.0),
            Learned(fit, fit, 0.0, 0.0, 0.0, ZERO3, ZERO3),
            NO_STARTS,
            self.cap,
            Backstop(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        )

    def step(self, state, desired, force, position):
        """One tick: speed of the commanded position [m/s], from the forces [N] and the measured position [m]."""
        before = state.desired if state.ticks > 0.0 else desired
        follow = followed(self, state, position)
        starts = listened(self, state, follow, force)
        watch = watched(self, state, starts, force)
        stage = staged(self, state.stage, watch, desired, before, force)
        known = begun(self, state.known, state.stage, stage, watch, follow, starts, behind(self, state))
        known = taken(self, known, state, stage, watch, follow, force)
        bound = bounded(self, state.bound, stage, watch, known)
        backstop = guarded(self, state.backstop, stage, watch, desired, before)
        u = backstop.care * gain(self, bound) * (desired - force)
        forward = 0.0
        if stage.phase != AIR and abs(desired - before) <= STEP * abs(desired):
            forward = (desired - before) / self.tick * (self.compliance + 1.0 / bound)
        firm = stage.firm * self.tick > self.theta or bound < 0.5 * self.cap
        limit = self.speed if stage.phase != AIR and firm else self.approach
        speed = max(min(u + forward, limit), -self.speed) if stage.phase != AIR else self.approach
        return speed, CautiousState(
            state.ticks + 1.0, desired, watch, follow, stage, known, starts, bound, backstop
        )  # fmt: skip

    def told(self, state):
        """K_u [N/m]."""
        return state.bound


@part
class Follow(NamedTuple):
    """The position through the sensor's low-pass."""

    z: Vec3
    x: float  # of the tick before, from the origin
    y: float  # as the sensor saw it
    y0: float  # of the tick before
    origin: float


@part
class Stage(NamedTuple):
    """Where in a press the loop is."""

    phase: float
    since: float  # ticks in it
    quiet: float  # ticks for which the error has been small
    firm: float  # ticks for which the force has stood out of the noise


@part
class Learned(NamedTuple):
    """What is known of the surface."""

    slow: Fit  # since the touch
    fast: Fit  # over theta
    since: float  # ticks since the contact began
    origin: float  # of the position in both fits [m]
    shown: float  # 1 where lines through the readings showed the surface
    found: Vec3  # K, B/theta in caps, offset [N]
    std: Vec3  # of K, B/theta and their sum, in caps


@part
class Backstop(NamedTuple):
    """Swings that do not decay."""

    care: float
    sign: float  # of the error
    peak: float  # since its last change [N]
    before: float  # of the swing before [N]
    swings: float
    calm: float  # ticks since it acted


@part
class CautiousState(NamedTuple):
    ticks: float
    desired: float
    watch: Watch
    follow: Follow
    stage: Stage
    known: Learned
    starts: Starts
    bound: float  # K_u [N/m]
    backstop: Backstop


@law
def gain(law, bound):
    """g [m/(s N)]."""
    felt = law.compliance * bound
    lag = law.theta * (1.0 - law.relief * (felt + 0.5) / (felt + 1.0))
    return law.alpha / lag * (law.compliance + 1.0 / bound)


@law
def followed(law, state, position):
    """This tick's position as the sensor saw it."""
    f = state.follow
    if state.ticks < 1.0:
        return Follow(ZERO3, 0.0, 0.0, 0.0, position)
    x = position - f.origin
    z = law.E @ f.z + f.x * law.e0 + x * law.e1
    return Follow(z, x, law.c @ z + law.d * x, f.y, f.origin)


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


@law
def begun(law, known, before, stage, w, f, starts, air):
    """What is known as this stage begins: in the air nothing, at a touch what its start tells, after a step a quarter.

    A stiff contact begins where the force last was within the noise: there it is at rest, but for the noise and for
    what comes between two readings.
    """
    sigma = sqrt(w.variance)
    slow, fast, since, origin, shown, found, std = known
    if stage.phase == AIR:
        since, origin, shown, found, std = 0.0, f.y, 0.0, ZERO3, ZERO3
    if stage.firm == 0.0:
        x = law.cap * (f.y - 0.004 / law.tick * (f.y - f.y0) - origin)
        fast = fit_through(x, w.rest + 0.5 * sigma, sigma)
    if before.phase == AIR and stage.phase == LEARNING:
        if w.mean - w.rest > LEVEL * sigma and stage.firm * law.tick < law.memory:
            readings = stage.firm * law.tick / law.period + 1.0
            back = (stage.firm + 0.004 / law.tick) * (f.y - f.y0)
            level = w.mean - w.rest
            fast = fit_through(
                law.cap * (f.y - back - origin), w.rest + 0.5 * sigma, sigma + level / readings
            )
            slow, since, found, std = fast, stage.firm, ZERO3, ZERO3
        else:
            line = latest(starts, air, explained(starts, air) - spread_of(law, w))
            pace = 2.0 * law.cap * law.theta * line.u / (line.n * line.n * law.period)
            slow = fit_of(line, law.cap, origin, pace, w.rest, spread_of(law, w))
            since, shown, found = line.n * law.period / law.tick, 1.0, slow.solved()
            std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    if before.phase == LOCKED and stage.phase == LEARNING:
        slow = without_offset(slow, 0.25)
    return Learned(slow, fast, since, origin, shown, found, std)


@law
def taken(law, known, state, stage, w, f, force):
    """What is known with this tick's reading."""
    since = known.since + 1.0
    if w.age > 0.0 or since * law.tick < law.memory:
        return Learned(known.slow, known.fast, since, known.origin, known.shown, known.found, known.std)
    rate = (f.y - f.y0) / law.tick
    phi = Vec3(law.cap * (0.5 * (f.y + f.y0) - known.origin), law.cap * law.theta * rate, 1.0)
    if state.bound >= law.cap and known.std.z > 0.0 and force - known.found @ phi > EDGE * sqrt(w.variance):
        return Learned(
            known.fast, known.fast, stage.firm, known.origin, 0.0, ZERO3, ZERO3
        )  # refuted: it begins here
    moving = min(max(known.found.x, 0.0), 1.0) * law.cap * rate * law.tick
    noise = 2.0 * law.theta * w.tide / (w.gap * law.tick)
    weight = 1.0 / (noise + moving * moving / 12.0)
    fast = known.fast
    if stage.firm * law.tick >= law.memory:
        fast = fast.taking(phi, force, weight, 1.0 - law.tick / law.theta)
    if stage.phase == LOCKED:
        return Learned(known.slow, fast, since, known.origin, known.shown, known.found, known.std)
    keep = 1.0 if state.bound >= law.cap else 1.0 - law.tick / (6.0 * law.theta)
    slow = known.slow.taking(phi, force, weight, keep)
    std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    return Learned(slow, fast, since, known.origin, known.shown, slow.solved(), std)


@law
def bounded(law, bound, stage, w, known):
    """K_u at this tick."""
    if stage.phase == AIR:
        return law.cap
    if known.since * law.tick < law.memory or stage.since * law.tick < SURE * law.period:
        return bound
    now = bound if stage.phase == LOCKED else from_slow(law, known)
    p, alone, both = known.fast.solved(), known.fast.std(AXIS_K), known.fast.std(BOTH)
    sure, factor = (law.z, 1.3) if stage.phase == LOCKED else (1.0, 1.0)
    if highest(law, p, -sure * alone, -sure * both) > factor * now:
        return min((1.0 + law.eps) * highest(law, p, law.z * alone, law.z * both), law.cap)
    return now


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
    """What K_u has to be for an estimate with room for K alone, and for K + B/theta [N/m]."""
    return max(law.cap * (p.x + alone), least_for(law, max(law.cap * (p.x + p.y + both), 0.0)))


@law
def least_for(law, whole):
    """K_u at which 1/(1/K_s + 1/K_u) is the least share of that of K + B/theta that there may be [N/m]."""
    return DAMPED * whole / (1.0 + (1.0 - DAMPED) * law.compliance * whole)


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
