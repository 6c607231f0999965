"""Estimate of the surface: least squares since the touch, and over the last theta alone."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, sqrt
from palpate.force.contact_evidence import EDGE, FREE_MOTION, LEVEL, spread_of
from palpate.force.onset import explained_variance, latest
from palpate.force.regression import AXIS_B, AXIS_K, BOTH, UNKNOWN, Fit, fit_of, fit_through, without_offset
from palpate.force.stage import LEARNING, LOCKED


@part
class ContactEstimate(NamedTuple):
    """Estimate of the surface."""

    slow: Fit  # since the touch
    fast: Fit  # over theta
    since: float  # ticks since the contact began
    origin: float  # of the position in both fits [m]
    shown: float  # 1 where lines through the readings showed the surface
    value: Vec3  # K, B/theta in caps, offset [N]
    std: Vec3  # of K, B/theta and their sum, in caps


@law
def first_estimate(law, estimate, before, stage, w, f, starts, behind):
    """Estimate at the beginning of a phase: none in free motion, that of the line at a touch, a quarter after a step.

    A stiff contact begins where the force last was within the noise: there it is at rest, but for the noise and for
    what comes between two readings.
    """
    sigma = sqrt(w.variance)
    slow, fast, since, origin, shown, value, std = estimate
    if stage.phase == FREE_MOTION:
        since, origin, shown, value, std = 0.0, f.y, 0.0, ZERO3, ZERO3
    if stage.firm == 0.0:
        x = law.cap * (f.y - 0.004 / law.tick * (f.y - f.y0) - origin)
        fast = fit_through(x, w.rest + 0.5 * sigma, sigma)
    if before.phase == FREE_MOTION and stage.phase == LEARNING:
        if w.mean - w.rest > LEVEL * sigma and stage.firm * law.tick < law.blind:
            readings = stage.firm * law.tick / law.period + 1.0
            back = (stage.firm + 0.004 / law.tick) * (f.y - f.y0)
            level = w.mean - w.rest
            fast = fit_through(
                law.cap * (f.y - back - origin), w.rest + 0.5 * sigma, sigma + level / readings
            )
            slow, since, value, std = fast, stage.firm, ZERO3, ZERO3
        else:
            line = latest(starts, behind, explained_variance(starts, behind) - spread_of(law, w))
            pace = 2.0 * law.cap * law.theta * line.u / (line.n * line.n * law.period)
            slow = fit_of(line, law.cap, origin, pace, w.rest, spread_of(law, w))
            since, shown, value = line.n * law.period / law.tick, 1.0, slow.solution()
            std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    if before.phase == LOCKED and stage.phase == LEARNING:
        slow = without_offset(slow, 0.25)
    return ContactEstimate(slow, fast, since, origin, shown, value, std)


@law
def next_estimate(law, estimate, state, stage, w, f, force):
    """Estimate after this tick's reading."""
    since = estimate.since + 1.0
    if w.age > 0.0 or since * law.tick < law.blind:
        return ContactEstimate(
            estimate.slow, estimate.fast, since, estimate.origin, estimate.shown, estimate.value, estimate.std
        )
    rate = (f.y - f.y0) / law.tick
    phi = Vec3(law.cap * (0.5 * (f.y + f.y0) - estimate.origin), law.cap * law.theta * rate, 1.0)
    if state.bound.sure.refuted > 0.0:  # it was no surface: what it seemed to tell is forgotten
        nothing = fit_through(law.cap * (f.y - estimate.origin), w.mean, UNKNOWN)
        return ContactEstimate(nothing, nothing, law.blind / law.tick, estimate.origin, 0.0, ZERO3, ZERO3)
    if (
        state.bound.used >= law.cap
        and estimate.std.z > 0.0
        and force - estimate.value @ phi > EDGE * max(sqrt(w.variance), 2.0 * sqrt(w.slow_variance))
    ):
        here = fit_through(phi.x, force, sqrt(w.variance))  # refuted: it begins here
        return ContactEstimate(here, estimate.fast, stage.firm, estimate.origin, 0.0, ZERO3, ZERO3)
    moving = min(max(estimate.value.x, 0.0), 1.0) * law.cap * rate * law.tick
    noise = 2.0 * law.theta * w.slow_variance / (w.gap * law.tick)
    weight = 1.0 / (noise + moving * moving / 12.0)
    fast = estimate.fast
    if stage.firm * law.tick >= law.blind:
        fast = fast.with_reading(phi, force, weight, 1.0 - law.tick / law.theta)
    if stage.phase == LOCKED:
        return ContactEstimate(
            estimate.slow, fast, since, estimate.origin, estimate.shown, estimate.value, estimate.std
        )
    keep = 1.0 if state.bound.used >= law.cap else 1.0 - law.tick / (6.0 * law.theta)
    slow = estimate.slow.with_reading(phi, force, weight, keep)
    std = Vec3(slow.std(AXIS_K), slow.std(AXIS_B), slow.std(BOTH))
    return ContactEstimate(slow, fast, since, estimate.origin, estimate.shown, slow.solution(), std)
