"""What an identification says."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.identification.warning_codes import Warn
from palpate.signals import Estimate


class Verdict(StrEnum):
    """How far to trust a parameter."""

    IDENTIFIED = "identified"
    NOT_IDENTIFIABLE = "not identifiable"
    REJECTED = "rejected"


@dataclass(frozen=True)
class Parameter:
    """One parameter of the contact.

    Args:
        value, std: None where the log carries no number worth printing.
        ci95: 95 % interval, with the lag, coloured noise and calibration included.
        unit: in SI.
        verdict: identified, not identifiable or rejected.
        reason: why.
    """

    value: float | None
    std: float | None
    ci95: tuple[float, float] | None
    unit: str
    verdict: Verdict
    reason: str


@dataclass(frozen=True)
class Comparison:
    """How well one of the models fits the same filtered force.

    Args:
        model: what it is called.
        r2, rmse: of the fit.
        note: what speaks against it.
        held_out: rms of what it misses of the rows in contact when it is fitted to the others.
        whiteness: probability of residuals no whiter than these, were they white.
    """

    model: str
    r2: float
    rmse: float
    note: str
    held_out: float = float("nan")
    whiteness: float = float("nan")


@dataclass(frozen=True)
class Traces:
    """What the figure shows: filtered signals of the whole log, shape (n,), and the fit in contact, shape (m,).

    Args:
        time, force: of the whole log [s], [N].
        fitted_time, fitted_position, fitted_force: of the samples that were fitted [s], [m], [N].
        predicted: the force by the model [N].
        columns: by linear parameter, what one unit of it adds to the predicted force, shape (m,).
        theta: the fit's own number of each of them, also where no number is given to the user.
        beforehand: standard deviation of what was known of some of them before the log.
        matched: whether the samples are the force sensor's own, with noise as white as its; else all have passed a
            filter chain.
        position_unit, force_unit: of the log.
    """

    time: NDArray[np.float64]
    force: NDArray[np.float64]
    fitted_time: NDArray[np.float64]
    fitted_position: NDArray[np.float64]
    fitted_force: NDArray[np.float64]
    predicted: NDArray[np.float64]
    columns: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    theta: dict[str, float] = field(default_factory=dict)
    beforehand: dict[str, float] = field(default_factory=dict)
    matched: bool = False
    position_unit: str = "m"
    force_unit: str = "N"


@dataclass(frozen=True)
class Identification:
    """What was touched: the model, its parameters with verdicts, and what to know about them.

    Args:
        model: name of the contact model that the parameters belong to.
        parameters: by name.
        contacts: start and end of each contact [s], on the log's clock from its first row.
        lag: how much later the force is read than the position, and its standard deviation [s]; None if not known.
        r2, rmse, n: of the fit to the filtered force [N], and the number of samples fitted.
        warnings: what was seen on the way.
        comparison: all the models that were tried.
        cutoff: of the filter chain [Hz].
        traces: for the figure.
        estimate: the fit's own parameters with their covariance, before any verdict; offset and lag among them.
    """

    model: str
    parameters: dict[str, Parameter]
    contacts: tuple[tuple[float, float], ...]
    lag: tuple[float, float] | None
    r2: float
    rmse: float
    n: int
    warnings: tuple[Warn, ...]
    comparison: tuple[Comparison, ...] = ()
    cutoff: float = float("nan")
    traces: Traces | None = field(default=None, repr=False)
    estimate: Estimate | None = field(default=None, repr=False)

    @property
    def codes(self) -> tuple[str, ...]:
        """The stable words of the warnings."""
        return tuple(warn.code.word for warn in self.warnings)

    @property
    def found(self) -> bool:
        """Whether there is any parameter with a number."""
        return any(parameter.value is not None for parameter in self.parameters.values())

    @property
    def resonance(self) -> tuple[float, float] | None:
        """Undamped resonance [Hz] and damping ratio, if mass, damping and stiffness are all identified."""
        own = [self.parameters.get(name) for name in ("K", "B", "M")]
        if not all(p and p.verdict is Verdict.IDENTIFIED for p in own):
            return None
        k, b, m = (p.value or 0.0 for p in own if p)
        return sqrt(k / m) / (2 * pi), b / (2 * sqrt(k * m))

    def to_json(self) -> dict[str, Any]:
        """The plain values that `palpate identify --json` prints."""
        return {
            "model": self.model,
            "parameters": {
                name: {
                    "value": p.value,
                    "std": p.std,
                    "ci95": list(p.ci95) if p.ci95 else None,
                    "unit": p.unit,
                    "verdict": str(p.verdict),
                    "reason": p.reason,
                }
                for name, p in self.parameters.items()
            },
            "contacts": [{"start_s": start, "end_s": end} for start, end in self.contacts],
            "lag_s": {"value": self.lag[0], "std": self.lag[1]} if self.lag else None,
            "fit": {"r2": _plain(self.r2), "rmse_N": _plain(self.rmse), "n": self.n},
            "warnings": [{"code": warn.code.word, "text": warn.text} for warn in self.warnings],
        }


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
