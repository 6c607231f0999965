"""Robots as an excitation sees them: how much of the desired force the surface feels, and when."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.excitation.surfaces import Surface
from palpate.signals.low_pass import LowPass

Complex = NDArray[np.complexfloating[Any, Any]]

BENCH_FILTERS = LowPass(((3, 120.0), (2, 120.0)))
"""Of the bench's sensor, and of its controller."""
_ROUNDS = 200
_SETTLED = 1e-4
"""Change of a round, as a share, at which friction's describing function has been found; and rounds at most."""
_STILL = 1e-9  # m/s; friction is never divided by less


class ForceLoop(Protocol):
    """Any robot under force control that is linear at a given speed."""

    def transfer(self, omega: Array, impedance: Complex, speed: Array) -> Complex:
        """Force on the surface per desired force, while the tip moves at an rms speed [m/s].

        Args:
            omega: angular frequencies [rad/s], shape (F,).
            impedance: of the surfaces there [N/m], shape (C, F).
            speed: shape (C, F) or (C, 1).

        Returns:
            Shape (C, F).
        """

    def stable(self, surface: Surface) -> bool:
        """Whether the loop comes to rest on a surface."""


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
        slider = sqrt(2 / pi) * self.friction / np.maximum(speed, _STILL)
        tip = self._tip(s) + self.presliding * s * slider / (self.presliding + s * slider)
        correction = self.gain + self.integral / s
        return (1 + correction) / (1 + correction * self._measured(omega) + tip / impedance)

    def stable(self, surface: Surface) -> bool:
        """By Nyquist: how far 1 + L turns from slow to fast, L that of the loop without friction, whose tip is stable.

        It turns by a quarter forwards, from the integral's -90 degrees to 0, or not at all without an integral; each
        unstable pair of poles takes a whole turn away.
        """
        omega = 2 * pi * np.geomspace(1e-3, 1e4, 20_000)
        s, Z = 1j * omega, surface.impedance(omega)
        loop = (self.gain + self.integral / s) * self._measured(omega) * Z / (Z + self._tip(s))
        angle = np.unwrap(np.angle(1 + loop))
        return bool(angle[-1] - angle[0] > -pi)

    def _tip(self, s: Complex) -> Complex:
        return np.polyval([self.tip_mass, self.damping, self.stiffness], s)

    def _measured(self, omega: Array) -> Complex:
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

    def stable(self, surface: Surface) -> bool:
        """Taken for granted."""
        return True


def contact_force(
    loop: ForceLoop, omega: Array, impedance: Complex, amplitudes: Array, together: bool
) -> Complex:
    """Phasors of the force on each surface under a desired force of given amplitudes [N], shape (C, F).

    Args:
        loop: the robot.
        omega: angular frequencies [rad/s], shape (F,).
        impedance: of the surfaces [N/m], shape (C, F).
        amplitudes: of the desired force [N], shape (F,).
        together: all frequencies at once, as in a multisine; otherwise one after the other, as in a chirp.
    """
    speed = np.full((len(impedance), 1 if together else len(omega)), 1e-2)
    for _ in range(_ROUNDS):
        force = loop.transfer(omega, impedance, speed) * amplitudes
        power = np.abs(omega * force / impedance) ** 2 / 2
        new = np.sqrt(power.sum(axis=1, keepdims=True) if together else power)
        change = np.abs(new - speed).max() / max(float(new.max()), _STILL)
        speed = 0.5 * (speed + new)
        if change < _SETTLED:
            break
    return force
