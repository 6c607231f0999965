"""Control laws: from what is sensed and what is asked for to joint torques.

A controller is a part: a frozen NamedTuple of gains with ``start()``, the state before the first tick, and
``step(state, sense, task, model) -> (torque, state)``. Gains are `Vec3` for the planar arm, or arrays of shape (m,).
"""

from palpate.controllers.any_controller import AnyController, join
from palpate.controllers.controller import controller
from palpate.controllers.hybrid import Hybrid
from palpate.controllers.neural import Neural
from palpate.controllers.resolved_acceleration import ResolvedAcceleration

__all__ = ["AnyController", "Hybrid", "Neural", "ResolvedAcceleration", "controller", "join"]
