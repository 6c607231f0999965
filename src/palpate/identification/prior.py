"""What is known of a contact before its log is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LAG = "lag"
"""Its name among the parameters."""


@dataclass(frozen=True)
class Lag:
    """What is known beforehand: how much later the force is read than the position, and perhaps the mass.

    Args:
        value: [s]; where the fit starts if it is not known.
        std: its standard deviation [s]; of a lag that is not known: how large it may be.
        known: calibrated beforehand, so that the log is not asked; where the force sensor's own way is known, the log
            may still mend it within its deviation.
        mass: value and standard deviation of the mass [kg], 0 if it is exact; None if nothing is known of it.
    """

    value: float = 0.0
    std: float = 0.0
    known: bool = True
    mass: tuple[float, float] | None = None


@dataclass(frozen=True)
class Beforehand:
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


NOTHING = Beforehand({})
_EXACT = 1e-3
"""Relative deviation of what is known exactly: less would only cost digits of the rest."""


def beforehand(lag: Lag, noise: float, free_lag: bool) -> Beforehand:
    """What is known of the mass, and of the lag where the log is asked for it, against noise of this deviation [N]."""
    known = {}
    if lag.mass is not None:
        value, std = lag.mass
        known["M"] = (value, noise / max(std, _EXACT * abs(value), _EXACT**3))
    if free_lag and lag.std > 0:
        known[LAG] = (lag.value, noise / lag.std)
    return Beforehand(known)
