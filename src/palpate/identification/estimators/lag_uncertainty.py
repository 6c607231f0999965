"""How uncertain a fit is for what least squares leave out: noise of the position, and the lag."""

from __future__ import annotations

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.errors_in_variables import Compensation, compensation, resting
from palpate.identification.least_squares import Noise, covariance
from palpate.identification.models import Model, Motion
from palpate.identification.prior import Lag


def of_derivatives(model: Model, theta: Array) -> tuple[Array, Array]:
    """How noise of the position's derivatives 0 to 3 stands in the columns, (p, 4), and in the force, (4,)."""
    noisy, force = np.zeros((len(theta), 4)), np.zeros(4)
    for name, d in model.derivatives.items():
        place = model.linear.index(name)
        noisy[place, d] = 1.0
        force[d] = theta[place]
    return noisy, force


def bias_corrected(
    model: Model, motion: Motion, jacobian: Array, theta: Array, level: float, lag: Lag, std: Array | None
) -> Compensation:
    """Bias of the estimate by the position's noise; none of the lag if the log does not estimate it.

    Where no sensor's way and no encoder's counts are known, the noise is only known to be no larger: nothing is taken
    out then, and all that it may have done is open.
    """
    noisy, force = of_derivatives(model, theta)
    noisy[-1, 1:] = -force[:3]
    weight = np.zeros(len(theta)) if std is None else (level / std) ** 2
    asked = lag.std > 0
    free = np.arange(len(theta)) < len(theta) - (not asked)
    spread = motion.chain.noise_spread(motion.noise)
    part = compensation(jacobian[:, free], noisy[free], force, spread, weight[free])
    if not (motion.matched or motion.noise.count):
        part = Compensation(0 * part.step, 0 * part.less, np.outer(part.step, part.step))
    if free.all():
        return part
    return Compensation(np.append(part.step, 0.0), np.pad(part.less, (0, 1)), np.pad(part.doubt, (0, 1)))


# More than seven arguments: what two estimates differ in, each by itself.
def with_lag(
    jacobian: Array,
    fixed: Array,
    motion: Motion,
    noise: Noise,
    lag: Lag,
    pulled: Array,
    std: Array | None,
    less: Array | None,
    more: Array | None,
) -> Array:
    """The covariance with the lag's own uncertainty, a prior that the log may sharpen."""
    if lag.std == 0:
        return fixed
    prior = np.full(jacobian.shape[1], np.inf) if std is None else std
    prior[-1] = lag.std
    return covariance(jacobian, motion.rows, noise, prior, less, more) + pulled


def hidden(model: Model, motion: Motion, jacobian: Array, theta: Array) -> Array:
    """Covariance of Phi' e for what the position's encoder hides, as `resting` has it, shape (p, p)."""
    stiffness = float(theta[model.linear.index("K")]) if "K" in model.linear else 0.0
    return resting(jacobian, motion.moved(0, float(theta[-1])), motion.noise.count, stiffness)
