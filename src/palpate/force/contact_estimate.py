"""Estimate of the surface: least squares since the touch, and over the last theta alone."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, outer, solve, sqrt
from palpate.force.contact_evidence import EDGE, FREE_MOTION, LEVEL, explained_variance, latest, spread_of
from palpate.force.stage import LEARNING, LOCKED

NOTHING = Mat3(ZERO3, ZERO3, ZERO3)
AXIS_K, AXIS_B, BOTH, AXIS_C = (
    Vec3(1.0, 0.0, 0.0),
    Vec3(0.0, 1.0, 0.0),
    Vec3(1.0, 1.0, 0.0),
    Vec3(0.0, 0.0, 1.0),
)
PRIOR = Mat3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 0.01))
"""Information that never fades: stiffness and damping deviate from 0 by about the cap, the offset by about 10 N.
It keeps the equations solvable where the tip moves evenly, so that damping and offset are one."""
UNKNOWN = 1e3


@part
class Fit(NamedTuple):
    """Information matrix and vector of (K, B/theta) in caps and the offset [N]: N p = r."""

    N: Mat3
    r: Vec3

    def with_reading(self, phi, force, weight, keep):
        """With one more sample of that weight [1/N^2], the old ones faded by `keep`."""
        N = keep * self.N + (1.0 - keep) * PRIOR + weight * outer(phi, phi)
        return Fit(N, keep * self.r + (weight * force) * phi)

    def solution(self):
        """K, B/theta and the offset."""
        return solve(self.N, self.r)

    def std(self, direction):
        """Standard deviation of a combination of the three."""
        variance = direction @ solve(self.N, direction)
        return sqrt(variance) if variance > 0.0 else UNKNOWN  # also where rounding left no variance


@law
def fit_of(line, unit, origin, pace, rest, variance):
    """Prior from a line through even motion, see `Line`: its step is damping, or a late start, or both.

    Args:
        line: sums over the readings.
        unit: of stiffness, the cap [N/m].
        origin: of the fit's position [m].
        pace: theta dx/dt in the unit [N].
        rest: force at rest [N].
        variance: of a reading [N^2].
    """
    _, level, _ = line.solution()
    d, w = line.x - origin, 1.0 / variance
    n, f = line.n, line.f + line.n * rest
    x = unit * (line.u + n * d)
    xx = unit * unit * (line.uu + 2.0 * d * line.u + n * d * d)
    xf = unit * (line.uf + d * line.f) + x * rest
    N = Mat3(Vec3(xx, pace * x, x), Vec3(pace * x, n * pace * pace, n * pace), Vec3(x, n * pace, n))
    late = fit_through(unit * d, rest + 0.5 * level, 0.5 * level + sqrt(variance / n))
    return Fit(w * N + late.N, w * Vec3(xf, pace * f, f) + late.r)


@law
def fit_through(x, force, std):
    """Prior from one force at x, in units of the cap, of this value +- std [N]."""
    phi, w = Vec3(x, 0.0, 1.0), 1.0 / (std * std)
    return Fit(PRIOR + w * outer(phi, phi), (w * force) * phi)


@law
def without_offset(fit, share):
    """A share of what is known of K and B; nothing of the offset."""
    N, c = fit.N, fit.N.r3.z
    across = Vec3(N.r1.z, N.r2.z, 0.0)
    slopes = Mat3(Vec3(N.r1.x, N.r1.y, 0.0), Vec3(N.r2.x, N.r2.y, 0.0), ZERO3) - outer(across, across) / c
    r = Vec3(fit.r.x, fit.r.y, 0.0) - (fit.r.z / c) * across
    return Fit(share * slopes + PRIOR, share * r)


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
def regressor(law, estimate, f, rate):
    """Factors of K, B/theta (in caps) and the offset [N] in the force, at this position and rate [m/s]."""
    return Vec3(law.cap * (0.5 * (f.y + f.y0) - estimate.origin), law.cap * law.theta * rate, 1.0)


@law
def reading_variance(law, estimate, w, rate):
    """Variance of a reading about the surface's force: its noise, of any colour, and the motion within a tick [N^2]."""
    moving = min(max(estimate.value.x, 0.0), 1.0) * law.cap * rate * law.tick
    noise = 2.0 * law.theta * w.slow_variance / (w.gap * law.tick)
    return noise + moving * moving / 12.0


@law
def next_estimate(law, estimate, state, stage, w, f, force):
    """Estimate after this tick's reading."""
    since = estimate.since + 1.0
    if w.age > 0.0 or since * law.tick < law.blind:
        return ContactEstimate(
            estimate.slow, estimate.fast, since, estimate.origin, estimate.shown, estimate.value, estimate.std
        )
    rate = (f.y - f.y0) / law.tick
    phi = regressor(law, estimate, f, rate)
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
    weight = 1.0 / reading_variance(law, estimate, w, rate)
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
