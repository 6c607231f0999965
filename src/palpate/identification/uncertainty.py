"""The uncertainty budget of a result: contributions by cause, and how they combine (GUM, JCGM 100:2008).

A standard uncertainty is a standard deviation; u_c is the root of the sum of their squares, its degrees of freedom are
Welch's and Satterthwaite's (annex G.4), and the expanded uncertainty U = k u_c is the half-width of the 95 % interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import combinations
from math import hypot, isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.identification.causes import cause_of
from palpate.records import Readable
from palpate.signals.types import NORMAL

_MAX_FREEDOM = 1e9
"""Degrees of freedom from which on Student's t is the normal distribution."""


def student(freedom: float, level: float = 0.95) -> float:
    """Two-sided quantile of Student's t for a probability within; fewer degrees of freedom than one count as one."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), (1 + level) / 2))


def effective_freedom(variance: ArrayLike, freedom: ArrayLike) -> Array:
    """Degrees of freedom of a sum of variances (Welch and Satterthwaite, JCGM 100, G.2b), shape (p,).

    The variances are by cause, shape (c, p), and so are the degrees of freedom of each.
    """
    variance = np.asarray(variance, np.float64)
    total = variance.sum(axis=0)
    loss = ((variance / np.where(total > 0, total, 1.0)) ** 2 / np.asarray(freedom)).sum(axis=0)
    return np.asarray(1 / np.clip(loss, 1 / _MAX_FREEDOM, 1.0))


def half_widths(variance: ArrayLike, freedom: ArrayLike) -> Array:
    """95 % half-widths of all causes together, shape (p,): Student's t times the root of the sum of the variances.

    The variances are by cause, shape (c, p), and so are the degrees of freedom of each.
    """
    from scipy.special import stdtrit

    total = np.asarray(variance, np.float64).sum(axis=0)
    freedoms = effective_freedom(variance, freedom)
    coverage = np.where(freedoms < 0.99 * _MAX_FREEDOM, stdtrit(freedoms, 0.975), NORMAL)
    return np.asarray(coverage * np.sqrt(total))


class Contribution(NamedTuple):
    """Contribution of one cause to the uncertainty of a result.

    Args:
        std: standard uncertainty, in the unit of the result.
        freedom: its degrees of freedom.
    """

    std: float
    freedom: float = np.inf

    @classmethod
    def within(cls, half: float) -> Contribution:
        """Of a bound that is the half-width of a normal distribution's 95 % (JCGM 100, 4.3.4)."""
        return cls(half / NORMAL)

    @property
    def half(self) -> float:
        """95 % half-width by this cause alone."""
        return (student(self.freedom) if isfinite(self.freedom) else NORMAL) * self.std

    def times(self, gain: float) -> Contribution:
        """Scale the contribution to that of a multiple of the result."""
        return Contribution(abs(gain) * self.std, self.freedom)


Contributions = Mapping[str, Contribution]


def half_width(contributions: Contributions) -> float:
    """95 % half-width of one result: of a parameter, a working point or a slope."""
    if not contributions:
        return 0.0
    std, freedom = np.array(list(contributions.values())).T
    return float(half_widths(std**2, freedom))


