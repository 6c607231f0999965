"""A contact whose area grows with penetration."""

import math
from typing import Annotated, ClassVar, NamedTuple

from msgspec import Meta

from palpate._jit import part
from palpate.environments.surface import UNTOUCHED, SurfaceState, SurfaceTable, implicitness, swing
from palpate.signals.types import NotNegative, Positive, coerce_fields, require


def _check(self):
    require(self.stiffness > 0, "stiffness", "above 0 N/m^n", self.stiffness)
    require(self.damping >= 0, "damping", "at least 0 N s/m^(n+1)", self.damping)
    require(self.exponent >= 1, "exponent", "at least 1", self.exponent)
    require(self.mass >= 0, "mass", "at least 0 kg", self.mass)


@part
@coerce_fields(_check)
class HuntCrossley(NamedTuple):
    """f = K p^n + lambda p^n v + M a (Hunt and Crossley, 1975): no jump at touch, no pull at parting.

    A free surface beyond its rest (p < 0) is held by the odd continuation, |p|^n (K sign p + lambda v).

    Args:
        stiffness: K [N/m^n].
        damping: lambda [N s/m^(n+1)].
        exponent: n; 1.5 for a sphere on a half-space.
        mass: M [kg].
    """

    stiffness: float
    damping: float
    exponent: float
    mass: float

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s], inertia left out [N]."""
        return abs(p) ** self.exponent * (math.copysign(self.stiffness, p) + self.damping * v)

    def relax(self, state, p, v, dt):
        """The state after a step in contact that ended at p, v."""
        return SurfaceState(p, v, 0.0, 1.0)

    def free(self, state, dt):
        """The state after a free step; secant stiffness and damping are taken at the middle of the step."""
        middle = abs(state.deflection + 0.5 * dt * state.rate)
        if self.mass == 0.0:
            middle = abs(state.deflection)
        secant = middle ** (self.exponent - 1.0)
        stiffness, damping = self.stiffness * secant, self.damping * secant * middle
        weight = implicitness(self.mass, damping, stiffness, dt)
        s, v = swing(self.mass, damping, stiffness, 0.0, state.deflection, state.rate, weight, dt)
        return SurfaceState(s, v, 0.0, 0.0)

    def stored_energy(self, state):
        """Energy that can be given back, motion of the mass included [J]."""
        s, v, n = abs(state.deflection), state.rate, self.exponent + 1.0
        return self.stiffness * s**n / n + 0.5 * self.mass * v * v

    def truth(self):
        """Parameter names with value and unit, for reports."""
        n = f"{self.exponent:g}"
        return {
            "K": (self.stiffness, f"N/m^{n}"),
            "lambda": (self.damping, f"N s/m^{self.exponent + 1:g}"),
            "n": (self.exponent, "1"),
            "M": (self.mass, "kg"),
        }


class HuntCrossleySurface(SurfaceTable, tag="hunt-crossley"):
    """A spring that stiffens and damping that grows with depth: f = K x^n + B x^n v."""

    part: ClassVar[type] = HuntCrossley

    stiffness: Positive
    damping: NotNegative
    exponent: Annotated[float, Meta(ge=1)]
    mass: NotNegative
