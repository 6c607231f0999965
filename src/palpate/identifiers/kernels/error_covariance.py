"""How far an estimate may be from the truth, whatever was forgotten on the way.

Each sample changes the error of theta by a known rule, error <- (I - gain phi^T) error + gain noise, and the gain is
all that forgetting has a say in. So the error's covariance is followed beside the estimate: what is left of the
initial doubt, and what the noise has added, of any colour that a `BLOCK` of samples outlasts.
"""

from __future__ import annotations

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, outer, solve, sqrt
from palpate.identifiers.kernels.square_root import SINGULAR

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
        white = fed(self.white, phi, gain)
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
def fed(W, phi, gain):
    """Root of the covariance of an error after a sample with noise of variance 1; W is that before it.

    (I - gain phi^T) W W^T (I - gain phi^T)^T + gain gain^T, whose difference would lose its sign to rounding in the
    end; of a root each sample makes a root.
    """
    z = (1.0 / max(1.0 - phi @ gain, 1e-16)) * solve(W, gain)
    q = z @ z
    left = W - outer(gain, W.T @ phi)
    return left + outer(((sqrt(1.0 + q) - 1.0) / q) * gain, z) if 0.0 < q < SINGULAR else left


@law
def carried(C, phi, gain, variance):
    """The covariance of an error after a sample: (I - gain phi^T) C (I - gain phi^T)^T + variance gain gain^T.

    In halves, which keeps it symmetric to the last bit.
    """
    w = C @ phi
    h = w + (-0.5 * (variance + phi @ w)) * gain
    return C - (outer(gain, h) + outer(h, gain))


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
