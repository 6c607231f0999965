"""The cautious law: presses with the gain that an upper bound of the stiffness allows, and learns that bound.

    v = LP_tau(g (F_d - F_m)) + dF_d/dt / K_u,        x_cmd += T v
    g = alpha (1 + tau/theta) / (theta K_eff(K_u))
    K_u = (1 + eps)(K^ + B^/theta) + z sd

In the air K_u is the stiffest surface that there may be, so that approach and touch follow from the same law. It is
written once, in operators: compiled in `ForceLoop`, in the simulator and on the bench, plain in a debugger.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, sqrt
from palpate.force.regression import AXIS_B, AXIS_K, BOTH, NOTHING, Fit, fit_from, without_offset

AIR, LEARNING, LOCKED = 0.0, 1.0, 2.0
"""Phases."""
PLAIN = 3.0
"""Standard deviations above which a stiffness, or a damping, is a surface and not noise in the air."""
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
        fit = Fit(NOTHING, ZERO3)
        return CautiousState(
            0.0,
            0.0,
            0.0,
            Watch(0.0, 0.0, 0.0, self.noise * self.noise, 0.0),
            Follow(ZERO3, 0.0, 0.0, 0.0, 0.0),
            Stage(AIR, 0.0, 0.0),
            Learned(fit, fit, -1.0, 0.0, ZERO3, ZERO3),
            Bound(self.cap, 0.0),
            Backstop(1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        )

    def step(self, state, desired, force, position):
        """One tick: speed of the commanded position [m/s], from the forces [N] and the measured position [m]."""
        before = state.desired if state.ticks > 0.0 else desired
        watch = watched(self, state, force)
        follow = followed(self, state, position)
        stage = staged(self, state.stage, watch, desired, before, force)
        known = begun(self, state.known, stage, watch, follow)
        known = taken(self, known, stage, watch, follow, force)
        bound = bounded(self, state.bound, stage, watch, known)
        backstop = guarded(self, state.backstop, stage, watch, desired, before)
        u = backstop.care * gain(self, bound) * (desired - force)
        smooth = state.smooth + self.tick / (bound.tau + self.tick) * (u - state.smooth)
        forward = 0.0
        if stage.phase != AIR and abs(desired - before) <= STEP * abs(desired):
            forward = (desired - before) / self.tick * (self.compliance + 1.0 / bound.stiffness)
        touching = watch.mean > 0.3 * desired or bound.stiffness < 0.5 * self.cap
        limit = self.speed if stage.phase != AIR and touching else self.approach
        speed = max(min(smooth + forward, limit), -self.speed)
        return speed, CautiousState(
            state.ticks + 1.0, desired, smooth, watch, follow, stage, known, bound, backstop
        )

    def told(self, state):
        """K_u [N/m]."""
        return state.bound.stiffness


@part
class Watch(NamedTuple):
    """The force's readings and their noise."""

    last: float
    mean: float  # over 4 ms [N]
    slow: float  # over theta [N]
    variance: float  # of a reading [N^2]
    age: float  # ticks since the last fresh reading; 0 if this one is


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


@part
class Learned(NamedTuple):
    """What is known of the surface."""

    slow: Fit  # since the touch
    fast: Fit  # over theta
    since: float  # ticks since it began
    origin: float  # of the position in both fits [m]
    found: Vec3  # K, B/theta in caps, offset [N]
    std: Vec3  # of K, B/theta and their sum, in caps


@part
class Bound(NamedTuple):
    """What the gain follows from."""

    stiffness: float  # K_u [N/m]
    tau: float  # [s]


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
    smooth: float  # the command before its limits [m/s]
    watch: Watch
    follow: Follow
    stage: Stage
    known: Learned
    bound: Bound
    backstop: Backstop


@law
def gain(law, bound):
    """g [m/(s N)]."""
    return law.alpha * (1.0 + bound.tau / law.theta) / law.theta * (law.compliance + 1.0 / bound.stiffness)


