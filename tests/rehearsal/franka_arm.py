"""A simulated arm that speaks as a Franka Research 3 does, to rehearse with: libfranka's protocol, on a loopback.

`python tests/rehearsal/franka_arm.py --address 127.0.0.10`. The protocol is franky-sim's (`pip install franky-sim`),
that of libfranka 0.18 and later; the libfranka of a Panda is refused as a Research 3 refuses it. Behind it stands an
arm whose tool keeps pointing down, moved by Cartesian velocities; joints follow. Every other kind of motion, a velocity
that turns the tool, and settings that would change what is simulated are refused, and named on standard error. As a
controller does, it ends the motion where 20 commands in a row are missing.
"""

import struct
import sys
from typing import Any

import numpy as np
from tool_axis_arm import REST, Joints, ToolAxisArm, arm_of, loopback, ready, ticks, turns, words_of

from palpate.errors import InputError

_RATE = 1000.0
_SAME = np.eye(4).ravel()
_USUAL: dict[str, dict[str, Any]] = {
    "SetEEToK": {"EE_T_K": _SAME},
    "SetNEToEE": {"NE_T_EE": _SAME},
    "SetLoad": {"m_load": 0.0},
    "SetJointImpedance": {"K_theta": (3000, 3000, 3000, 2500, 2500, 2000, 2000)},
    "SetCartesianImpedance": {"K_x": (3000, 3000, 3000, 300, 300, 300)},
}
"""Settings of libfranka's examples, which leave the simulated arm as it is, by command and field."""
_REJECTED = 2
"""Status of a setting whose argument a controller does not take."""
_MOST = 20
"""Commands missing in a row at which the motion ends (Franka Control Interface)."""
_COMMUNICATION_ERROR = 25
"""Index of `communication_constraints_violation` among libfranka's errors."""
_ERRORS = 41
"""Number of libfranka's errors."""


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
            self.velocity, self.silent, self.turned = REST, 0, False
            self.force_limits: Any = [np.inf] * 6
            self.joints = Joints("fr3", arm.reading()[6:9])
            self.reflex: int | None = None

        def cartesian_velocity_control(
            self, velocity: Any, _elbow: Any, has_new_command: bool = True
        ) -> None:
            self.silent = 0 if has_new_command else self.silent + 1
            self.velocity, self.turned = velocity[:3], turns(velocity)

        def joint_position_control(self, *_: Any, **__: Any) -> None:
            """Of the server, while no motion runs."""
            self.velocity, self.silent, self.turned = REST, 0, False

        def _get_state(self) -> Any:
            return InnerRobotState(tuple(self.joints.q), (0.0,) * 7, (0.0,) * 7)

        _torque_control = set_hand_goal = _get_hand_width = None  # abstract there, and never asked for

        def reset_motion_state(self) -> None:
            self.velocity, self.silent, self.turned = REST, 0, False

        @property
        def state(self) -> Any:
            reading = [float(v) for v in arm.reading()[:9]]
            q = tuple(self.joints.follow(reading[6:9]))
            pose = (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, *reading[6:9], 1.0)
            return FrankaRobotState(
                q=q, q_d=q, O_T_EE=pose, O_T_EE_d=pose, O_F_ext_hat_K=(*reading[:3], 0.0, 0.0, 0.0),
                control_command_success_rate=1.0, reflex_reason=tuple(i == self.reflex for i in range(_ERRORS)),
            )  # fmt: skip

    return FrankaRobot()


