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
    beside,
    cross,
    press_again,
    put_vector,
    unit,
    vector_at,
)  # fmt: skip

NEAR = 2e-4
"""Distance from the place above a touch at which the tip is there [m]."""
CLEARANCE = 1e-3
"""Height above the highest place that the tilt makes likely, on the way to the next touch [m]."""


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
    """Place of the next touch, but for its height [m]: of a triangle, and at last its centre."""
    first, second = vector_at(s, POINTS), vector_at(s, POINTS + 3)
    e1 = beside(law.into)
    if s[TOUCHES] == 1.0:
        return first + law.spacing * e1
    if s[TOUCHES] == 2.0:
        return first + law.spacing * (0.5 * e1 + 0.8660254037844386 * cross(law.into, e1))
    return (first + second + vector_at(s, POINTS + 6)) / ALL


@law
def next_touch(law, s, force, position):
    """A tick on the way to the next touch: up, and aside at that height; the velocity [m/s]."""
    c, into = law.press, law.into
    highest = min((vector_at(s, POINTS) @ into), vector_at(s, POINTS + 3 * int(s[TOUCHES] - 1.0)) @ into)
    lifted = highest - position @ into
    needed = CLEARANCE + law.spacing * min(3.0 * law.slope, 1.0)
    felt = force @ into - state_in(s[LAW:SAFETY]).watch.rest
    if lifted > 3.0 * needed and felt > c.level:
        s[TROUBLE] = UNTARED
        return ZERO3
    s[TROUBLE] = FINE
    if felt > c.level or lifted < needed:
        return -c.approach * into
    n, way = vector_at(s, NORMAL), corner(law, s) - position
    way = way - (way @ n) * n
    left = sqrt(way @ way)
    if left < NEAR:
        press_again(law, s, n, FINE)
        return ZERO3
    return (min(c.approach, left / (3.0 * c.theta)) / left) * way
