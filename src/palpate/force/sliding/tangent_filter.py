"""Extended Kalman filter of a contact that slides: normal force, slope, curvature, stiffness and friction.

In the frame (e1, e2, n) of the estimated normal n, which points into the surface, the state is

    N normal force [N], g (2) true normal less n, H (3) curvature [1/m], ln K, mu, phi (2) tangential over normal force

A motion (d, dz) of the tip, d along the surface and dz into it, predicts

    N += K (dz + g.d + d'H d/2)     g += H d     phi += (mu d/|d| - phi)(1 - exp(-|d| K r/(mu N)))

the last being Dahl's friction with tangential stiffness r K. A reading f is three scalar rows: f.n = N - N phi.g, and
f_t/f.n = g + phi. The frame turns by g after each, so that g is zero again.
"""

from palpate._jit import law
from palpate._vector import Vec3, exp, sqrt

FORCE, G1, G2, H11, H12, H22, LOG_K, MU, F1, F2 = range(10)
STATES = 10
COVARIANCE = STATES
"""Place of the covariance, row by row, behind the state."""
BASE = STATES + STATES * STATES
"""Place of K at the beginning [N/m], in units of which the state has ln K."""
FILTER = BASE + 1
"""Numbers of the filter."""
HUBER = 3.0
"""Deviations from which an innovation counts no more than linearly."""
WANDER = 0.05
"""Standard deviation of phi about Dahl's law after one length of its relaxation, in units of mu."""
STICKS = 0.15
"""The same in units of what phi lacks of mu: what Dahl's law leaves of a contact that sticks."""
CHANGES = 0.1, 0.3
"""Standard deviations of ln K and of mu along a metre of path, per square root of it."""


@law
def add_row(s, to, source, factor):
    """Adds a factor times one row of the covariance to another, and the same of the columns."""
    for j in range(STATES):
        s[COVARIANCE + STATES * to + j] += factor * s[COVARIANCE + STATES * source + j]
    for j in range(STATES):
        s[COVARIANCE + STATES * j + to] += factor * s[COVARIANCE + STATES * j + source]


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
    """K [N/m]."""
    return s[BASE] * exp(s[LOG_K])


@law
def predict(s, d1, d2, dz, ratio, turning, noise):
    """The state after a motion of the tip; `turning` is the noise of curvature [1/m^3], `noise` that of dz [m]."""
    way = sqrt(d1 * d1 + d2 * d2)
    stiffness = stiffness_of(s)
    rise = dz + s[G1] * d1 + s[G2] * d2
    bend = 0.5 * (s[H11] * d1 * d1 + 2.0 * s[H12] * d1 * d2 + s[H22] * d2 * d2)
    # e^x acts on the covariance as a product of shears, each of one row and its column
    add_row(s, FORCE, LOG_K, stiffness * (rise + bend))
    add_row(s, FORCE, G1, stiffness * d1)
    add_row(s, FORCE, G2, stiffness * d2)
    add_row(s, FORCE, H11, 0.5 * stiffness * d1 * d1)
    add_row(s, FORCE, H12, stiffness * d1 * d2)
    add_row(s, FORCE, H22, 0.5 * stiffness * d2 * d2)
    add_row(s, G1, H11, d1)
    add_row(s, G1, H12, d2)
    add_row(s, G2, H12, d1)
    add_row(s, G2, H22, d2)
    s[FORCE] += stiffness * (rise + bend)
    s[G1] += s[H11] * d1 + s[H12] * d2
    s[G2] += s[H12] * d1 + s[H22] * d2
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
    for i in range(H11, H22 + 1):
        spread(s, i, turning * way * (0.5 if i == H12 else 1.0))
    spread(s, LOG_K, CHANGES[0] ** 2 * way)
    spread(s, MU, CHANGES[1] ** 2 * way)


# More than seven arguments: a row of three entries needs no array.
@law
def correct(s, one, weight1, two, weight2, three, weight3, innovation, noise, gate, work):
    """A reading that is w1 x1 + w2 x2 + w3 x3 and a noise of this variance; `work` has room for STATES numbers.

    Returns the innovation in its standard deviations; beyond `gate` of them nothing is corrected.
    """
    for i in range(STATES):
        at = COVARIANCE + STATES * i
        work[i] = weight1 * s[at + one] + weight2 * s[at + two] + weight3 * s[at + three]
    total = weight1 * work[one] + weight2 * work[two] + weight3 * work[three] + noise
    if not total > 0.0:
        return 0.0
    deviations = innovation / sqrt(total)
    if abs(deviations) > gate:
        return deviations
    if abs(deviations) > HUBER:
        total *= abs(deviations) / HUBER
    for i in range(STATES):
        s[i] += work[i] / total * innovation
    for i in range(STATES):
        for j in range(STATES):
            s[COVARIANCE + STATES * i + j] -= work[i] * work[j] / total
    return deviations


# More than seven arguments: each is a number of the prior.
@law
def begin(s, force, slope, curvature, stiffness, relative, mu, mu_std, noise):
    """The filter at a normal that is known to a standard deviation `slope` [rad] in each direction.

    `stiffness` is known to `relative` of itself, `curvature` is the standard deviation of one that is zero [1/m].
    """
    for i in range(FILTER):
        s[i] = 0.0
    s[FORCE], s[BASE], s[MU] = force, stiffness, mu
    spread(s, FORCE, noise * noise)
    spread(s, G1, slope * slope)
    spread(s, G2, slope * slope)
    for i in range(H11, H22 + 1):
        spread(s, i, curvature * curvature * (0.25 if i == H12 else 1.0))
    spread(s, LOG_K, relative * relative)
    spread(s, MU, mu_std * mu_std)
    spread(s, F1, mu * mu + mu_std * mu_std)
    spread(s, F2, mu * mu + mu_std * mu_std)


@law
def unit(a, otherwise):
    """A vector's direction; of one without length another."""
    length = sqrt(a @ a)
    return a / length if length > 1e-12 else otherwise


@law
def cross(a, b):
    """The vector product."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@law
def beside(n):
    """A unit vector that is perpendicular to n."""
    other = Vec3(1.0, 0.0, 0.0) if abs(n.x) < 0.7 else Vec3(0.0, 1.0, 0.0)
    return unit(other - (other @ n) * n, other)
