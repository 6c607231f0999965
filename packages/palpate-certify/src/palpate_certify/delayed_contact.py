"""A control loop with one delay in contact with a spring: where it is stable, exactly and proved.

    A(s) + K C(s) = 0,    A = a(s) + b(s) e^(-s T),    C = c(s) + d(s) e^(-s T)

K is the surface's stiffness. A root on the imaginary axis makes -A(jw)/C(jw) real and positive: that is K.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import NDArray

from palpate.arrays import Array

TURNS, FINE = 40.0, 4e-3
"""Angles w T [rad] up to which crossings are looked for, and the step: A and C turn by less between two of them."""
LEAST = 1e-4
"""Of the highest stiffness: the lowest that is proved. Without any a force loop does nothing, which is not stable."""
CELLS = 1 << 20
Polynomial = tuple[float, ...]
"""Coefficients, the lowest power first."""


@dataclass(frozen=True)
class DelayedContact:
    """The loop above.

    Args:
        delay: T, everything that is late between contact and motion together [s].
        plain: a.
        late: b.
        surface: c.
        late_surface: d.
    """

    delay: float
    plain: Polynomial
    late: Polynomial = (0.0,)
    surface: Polynomial = (0.0,)
    late_surface: Polynomial = (0.0,)

    def at(self, w: Array) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """A and C at angular frequencies [rad/s]."""
        s = 1j * w
        late = np.exp(-s * self.delay)
        A, C = (
            poly.polyval(s, a) + late * poly.polyval(s, b)
            for a, b in ((self.plain, self.late), (self.surface, self.late_surface))
        )
        return A, C

    def on_damped(self, time: float) -> DelayedContact:
        """The same on a surface whose damping is this time times its stiffness: B = K time [s]."""
        if time == 0.0:
            return self
        surface, late = (
            tuple(poly.polymul((1.0, time), c).tolist()) for c in (self.surface, self.late_surface)
        )
        return replace(self, surface=surface, late_surface=late)

    @property
    def frequencies(self) -> Array:
        """At which crossings are looked for [rad/s]: even in w T, and by decades below that."""
        even = np.arange(FINE, TURNS, FINE) / self.delay
        return np.concatenate([np.geomspace(1e-6, 1.0, 2000, endpoint=False) * even[0], even])

    def first_unstable(self) -> float:
        """K from which on, upwards from 0, the loop grows [N/m]; infinite if none does, 0 if it grows without contact.

        The free loop of an impedance is stable up to a gain, if its damping leads by more than the delay lags.
        """
        if any(self.late):
            free = DelayedContact(self.delay, self.plain, late_surface=self.late)
            if self.late[1] <= self.delay * self.late[0] or free.first_unstable() <= 1.0:
                return 0.0
        w = self.frequencies
        turn = _turn(*self.at(w))
        change = np.flatnonzero(turn[:-1] * turn[1:] <= 0.0)
        low, high, below = w[change], w[change + 1], turn[change]
        for _ in range(60):
            middle = 0.5 * (low + high)
            same = _turn(*self.at(middle)) * below > 0.0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        A, C = self.at(high)
        K = -(A / C).real
        neutral = len(self.plain) == len(self.late_surface) and self.late_surface[-1] != 0.0
        most = (
            abs(self.plain[-1] / self.late_surface[-1]) if neutral else np.inf
        )  # grows ever faster from there on
        return float(min([*K[K > 0.0], most]))

    def proves(self, low: float, high: float) -> bool:
        """Whether no root is on the imaginary axis for any K from low to high: A + K C is away from 0 there.

        The distance of the segment from 0, at the middle of a cell of frequencies, is more than the segment can move
        within the cell; above the last cell the highest power outweighs all others. As K goes to `low` from where the
        loop is known to be stable, no root has crossed: so it is stable.
        """
        top = self._last(high)
        if not (np.isfinite(top) and self.first_unstable() > high):
            return False
        edges = np.linspace(0.0, top, 4097)
        low_w, high_w = edges[:-1], edges[1:]
        for _ in range(40):
            middle, half = 0.5 * (low_w + high_w), 0.5 * (high_w - low_w)
            A, C = self.at(middle)
            start, span = A + low * C, (high - low) * C
            place = np.clip(-(start * span.conj()).real / np.maximum(np.abs(span) ** 2, 1e-300), 0.0, 1.0)
            left = np.abs(start + place * span) <= 1.000001 * half * self._slope(high_w, high)
            if not left.any():
                return True
            low_w = np.concatenate([low_w[left], middle[left]])
            high_w = np.concatenate([middle[left], high_w[left]])
            if len(low_w) > CELLS:
                return False
        return False

    def _slope(self, w: Array, K: float) -> Array:
        """How fast A + K C may turn with w, at most."""
        found = np.zeros_like(w)
        for of, late, factor in (
            (self.plain, 0.0, 1.0), (self.late, self.delay, 1.0),
            (self.surface, 0.0, K), (self.late_surface, self.delay, K),
        ):  # fmt: skip
            size = np.abs(of)
            found += factor * (poly.polyval(w, poly.polyder(size)) + late * poly.polyval(w, size))
        return found

    def _last(self, K: float) -> float:
        """A frequency above which the highest power of A outweighs all other terms [rad/s]."""
        others = np.zeros(len(self.plain))
        for of, factor in (
            (self.plain[:-1], 1.0),
            (self.late, 1.0),
            (self.surface, K),
            (self.late_surface, K),
        ):
            others[: len(of)] += factor * np.abs(of)
        lead, n = abs(self.plain[-1]) - others[-1], len(others)
        if lead <= 0.0:
            return np.inf
        return float(2.0 * max((n * c / lead) ** (1.0 / (n - 1 - i)) for i, c in enumerate(others[:-1])))


def _turn(A: NDArray[np.complex128], C: NDArray[np.complex128]) -> Array:
    return np.asarray((A * C.conj()).imag)
