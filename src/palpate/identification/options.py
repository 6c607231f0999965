"""Options of a caller about a log, checked once."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import hypot, isfinite
from typing import Any

import numpy as np

from palpate.errors import InputError, unknown
from palpate.identification.models import NAMES
from palpate.signals.low_pass import LowPass

LAG = "lag"
"""Its name among the parameters."""
USUAL_LAG = 0.005
USUAL_LAG_STD = 0.0075
"""Mean and deviation of the lag of a force sensor that nobody has calibrated [s]. Filters and transports of the
sensors and arms in `tests/oracles/foreign` take 0 to 20 ms; the prior's 95 % reach from -10 to 20 ms."""


@dataclass(frozen=True)
class Lag:
    """Prior of the delay of the force behind the position, and of the mass.

    Args:
        value, std: mean and standard deviation of the prior of the lag [s].
        known: it was calibrated, not assumed.
        mass: mean and standard deviation of the prior of the mass [kg], 0 if it is exact; None if there is none.
    """

    value: float = 0.0
    std: float = 0.0
    known: bool = True
    mass: tuple[float, float] | None = None


def lag_prior(
    lag: float | None, lag_std: float, period: float, filtered: float, mass: tuple[float, float] | None
) -> Lag:
    """The prior of the lag, as calibrated, with its standard deviation, or as sensors have it where `lag` is None [s].

    `period` is between two readings of the slower channel, `filtered` the delay of the force sensor's own low-pass, 0
    if it is not known [s]; `mass` is as in `Lag`.
    """
    if lag is not None:
        return Lag(lag, lag_std, True, mass)
    return Lag(filtered + USUAL_LAG, float(np.hypot(USUAL_LAG_STD, period / 2)), False, mass)


_EXACT_STD = 1e-3
"""Relative deviation of what is known exactly: less would only cost digits of the rest."""


def mass_std(mass: tuple[float, float]) -> float:
    """Standard deviation of the prior of the mass [kg]."""
    value, std = mass
    return max(std, _EXACT_STD * abs(value), _EXACT_STD**3)


@dataclass(frozen=True)
class Options:
    """Knowledge of a log beside its record.

    Args:
        model: kelvin-voigt, kelvin-voigt-mass, standard-linear-solid, hunt-crossley or quasi-linear-viscoelastic;
            None to choose.
        lag: how much later the force is read than the position [s], if it is calibrated.
        lag_std: standard deviation of that [s].
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        series_stiffness: of what lies between the position sensor and the surface [N/m]; it is taken out.
        series_std: standard deviation of that [N/m].
        series_mass: mass between that and the surface, which swings on it, and its standard deviation [kg].
        bonded: True if the probe is fixed to the surface, False if it is not, None to find out.
        cutoff: of the filter chain [Hz]; None to choose.
        force_filter: what the force sensor low-passes the force with before it is sampled, as `butterworth3:120`, or
            `none`. The position then goes through the same, and is read at the sensor's own samples. The lag, if it is
            given, is that of a fresh reading, this low-pass included. None if it is not known.
        mass: prior of the mass, value and standard deviation [kg]; 0 fixes it.
        force_sign: 1 if the force grows as the probe presses, -1 if it falls; None to find out.
    """

    model: str | None = None
    lag: float | None = None
    lag_std: float = 0.0
    tolerance: float = 0.25
    calibration: float = 0.0
    series_stiffness: float | None = None
    series_std: float = 0.0
    series_mass: tuple[float, float] | None = None
    bonded: bool | None = None
    cutoff: float | None = None
    force_filter: LowPass | None = None
    mass: tuple[float, float] | None = None
    force_sign: int | None = None

    @classmethod
    def of(cls, **said: Any) -> Options:
        """Check what was said; a value out of its range is an `InputError`."""
        force_filter = said.get("force_filter")
        options = cls(
            **(
                said
                | {
                    "force_filter": LowPass.parse(force_filter)
                    if isinstance(force_filter, str)
                    else force_filter
                }
            )
        )
        _check(options)
        return options

    @property
    def assumed_lag(self) -> float:
        """Delay of the force behind the position [s]: as given, else as sensors have it."""
        filter_lag = self.force_filter.lag if self.force_filter else 0.0
        return filter_lag + USUAL_LAG if self.lag is None else self.lag

    @property
    def swing(self) -> tuple[float, float]:
        """m/k of a tip that swings on what is in series, and its standard deviation [s^2]; 0 where none was told."""
        if self.series_mass is None or self.series_stiffness is None:
            return 0.0, 0.0
        (mass, mass_std), k = self.series_mass, self.series_stiffness
        return mass / k, hypot(mass_std / k, mass / k * self.series_std / k)

    def check_lag(self, duration: float) -> None:
        """Refuse a lag in other units than seconds."""
        if self.lag is not None and abs(self.lag) >= duration:
            raise InputError(
                f"the lag of {self.lag:g} s is as long as the whole log ({duration:.3g} s); give it in seconds"
            )


def _check(o: Options) -> None:
    if o.model is not None and o.model not in NAMES:
        raise unknown("model", o.model, NAMES)
    for wrong, text in (
        (o.force_sign not in (None, 1, -1), f"the force sign must be +1 or -1, got {o.force_sign}"),
        (
            o.series_mass and o.series_stiffness is None,
            "a mass in series swings on a stiffness in series: give that too",
        ),
        (not 0 < o.tolerance <= 1, f"the tolerance must be in (0, 1], got {o.tolerance:g}; 0.25 means 25 %"),
        (o.calibration >= 1, f"the calibration must be below 1, got {o.calibration:g}; 0.01 means 1 %"),
        (not isfinite(o.lag or 0.0), f"the lag must be a number of seconds, got {o.lag}"),
    ):
        if wrong:
            raise InputError(text)
    for name, mass in (("mass", o.mass), ("mass in series", o.series_mass)):
        if mass is not None and not all(isfinite(number) and number >= 0 for number in mass):
            raise InputError(f"the {name} and its std must be 0 or more, got {mass[0]:g} and {mass[1]:g}")
    deviations = {"calibration": o.calibration, "lag's std": o.lag_std, "series stiffness' std": o.series_std}
    positive = {"series stiffness": o.series_stiffness, "cut-off": o.cutoff}
    for name, value in (deviations | positive).items():
        if value is not None and not (isfinite(value) and (value > 0 or (value == 0 and name in deviations))):
            raise InputError(
                f"the {name} must be {'above 0' if name in positive else '0 or more'}, got {value:g}"
            )


DEFAULT_OPTIONS = Options()
OPTION_NAMES = tuple(own.name for own in fields(Options))
"""Names of the options."""
