"""One elastic mode of an arm: deflection of its tip along x, between the pose of the joints and the actual one."""

import math
from typing import NamedTuple

from palpate._jit import part


@part
class ElasticState(NamedTuple):
    bend: float  # of the tip beyond where the joints put it [m]
    rate: float  # [m/s]


@part
class ElasticMode(NamedTuple):
    """A modal mass on a spring and a damper that the contact force drives: d'' + 2 zeta w d' + w^2 d = -mobility f.

    The joints' encoders do not see it. In modal coordinates the rigid arm feels the contact force as before; that
    torques excite the mode too is left out.

    Args:
        mobility: one over the modal mass [1/kg]; 0 makes a rigid arm.
        frequency: w, undamped [rad/s].
        damping: zeta.
    """

    mobility: float
    frequency: float
    damping: float

    def start(self):
        return ElasticState(0.0, 0.0)

    def acceleration(self, state):
        """Acceleration by spring and damper [m/s^2]."""
        return -self.frequency * (2.0 * self.damping * state.rate + self.frequency * state.bend)

    def step(self, state, acceleration, dt):
        """The state after dt [s]; semi-implicit Euler, as the arm's."""
        rate = state.rate + dt * acceleration
        return ElasticState(state.bend + dt * rate, rate)

    def struck(self, state, impulse):
        """The state after an impulse [N s] of the surface."""
        return ElasticState(state.bend, state.rate - self.mobility * impulse)


RIGID = ElasticMode(0.0, 0.0, 0.0)


def elastic_mode(stiffness: float, frequency: float, damping: float) -> ElasticMode:
    """The mode that gives way by 1/stiffness [m/N] at rest and swings at a frequency [Hz] with a damping ratio."""
    w = 2.0 * math.pi * frequency
    return ElasticMode(w * w / stiffness, w, float(damping))
