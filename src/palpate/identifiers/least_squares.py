"""Recursive least squares on a square root of the covariance, and how far its estimate may be from the truth.

P = S S^T is never formed, so it can lose neither its symmetry nor its sign, and S has half the digits of P to carry.
All that happens to P is a stretch of S along one direction u: a sample shrinks it (Potter's form of the update, 1963;
Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. II), forgetting stretches it, the bound
shrinks it back.

Each sample changes the error of theta by a known rule, error <- (I - gain phi^T) error + gain noise, and the gain is
all that forgetting has a say in. So the error's covariance is followed beside the estimate: the rest of the initial
uncertainty, and the part that the noise has added, of any colour that a `BLOCK` of samples outlasts.

The state of an estimator of n parameters is one flat array that a kernel changes in place: theta, root, left, passed,
heard, white, added, six statistics, floor, even. See `ErrorCovariance`; floor is the inverse of each initial variance,
even that of their sum, n times.
"""

from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, outer, solve, sqrt, trace
from palpate.arrays import Array
from palpate.identifiers.dimension import Three

SINGULAR = 1e300
"""Square of a solution of a root beyond which the root has lost a direction to rounding."""


@law
def stretch_of(keep):
    """How much longer a root gets when its information shrinks to `keep` of what it was."""
    return 1.0 / sqrt(keep)


@law
def stretch(S, u, s):
    """S after its direction u is made s times as long: P changes by (s^2 - 1) (S u)(S u)^T / u^T u.

    A direction that rounding has taken from a root, and that no number can hold therefore, stays as it is.
    """
    q = u @ u
    return S + outer(((s - 1.0) / q) * (S @ u), u) if 0.0 < q < SINGULAR else S


@law
def measure(theta, S, phi, y, r):
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
def limit_axis(S, axis, floor):
    """S with the variance of the parameter along a unit vector no larger than at the start, 1 / floor.

    As if a sample of that parameter alone had said what is believed already: theta stays, what is wound up goes,
    and what is excited is forgotten on.
    """
    f = S.T @ axis
    excess = (f @ f) * (floor @ axis)
    return stretch(S, f, 1.0 / sqrt(excess)) if excess > 1.0 else S


BLOCK = 100
"""Samples whose noise is summed before it is squared: it may be correlated over less than this."""
_CAUTION = 4.0
"""Blocks that the cautious first-order correction counts for, beside those that were seen."""

NOTHING = 1e-10
"""Of the initial root: what noise has left before there was any, so that its root can be inverted."""
_STUDENT = 2.4
"""(1.96^2 + 1) / 2: over the degrees of freedom, what Student's interval of 95 % adds to the square of Gauss'."""


@part
class ErrorCovariance(NamedTuple):
    """The error of theta, as a rule and a covariance, and statistics of the noise.

    error = passed @ (error when the block began) + added. Matrices are `Mat3`, or arrays of shape (n, n).
    """

    left: Mat3  # root of the initial covariance, as far as it was left when the block began
    passed: Mat3  # what the samples since have made of an error
    heard: Mat3  # covariance that the noise of the blocks before has left
    white: Mat3  # root of the covariance that all noise has left, were it white and of variance 1
    added: Vec3  # error that the noise of this block has added
    weight: float  # samples seen, the old ones discounted
    squares: float  # of the scaled innovations, discounted alike
    products: float  # of each with the one before
    last: float  # scaled innovation
    blocks: float  # finished, the old ones discounted
    filled: float  # samples in the block under way

    def after(self, phi, gain, e, keep, memory, size):
        """The doubt after a sample with this gain and scaled innovation e.

        It leaves `keep` of what the older ones weigh in theta, and `memory` of what they say of the noise. A regressor
        of exact zeros says nothing: theta does not depend on such a sample, and neither does its uncertainty. Were
        their innovations, zeros too, heard as noise, nothing touched would make what was touched more certain.
        """
        if not phi @ phi > 0.0:
            return self
        left, heard, blocks, filled = self.left, self.heard, keep * keep * self.blocks, self.filled + 1.0
        passed = self.passed - outer(gain, self.passed.T @ phi)
        white = propagate_root(self.white, phi, gain)
        added = self.added + (e - phi @ self.added) * gain
        if filled >= BLOCK:
            left, heard = passed @ left, passed @ heard @ passed.T + outer(added, added)
            passed, added, blocks, filled = size.identity(), 0.0 * added, blocks + 1.0, 0.0
        return ErrorCovariance(
            left,
            passed,
            heard,
            white,
            added,
            memory * self.weight + 1.0,
            memory * self.squares + e * e,
            memory * self.products + e * self.last,
            e,
            blocks,
            filled,
        )

    def noise(self, parameters):
        """Long-run variance of the force's noise, as far as the samples tell."""
        return long_run_variance(self.weight, self.squares, self.products, parameters)

    def covariance(self, parameters):
        """Covariance of theta, were the parameters constant.

        A few blocks of noise say little about it, so it starts from white noise of the long-run variance, which
        errs on the wide side. (Newey and West, 1987, for noise of any colour; Alexopoulos and Seila, 1996, for the
        blocks.)
        """
        left = self.passed @ self.left
        heard = self.passed @ self.heard @ self.passed.T + outer(self.added, self.added)
        spread = (_CAUTION * self.noise(parameters)) * (self.white @ self.white.T) + self.blocks * heard
        known = _CAUTION + self.blocks
        return left @ left.T + ((1.0 + _STUDENT * self.blocks / known**2) / known) * spread


