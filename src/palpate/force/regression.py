"""Least squares of the force on what the sensor saw of the position: stiffness and damping with their uncertainty."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, outer, solve, sqrt

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
