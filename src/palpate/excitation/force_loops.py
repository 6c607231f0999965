"""Surfaces and robots of an excitation, and the force on each surface."""

from dataclasses import dataclass
from itertools import product
from math import pi, sqrt
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array, Complex
from palpate.errors import InputError
from palpate.signals.low_pass import LowPass

Range = tuple[float, float]


@dataclass(frozen=True)
class LinearSurface:
    """One surface: f = M a + B v + K x.

    Args:
        stiffness: K [N/m].
        damping: B [N s/m].
        mass: M [kg]; 0 for a surface without one.
    """

    stiffness: float
    damping: float
    mass: float = 0.0

    def impedance(self, omega: Array) -> NDArray[np.complexfloating[Any, Any]]:
        """Force per displacement at angular frequencies [N/m], of their shape."""
        return self.stiffness + 1j * omega * self.damping - self.mass * omega**2

    @property
    def values(self) -> tuple[float, float, float]:
        """The parameters K, B, M."""
        return self.stiffness, self.damping, self.mass


@dataclass(frozen=True)
class SurfaceRange:
    """All surfaces between the lowest and the highest of each parameter.

    Args:
        stiffness: lowest and highest K [N/m].
        damping: lowest and highest B [N s/m].
        mass: lowest and highest M [kg]; None for surfaces without one, of which no mass is asked.

    Raises:
        InputError: a range that is upside down or not above 0.
    """

    stiffness: Range
    damping: Range
    mass: Range | None = None

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping", "mass"):
            ends = getattr(self, name)
            if ends is not None and not 0 < ends[0] <= ends[1] < np.inf:
                raise InputError(
                    f"{name} must be LOW:HIGH with 0 < LOW <= HIGH, got {ends[0]:g}:{ends[1]:g}; a relative "
                    "precision needs a value above 0"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters to identify: K and B, and M if there is one."""
        return ("K", "B") if self.mass is None else ("K", "B", "M")

    def surfaces(self) -> tuple[LinearSurface, ...]:
        """The middle (of the logarithms) and the corners, each once."""
        ranges = (self.stiffness, self.damping, self.mass or (0.0, 0.0))
        corners = [LinearSurface(*corner) for corner in product(*ranges)]
        middle = LinearSurface(*(sqrt(low * high) for low, high in ranges))
        return tuple(dict.fromkeys([middle, *corners]))


BENCH_FILTERS = LowPass(((3, 120.0), (2, 120.0)))
"""Low-pass of the bench's force sensor and of its controller."""
_MAX_ROUNDS = 200
_MAX_CHANGE = 1e-4
"""Relative change of the speed in a round at which the damper for friction has converged."""
_MIN_SPEED = 1e-9
"""Smallest speed by which friction is divided [m/s]."""


class ExcitedLoop(Protocol):
    """Any robot under force control that is linear at a given speed."""

    def transfer(self, omega: Array, impedance: Complex, speed: Array) -> Complex:
        """Force on the surface per desired force, while the tip moves at an rms speed [m/s].

        Args:
            omega: angular frequencies [rad/s], shape (F,).
            impedance: of the surfaces there [N/m], shape (C, F).
            speed: shape (C, 1).

        Returns:
            Shape (C, F).
        """

    def stable(self, surface: LinearSurface) -> bool:
        """True if the loop comes to rest on a surface."""


@dataclass(frozen=True)
class HybridLoop:
    """A tip under hybrid control: the desired force fed forward, its error through a gain and an integral.

    The tip obeys m a + b v + k x + friction + f = f_d + C (f_d - G f), so f/f_d = (1 + C) / (1 + C G + R/Z) with Z the
    surface, R the tip, G the way of the measured force and C = gain + integral/s. Friction is a spring (presliding) in
    series with a slider; at an rms speed the slider is the damper sqrt(2/pi) friction/speed, which takes the same power
    (statistical linearisation, Booton, 1954).

    The defaults are the bench's arm before its wall, fitted to multisines of 0.5 to 40 Hz and 2 to 12 N on foam and
    rubber, whose forces they predict to some 10 % (at 2 N, where it mostly sticks, to 20 %).

    Args:
        tip_mass: m, effective at the tip [kg].
        damping: b, of the tip [N s/m].
        stiffness: k, of the other directions' position control against the tip's own [N/m].
        friction: dry, as felt at the tip [N].
        presliding: stiffness of the friction before it slides [N/m].
        gain: of the force error [1].
        integral: of the force error [1/s].
        low_pass: that the measured force passes before the controller.
        delay: of the measured force beyond that, half a hold included [s].
    """

    tip_mass: float = 11.5
    damping: float = 180.0
    stiffness: float = 8000.0
    friction: float = 3.7
    presliding: float = 240e3
    gain: float = 1.0
    integral: float = 3.0
    low_pass: LowPass = BENCH_FILTERS
    delay: float = 4.1e-3

    def __post_init__(self) -> None:
        for name in ("tip_mass", "damping", "stiffness", "friction", "gain", "integral", "delay"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"{name} of a force loop must be 0 or above, got {getattr(self, name)}")
        if not 0 < self.presliding < np.inf:
            raise InputError(f"presliding of a force loop must be above 0 N/m, got {self.presliding}")

    def transfer(self, omega: Array, impedance: Complex, speed: Array) -> Complex:
        """(1 + C) / (1 + C G + R/Z), shape (C, F)."""
        s = 1j * omega
        slider = sqrt(2 / pi) * self.friction / np.maximum(speed, _MIN_SPEED)
        tip = self._tip(s) + self.presliding * s * slider / (self.presliding + s * slider)
        correction = self.gain + self.integral / s
        return (1 + correction) / (1 + correction * self._measured_loop(omega) + tip / impedance)

    def stable(self, surface: LinearSurface) -> bool:
        """By Nyquist: how far 1 + L turns from slow to fast, L that of the loop without friction, whose tip is stable.

        It turns by a quarter forwards, from the integral's -90 degrees to 0, or not at all without an integral; each
        unstable pair of poles takes a whole turn away.
        """
        omega = 2 * pi * np.geomspace(1e-3, 1e4, 20_000)
        s, Z = 1j * omega, surface.impedance(omega)
        loop = (self.gain + self.integral / s) * self._measured_loop(omega) * Z / (Z + self._tip(s))
        angle = np.unwrap(np.angle(1 + loop))
        return bool(angle[-1] - angle[0] > -pi)

    def _tip(self, s: Complex) -> Complex:
        return np.polyval([self.tip_mass, self.damping, self.stiffness], s)

    def _measured_loop(self, omega: Array) -> Complex:
        late: Complex = np.exp(-1j * omega * self.delay)
        return self.low_pass.at(omega) * late


@dataclass(frozen=True)
class KnownBandwidth:
    """A robot with a known bandwidth of its force control, the same on any surface.

    Args:
        bandwidth: where the force has fallen to 0.71 of the desired one [Hz]; a second-order Butterworth.
    """

    bandwidth: float

    def __post_init__(self) -> None:
        if not 0 < self.bandwidth < np.inf:
            raise InputError(f"bandwidth of a force loop must be above 0 Hz, got {self.bandwidth}")

    def transfer(self, omega: Array, impedance: Complex, speed: Array) -> Complex:
        """The same low-pass on every surface, shape (C, F)."""
        gain = LowPass(((2, self.bandwidth),)).at(omega)
        return np.broadcast_to(gain, impedance.shape)

    def stable(self, surface: LinearSurface) -> bool:
        """Always True: a robot with a bandwidth is stable."""
        return True


def contact_force(loop: ExcitedLoop, omega: Array, impedance: Complex, amplitudes: Array) -> Complex:
    """Phasors of the force on each surface under a multisine of given amplitudes [N], shape (C, F).

    Args:
        loop: the robot.
        omega: angular frequencies [rad/s], shape (F,).
        impedance: of the surfaces [N/m], shape (C, F).
        amplitudes: of the desired force [N], shape (F,).
    """
    speed = np.full((len(impedance), 1), 1e-2)
    for _ in range(_MAX_ROUNDS):
        force = loop.transfer(omega, impedance, speed) * amplitudes
        power = np.abs(omega * force / impedance) ** 2 / 2
        new = np.sqrt(power.sum(axis=1, keepdims=True))
        change = np.abs(new - speed).max() / max(float(new.max()), _MIN_SPEED)
        speed = 0.5 * (speed + new)
        if change < _MAX_CHANGE:
            break
    return force
