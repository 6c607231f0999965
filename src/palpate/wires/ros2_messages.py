"""Messages of ROS 2 as DDS types, byte for byte as ROS 2 itself sends them.

Their fields are those of the definitions that rosbags carries; here stands only how a definition becomes a DDS type.
Needs cyclonedds and rosbags.
"""

from dataclasses import dataclass
from functools import cache
from types import new_class
from typing import Any

from cyclonedds.idl import IdlStruct, types
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

_BASES = {"string": str, "float64": types.float64, "int32": types.int32, "uint32": types.uint32}
"""Types of the fields of arms' messages."""


@cache
def message(name: str) -> Any:
    """The class of a message, such as `geometry_msgs/msg/WrenchStamped`; its fields are its arguments, in order."""
    package, kind, short = name.split("/")
    _, fields = _definitions()[name]
    typed = {field: _type(definition) for field, definition in fields}
    cls = new_class(
        short,
        (IdlStruct,),
        {"typename": f"{package}::{kind}::dds_::{short}_"},
        lambda body: body.update(__annotations__=typed, __module__=__name__),
    )
    return dataclass(cls)


@cache
def _definitions() -> Any:
    return get_typestore(Stores.ROS2_HUMBLE).fielddefs


def _type(definition: Any) -> Any:
    kind, details = definition
    if kind == Nodetype.BASE:
        return _BASES[details[0]]
    if kind == Nodetype.NAME:
        return message(details)
    assert kind == Nodetype.SEQUENCE, kind
    return types.sequence[_type(details[0])]


def header(nanoseconds: int, frame: str) -> Any:
    """A header of a time since 1970 and a frame."""
    stamp = message("builtin_interfaces/msg/Time")(*divmod(nanoseconds, 10**9))
    return message("std_msgs/msg/Header")(stamp, frame)


def vector(values: Any) -> Any:
    """Message of three numbers."""
    return message("geometry_msgs/msg/Vector3")(*map(float, values))


def wrench(head: Any, force: Any, torque: Any) -> Any:
    """A WrenchStamped of a force [N] and a torque [N m]."""
    content = message("geometry_msgs/msg/Wrench")(vector(force), vector(torque))
    return message("geometry_msgs/msg/WrenchStamped")(head, content)


def pose(head: Any, position: Any, quaternion: Any) -> Any:
    """A PoseStamped of a position [m] and a quaternion x, y, z, w."""
    point = message("geometry_msgs/msg/Point")(*map(float, position))
    turn = message("geometry_msgs/msg/Quaternion")(*map(float, quaternion))
    return message("geometry_msgs/msg/PoseStamped")(head, message("geometry_msgs/msg/Pose")(point, turn))


def twist(head: Any, velocity: Any) -> Any:
    """A TwistStamped of a speed [m/s] that does not turn."""
    content = message("geometry_msgs/msg/Twist")(vector(velocity), vector((0.0, 0.0, 0.0)))
    return message("geometry_msgs/msg/TwistStamped")(head, content)


def joints(head: Any, names: list[str], positions: Any) -> Any:
    """A JointState of positions alone [rad, or m where a joint slides]."""
    return message("sensor_msgs/msg/JointState")(head, names, [float(q) for q in positions], [], [])


def numbers(values: Any) -> Any:
    """A Float64MultiArray of numbers without a layout."""
    layout = message("std_msgs/msg/MultiArrayLayout")([], 0)
    return message("std_msgs/msg/Float64MultiArray")(layout, [float(v) for v in values])
