"""The law of a slide: presses with the cautious law, then holds the force along a surface while the tip moves.

    velocity = g(K_u) (F_d - F_m) n + v,    F_m = max(f.n, |f|/sqrt(1 + mu_max^2)),    v perpendicular to n + H v L

n and H are those of the tangent filter (`tangent_filter.py`), L the sum of the lags, g the cautious gain with the K_u
of the press. K_u does not change in a slide: motion along a wrong normal looks like stiffness. F_m is at most the
normal force of any normal that friction up to mu_max admits, so that no wrong normal presses harder than
F_d sqrt(1 + mu_max^2).

A jump of the force and a refuted normal halt the slide: the tip stops at once, nothing is estimated, and the force
alone is controlled along n. Once it is held for the loop's lag, the filter begins again at an uncertain normal.

The command of a servo that yields leads its tip, along n as in a press, along the surface as in free motion.
"""

from palpate._jit import law
from palpate._vector import ZERO3, Vec3, sqrt
from palpate.force.guard import (
    BLIND,
    FAR,
    FINE,
    LATE,
    LEAST,
    LIMITED,
    SATURATED,
    SCALES,
    STALE,
    guard_in,
    put_guard,
    put_state,
    safe_step,
    state_in,
)
from palpate.force.law import gain, lead_speed
from palpate.force.sliding.slide_state import (
    ALL,
    ALONG,
    AWAY,
    BOUND,
    DIRECTION,
    EDGE,
    FELT,
    FRAMES,
    HALT,
    JERKS,
    LAW,
    LOSS,
    LOST,
    MOVE,
    NORMAL,
    PACE,
    PHASE,
    PRESS,
    PRESSING,
    READ_AT,
    REFUTED,
    ROUGH,
    SAFETY,
    SEEN,
    SILENT,
    SLIDE,
    SLOPE,
    SLOW,
    STEPPED,
    TICKS,
    TOUCHES,
    TROUBLE,
    UNCHANGED,
    VELOCITY,
    accelerate,
    beside,
    cross,
    followed_tip,
    halt,
    halt_along,
    into_cone,
    press_again,
    put_vector,
    unit,
    vector_at,
    within,
)  # fmt: skip
from palpate.force.sliding.tangent_filter import (
    C11,
    C12,
    C22,
    F1,
    F2,
    FORCE,
    G1,
    G2,
    MU,
    STIFF,
    Observation,
    begin,
    confine,
    correct,
    predict,
    slope_variance,
    stiffness_of,
    turn,
    variance,
)  # fmt: skip
from palpate.force.sliding.touches import LIGHT, enter_touch, next_touch
from palpate.force.stage import LOCKED

CONE = 0.07
"""Angle by which a force may leave the friction cone [rad]: 4 degrees."""
BAND = 0.1
"""Share of F_d within which the force counts as held."""
GATE = 6.0
"""Deviations of the normal force that are a step's."""
AFTER = 0.5, 0.1
"""Standard deviations of the normal after a step, each way [rad], and of mu: an edge of 45 degrees is within two."""
AT_REST = 1.5
"""Friction at rest over that of a slide, at most."""
JERKY = 6.0
"""Mean squared deviation of the force's angle that is said as stick-slip."""
WORTH = 0.06
"""Share of F_d that the slope's uncertainty may cost: the speed is limited so that it costs no more."""
EXCESS = 0.3
"""Share of F_d by which an edge of 45 degrees may raise the force within the loop's lag, where steps are expected."""
CROOKED = 0.4
"""Cosine between force and direction below which a press is in other axes: friction of 0.9 and a tilt of 20 degrees
have 0.48."""
HALF = 0.5
"""Share of the speed after a step, and where the force is off."""
RECOVERY = 0.5
"""Time in which the speed is as asked again after a step [s]."""
LIKELY = 0.35, 0.3
"""Friction of dry contacts: mean and standard deviation before any was felt."""


