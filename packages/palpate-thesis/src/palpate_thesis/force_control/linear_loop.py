"""The force loop of the thesis' controllers, linear: a tip on a surface, the sensor, its filters and the force law."""

from functools import cache
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.signals.filters import butterworth2

TICK = 1e-3
"""[s]"""
TIP = 8.2
"""Effective mass of the arm along x at the wall, rotors included [kg]."""


class LoopParameters(NamedTuple):
    """Parameters that decide the stability, besides the surface's stiffness."""

    kf: float  # K_fp
    ki: float  # K_fi [per sample]
    damping: float  # B_e of the surface [N s/m]
    tip: float  # mass along the force [kg]
    mass: float = 0.05  # M_e of the surface [kg]
    cutoff: float = 120.0  # of the sensor's analog low-pass, of third order [Hz]
    late: float = 1.5 / 480.0  # how long the sensor computes and holds [s]
    smoothing: float = 120.0  # cut-off of the controller's own filter [Hz]

    def radius(self, stiffness: Array) -> Array:
        """Spectral radius of one tick on surfaces of these stiffnesses [N/m], shape (n,); above 1 it is unstable."""
        return np.asarray(np.abs(np.linalg.eigvals(self.ticks(np.atleast_1d(stiffness)))).max(axis=-1))

    def limit(self, low: float = 1e3, high: float = 3e6) -> float:
        """The stiffness from which it is unstable [N/m]; NaN if it is so at `low`, infinite if not below `high`."""
        for _ in range(2):
            grid = np.geomspace(low, high, 40)
            unstable = self.radius(grid) > 1.0 + 1e-9
            first = int(np.argmax(unstable))
            if not unstable[first]:
                return float("inf")
            if first == 0:
                return float("nan")
            low, high = float(grid[first - 1]), float(grid[first])
        return float(np.sqrt(low * high))

    def ticks(self, stiffness: Array) -> Array:
        """Transition of the state by one tick: tip and analog filter, delay line of readings, filter, integral."""
        A, b, c = self.zero_order_hold(stiffness)
        n, line = 5, int(self.late / TICK) + 1
        share = self.late / TICK + 1 - line
        s1, s2, total = n + line, n + line + 1, n + line + 2
        unit = np.eye(total + 1)
        past = [np.pad(c, (0, total + 1 - n)), *unit[n : n + line]]
        smooth = butterworth2(self.smoothing, 1.0 / TICK)
        reading = (1.0 - share) * past[line - 1] + share * past[line]
        measured = smooth.b0 * reading + unit[s1]
        F = np.zeros((len(stiffness), total + 1, total + 1))
        F[:, :n, :n] = A
        F[:, n : n + line] = past[:line]
        F[:, s1] = smooth.b1 * reading - smooth.a1 * measured + unit[s2]
        F[:, s2] = smooth.b2 * reading - smooth.a2 * measured
        F[:, total] = unit[total] - self.ki * measured
        F[:, :n] += b[:, :, None] * (F[:, total] - self.kf * measured)[:, None, :]
        return F

    def zero_order_hold(self, stiffness: Array) -> tuple[Array, Array, Array]:
        """Tip and analog filter over one tick of constant force: x' = A x + b u for each stiffness, reading c x."""
        from scipy.linalg import expm

        step = expm(TICK * self.rates(stiffness))
        return step[:, :5, :5], step[:, :5, 5], np.concatenate([[0.0, 0.0], _analog(self.cutoff)[2]])

    def rates(self, stiffness: Array) -> Array:
        """d/dt of tip, analog filter and a held force for each stiffness, shape (n, 6, 6)."""
        Af, Bf, _ = _analog(self.cutoff)
        whole = self.tip + self.mass
        A = np.zeros((len(stiffness), 6, 6))
        A[:, 0, 1] = 1.0
        A[:, 1, 0], A[:, 1, 1], A[:, 1, 5] = -stiffness / whole, -self.damping / whole, 1.0 / whole
        A[:, 2:5, 2:5] = Af
        A[:, 2:5, 0], A[:, 2:5, 1] = stiffness[:, None] * Bf, self.damping * Bf
        return A


@cache
def _analog(cutoff: float) -> tuple[Array, Array, Array]:
    """The sensor's low-pass in state space."""
    from scipy.signal import butter, tf2ss

    A, B, C, _ = tf2ss(*butter(3, 1.0, analog=True))
    w = 2.0 * np.pi * cutoff
    return w * A, w * B[:, 0], C[0]
