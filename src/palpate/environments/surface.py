"""A surface's state, its table in an experiment, and one type for all of them, so that one compiled loop serves all."""

from functools import cache
from typing import Any, ClassVar, NamedTuple

from msgspec.structs import asdict

from palpate._jit import law, part
from palpate.errors import InputError
from palpate.signals.types import Table, example, kinds


class SurfaceTable(Table, tag_field="kind"):
    """The [surface] table of an experiment. Derive from it beside the part, with the word that is its `kind` as tag.

    ``part`` is the surface, whose fields bear the names of the table's.
    """

    part: ClassVar[type]

    def build(self) -> Any:
        """The surface that the table describes."""
        return self.part(**{name: float(value) for name, value in asdict(self).items()})


class SurfaceState(NamedTuple):
    """The surface along its normal."""

    deflection: float  # [m]
    rate: float  # [m/s]
    internal: float  # stretch of the relaxing branch's spring [m]; 0 where the model has none
    contact: float  # 1 in contact, 0 free


UNTOUCHED = SurfaceState(0.0, 0.0, 0.0, 0.0)


@law
def touch(state, v):
    """The state in contact, at the common velocity v; the next `relax` takes the deflection to the tip."""
    return SurfaceState(state.deflection, v, state.internal, 1.0)


@law
def part_from(state):
    """The state after parting: the surface keeps its place and its velocity."""
    return SurfaceState(state.deflection, state.rate, state.internal, 0.0)


@law
def impact(tip_mass, surface_mass, tip_velocity, surface_velocity):
    """Common velocity [m/s] after an inelastic impact and the impulse [N s] that the tip gives."""
    common = (tip_mass * tip_velocity + surface_mass * surface_velocity) / (tip_mass + surface_mass)
    return common, surface_mass * (common - surface_velocity)


@law
def opposing(surface, state, p, v, dt):
    """Force [N] and mass [kg] with which a surface opposes a tip that moves with it: the two for `contact_force`.

    Steps of dt leave the rate half a step behind p: at p it is v + a dt/2, so that damping acts as a mass of
    dt/2 times itself. Where it is not proportional to the rate it is taken as the slope over a millimetre a second.

    Args:
        surface: the law of it.
        state: at the moment of p.
        p: penetration now [m].
        v: its rate dt/2 ago [m/s].
        dt: [s].
    """
    force = surface.force(state, p, v)
    damping = (surface.force(state, p, v + 1e-3) - force) / 1e-3
    return force, surface.mass + 0.5 * dt * damping


@law
def contact_force(force, surface_mass, tip_mass, free_acceleration):
    """Force [N] between tip and surface that move together; negative: they are about to part.

    Args:
        force: the surface's own, without inertia [N].
        surface_mass: mass that moves with the tip [kg].
        tip_mass: effective mass of the tip along the normal, 1/(n^T J M^-1 J^T n) of an arm [kg].
        free_acceleration: of the tip into the surface if there were no normal contact force [m/s^2].
    """
    return (force + surface_mass * free_acceleration) * (tip_mass / (tip_mass + surface_mass))


@law
def follow(surface, state, force, p, v, tip_mass, dt):
    """The surface after a step that took the tip to p [m] at v [m/s], and the impulse of an impact, else 0 [N s].

    Args:
        surface: the law of it.
        state: before the step.
        force: between the two during the step [N]; where it is negative they part.
        p: penetration of the tip [m].
        v: its rate before an impact [m/s].
        tip_mass: effective mass of the tip along the normal [kg].
        dt: [s].
    """
    if force < 0.0:
        state = part_from(state)
    if state.contact == 1.0:
        return surface.relax(state, p, v, dt), 0.0
    state = surface.free(state, dt)
    if p >= state.deflection and v > state.rate:
        common, impulse = impact(tip_mass, surface.mass, v, state.rate)
        return touch(state, common), impulse
    return state, 0.0


@law
def implicitness(mass, damping, stiffness, dt):
    """Weight of the new state in a step: 1/2 (second order), towards 1 where the step outlasts the decay.

    With it no decay changes its sign from step to step, however stiff; without mass it is 1.
    """
    if mass == 0.0:
        return 1.0
    reach = dt * (damping + dt * stiffness)
    return 1.0 - mass / reach if reach > 2.0 * mass else 0.5


@law
def swing(mass, damping, stiffness, load, s, v, weight, dt):
    """Deflection and rate after a free step of m s'' + b s' + k s + load = 0.

    The mean rate r over the step solves m (v1 - v)/dt + b r + k (s + weight dt r) + load = 0 with
    r = v + weight (v1 - v): energy never grows for weight >= 1/2.
    """
    inertia = mass / (weight * dt)
    push = inertia * v - stiffness * s - load
    resistance = inertia + damping + weight * dt * stiffness
    rate = push / resistance if resistance > 0.0 else 0.0
    return s + dt * rate, v + (rate - v) / weight


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
