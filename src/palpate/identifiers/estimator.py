"""Base of the estimators on a stream: a flat state, one compiled update, and the input checks.

Forgetting policies are parts that stretch a root of the covariance before each sample: `forget(S, phi, floor)`
returns S stretched, and whether the sample counts at all; `floor` is the inverse of the initial variances. `keep` is
the weight that those before a sample keep after it. By an identifier's table an experiment asks for one that watches
its run.
"""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law, part
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate._vector import solve
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identifiers.dimension import size_of
from palpate.identifiers.least_squares import length, stretch, stretch_of
from palpate.records import Readable
from palpate.signals.types import Estimate, Table, coerce_fields, require

LARGEST = 1e30
"""No measurement in SI units is larger: the range of a log's columns."""
HUGE = LARGEST**2
"""A sum of squares beyond it, or not a number, is no sample."""


class Streaming(Readable, ABC):
    """Estimates theta in ``force = regressor . theta``; the update is compiled in the constructor.

    An estimator belongs to one thread at a time: updates change its state in place without a lock of their own, which
    would cost as much as they do. Threads that share one hold a lock around each call, or samples are lost.

    Args:
        state: all that is known, flat; the first n values are theta.
        n: number of parameters.
        policy: the part with `absorb(state, phi, y, size)`, which takes a sample in and says whether it was one.
        names: of the parameters, in the order of the regressor.
    """

    names: tuple[str, ...]

    def __init__(self, state: Array, n: int, policy: Any, names: tuple[str, ...] | None):
        self.names = names if names is not None else tuple(f"theta{i}" for i in range(n))
        if len(self.names) != n:
            raise InputError(f"names must be as many as parameters: got {len(self.names)} names for {n}")
        self._n, self._state, self._policy, self._size = n, state, policy, size_of(n)
        self._bind()

    @abstractmethod
    def estimate(self) -> Estimate:
        """The estimate with its covariance, from which its verdicts follow."""

    @property
    @abstractmethod
    def covariance(self) -> Array:
        """P, shape (n, n)."""

    @property
    def _floor(self) -> Array:
        ends = length(self._n) - 2 * self._n
        return self._state[ends : ends + self._n]

    @property
    def theta(self) -> Array:
        """The estimate, shape (n,)."""
        return self._state[: self._n].copy()

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in: regressor of shape (n,), force a number.

        Raises:
            InputError: a regressor of another shape, or a number that is not finite; the estimate is unchanged.
        """
        phi = cast_array("regressor", regressor, self._shape)
        y = cast_number("force", force)
        if not self._one(self._state, phi, y, self._policy, self._size):
            raise InputError(
                "a sample must be finite numbers up to 1e30, leave it out; "
                f"got regressor {phi.tolist()}, force {y:g}"
            )

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, as k calls of `update` would: regressors of shape (k, n), forces of shape (k,).

        Raises:
            InputError: shapes that do not fit; or a sample that is not finite, those before it having been taken in.
        """
        phi = cast_array("regressors", regressors, (None, self._n))
        y = cast_array("forces", forces, phi.shape[:1])
        done = self._many(self._state, phi, y, self._policy, self._size)
        if done < len(y):
            raise InputError(
                f"sample {done} is not finite: regressor {phi[done].tolist()}, force {y[done]}; "
                f"the {done} before it were taken in"
            )

    def _bind(self) -> None:
        self._shape = (self._n,)
        # An impossible sample compiles the update and leaves the state alone.
        impossible = np.full((1, self._n), np.nan)
        rest = (self._policy, self._size)
        self._one = machine_code(_one, self._state, impossible[0], 0.0, *rest)
        self._many = machine_code(_many, self._state, impossible, np.zeros(1), *rest)

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value.copy() if name == "_state" else value
            for name, value in self.__dict__.items()
            if name not in ("_one", "_many")
        }

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()


@kernel
def _one(state, phi, y, policy, size):
    return policy.absorb(state, phi, y, size)


@kernel
def _many(state, phi, y, policy, size):
    """Index of the first sample that is not finite, or how many there are."""
    for i in range(len(y)):
        if not policy.absorb(state, phi[i], y[i], size):
            return i
    return len(y)


@law
def is_sample(p, y):
    """Whether a regressor and a force are numbers of a measurement."""
    return p @ p + y * y < HUGE


def as_estimate(
    names: tuple[str, ...], theta: Array, covariance: Array, samples: float, floor: Array
) -> Estimate:
    """An estimate; where regressors of too different size took all digits of a covariance, with that of the start.

    Args:
        names: of the parameters.
        theta: the values, shape (n,).
        covariance: of them, shape (n, n), as it was computed.
        samples: that they are worth.
        floor: inverse of each initial variance, shape (n,).
    """
    variances = np.diag(covariance)
    if not (np.isfinite(covariance).all() and (variances >= 0.0).all()):
        return Estimate(names, theta, np.diag(1.0 / floor), samples)
    return Estimate(names, theta, 0.5 * (covariance + covariance.T), samples)


