"""The force's readings, their noise in free motion, and the evidence of a contact.

In free motion the tip moves evenly, so that a touch is a step (damping, times the speed) and a ramp (stiffness) from
some place on, and nothing before. For each of six starts, every one about twice as far back as the one before, the
line through the force since then is fitted; the rest of the past counts as free motion. That is the profile likelihood
of the start (generalised likelihood ratio), with starts so dense that at most an eighth of the evidence is lost.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import sqrt


@part
class Line(NamedTuple):
    """Sums over the readings since a start: number, way from there [m], way squared, force [N], their product."""

    x: float
    n: float
    u: float
    uu: float
    f: float
    uf: float

    def with_reading(self, x, force):
        """With one more reading."""
        u = x - self.x
        return Line(self.x, self.n + 1.0, self.u + u, self.uu + u * u, self.f + force, self.uf + u * force)

    def solution(self):
        """Slope [N/m], force at the start [N] and what both explain of the sum of squares [N^2]; neither negative."""
        spread = self.n * self.uu - self.u * self.u
        if not (spread > 1e-9 * self.n * self.uu):  # the tip stands: there is no slope
            level = max(self.f / max(self.n, 1.0), 0.0)
            return 0.0, level, level * self.f
        slope = (self.n * self.uf - self.u * self.f) / spread
        level = (self.f - slope * self.u) / self.n
        if level < 0.0:
            slope, level = max(self.uf / self.uu, 0.0), 0.0
        elif slope < 0.0:
            slope, level = 0.0, max(self.f / self.n, 0.0)
        return slope, level, slope * self.uf + level * self.f

    def shown(self, behind):
        """Explained variance beside a rest that is the mean of so many readings, whose own error explains as much."""
        return self.solution()[2] / (1.0 + self.n / behind)


EMPTY = Line(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@part
class Starts(NamedTuple):
    """Lines from six starts; the newest is not asked until it has become the second."""

    readings: float
    newest: Line
    a: Line
    b: Line
    c: Line
    d: Line
    oldest: Line


NO_STARTS = Starts(0.0, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY)


@law
def later(starts, every, x, force):
    """With one more reading; each `every` readings there is a new start, and every second of them moves one back."""
    n, new, a, b, c, d, old = starts
    if n % every == 0.0:
        if n % (32.0 * every) == 0.0:
            old = d
        if n % (16.0 * every) == 0.0:
            d = c
        if n % (8.0 * every) == 0.0:
            c = b
        if n % (4.0 * every) == 0.0:
            b = a
        if n % (2.0 * every) == 0.0:
            a = new
        new = Line(x, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Starts(
        n + 1.0, new.with_reading(x, force), a.with_reading(x, force), b.with_reading(x, force),
        c.with_reading(x, force), d.with_reading(x, force), old.with_reading(x, force),
    )  # fmt: skip


@law
def explained_variance(starts, behind):
    """Sum of squares that the likeliest line explains [N^2], see `Line.shown`."""
    _, _, a, b, c, d, old = starts
    return max(a.shown(behind), b.shown(behind), c.shown(behind), d.shown(behind), old.shown(behind))


@law
def latest(starts, behind, least):
    """The line of the latest start that explains so much [N^2]; an earlier one includes free motion, and is flat."""
    if starts.a.shown(behind) >= least:
        return starts.a
    if starts.b.shown(behind) >= least:
        return starts.b
    if starts.c.shown(behind) >= least:
        return starts.c
    return starts.d if starts.d.shown(behind) >= least else starts.oldest


FREE_MOTION = 0.0
"""The phase before a touch."""
CONTACT = 7.0
"""Evidence of a contact, a cumulative sum, that a touch begins with, and with none of which it ends."""
EVIDENT = 32.0
"""Evidence of a line through the readings, in variances of a reading, from which there is contact.
Measured by benchmarks/force/false_alarms.py: white noise comes to it in one of some six thousand approaches of ten
seconds, to 28 five times as often; a ramp comes to it 5 % later."""
EDGE, LEVEL = 4.0, 3.2
"""Standard deviations above which a reading, and with it the mean over 4 ms, are a contact; from the same."""
PLAIN = 2.5
"""Standard deviations above which a stiffness, or a damping, is a surface and not noise in free motion.
Measured by benchmarks/force/first_touches.py: with 2 noise passes for a soft surface once in some thousand touches
(22 % over, --arms ur5e --touches 1000 --seed 2), with 1.5 oftener (37 %)."""
FEWEST = 20.0
"""Readings that the noise given counts for: as many as tell a standard deviation to 16 %."""
SLOWER = 8.0
"""Lags of the mean that the mean over theta is compared with: a drift is in both, a hum in one."""
FADING = 10.0
"""Of the largest deviation in free motion [s]."""
MEMORY = 1.0
"""Of the bias in free motion [s]."""


@part
class Steepest(NamedTuple):
    """Largest rise of the force within half of theta, by the means over quarters of it."""

    total: float  # of the readings in the quarter that runs [N]
    last: float  # mean over the quarter before [N]
    former: float  # mean over the one before that [N]
    rise: float  # largest, while the force is not surely that of a surface [N]


@part
class Watch(NamedTuple):
    """The force's readings and their noise."""

    last: float
    former: float  # reading before that one [N]
    mean: float  # over 4 ms [N]
    slow: float  # over theta [N]
    slower: float  # over `SLOWER` theta, in free motion [N]
    rest: float  # bias: mean of the readings in free motion [N]
    drift: float  # of the bias [N/s]
    peak: float  # largest deviation of the mean over theta from it in free motion, fading [N]
    variance: float  # of a reading [N^2]
    slow_variance: float  # of the mean over theta [N^2]
    evidence: float  # of a contact
    fresh: float  # readings so far
    age: float  # ticks since the last fresh reading; 0 if this one is
    gap: float  # ticks between the last two
    steepest: Steepest


