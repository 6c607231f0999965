"""A model fitted to a log by least squares, and how far its parameters can be trusted.

White noise n of the position stands in every column as a filtered derivative of it. It adds N S to the information
Phi' Phi and nothing to Phi' f, which pulls the answer towards zero; taken out again, the answer is right on average
(bias-compensated least squares: Soderstrom, Errors-in-Variables Methods in System Identification, 2018, ch. 7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.descent import Descent, Point, names_of
from palpate.identification.least_squares import Noise, covariance, noise_of
from palpate.identification.models import Model, Motion
from palpate.identification.options import Lag, prior_of
from palpate.identification.uncertainty import student

_LEAST = 0.1
"""Share of the information in any direction that must be left for the noise's to be taken out."""
_NOTHING = 0.05
"""Share of it under which a direction is as good as unknown."""
_ENCODERS = 2
_DOUBT = 0.3
"""Relative error of each of the noise's measured covariances."""


@dataclass(frozen=True)
class Compensation:
    """Effect of noise of the position on a least-squares answer.

    Args:
        step: to add to the answer, shape (p,).
        less: information that was the noise's and has to be taken out, shape (p, p).
        doubt: covariance of what the answer may still be off by, shape (p, p).
    """

    step: Array
    less: Array
    doubt: Array


def compensation(jacobian: Array, noisy: Array, theta: Array, spread: Array, weight: Array) -> Compensation:
    """Find it, in each direction of the parameters with its own share of noise in the information.

    Args:
        jacobian: derivatives of the prediction by the parameters, shape (n, p).
        noisy: how the columns' noise is made of that of the position's derivatives, shape (p, k).
        theta: how the force's noise is made of them, shape (k,).
        spread: covariance of the derivatives' noise in one row, shape (k, k).
        weight: of what is known of each parameter beforehand, shape (p,).
    """
    gram = jacobian.T @ jacobian + np.diag(weight)
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0] = 1.0
    rows = len(jacobian)
    whole = rows * noisy @ spread @ noisy.T / np.outer(scale, scale)
    scores = (
        rows * noisy @ spread * theta / scale[:, None]
    )  # what each derivative's noise pulls by, shape (p, k)
    root = np.linalg.cholesky(gram / np.outer(scale, scale) + 1e-13 * np.eye(len(scale)))
    inner = np.linalg.solve(root, np.linalg.solve(root, whole).T)
    noise, ways = np.linalg.eigh((inner + inner.T) / 2)
    share = np.minimum(1.0, (1 - _LEAST) / np.maximum(noise, 1e-300))
    pulls = ways.T @ np.linalg.solve(root, scores)
    # A direction that is nearly all noise is left where it is: how far to move it, nobody knows.
    step = np.where(share == 1, pulls.sum(axis=1) / np.maximum(1 - noise, _LEAST), 0.0)
    # How a pull c / (1 - n) moves with the noise's power, c and n both in proportion to it.
    doubt = _DOUBT * np.linalg.norm(pulls, axis=1) / np.maximum(1 - noise, _NOTHING) ** 2
    back = np.linalg.solve(root.T, ways) / scale[:, None]
    taken = (root @ ways) * scale[:, None]
    return Compensation(back @ step, (taken * (share * noise)) @ taken.T, (back * doubt**2) @ back.T)


def resting(jacobian: Array, position: Array, count: float, stiffness: float) -> Array:
    """Covariance of Phi' e, for the force e that a coarse position hides, shape (p, p).

    Where the position rests it errs by the same part of a count all the time, which no number of samples averages out:
    one error, even in a count (deviation count / sqrt(12)), for each place of a count's width. As the tip of an arm is
    read through several encoders, two are counted that are as coarse as the one seen.

    Args:
        jacobian: Phi, shape (n, p).
        position: shape (n,).
        count: what it moves by when its encoder counts on.
        stiffness: force per position.
    """
    if count == 0:
        return np.zeros((jacobian.shape[1], jacobian.shape[1]))
    _, place = np.unique(np.floor(position / count), return_inverse=True)
    sums = np.zeros((int(place.max()) + 1, jacobian.shape[1]))
    np.add.at(sums, place, jacobian)
    found: Array = _ENCODERS * (stiffness * count) ** 2 / 12 * sums.T @ sums
    return found


def bias_corrected(
    model: Model, motion: Motion, jacobian: Array, theta: Array, level: float, lag: Lag, std: Array | None
) -> Compensation:
    """Bias of the estimate by the position's noise; none of the lag if the log does not estimate it.

    Where no sensor's way and no encoder's counts are known, the noise is only known to be no larger: nothing is taken
    out then, and all that it may have done is open.
    """
    noisy, force = np.zeros((len(theta), 4)), np.zeros(4)  # of the position's derivatives 0 to 3
    for name, d in model.derivatives.items():
        place = model.linear.index(name)
        noisy[place, d], force[d] = 1.0, theta[place]
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


