"""Control laws: from what is sensed and what is asked for to joint torques.

A controller is a part: a frozen NamedTuple of gains with ``start()``, the state before the first tick, and
``step(state, sense, task, model) -> (torque, state)``. Gains are `Vec3` for the planar arm, or arrays of shape (m,).
"""

from palpate.controllers.any_controller import AnyController, join
from palpate.controllers.cautious_press import CautiousPress, cautious_on_bench
from palpate.controllers.controller import controller
from palpate.controllers.decoupled_hybrid import DecoupledHybrid
from palpate.controllers.hybrid import Hybrid
from palpate.controllers.impedance import Impedance
from palpate.controllers.neural import Neural
from palpate.controllers.proportional_integral import ProportionalIntegral
from palpate.controllers.raibert_craig import RaibertCraig
from palpate.controllers.resolved_acceleration import ResolvedAcceleration
from palpate.controllers.self_tuning import SelfTuning

__all__ = [
    "AnyController",
    "CautiousPress",
    "DecoupledHybrid",
    "Hybrid",
    "Impedance",
    "Neural",
    "ProportionalIntegral",
    "RaibertCraig",
    "ResolvedAcceleration",
    "SelfTuning",
    "cautious_on_bench",
    "controller",
    "join",
]