@law
def is_fresh(law, w, force):
    """Whether this is another reading than the tick before's."""
    return force != w.last or w.age * law.tick > 1.5 * law.period


@law
def next_starts(law, state, f, force):
    """Lines through the readings from several starts back in free motion; in contact, those of the touch."""
    if state.stage.phase != FREE_MOTION or state.ticks < 1.0 or not is_fresh(law, state.watch, force):
        return state.starts
    starts = NO_STARTS if state.stage.since == 0.0 else state.starts
    return later(starts, readings_of(law), f.y, force - state.watch.rest)


@law
def readings_of(law):
    """Readings until the sensor's low-pass has forgotten, the space between two starts."""
    return law.memory // law.period + 1.0


@law
def behind(law, state):
    """Number of readings behind the mean in free motion."""
    return min(state.ticks * law.tick, MEMORY) / law.period + 1.0


@law
def next_watch(law, state, starts, force):
    """This tick's reading and the noise: in free motion the force differs from its bias by the noise alone."""
    w = state.watch
    if state.ticks < 1.0:
        period = law.period / law.tick
        return Watch(
            force, force, force, w.rest, force, w.rest, w.drift, w.peak, w.variance, w.slow_variance, 0.0,
            w.fresh + 1.0, 0.0, period, Steepest(0.0, force, force, w.steepest.rise),
        )  # fmt: skip
    fresh, steepest = is_fresh(law, w, force), steepest_of(law, state, force)
    mean = w.mean + law.tick / (0.004 + law.tick) * (force - w.mean)
    slow = w.slow + law.tick / (law.theta + law.tick) * (force - w.slow)
    evidence = evidence_of(law, state, starts, mean, slow, force)
    age, gap = (0.0, w.age + 1.0) if fresh else (w.age + 1.0, w.gap)
    former, variance = w.former, w.variance
    many = w.fresh + 1.0 if fresh else w.fresh
    span = min(state.ticks * law.tick, 3.0)
    if fresh:
        if state.bound.sure.stiffness == 0.0:
            # A second difference: neither bias nor drift nor a touch is noise.
            bend = force - 2.0 * w.last + w.former
            variance += (min(bend * bend / 6.0, 9.0 * variance) - variance) / (FEWEST + span / law.period)
        variance = max(variance, law.least)
        former = w.last
    if state.stage.phase != FREE_MOTION:
        slow_variance = max(w.slow_variance, white(law, variance))
        return Watch(
            force, former, mean, slow, w.slower, w.rest, w.drift, w.peak, variance, slow_variance, evidence, many,
            age, gap, steepest,
        )  # fmt: skip
    slower = w.slower + law.tick / (SLOWER * law.theta + law.tick) * (force - w.slower)
    swing = slow - slower
    slow_variance = w.slow_variance + law.tick / (1.0 + span) * (
        min(swing * swing, 9.0 * w.slow_variance) - w.slow_variance
    )
    rest = w.rest
    ramp = explained_variance(starts, behind(law, state)) > 0.5 * EVIDENT * spread_of(law, w)
    if evidence < 0.3 * CONTACT and not ramp and many > FEWEST:
        rest += law.tick / (min(state.ticks * law.tick, MEMORY) + law.period) * (force - rest)
        rest = max(min(rest, law.bias), -law.bias)
    slow_variance = max(slow_variance, white(law, variance))
    drift = w.drift + law.tick / MEMORY * ((rest - w.rest) / law.tick - w.drift)
    peak = min(max((1.0 - law.tick / FADING) * w.peak, abs(slow - rest)), law.bias)
    return Watch(
        force, former, mean, slow, slower, rest, drift, peak, variance, slow_variance, evidence, many, age, gap,
        steepest,
    )  # fmt: skip


