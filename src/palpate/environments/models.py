"""Models of surfaces: spring, damper and mass; one that relaxes; a contact whose area grows."""

import math
from typing import Annotated, Any, ClassVar, NamedTuple

from msgspec import Meta

from palpate._jit import law, part
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


def _check_branch(self):
    _check(self)
    require(self.branch_stiffness >= 0, "branch stiffness", "at least 0 N/m", self.branch_stiffness)
    require(self.branch_time > 0, "branch time", "above 0 s", self.branch_time)


@law
def stretch_after(z, advance, time, weight, dt):
    """Stretch of a Maxwell branch's spring after a step that advanced so far: z' = v - z/time, implicit."""
    h = dt / time
    return (z * (1.0 - (1.0 - weight) * h) + advance) / (1.0 + weight * h)


@law
def branch_weight(time, dt):
    """1/2 (second order), towards 1 where the step outlasts the relaxation."""
    return max(0.5, 1.0 - time / dt)


@part
@coerce_fields(_check_branch)
class StandardLinearSolid(NamedTuple):
    """f = K p + B v + K_1 z + M a, with z' = v - z/tau: foam.

    Args:
        stiffness: K, the relaxed stiffness [N/m].
        damping: B [N s/m].
        mass: M [kg].
        branch_stiffness: K_1 [N/m]; pressed at once, the surface is K + K_1 stiff.
        branch_time: tau, relaxation time of the branch [s].
    """

    stiffness: float
    damping: float
    mass: float
    branch_stiffness: float
    branch_time: float

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s], inertia left out [N].

        The branch is taken as stretched by what p is beyond the state's deflection.
        """
        z = state.internal + (p - state.deflection)
        return self.stiffness * p + self.damping * v + self.branch_stiffness * z

    def relax(self, state, p, v, dt):
        """The state after a step in contact that ended at p, v."""
        weight = branch_weight(self.branch_time, dt)
        z = stretch_after(state.internal, p - state.deflection, self.branch_time, weight, dt)
        return SurfaceState(p, v, z, 1.0)

    def free(self, state, dt):
        """The state after a free step."""
        time, k1, z = self.branch_time, self.branch_stiffness, state.internal
        weight = max(branch_weight(time, dt), implicitness(self.mass, self.damping, self.stiffness + k1, dt))
        # The branch's spring at its weighted mean is (z + weight advance)/(1 + weight dt/time).
        softening = 1.0 / (1.0 + weight * dt / time)
        stiffness = self.stiffness + k1 * softening
        load = k1 * softening * (z - state.deflection)
        s, v = swing(self.mass, self.damping, stiffness, load, state.deflection, state.rate, weight, dt)
        return SurfaceState(s, v, stretch_after(z, s - state.deflection, time, weight, dt), 0.0)

    def stored_energy(self, state):
        """Energy that can be given back, motion of the mass included [J]."""
        s, v, z = state.deflection, state.rate, state.internal
        return 0.5 * (self.stiffness * s * s + self.branch_stiffness * z * z + self.mass * v * v)

    def truth(self):
        """Parameter names with value and unit, for reports; K is the relaxed stiffness."""
        return {
            "K": (self.stiffness, "N/m"),
            "B": (self.damping, "N s/m"),
            "M": (self.mass, "kg"),
            "K_instant": (self.stiffness + self.branch_stiffness, "N/m"),
            "tau": (self.branch_time, "s"),
        }


class StandardLinearSolidSurface(SurfaceTable, tag="standard-linear-solid"):
    """A spring and damper beside a spring that relaxes: foam under load."""

    part: ClassVar[type] = StandardLinearSolid

    stiffness: Positive
    damping: NotNegative
    mass: NotNegative
    branch_stiffness: NotNegative
    branch_time: Positive


def _check_sphere(self):
    require(self.stiffness > 0, "stiffness", "above 0 N/m^n", self.stiffness)
    require(self.damping >= 0, "damping", "at least 0 N s/m^(n+1)", self.damping)
    require(self.exponent >= 1, "exponent", "at least 1", self.exponent)
    require(self.mass >= 0, "mass", "at least 0 kg", self.mass)


@part
@coerce_fields(_check_sphere)
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
