"""One type for every built-in surface, so that one compiled loop serves them all."""

from typing import NamedTuple

from palpate._jit import part
from palpate.environments.hunt_crossley import HuntCrossley
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.environments.standard_linear_solid import StandardLinearSolid
from palpate.environments.surface_state import UNTOUCHED
from palpate.errors import InputError

_KELVIN_VOIGT, _SOLID, _HUNT_CROSSLEY = 0, 1, 2
_MEMBERS = (KelvinVoigt(1, 0, 0), StandardLinearSolid(1, 0, 0, 0, 1), HuntCrossley(1, 0, 1, 0))
BUILT_IN = (KelvinVoigt, StandardLinearSolid, HuntCrossley)


@part
class Surface(NamedTuple):
    """One of the built-in surfaces; `join` makes it.

    Args:
        kind: which of the following is meant.
        mass: the mass of the one that is meant [kg].
        kelvin_voigt, solid, hunt_crossley: the one meant, and two that are not used.
    """

    kind: int
    mass: float
    kelvin_voigt: KelvinVoigt
    solid: StandardLinearSolid
    hunt_crossley: HuntCrossley

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s], inertia left out [N]."""
        if self.kind == _KELVIN_VOIGT:
            return self.kelvin_voigt.force(state, p, v)
        if self.kind == _SOLID:
            return self.solid.force(state, p, v)
        return self.hunt_crossley.force(state, p, v)

    def relax(self, state, p, v, dt):
        """The state after a step in contact that ended at p, v."""
        if self.kind == _KELVIN_VOIGT:
            return self.kelvin_voigt.relax(state, p, v, dt)
        if self.kind == _SOLID:
            return self.solid.relax(state, p, v, dt)
        return self.hunt_crossley.relax(state, p, v, dt)

    def free(self, state, dt):
        """The state after a free step."""
        if self.kind == _KELVIN_VOIGT:
            return self.kelvin_voigt.free(state, dt)
        if self.kind == _SOLID:
            return self.solid.free(state, dt)
        return self.hunt_crossley.free(state, dt)

    def stored(self, state):
        """Energy that can be given back, motion of the mass included [J]."""
        if self.kind == _KELVIN_VOIGT:
            return self.kelvin_voigt.stored(state)
        if self.kind == _SOLID:
            return self.solid.stored(state)
        return self.hunt_crossley.stored(state)

    def truth(self):
        """Parameter names with value and unit, for reports."""
        return (self.kelvin_voigt, self.solid, self.hunt_crossley)[self.kind].truth()


def join(environment: KelvinVoigt | StandardLinearSolid | HuntCrossley) -> Surface:
    """The surface that behaves as this environment."""
    if type(environment) not in BUILT_IN:
        known = ", ".join(kind.__name__ for kind in BUILT_IN)
        raise InputError(f"cannot join a {type(environment).__name__}; there are: {known}")
    kind = BUILT_IN.index(type(environment))
    members = (*_MEMBERS[:kind], environment, *_MEMBERS[kind + 1 :])
    return Surface._make((kind, environment.mass, *members))