def server_of(robot: Any, address: str) -> Any:
    """Server of franky-sim's protocol that refuses what is not simulated, by name."""
    from franky_sim import FrankaRobotServer
    from franky_sim import franka_robot_protocol as protocol

    class FrankaServer(FrankaRobotServer):  # type: ignore[misc, unused-ignore]
        """Server that takes Cartesian velocities, and the settings that a controller starts with."""

        def start_motion(self, controller_mode: Any, motion_generator_mode: Any, motion_id: int) -> None:
            if motion_generator_mode.name != "kCartesianVelocity":
                asked = f"{controller_mode.name[1:]} with {motion_generator_mode.name[1:]}"
                # franky-sim prints it, and answers with an aborted motion.
                raise ValueError(f"a motion by {asked} is not simulated: Cartesian velocities alone")
            super().start_motion(controller_mode, motion_generator_mode, motion_id)

        def abort(self, why: str, reflex: int | None = None) -> None:
            """End the motion as a reflex does; the state that goes out before the answer has the error."""
            sys.stderr.write(f"franka_arm: {why}\n")
            motion, robot.reflex = self.current_motion_id, reflex
            self.send_state()
            self.stop_motion(send_preemption_signal=False)
            protocol.BaseCommand.send_response(
                self._tcp_socket, protocol.RobotCommand.kMove, motion, protocol.MoveStatus.kReflexAborted
            )
            self.reset_current_motion_id()

    def take_limits(command: Any, server: Any) -> None:
        robot.force_limits = command.upper_force_thresholds_nominal
        command.reply(0)

    protocol.SetCollisionBehaviorCommand.handle = take_limits
    for kind, usual in _USUAL.items():
        _refuse_others(getattr(protocol, f"{kind}Command"), usual)
    _check_version()
    return FrankaServer(robot, [address])


def _refuse_others(kind: Any, usual: dict[str, Any]) -> None:
    """Let a setting of franky-sim's protocol be taken only with the numbers of the arm that is simulated."""
    handle = kind.handle

    def strict(command: Any, server: Any) -> None:
        if all(np.allclose(getattr(command, name), value) for name, value in usual.items()):
            handle(command, server)
            return
        sys.stderr.write(f"franka_arm: {kind.__name__[:-7]} is simulated with its usual numbers alone\n")
        command.reply(_REJECTED)

    kind.handle = strict


def _check_version() -> None:
    """Refuse other versions of the protocol, as a controller does: franky-sim takes all, and speaks its own."""
    from franky_sim import franka_server

    handle = franka_server.ConnectCommand.handle

    def strict(command: Any, server: Any, command_type_struct: str = "I") -> None:
        if command.version == server.library_version:
            handle(command, server, command_type_struct)
            return
        sys.stderr.write(
            f"franka_arm: version {command.version} of the protocol is not that of libfranka 0.18 and later\n"
        )
        header = franka_server.MessageHeader(command.command_type, command.command_id, 8)
        refused = franka_server.ConnectStatus.kIncompatibleLibraryVersion.value
        body = struct.pack("<HH4x", refused, server.library_version)
        command.client_socket.sendall(header.to_bytes(command_type_struct=command_type_struct) + body)

    franka_server.ConnectCommand.handle = strict


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
        if server.current_motion_id and robot.silent > _MOST:
            server.abort(f"{_MOST} commands in a row are missing", _COMMUNICATION_ERROR)
        if server.current_motion_id and np.any(np.abs(arm.reading()[:6]) > robot.force_limits):
            server.abort("a force above the collision behaviour's upper threshold")
        if server.current_motion_id and robot.turned:
            server.abort("a velocity that turns the tool is not simulated")
        arm.tick(robot.velocity if server.current_motion_id else REST)
        try:
            server.send_state()
        except OSError:  # the client has gone; the next tick sees it
            continue


def main() -> None:
    """Read the words, and serve."""
    words = words_of("franka_arm", __doc__)
    words.add_argument("--address", default="127.0.0.10", help="of the loopback")
    words.set_defaults(arm="fr3")
    told = words.parse_args()
    address = loopback(words, told.address)
    arm = arm_of(told, (0.0, 0.0, 1.0))
    if arm.arm.rate != _RATE:
        words.error(f"--arm must be of {_RATE:g} Hz, as libfranka is, and {told.arm} is of {arm.arm.rate:g}")
    try:
        serve(arm, address, told.seconds)
    except (InputError, OSError) as error:
        words.error(str(error))


if __name__ == "__main__":
    main()
