"""A simulated arm under ROS 2, to rehearse with, without ROS: `python -m palpate_rehearsal.ros2_arm --domain 42`.

It publishes the wrench at /ft/wrench (the reaction, in the tool's axes), the tool's pose at /tcp/pose and, with
--joints, the joints of a UR5e at /joint_states. It moves as /command says, and rests after ten ticks of silence, as a
controller of ros2_control does after its time-out.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from palpate.press.setting import place_of
from palpate.robots import SerialArm
from palpate.wires.ros2 import SENT
from palpate_rehearsal.rehearsal import START, ToolAxisArm, arm_of, ready, ticks, words_of

_REST = 10
_DOWN = (1.0, 0.0, 0.0, 0.0)
"""The tool points down: turned by half a turn about x."""
_NAMES = ("elbow", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3")
"""Of a UR5e's joints, as its driver orders them: by the alphabet."""


class Joints:
    """A UR5e whose tip goes straight down, as far as the arm of one direction does."""

    def __init__(self) -> None:
        self.arm = SerialArm.named("ur5e")
        start = place_of(self.arm, None, np.array([0.0, 0.0, -1.0]))
        self.q, self.pose, self.depth = start.q, start.pose, 0.0

    def moved(self, depth: float) -> None:
        """The tip is so far below its start [m]."""
        self.q = self.q + self.rates(depth - self.depth)
        self.depth = depth

    def rates(self, speed: float) -> Any:
        """Of the joints for a speed downwards [m/s], and for a way likewise."""
        return np.linalg.solve(self.arm.jacobian(self.q), [0.0, 0.0, -speed, 0.0, 0.0, 0.0])

    def speed(self, rates: Any) -> float:
        """Downwards, of these joint speeds in the order of the arm's file [m/s]."""
        return -float(self.arm.jacobian(self.q)[2] @ np.asarray(rates))


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
        self._kind, self._joints, self._begun = kind, joints, time.time_ns()
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

    def speed_commanded(self, arm: ToolAxisArm) -> float | None:
        """The speed downwards that was commanded since [m/s]; None if nothing came."""
        speed = None
        for sample in self._commands.take(10):
            if type(sample) is self._taken:  # not what a writer leaves as it goes
                speed = self._speed(sample, arm)
        return speed

    def _speed(self, sample: Any, arm: ToolAxisArm) -> float:
        if self._kind == "twist":
            return -float(sample.twist.linear.z)
        if self._kind == "pose":
            return (START - float(sample.pose.position.z) - arm.command) / arm.world.tick
        if self._kind == "joint-speeds":
            assert self._joints is not None
            return self._joints.speed(sample.data)
        return -float(sample.data[2])

    def publish(self, arm: ToolAxisArm) -> None:
        """All that there is."""
        # Stamped by the arm's own clock, as a controller's cycle is.
        head = self._m.header(self._begun + round(1e9 * arm.time), "base")
        _, _, fz, *_, x, y, z = arm.reading()[:9]
        if self._joints is not None:
            self._joints.moved(arm.body.x)
            places = dict(zip(self._joints.arm.names, self._joints.q, strict=True))
            names = [f"{name}_joint" for name in _NAMES]
            self._states.write(self._m.joints(head, names, [places[name] for name in _NAMES]))
        self._pose.write(self._m.pose(head, (x, y, z), _DOWN))
        self._wrench.write(self._m.wrench(head, (0.0, 0.0, fz), (0.0, 0.0, 0.0)))


def serve(arm: ToolAxisArm, node: Node, seconds: float) -> None:
    """Run at real time until the seconds of the arm are over."""
    speed, silent = 0.0, 0
    for _ in ticks(arm, seconds):
        heard = node.speed_commanded(arm)
        silent = 0 if heard is not None else silent + 1
        speed = heard if heard is not None else (speed if silent < _REST else 0.0)
        arm.tick(speed)
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
    node = Node(told.domain, told.kind, Joints() if told.joints else None)
    ready(f"ros2:{told.domain}")
    serve(arm, node, told.seconds)


if __name__ == "__main__":
    main()