class Input(NamedTuple):
    """An input quantity that a cause stands for: estimate, standard uncertainty, and their unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Measurement:
    """A value and the contributions to its uncertainty, by cause; independent of each other."""

    value: float
    contributions: Contributions

    @classmethod
    def within(cls, value: float, half: float, cause: str = "noise") -> Measurement:
        """With one cause of a normal distribution, whose 95 % half-width is given."""
        return cls(value, {cause: Contribution.within(half)})

    @property
    def half(self) -> float:
        """95 % half-width of all causes together: the expanded uncertainty."""
        return half_width(self.contributions)

    @property
    def combined(self) -> float:
        """Combined standard uncertainty u_c."""
        return hypot(*(part.std for part in self.contributions.values()))

    @property
    def freedom(self) -> float:
        """Effective degrees of freedom; infinite where the normal distribution holds."""
        variance, freedom = np.array([(part.std**2, part.freedom) for part in self.contributions.values()]).T
        effective = float(effective_freedom(variance, freedom))
        return effective if effective < 0.99 * _MAX_FREEDOM else np.inf

    @property
    def relative_half(self) -> float:
        """The half-width over the value."""
        return self.half / abs(self.value or 1e-300)

    def known_to(self, tolerance: float) -> bool:
        """True if the half-width is at most a fraction of the value."""
        return self.half <= tolerance * abs(self.value)

    def with_cause(self, cause: str, own: Contribution) -> Measurement:
        """Add one more cause of error."""
        return replace(self, contributions={**self.contributions, cause: own})

    def through(self, value: float, gain: float) -> Measurement:
        """A function of it instead, by its value and its derivative."""
        return Measurement(value, {cause: part.times(gain) for cause, part in self.contributions.items()})

    def budget_json(self, inputs: Mapping[str, Input]) -> dict[str, Any]:
        """Plain values that JSON can hold, largest contribution first; an infinite number is None.

        Args:
            inputs: of causes that are input quantities. The effect of any other is estimated in the unit of the result,
                and its sensitivity is 1.
        """
        rows = sorted(self.contributions.items(), key=lambda item: -item[1].std)
        return {
            "combined_standard_uncertainty": self.combined,
            "effective_degrees_of_freedom": _finite(self.freedom),
            "coverage_factor": self.half / self.combined,
            "expanded_uncertainty": self.half,
            "sources": [self._source(name, part, inputs.get(name)) for name, part in rows if part.std > 0],
        }

    def _source(self, name: str, own: Contribution, read: Input | None) -> dict[str, Any]:
        cause = cause_of(name)
        return {
            "source": name,
            "description": cause.described,
            "type": cause.kind,
            "distribution": "t" if isfinite(own.freedom) else "normal",
            "input": read._asdict() if read else None,
            "sensitivity": own.std / read.std if read and read.std else 1.0,
            "standard_uncertainty": own.std,
            "degrees_of_freedom": _finite(own.freedom),
            "share": (own.std / self.combined) ** 2,
        }


class Verdict(StrEnum):
    """Trust in a parameter."""

    IDENTIFIED = "identified"
    NOT_IDENTIFIABLE = "not identifiable"
    REJECTED = "rejected"


_MIN_LISTED_SHARE = 1e-3
"""Share of a half-width below which a cause is not listed in the budget."""


@dataclass(frozen=True)
class Parameter(Readable):
    """One parameter of the contact.

    Args:
        value, std: None where the log carries no number worth printing.
        unit: in SI.
        verdict: identified, not identifiable or rejected.
        ci95: 95 % interval that holds whatever the model, also where `value` is None and the log bounds it; verdicts
            rest on it.
        reason: why.
        budget: half-width of `ci95` by cause, largest first; without what is under a thousandth of the whole.
        contributions: to the combined standard uncertainty, by cause.
    """

    value: float | None
    std: float | None
    ci95: tuple[float, float] | None
    unit: str
    verdict: Verdict
    reason: str
    budget: dict[str, float] = field(default_factory=dict)
    contributions: Contributions = field(default_factory=dict)

    @classmethod
    def of(
        cls, value: float, unit: str, verdict: Verdict, reason: str, contributions: Contributions
    ) -> Parameter:
        """A parameter with its interval and its budget, of the contributions to its uncertainty by cause."""
        measurement = Measurement(value, contributions)
        half = measurement.half
        coverage = half / (measurement.combined or 1.0)  # one coverage factor, of all causes together
        parts = {cause: coverage * part.std for cause, part in contributions.items()}
        parts = dict(sorted(parts.items(), key=lambda item: -item[1]))
        budget = {cause: part for cause, part in parts.items() if part > _MIN_LISTED_SHARE * half}
        ends = value - half, value + half
        return cls(value, half / NORMAL, ends, unit, verdict, reason, budget, contributions)

    @classmethod
    def unknown(cls, unit: str, reason: str) -> Parameter:
        """A parameter that the log says nothing of, and why."""
        return cls(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, reason)

    def without_number(
        self,
        reason: str,
        verdict: Verdict = Verdict.NOT_IDENTIFIABLE,
        ci95: tuple[float, float] | None = None,
    ) -> Parameter:
        """Remove the value, and keep at most the bounds `ci95` that the log still shows: the budget says why."""
        return replace(self, value=None, std=None, ci95=ci95, verdict=verdict, reason=reason)

    @property
    def measurement(self) -> Measurement | None:
        """Value and contributions; None without a number, or where no cause is known."""
        if (
            self.value is None
            or self.ci95 is None
            or not any(part.std for part in self.contributions.values())
        ):
            return None
        return Measurement(self.value, self.contributions)

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        return {
            "value": self.value,
            "std": self.std,
            "ci95": list(self.ci95) if self.ci95 else None,
            "budget": self.budget,
            "unit": self.unit,
            "verdict": str(self.verdict),
            "reason": self.reason,
        }


def correlations(names: Sequence[str], cov: Array) -> dict[str, float]:
    """Correlation coefficient of each pair of parameters, by their names with a comma between; cov is (p, p)."""
    std = np.sqrt(np.diag(cov))
    pairs = [(i, j) for i, j in combinations(range(len(names)), 2) if std[i] * std[j] > 0]
    return {f"{names[i]},{names[j]}": float(cov[i, j] / (std[i] * std[j])) for i, j in pairs}


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None
