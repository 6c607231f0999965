"""Problem of an excitation: surfaces, budget, precision, sensors and force loop."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.errors import InputError, unknown
from palpate.excitation.force_loops import (
    ExcitedLoop,
    HybridLoop,
    LinearSurface,
    SurfaceRange,
    contact_force,
)
from palpate.excitation.power_spectrum import covariance
from palpate.excitation.sensors import Sensors
from palpate.signals.octaves import MIN_MOTION

PARAMETERS = ("K", "B", "M")


@dataclass(frozen=True)
class Budget:
    """Limits of the desired force, and of the force on the surface.

    Args:
        mean: of the force [N].
        peak: highest force [N].
        least: lowest force, so that contact is kept [N].
        lowest, highest: frequencies in use [Hz].
        rate: fastest change of the desired force [N/s].
        drive: largest departure of the desired force from its mean [N]; that of the force on the surface when None. A
            slow loop lets little of the desired force through, so more may be commanded than arrives.

    Raises:
        InputError: contradictory limits.
    """

    mean: float
    peak: float
    least: float = 2.0
    lowest: float = 0.5
    highest: float = 40.0
    rate: float = inf
    drive: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.least < self.mean < self.peak < inf:
            raise InputError(
                f"the force must obey 0 <= least < mean < peak, got least {self.least:g} N, mean {self.mean:g} N, "
                f"peak {self.peak:g} N"
            )
        if not 0 < self.lowest < self.highest < inf:
            raise InputError(
                f"the frequencies must obey 0 < lowest < highest, got {self.lowest:g} and {self.highest:g} Hz"
            )
        if self.drive is not None and not 0 < self.drive < inf:
            raise InputError(
                f"the desired force must depart from its mean by more than 0 N, got {self.drive:g}"
            )
        if not self.rate > 0:
            raise InputError(f"the force's rate of change must be above 0 N/s, got {self.rate:g}")

    @property
    def swing(self) -> float:
        """Largest departure of the force on the surface from its mean [N]."""
        return min(self.peak - self.mean, self.mean - self.least)

    @property
    def desired_swing(self) -> float:
        """Largest departure of the desired force from its mean [N]."""
        return self.swing if self.drive is None else self.drive


_MIN_PRECISION = 1e-6
"""Finest precision, as a fraction: no force sensor is calibrated to it."""
LONGEST = 3600.0
"""Longest excitation [s]; nobody presses longer."""


@dataclass(frozen=True)
class DesignProblem:
    """An excitation for a range of surfaces, by a robot with its sensors, within a budget, to a precision.

    Args:
        surfaces: range of the surfaces.
        budget: limits of force and frequency.
        precision: largest 95 % half-width of each parameter, as a fraction of its value; an omitted parameter is
            estimated without a limit.
        sensors: of force and position.
        loop: the robot.
        duration: of the excitation [s]; the shortest sufficient one when None.
        longest: longest duration that is tried [s].
        settle: time before the part that counts [s], in which the wave is eased in and the touch is forgotten.

    Raises:
        InputError: numbers out of range, or a precision of a parameter that the surfaces lack.
    """

    surfaces: SurfaceRange
    budget: Budget
    precision: Mapping[str, float]
    sensors: Sensors = field(default_factory=Sensors)
    loop: ExcitedLoop = field(default_factory=HybridLoop)
    duration: float | None = None
    longest: float = 60.0
    settle: float = 1.0

    def __post_init__(self) -> None:
        for name, low in (("duration", 0.0), ("longest", 0.0), ("settle", -1e-9)):
            value = getattr(self, name)
            if value is not None and not low < value <= LONGEST:
                raise InputError(f"{name} must be above 0 and at most {LONGEST:g} s, got {value:g}")
        self._check_precision()
        self._check_robot()

    def _check_precision(self) -> None:
        if not self.precision:
            raise InputError(f"give the precision of at least one of {', '.join(self.surfaces.names)}")
        for name, target in self.precision.items():
            if name not in self.surfaces.names:
                raise unknown("parameter", name, self.surfaces.names)
            if not _MIN_PRECISION <= target < 1:
                raise InputError(
                    f"the precision of {name} must be between {100 * _MIN_PRECISION:g} and 100 %,"
                    f" got {100 * target:g} %"
                )

    def _check_robot(self) -> None:
        half = self.sensors.force.sampling / 2
        if self.budget.highest >= half:
            raise InputError(
                f"the highest frequency must be below half the force sensor's sampling, {half:g} Hz, "
                f"got {self.budget.highest:g}"
            )
        for surface in self.surfaces.surfaces():
            if not self.loop.stable(surface):
                raise InputError(
                    f"the robot's force loop is not stable on a surface of {surface.stiffness:g} N/m, "
                    f"{surface.damping:g} N s/m and {surface.mass:g} kg; lower its gain"
                )

    @property
    def free(self) -> NDArray[np.intp]:
        """Indices of the estimated ones of ln K, ln B, ln M and the lag, shape (n,)."""
        return np.array([PARAMETERS.index(name) for name in self.surfaces.names] + [len(PARAMETERS)])

    @property
    def targets(self) -> Array:
        """Wanted half-widths in the order of `free`, infinite where none is, shape (n,)."""
        return np.array([*(self.precision.get(name, np.inf) for name in self.surfaces.names), np.inf])

    @property
    def prior(self) -> Array:
        """Information about `free` before any motion, shape (n, n)."""
        return self.sensors.prior()[np.ix_(self.free, self.free)]

    def forces(self, omega: Array, amplitudes: Array) -> Complex:
        """Phasors of the force on each surface, shape (C, F), under a desired force of amplitudes, shape (F,) [N]."""
        Z = np.stack([surface.impedance(omega) for surface in self.surfaces.surfaces()])
        return contact_force(self.loop, omega, Z, amplitudes)

    def information(self, omega: Array, forces: Complex) -> Array:
        """Information about `free` of a second at each frequency, shape (C, F, n, n)."""
        pairs = zip(self.surfaces.surfaces(), forces, strict=True)
        all_four = np.stack([self.sensors.information(surface, omega, force) for surface, force in pairs])
        return all_four[:, :, self.free[:, None], self.free]

    def information_with_rounding(
        self, surface: LinearSurface, omega: Array, force: Complex, rounding: Complex, seconds: float
    ) -> tuple[Array, Array, Array]:
        """Information of a second about `free`, and the errors of `free` by rounding of the position.

        The rounding of a repeated motion repeats, so that its errors stay however long the motion lasts: one for each
        offset of the encoder. Octaves in which the rounding drowns the motion do not count, as in an identification.
        The products of the rounding with itself pull each estimate towards zero.

        Args:
            surface: the touched surface.
            omega: angular frequencies [rad/s], shape (F,).
            force: phasors on the surface [N], shape (F,).
            rounding: phasors of the position's error [m], shape (offsets, F).
            seconds: duration of the motion.

        Returns:
            Information, shape (n, n); covariance by rounding, shape (n, n); fraction by which each estimate is pulled
            towards zero, shape (n,).
        """
        sensors, free = self.sensors, self.free
        motion = force / surface.impedance(omega)
        mean_power = np.mean(np.abs(rounding) ** 2, axis=0)
        power = _smooth_over_octave(mean_power, omega)
        drowned = _smooth_over_octave(np.abs(motion) ** 2, omega) < MIN_MOTION * power
        density = np.where(drowned, np.inf, sensors.noise_density(surface, omega, power * seconds / 4))
        columns = sensors.regressors(surface, omega, motion)[:, free]
        A = np.real(np.einsum("fi,fj->fij", columns, np.conj(columns))) / 2
        weighted = (A / density[:, None, None]).sum(axis=0)
        force_noise = sensors.noise_density(surface, omega, 0.0)
        by_force_noise = (A * (force_noise / density**2)[:, None, None]).sum(axis=0)
        C = covariance(weighted, self.prior / seconds)
        rounding_force = rounding * surface.impedance(omega) * sensors.force.low_pass.at(omega)
        errors = np.real(np.einsum("fi,pf->pi", np.conj(columns) / density[:, None], rounding_force)) / 2 @ C
        noise_products = sensors.regressor_products(surface, omega, np.sqrt(mean_power) + 0j)
        noise_products = (noise_products[:, free[:, None], free] / density[:, None, None]).sum(axis=0)
        pull = C[:, :-1] @ noise_products[:-1, :-1].sum(axis=1)
        information = weighted @ np.linalg.pinv(by_force_noise, hermitian=True) @ weighted
        return information, errors.T @ errors / len(errors), pull


def _smooth_over_octave(power: Array, omega: Array) -> Array:
    """Mean of a power within half an octave to either side, shape (F,)."""
    near = np.abs(np.log2(omega[:, None] / omega)) < 0.5
    return np.asarray((near * power).sum(axis=1) / near.sum(axis=1))
