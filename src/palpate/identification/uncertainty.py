"""How uncertain a fit is for what least squares leave out: noise of the position, and the lag."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palpate.identification.beforehand import Lag
from palpate.identification.compensation import Compensation, compensation
from palpate.identification.models import Model, Motion
from palpate.identification.regression import Noise, covariance, solve
from palpate.identification.sensor_path import SensorPath

Array = NDArray[np.float64]


def undone(
    model: Model, motion: Motion, jacobian: Array, theta: Array, level: float, lag: Lag, std: Array | None
) -> Compensation:
    """What the position's noise did to the answer; to the lag it did nothing if that is known exactly."""
    derivatives = model.derivatives
    force = np.zeros(4)
    noisy = np.zeros((len(theta), 4))
    for name, d in derivatives.items():
        place = model.linear.index(name)
        force[d] = theta[place]
        noisy[place, d] = 1.0
    noisy[-1, 1:] = -force[:3]
    weight = np.zeros(len(theta)) if std is None else (level / std) ** 2
    free = np.arange(len(theta)) < len(theta) - (lag.std == 0)
    spread = (
        motion.chain.noise_spread(motion.own_noise)
        if isinstance(motion.chain, SensorPath)
        else np.zeros((4, 4))
    )
    part = compensation(jacobian[:, free], noisy[free], force, spread, weight[free])
    if free.all():
        return part
    return Compensation(np.append(part.step, 0.0), np.pad(part.less, (0, 1)), np.append(part.doubt, 0.0))


def attenuation(model: Model, motion: Motion, jacobian: Array, theta: Array) -> Array:
    """How far white noise of the position pulls the parameters: (Phi' Phi)^-1 n S theta, S the noise of the columns."""
    shift = np.zeros(jacobian.shape[1])
    if motion.noise == 0 or isinstance(motion.chain, SensorPath):
        return shift
    places = [model.linear.index(name) for name in model.derivatives]
    spread = motion.chain.noise_gain(tuple(model.derivatives.values())) * motion.noise**2
    shift[places] = len(motion.rows) * spread @ theta[places]
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0] = 1.0
    gram = jacobian.T @ jacobian / np.outer(scale, scale)
    pulled: Array = np.linalg.lstsq(gram, shift / scale, rcond=1e-12)[0] / scale
    return pulled


def with_lag(
    jacobian: Array,
    fixed: Array,
    motion: Motion,
    noise: Noise,
    lag: Lag,
    pulled: Array,
    std: Array | None,
    less: Array | None,
) -> Array:
    """The covariance with the lag's own uncertainty, be it calibrated (the log is not asked) or found in the log."""
    if lag.std == 0:
        return fixed
    if not lag.known or motion.matched:
        prior = np.full(jacobian.shape[1], np.inf) if std is None else std
        prior[-1] = lag.std
        return covariance(jacobian, motion.rows, noise, prior, less) + np.outer(pulled, pulled)
    shift = -solve(jacobian[:, :-1], jacobian[:, -1])  # how the answer moves with the lag
    grown = fixed + np.pad(np.outer(shift, shift), (0, 1)) * lag.std**2
    grown[-1, :-1] = grown[:-1, -1] = shift * lag.std**2
    grown[-1, -1] = lag.std**2
    return grown
