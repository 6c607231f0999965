"""The linear model of bench and control law about a state of rest: does it come back to it, how, and how fast?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.constant_modes import CONSTANT, moving
from palpate.analysis.motion import SHOWN, Motion
from palpate.arrays import Array

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Mode:
    """One way in which the loop moves by itself.

    Args:
        growth: factor from tick to tick; below 1 it dies away.
        frequency: [Hz]; 0 where it does not swing.
        rate: of growth [1/s]; negative where it dies away.
    """

    growth: float
    frequency: float
    rate: float

    @property
    def damping(self) -> float:
        """Damping ratio: 1 where it does not swing, negative where it grows."""
        return -self.rate / math.hypot(self.rate, 2.0 * math.pi * self.frequency)


@dataclass(frozen=True)
class LinearLoop:
    """The loop about a state of rest, to first order; `linearise` makes it.

    The force sensor samples at its own rate, so the loop is periodic in time: it repeats itself after `period` ticks
    (25 at 480 Hz against 1 kHz). Its eigenvalues are those of a whole period (Floquet's), exact but for the rounding
    of differences; `margins` takes the average over a period.

    Args:
        motion: the loop as a map of vectors.
        x: the state of rest, shape (n,), as `motion.names` has it.
        period: in ticks.
        transition: d x(a period later)/d x, shape (n, n).
        seen: d `SHOWN`/d x at each tick of a period, shape (period, len(SHOWN), n).
        pose: of the tip at rest [m, m, rad], shape (3,).
        force: on the surface at rest [N].
        torque: of the motors at rest [N m], shape (3,).
    """

    motion: Motion
    x: Array
    period: int
    transition: Array
    seen: Array
    pose: Array
    force: float
    torque: Array

    @property
    def tick(self) -> float:
        """Time between ticks [s]."""
        return float(self.motion.loop.tick)

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The loop's own motions, the one that grows fastest first; a swing is one mode."""
        found = []
        for value, v in zip(*self._floquet, strict=True):
            if value.imag >= 0.0 and abs(value) > 0.0:
                growth = float(abs(value)) ** (1.0 / self.period)
                found.append(Mode(growth, self._frequency(value, v), math.log(growth) / self.tick))
        return tuple(sorted(found, key=lambda mode: -mode.growth))

    @cached_property
    def eigenvalues(self) -> Complex:
        """Of a tick, on average over a period, shape (m,), the largest first; swings have two.

        Constant modes (the tip's contact point, an integral without input) are left out.
        """
        z = [m.growth * np.exp(2j * math.pi * m.frequency * self.tick) for m in self.modes]
        return np.array([w for v in z for w in ([v, v.conjugate()] if abs(v.imag) > 1e-9 * abs(v) else [v])])

    @property
    def growth(self) -> float:
        """Factor per tick of the fastest mode: the spectral radius."""
        return float(np.abs(self._floquet[0]).max()) ** (1.0 / self.period)

    @property
    def stable(self) -> bool:
        """Whether every small disturbance dies away."""
        return self.growth**self.period <= 1.0 + CONSTANT

    @cached_property
    def ticks(self) -> tuple[Array, ...]:
        """d x(a tick later)/d x at each tick of a period, each of shape (n, n); `transition` is their product.

        Ticks with the same sampling moment of the sensor are equal and differentiated once.
        """
        sensor: Any = self.motion.loop.force.sensor
        steps = self.motion.loop.steps
        known: dict[tuple[bool, ...], Array] = {}
        found = []
        for k in range(self.period):
            alike = tuple(bool(sensor.samples_at(k * steps + j)) for j in range(steps))
            if alike not in known:
                known[alike] = self.motion.derivative(self.x, k, 1)[0]
            found.append(known[alike])
        return tuple(found)

    @cached_property
    def _floquet(self) -> tuple[Complex, Complex]:
        """Eigenvalues of a period, shape (m,), and their vectors, shape (m, n)."""
        return moving(self.transition, self.motion.steps)

    def _frequency(self, value: complex, v: Complex) -> float:
        """Of a mode [Hz]: a period gives its phase modulo whole turns; the ticks within it give the turns."""
        exponent = np.log(value) / self.period
        seen = (self.seen @ v) / np.array(list(SHOWN.values()))
        seen *= np.exp(-exponent * np.arange(self.period))[:, None]
        power = (np.abs(np.fft.fft(seen, axis=0)) ** 2).sum(axis=1)
        cycles = exponent.imag / (2.0 * math.pi) + np.fft.fftfreq(self.period)[int(np.argmax(power))]
        return float(abs((cycles + 0.5) % 1.0 - 0.5)) / self.tick