@law
def steepest_of(law, state, force):
    """The largest rise within half of theta with this tick's reading; in free motion it fades as fast as the bias.

    A step that begins in one quarter is whole between the quarters beside it, as far as the sensor's low-pass is done
    with it in a quarter.
    """
    s, span = state.watch.steepest, max(0.25 * law.theta // law.tick, 1.0)
    fading = 1.0 - law.tick / MEMORY if state.stage.phase == FREE_MOTION else 1.0
    total, rise = s.total + force, fading * s.rise
    if state.ticks % span != 0.0:
        return Steepest(total, s.last, s.former, rise)
    mean = total / span
    if state.bound.sure.stiffness == 0.0:
        rise = max(rise, mean - s.former)
    return Steepest(0.0, mean, s.last, rise)


@law
def white(law, variance):
    """Variance of the mean over theta if the noise is white [N^2]."""
    return 0.5 * variance * law.period / law.theta


@law
def tare(law, w):
    """The bias after a false touch: the mean over theta, which is within what a sensor may be off."""
    peak = min(max(w.peak, abs(w.slow - w.rest)), law.bias)
    drift = w.drift + (w.slow - w.rest) / MEMORY
    return Watch(
        w.last, w.former, w.mean, w.slow, w.slow, w.slow, drift, peak, w.variance, w.slow_variance, 0.0, w.fresh,
        w.age, w.gap, w.steepest,
    )  # fmt: skip


@law
def evidence_of(law, state, starts, mean, slow, force):
    """Evidence of a contact: `CONTACT` as soon as a reading and its mean, or a line, stand out; else Page's sum.

    The cumulative sum (Page, Biometrika 1954) grows while the force is above the noise of its mean over theta, and
    falls below it. In contact the threshold is also a third of the mean force: a loss shows within half of theta.
    """
    w, unit = state.watch, sqrt(2.0 * state.watch.slow_variance)
    sigma, above = sqrt(w.variance), force - w.rest
    if state.stage.phase == FREE_MOTION and w.fresh < FEWEST and abs(mean) < law.bias:
        return 0.0  # the noise is not known yet
    if state.stage.phase == FREE_MOTION and above > EDGE * sigma and mean - w.rest > LEVEL * sigma:
        return CONTACT
    asked = state.stage.phase == FREE_MOTION and starts.readings > 2.0 * readings_of(law)
    if asked and explained_variance(starts, behind(law, state)) > EVIDENT * spread_of(law, w):
        return CONTACT
    least = unit if state.stage.phase == FREE_MOTION else max(unit, 0.3 * (slow - w.rest))
    step = max(min((above - least) / unit, 3.0 * sigma / unit), -2.0 * CONTACT)
    most = (
        0.9 * CONTACT if state.stage.phase == FREE_MOTION else CONTACT
    )  # alone it makes no contact: it knows no surface
    return max(min(w.evidence + law.tick / law.theta * step, most), 0.0)


@law
def spread_of(law, w):
    """Variance of a reading, or what white noise would have for the same tide if that is more [N^2]."""
    return max(w.variance, 2.0 * law.theta / law.period * w.slow_variance)
