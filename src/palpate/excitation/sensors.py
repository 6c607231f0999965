"""Information of the sensors about the surface, per second and frequency of a motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.excitation.fisher_information import ForceChain, phase_std
from palpate.excitation.surfaces import Surface

Complex = NDArray[np.complexfloating[Any, Any]]

LAG_UNIT = 1e-4
"""The lag is counted in tenths of a millisecond, so that it is of the size of the relative parameters."""
_SURE = 1e-8  # s; a lag known better is known as well as exactly


def bench_chain() -> ForceChain:
    """The force sensor of the bench, logged at 1 kHz."""
    return ForceChain(phase_std=phase_std(480, 1000))


@dataclass(frozen=True)
class Sensors:
    """Sensors of force and position, and their log.

    Args:
        force: the force sensor's chain.
        position_step: of the position's quantisation [m].
        rate: positions a second [Hz].
        lag_std: how well the lag between force and position is calibrated [s].
    """

    force: ForceChain = field(default_factory=bench_chain)
    position_step: float = 1.6e-6
    rate: float = 1000.0
    lag_std: float = 0.0

    def __post_init__(self) -> None:
        for name, low in (("position_step", 0.0), ("lag_std", 0.0), ("rate", 1e-9)):
            if not low <= getattr(self, name) < np.inf:
                raise InputError(f"{name} of the sensors must be {low:g} or above, got {getattr(self, name)}")

    def information(
        self, surface: Surface, omega: Array, force: Complex, rounding: Array | float | None = None
    ) -> Array:
        """Fisher information about (ln K, ln B, ln M, lag) of a second at each frequency, shape (F, 4, 4).

        Noise of the position acts like a force of |Z H| times its size. The offset is known from the mean alone, and
        the mean says nothing else as long as the touch is not known exactly.

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            force: phasors of the force on the surface [N], shape (F,).
            rounding: power of the position's error at them [m^2/Hz], shape (F,); None for white noise of step^2/12.
        """
        Z = surface.impedance(omega)
        density = self.density(surface, omega, rounding)
        return self.moments(surface, omega, force / Z) / density[:, None, None]

    def density(self, surface: Surface, omega: Array, rounding: Array | float | None = None) -> Array:
        """Noise of both sensors as a force, as `information` has it, shape (F,) [N^2/Hz], of both signs."""
        if rounding is None:
            rounding = self.position_step**2 / (12 * self.rate)
        gain = np.abs(surface.impedance(omega) * self.force.low_pass.at(omega)) ** 2
        return np.asarray(self.force.noise**2 / self.force.sampling + gain * rounding)

    def columns(self, surface: Surface, omega: Array, motion: Complex) -> Complex:
        """The regressors of (ln K, ln B, ln M, lag) under a motion, phasors of shape (F, 4) [N].

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            motion: phasors of the position [m], shape (F,).
        """
        s, Z = 1j * omega, surface.impedance(omega)
        K, B, M = surface.values
        columns = np.stack([K + 0 * s, B * s, M * s**2, -s * Z * LAG_UNIT], axis=-1)
        return np.asarray(columns * (self.force.low_pass.at(omega) * motion)[:, None])

    def moments(self, surface: Surface, omega: Array, motion: Complex) -> Array:
        """Mean products of the regressors under a motion, shape (F, 4, 4) [N^2]; see `columns`."""
        columns = self.columns(surface, omega, motion)
        found: Array = np.real(columns[:, :, None] * np.conj(columns[:, None, :])) / 2
        return found

    def prior(self) -> Array:
        """Information about the same four before anything has moved: that of the lag, shape (4, 4)."""
        known = np.zeros((4, 4))
        known[3, 3] = (LAG_UNIT / max(self.lag_error, _SURE)) ** 2
        return known

    @property
    def lag_error(self) -> float:
        """Uncertainty of the lag, the phase of the samples included: a standard deviation [s]."""
        return hypot(self.lag_std, self.force.phase_std)