# More than seven arguments: the readings of a tick, and the state with its room.
@law
def slide_step(law, s, work, desired, force, position, direction, missed):
    """One tick: velocity of the commanded position [m/s]; the flat state `s` changes in place.

    Args:
        law: the numbers.
        s: state, shape (SIZE,).
        work: room, shape (10,).
        desired: F_d [N].
        force: on the surface [N].
        position: of the tip by the arm's encoders [m].
        direction: wanted, a unit vector or shorter for a slower slide; its part along the normal counts for nothing.
        missed: ticks that were lost since the last call.
    """
    c = law.press
    lag = c.theta / c.tick
    if not (within(force, SCALES * c.full_scale) and within(position, FAR)):
        s[SILENT] += 1.0
        s[TROUBLE] = BLIND
        put_vector(s, VELOCITY, ZERO3)
        return ZERO3
    if (s[SILENT] > lag or not missed <= lag) and s[TICKS] > 0.0:
        press_again(law, s, vector_at(s, NORMAL), LATE)
    before, last = vector_at(s, SEEN), vector_at(s, FELT)
    same = force.x == last.x and force.y == last.y and force.z == last.z and s[TICKS] > 0.0
    s[UNCHANGED] = s[UNCHANGED] + 1.0 if same else 0.0
    seen = followed_tip(c, s, position)
    late = seen - law.late * (seen - before) if s[TICKS] > 0.0 else seen
    gap = s[SILENT] > 0.0 or not missed <= 0.0
    s[SILENT] = 0.0
    s[TICKS] += 1.0
    put_vector(s, SEEN, seen)
    put_vector(s, FELT, force)
    if s[PHASE] == PRESS:
        light = desired if s[TOUCHES] == ALL else max(LIGHT * desired, LEAST * c.noise)
        velocity = press_tick(law, s, late, light, force, position, missed)
    elif s[PHASE] == MOVE:
        put_vector(s, READ_AT, late)
        velocity = next_touch(law, s, force, position) if s[UNCHANGED] * c.tick <= c.theta else ZERO3
    else:
        if s[HALT] == 0.0:
            s[TROUBLE] = LATE if gap else FINE
        if not same:
            learn(law, s, work, late, desired, force)
        velocity = command(law, s, desired, force, direction)
    fast = sqrt(velocity @ velocity)
    if not fast < 1e9:  # nothing that is not finite leaves
        press_again(law, s, law.into, BLIND)
        return ZERO3
    if c.lead > 0.0 and s[PHASE] != PRESS:
        velocity = lead_velocity(c, s, velocity)
        fast = sqrt(velocity @ velocity)
    return velocity * (c.speed / fast) if fast > c.speed else velocity


@law
def lead_velocity(c, s, wanted):
    """Velocity of a servo's command whose tip is to have this one [m/s]; see `law.lead_speed`.

    What presses works against the surface's spring, what follows the surface does not, however that bends.
    """
    n, pace, v = vector_at(s, NORMAL), vector_at(s, PACE), wanted
    if s[PHASE] == SLIDE:
        v = vector_at(s, VELOCITY)
    press, s[PRESSING] = lead_speed(c, s[PRESSING], (wanted - v) @ n, s[BOUND], c.speed)
    x, pace_x = lead_speed(c, pace.x, v.x, 0.0, c.speed)
    y, pace_y = lead_speed(c, pace.y, v.y, 0.0, c.speed)
    z, pace_z = lead_speed(c, pace.z, v.z, 0.0, c.speed)
    put_vector(s, PACE, Vec3(pace_x, pace_y, pace_z))
    return press * n + Vec3(x, y, z)


@law
def press_tick(law, s, late, desired, force, position, missed):
    """A tick of the cautious law along the direction into the surface; the slide begins when the force is held."""
    c, n = law.press, vector_at(s, NORMAL)
    speed, press, guard = safe_step(
        c, state_in(s[LAW:SAFETY]), guard_in(s[SAFETY:]), desired, force @ n, position @ n, missed
    )
    put_state(s[LAW:SAFETY], press)
    put_guard(s[SAFETY:], guard)
    if not (s[TROUBLE] == LOST and guard.trouble == FINE):
        s[TROUBLE] = guard.trouble
    put_vector(s, READ_AT, late)
    size = sqrt(force @ force)
    if size > 0.5 * desired and force @ n < CROOKED * size:
        s[TROUBLE] = FRAMES
        return ZERO3
    stiffness, sd = stiffness_in(c, press)
    over = press.watch.mean - press.watch.rest - desired
    # a touch is where its force is F_d: that place is known once K adds less to its error than the noise does
    known = s[TOUCHES] < ALL and press.bound.sure.stiffness > 0.0 and abs(over) * sd < c.noise * stiffness
    if (known or press.stage.phase == LOCKED) and size > 0.5 * desired and guard.trouble == FINE:
        if s[TOUCHES] < ALL:
            put_vector(s, PACE, ZERO3)
            enter_touch(law, s, late - over / (stiffness + 2.0 * sd) * n, c.noise / stiffness)
            return ZERO3
        tilt = 2.0 * s[SLOPE] * s[SLOPE] * (1.0 + c.compliance * stiffness)
        relative = min(sqrt((sd / stiffness) ** 2 + tilt * tilt), 0.5)
        s[PHASE], s[BOUND] = SLIDE, press.bound.used
        s[PRESSING] = press.pace
        put_vector(s, PACE, ZERO3)
        start = n if law.spacing > 0.0 else unit(force, n)
        slide_from(law, s, start, size, stiffness, relative, s[SLOPE], LIKELY[0], LIKELY[1])
    return speed * n


