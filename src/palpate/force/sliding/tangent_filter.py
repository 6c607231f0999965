"""The tangent filter: normal, curvature, stiffness and friction of a surface under a tip, from motions and forces.

In the frame (e1, e2, n) of the estimated normal n, which points into the surface, a Kalman filter estimates

    N normal force [N], K stiffness [N/m], K g (2) with the true normal less n, K H (3) with the curvature [1/m],
    mu, phi (2) tangential over normal force

A motion (d, dz) of the tip, d along the surface and dz into it, predicts

    N += K dz + (K g).d + d'(K H)d/2     K g += (K H) d     phi += (mu d/|d| - phi)(1 - exp(-|d| K r/(mu N)))

the last being Dahl's friction with tangential stiffness r K. The first two are linear in these states. They are not in
(K, g, H): where the force is held, dz = -g.d, and an extended filter takes the motion along a slope that is not yet
known for one that stiffness does not answer. K itself keeps the press' value (Schmidt's considered state). A reading
f is three scalar rows: f.n = N - N phi.g, and f_t/f.n = g + phi. The frame turns by g after each, so that g is zero
again.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._jit.elementary import exp
from palpate._vector import sqrt

FORCE, G1, G2, C11, C12, C22, STIFF, MU, F1, F2 = range(10)
"""Places of the state; K, K g and K H in units of K at the beginning."""
STATES = 10
COVARIANCE = STATES
"""Place of the covariance, row by row, behind the state."""
BASE = STATES + STATES * STATES
"""Place of K at the beginning [N/m]."""
FILTER = BASE + 1
"""Numbers of the filter."""
HUBER = 3.0
"""Deviations from which an innovation counts no more than linearly."""
WANDER = 0.05
"""Standard deviation of phi about Dahl's law after one length of its relaxation, in units of mu."""
STICKS = 0.86
"""The same in units of what phi lacks of mu, which is as uncertain as the friction of dry contacts."""
CHANGES = 0.1, 0.3
"""Relative standard deviation of K, and that of mu, after a metre of path; they grow as its square root."""


@law
def add_row(s, to, source, factor):
    """Adds a factor times one row of the covariance to another, and the same of the columns."""
    for j in range(STATES):
        s[COVARIANCE + STATES * to + j] += factor * s[COVARIANCE + STATES * source + j]
    for j in range(STATES):
        s[COVARIANCE + STATES * j + to] += factor * s[COVARIANCE + STATES * j + source]


@law
def shear(s, to, source, factor):
    """Adds a factor times one state to another, in state and covariance."""
    s[to] += factor * s[source]
    add_row(s, to, source, factor)


@law
def scale_row(s, to, factor):
    """Multiplies a row and a column of the covariance."""
    for j in range(STATES):
        s[COVARIANCE + STATES * to + j] *= factor
    for j in range(STATES):
        s[COVARIANCE + STATES * j + to] *= factor


@law
def variance(s, i, j):
    """An entry of the covariance."""
    return s[COVARIANCE + STATES * i + j]


@law
def spread(s, i, more):
    """Adds process noise to a state."""
    s[COVARIANCE + (STATES + 1) * i] += more


@law
def stiffness_of(s):
    """Stiffness K of the surface [N/m]."""
    return s[BASE] * s[STIFF]


@law
def predict(s, d1, d2, dz, ratio, turning, noise):
    """The state after a motion of the tip; `turning` is the noise of curvature [1/m^3], `noise` that of dz [m]."""
    way = sqrt(d1 * d1 + d2 * d2)
    unit_force, stiffness = s[BASE], stiffness_of(s)
    # a linear map: a product of shears, each of one state and of one row and column of the covariance
    shear(s, FORCE, STIFF, unit_force * dz)
    shear(s, FORCE, G1, unit_force * d1)
    shear(s, FORCE, G2, unit_force * d2)
    shear(s, FORCE, C11, 0.5 * unit_force * d1 * d1)
    shear(s, FORCE, C12, unit_force * d1 * d2)
    shear(s, FORCE, C22, 0.5 * unit_force * d2 * d2)
    shear(s, G1, C11, d1)
    shear(s, G1, C12, d2)
    shear(s, G2, C12, d1)
    shear(s, G2, C22, d2)
    spread(s, FORCE, (stiffness * noise) ** 2)
    if way <= 0.0:
        return
    mu = max(s[MU], 0.02)
    lengths = way * ratio * stiffness / (mu * max(s[FORCE], 0.1))
    kept = exp(-lengths)
    for i in range(2):
        along = (d1 if i == 0 else d2) / way
        lacks = s[MU] * along - s[F1 + i]
        scale_row(s, F1 + i, kept)
        add_row(
            s, F1 + i, MU, along * (1.0 - kept) - lacks * kept * lengths / mu
        )  # while it sticks, nothing tells mu
        s[F1 + i] += (1.0 - kept) * lacks
        spread(s, F1 + i, ((WANDER * max(mu, 0.05)) ** 2 + (STICKS * lacks) ** 2) * (1.0 - kept * kept))
    for i in range(C11, C22 + 1):
        spread(s, i, turning * way * s[STIFF] ** 2 * (0.5 if i == C12 else 1.0))
    spread(s, STIFF, (CHANGES[0] * s[STIFF]) ** 2 * way)
    spread(s, MU, CHANGES[1] ** 2 * way)