def check_start(theta: ArrayLike, covariance: ArrayLike) -> tuple[Array, Array]:
    """Copies of theta, shape (n,), and of its covariance, shape (n, n), symmetric to the last bit.

    Raises:
        InputError: shapes that do not fit, numbers that are not finite, a matrix that is no covariance.
    """
    start = cast_array("theta", theta, (None,)).copy()
    n = len(start)
    if n == 0:
        raise InputError("theta must have shape (n,) with n at least 1, got (0,)")
    P = cast_array("covariance", covariance, (n, n))
    if not (np.isfinite(start).all() and np.isfinite(P).all()):
        raise InputError("theta and covariance must be finite")
    variances = np.diag(P)
    if not np.allclose(P, P.T, rtol=1e-12, atol=0.0) or not _is_definite(P):
        raise InputError("covariance must be symmetric and positive definite, for example 1e6 * identity")
    if np.abs(start).max() > LARGEST or variances.max() > HUGE or variances.min() < 1.0 / HUGE:
        raise InputError(
            "theta must be numbers up to 1e30, and their variances in covariance from 1e-60 to 1e60"
        )
    return start, 0.5 * (P + P.T)


def _is_definite(P: Array) -> bool:
    """True if a symmetric matrix has a root."""
    with np.errstate(all="ignore"):
        scale = np.sqrt(np.diag(P))
        try:
            return bool(np.isfinite(np.linalg.cholesky(P / scale / scale[:, None])).all())
        except np.linalg.LinAlgError:
            return False


@runtime_checkable
class Forgetting(Protocol):
    """A policy, of this file or one's own; a part."""

    @property
    def keep(self) -> float:
        """Weight of the earlier samples after one more, relative."""

    def forget(self, S: Any, phi: Any, floor: Any) -> tuple[Any, bool]:
        """S stretched, and whether the sample counts."""


def _factor(policy: Any) -> None:
    require(0.0 < policy.keep <= 1.0, "forgetting", "in (0, 1]", policy.keep)


@part
@coerce_fields(_factor)
class Exponential(NamedTuple):
    """Everything is forgotten alike, whether the sample speaks of it or not.

    When to use it: motion that always excites all parameters. What is not excited is forgotten until the initial
    covariance is back, so that after a long rest an estimator is as ready as at its start, and knows as little.

    Args:
        keep: the forgetting factor, in (0, 1]; memory of 1 / (1 - keep) samples. 1 forgets nothing.
    """

    keep: float

    def forget(self, S, phi, floor):
        """S with all of it stretched; every sample counts."""
        return stretch_of(self.keep) * S, True


def _subspace(policy: "SIFt") -> None:
    _factor(policy)
    require(policy.least >= 0.0, "least", "0 or more", policy.least)


@part
@coerce_fields(_subspace)
class SIFt(NamedTuple):
    """Information is forgotten only in the subspace that new information arrives in, and only where some does.

    Subspace of information forgetting (Lai and Bernstein, 2024), for one force at a time: information has a lower
    and an upper bound without persistent excitation. Directions are compared in units of the initial standard
    deviations, so that the result does not depend on whether stiffness is in N/m or in kN/m.

    When to use it: excitation that comes and goes, faint excitation, and years of rest with noisy sensors.

    Args:
        keep: the forgetting factor, in (0, 1]. Each sample forgets in one direction of n only: where all are excited
            alike, each remembers n / (1 - keep) samples.
        least: a sample whose force the initial covariance would predict with less than this variance [N^2] says
            nothing; it is left out.
    """

    keep: float
    least: float = 1e-6

    def forget(self, S, phi, floor):
        """S stretched where the sample has information, and whether that is any at all."""
        d = phi / floor
        if not phi @ d > self.least:
            return S, False
        return stretch(S, solve(S, d), stretch_of(self.keep)), True


def forgetting_policy(forgetting: float | Forgetting) -> Forgetting:
    """A policy as it is; a number is the factor of exponential forgetting."""
    if isinstance(forgetting, Forgetting):
        return forgetting
    return Exponential(cast_number("forgetting", forgetting))


class IdentifierTable(Table, tag_field="kind"):
    """The [identifier] table of an experiment. Derive from it beside the estimator, with its `kind` as tag."""

    def build(self, tick: float) -> Any:
        """The estimator of (M, B, K) at its start, for a time between samples [s]."""
        raise NotImplementedError


VAGUE = (10.0, 1e4, 1e6)
"""Standard deviation of M [kg], B [N s/m] and K [N/m] before anything is known."""
NAMES = ("M", "B", "K")
