"""Recursive least squares as laws and as a part for kernels (thesis, sec. 5.1)."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, outer, sqrt, trace


@law
def rls(theta, P, phi, y, forgetting):  # (5.7)-(5.10), with the matrix inversion lemma for (5.9)
    """One sample: new estimate, new P, innovation scaled to the noise's variance.

    P is lowered by an outer product, which keeps it symmetric to the last bit; the squares of the scaled
    innovations add up to the residual sum of squares of the batch solution.
    """
    Pphi = P @ phi
    e = y - phi @ theta  # (5.10)
    d = 1.0 / (forgetting + phi @ Pphi)
    return theta + Pphi * (d * e), (P - d * outer(Pphi, Pphi)) / forgetting, e * (forgetting * d) ** 0.5


@law
def bounded(forgetting, P, limit):
    """The forgetting factor, or 1 while P has grown beyond the limit.

    Without excitation P grows as 1/forgetting^k; so held, an idle estimator stays finite for ever.
    """
    return forgetting if trace(P) <= limit else 1.0


@part
class LeastSquaresState(NamedTuple):
    theta: Vec3  # estimate
    P: Mat3  # inverse information, of unit noise
    weight: float  # samples seen, the old ones discounted
    squares: float  # of the scaled innovations, discounted alike
    products: float  # of each with the one before
    last: float  # scaled innovation

    @property
    def noise(self):
        """Long-run variance of the noise: its variance, times what its correlation in time costs.

        First-order: (1 + r)/(1 - r) with r the correlation of neighbours, held below 0.99.
        """
        if self.squares <= 0.0:
            return 0.0
        r = max(min(self.products / self.squares, 0.99), 0.0)
        return self.squares / max(self.weight - 3.0, 1.0) * (1.0 + r) / (1.0 - r)

    def std(self):
        """Standard deviation of each parameter."""
        variance = Vec3(self.P.r1.x, self.P.r2.y, self.P.r3.z) * self.noise
        return sqrt(variance)


@part
class LeastSquares(NamedTuple):
    """Recursive least squares on three regressors.

    Args:
        theta: initial estimate.
        P: initial inverse information; its trace bounds P for ever.
        forgetting: in (0, 1]; 1 forgets nothing.
    """

    theta: Vec3
    P: Mat3
    forgetting: float

    def start(self):
        return LeastSquaresState(self.theta, self.P, 0.0, 0.0, 0.0, 0.0)

    def step(self, state, phi, y):
        keep = bounded(self.forgetting, state.P, trace(self.P))
        theta, P, e = rls(state.theta, state.P, phi, y, keep)
        return theta, LeastSquaresState(
            theta,
            P,
            keep * state.weight + 1.0,
            keep * state.squares + e * e,
            keep * state.products + e * state.last,
            e,
        )
