"""Simple forms of other laws of a slide, which take over from the sliding law when the force is held.

They keep its normal of that moment and its K_u. `fixed normal` turns neither; `normal from velocity` makes it
perpendicular to the way of the last 40 ms; `fzi-like` moves the tip by the force error as a vector, along the surface
against a spring of K_u to a target that moves as asked, without which friction would hold the tip; `admittance` has
a mass of three lags.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, sqrt
from palpate.force.law import gain
from palpate.force.sliding.slide_law import slide_step
from palpate.force.sliding.slide_state import (
    BOUND,
    NORMAL,
    PHASE,
    SIZE,
    SLIDE,
    Sliding,
    put_vector,
    unit,
    vector_at,
)

FIXED, FROM_VELOCITY, FZI, ADMITTANCE = 1.0, 2.0, 3.0, 4.0
FILTERED, LAST = SIZE, SIZE + 3
"""Places behind the law's state: the low-passed position, or that of the target; the last velocity."""


@part
class Rival(NamedTuple):
    """Another law from the held force on."""

    law: Sliding
    kind: float

    def step(self, s, work, desired, force, position, direction):
        """Velocity of a tick [m/s]."""
        if s[PHASE] != SLIDE:
            put_vector(s, FILTERED, position)
            put_vector(s, LAST, ZERO3)
            return slide_step(self.law, s, work, desired, force, position, direction, 0.0)
        velocity = rival_step(self.law, self.kind, s, desired, force, position, direction)
        put_vector(s, LAST, velocity)
        return velocity


@law
def rival_step(law, kind, s, desired, force, position, direction):
    """A tick of a rival: velocity [m/s]."""
    c, n, filtered = law.press, vector_at(s, NORMAL), vector_at(s, FILTERED)
    moved = position - filtered
    if kind != FZI:
        put_vector(s, FILTERED, filtered + 0.05 * c.tick / 2e-3 * moved)
    if kind == FROM_VELOCITY and sqrt(moved @ moved) > 5e-4:
        along = unit(moved, n)
        n = unit(n - 0.05 * (n @ along) * along, n)
        put_vector(s, NORMAL, n)
    flat = direction - (direction @ n) * n
    across = (law.speed / max(sqrt(flat @ flat), 0.1)) * flat
    g = gain(c, s[BOUND])
    if kind == FZI:  # the whole force error, and a spring to a target that moves along, move the tip
        put_vector(s, FILTERED, filtered + c.tick * across)
        behind = s[BOUND] * (filtered - position)
        return g * (desired * n - force + behind - (behind @ n) * n)
    if kind == ADMITTANCE:  # M dv/dt + B v = F_d - f.n with B = 1/g and M/B of three lags
        press = vector_at(s, LAST) @ n
        return (press + c.tick / (3.0 * c.theta) * (g * (desired - force @ n) - press)) * n + across
    return g * (desired - force @ n) * n + across


RIVALS = {
    name: partial(Rival, kind=kind)
    for name, kind in {
        "fixed normal": FIXED, "normal from velocity": FROM_VELOCITY, "fzi-like": FZI, "admittance": ADMITTANCE,
    }.items()
}  # fmt: skip
