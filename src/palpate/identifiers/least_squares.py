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


BLOCK = 100
"""Samples whose scores are summed before they are squared: noise may be correlated over less than this."""
_DOUBT = 2.0
"""Blocks that the cautious first-order correction counts for, beside those that were seen."""


@law
def gathered(scores, spread, phi, e, keep, full):
    """The sum of the scores phi e of a block, and the sum of the finished blocks' squares, discounted as P is."""
    scores, spread = keep * scores + e * phi, keep * keep * spread
    if full:
        return 0.0 * scores, spread + outer(scores, scores)
    return scores, spread


@law
def long_run(P, noise, scores, spread, blocks):
    """Covariance of the estimate under noise of any colour that a `BLOCK` outlasts.

    P S P, where S is the covariance of the sum of all scores, measured by the means of blocks (Newey and West,
    1987, for the form; Alexopoulos and Seila, 1996, for the blocks). A few blocks say little, so it starts from
    noise * P, with the noise's long-run variance of `long_run_variance`, which errs on the wide side.
    """
    measured = P @ (spread + outer(scores, scores)) @ P
    return (_DOUBT * noise * P + blocks * measured) / (_DOUBT + blocks)


@law
def long_run_variance(weight, squares, products, parameters):
    """Variance of the noise times what its correlation in time costs: (1 + r)/(1 - r), r that of neighbours.

    r is held below 0.99. Right for first-order noise under slow regressors, too wide under fast ones.
    """
    if squares <= 0.0:
        return 0.0
    r = max(min(products / squares, 0.99), 0.0)
    return squares / max(weight - parameters, 1.0) * (1.0 + r) / (1.0 - r)


@part
class LeastSquaresState(NamedTuple):
    theta: Vec3  # estimate
    P: Mat3  # inverse information, of unit noise
    weight: float  # samples seen, the old ones discounted
    squares: float  # of the scaled innovations, discounted alike
    products: float  # of each with the one before
    last: float  # scaled innovation
    scores: Vec3  # of the block under way
    spread: Mat3  # of the finished blocks' scores
    blocks: float  # finished, the old ones discounted
    filled: float  # samples in the block under way

    def std(self):
        """Standard deviation of each parameter."""
        noise = long_run_variance(self.weight, self.squares, self.products, 3.0)
        C = long_run(self.P, noise, self.scores, self.spread, self.blocks)
        return sqrt(Vec3(C.r1.x, C.r2.y, C.r3.z))


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
        none = 0.0 * self.theta
        return LeastSquaresState(self.theta, self.P, 0.0, 0.0, 0.0, 0.0, none, outer(none, none), 0.0, 0.0)

    def step(self, state, phi, y):
        keep = bounded(self.forgetting, state.P, trace(self.P))
        theta, P, e = rls(state.theta, state.P, phi, y, keep)
        filled = state.filled + 1.0
        full = filled >= BLOCK
        scores, spread = gathered(state.scores, state.spread, phi, e, keep, full)
        blocks = keep * keep * state.blocks
        return theta, LeastSquaresState(
            theta,
            P,
            keep * state.weight + 1.0,
            keep * state.squares + e * e,
            keep * state.products + e * state.last,
            e,
            scores,
            spread,
            blocks + 1.0 if full else blocks,
            0.0 if full else filled,
        )
