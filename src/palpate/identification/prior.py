"""Priors of a contact: the lag of the force, and perhaps the mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array

LAG = "lag"
"""Its name among the parameters."""
USUAL_LAG = 0.005
USUAL_LAG_STD = 0.0075
"""Mean and deviation of the lag of a force sensor that nobody has calibrated [s]. Filters and transports of the
sensors and arms in `benchmarks/identification/foreign` take 0 to 20 ms; the prior's 95 % reach from -10 to 20 ms."""


@dataclass(frozen=True)
class Lag:
    """How much later the force is read than the position, and what is known of the mass.

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
    """The prior of the lag.

    Args:
        lag: as calibrated [s]; None if it is not.
        lag_std: standard deviation of that [s].
        period: between two readings of the slower channel [s].
        filtered: delay of the force sensor's own low-pass [s], 0 if it is not known.
        mass: as in `Lag`.
    """
    if lag is not None:
        return Lag(lag, lag_std, True, mass)
    return Lag(filtered + USUAL_LAG, float(np.hypot(USUAL_LAG_STD, period / 2)), False, mass)


@dataclass(frozen=True)
class Prior:
    """Knowledge from before as observations beside the log's: value and weight (the noise over its deviation)."""

    known: dict[str, tuple[float, float]]

    def rows(self, names: tuple[str, ...]) -> tuple[Array, Array]:
        """The regression's rows and targets for parameters of these names, shapes (r, p) and (r,)."""
        own = [name for name in names if name in self.known]
        matrix = np.zeros((len(own), len(names)))
        for i, name in enumerate(own):
            matrix[i, names.index(name)] = self.known[name][1]
        return matrix, np.array([value * weight for value, weight in (self.known[name] for name in own)])

    def std(self, names: tuple[str, ...], noise: float) -> Array | None:
        """Standard deviation of each parameter, infinite where nothing is known; None if nothing is at all."""
        if not any(name in self.known for name in names):
            return None
        return np.array([noise / self.known[name][1] if name in self.known else np.inf for name in names])


NOTHING = Prior({})
_EXACT = 1e-3
"""Relative deviation of what is known exactly: less would only cost digits of the rest."""


def mass_std(mass: tuple[float, float]) -> float:
    """Standard deviation of the prior of the mass [kg]."""
    value, std = mass
    return max(std, _EXACT * abs(value), _EXACT**3)


def prior_of(lag: Lag, noise: float, free_lag: bool) -> Prior:
    """The prior of the mass, and of the lag where the log estimates it, against noise of this deviation [N]."""
    known = {}
    if lag.mass is not None:
        known["M"] = (lag.mass[0], noise / mass_std(lag.mass))
    if free_lag and lag.std > 0:
        known[LAG] = (lag.value, noise / lag.std)
    return Prior(known)
