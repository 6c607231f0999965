"""A simulated arm that speaks as a Franka does, to rehearse with: libfranka's protocol, on a loopback address.

`python -m palpate_rehearsal.franka_arm --address 127.0.0.10`. The protocol is franky-sim's (`pip install franky-sim`),
by which libfranka cannot tell it from a controller; behind it stands an arm of one direction, moved by Cartesian
velocities. Every other kind of motion is refused, and named on standard error. As a controller does, it ends the motion
where 20 commands in a row are missing.
"""

from __future__ import annotations

from typing import Any

from palpate.errors import InputError
from palpate_rehearsal.rehearsal import ToolAxisArm, arm_of, loopback, ready, ticks, words_of

_Q = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
_RATE = 1000.0
_MOST = 20
"""Commands missing in a row at which the motion ends (Franka Control Interface)."""


def robot_of(arm: ToolAxisArm) -> Any:
    """Robot for franky-sim's server, with the arm of one direction behind it."""
    try:
        from franky_sim import BaseRobot
        from franky_sim.base_simulator import InnerRobotState
        from franky_sim.franka_robot_state import FrankaRobotState
    except ImportError:
        raise InputError("this arm needs franky-sim: pip install franky-sim") from None

    class FrankaRobot(BaseRobot):  # type: ignore[misc, unused-ignore]
        """The arm; its tool points down."""

        def __init__(self) -> None:
            super().__init__(has_gripper=False)
            self.speed, self.silent = 0.0, 0

        def cartesian_velocity_control(
            self, velocity: Any, _elbow: Any, has_new_command: bool = True
        ) -> None:
            self.silent = 0 if has_new_command else self.silent + 1
            self.speed = -float(velocity[2])

        def joint_position_control(self, *_: Any, **__: Any) -> None:
            """Of the server, while no motion runs."""
            self.speed, self.silent = 0.0, 0

        def _get_state(self) -> Any:
            return InnerRobotState(_Q, (0.0,) * 7, (0.0,) * 7)

        _torque_control = set_hand_goal = _get_hand_width = None  # abstract there, and never asked for

        def reset_motion_state(self) -> None:
            self.speed, self.silent = 0.0, 0

        @property
        def state(self) -> Any:
            reading = [float(v) for v in arm.reading()[:9]]
            pose = (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, *reading[6:9], 1.0)
            return FrankaRobotState(
                q=_Q, q_d=_Q, O_T_EE=pose, O_T_EE_d=pose, O_F_ext_hat_K=(*reading[:3], 0.0, 0.0, 0.0),
                control_command_success_rate=1.0,
            )  # fmt: skip

    return FrankaRobot()


def server_of(robot: Any, address: str) -> Any:
    """Server of franky-sim's protocol that refuses each motion but that by Cartesian velocities."""
    from franky_sim import FrankaRobotServer

    class FrankaServer(FrankaRobotServer):  # type: ignore[misc, unused-ignore]
        """Server that refuses all but Cartesian velocities."""

        def start_motion(self, controller_mode: Any, motion_generator_mode: Any, motion_id: int) -> None:
            if motion_generator_mode.name != "kCartesianVelocity":
                asked = f"{controller_mode.name[1:]} with {motion_generator_mode.name[1:]}"
                # franky-sim prints it, and answers with an aborted motion.
                raise ValueError(f"a motion by {asked} is not simulated: Cartesian velocities alone")
            super().start_motion(controller_mode, motion_generator_mode, motion_id)

    return FrankaServer(robot, [address])


def serve(arm: ToolAxisArm, address: str, seconds: float) -> None:
    """Run at real time until the seconds of the arm are over.

    Args:
        arm: the simulated arm.
        address: of the loopback.
        seconds: of the arm's time.
    """
    robot = robot_of(arm)
    server = server_of(robot, address)
    server.init()
    ready(f"franka:{address}")
    for _ in ticks(arm, seconds):
        server.process_commands()
        if robot.silent > _MOST:
            server.stop_motion()
        arm.tick(robot.speed if server.current_motion_id else 0.0)
        try:
            server.send_state()
        except OSError:  # the client has gone; the next tick sees it
            continue


def main() -> None:
    """Read the words, and serve."""
    words = words_of("franka_arm", __doc__)
    words.add_argument("--address", default="127.0.0.10", help="of the loopback")
    told = words.parse_args()
    address = loopback(words, told.address)
    arm = arm_of(told, (0.0, 0.0, 1.0))
    if arm.arm.rate != _RATE:
        words.error(f"--arm must be of {_RATE:g} Hz, as libfranka is, and {told.arm} is of {arm.arm.rate:g}")
    try:
        serve(arm, address, told.seconds)
    except InputError as error:
        words.error(str(error))


if __name__ == "__main__":
    main()
