"""The sliding law's numbers, and its state as a flat array: places, phases, troubles."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Vec3, sqrt
from palpate.force.guard import FINE, GUARD, QUIET, STATE, TROUBLES, put_guard, put_state
from palpate.force.law import Cautious
from palpate.force.sliding.tangent_filter import FILTER


@law
def unit(a, otherwise):
    """A vector's direction; of one without length another."""
    length = sqrt(a @ a)
    return a / length if length > 1e-12 else otherwise


@law
def cross(a, b):
    """Vector product of two vectors."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@law
def beside(n):
    """A unit vector that is perpendicular to n."""
    other = Vec3(1.0, 0.0, 0.0) if abs(n.x) < 0.7 else Vec3(0.0, 1.0, 0.0)
    return unit(other - (other @ n) * n, other)


PRESS, SLIDE, MOVE = 0.0, 1.0, 2.0
"""Phases: the cautious law alone, the slide, and the way from a touch to the next."""
ALONG, REFUTED, STEPPED, JERKS, LOST, DIRECTION, FRAMES, AWAY = 20.0, 21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0
SLIDING_TROUBLES = TROUBLES | {
    ALONG: "the direction asked for is along the normal: the tip does not slide; ask for one along the surface",
    REFUTED: "the force leaves the friction cone about the estimated normal: the normal was wrong, or friction is "
    "above mu_max; the tip stopped, and the normal is estimated again",
    STEPPED: "the force jumped: a step, an edge or a hole in the surface; the tip stops until the force is held again, "
    "then slides on at half the speed (give the height of steps that are expected as --step)",
    JERKS: "the force turns in jerks, as in stick-slip: friction and normal are less certain than shown",
    AWAY: "the force may be off by more than a tenth: a step or an edge, friction that changes or is above "
    "mu_max, or a normal that is not yet known; slide more slowly",
    LOST: "contact was lost: the tip stopped sliding, and approaches again",
    FRAMES: "the force is not along the direction into the surface: force and position need the same axes, those of "
    "the base; the tip was held",
    DIRECTION: "the direction is no number: the tip does not slide",
}


@part
class Sliding(NamedTuple):
    """The law's numbers.

    Args:
        press: the cautious law of the press, and limits of arm and sensor.
        into: direction into the surface, in which it is looked for (unit vector, base's axes).
        slope: standard deviation of that direction against the surface's normal, each way [rad].
        mu_max: largest friction that there may be.
        ratio: tangential over normal stiffness of the contact.
        turning: noise of the curvature [1/m^3].
        curvature: standard deviation of the curvature before any was seen [1/m].
        speed: of the slide [m/s].
        acceleration: of the tip along the surface [m/s^2].
        lead: sum of the lags from the reading to the tip [s].
        late: age of a reading in ticks, 0 to 1.
        encoder: standard deviation of a measured position [m].
        doubt: standard deviation of the lag [s].
        step: highest step that is expected in the surface [m].
        spacing: between three touches that measure the normal before the slide; 0 for none [m].
        crossing: speed from a touch to the next, at which a surface in the way stays below the force limit [m/s].
    """

    press: Cautious
    into: Vec3
    slope: float
    mu_max: float
    ratio: float
    turning: float
    curvature: float
    speed: float
    acceleration: float
    lead: float
    late: float
    encoder: float
    doubt: float
    step: float
    spacing: float
    crossing: float

    def start(self, s):
        """In free motion, knowing nothing but a direction into the surface: fills a state, shape (SIZE,)."""
        for i in range(len(s)):
            s[i] = 0.0
        s[TOUCHES] = 0.0 if self.spacing > 0.0 else ALL
        s[SLOPE] = self.slope
        press_again(self, s, self.into, FINE)


(PHASE, TROUBLE, SILENT, UNCHANGED, TICKS, BOUND, SLOW, ROUGH, HALT, LOSS, TOUCHES, SLOPE) = (
    FILTER + i for i in range(12)
)
"""Places behind the filter: phase, trouble, ticks without a good reading and since one changed, ticks of all, K_u,
share of the speed after a step, mean squared deviation of the force's angle, ticks since the force is held again
after a step (at least 1 in a halt), ticks without contact, touches made, and standard deviation of the normal of the
press, each way [rad]."""
(NORMAL, EDGE, VELOCITY, READ_AT, SEEN, FELT, POSITION, ORIGIN, POINTS) = (
    FILTER + 12 + 3 * i for i in range(9)
)
"""Vectors: normal, e1, velocity along the surface [m/s], position at the last reading and in the last tick as the
sensor saw it [m], last force [N], last position and its origin [m], and three touched points [m]."""
AXIS = POINTS + 9
"""The sensor's low-pass of three axes."""
ALL = 3.0
"""Touches that make a normal."""
PACE, PRESSING = AXIS + 9, AXIS + 12
"""Smoothed velocity along the surface, and speed along the normal, which a servo's command leads [m/s]."""
LAW = PRESSING + 1
SAFETY = LAW + STATE
SIZE = SAFETY + GUARD
"""Places of the cautious law's state and of its guard's; numbers of a state."""


@law
def vector_at(s, at):
    """Three numbers of a state as a vector."""
    return Vec3(s[at], s[at + 1], s[at + 2])


@law
def put_vector(s, at, v):
    """Puts a vector into a state."""
    s[at], s[at + 1], s[at + 2] = v.x, v.y, v.z


@law
def within(v, most):
    """Whether each component is a number and at most so large."""
    return abs(v.x) <= most and abs(v.y) <= most and abs(v.z) <= most


@law
def accelerate(law, v, wanted):
    """The velocity after a tick towards a wanted one, within the acceleration of the tip [m/s]."""
    change = wanted - v
    size, most = sqrt(change @ change), law.acceleration * law.press.tick
    return v + min(most / size, 1.0) * change if size > 0.0 else v


@law
def press_again(law, s, n, trouble):
    """In free motion, with a direction into the surface."""
    s[PHASE], s[TROUBLE], s[SILENT], s[LOSS] = PRESS, trouble, 0.0, 0.0
    put_vector(s, NORMAL, n)
    put_vector(s, EDGE, beside(n))
    put_vector(s, VELOCITY, ZERO3)
    put_state(s[LAW:SAFETY], law.press.start())
    put_guard(s[SAFETY:], QUIET)


@law
def halt(s, n, trouble):
    """Stops the tip, with a normal along which the force is controlled until the slide goes on."""
    s[HALT], s[TROUBLE] = 1.0, trouble
    halt_along(s, n)


@law
def halt_along(s, n):
    """The tip stands along the surface, with a normal along which the force is controlled."""
    put_vector(s, NORMAL, n)
    put_vector(s, EDGE, beside(n))
    put_vector(s, VELOCITY, ZERO3)


@law
def followed_tip(c, s, position):
    """The position as the sensor's low-pass saw it [m]; the state goes on by a tick."""
    if s[TICKS] == 0.0:
        put_vector(s, ORIGIN, position)
        put_vector(s, POSITION, ZERO3)
        return position
    origin, q = vector_at(s, ORIGIN), vector_at(s, POSITION)
    p = position - origin
    put_vector(s, POSITION, p)
    x = axis(c, s, AXIS, q.x, p.x)
    y = axis(c, s, AXIS + 3, q.y, p.y)
    z = axis(c, s, AXIS + 6, q.z, p.z)
    return Vec3(x, y, z) + origin


@law
def axis(c, s, at, before, now):
    """One axis through the sensor's low-pass."""
    z = c.E @ vector_at(s, at) + before * c.e0 + now * c.e1
    put_vector(s, at, z)
    return c.c @ z + c.d * now


@law
def into_cone(n, force, friction):
    """The normal next to n from which the force is off by the angle of friction at most."""
    normal = force @ n
    pull = force - normal * n
    ratio = sqrt(pull @ pull) / normal
    if ratio <= friction:
        return n
    return unit(n + (ratio - friction) / (1.0 + ratio * friction) / (ratio * normal) * pull, n)
