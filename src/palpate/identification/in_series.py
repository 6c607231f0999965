"""Compliance and mass between position sensor and surface, removed from the identified parameters.

An arm of stiffness k in series with a surface of impedance Z is seen as Z k / (Z + k), and as Z k / (Z + k + m s^2)
where a tip of mass m swings between the two. Both channels pass through the same filters first, and the surface is
found from what they say together: nothing is subtracted from a position that the force's lag and noise would come with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.budget import FittedParameters
from palpate.identification.options import Options
from palpate.identification.result import DynamicStiffness, Press, Tangent
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement
from palpate.signals.types import NORMAL

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

    def parameters(self, seen: FittedParameters, band: float = 0.0) -> FittedParameters:
        """Parameters of the surface from those of all, to the second order of the frequency.

        With the apparent impedance K_a + B_a s + M_a s^2: K = K_a r, B = B_a r^2, M = M_a r^2 + B_a^2 r^3/k + K m/k,
        r = k/(k - K_a). The covariance is transformed by the derivatives. The next orders make B and M too large by at
        most m omega^2/k of each, which is their half-width by this cause; the probe moved below `band` [Hz].
        """
        theta = seen.theta
        names = seen.names
        self._check(float(theta[names.index("K")]))
        surface_theta = self.surface_parameters(theta, names)
        jacobian = np.eye(len(theta))
        for place in (names.index(name) for name in ("K", "B", "M") if name in names):
            step = 1e-6 * max(abs(theta[place]), 1e-9)
            shifted = theta.copy()
            shifted[place] += step
            jacobian[:, place] = (self.surface_parameters(shifted, names) - surface_theta) / step
        stiffer = replace(self, stiffness=self.stiffness + self.std)
        change = stiffer.surface_parameters(theta, names) - surface_theta
        surface = seen.through(jacobian, surface_theta).with_cause(_SPRING, change)
        if not (self.share or self.share_std):
            return surface
        heavier = replace(self, share=self.share + self.share_std)
        largest_ratio = min(self.share * (2 * np.pi * band) ** 2, 1.0) / NORMAL
        massless = replace(self, share=0.0).surface_parameters(theta, names)
        higher_orders = largest_ratio * massless * np.isin(names, ("B", "M"))
        change = heavier.surface_parameters(theta, names) - surface_theta
        return surface.with_cause(_TIP, np.hypot(change, higher_orders))

    def surface_parameters(self, theta: Array, names: tuple[str, ...]) -> Array:
        """The surface's parameters from the apparent ones, shape (p,)."""
        values = dict(zip(names, theta, strict=True))
        surface_theta = theta.copy()
        gain = self.stiffness / (self.stiffness - values["K"])
        surface_theta[names.index("K")] = values["K"] * gain
        if "B" in values:
            surface_theta[names.index("B")] = values["B"] * gain**2
        if "M" in values:
            by_damping = values.get("B", 0.0) ** 2 * gain**3 / self.stiffness
            by_tip = self.share * values["K"] * gain
            surface_theta[names.index("M")] = values["M"] * gain**2 + by_damping + by_tip
        return surface_theta

    def spectrum(self, spectrum: tuple[DynamicStiffness, ...]) -> tuple[DynamicStiffness, ...]:
        """Dynamic stiffness of the surface, Z k / (k - Z) (1 + m s^2/k), with the uncertainty of k and m/k."""
        surfaces = []
        for octave in spectrum:
            apparent = complex(octave.storage, octave.loss)
            squared = (2.0 * np.pi * octave.frequency) ** 2
            without_spring = apparent * self.stiffness / (self.stiffness - apparent)
            tip = 1.0 - squared * self.share
            gain = tip * abs(self.stiffness / (self.stiffness - apparent)) ** 2
            by_spring = Contribution(abs(tip) * self.std * abs(without_spring / self.stiffness) ** 2)
            apparent_parts = octave.in_phase, octave.in_quadrature
            components = without_spring.real, without_spring.imag
            parts = []
            for part, component in zip(apparent_parts, components, strict=True):
                surface = part.through(tip * component, gain).with_cause(_SPRING, by_spring)
                by_tip = Contribution(squared * self.share_std * abs(component))
                parts.append(surface.with_cause(_TIP, by_tip) if self.share_std else surface)
            surfaces.append(replace(octave, in_phase=parts[0], in_quadrature=parts[1]))
        return tuple(surfaces)

    def slope(self, seen: Measurement) -> Measurement:
        """The surface's slope from the slope of surface and spring [N/m]."""
        self._check(seen.value)
        gain = self.stiffness / (self.stiffness - seen.value)
        by_spring = Contribution(self.std * (gain * seen.value / self.stiffness) ** 2)
        return seen.through(gain * seen.value, gain**2).with_cause(_SPRING, by_spring)

    def slopes(self, seen: Slopes) -> Slopes:
        """Remove the series spring from the slopes of some loadings."""
        surface_slope = self.slope(seen.stiffness)
        gain = (surface_slope.value / seen.stiffness.value) ** 2
        return replace(seen, stiffness=surface_slope, again=None if seen.again is None else gain * seen.again)

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
