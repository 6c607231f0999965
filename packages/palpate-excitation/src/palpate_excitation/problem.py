"""Problem of an excitation: goals, surfaces, limits, loop, and the information of the sensors by frequency."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.errors import InputError, unknown
from palpate.identifiers.octave_system import SEEN
from palpate_excitation.force_loops import (
    ALL,
    ExcitedLoop,
    HybridLoop,
    LinearSurface,
    SurfaceRange,
    contact_force,
)
from palpate_excitation.spectra import CRITERIA, ForceChain, covariance, phase_std

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
        self, surface: LinearSurface, omega: Array, force: Complex, rounding: Array | float | None = None
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

    def density(self, surface: LinearSurface, omega: Array, rounding: Array | float | None = None) -> Array:
        """Noise of both sensors as a force, as `information` has it, shape (F,) [N^2/Hz], of both signs."""
        if rounding is None:
            rounding = self.position_step**2 / (12 * self.rate)
        gain = np.abs(surface.impedance(omega) * self.force.low_pass.at(omega)) ** 2
        return np.asarray(self.force.noise**2 / self.force.sampling + gain * rounding)

    def columns(self, surface: LinearSurface, omega: Array, motion: Complex) -> Complex:
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

    def moments(self, surface: LinearSurface, omega: Array, motion: Complex) -> Array:
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


_ROUNDS = 40
_CAUTION = 0.7  # the power of each correction: a whole one would overshoot where friction gives way
_CLOSE = 1e-3
"""To the budget, as a share of it."""


@dataclass(frozen=True)
class Budget:
    """Limits of the desired force, and of the force that the surface will feel.

    Args:
        mean: about which the force varies [N].
        peak: highest force [N].
        least: lowest force, so that contact is kept [N].
        lowest, highest: frequencies in use [Hz].
        rate: fastest change of the desired force [N/s].
        drive: largest departure of the desired force from its mean [N]; as for the force on the surface when None.
            A loop that is slow lets little of the desired force through, so more may be asked for than shall arrive.

    Raises:
        InputError: limits that leave nothing.
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
        """How far the force on the surface may depart from its mean [N]."""
        return min(self.peak - self.mean, self.mean - self.least)

    @property
    def desired_swing(self) -> float:
        """How far the desired force may depart from its mean [N]."""
        return self.swing if self.drive is None else self.drive

    def share(self, peak: float, slope: float) -> float:
        """Factor of a desired force that uses up its budget.

        Args:
            peak: how far it departs from its mean [N].
            slope: its fastest change [N/s].
        """
        return min(self.desired_swing / peak, self.rate / slope)


def used_up(share: Callable[[float], float], strength: float) -> float:
    """The strength at which an excitation uses up its budget.

    Args:
        share: of the budget over what a strength takes of it; friction makes that grow faster than the strength.
        strength: to start from.
    """
    for _ in range(_ROUNDS):
        left = share(strength)
        strength *= left**_CAUTION
        if abs(left - 1) < _CLOSE:
            break
    return strength


KINDS = ("multisine", "chirp")
_FINEST = 1e-6
"""Finest precision, as a share: no force sensor is calibrated to it."""
LONGEST = 3600.0
"""Of an excitation [s]; nobody presses longer."""


@dataclass(frozen=True)
class DesignProblem:
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
    loop: ExcitedLoop = field(default_factory=HybridLoop)
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
    def target_halves(self) -> Array:
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

    def information_with_errors(
        self,
        surface: LinearSurface,
        omega: Array,
        force: Complex,
        error: Complex,
        seconds: float,
        together: bool,
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
