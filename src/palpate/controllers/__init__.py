"""Control laws: from measurements and a task to joint torques.

A controller is a part: a frozen NamedTuple of gains with ``start()``, the state before the first tick, and
``step(state, sense, task, model) -> (torque, state)``. Gains are `Vec3` for the planar arm, or arrays of shape (m,).
"""

from palpate.controllers.cautious_press import CautiousController, CautiousPress, cautious_on_bench
from palpate.controllers.controller import (
    AnyController,
    ControllerTable,
    alone,
    controller,
    controller_of,
    join,
)
from palpate.controllers.hybrid import (
    DecoupledHybrid,
    DecoupledHybridController,
    Hybrid,
    HybridController,
    ResolvedAcceleration,
)
from palpate.controllers.impedance import Impedance, ImpedanceController
from palpate.controllers.neural import Neural, NeuralController
from palpate.controllers.proportional_integral import ProportionalIntegral, ProportionalIntegralController

__all__ = [
    "AnyController",
    "CautiousController",
    "CautiousPress",
    "ControllerTable",
    "DecoupledHybrid",
    "DecoupledHybridController",
    "Hybrid",
    "HybridController",
    "Impedance",
    "ImpedanceController",
    "Neural",
    "NeuralController",
    "ProportionalIntegral",
    "ProportionalIntegralController",
    "ResolvedAcceleration",
    "alone",
    "cautious_on_bench",
    "controller",
    "controller_of",
    "join",
]
