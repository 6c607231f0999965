"""Many measurements of one quantity that differ by more than their own intervals: a random effect.

Each press has an error of its own, with a variance that it states, and beside it the presses differ (another spot,
another moisture). The variance between them is found by Paule and Mandel (J. Res. NBS 87, 1982), the mean's deviation
by Hartung and Knapp (Statist. Med. 20, 2001), never below what equal effects would have (Roever, Knapp and Friede, BMC
Med. Res. Methodol. 15, 2015); the next press by Higgins, Thompson and Spiegelhalter (J. R. Statist. Soc. A 172, 2009).
Where covariates are given (a temperature, a humidity), the mean is a plane over them, and the presses differ about it
(random-effects meta-regression, Knapp and Hartung, Statist. Med. 22, 2003).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.result import Identification
from palpate.identification.uncertainty import Contribution, Measurement, Parameter, Verdict, student
from palpate.records import Result
from palpate.signals.types import NORMAL

Interval = tuple[float, float]

_MAX_ITERATIONS = 100
_NO_VARIANCE = 1e-12
"""Share of the spread of the values below which a stated variance counts as none."""
_SINGLE_FREEDOM = 4.0
"""Degrees of freedom of a single effect's own variance, which nothing repeats."""
_POOLED = ("K", "B", "M", "E")
"""Parameters that mean the same in each log."""
_INDEPENDENT_CAUSES = ("noise", "repetition", "blocks")
"""Causes whose errors are independent from log to log. The others are errors common to all logs of one rig and one
motion (the lag, a calibration, a force that the model lacks): no number of logs makes them smaller."""
_SAME_MEANING = {"kelvin-voigt-mass": "kelvin-voigt"}
"""Models whose parameters of one name are one quantity."""


@dataclass(frozen=True)
class Mean:
    """Mean of effects that differ.

    Args:
        value: of the mean; with covariates, of where they have their mean.
        std: its standard deviation.
        freedom: degrees of freedom of that.
        between: standard deviation of the effects themselves, their own errors left aside.
        count: of the effects.
        share: of the mean's variance that is due to the effects' differences.
        slopes: by each covariate, with its standard deviation.
    """

    value: float
    std: float
    freedom: float
    between: float
    count: int
    share: float = 0.0
    slopes: tuple[tuple[float, float], ...] = ()

    @property
    def half(self) -> float:
        """95 % half-width of the mean."""
        return student(self.freedom) * self.std

    @property
    def next_half(self) -> float | None:
        """95 % half-width of where the next effect falls; None for fewer than three and the covariates."""
        if self.freedom < 2 or self.count < 3:
            return None
        return student(self.freedom - 1) * float(np.hypot(self.between, self.std))


def random_effects(values: Array, variances: Array, covariates: Array | None = None) -> Mean:
    """Mean of effects that differ: one value of each, and the variance of its own error, shape (n,).

    Covariates of each effect have the shape (n, c) with c < n - 1; none is constant or a combination of the others.
    """
    n = len(values)
    if n == 1:
        return Mean(float(values[0]), float(np.sqrt(variances[0])), _SINGLE_FREEDOM, 0.0, 1)
    scale = float(max(np.ptp(values) ** 2, variances.max())) or 1.0
    centre = float(values.mean())
    size = float(np.sqrt(scale))
    y = (values - centre) / size
    own_variances = np.maximum(variances / scale, _NO_VARIANCE)
    offsets = np.empty((n, 0)) if covariates is None else covariates - covariates.mean(axis=0)
    spans = offsets.std(axis=0)
    design = np.column_stack([np.ones(n), offsets / spans])
    freedom = n - design.shape[1]
    between = _between_variance(y, own_variances, design)
    weight = 1 / (own_variances + between)
    theta, inverse = _least_squares(y, weight, design)
    excess = max(float(weight @ (y - design @ theta) ** 2) / freedom, 1.0)
    stds = size * np.sqrt(excess * np.diag(inverse))
    influence = design @ inverse[0] * weight  # of each effect on the mean
    between_fraction = between * float(influence @ influence) / float(inverse[0, 0])
    slopes = zip((size * theta[1:] / spans).tolist(), (stds[1:] / spans).tolist(), strict=True)
    value = centre + size * float(theta[0])
    deviation = size * float(np.sqrt(between))
    return Mean(value, float(stds[0]), float(freedom), deviation, n, between_fraction, tuple(slopes))


def _least_squares(y: Array, weight: Array, design: Array) -> tuple[Array, Array]:
    """Weighted fit, shape (p,), and the inverse of its normal matrix, shape (p, p)."""
    inverse = np.asarray(np.linalg.inv(design.T @ (weight[:, None] * design)), np.float64)
    return inverse @ (design.T @ (weight * y)), inverse


def _between_variance(y: Array, own_variances: Array, design: Array) -> float:
    """Variance between effects at which their weighted spread is what it should be: n - p (Newton from below)."""
    between = 0.0
    freedom = len(y) - design.shape[1]
    for _ in range(_MAX_ITERATIONS):
        weight = 1 / (own_variances + between)
        residual = y - design @ _least_squares(y, weight, design)[0]
        excess = float(weight @ residual**2) - freedom
        if excess <= 1e-9 * len(y):
            break
        between += excess / float(weight**2 @ residual**2)
    return between


