"""Problem of an excitation: goals, surfaces, limits, sensors and loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.excitation.budget import Budget
from palpate.excitation.force_loops import ForceLoop, HybridLoop, contact_force
from palpate.excitation.prediction import ALL
from palpate.excitation.sensors import Sensors
from palpate.excitation.spectra import CRITERIA, covariance
from palpate.excitation.surfaces import Surface, SurfaceRange
from palpate.identifiers.octave_system import SEEN

Complex = NDArray[np.complexfloating[Any, Any]]

KINDS = ("multisine", "chirp")
_FINEST = 1e-6
"""Finest precision, as a share: no force sensor is calibrated to it."""
LONGEST = 3600.0
"""Of an excitation [s]; nobody presses longer."""


@dataclass(frozen=True)
class Problem:
    """An excitation for a range of surfaces, by a robot with its sensors, within a budget, to a precision.

    Args:
        surfaces: that it shall serve, every one.
        budget: of force and frequency.
        precision: largest 95 % half-width of each parameter, as a share of its value; an omitted one is estimated
            but may come out as it likes.
        sensors: that watch.
        loop: the robot.
        kind: `multisine` or `chirp`.
        criterion: of `spectra.optimal`, for a multisine.
        duration: of the excitation [s]; the shortest that suffices when None.
        longest: that one may be [s].
        settle: of a multisine before the part that counts [s], while the touch is forgotten.

    Raises:
        InputError: numbers out of range, or a precision for a parameter that the surfaces have not.
    """

    surfaces: SurfaceRange
    budget: Budget
    precision: Mapping[str, float]
    sensors: Sensors = field(default_factory=Sensors)
    loop: ForceLoop = field(default_factory=HybridLoop)
    kind: str = "multisine"
    criterion: str = "worst"
    duration: float | None = None
    longest: float = 60.0
    settle: float = 1.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown("excitation", self.kind, KINDS)
        if self.criterion not in CRITERIA:
            raise unknown("criterion", self.criterion, CRITERIA)
        for name, low in (("duration", 0.0), ("longest", 0.0), ("settle", -1e-9)):
            value = getattr(self, name)
            if value is not None and not low < value <= LONGEST:
                raise InputError(f"{name} must be above 0 and at most {LONGEST:g} s, got {value:g}")
        self._check_precision()
        self._check_robot()

    def _check_precision(self) -> None:
        if not self.precision:
            raise InputError(f"give the precision of at least one of {', '.join(self.surfaces.names)}")
        for name, asked in self.precision.items():
            if name not in self.surfaces.names:
                raise unknown("parameter", name, self.surfaces.names)
            if not _FINEST <= asked < 1:
                raise InputError(
                    f"the precision of {name} must be between {100 * _FINEST:g} and 100 %, got {100 * asked:g} %"
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
        """Which of ln K, ln B, ln M and the lag are estimated."""
        return np.array([ALL.index(name) for name in self.surfaces.names] + [len(ALL)])

    @property
    def wanted(self) -> Array:
        """The half-widths asked for in the order of `free`, infinite where nothing is asked."""
        return np.array([*(self.precision.get(name, np.inf) for name in self.surfaces.names), np.inf])

    @property
    def prior(self) -> Array:
        """Information about `free` before anything has moved."""
        return self.sensors.prior()[np.ix_(self.free, self.free)]

    def forces(self, omega: Array, amplitudes: Array) -> Complex:
        """Phasors of the force on each surface, shape (C, F), under a desired force of amplitudes, shape (F,) [N]."""
        Z = np.stack([surface.impedance(omega) for surface in self.surfaces.surfaces()])
        return contact_force(self.loop, omega, Z, amplitudes, together=self.kind == "multisine")

    def information(self, omega: Array, forces: Complex) -> Array:
        """About `free`, of a second of each frequency, shape (C, F, n, n)."""
        pairs = zip(self.surfaces.surfaces(), forces, strict=True)
        found = np.stack([self.sensors.information(surface, omega, force) for surface, force in pairs])
        return found[:, :, self.free[:, None], self.free]

    def predicted(
        self, surface: Surface, omega: Array, force: Complex, error: Complex, seconds: float, together: bool
    ) -> tuple[Array, Array, Array]:
        """Information of a second about `free`, and the errors of `free` by rounding.

        The rounding of a repeated motion repeats itself, so that its errors stay however long it lasts: for each place
        of the encoder one. Octaves in which it drowns the motion do not count, as in an identification. Beside them
        the products of the error with itself pull each estimate towards zero.

        Args:
            surface: which.
            omega: angular frequencies [rad/s], shape (F,).
            force: phasors on the surface [N], shape (F,).
            error: phasors of the rounding there [m], shape (places, F).
            seconds: that the motion lasts.
            together: all frequencies at once; otherwise one after the other, each for an equal time.

        Returns:
            Information, shape (n, n); covariance by rounding, shape (n, n); share of each that the estimate is pulled
            by, shape (n,).
        """
        share = 1.0 if together else 1.0 / len(omega)
        motion = force / surface.impedance(omega)
        power = _smooth(np.mean(np.abs(error) ** 2, axis=0), omega)
        density = self.sensors.density(surface, omega, power * (seconds * share) / 4)
        density = np.where(_smooth(np.abs(motion) ** 2, omega) >= SEEN * power, density, np.inf)
        columns = self.sensors.columns(surface, omega, motion)[:, self.free]
        A = np.real(np.einsum("fi,fj->fij", columns, np.conj(columns))) / 2 * share
        whole = (A / density[:, None, None]).sum(axis=0)
        own = (A * (self.sensors.density(surface, omega, 0.0) / density**2)[:, None, None]).sum(axis=0)
        C = covariance(whole, self.prior / seconds)
        felt = error * surface.impedance(omega) * self.sensors.force.low_pass.at(omega)
        moved = np.real(np.einsum("fi,pf->pi", np.conj(columns) / density[:, None], felt)) / 2 * share @ C
        noisy = self.sensors.moments(surface, omega, np.sqrt(np.mean(np.abs(error) ** 2, axis=0)) + 0j)
        noisy = (noisy[:, self.free[:, None], self.free] / density[:, None, None]).sum(axis=0) * share
        pull = C[:, :-1] @ noisy[:-1, :-1].sum(axis=1)
        return whole @ np.linalg.pinv(own, hermitian=True) @ whole, moved.T @ moved / len(moved), pull


def _smooth(power: Array, omega: Array) -> Array:
    """The mean of a power within half an octave to either side, shape (F,)."""
    near = np.abs(np.log2(omega[:, None] / omega)) < 0.5
    return np.asarray((near * power).sum(axis=1) / near.sum(axis=1))
