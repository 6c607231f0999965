"""Sensors of force and position, and the Fisher information of their readings at each frequency of a motion."""

from dataclasses import dataclass, field
from math import gcd, hypot, sqrt

import numpy as np

from palpate.arrays import Array, Complex
from palpate.errors import InputError
from palpate.excitation.force_loops import LinearSurface
from palpate.signals.low_pass import LowPass

LAG_UNIT = 1e-4
"""Unit of the lag [s], by which it is of the size of the relative parameters."""
_MIN_LAG_ERROR = 1e-8
"""Standard deviation [s] below which a lag counts as known exactly."""
THESIS_FILTER = LowPass(((3, 120.0),))
"""Low-pass of the thesis' force sensor (sec. 3.4)."""


@dataclass(frozen=True)
class ForceChain:
    """Force sensor, from the force to the readings.

    Args:
        low_pass: before the sampling.
        sampling: independent samples per second [Hz].
        noise: standard deviation of a sample [N].
        phase_std: standard deviation of the sampling instants, which a log does not show [s]; see `phase_std`.

    Raises:
        InputError: a number out of range.
    """

    low_pass: LowPass = THESIS_FILTER
    sampling: float = 480.0
    noise: float = 0.6
    phase_std: float = 0.0

    def __post_init__(self) -> None:
        for name in ("sampling", "noise"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} of a force chain must be above 0, got {getattr(self, name)}")
        if not self.phase_std >= 0:
            raise InputError(f"phase_std must be at least 0 s, got {self.phase_std}")


def phase_std(sampling: int, rate: int) -> float:
    """Standard deviation of the sampling instants, given the pattern of new rows in a log [s].

    Samples at `sampling` Hz, logged at `rate` Hz, lie on the instants of a grid of gcd/(sampling rate) between the
    rows; anywhere within one such step the log looks the same. For 480 Hz in 1 kHz the step is 1/12 ms, and the
    standard deviation 24 us.
    """
    return gcd(sampling, rate) / (sampling * rate) / sqrt(12)


def bench_chain() -> ForceChain:
    """The force sensor of the bench, logged at 1 kHz."""
    return ForceChain(phase_std=phase_std(480, 1000))


@dataclass(frozen=True)
class Sensors:
    """Sensors of force and position, and their log.

    Args:
        force: the force sensor.
        position_step: quantisation of the position [m].
        rate: positions per second [Hz].
        lag_std: standard deviation of the calibrated lag between force and position [s].

    Raises:
        InputError: a number out of range.
    """

    force: ForceChain = field(default_factory=bench_chain)
    position_step: float = 1.6e-6
    rate: float = 1000.0
    lag_std: float = 0.0

    def __post_init__(self) -> None:
        for name, low in (("position_step", 0.0), ("lag_std", 0.0), ("rate", 1e-9)):
            if not low <= getattr(self, name) < np.inf:
                raise InputError(f"{name} of the sensors must be {low:g} or above, got {getattr(self, name)}")

    @property
    def lag_error(self) -> float:
        """Standard deviation of the lag, the phase of the samples included [s]."""
        return hypot(self.lag_std, self.force.phase_std)

    def prior(self) -> Array:
        """Information about (ln K, ln B, ln M, lag) before any motion: that of the lag, shape (4, 4)."""
        information = np.zeros((4, 4))
        information[3, 3] = (LAG_UNIT / max(self.lag_error, _MIN_LAG_ERROR)) ** 2
        return information

    def information(self, surface: LinearSurface, omega: Array, force: Complex) -> Array:
        """Fisher information about (ln K, ln B, ln M, lag) of a second at each frequency, shape (F, 4, 4).

        Quantisation of the position counts as white noise. The mean force only tells the offset, as the position of
        the touch is not known exactly.

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            force: phasors of the force on the surface [N], shape (F,).
        """
        density = self.noise_density(surface, omega, self.position_step**2 / (12 * self.rate))
        motion = force / surface.impedance(omega)
        return self.regressor_products(surface, omega, motion) / density[:, None, None]

    def noise_density(self, surface: LinearSurface, omega: Array, position_noise: Array | float) -> Array:
        """Noise of both sensors as a force, for frequencies of both signs, shape (F,) [N^2/Hz].

        Noise of the position acts like a force of |Z H| times its size.

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            position_noise: spectral density of the position's error [m^2/Hz], shape (F,) or a number.
        """
        gain = np.abs(surface.impedance(omega) * self.force.low_pass.at(omega)) ** 2
        return np.asarray(self.force.noise**2 / self.force.sampling + gain * position_noise)

    def regressors(self, surface: LinearSurface, omega: Array, motion: Complex) -> Complex:
        """Derivatives of the filtered force by (ln K, ln B, ln M, lag), phasors of shape (F, 4) [N].

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            motion: phasors of the position [m], shape (F,).
        """
        s, Z = 1j * omega, surface.impedance(omega)
        K, B, M = surface.values
        columns = np.stack([K + 0 * s, B * s, M * s**2, -s * Z * LAG_UNIT], axis=-1)
        return np.asarray(columns * (self.force.low_pass.at(omega) * motion)[:, None])

    def regressor_products(self, surface: LinearSurface, omega: Array, motion: Complex) -> Array:
        """Mean products of the regressors at each frequency, shape (F, 4, 4) [N^2]; arguments as of `regressors`."""
        columns = self.regressors(surface, omega, motion)
        products: Array = np.real(columns[:, :, None] * np.conj(columns[:, None, :])) / 2
        return products