@dataclass(frozen=True)
class Fit:
    """A model fitted to a log.

    Args:
        names: of the parameters: the linear ones, then the nonlinear ones, then the lag.
        theta: their values, shape (p,).
        cov: their covariance, coloured noise and the lag's uncertainty included, shape (p, p).
        r2: share of the force's variance that it explains.
        noise: colour of the residuals.
    """

    names: tuple[str, ...]
    theta: Array
    cov: Array
    r2: float
    noise: Noise

    def __getitem__(self, name: str) -> float:
        return float(self.theta[self.names.index(name)])

    def std(self, name: str) -> float:
        """Standard deviation of a parameter."""
        i = self.names.index(name)
        return float(np.sqrt(max(self.cov[i, i], 0.0)))

    @property
    def t(self) -> float:
        """Student's factor of a standard deviation for a 95 % interval."""
        return student(self.noise.effective - len(self.names))

    def with_cause(self, cause: str, effect: Array) -> Fit:
        """The same with one more cause of error, as of an `Answer`; a covariance keeps no names of causes.

        Args:
            cause: its name.
            effect: standard deviation of each parameter by it, shape (p,).
        """
        return replace(self, cov=self.cov + np.outer(effect, effect))

    def through(self, jacobian: Array, theta: Array) -> Fit:
        """Functions of the parameters instead, as of an `Answer`.

        Args:
            jacobian: their derivatives by the parameters, shape (p, p).
            theta: their values, shape (p,).
        """
        return replace(self, theta=theta, cov=jacobian @ self.cov @ jacobian.T)


def fit(model: Model, motion: Motion, force: Array, lag: Lag, start: float | None = None) -> Fit:
    """Fit a model.

    Args:
        model: which.
        motion: the position.
        force: filtered, at the motion's rows, shape (n,).
        lag: what is known about it; if it is not known, it is looked for within its prior, and its uncertainty is part
            of every interval.
        start: where that search begins [s]; the prior's value if not given.
    """
    descent, point = _search(model, motion, force, lag, start)
    jacobian = descent.jacobian(point)
    names = names_of(model)
    noise = noise_of(point.residuals, motion.rows, len(names) - int(lag.std == 0))
    theta = np.array([*point.theta, *(point.nonlinear[k.name] for k in model.nonlinear), point.lag])
    level = float(np.sqrt(point.rss / max(len(force) - len(point.theta), 1)))
    std = descent.known.std(names, level)
    pulled, less, more = np.zeros((len(names), len(names))), None, None
    if model.of_position:
        by_noise = bias_corrected(model, motion, jacobian, theta, level, lag, std)
        theta, pulled, less = theta + by_noise.step, by_noise.doubt, by_noise.less
        stiffness = float(theta[names.index("K")]) if "K" in names else 0.0
        more = resting(jacobian, motion.moved(0, float(theta[-1])), motion.noise.count, stiffness)
    prior = np.full(len(names), np.inf) if std is None else std
    prior[-1] = lag.std
    cov, own = np.zeros_like(pulled), slice(None if lag.std > 0 else -1)
    cov[own, own] = pulled[own, own] + covariance(
        jacobian[:, own],
        motion.rows,
        noise,
        prior[own],
        None if less is None else less[own, own],
        None if more is None else more[own, own],
    )
    residuals = point.residuals - jacobian @ (theta - [*point.theta, *point.nonlinear.values(), point.lag])
    spread = float(np.mean((force - force.mean()) ** 2))
    return Fit(names, theta, cov, 1 - float(np.mean(residuals**2)) / spread if spread else 0.0, noise)


def nonlinear_fit(model: Model, motion: Motion, force: Array, lag: Lag) -> dict[str, float]:
    """The nonlinear parameters of a model by least squares, by name.

    Args:
        model: which.
        motion: the position.
        force: filtered, at the motion's rows, shape (n,).
        lag: what is known about it.
    """
    return _search(model, motion, force, lag)[1].nonlinear


def _search(
    model: Model, motion: Motion, force: Array, lag: Lag, start: float | None = None
) -> tuple[Descent, Point]:
    """The least cost, and the search with what is known beside the log against its noise."""
    asked = lag if lag.std > 0 else None
    descent = Descent(model, motion, force)
    best = descent.best_start(lag.value if start is None else start)
    for _ in range(2 if asked or lag.mass else 1):
        best = descent.from_point(best, asked)
        noise = float(np.sqrt(best.rss / max(len(force) - len(best.theta), 1)))
        descent = replace(descent, known=prior_of(lag, noise, asked is not None))
    return descent, descent.from_point(best, asked) if descent.known.known else best