@law
def stiffness_in(c, press):
    """Stiffness that a press found, and its standard deviation [N/m]; that of an even share of K_u if it found none."""
    if press.estimate.std.x > 0.0:
        return max(c.cap * press.estimate.value.x, c.floor), c.cap * press.estimate.std.x
    return 0.5 * press.bound.used, 0.29 * press.bound.used


# More than seven arguments: each is a number of the prior.
@law
def slide_from(law, s, n, size, stiffness, relative, slope, mu, mu_std):
    """The slide at its beginning, with a normal that is known to `slope` [rad] each way."""
    begin(s, size, slope, law.curvature, stiffness, relative, mu, mu_std, law.press.noise)
    s[SLOW], s[ROUGH], s[HALT], s[LOSS] = 1.0, 1.0, 0.0, 0.0
    put_vector(s, NORMAL, n)
    put_vector(s, EDGE, beside(n))
    put_vector(s, VELOCITY, ZERO3)


@law
def friction_bound(law, s):
    """Largest friction that the estimate of it admits, at rest too."""
    return min(AT_REST * s[MU] + GATE * sqrt(max(variance(s, MU, MU), 0.0)), law.mu_max)


@law
def learn(law, s, work, late, desired, force):
    """The filter after a new reading: prediction, three rows, the turn of the frame, and the guards."""
    c, n, e1 = law.press, vector_at(s, NORMAL), vector_at(s, EDGE)
    e2 = cross(n, e1)
    way = late - vector_at(s, READ_AT)
    put_vector(s, READ_AT, late)
    if s[HALT] > 0.0:
        return
    d1, d2, dz = way @ e1, way @ e2, way @ n
    predict(s, d1, d2, dz, law.ratio, law.turning, law.encoder + law.doubt * abs(dz) / c.period)
    f, f1, f2 = force @ n, force @ e1, force @ e2
    if f < max(c.level, 0.1 * desired):
        return
    pull = sqrt(f1 * f1 + f2 * f2)
    if pull > f * (friction_bound(law, s) + CONE + GATE * sqrt(slope_variance(s))) + GATE * c.noise:
        halt(s, n, STEPPED)
        return
    noise, N = c.noise * c.noise, s[FORCE]
    # the product of two uncertain states is noise here: before slip no reading shows the normal
    slope = (variance(s, G1, G1) + variance(s, G2, G2)) / (s[STIFF] * s[STIFF])
    friction = variance(s, F1, F1) + variance(s, F2, F2)
    curved = N * N * slope * (friction + slope)
    w1, w2 = -N * s[F1] / s[STIFF], -N * s[F2] / s[STIFF]
    jump = correct(s, Observation(FORCE, 1.0, G1, w1, G2, w2), f - N, noise + curved, GATE, work)
    if abs(jump) > GATE:
        halt(s, n, STEPPED)
        return
    angle, w = noise / (f * f) * max(1.0, s[ROUGH]), 1.0 / s[STIFF]
    one = correct(s, Observation(G1, w, F1, 1.0, F2, 0.0), f1 / f - w * s[G1] - s[F1], angle, 1e9, work)
    two = correct(s, Observation(G2, w, F2, 1.0, F1, 0.0), f2 / f - w * s[G2] - s[F2], angle, 1e9, work)
    both = 0.5 * (one * one + two * two) * max(1.0, s[ROUGH])
    s[ROUGH] += 0.02 * (min(both, 100.0) - s[ROUGH])
    if s[ROUGH] > JERKY and s[TROUBLE] == FINE:
        s[TROUBLE] = JERKS
    confine(s, MU, 0.0, law.mu_max)
    s[FORCE] = max(s[FORCE], 0.0)
    s[STIFF] = max(s[STIFF], 0.05)
    t1, t2 = turn(s)
    n = unit(n + t1 * e1 + t2 * e2, n)
    put_vector(s, NORMAL, n)
    put_vector(s, EDGE, unit(e1 - (e1 @ n) * n, beside(n)))
    s[SLOW] = min(s[SLOW] + c.period / RECOVERY, 1.0)


