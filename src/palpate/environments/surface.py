"""One type for every surface that an experiment can ask for, so that one compiled loop serves them all."""

from functools import cache
from typing import Any, NamedTuple

from palpate._jit import part
from palpate.environments.surface_state import UNTOUCHED, SurfaceState, SurfaceTable
from palpate.errors import InputError
from palpate.signals.types import example, kinds


@cache
def members() -> tuple[Any, ...]:
    """One of each surface, with any numbers: the type is what counts."""
    return tuple(example(kind).build() for kind in kinds(SurfaceTable))


@part
class Surface(NamedTuple):
    """One of two surfaces, of which the second may again be one of two; `join` makes it.

    Args:
        chosen: 1 if the first is meant, 0 if it is the second.
        mass: the mass of the one that is meant [kg].
        first: a surface.
        second: another one.
    """

    chosen: int
    mass: float
    first: Any
    second: Any

    def start(self):
        return UNTOUCHED

    def force(self, state, p, v):
        """Force on the surface at penetration p [m] and rate v [m/s], inertia left out [N]."""
        if self.chosen == 1:
            return self.first.force(state, p, v)
        return self.second.force(state, p, v)

    def relax(self, state, p, v, dt):
        """The state after a step in contact that ended at p, v."""
        if self.chosen == 1:
            return self.first.relax(state, p, v, dt)
        return self.second.relax(state, p, v, dt)

    def free(self, state, dt):
        """The state after a free step."""
        if self.chosen == 1:
            return self.first.free(state, dt)
        return self.second.free(state, dt)

    def stored_energy(self, state):
        """Energy that can be given back, motion of the mass included [J]."""
        if self.chosen == 1:
            return self.first.stored_energy(state)
        return self.second.stored_energy(state)

    def truth(self):
        """Parameter names with value and unit, for reports."""
        return (self.first if self.chosen == 1 else self.second).truth()


def join(one: Any) -> Surface:
    """The surface that behaves as this one and has the same type for every one of `members`.

    Raises:
        InputError: an experiment cannot ask for such a surface.
    """
    types = [type(member) for member in members()]
    if type(one) not in types:
        known = ", ".join(kind.__name__ for kind in types)
        raise InputError(f"cannot join a {type(one).__name__}; there are: {known}")
    *others, joined = [one if type(member) is type(one) else member for member in members()]
    for first in reversed(others):
        joined = Surface(int(first is one), one.mass, first, joined)
    return joined


def surface_of(table: Any) -> Any:
    """The surface of a table: those that come with palpate in their one type, a user's own as it is."""
    one = table.build()
    return join(one) if isinstance(table, SurfaceTable) else one


def alone(surface: Any) -> Any:
    """The surface that is meant, taken out of what `join` made."""
    while isinstance(surface, Surface):
        surface = surface.first if surface.chosen == 1 else surface.second
    return surface


SHALLOW = 1e-6
"""Depth at which the search begins [m]."""


DEEPEST = 10.0
"""Depth at which it is given up [m]."""


def rest_for(surface: Any, force: float, rate: float) -> float:
    """Penetration [m] at which a relaxed surface moving at a rate [m/s] carries a force [N], without inertia.

    Negative if the damping alone carries more than that.

    Raises:
        InputError: no depth within metres carries it.
    """
    from scipy.optimize import brentq

    def short(depth: float) -> float:
        return float(surface.force(SurfaceState(depth, rate, 0.0, 1.0), depth, rate)) - force

    bound = SHALLOW if short(0.0) < 0.0 else -SHALLOW
    while short(0.0) * short(bound) > 0.0:
        bound *= 2.0
        if abs(bound) > DEEPEST:
            raise InputError(
                f"no depth of the new surface carries the {force:g} N of the old one; change the surface"
            )
    return float(brentq(short, 0.0, bound, xtol=1e-18, rtol=1e-15))