@part
class Observation(NamedTuple):
    """A reading that is w1 x1 + w2 x2 + w3 x3 of three states."""

    one: int
    w1: float
    two: int
    w2: float
    three: int
    w3: float


@law
def correct(s, row, innovation, noise, gate, work):
    """The state after a reading whose noise has this variance; `work` has room for STATES numbers.

    K is considered, not corrected: its uncertainty counts, but a slide with a held force says next to nothing of it,
    and motion that noise causes would pull it. Returns the innovation in its standard deviations; beyond `gate` of
    them nothing is corrected.
    """
    for i in range(STATES):
        at = COVARIANCE + STATES * i
        work[i] = row.w1 * s[at + row.one] + row.w2 * s[at + row.two] + row.w3 * s[at + row.three]
    total = row.w1 * work[row.one] + row.w2 * work[row.two] + row.w3 * work[row.three] + noise
    if not total > 0.0:
        return 0.0
    deviations = innovation / sqrt(total)
    if abs(deviations) > gate:
        return deviations
    if abs(deviations) > HUBER:
        total *= abs(deviations) / HUBER
    kept = variance(s, STIFF, STIFF)
    for i in range(STATES):
        if i != STIFF:
            s[i] += work[i] / total * innovation
        for j in range(STATES):
            s[COVARIANCE + STATES * i + j] -= work[i] * work[j] / total
    spread(s, STIFF, kept - variance(s, STIFF, STIFF))
    return deviations


@law
def confine(s, i, low, high):
    """Moves a state between two bounds, and the others with it as the covariance has them: K alone stays."""
    change = (min(max(s[i], low), high) - s[i]) / max(variance(s, i, i), 1e-12)
    if change != 0.0:
        for j in range(STATES):
            if j != STIFF:
                s[j] += change * variance(s, j, i)


# More than seven arguments: each is a number of the prior.
@law
def begin(s, force, slope, curvature, stiffness, relative, mu, mu_std, noise):
    """The filter at a normal that is known to a standard deviation `slope` [rad] in each direction.

    `stiffness` is known to `relative` of itself, `curvature` is the standard deviation of one that is zero [1/m].
    """
    for i in range(FILTER):
        s[i] = 0.0
    s[FORCE], s[BASE], s[STIFF], s[MU] = force, stiffness, 1.0, mu
    spread(s, FORCE, noise * noise)
    spread(s, G1, slope * slope)
    spread(s, G2, slope * slope)
    for i in range(C11, C22 + 1):
        spread(s, i, curvature * curvature * (0.25 if i == C12 else 1.0))
    spread(s, STIFF, relative * relative)
    spread(s, MU, mu_std * mu_std)
    spread(s, F1, mu * mu + mu_std * mu_std)
    spread(s, F2, mu * mu + mu_std * mu_std)


@law
def turn(s):
    """The frame's turn to the estimated normal (2) [rad]; in the turned frame the slope is zero."""
    t1, t2 = s[G1] / s[STIFF], s[G2] / s[STIFF]
    shear(s, G1, STIFF, -t1)
    shear(s, G2, STIFF, -t2)
    return t1, t2


@law
def slope_variance(s):
    """Variance of the true normal against the estimated one, in the worse of two directions [rad^2]."""
    return max(variance(s, G1, G1), variance(s, G2, G2), 0.0) / (s[STIFF] * s[STIFF])