@law
def command(law, s, desired, force, direction):
    """The velocity in a slide, and the guards of force and contact."""
    c, n = law.press, vector_at(s, NORMAL)
    size, normal = sqrt(force @ force), force @ n
    if not within(force, 0.99 * c.full_scale) or size > c.force_limit:
        s[TROUBLE] = LIMITED if size > c.force_limit else SATURATED
        put_vector(s, VELOCITY, ZERO3)
        return -c.approach * n
    if s[UNCHANGED] > max(c.theta, 5.0 * c.period) / c.tick and c.resolution == 0.0:
        s[TROUBLE] = STALE
        put_vector(s, VELOCITY, ZERO3)
        return ZERO3
    if size > 0.3 * desired and normal < size * cone_of(law):
        n = into_cone(n, force, law.mu_max) if normal > CROOKED * size else unit(force, n)
        halt(s, n, REFUTED)
    s[LOSS] = s[LOSS] + 1.0 if normal < max(c.level, 0.05 * desired) else 0.0
    if s[LOSS] * c.tick > 2.0 * c.theta:
        press_again(law, s, n, LOST)
        return ZERO3
    if s[HALT] > 0.0 and s[TROUBLE] == STEPPED and normal > CROOKED * size > 0.3 * CROOKED * desired:
        n = into_cone(n, force, min(s[MU], law.mu_max))
        halt_along(s, n)
        normal = force @ n
    felt = max(normal, size / sqrt(1.0 + law.mu_max * law.mu_max))
    likely = 2.0 * sqrt(max(variance(s, FORCE, FORCE), 0.0))
    if s[TROUBLE] == FINE and abs(s[FORCE] - desired) + likely > BAND * desired:
        s[TROUBLE], s[SLOW] = AWAY, min(s[SLOW], HALF)
    # friction above mu_max, within the margin of the cone
    if s[TROUBLE] == FINE and felt - normal > GATE * c.noise:
        s[TROUBLE] = AWAY
    press = gain(c, s[BOUND]) * (desired - felt)
    press = min(max(press, -c.speed), c.approach if s[LOSS] > 0.0 else c.speed)
    if s[HALT] > 0.0:
        s[HALT] = s[HALT] + 1.0 if abs(felt - desired) < BAND * desired else 1.0
        if s[HALT] * c.tick > law.lead:
            relative = sqrt(variance(s, STIFF, STIFF)) / s[STIFF]
            stepped = s[TROUBLE] == STEPPED
            mu, mu_std = s[MU] if stepped else law.mu_max, AFTER[1] if stepped else LIKELY[1]
            slide_from(law, s, n, normal, stiffness_of(s), relative, AFTER[0], mu, mu_std)
            s[SLOW] = HALF
        return press * n
    v = along_surface(law, s, desired, direction)
    put_vector(s, VELOCITY, v)
    return press * n + v


@law
def along_surface(law, s, desired, direction):
    """The velocity along the surface [m/s]."""
    c, n, e1, v = law.press, vector_at(s, NORMAL), vector_at(s, EDGE), vector_at(s, VELOCITY)
    e2 = cross(n, e1)
    asked = sqrt(direction @ direction)
    wanted, v1, v2 = ZERO3, v @ e1, v @ e2
    bend = (s[C11] * v1 + s[C12] * v2) * e1 + (s[C12] * v1 + s[C22] * v2) * e2
    ahead = unit(n + (law.lead / s[STIFF]) * bend, n)
    flat = direction - (direction @ ahead) * ahead
    if not asked < 1e6:
        s[TROUBLE] = DIRECTION
    elif asked > 0.0 and sqrt(flat @ flat) < 0.1 * asked:
        s[TROUBLE] = ALONG
    elif asked > 0.0 and s[LOSS] == 0.0:
        stiffness = s[BOUND] / (1.0 + c.compliance * s[BOUND])
        slope = sqrt(max(slope_variance(s), 1e-12))
        sure = WORTH * c.alpha * desired / (stiffness * c.theta * slope)
        if stiffness * law.step > EXCESS * desired:
            sure = min(sure, EXCESS * desired / (stiffness * law.lead))
        wanted = min(law.speed * min(asked, 1.0) * s[SLOW], sure) * unit(flat, e1)
    return accelerate(law, v - (v @ ahead) * ahead, wanted)


@law
def cone_of(law):
    """Cosine of the widest angle between force and normal that friction admits."""
    slip = 1.0 / sqrt(1.0 + law.mu_max * law.mu_max)
    return slip * (1.0 - CONE * CONE / 2.0) - law.mu_max * slip * CONE
