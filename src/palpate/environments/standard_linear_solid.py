"""A Kelvin-Voigt surface with a Maxwell branch beside it: it relaxes under load."""

from typing import ClassVar, NamedTuple

from palpate._jit import law, part
from palpate.environments.surface import UNTOUCHED, SurfaceState, SurfaceTable, implicitness, swing
from palpate.signals.types import NotNegative, Positive, coerce_fields, require


def _check(self):
    require(self.stiffness > 0, "stiffness", "above 0 N/m", self.stiffness)
    require(self.damping >= 0, "damping", "at least 0 N s/m", self.damping)
    require(self.mass >= 0, "mass", "at least 0 kg", self.mass)
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
@coerce_fields(_check)
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
