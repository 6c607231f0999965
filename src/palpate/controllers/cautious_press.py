"""The cautious force law on the planar arm: the law moves the far end of a stiff spring along x."""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, clip
from palpate.controllers.controller import ControllerTable, controller
from palpate.force.arm import Arm, Limits, TorqueLoop, load_arm
from palpate.force.gains import gains_for
from palpate.force.law import Cautious, CautiousState
from palpate.signals.types import NotNegativeTriple, Positive, PositiveTriple, triple


@part
class CautiousPressState(NamedTuple):
    """State of `CautiousPress` between two ticks."""

    inner: CautiousState
    x_c: float  # far end of the spring [m]
    touch: Vec3  # pose at the touch [m, m, rad]
    ticks: float


@law
def without_last_joint(J):
    """J_w: the rows of x and y as they are while the last joint keeps the angle of its link.

    That joint's rate is filtered, and late by 15 ms; left in, the spring would have to be ten times softer.
    """
    return Mat3(J.r1 - J.r1.z * J.r3, J.r2 - J.r2.z * J.r3, J.r3)


@controller
class CautiousPress(NamedTuple):
    """tau = J_w^T f + h, f_x = K_p (x_c - x) - D (xdot - v/2), v the cautious law's speed of x_c.

    J^T and no inverse dynamics: where friction holds joint 1, M J^-1 would turn motor 2 the wrong way.

    Args:
        law: the cautious law.
        stiffness: K_p, K_y, K_phi [N/m, N/m, N m/rad].
        damping: D, D_y, D_phi.
        room: farthest that x_c may be from x [m]; keeps it from winding up.
        tick: time between steps [s].
    """

    law: Cautious
    stiffness: Vec3
    damping: Vec3
    room: float
    tick: float

    def start(self):
        return CautiousPressState(self.law.start(), 0.0, 0.0 * self.stiffness, 0.0)

    def step(self, state, sense, task, model):
        x, force = sense.x.x, sense.f.x
        x_c = state.x_c if state.ticks > 0.0 else x + force / self.stiffness.x
        touch = state.touch if state.ticks > 0.0 else sense.x
        v, inner = self.law.step(state.inner, task.f.x, force, x)
        x_c = x + clip(x_c + self.tick * v - x, self.room)
        J_w = without_last_joint(model.J)
        rate = J_w @ sense.qd - Vec3(0.5 * v, 0.0, 0.0)
        target = Vec3(x_c, touch.y, touch.z)
        pull = self.stiffness * (target - sense.x) - self.damping * rate
        return J_w.T @ pull + model.h, CautiousPressState(inner, x_c, touch, state.ticks + 1.0)

    def report(self, state):
        """Nothing learned of force; K_u [N/m], phase, evidence of a contact."""
        inner = state.inner
        return Vec3(0.0, 0.0, 0.0), Vec3(inner.bound.used, inner.stage.phase, inner.watch.evidence)


class CautiousController(ControllerTable, tag="cautious"):
    """A stiff spring whose far end the cautious force law moves; it learns the surface and needs no prior of it."""

    spring: PositiveTriple = (1e5, 2e4, 4.0)
    """K_p, K_y, K_phi [N/m, N/m, N m/rad]."""
    damping: NotNegativeTriple = (1450.0, 1000.0, 0.1)
    """Of the three."""
    force: Positive = 20.0
    """The smallest that is asked for [N]."""
    cap: Positive = 4e5
    """The largest possible stiffness [N/m]."""
    room: Positive = 80.0
    """Farthest that the spring is drawn beyond what is felt [N]."""

    def build(self, tick: float, wall: float) -> CautiousPress:
        """The part, for a time between ticks [s] and a surface at x = `wall` [m]."""
        return cautious_on_bench(tick, self.spring, self.damping, self.force, self.cap, self.room)


def cautious_on_bench(tick, spring, damping, force, cap, room):
    """The controller for the bench's arm, its lag worked out for this spring.

    Args:
        tick: time between steps [s].
        spring: K_p, K_y, K_phi [N/m, N/m, N m/rad].
        damping: of the three.
        force: smallest that is asked for [N].
        cap: largest possible stiffness [N/m].
        room: force by which the spring may be drawn beyond what is felt [N].
    """
    gains = gains_on_bench(tick, spring, damping, force, cap)
    return CautiousPress(
        gains.cautious(), triple(spring), triple(damping), room / float(spring[0]), float(tick)
    )


def gains_on_bench(tick, spring, damping, force, cap):
    """The gains of that law, as `palpate.force.certify` takes them; arguments as `cautious_on_bench` has them."""
    own = load_arm("thesis")
    assert isinstance(own.inner, TorqueLoop)
    inner = TorqueLoop(
        mass=own.inner.mass, stiffness=float(spring[0]), damping=float(damping[0]), delay=float(tick)
    )
    limits = Limits(speed=own.limits.speed, stiffness=float(cap))
    arm = Arm(title=own.title, rate=1.0 / tick, inner=inner, sensor=own.sensor, limits=limits)
    return gains_for(arm, float(force))