@law
def watched(law, state, force):
    """This tick's reading."""
    w = state.watch
    if state.ticks < 1.0:
        return Watch(force, force, force, w.variance, 0.0)
    fresh = force != w.last or w.age * law.tick > 1.5 * law.period
    mean = w.mean + law.tick / (0.004 + law.tick) * (force - w.mean)
    slow = w.slow + law.tick / (law.theta + law.tick) * (force - w.slow)
    variance = w.variance
    if fresh and state.stage.phase == AIR and mean < 3.0 * sqrt(variance):
        step = force - w.last
        variance += law.period / 0.3 * (min(0.5 * step * step, 9.0 * variance) - variance)
    return Watch(force, mean, slow, variance, 0.0 if fresh else w.age + 1.0)


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
    sigma, since = sqrt(w.variance), stage.since + 1.0
    if stage.phase == AIR:
        few = 5.0 * sqrt(0.5 * law.period / law.theta)
        touched = (force > 4.0 * sigma and w.mean > 3.2 * sigma) or w.slow > max(few, 0.5) * sigma
        return Stage(LEARNING, 0.0, 0.0) if touched else Stage(AIR, since, 0.0)
    if w.mean < 0.5 * sigma and w.slow < sigma and since * law.tick > law.theta:
        return Stage(AIR, 0.0, 0.0)
    if stage.phase == LOCKED and abs(desired - before) > 0.2 * abs(before):
        return Stage(LEARNING, 0.0, 0.0)
    quiet = stage.quiet + 1.0 if abs(desired - w.mean) < 0.07 * abs(desired) else 0.0
    if stage.phase == LEARNING and quiet * law.tick > 3.0 * law.theta and law.locking > 0.0:
        return Stage(LOCKED, 0.0, 0.0)
    return Stage(stage.phase, since, quiet)


@law
def begun(law, known, stage, w, f):
    """What is known as this stage begins: after a touch nothing, after a step a quarter of what was known."""
    if stage.phase != LEARNING or stage.since > 0.0:
        return known
    if known.since < 0.0:
        level = max(w.mean, sqrt(w.variance))
        fit = fit_from(0.5 * level, 0.5 * level + sqrt(w.variance))
        return Learned(fit, fit, 0.0, f.y, ZERO3, ZERO3)
    return Learned(
        without_offset(known.slow, 0.25), known.fast, known.since, known.origin, known.found, known.std
    )


@law
def taken(law, known, stage, w, f, force):
    """What is known with this tick's reading."""
    if stage.phase == AIR:
        return Learned(known.slow, known.fast, -1.0, 0.0, ZERO3, ZERO3)
    since = known.since + 1.0
    if w.age > 0.0 or since * law.tick < law.memory:
        return Learned(known.slow, known.fast, since, known.origin, known.found, known.std)
    rate = (f.y - f.y0) / law.tick
    phi = Vec3(law.cap * (0.5 * (f.y + f.y0) - known.origin), law.cap * law.theta * rate, 1.0)
    moving = min(max(known.found.x, 0.0), 1.0) * law.cap * rate * law.tick
    weight = 1.0 / (w.variance + moving * moving / 12.0)
    fast = known.fast.taking(phi, force, weight, 1.0 - law.tick / law.theta)
    if stage.phase == LOCKED:
        return Learned(known.slow, fast, since, known.origin, known.found, known.std)
    slow = known.slow.taking(phi, force, weight, 1.0 - law.tick / (6.0 * law.theta))
    std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    return Learned(slow, fast, since, known.origin, slow.solved(), std)


@law
def bounded(law, bound, stage, w, known):
    """K_u and tau at this tick."""
    if stage.phase == AIR:
        return Bound(law.cap, 0.0)
    if known.since * law.tick < law.memory:
        return bound
    now = bound if stage.phase == LOCKED else from_slow(law, w, known)
    p, sd = known.fast.solved(), known.fast.std(BOTH)
    total = p.x + p.y
    if law.cap * (total - law.z * sd) > 1.3 * now.stiffness:
        return Bound(min(law.cap * ((1.0 + law.eps) * total + law.z * sd), law.cap), 0.0)
    return now


@law
def from_slow(law, w, known):
    """K_u as all since the touch allows: never below the bound, and the cap unless a surface is plain to see."""
    p, sd = known.found, known.std
    total, room = p.x + p.y, law.z * law.bounding
    plain = total > PLAIN * sd.z or p.x > PLAIN * sd.x
    if law.bounding > 0.0 and not (plain and w.slow > 0.5 * sqrt(w.variance)):
        return Bound(law.cap, 0.0)
    most = (1.0 + law.eps) * total + room * sd.z
    if p.y < 0.0:
        alone, error = known.slow.undamped()
        most = max(most, (1.0 + law.eps) * alone + room * error)
    least = (p.y - room * sd.y) / (p.x + room * sd.x) if p.x > 0.0 else 0.0
    return Bound(min(max(law.cap * most, law.floor), law.cap), min(max(least, 0.0), 1.0) * law.theta)


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
