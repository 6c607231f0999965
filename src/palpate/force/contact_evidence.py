"""The force's readings, their noise as the air tells it, and the evidence that there is contact."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt
from palpate.force.onset import NO_STARTS, explained, later

AIR = 0.0
"""The phase before a touch."""
CONTACT = 7.0
"""Evidence of a contact, a cumulative sum, that a touch begins with, and with none of which it ends."""
EVIDENT = 32.0
"""Evidence of a line through the readings, in variances of a reading, from which there is contact.

Measured by benchmarks/force/false_alarms.py: white noise comes to it in one of some six thousand approaches of ten
seconds, to 28 five times as often; a ramp comes to it 5 % later.
"""
EDGE, LEVEL = 4.0, 3.2
"""Standard deviations above which a reading, and with it the mean over 4 ms, are a contact; from the same."""
LOUDER = 4.0
"""Times the variance told that the air may tell: `EDGE` is then at most the 8 deviations that F_d has to have, so that
a slow rise is found before F_d even if it passed for noise."""
MEMORY = 1.0
"""Of the force at rest in the air [s]."""


@part
class Watch(NamedTuple):
    """The force's readings and their noise."""

    last: float
    mean: float  # over 4 ms [N]
    slow: float  # over theta [N]
    rest: float  # of readings in the air [N]
    variance: float  # of a reading [N^2]
    tide: float  # of the mean over theta [N^2]
    evidence: float  # of a contact
    age: float  # ticks since the last fresh reading; 0 if this one is
    gap: float  # ticks between the last two


@law
def is_fresh(law, w, force):
    """Whether this is another reading than the tick before's."""
    return force != w.last or w.age * law.tick > 1.5 * law.period


@law
def listened(law, state, f, force):
    """In the air, lines through the readings from several starts back; in contact, as they were at the touch."""
    if state.stage.phase != AIR or state.ticks < 1.0 or not is_fresh(law, state.watch, force):
        return state.starts
    starts = NO_STARTS if state.stage.since == 0.0 else state.starts
    return later(starts, readings_of(law), f.y, force - state.watch.rest)


@law
def readings_of(law):
    """Readings until the sensor's low-pass has forgotten, the space between two starts."""
    return law.memory // law.period + 1.0


@law
def behind(law, state):
    """Readings behind the mean in the air."""
    return min(state.ticks * law.tick, MEMORY) / law.period + 1.0


@law
def watched(law, state, starts, force):
    """This tick's reading, and what noise there is: in the air the force is at rest but for that."""
    w = state.watch
    if state.ticks < 1.0:
        return Watch(force, force, 0.0, 0.0, w.variance, w.tide, 0.0, 0.0, law.period / law.tick)
    fresh = is_fresh(law, w, force)
    mean = w.mean + law.tick / (0.004 + law.tick) * (force - w.mean)
    slow = w.slow + law.tick / (law.theta + law.tick) * (force - w.slow)
    evidence = evident(law, state, starts, mean, slow, force)
    age, gap = (0.0, w.age + 1.0) if fresh else (w.age + 1.0, w.gap)
    if state.stage.phase != AIR:
        return Watch(force, mean, slow, w.rest, w.variance, w.tide, evidence, age, gap)
    if explained(starts, behind(law, state)) > 0.5 * EVIDENT * spread_of(law, w):  # a ramp is no noise
        return Watch(force, mean, slow, w.rest, w.variance, w.tide, evidence, age, gap)
    rest = w.rest
    if evidence < 0.3 * CONTACT:
        rest += law.tick / (min(state.ticks * law.tick, MEMORY) + law.period) * (force - rest)
        rest = max(min(rest, law.noise), -law.noise)
    off, drift = force - rest, slow - rest
    span = min(state.ticks * law.tick, 3.0)
    variance = w.variance + law.tick / (0.3 + span) * (min(off * off, 9.0 * w.variance) - w.variance)
    variance = min(variance, LOUDER * law.noise * law.noise)
    tide = w.tide + law.tick / (1.0 + span) * (min(drift * drift, 9.0 * w.tide) - w.tide)
    return Watch(force, mean, slow, rest, variance, tide, evidence, age, gap)


@law
def evident(law, state, starts, mean, slow, force):
    """All of it as soon as a reading and its mean, or a line, stand out; else a cumulative sum (Page).

    It grows while the force is above the noise of its mean over theta, and falls below.
    In contact what it has to be above is also a third of what it was: a loss shows within half of theta.
    """
    w, unit = state.watch, sqrt(2.0 * state.watch.tide)
    sigma, above = sqrt(w.variance), force - w.rest
    if state.stage.phase == AIR and above > EDGE * sigma and mean - w.rest > LEVEL * sigma:
        return CONTACT
    asked = state.stage.phase == AIR and starts.readings > 2.0 * readings_of(law)
    if asked and explained(starts, behind(law, state)) > EVIDENT * spread_of(law, w):
        return CONTACT
    least = unit if state.stage.phase == AIR else max(unit, 0.3 * slow)
    step = max(min((above - least) / unit, 3.0 * sigma / unit), -2.0 * CONTACT)
    most = (
        0.9 * CONTACT if state.stage.phase == AIR else CONTACT
    )  # alone it makes no contact: it knows no surface
    return max(min(w.evidence + law.tick / law.theta * step, most), 0.0)


@law
def spread_of(law, w):
    """Variance of a reading, or what white noise would have for the same tide if that is more [N^2]."""
    return max(w.variance, 2.0 * law.theta / law.period * w.tide)
