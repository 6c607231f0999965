"""The cautious law: presses with the gain that an upper bound of the stiffness allows, and learns that bound.

    v = g (F_d - F_m) + dF_d/dt / K_u,        x_cmd += T v
    g = alpha / (theta (1 - rho (K_u + K_s/2)/(K_u + K_s)) K_eff(K_u))
    K_u = max of (1 + eps) K^ + z sd and 0.52 ((1 + eps)(K^ + B^/theta) + z sd)

Damping is lead, so that a bound of the stiffness alone is enough until B/K is above 0.9 theta. In free motion K_u is
the stiffest surface that there may be, so that approach and touch follow from the same law. It is written once, in
operators: compiled in `ForceLoop`, in the simulator and on the bench, plain in a debugger.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, sqrt
from palpate.force.contact_estimate import NOTHING, ContactEstimate, Fit, first_estimate, next_estimate
from palpate.force.contact_evidence import (
    FREE_MOTION,
    NO_STARTS,
    Starts,
    Steepest,
    Watch,
    behind,
    next_starts,
    next_watch,
    tare,
    white,
)
from palpate.force.outlier import REFUTED, Knowledge, Recall, next_recall
from palpate.force.stage import MOST, STEP, Backstop, Stage, is_false_touch, next_backstop, next_stage
from palpate.force.stiffness_bound import EARNED, Bound, Sure, next_bound

SMOOTHING = 0.1
"""Of a servo's lag in free motion, by which its lead is smoothed: the usual filter of a PID controller's derivative,
N = 10 (Astrom and Haegglund, *PID Controllers*)."""


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
        lead: lag D/K_s of a servo that yields, in free motion [s]; 0 for other arms.
        inertia: 4 m K_s/D^2 of the same, above 1 where its tip swings; 0 for other arms.
        cap: largest K + B/theta that there may be, as the measured position feels it [N/m].
        floor: lowest K_u that is used [N/m].
        speed: the arm's limit [m/s].
        approach: speed in free motion [m/s].
        level: force above the bias that is a surface's if it follows the tip [N]; twice what the sensor may show.
        bias: largest force at rest that is taken out of the readings [N].
        drift: slowest rise that counts as a surface's [N/s].
        noise: standard deviation of a reading, until free motion has told better [N].
        least: least variance of a reading that is believed [N^2].
        resolution: step in which the sensor reads; 0 for none [N].
        memory: time in which the sensor's low-pass forgets [s].
        blind: time after a touch for which nothing is learned: the low-pass', and half of a swing of the tip [s].
        period: between two readings [s].
        E, e0, e1: the sensor's low-pass on the position, from tick to tick: z' = E z + e0 x + e1 x'.
        c: its output is c z + d x.
        d: see c.
        z: standard deviations between estimate and bound.
        eps: relative room of the bound.
        full_scale: of the sensor [N].
        force_limit: above which the tip withdraws [N].
    """

    tick: float
    theta: float
    alpha: float
    compliance: float
    relief: float
    lead: float
    inertia: float
    cap: float
    floor: float
    speed: float
    approach: float
    level: float
    bias: float
    drift: float
    noise: float
    least: float
    resolution: float
    memory: float
    blind: float
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

    def start(self):
        """Free motion, with no estimate of a surface."""
        fit, variance = Fit(NOTHING, ZERO3), max(self.noise * self.noise, self.least)
        slow_variance, steepest = white(self, variance), Steepest(0.0, 0.0, 0.0, 0.0)
        watch = Watch(
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, variance, slow_variance, 0.0, 0.0, 0.0, 0.0, steepest
        )
        stage, estimate = (
            Stage(FREE_MOTION, 0.0, 0.0, 0.0),
            ContactEstimate(fit, fit, 0.0, 0.0, 0.0, ZERO3, ZERO3),
        )
        bound = Bound(self.cap, self.cap, self.cap, 0.0, 0.0, Sure(0.0, 0.0, 0.0, self.approach, 0.0, 0.0))
        backstop = Backstop(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        recall = Recall(0.0, Knowledge(watch, stage, estimate, bound, backstop))
        follow = Follow(ZERO3, 0.0, 0.0, 0.0, 0.0)
        return CautiousState(
            0.0, 0.0, watch, follow, stage, estimate, NO_STARTS, bound, backstop, self.approach, recall
        )  # fmt: skip

    def step(self, state, desired, force, position):
        """One tick: speed of the commanded position [m/s], from the forces [N] and the measured position [m]."""
        before = state.desired if state.ticks > 0.0 else desired
        follow = next_follow(self, state, position)
        recall = next_recall(self, state, follow, force)
        if recall.readings == REFUTED:
            state = without_outliers(state)
        starts = next_starts(self, state, follow, force)
        watch = next_watch(self, state, starts, force)
        false_touch = is_false_touch(self, state, watch)
        stage = next_stage(self, state, watch, desired, before, false_touch)
        if false_touch:
            watch = tare(self, watch)
        start = first_estimate(
            self, state.estimate, state.stage, stage, watch, follow, starts, behind(self, state)
        )
        estimate = next_estimate(self, start, state, stage, watch, follow, force)
        bound = next_bound(self, state.bound, stage, estimate, watch, follow)
        backstop = next_backstop(self, state.backstop, state.stage, stage, watch, desired, before)
        u = backstop.care * gain(self, bound.used) * (desired - (force - watch.rest))
        forward = 0.0
        if stage.phase != FREE_MOTION and abs(desired - before) <= STEP * abs(desired):
            forward = (desired - before) / self.tick * (self.compliance + 1.0 / bound.used)
        limit = bound.sure.limit
        speed = max(min(u + forward, limit), -limit)
        if stage.phase == FREE_MOTION:
            speed = backstop.care * self.approach if backstop.bounces < MOST else 0.0
        most = self.speed if limit > EARNED * self.approach else limit
        speed, pace = lead_speed(self, state.pace, speed, bound.used, most)
        return speed, CautiousState(
            state.ticks + 1.0, desired, watch, follow, stage, estimate, starts, bound, backstop, pace, recall
        )  # fmt: skip

    def stiffness_bound(self, state):
        """Upper bound K_u of the stiffness [N/m]."""
        return state.bound.used


@part
class Follow(NamedTuple):
    """The position through the sensor's low-pass."""

    z: Vec3
    x: float  # of the tick before, from the origin
    y: float  # as the sensor saw it
    y0: float  # of the tick before
    origin: float


@part
class CautiousState(NamedTuple):
    ticks: float
    desired: float
    watch: Watch
    follow: Follow
    stage: Stage
    estimate: ContactEstimate
    starts: Starts
    bound: Bound
    backstop: Backstop
    pace: float  # smoothed speed, which a servo's command leads [m/s]
    recall: Recall


@law
def without_outliers(state):
    """The state as it would be without the readings that were refuted."""
    watch, stage, estimate, bound, backstop = state.recall.known
    return CautiousState(
        state.ticks, state.desired, watch, state.follow, stage, estimate, state.starts, bound, backstop, state.pace,
        state.recall,
    )  # fmt: skip


@law
def lead_speed(law, pace, speed, bound, limit):
    """Speed of the command, and the smoothed speed, both of which are the law's own speed but for a servo [m/s].

    A tip that a servo pulls against a surface of stiffness K is late by the slowest time constant of
    m s^2 + D s + K_s + K. The command is ahead by that. What the limit takes off is taken off the smoothed speed, so
    that it stays the speed that the tip can have. The speed that a test has borne out is the tip's: the command is
    then ahead of it by up to the arm's own limit. Before, a tip that gathers speed slowly touches gently where a sensor
    lied: measured by benchmarks/force/free_motion.py.
    """
    if law.lead == 0.0:
        return speed, speed
    total = 1.0 + law.compliance * bound
    lead = 0.5 * law.lead / total * (1.0 + sqrt(max(1.0 - law.inertia * total, 0.0)))
    ahead = (lead + SMOOTHING * law.lead) / law.tick
    after = pace + (speed - pace) / (1.0 + SMOOTHING * law.lead / law.tick)
    sent = max(min(after + ahead * (after - pace), limit), -limit)
    return sent, (sent + ahead * pace) / (1.0 + ahead)


@law
def gain(law, bound):
    """Gain g from force error to speed [m/(s N)]."""
    felt = law.compliance * bound
    lag = law.theta * (1.0 - law.relief * (felt + 0.5) / (felt + 1.0))
    return law.alpha / lag * (law.compliance + 1.0 / bound)


@law
def next_follow(law, state, position):
    """This tick's position as the sensor saw it."""
    f = state.follow
    if state.ticks < 1.0:
        return Follow(ZERO3, 0.0, 0.0, 0.0, position)
    x = position - f.origin
    z = law.E @ f.z + f.x * law.e0 + x * law.e1
    return Follow(z, x, law.c @ z + law.d * x, f.y, f.origin)
