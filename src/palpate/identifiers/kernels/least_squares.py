"""Recursive least squares as laws and as a part for kernels (thesis, sec. 5.1)."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, outer, sqrt, trace
from palpate.identifiers.kernels.dimension import Three
from palpate.identifiers.kernels.error_covariance import ErrorCovariance, unsure
from palpate.identifiers.kernels.square_root import measured, stretch_of
from palpate.identifiers.kernels.state_layout import bounded

_SIZE = Three()
_ONES = Vec3(1.0, 1.0, 1.0)


@law
def rls(theta, P, phi, y, forgetting):  # (5.7)-(5.10), with the matrix inversion lemma for (5.9)
    """One sample on the covariance itself, as the thesis has it: new estimate, new P, innovation scaled to the noise.

    A yardstick, not what the estimators run on: P is lowered by an outer product, which keeps it symmetric to the
    last bit, but a vague start costs it twice the digits that it costs a root.
    """
    Pphi = P @ phi
    e = y - phi @ theta  # (5.10)
    d = 1.0 / (forgetting + phi @ Pphi)
    return theta + Pphi * (d * e), (P - d * outer(Pphi, Pphi)) / forgetting, e * (forgetting * d) ** 0.5


@law
def learned(theta, S, doubt, phi, y, keep, size):
    """One sample on a root S that has forgotten already, leaving `keep` of what older samples weigh.

    theta, S, doubt, and the innovation scaled to the noise with the variance that it had before.
    """
    theta, S, gain, e, a = measured(theta, S, phi, y, 1.0)
    e = e / sqrt(a)
    return theta, S, doubt.after(phi, gain, e, keep, keep, size), e, a


@law
def root3(P):
    """The lower triangular S with S S^T = P (Cholesky)."""
    a = sqrt(P.r1.x)
    b, d = P.r2.x / a, P.r3.x / a
    c = sqrt(P.r2.y - b * b)
    e = (P.r3.y - d * b) / c
    return Mat3(Vec3(a, 0.0, 0.0), Vec3(b, c, 0.0), Vec3(d, e, sqrt(P.r3.z - d * d - e * e)))


@part
class LeastSquaresState(NamedTuple):
    theta: Vec3  # estimate
    root: Mat3  # of the inverse information, of unit noise
    doubt: ErrorCovariance

    @property
    def weight(self):
        """How many samples were seen, the old ones discounted."""
        return self.doubt.weight

    def std(self):
        """Standard deviation of each parameter."""
        C = self.doubt.covariance(3.0)
        return sqrt(Vec3(C.r1.x, C.r2.y, C.r3.z))


@part
class LeastSquares(NamedTuple):
    """Recursive least squares on three regressors.

    Args:
        theta: initial estimate.
        P: initial covariance; it bounds P for ever.
        forgetting: in (0, 1]; 1 forgets nothing.
    """

    theta: Vec3
    P: Mat3
    forgetting: float

    def start(self):
        root = root3(self.P)
        return LeastSquaresState(self.theta, root, unsure(self.theta, root, _SIZE.identity()))

    def step(self, state, phi, y):
        variances, total = Vec3(self.P.r1.x, self.P.r2.y, self.P.r3.z), trace(self.P)
        floor, even = _ONES / variances, _ONES / Vec3(total, total, total)
        S = stretch_of(self.forgetting) * bounded(state.root, floor, even, _SIZE)
        theta, S, doubt, _, _ = learned(state.theta, S, state.doubt, phi, y, self.forgetting, _SIZE)
        return theta, LeastSquaresState(theta, S, doubt)