@dataclass(frozen=True)
class PooledParameter:
    """One parameter over all logs.

    Args:
        parameter: mean, interval and verdict.
        prediction95: where the next log's own falls; None for fewer than three.
        between: standard deviation between logs, in the parameter's unit; with covariates, about the plane over them.
        logs: places of those that it is from.
        slopes: change for each unit of a covariate, by its name.
        at: values of the covariates that the mean belongs to.
    """

    parameter: Parameter
    prediction95: Interval | None
    between: float | None
    logs: tuple[int, ...]
    slopes: dict[str, Parameter] = field(default_factory=dict)
    at: dict[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        return self.parameter.to_json() | {
            "prediction95": list(self.prediction95) if self.prediction95 else None,
            "between_std": self.between,
            "logs": list(self.logs),
            "covariates": {name: {"at": self.at[name], **p.to_json()} for name, p in self.slopes.items()},
        }


@dataclass(frozen=True)
class PooledPoint:
    """The stiffness at the working point over all logs, and the range of what it belongs to.

    Args:
        stiffness: as of a parameter.
        force_N, depth_m, frequency_Hz: least and largest of the logs.
    """

    stiffness: PooledParameter
    force_N: Interval
    depth_m: Interval
    frequency_Hz: Interval

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        ranges = {name: list(getattr(self, name)) for name in ("force_N", "depth_m", "frequency_Hz")}
        return {"stiffness": self.stiffness.to_json()} | ranges


@dataclass(frozen=True, eq=False, repr=False)
class Pooled(Result):
    """Estimates pooled over many logs.

    Args:
        parameters: by name.
        working_point: None if no log has one.
        logs: that it is from; None for one that could not be read.
        names: of the logs; empty where they have none.
    """

    parameters: dict[str, PooledParameter]
    working_point: PooledPoint | None
    logs: tuple[Identification | None, ...]
    names: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of the pooled logs."""
        return len(self.logs)

    @property
    def identified(self) -> bool:
        """True if the stiffness at the working point or a parameter is identified over the logs."""
        point = [self.working_point.stiffness] if self.working_point else []
        return any(p.parameter.verdict is Verdict.IDENTIFIED for p in (*self.parameters.values(), *point))

    def to_json(self) -> dict[str, Any]:
        """The plain values under `pooled` of `palpate identify --json` for many logs."""
        return {
            "count": self.count,
            "working_point": self.working_point.to_json() if self.working_point else None,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
        }


def pool(
    logs: Sequence[Identification | None],
    tolerance: float = 0.25,
    names: Sequence[str] = (),
    covariates: Mapping[str, ArrayLike] | None = None,
) -> Pooled:
    """Pool identifications of one thing.

    Args:
        logs: one of each; None for a log that could not be read.
        tolerance: largest half-width of an identified mean's 95 % interval, as a share of its value.
        names: of the logs, by which tables and figures call them.
        covariates: by name, one number of each log, such as its temperature: the dependence on each is pooled, too.

    Raises:
        InputError: there are not as many names, or numbers of a covariate, as logs; a covariate is not finite, or does
            not vary by itself.
    """
    if names and len(names) != len(logs):
        raise InputError(f"names must be one for each of the {len(logs)} logs, got {len(names)}")
    regressors = _Covariates.of(covariates or {}, len(logs))
    pooled = {}
    for name in _POOLED:
        reported = [  # a parameter, and the model that gives it its meaning
            (
                identification.parameters[name],
                "" if name == "E" else _SAME_MEANING.get(identification.model, identification.model),
            )
            if identification is not None and name in identification.parameters
            else None
            for identification in logs
        ]
        if any(reported):
            pooled[name] = _pool(reported, tolerance, regressors)
    return Pooled(pooled, _point(logs, tolerance, regressors), tuple(logs), tuple(names))


@dataclass(frozen=True)
class _Covariates:
    """Covariates by name, and their numbers, shape (logs, covariates)."""

    names: tuple[str, ...]
    numbers: Array

    @classmethod
    def of(cls, columns: Mapping[str, ArrayLike], count: int) -> _Covariates:
        collected = cls((), np.empty((count, 0)))
        for name, values in columns.items():
            column = np.asarray(values, np.float64)
            if column.shape != (count,) or not np.isfinite(column).all():
                raise InputError(f"the covariate {name} must be a number for each of the {count} logs")
            collected = cls((*collected.names, name), np.column_stack([collected.numbers, column]))
            if not collected.vary(range(count)):
                raise InputError(
                    f"the covariate {name} is the same in all {count} logs, or a combination of others; leave it out"
                )
        return collected

    def vary(self, logs: Sequence[int]) -> bool:
        """True if these logs separate the effects of the covariates."""
        selected = self.numbers[list(logs)]
        spread = selected.std(axis=0)
        if (spread <= _NO_VARIANCE * abs(selected).max(axis=0, initial=0.0)).any():
            return False
        return int(np.linalg.matrix_rank((selected - selected.mean(axis=0)) / spread)) == len(self.names)


def _point(
    logs: Sequence[Identification | None], tolerance: float, covariates: _Covariates
) -> PooledPoint | None:
    points = [log.working_point if log else None for log in logs]
    if not any(points):
        return None
    stiffness = _pool([(point.stiffness, "") if point else None for point in points], tolerance, covariates)
    used = [p for i in stiffness.logs or range(len(points)) if (p := points[i]) is not None]
    forces, depths, frequencies = zip(*((p.force_N, p.depth_m, p.frequency_Hz) for p in used), strict=True)
    intervals = ((min(values), max(values)) for values in (forces, depths, frequencies))
    return PooledPoint(stiffness, *intervals)


def _pool(
    own: Sequence[tuple[Parameter, str] | None], tolerance: float, beside: _Covariates
) -> PooledParameter:
    """Pool the numbers of one meaning that most logs give: one unit, one model; what is rejected is left out."""
    kinds, numbers_of = {}, {}  # of a log: unit and model; value, half-widths of its own and common to all
    for i, (p, meaning) in ((i, pair) for i, pair in enumerate(own) if pair is not None):
        if p.value is not None and p.ci95 is not None and p.verdict is not Verdict.REJECTED:
            half = (p.ci95[1] - p.ci95[0]) / 2
            alike = [part for cause, part in p.budget.items() if cause not in _INDEPENDENT_CAUSES]
            common = min(float(np.hypot.reduce([0.0, *alike])), half)
            kinds[i] = p.unit, meaning
            numbers_of[i] = p.value, float(np.sqrt(half**2 - common**2)), common
    unit = next((pair[0].unit for pair in own if pair is not None), "1")
    kind = max(kinds.values(), key=[*kinds.values()].count, default=(unit, ""))
    used = {i: numbers_of[i] for i, own_kind in kinds.items() if own_kind == kind}
    least = 2 + len(beside.names)
    if len(used) < least or not beside.vary(tuple(used)):
        few = f"{len(used)} of {len(own)} logs give{'s' * (len(used) == 1)} it a number; pooling takes two or more"
        if beside.names:
            few += f", and with {', '.join(beside.names)} {least} in which each of these varies by itself"
        return PooledParameter(Parameter.unknown(kind[0], few), None, None, tuple(used))
    values, halves, shared = np.array([*used.values()]).T
    numbers = beside.numbers[list(used)]
    mean = random_effects(values, (halves / NORMAL) ** 2, numbers)
    common = float(shared.mean())
    again = None if mean.next_half is None else float(np.hypot(mean.next_half, common))
    prediction = None if again is None else (mean.value - again, mean.value + again)
    of = f"{mean.count} of {len(own)} logs{f', as of {kind[1]}' if kind[1] else ''}"
    freedom = mean.freedom * (mean.share**2 + (1 - mean.share) ** 2)  # that of both together is the mean's
    parts = {
        "between logs": Contribution(mean.std * float(np.sqrt(mean.share)), freedom),
        "each log": Contribution(mean.std * float(np.sqrt(1 - mean.share)), freedom),
        "common to all logs": Contribution.within(common),
    }
    together = _judge_pooled(Measurement(mean.value, parts), kind[0], of, tolerance)
    slopes = {}
    for name, (slope, std) in zip(beside.names, mean.slopes, strict=True):
        scaled = common * abs(slope / mean.value) if mean.value else 0.0  # such an error is of the scale
        parts = {
            "between logs": Contribution(std, mean.freedom),
            "common to all logs": Contribution.within(scaled),
        }
        slopes[name] = _judge_pooled(Measurement(slope, parts), f"{kind[0]} per {name}", of, tolerance)
    at = dict(zip(beside.names, numbers.mean(axis=0).tolist(), strict=True))
    return PooledParameter(together, prediction, mean.between, tuple(used), slopes, at)


def _judge_pooled(measurement: Measurement, unit: str, source: str, tolerance: float) -> Parameter:
    """A verdict on a pooled number; `source` names its logs."""
    relative_half = measurement.half / abs(measurement.value) if measurement.value else np.inf
    parameter = Parameter.of(measurement.value, unit, Verdict.IDENTIFIED, "", measurement.contributions)
    if relative_half >= 1:
        low = measurement.value - measurement.half
        high = measurement.value + measurement.half
        reason = f"95 %: {low:.3g} to {high:.3g}; zero is within it ({source})"
        return parameter.without_number(reason, ci95=parameter.ci95)
    verdict = Verdict.IDENTIFIED if relative_half <= tolerance else Verdict.NOT_IDENTIFIABLE
    qualifier = "" if verdict is Verdict.IDENTIFIED else " only"
    reason = f"known to {100 * relative_half:.2g} %{qualifier} (95 %), from {source}"
    return replace(parameter, verdict=verdict, reason=reason)
