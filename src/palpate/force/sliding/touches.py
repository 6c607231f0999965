"""Three light presses about a point: the normal of a surface before a slide, from where they were."""

from palpate._jit import law
from palpate._vector import ZERO3, sqrt
from palpate.force.guard import FINE, UNTARED, state_in
from palpate.force.sliding.slide_state import (
    ALL,
    LAW,
    MOVE,
    NORMAL,
    PHASE,
    POINTS,
    SAFETY,
    SLOPE,
    TOUCHES,
    TROUBLE,
    VELOCITY,
    accelerate,
    beside,
    cross,
    press_again,
    put_vector,
    unit,
    vector_at,
)  # fmt: skip

LIGHT = 0.3
"""Share of F_d with which a normal is touched."""
CLEARANCE = 3e-4
"""Height above the highest place that tilt and curvature make likely, on the way to the next touch [m]."""
ACROSS = 0.75**0.5
"""Height of an equilateral triangle over its side."""
ARRIVED = 0.1
"""Distance from the place above the next touch at which the tip goes down, as a fraction of the spacing."""


@law
def enter_touch(law, s, point, unsure):
    """Enters a touch at a point that is known to `unsure` [m]; three give the normal and its uncertainty."""
    put_vector(s, POINTS + 3 * int(s[TOUCHES]), point)
    s[TOUCHES] += 1.0
    s[PHASE] = MOVE
    if s[TOUCHES] < ALL:
        return
    n, first = vector_at(s, NORMAL), vector_at(s, POINTS)
    across = unit(cross(vector_at(s, POINTS + 3) - first, vector_at(s, POINTS + 6) - first), n)
    put_vector(s, NORMAL, across if across @ n > 0.0 else -across)
    s[SLOPE] = min(slope_of_touches(law.spacing, unsure, law.turning), law.slope)


@law
def slope_of_touches(spacing, unsure, turning):
    """Standard deviation of the normal of three touches, each way [rad].

    The sum of x^2 over the corners of a triangle is 1.5 r^2, and the curvature changes as a random walk.
    """
    r = spacing / sqrt(3.0)
    return sqrt(unsure * unsure / (1.5 * r * r) + turning * r * r * r / 3.0)


@law
def corner(law, s):
    """Place of the next touch, as high as the touches so far predict [m]: of a triangle, and at last its centre."""
    first, second = vector_at(s, POINTS), vector_at(s, POINTS + 3)
    e1 = beside(law.into)
    if s[TOUCHES] == 1.0:
        return first + law.spacing * e1
    if s[TOUCHES] == 2.0:
        return 0.5 * (first + second) + ACROSS * law.spacing * cross(law.into, e1)
    return (first + second + vector_at(s, POINTS + 6)) / ALL


@law
def safe_height(curvature, slope, distance):
    """Height above a predicted point that the surface exceeds once in 700, this far beside what is known [m]."""
    return CLEARANCE + distance * (min(3.0 * slope, 1.0) + 0.5 * curvature * distance)


@law
def clearance_at(law, s):
    """Height above the next place from which the tip goes down [m]."""
    if s[TOUCHES] == ALL:
        return safe_height(law.curvature, s[SLOPE], law.spacing / sqrt(3.0))
    return safe_height(law.curvature, law.slope, law.spacing if s[TOUCHES] == 1.0 else ACROSS * law.spacing)


@law
def next_touch(law, s, force, position):
    """A tick on the way to the next touch, up and aside at once: the velocity [m/s].

    The tip goes aside no further than its height is safe. Only the way down is as slow as an approach.
    """
    c, n = law.press, vector_at(s, NORMAL)
    last, goal, height = (
        vector_at(s, POINTS + 3 * int(s[TOUCHES] - 1.0)),
        corner(law, s),
        clearance_at(law, s),
    )
    to_rise = (position - goal) @ n + height
    felt = force @ n - state_in(s[LAW:SAFETY]).watch.rest
    if to_rise < -2.0 * height - law.spacing and felt > c.level:
        s[TROUBLE] = UNTARED
        put_vector(s, VELOCITY, ZERO3)
        return ZERO3
    s[TROUBLE] = FINE
    aside = goal - position
    aside = aside - (aside @ n) * n
    left = max(sqrt(aside @ aside), 1e-9)
    if left < ARRIVED * law.spacing and to_rise < 0.0:
        press_again(law, s, n, FINE)
        return ZERO3
    passed = position - last
    passed = passed - (passed @ n) * n
    safe = safe_height(law.curvature, law.slope, sqrt(passed @ passed))
    v = vector_at(s, VELOCITY)
    in_contact = felt > c.level
    wanted = -brake(law, CLEARANCE + (max(to_rise, 0.0) if in_contact else to_rise), -v @ n) * n
    if not in_contact and (to_rise < 0.0 or (last - position) @ n > safe):
        wanted = wanted + brake(law, left, v @ aside / left) / left * aside
    v = accelerate(law, v, wanted)
    if in_contact:
        v = -max(-v @ n, c.approach) * n
    put_vector(s, VELOCITY, v)
    return v


@law
def brake(law, way, speed):
    """Speed at which the tip stops within a way, at half the acceleration; it still goes on by the lags' way [m/s]."""
    way = way - law.lead * speed
    return min(0.5 * way / law.lead, sqrt(law.acceleration * way), law.crossing) if way > 0.0 else 0.0
