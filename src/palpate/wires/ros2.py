"""The wire to an arm under ROS 2, by cyclonedds alone: wrench, pose or joints in; a twist, pose or array out."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Literal
from urllib.parse import parse_qsl

import msgspec

from palpate.errors import InputError, how_to_install
from palpate.signals.rotations import rotate
from palpate.wires.ros2_tool import JointTool, PoseTool, seconds
from palpate.wires.subprocess_wire import SubprocessWire
from palpate.wires.wire import (
    SILENCE,
    ArmReading,
    Command,
    ConnectionLostError,
    NoReadingError,
    Triple,
)

FORM = "ros2:DOMAIN?wrench=TOPIC&pose=TOPIC&command=TOPIC&as=twist&wrench-frame=tool&force-sign=reaction"
_KEPT = 32
_DISCOVERY_TIMEOUT = 2.0
"""Longest time until topics are found [s]."""
SENT = {
    "twist": "geometry_msgs/msg/TwistStamped",
    "pose": "geometry_msgs/msg/PoseStamped",
    "array": "std_msgs/msg/Float64MultiArray",
    "joint-speeds": "std_msgs/msg/Float64MultiArray",
}
"""Messages to send, by the option `as`."""


class Topics(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options of a wire to ROS 2; none of them is guessed.

    Args:
        wrench: topic of a WrenchStamped.
        pose: topic of a PoseStamped, of the tool in the arm's base; or instead
        joints: topic of a JointState, and
        arm: whose joints they are, as `palpate press --arm` takes it, and
        site: the tip of a file.
        command: topic that a controller listens at.
        kind: `twist` (TwistStamped), `pose` (PoseStamped), `array` (Float64MultiArray of a twist's six numbers), or
            `joint-speeds` (Float64MultiArray of a speed for each of the arm's joints, in the order of its file).
        wrench_frame: axes of the wrench: the arm's `base` or the `tool`.
        force_sign: `action` for what the tool exerts on the surface, `reaction` for the opposite.
    """

    wrench: str
    pose: str | None = None
    joints: str | None = None
    arm: str | None = None
    site: str | None = None
    command: str
    kind: Literal["twist", "pose", "array", "joint-speeds"] = msgspec.field(name="as")
    wrench_frame: Literal["base", "tool"] = msgspec.field(name="wrench-frame")
    force_sign: Literal["action", "reaction"] = msgspec.field(name="force-sign")

    def __post_init__(self) -> None:
        if (self.pose is None) == (self.joints is None):
            raise ValueError("needs pose=TOPIC, or joints=TOPIC&arm=ARM, and not both")
        if (self.joints is None) != (self.arm is None):
            raise ValueError("joints=TOPIC and arm=ARM belong together")
        if self.kind == "joint-speeds" and self.joints is None:
            raise ValueError("as=joint-speeds needs joints=TOPIC&arm=ARM: speeds of joints are of an arm")

    @property
    def place(self) -> str:
        """The topic that says where the tool is."""
        return str(self.pose or self.joints)


def topics_of(where: str) -> tuple[int, Topics]:
    """Domain and topics of an address behind `ros2:`.

    Raises:
        InputError: one of them is missing or none.
    """
    domain, _, query = where.partition("?")
    if not domain.isdecimal() or not 0 <= int(domain) <= 232:
        raise InputError(f"--wire needs {FORM}, with a domain from 0 to 232, got 'ros2:{where}'")
    try:
        return int(domain), msgspec.convert(dict(parse_qsl(query, keep_blank_values=True)), Topics)
    except msgspec.ValidationError as error:
        raise InputError(f"--wire {FORM}: {error}") from None


@dataclass
class _Ends:
    """Readers of a participant, and the maker of its writer."""

    wrench: Any
    place: Any
    writer: Callable[[float], Any]
    writers: Any
    waiting: Any


class Ros2Wire(SubprocessWire):
    """An arm under ROS 2, whose controller runs; commands come from a process of their own, which outlives this one.

    Args:
        where: domain and topics, see `topics_of`.

    Raises:
        InputError: cyclonedds is missing, or nothing publishes there.
    """

    def __init__(self, where: str):
        domain, _ = topics_of(where)
        if any(find_spec(name) is None for name in ("cyclonedds.idl", "rosbags")):
            raise InputError(f"this wire needs cyclonedds: {how_to_install('palpate[ros2]')}")
        super().__init__("host", ["ros2", where], f"nothing to read in ROS domain {domain}")


