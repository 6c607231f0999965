"""Estimate of the surface: least squares since the touch, and over the last theta alone."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, sqrt
from palpate.force.contact_evidence import AIR, EDGE, LEVEL, spread_of
from palpate.force.onset import explained, latest
from palpate.force.regression import AXIS_B, AXIS_K, BOTH, UNKNOWN, Fit, fit_of, fit_through, without_offset
from palpate.force.stage import LEARNING, LOCKED


@part
class Learned(NamedTuple):
    """Estimate of the surface."""

    slow: Fit  # since the touch
    fast: Fit  # over theta
    since: float  # ticks since the contact began
    origin: float  # of the position in both fits [m]
    shown: float  # 1 where lines through the readings showed the surface
    found: Vec3  # K, B/theta in caps, offset [N]
    std: Vec3  # of K, B/theta and their sum, in caps


@law
def begun(law, known, before, stage, w, f, starts, air):
    """Estimate at the begin of this stage: none in free motion, that of the start at a touch, a quarter after a step.

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
        if w.mean - w.rest > LEVEL * sigma and stage.firm * law.tick < law.blind:
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
    """Estimate with this tick's reading."""
    since = known.since + 1.0
    if w.age > 0.0 or since * law.tick < law.blind:
        return Learned(known.slow, known.fast, since, known.origin, known.shown, known.found, known.std)
    rate = (f.y - f.y0) / law.tick
    phi = Vec3(law.cap * (0.5 * (f.y + f.y0) - known.origin), law.cap * law.theta * rate, 1.0)
    if state.bound.sure.refuted > 0.0:  # it was no surface: what it seemed to tell is forgotten
        nothing = fit_through(law.cap * (f.y - known.origin), w.mean, UNKNOWN)
        return Learned(nothing, nothing, law.blind / law.tick, known.origin, 0.0, ZERO3, ZERO3)
    if (
        state.bound.used >= law.cap
        and known.std.z > 0.0
        and force - known.found @ phi > EDGE * max(sqrt(w.variance), 2.0 * sqrt(w.tide))
    ):
        here = fit_through(phi.x, force, sqrt(w.variance))  # refuted: it begins here
        return Learned(here, known.fast, stage.firm, known.origin, 0.0, ZERO3, ZERO3)
    moving = min(max(known.found.x, 0.0), 1.0) * law.cap * rate * law.tick
    noise = 2.0 * law.theta * w.tide / (w.gap * law.tick)
    weight = 1.0 / (noise + moving * moving / 12.0)
    fast = known.fast
    if stage.firm * law.tick >= law.blind:
        fast = fast.taking(phi, force, weight, 1.0 - law.tick / law.theta)
    if stage.phase == LOCKED:
        return Learned(known.slow, fast, since, known.origin, known.shown, known.found, known.std)
    keep = 1.0 if state.bound.used >= law.cap else 1.0 - law.tick / (6.0 * law.theta)
    slow = known.slow.taking(phi, force, weight, keep)
    std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    return Learned(slow, fast, since, known.origin, known.shown, slow.solved(), std)
