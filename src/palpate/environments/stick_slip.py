"""Friction along the surface: a tip sticks to where it touched, and slides when pulled too hard."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import clip
from palpate.signals.types import coerce_fields, require


def _check(self):
    require(self.stiffness > 0, "tangential stiffness", "above 0 N/m", self.stiffness)
    require(self.damping >= 0, "tangential damping", "at least 0 N s/m", self.damping)
    require(self.friction >= 0, "friction coefficient", "at least 0", self.friction)


class StickSlipState(NamedTuple):
    """How far the bristle between tip and surface is bent [m]."""

    bend: float


@part
@coerce_fields(_check)
class StickSlip(NamedTuple):
    """A spring and a damper that the slide bends, within the Coulomb cone; sliding drags the anchor along.

    Args:
        stiffness: of the bristle [N/m].
        damping: of the bristle [N s/m].
        friction: Coulomb coefficient mu: |f_t| <= mu f_n.
    """

    stiffness: float
    damping: float
    friction: float

    def start(self):
        """The state at touch: anchored where the tip is."""
        return StickSlipState(0.0)

    def slide(self, state, slide_rate, normal_force, dt):
        """Tangential force on the tip [N] and the state, after dt at this rate [m/s] under this force [N]."""
        pull, bend = bristle(
            self.stiffness, self.damping, self.friction * max(normal_force, 0.0), state.bend, slide_rate, dt
        )
        return -pull, StickSlipState(bend)

    def bending_energy(self, state):
        """Energy in the bristle [J]."""
        return 0.5 * self.stiffness * state.bend * state.bend


@law
def bristle(stiffness, damping, limit, bend, rate, dt):
    """Pull on the surface and bend after a step; implicit, so that it gives back no more than it took.

    Sticking, the bend follows the tip. Sliding, the pull is the limit, and the bend is what that pull holds:
    limit = k bend' + b (bend' - bend)/dt.
    """
    pull = stiffness * (bend + dt * rate) + damping * rate
    held = clip(pull, limit)
    if held == pull:
        return pull, bend + dt * rate
    return held, (held * dt + damping * bend) / (stiffness * dt + damping)
