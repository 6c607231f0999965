"""The guard around the force law: readings that are none, when the tip stops or withdraws, a last check of speed."""

from typing import Any, NamedTuple

import numpy as np

from palpate._jit import law, part, reader, writer
from palpate._jit.overloads import leaves, places
from palpate.arrays import Array
from palpate.force.contact_estimate import ContactEstimate
from palpate.force.contact_evidence import FREE_MOTION, MEMORY, Watch, behind
from palpate.force.law import Cautious, CautiousState
from palpate.force.stage import LEARNING, LOCKED, MOST, follows_no_tip
from palpate.force.stiffness_bound import STIFFER

FINE, BLIND, STALE, SATURATED, LIMITED, LATE, UNREACHED, PULLED = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
DRIFTS, UNTARED, BOUNCED, BEYOND, SWINGS = 8.0, 9.0, 10.0, 11.0, 12.0
TROUBLES = {
    FINE: "",
    BLIND: "a reading was no number, or beyond anything that the sensor or the arm can show: the tip was held",
    STALE: "the force reading has not changed for longer than the loop's lag: the tip was held; "
    "the sensor, or what reads it, stands still (a simulated one needs noise; of one that reads in coarse steps, "
    "give the step as `resolution` in [sensor])",
    SATURATED: "the force sensor is at the end of its scale: the tip withdrew",
    LIMITED: "the force is above its limit: the tip withdrew",
    LATE: "ticks were missed: nothing was learned from them",
    UNREACHED: "the force asked for cannot be reached: the command went three times as far as that takes; "
    "a motor is at its limit, or something blocks the tip: it was held",
    PULLED: "the force is negative beyond its noise: its sign is turned, or the sensor was not tared in free motion; "
    "the tip was held",
    DRIFTS: "the sensor drifts in free motion, and its bias is followed: tare it again before the next press",
    UNTARED: "the sensor shows a force that does not follow the tip, beyond a tenth of the force asked for: the tip "
    "was held; tare the sensor in free motion",
    BOUNCED: "contact was lost three times before the force was held: the surface is far stiffer than the gains' cap, "
    "or heavy; the tip was stopped: tune for a stiffer surface",
    BEYOND: "the surface is stiffer than the gains' cap, and no proof covers it: tune for a stiffer surface",
    SWINGS: "the surface swings off the tip before the force is held: it is heavy, and no proof covers it; the tip "
    "goes on at its approach until the force follows it",
}
FARTHEST = 3.0
"""Of the way to F_d on the surface as it is known, that a command may go without the force coming nearer.
Measured by benchmarks/force/in_vain.py: where nothing is wrong it is a third of that way at most; the proof lets the
stiffness be wrong by a factor of 2, and half of that again is room for friction."""
LEAST = 8.0
"""Standard deviations of the noise: the least force that may be asked for, and the least that counts as a pull."""
NEAR = 0.05
"""Of F_d: an error that counts, and a change of the force that starts the count anew; the band of what is settled."""
SCALES, FAR = 10.0, 1e3
"""Full scales, and metres, above which a reading is none."""
SEEN = 8.0
"""Standard deviations of a mean over the free motion behind from which a drift is said: early on they are large."""


@part
class SafetyState(NamedTuple):
    """Memory of the guard from tick to tick."""

    silent: float  # ticks without a good reading
    unchanged: float  # ticks since the reading changed
    way: float  # of the command since then [m]
    vain: float  # force that the command should have added since the error last fell [N]
    reached: float  # force from which that counts [N]
    touched: float  # 1 since the force was above the level, until it is within the noise
    losses: float  # times that it came to be within the noise before it was held
    trouble: float  # of the last tick


QUIET = SafetyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, FINE)


@law
def safe_step(law, state, guard, desired, force, position, missed):
    """One tick, with a safe answer to everything that is no reading: speed [m/s], and both states."""
    lag = law.theta / law.tick
    if not (abs(force) <= SCALES * law.full_scale and abs(position) <= FAR):
        silent, unchanged, way, vain, reached, touched, losses, _ = guard
        return 0.0, state, SafetyState(silent + 1.0, unchanged, way, vain, reached, touched, losses, BLIND)
    gap = guard.silent > 0.0 or not missed <= 0.0
    if guard.silent > lag or not missed <= lag:  # too long to go on from what was known
        state = restart(law, state)
    elif gap:
        state = after_gap(state)
    unchanged = guard.unchanged + 1.0 if force == state.watch.last and state.ticks > 0.0 else 0.0
    wanted, after = law.step(state, desired, force, position)
    vain, reached = in_vain(law, guard, after, desired, wanted)
    way = guard.way + law.tick * abs(wanted) if unchanged > 0.0 else 0.0
    touched, losses = losses_of(law, guard, after)
    guard = SafetyState(0.0, unchanged, way, vain, reached, touched, losses, LATE if gap else FINE)
    speed, trouble = allowed_speed(law, guard, after, desired, force, wanted)
    if not abs(speed) <= law.speed:  # nothing that is not finite, or too fast, leaves
        return 0.0, restart(law, state), SafetyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, BLIND)
    return speed, after, SafetyState(0.0, unchanged, way, vain, reached, touched, losses, trouble)


@part
class GuardedState(NamedTuple):
    """States of a law and of its guard."""

    law: CautiousState
    guard: SafetyState


