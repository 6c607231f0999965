"""Compliance and mass between position sensor and surface, removed from the identified parameters.

An arm of stiffness k in series with a surface of impedance Z is seen as Z k / (Z + k), and as Z k / (Z + k + m s^2)
where a tip of mass m swings between the two. Both channels pass through the same filters first, and the surface is
found from what they say together: nothing is subtracted from a position that the force's lag and noise would come with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.estimators.budget import Answer
from palpate.identification.estimators.fit import Fit
from palpate.identification.options import Options
from palpate.identification.result import DynamicStiffness, Press, Tangent
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.types import NORMAL

Linear = TypeVar("Linear", Answer, Fit)
"""Parameters with their covariance."""
_SPRING, _TIP = "series stiffness", "tip's mass"
"""The causes of an interval that these two are."""


@dataclass(frozen=True)
class SeriesSpring:
    """A spring between position sensor and surface, and the mass that swings on it.

    Args:
        stiffness, std: of the spring, and its standard deviation [N/m].
        share, share_std: the mass over the stiffness, and its standard deviation [s^2]; 0 without a mass.
    """

    stiffness: float
    std: float = 0.0
    share: float = 0.0
    share_std: float = 0.0

    @classmethod
    def of(cls, options: Options) -> SeriesSpring | None:
        """The spring of a log's options; None without one."""
        k = options.series_stiffness
        return None if k is None else cls(k, options.series_std, *options.swing)

    def parameters(self, seen: Linear, band: float = 0.0) -> Linear:
        """Parameters of the surface from those of all, to the second order of the frequency.

        With what is seen as K_a + B_a s + M_a s^2: K = K_a r, B = B_a r^2, M = M_a r^2 + B_a^2 r^3/k + K m/k,
        r = k/(k - K_a). The covariance goes through the derivatives of these. The next orders make B and M too large by
        m omega^2/k of each at most, which is their half-width by this cause; below `band` [Hz] the probe moved.
        """
        theta, names = seen.theta, seen.names
        self._check(float(theta[names.index("K")]))
        new, jacobian = self.surface_of(theta, names), np.eye(len(theta))
        for i in (names.index(name) for name in ("K", "B", "M") if name in names):
            step = 1e-6 * max(abs(theta[i]), 1e-9)
            moved = theta.copy()
            moved[i] += step
            jacobian[:, i] = (self.surface_of(moved, names) - new) / step
        stiffer = replace(self, stiffness=self.stiffness + self.std)
        surface = seen.through(jacobian, new).with_cause(_SPRING, stiffer.surface_of(theta, names) - new)
        if not (self.share or self.share_std):
            return surface
        heavier = replace(self, share=self.share + self.share_std)
        most = min(self.share * (2 * np.pi * band) ** 2, 1.0) / NORMAL
        beyond = most * replace(self, share=0.0).surface_of(theta, names) * np.isin(names, ("B", "M"))
        return surface.with_cause(_TIP, np.hypot(heavier.surface_of(theta, names) - new, beyond))

    def surface_of(self, theta: Array, names: tuple[str, ...]) -> Array:
        """The surface's parameters of those of all, shape (p,)."""
        own, new = dict(zip(names, theta, strict=True)), theta.copy()
        r = self.stiffness / (self.stiffness - own["K"])
        new[names.index("K")] = own["K"] * r
        if "B" in own:
            new[names.index("B")] = own["B"] * r**2
        if "M" in own:
            by_damping = own.get("B", 0.0) ** 2 * r**3 / self.stiffness
            new[names.index("M")] = own["M"] * r**2 + by_damping + self.share * own["K"] * r
        return new

    def spectrum(self, spectrum: tuple[DynamicStiffness, ...]) -> tuple[DynamicStiffness, ...]:
        """Dynamic stiffness of the surface, Z k / (k - Z) (1 + m s^2/k), with what is not known of k and m/k."""
        found = []
        for octave in spectrum:
            seen = complex(octave.storage, octave.loss)
            squared = (2.0 * np.pi * octave.frequency) ** 2
            behind = seen * self.stiffness / (self.stiffness - seen)
            swings = 1.0 - squared * self.share
            gain = swings * abs(self.stiffness / (self.stiffness - seen)) ** 2
            by_spring = Contribution(abs(swings) * self.std * abs(behind / self.stiffness) ** 2)
            parts = []
            for part, own in ((octave.in_phase, behind.real), (octave.in_quadrature, behind.imag)):
                surface = part.through(swings * own, gain).with_cause(_SPRING, by_spring)
                by_tip = Contribution(squared * self.share_std * abs(own))
                parts.append(surface.with_cause(_TIP, by_tip) if self.share_std else surface)
            found.append(replace(octave, in_phase=parts[0], in_quadrature=parts[1]))
        return tuple(found)

    def slope(self, seen: Measurement) -> Measurement:
        """The surface's slope from that of both [N/m]."""
        self._check(seen.value)
        gain = self.stiffness / (self.stiffness - seen.value)
        by_spring = Contribution(self.std * (gain * seen.value / self.stiffness) ** 2)
        return seen.through(gain * seen.value, gain**2).with_cause(_SPRING, by_spring)

    def slopes(self, seen: Slopes) -> Slopes:
        """The same of the slopes of some loadings."""
        own = self.slope(seen.stiffness)
        gain = (own.value / seen.stiffness.value) ** 2
        return replace(seen, stiffness=own, again=None if seen.again is None else gain * seen.again)

    def press(self, seen: Press) -> Press:
        """The press over the depth of the surface alone."""
        softer = (t for t in seen.tangent if t.stiffness < self.stiffness)
        curves = [np.stack([d - (f - f[:1]) / self.stiffness, f]) for d, f in (seen.loading, seen.unloading)]
        tangent = tuple(Tangent(t.force, self.slope(t.slope)) for t in softer)
        return replace(seen, tangent=tangent, loading=curves[0], unloading=curves[1])

    def _check(self, apparent: float) -> None:
        """Two springs in series are softer than either; an `InputError` if not."""
        if abs(apparent) >= self.stiffness:
            raise InputError(
                f"the series stiffness of {self.stiffness:.4g} N/m is softer than the log's own {abs(apparent):.4g}"
                " N/m, but two springs in series are softer than either: check its value and unit, or leave it out"
            )
