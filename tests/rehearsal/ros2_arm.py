"""A simulated arm under ROS 2, to rehearse with, without ROS: `python tests/rehearsal/ros2_arm.py --domain 42`.

It publishes the wrench at /ft/wrench (the reaction, in the tool's axes), the tool's pose at /tcp/pose and, with
--joints, the joints of a UR5e at /joint_states. It moves as /command says, and rests after ten ticks of silence, as a
controller of ros2_control does after its time-out. The tool keeps pointing down: a command that turns it is named on
standard error, and the arm rests.
"""

import sys
import time
from typing import Any

import numpy as np
from tool_axis_arm import REST, Joints, ToolAxisArm, arm_of, ready, ticks, turns, words_of

from palpate.wires.ros2 import SENT

_SILENT = 10
"""Ticks without a command after which it rests."""
_DOWN = (1.0, 0.0, 0.0, 0.0)
"""The tool points down: turned by half a turn about x."""
_NAMES = ("elbow", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3")
"""Of a UR5e's joints, as its driver orders them: by the alphabet."""


class Node:
    """Publishers and subscribers.

    Args:
        domain: ROS_DOMAIN_ID.
        kind: of the commands, as `as` of the wire's address says it.
        joints: those of an arm, if they are published.
    """

    def __init__(self, domain: int, kind: str, joints: Joints | None):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from palpate.wires import ros2_messages

        self._m: Any = ros2_messages
        self._kind, self._joints, self._begun, self._named = kind, joints, time.time_ns(), False
        participant = DomainParticipant(domain)
        qos = Qos(Policy.Reliability.Reliable(10**8), Policy.History.KeepLast(1))

        def topic(name: str, type_: str) -> Any:
            return Topic(participant, f"rt{name}", ros2_messages.message(type_))

        self._wrench = DataWriter(
            participant, topic("/ft/wrench", "geometry_msgs/msg/WrenchStamped"), qos=qos
        )
        self._pose = DataWriter(participant, topic("/tcp/pose", "geometry_msgs/msg/PoseStamped"), qos=qos)
        self._states = DataWriter(participant, topic("/joint_states", "sensor_msgs/msg/JointState"), qos=qos)
        self._taken = ros2_messages.message(SENT[kind])
        self._commands = DataReader(participant, topic("/command", SENT[kind]), qos=qos)

    def velocity_commanded(self, arm: ToolAxisArm) -> Any:
        """The velocity that was commanded since, shape (3,) [m/s]; None if nothing came."""
        twist = None
        for sample in self._commands.take(10):
            if type(sample) is self._taken:  # not what a writer leaves as it goes
                twist = self._twist(sample, arm)
        if twist is None or not turns(twist):
            return None if twist is None else twist[:3]
        if not self._named:
            sys.stderr.write("ros2_arm: a command that turns the tool is not simulated: the arm rests\n")
        self._named = True
        return REST

    def _twist(self, sample: Any, arm: ToolAxisArm) -> Any:
        """Velocity of the tool in the base, linear above turning, shape (6,)."""
        if self._kind == "twist":
            lin, ang = sample.twist.linear, sample.twist.angular
            return np.array([lin.x, lin.y, lin.z, ang.x, ang.y, ang.z])
        if self._kind == "pose":
            at, turn = sample.pose.position, sample.pose.orientation
            away = np.hypot(np.hypot(turn.y, turn.z), turn.w)  # of _DOWN, half the angle
            return np.array([*arm.velocity_to((at.x, at.y, at.z)), away, 0.0, 0.0])
        if self._kind == "joint-speeds":
            assert self._joints is not None
            return self._joints.arm.jacobian(self._joints.q) @ np.asarray(sample.data)
        return np.array(sample.data)

    def publish(self, arm: ToolAxisArm) -> None:
        """All that there is."""
        # Stamped by the arm's own clock, as a controller's cycle is.
        head = self._m.header(self._begun + round(1e9 * arm.time), "base")
        fx, fy, fz, *_, x, y, z = arm.reading()[:9]
        if self._joints is not None:
            places = dict(zip(self._joints.arm.names, self._joints.follow((x, y, z)), strict=True))
            names = [f"{name}_joint" for name in _NAMES]
            self._states.write(self._m.joints(head, names, [places[name] for name in _NAMES]))
        self._pose.write(self._m.pose(head, (x, y, z), _DOWN))
        self._wrench.write(self._m.wrench(head, (-fx, fy, fz), (0.0, 0.0, 0.0)))


def serve(arm: ToolAxisArm, node: Node, seconds: float) -> None:
    """Run at real time until the seconds of the arm are over."""
    velocity, silent = REST, 0
    for _ in ticks(arm, seconds):
        heard = node.velocity_commanded(arm)
        silent = 0 if heard is not None else silent + 1
        velocity = heard if heard is not None else (velocity if silent < _SILENT else REST)
        arm.tick(velocity)
        node.publish(arm)


def main() -> None:
    """Read the words, and serve."""
    words = words_of("ros2_arm", __doc__)
    words.add_argument("--domain", type=int, required=True, help="ROS_DOMAIN_ID")
    words.add_argument(
        "--as", dest="kind", choices=list(SENT), default="twist", help="what comes at /command"
    )
    words.add_argument("--joints", action="store_true", help="publish a UR5e's joints too")
    told = words.parse_args()
    if told.kind == "joint-speeds" and not told.joints:
        words.error("--as joint-speeds needs --joints")
    arm = arm_of(told, (0.0, 0.0, 1.0))
    node = Node(told.domain, told.kind, Joints("ur5e", arm.reading()[6:9]) if told.joints else None)
    ready(f"ros2:{told.domain}")
    serve(arm, node, told.seconds)


if __name__ == "__main__":
    main()