class DdsWire:
    """A ROS 2 wire in the process of the library.

    Args:
        domain: ROS_DOMAIN_ID.
        topics: by name.

    Raises:
        InputError: nothing publishes there.
    """

    def __init__(self, domain: int, topics: Topics):
        from palpate.wires import ros2_messages

        self._messages: Any = ros2_messages
        self._topics, self._domain = topics, domain
        self._tool: JointTool | PoseTool = JointTool(topics.arm, topics.site) if topics.arm else PoseTool()
        self._ends = _open(domain, topics, ros2_messages)
        self._last = -1.0
        self._command: Any = None
        self._commanded: Command | None = None
        try:
            self.read(_DISCOVERY_TIMEOUT)
        except ConnectionLostError as error:
            raise InputError(f"nothing to read in ROS domain {domain}: {error}") from None

    @property
    def title(self) -> str:
        """Name of the far end."""
        t = self._topics
        return f"an arm in ROS domain {self._domain}, {t.wrench} and {t.place} in, {t.kind} to {t.command}"

    @property
    def watchdog(self) -> str:
        """The arm's stop if this process dies."""
        return (
            "a second process sends a speed of 0 when it gets no command; if that dies too, only what the controller at"
            f" {self._topics.command} does when commands stop: look up its timeout. Commands have a deadline, a"
            " liveliness and a lifespan of the loop's lag, by which a controller can see that they ended"
        )

    @property
    def source(self) -> str:
        """Topic of the wrench."""
        return f" at {self._topics.wrench}"

    def read(self, timeout: float) -> ArmReading:
        """The next wrench, with the newest place of the tool."""
        end = time.monotonic() + timeout
        while (remaining := end - time.monotonic()) > 0:
            self._ends.waiting.wait(max(int(1e9 * remaining), 1))
            wrenches = self._ends.wrench.take(_KEPT)
            for sample in self._ends.place.take(_KEPT):
                if hasattr(sample, "header"):  # not one that a writer leaves as it goes
                    self._tool.take(sample)
            fresh = [sample for sample in wrenches if hasattr(sample, "wrench")]
            if fresh and self._tool.stamp is not None:
                sense = self._sense(fresh[-1])
                if sense is not None:
                    return sense
        lacking = self._topics.wrench if self._tool.stamp is not None else self._topics.place
        raise NoReadingError(f" at {lacking}", timeout)

    def _sense(self, sample: Any) -> ArmReading | None:
        received, stamp = time.monotonic(), seconds(sample.header.stamp)
        if not stamp > self._last:
            return None
        self._last = stamp
        position, quaternion = self._tool.place()
        sign = 1.0 if self._topics.force_sign == "action" else -1.0
        f, m = ((sign * v.x, sign * v.y, sign * v.z) for v in (sample.wrench.force, sample.wrench.torque))
        if self._topics.wrench_frame == "tool":
            f, m = rotate(quaternion, f), rotate(quaternion, m)
        return ArmReading(received, stamp, f, m, position, quaternion, stamp - float(self._tool.stamp or 0.0))

    def tare(self) -> None:
        """ROS 2 has no one way to zero a sensor."""

    def begin(self, silence: float = SILENCE) -> None:
        """Refuse another master, and a topic that nobody listens at."""
        name, writer = f"rt{self._topics.command}", self._ends.writer(silence)
        end = time.monotonic() + _DISCOVERY_TIMEOUT
        while not writer.get_matched_subscriptions():
            if time.monotonic() > end:
                raise InputError(f"nothing listens at {self._topics.command}; is the controller active?")
            time.sleep(0.02)
        other_writers = [
            sample
            for sample in self._ends.writers.take(1000)
            if getattr(sample, "topic_name", "") == name and sample.key != writer.guid
        ]
        if other_writers:
            raise InputError(f"{self._topics.command} has another master; end that one first")
        self._command, self._commanded = writer, None

    def write(self, command: Command) -> None:
        """Send a command as a message of the chosen kind."""
        self._commanded = command
        try:
            self._command.write(self._message(command.velocity, command.position))
        except Exception as error:  # noqa: BLE001 - cyclonedds has many, of no common base
            raise ConnectionLostError(f"a command could not be sent: {error}") from None

    def _message(self, velocity: Triple, position: Triple) -> Any:
        m, kind = self._messages, self._topics.kind
        if kind == "array":
            return m.numbers([*velocity, 0.0, 0.0, 0.0])
        if kind == "joint-speeds":
            return m.numbers(self._tool.speeds(velocity))
        head = m.header(time.time_ns(), self._tool.frame)
        if kind == "pose":
            return m.pose(head, position, self._tool.place()[1])
        return m.twist(head, velocity)

    def stop(self) -> None:
        """Send speed 0, or the place where the tool shall rest or else is, three times."""
        if self._command is None:
            return
        last, (position, _) = self._commanded, self._tool.place()
        if last is not None and not any(last.velocity):
            position = last.position
        for _ in range(3):
            try:
                self.write(Command((0.0, 0.0, 0.0), position))
            except ConnectionLostError:
                break
            time.sleep(0.002)
        self._command = None

    def close(self) -> None:
        """Leave the domain of DDS."""
        self.stop()
        self._ends = None  # type: ignore[assignment]


def _open(domain: int, topics: Topics, messages: Any) -> _Ends:
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
    from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    participant = DomainParticipant(domain)
    into = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(_KEPT))

    def topic(name: str, kind: str) -> Any:
        return Topic(participant, f"rt{name}", messages.message(kind))

    def writer(silence: float) -> Any:
        """A writer of commands, whose samples expire, and whose end is seen, after this silence [s]."""
        lag = round(1e9 * silence)
        out = Qos(
            Policy.Reliability.Reliable(10**8),
            Policy.History.KeepLast(1),
            Policy.Lifespan(lag),
            Policy.Deadline(lag),
            Policy.Liveliness.ManualByTopic(lag),
        )
        return DataWriter(participant, topic(topics.command, SENT[topics.kind]), qos=out)

    of_place = "geometry_msgs/msg/PoseStamped" if topics.pose else "sensor_msgs/msg/JointState"
    wrench = DataReader(participant, topic(topics.wrench, "geometry_msgs/msg/WrenchStamped"), qos=into)
    place = DataReader(participant, topic(topics.place, of_place), qos=into)
    waiting = WaitSet(participant)
    waiting.attach(ReadCondition(wrench, ViewState.Any | InstanceState.Alive | SampleState.NotRead))
    writers = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    return _Ends(wrench, place, writer, writers, waiting)
