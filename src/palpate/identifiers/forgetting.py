"""Forgetting policies of an estimator: parts that stretch a root of the covariance before each sample.

`forget(S, phi, floor)` returns S stretched, and whether the sample counts at all; `floor` is the inverse of the
initial variances. `keep` is what is left after one sample of the weight of those before it.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, runtime_checkable

from palpate._jit import part
from palpate._vector import solve
from palpate.identifiers.kernels.square_root import stretch_of, stretched
from palpate.signals.types import coerced, require


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
@coerced(_factor)
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


@part
@coerced(_factor)
class Directional(NamedTuple):
    """Only what the sample speaks of is forgotten: the force that is predicted for it (Kulhavy and Karny, 1984).

    When to use it: excitation that comes and goes and is never faint. Independent of units; but a faint sample,
    mere noise, makes it forget as much as a strong one.

    Args:
        keep: the forgetting factor, in (0, 1]. Each sample forgets in one direction of n only: where all are excited
            alike, each remembers n / (1 - keep) samples.
    """

    keep: float

    def forget(self, S, phi, floor):
        """S stretched along what the sample sees of it; every sample counts."""
        return stretched(S, S.T @ phi, stretch_of(self.keep)), True


def _subspace(policy: SIFt) -> None:
    _factor(policy)
    require(policy.least >= 0.0, "least", "0 or more", policy.least)


@part
@coerced(_subspace)
class SIFt(NamedTuple):
    """Information is forgotten only in the subspace that new information arrives in, and only where some does.

    Subspace of information forgetting (Lai and Bernstein, 2024), for one force at a time: information has a lower
    and an upper bound without persistent excitation. Directions are compared in units of the initial standard
    deviations, so that the result does not depend on whether stiffness is in N/m or in kN/m.

    When to use it: as `Directional`, and for years of rest with noisy sensors.

    Args:
        keep: the forgetting factor, in (0, 1]; memory as of `Directional`.
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
        return stretched(S, solve(S, d), stretch_of(self.keep)), True


def policy_of(forgetting: float | Forgetting) -> Forgetting:
    """A policy as it is; a number is the factor of exponential forgetting."""
    return forgetting if isinstance(forgetting, Forgetting) else Exponential(forgetting)
