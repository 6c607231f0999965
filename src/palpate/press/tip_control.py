"""The torques of an arm whose tip is controlled in six directions, by any controller of `palpate.controllers`."""

from typing import NamedTuple

from palpate._jit import kernel, law
from palpate._vector import Vec3, Vec6
from palpate.controllers.controller import controller
from palpate.robots.serial.task import into, joint_torque, task_model, tip_of
from palpate.signals.types import Sense


@controller
class Spring(NamedTuple):
    """F = K (x_d - x) - D xdot + h: a position with a spring in series, which the cautious law moves.

    Args:
        stiffness: K [N/m, N m/rad].
        damping: D [N s/m, N m s/rad].
    """

    stiffness: Vec6
    damping: Vec6

    def start(self):
        return 0.0

    def step(self, state, sense, task, model):
        return self.stiffness * (task.x - sense.x) - self.damping * sense.xd + model.h, state


@law
def half_turn(R):
    """Sine of the rotation's angle times its axis: the rotation vector for the small turns of a held tip [rad]."""
    return 0.5 * Vec3(R.r3.y - R.r2.z, R.r1.z - R.r3.x, R.r2.x - R.r1.y)


@law
def tip_torque(axes, held, control, state, force, task, damping, q, qd, found, own, torque):
    """Fills the joints' torques from encoders and force reading: the controller's state.

    Args:
        axes: of the task, in rows; the first is the surface's normal.
        held: axes of the tip when it stands as it should, in columns.
        control: in six directions.
        state: its own.
        force: reading along the normal [N].
        task: what is asked for, in the task's axes.
        damping: of joints to spare [1/s].
        q: measured [rad, m], shape (n,).
        qd: measured, shape (n,).
        found: what `described` says of these.
        own: room for the laws.
        torque: where it goes, shape (n,).
    """
    room, tip = found.room, tip_of(found, qd)
    model = task_model(axes, room, tip, own)
    x = into(axes, tip.p, half_turn(tip.R @ held.T))
    wrench = Vec6(Vec3(force, 0.0, 0.0), Vec3(0.0, 0.0, 0.0))
    sense = Sense(q, qd, x, into(axes, tip.v, tip.w), wrench)  # type: ignore[arg-type]
    F, state = control.step(state, sense, task, model)
    joint_torque(axes, room, model, own, F, damping, qd, torque)
    return state


compiled_tip_torque = kernel(tip_torque)