@law
def propagate_root(W, phi, gain):
    """Root of the covariance of an error after a sample with noise of variance 1; W is that before it.

    (I - gain phi^T) W W^T (I - gain phi^T)^T + gain gain^T, whose difference would lose its sign to rounding in the
    end; of a root each sample makes a root.
    """
    z = (1.0 / max(1.0 - phi @ gain, 1e-16)) * solve(W, gain)
    q = z @ z
    left = W - outer(gain, W.T @ phi)
    return left + outer(((sqrt(1.0 + q) - 1.0) / q) * gain, z) if 0.0 < q < SINGULAR else left


@law
def unsure(theta, root, identity):
    """The doubt before the first sample, from a root of the initial covariance."""
    return ErrorCovariance(
        root, identity, 0.0 * root, NOTHING * root, 0.0 * theta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )


@law
def long_run_variance(weight, squares, products, parameters):
    """Variance of the noise times what its correlation in time costs: (1 + r)/(1 - r), r that of neighbours.

    r is held below 0.99. Right for first-order noise under slow regressors, too wide under fast ones.
    """
    if squares <= 0.0:
        return 0.0
    r = max(min(products / squares, 0.99), 0.0)
    return squares / max(weight - parameters, 1.0) * (1.0 + r) / (1.0 - r)


_STATISTICS = 6
"""Numbers that stand behind theta in the state: what is known of the residuals."""


def known_first(theta: Array, P: Array) -> Array:
    """The state before the first sample: the initial estimate and its covariance, shapes (n,) and (n, n)."""
    n = len(theta)
    root, identity = np.linalg.cholesky(P).ravel(), np.eye(n).ravel()
    heard, nothing, even = np.zeros(n * n), np.zeros(n + _STATISTICS), np.full(n, 1.0 / np.trace(P))
    return np.concatenate(
        [theta, root, root, identity, heard, NOTHING * root, nothing, 1.0 / np.diag(P), even]
    )


@law
def statistics_at(n):
    """Where the six statistics stand."""
    return 5 * n * n + 2 * n


@law
def length(n):
    """How many numbers the state of n parameters has."""
    return statistics_at(n) + _STATISTICS + 2 * n


@law
def error_covariance_in(state, size):
    """The doubt as a state has it."""
    n = size.n
    k, m, s = n + n * n, n * n, statistics_at(n)
    return ErrorCovariance(
        size.matrix(state, k),
        size.matrix(state, k + m),
        size.matrix(state, k + 2 * m),
        size.matrix(state, k + 3 * m),
        size.vector(state, s - n),
        state[s],
        state[s + 1],
        state[s + 2],
        state[s + 3],
        state[s + 4],
        state[s + 5],
    )


def covariance_in(state: Array, n: int) -> Array:
    """S S^T, shape (n, n)."""
    root = state[n : n + n * n].reshape(n, n)
    return np.asarray(root @ root.T)


@law
def put(state, size, theta, S, doubt):
    """Writes an estimate, its root and its doubt into a state."""
    n = size.n
    k, m, s = n + n * n, n * n, statistics_at(n)
    size.put_vector(state, 0, theta)
    size.put_matrix(state, n, S)
    size.put_matrix(state, k, doubt.left)
    size.put_matrix(state, k + m, doubt.passed)
    size.put_matrix(state, k + 2 * m, doubt.heard)
    size.put_matrix(state, k + 3 * m, doubt.white)
    size.put_vector(state, s - n, doubt.added)
    state[s], state[s + 1], state[s + 2] = doubt.weight, doubt.squares, doubt.products
    state[s + 3], state[s + 4], state[s + 5] = doubt.last, doubt.blocks, doubt.filled


@law
def limit_root(S, floor, even, size):
    """S held on every axis, once its variances add up to more than at the start, as they are or each over its own."""
    v = size.variances(S)
    if v @ floor > size.n or v @ even > 1.0:
        for i in range(size.n):
            S = limit_axis(S, size.axis(i), floor)
    return S


_SIZE = Three()
_ONES = Vec3(1.0, 1.0, 1.0)


@law
def learn_sample(theta, S, doubt, phi, y, keep, size):
    """One sample on a root S that has forgotten already, leaving `keep` of what older samples weigh.

    theta, S, doubt, and the innovation scaled to the noise with the variance that it had before.
    """
    theta, S, gain, e, a = measure(theta, S, phi, y, 1.0)
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
        S = stretch_of(self.forgetting) * limit_root(state.root, floor, even, _SIZE)
        theta, S, doubt, _, _ = learn_sample(state.theta, S, state.doubt, phi, y, self.forgetting, _SIZE)
        return theta, LeastSquaresState(theta, S, doubt)
