"""One axis of a torque arm on a spring: a mass that swings between ticks, in floats, in fractions, and how A(K) bends.

With kappa = K t^2/m the swing over a time t has elements of c = cos sqrt(kappa), s = sin sqrt(kappa)/sqrt(kappa) and
g = (1 - c)/kappa, whose second derivatives for kappa >= 0 are at most those at 0: 1/12, 1/60 and 1/360 (integrals of
cosines); that of kappa s is (s' + c')/2, at most (1/6 + 1/2)/2 = 1/3.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from math import ceil, factorial, isqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from palpate.arrays import Array

BITS = 520
"""Terms of a series are rounded to 2^-520, and finer where they first grow: by less than 4^sqrt(kappa)."""
MAX_KAPPA = 1e4
"""K t^2/m beyond which nothing is proved: sixteen swings in a tick."""


class TorqueSpringLoop(NamedTuple):
    """Loop of a torque arm: a mass on the surface's spring, driven by the force of the latest commands.

    State: position, velocity, and the commanded forces of the last ticks, the newest first.

    Args:
        feedback: commanded force from position and velocity [N/m, N s/m].
        mass: of the arm at its tip along the axis [kg].
        period: of a tick [s].
        whole: whole ticks of the delay.
        part: rest of the delay, as a fraction of a tick.
    """

    feedback: tuple[float, float]
    mass: float
    period: float
    whole: int
    part: float

    @property
    def pressed(self) -> int:
        """Index, among the states, of the position whose force is read."""
        return 0

    def matrices(self, stiffness: Array) -> Array:
        """A(K) for each stiffness [N/m]; shape (m, n, n)."""
        return self._float_system(stiffness)[..., :-1]

    def inputs(self, stiffness: Array) -> Array:
        """Change of the state by one newton of commanded force, for each stiffness; shape (m, n)."""
        return self._float_system(stiffness)[..., -1]

    def exact_matrix(self, stiffness: Fraction) -> Any:
        """A(K) in fractions, each within 2^-400 of the true element; shape (n, n)."""
        mass, period = Fraction(self.mass), Fraction(self.period)
        times = (period, period * (1 - Fraction(self.part)))
        (swing, whole), (_, rest) = (_oscillation(stiffness, mass, time) for time in times)
        return self._system(np.array(swing), np.array(whole), np.array(rest), Fraction)[:, :-1]

    def bend(self, low: float, high: float) -> Array:
        """Bounds of the distance of A(K) from the chord between the ends, for each element; shape (n, n).

        A function is off its chord by at most an eighth of the square of the interval times its second derivative.
        """
        n, t, m = self.whole + 3, self.period, self.mass
        if high * t**2 / m > MAX_KAPPA:
            return np.full((n, n), np.inf)
        command = np.zeros(n)
        command[:2] = np.abs(self.feedback)
        commands = [command, *np.eye(n)[2:]]

        def forced(time: float) -> Array:
            return (time**2 / m) ** 2 / m * np.array([time**2 / 360.0, time / 60.0])

        rest = forced(t * (1.0 - self.part))
        bounds = np.zeros((n, n))
        bounds[:2, :2] = (t**2 / m) ** 2 * np.array([[1.0 / 12.0, t / 60.0], [1.0 / (3.0 * t), 1.0 / 12.0]])
        bounds[:2] += np.outer(rest, commands[self.whole])
        bounds[:2] += np.outer(forced(t) + rest, commands[self.whole + 1])
        return bounds * ((high - low) ** 2 / 8.0 * (1.0 + 1e-9))

    def _float_system(self, stiffness: Array) -> Array:
        swing, whole = self._swing(stiffness, self.period)
        _, rest = self._swing(stiffness, self.period * (1.0 - self.part))
        return self._system(swing, whole, rest, float)

    def _system(self, swing: Array, whole: Array, rest: Array, number: Callable[[float], Any]) -> Array:
        """Next state from the state and, in the last column, one newton more; in numbers of one kind.

        Args:
            swing: position and velocity after a tick from those before it; shape (..., 2, 2).
            whole: the same from a constant force of one newton; shape (..., 2).
            rest: that of the part of the tick in which the newer command acts.
            number: kind of number.
        """
        n = self.whole + 3
        signals = np.eye(n, n + 1, dtype=int).astype(swing.dtype)
        command = -number(self.feedback[0]) * signals[0] - number(self.feedback[1]) * signals[1]
        command[-1] = number(1.0)
        commands = [command, *signals[2:]]
        system = np.zeros((*swing.shape[:-2], n, n + 1), swing.dtype)
        system[..., :2, :] = swing @ signals[:2]
        system[..., :2, :] += rest[..., None] * commands[self.whole]
        system[..., :2, :] += (whole - rest)[..., None] * commands[self.whole + 1]
        system[..., 2:, :] = np.array(commands[:-1])
        return system

    def _swing(self, stiffness: Array, time: float) -> tuple[Array, Array]:
        """Position and velocity after a time from those before it, and from a constant force of one newton."""
        omega = np.sqrt(np.maximum(stiffness, 1e-9) / self.mass)
        cosine, sine = np.cos(omega * time), np.sin(omega * time)
        swing = np.array([[cosine, sine / omega], [-omega * sine, cosine]])
        forced = np.array([2.0 * np.sin(0.5 * omega * time) ** 2 / omega**2, sine / omega]) / self.mass
        return swing.transpose(2, 0, 1), forced.T


@lru_cache(64)
def _oscillation(stiffness: Fraction, mass: Fraction, time: Fraction) -> tuple[list[list[Any]], list[Any]]:
    """Position and velocity after a time from those before it, and from a constant force of 1 N; in fractions."""
    kappa = stiffness * time**2 / mass
    c, s, g = (_series(kappa, first) for first in (0, 1, 2))
    velocity = -stiffness * time / mass * s
    return [[c, time * s], [velocity, c]], [time**2 * g / mass, time * s / mass]


def _series(kappa: Fraction, first: int) -> Fraction:
    """Sum of (-kappa)^j/(2 j + first)!, with an error below 2^-500: its terms alternate, and fall after a while."""
    bits = BITS + 2 * isqrt(ceil(kappa))
    total = term = (1 << bits) // factorial(
        first
    )  # in units of 2^-bits: whole numbers are faster than fractions
    up, down = -kappa.numerator, kappa.denominator
    j = 1
    while term or (2 * j + first) ** 2 <= kappa:
        divisor = down * (2 * j + first - 1) * (2 * j + first)
        term = (2 * term * up + divisor) // (2 * divisor)
        total += term
        j += 1
    return Fraction(total, 1 << bits)
