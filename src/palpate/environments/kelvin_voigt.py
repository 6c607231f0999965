"""Spring, damper and mass side by side."""

from typing import Any, ClassVar, NamedTuple

from palpate._jit import part
from palpate.environments.surface import UNTOUCHED, SurfaceState, SurfaceTable, implicitness, swing
from palpate.signals.types import NotNegative, Positive, coerce_fields, require


def _check(self):
    require(self.stiffness > 0, "stiffness", "above 0 N/m", self.stiffness)
    require(self.damping >= 0, "damping", "at least 0 N s/m", self.damping)
    require(self.mass >= 0, "mass", "at least 0 kg", self.mass)


@part
@coerce_fields(_check)
class KelvinVoigt(NamedTuple):
    """f = K p + B v + M a: the model that M, B, K estimators assume.

    At touch with velocity v the force jumps by B v: the model says so.

    Args:
        stiffness: K [N/m].
        damping: B [N s/m].
        mass: M [kg].
    """

    stiffness: float
    damping: float
    mass: float

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s], inertia left out [N]."""
        return self.stiffness * p + self.damping * v

    def relax(self, state, p, v, dt):
        """The state after a step in contact that ended at p, v."""
        return SurfaceState(p, v, 0.0, 1.0)

    def free(self, state, dt):
        """The state after a free step."""
        weight = implicitness(self.mass, self.damping, self.stiffness, dt)
        s, v = swing(self.mass, self.damping, self.stiffness, 0.0, state.deflection, state.rate, weight, dt)
        return SurfaceState(s, v, 0.0, 0.0)

    def stored_energy(self, state):
        """Energy that can be given back, motion of the mass included [J]."""
        s, v = state.deflection, state.rate
        return 0.5 * (self.stiffness * s * s + self.mass * v * v)

    def truth(self):
        """Parameter names with value and unit, for reports."""
        return {"K": (self.stiffness, "N/m"), "B": (self.damping, "N s/m"), "M": (self.mass, "kg")}


def _check_layers(self):
    _check(self)
    require(self.thickness > 0, "thickness", "above 0 m", self.thickness)
    require(self.behind > 0, "behind", "above 0 N/m", self.behind)


@part
@coerce_fields(_check_layers)
class Layered(NamedTuple):
    """A layer on something else, spring by spring: f = K p + B v up to its thickness, and from there on with K behind.

    Args:
        stiffness: K of the layer [N/m].
        damping: B [N s/m].
        mass: none: 0 [kg].
        thickness: penetration at which what is behind the layer is felt [m].
        behind: the stiffness from there on [N/m].
    """

    stiffness: float
    damping: float
    mass: float
    thickness: float
    behind: float

    start, relax, free = KelvinVoigt.start, KelvinVoigt.relax, KelvinVoigt.free

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s] [N]."""
        within = min(p, self.thickness)
        return self.stiffness * within + self.behind * (p - within) + self.damping * v

    def truth(self):
        """Parameter names with value and unit, for reports."""
        known = {"K": self.stiffness, "thickness": self.thickness, "behind": self.behind}
        return {name: (value, "m" if name == "thickness" else "N/m") for name, value in known.items()}


def stiffest(surface: Any) -> float:
    """The largest stiffness that a surface of springs has at any depth [N/m]."""
    return float(max(surface.stiffness, getattr(surface, "behind", 0.0)))


class KelvinVoigtSurface(SurfaceTable, tag="kelvin-voigt"):
    """Mass, damper and spring: f = M a + B v + K x."""

    part: ClassVar[type] = KelvinVoigt

    stiffness: Positive
    damping: NotNegative
    mass: NotNegative
