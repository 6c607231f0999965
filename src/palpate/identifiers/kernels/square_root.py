"""Least squares on a square root of the covariance: one sample, a drift, and the bound that keeps it finite.

P = S S^T is never formed, so it can lose neither its symmetry nor its sign, and S has half the digits of P to
carry. All that happens to P is a stretch of S along one direction u: a sample shrinks it (Potter's form of the
update, 1963; Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. II), forgetting and
drift stretch it, the bound shrinks it back.
"""

from palpate._jit import law
from palpate._vector import outer, solve, sqrt

SINGULAR = 1e300
"""Square of a solution of a root beyond which the root has lost a direction to rounding."""


@law
def stretch_of(keep):
    """How much longer a root gets when its information shrinks to `keep` of what it was."""
    return 1.0 / sqrt(keep)


@law
def stretched(S, u, s):
    """S after its direction u is made s times as long: P changes by (s^2 - 1) (S u)(S u)^T / u^T u.

    A direction that rounding has taken from a root, and that no number can hold therefore, stays as it is.
    """
    q = u @ u
    return S + outer(((s - 1.0) / q) * (S @ u), u) if 0.0 < q < SINGULAR else S


@law
def measured(theta, S, phi, y, r):
    """One sample of a force with noise variance r: theta, S, the gain, the innovation and its variance.

    In exact arithmetic the least-squares update of eq. 5.7-5.10. The squares of the innovations, each over its
    variance, add up to the residual sum of squares of the batch solution over r.
    """
    f = S.T @ phi
    a = r + f @ f
    k = S @ f
    gain = (1.0 / a) * k
    e = y - phi @ theta  # (5.10)
    return theta + e * gain, S - outer((1.0 / (a + sqrt(a * r))) * k, f), gain, e, a


@law
def drifted(S, axis, step):
    """S after the parameter along a unit vector went one step of a random walk, of standard deviation `step`."""
    u = solve(S, step * axis)
    return stretched(S, u, sqrt(1.0 + u @ u))


@law
def held(S, axis, floor):
    """S with the variance of the parameter along a unit vector no larger than at the start, 1 / floor.

    As if a sample of that parameter alone had said what is believed already: theta stays, what is wound up goes,
    and what is excited is forgotten on.
    """
    f = S.T @ axis
    excess = (f @ f) * (floor @ axis)
    return stretched(S, f, 1.0 / sqrt(excess)) if excess > 1.0 else S