@part
class Guarded(NamedTuple):
    """The law with its guard, as a controller of simulated presses.

    Args:
        law: the law's numbers.
    """

    law: Cautious

    def start(self):
        """In free motion, knowing nothing."""
        return GuardedState(self.law.start(), QUIET)

    def step(self, state, desired, force, position):
        """One tick: speed of the commanded position [m/s], from the forces [N] and the measured position [m]."""
        speed, law, guard = safe_step(self.law, state.law, state.guard, desired, force, position, 0.0)
        return speed, GuardedState(law, guard)

    def stiffness_bound(self, state):
        """Upper bound K_u of the stiffness [N/m]."""
        return state.law.bound.used


@law
def allowed_speed(law, guard, after, desired, force, speed):
    """Speed that the readings allow [m/s], and the trouble that limits it."""
    withdrawal, felt = -after.backstop.care * law.approach, after.watch.mean - after.watch.rest
    if abs(force) >= 0.99 * law.full_scale:
        return withdrawal if force > 0.0 else 0.0, SATURATED
    if force > law.force_limit:
        return min(speed, withdrawal), LIMITED
    if felt < -LEAST * max(law.noise, after.watch.variance**0.5):
        return 0.0, PULLED
    if is_stale(law, guard, after):
        return 0.0, STALE
    if guard.vain > FARTHEST * desired:
        return 0.0, UNREACHED
    if after.backstop.bounces >= MOST and after.stage.phase == FREE_MOTION:
        return 0.0, BOUNCED
    if follows_no_tip(law, after) and abs(after.watch.slow) >= law.bias:
        return 0.0, UNTARED
    if after.bound.most > STIFFER * law.cap and guard.trouble == FINE:
        return speed, BEYOND
    if guard.losses >= MOST and after.stage.phase == LEARNING and guard.trouble == FINE:
        return speed, SWINGS
    drifts = MEMORY * abs(after.watch.drift) > SEEN * (after.watch.variance / behind(law, after)) ** 0.5
    return (
        speed,
        DRIFTS if drifts and guard.trouble == FINE and after.stage.phase == FREE_MOTION else guard.trouble,
    )


@law
def losses_of(law, guard, after):
    """Whether the force was above the level, as a surface's is; how often it then fell to the noise before it was held.

    A second of free motion forgets both.
    """
    stage, w = after.stage, after.watch
    if stage.phase == LOCKED or (stage.phase == FREE_MOTION and stage.since * law.tick > MEMORY):
        return 0.0, 0.0
    if guard.touched > 0.0 and stage.firm == 0.0:
        return 0.0, guard.losses + 1.0
    return 1.0 if w.mean - w.rest > law.level else guard.touched, guard.losses


@law
def is_stale(law, guard, after):
    """Whether the sensor stands still: no new reading for a lag, where one was due.

    A sensor that reads in steps is due for one when the command has gone as far as three of them take.
    """
    if guard.unchanged <= max(law.theta, 5.0 * law.period) / law.tick:
        return False
    return guard.way * law.cap * max(after.estimate.value.x, 0.0) >= 3.0 * law.resolution


@law
def in_vain(law, guard, after, desired, speed):
    """Force that the command should have added since the error last fell, and the force from which that counts [N]."""
    stiffness, felt = law.cap * max(after.estimate.value.x, 0.0), after.watch.mean - after.watch.rest
    low = felt < (1.0 - NEAR) * desired and after.stage.phase != FREE_MOTION
    if not low or abs(felt - guard.reached) > NEAR * desired:
        return 0.0, felt
    return guard.vain + law.tick * speed * stiffness / (1.0 + law.compliance * stiffness), guard.reached


@law
def restart(law, state):
    """Free motion, of which only the sensor's noise and bias are known."""
    s, w = law.start(), state.watch
    watch = Watch(
        0.0, 0.0, 0.0, w.rest, w.rest, w.rest, w.drift, w.peak, w.variance, w.slow_variance, 0.0, w.fresh, 0.0,
        law.period / law.tick, w.steepest,
    )  # fmt: skip
    return CautiousState(
        s.ticks, s.desired, watch, s.follow, s.stage, s.estimate, s.starts, s.bound, state.backstop, s.pace,
        s.recall,
    )  # fmt: skip


@law
def after_gap(state):
    """The low-pass has to forget the gap before anything is learned."""
    k = state.estimate
    estimate = ContactEstimate(k.slow, k.fast, 0.0, k.origin, k.shown, k.value, k.std)
    return CautiousState(
        state.ticks, state.desired, state.watch, state.follow, state.stage, estimate, state.starts, state.bound,
        state.backstop, state.pace, state.recall,
    )  # fmt: skip


def flatten(tree: Any) -> Array:
    """Every number of nested tuples, in their order, shape (n,)."""
    return np.array(list(leaves(tree)))


law_in = reader(Cautious)
state_in = reader(CautiousState)
put_state = writer(CautiousState)
guard_in = reader(SafetyState)
put_guard = writer(SafetyState)

_PLACES = places(CautiousState)
STATE = len(_PLACES)
"""Numbers of a state."""
VARIANCE, REST, DRIFT = (_PLACES.index(("watch", name)) for name in ("variance", "rest", "drift"))
PHASE = _PLACES.index(("stage", "phase"))
VALUE, STD = (_PLACES.index(("estimate", name, "x")) for name in ("value", "std"))
BOUND = _PLACES.index(("bound", "used"))
GUARD, TROUBLE = len(places(SafetyState)), STATE + places(SafetyState).index(("trouble",))
"""Numbers of a guard's state behind it, and the place of the trouble."""
