"""Place of an arm's tool from ROS 2 messages: its pose, or the positions of the arm's joints."""

from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.signals.rotations import quaternion_from_columns
from palpate.wires.wire import ConnectionLostError, Quaternion, Triple, triple

_MIN_SINGULAR_VALUE = 0.02
"""Smallest singular value of the Jacobian at which joints are still moved [m]: there 20 mm/s take a joint 1 rad/s."""


class PoseTool:
    """Tool's pose by messages of PoseStamped."""

    def __init__(self) -> None:
        self.stamp: float | None = None
        self.frame = ""
        self._pose: Any = None

    def take(self, sample: Any) -> None:
        """Take a message in."""
        self.stamp, self.frame, self._pose = seconds(sample.header.stamp), sample.header.frame_id, sample.pose

    def place(self) -> tuple[Triple, Quaternion]:
        """Position and orientation as received."""
        p, o = self._pose.position, self._pose.orientation
        return (p.x, p.y, p.z), (o.x, o.y, o.z, o.w)

    def speeds(self, velocity: Triple) -> list[float]:
        """Raise NotImplementedError: a pose contains no joints."""
        raise NotImplementedError


class JointTool:
    """Place of the tool by JointState and the arm's kinematics.

    Args:
        name: of the arm, or its file.
        site: the tip of a file.

    Raises:
        InputError: no such arm.
    """

    def __init__(self, name: str, site: str | None):
        from palpate.press.prepare import arm_of

        self._arm = arm_of(name, site)
        self.stamp: float | None = None
        self.frame = ""
        self._q = np.array(self._arm.home)
        self._names: list[str] = []
        self._order: list[int] = []

    def take(self, sample: Any) -> None:
        """Take a message in; others may bring other joints, as those of a gripper."""
        if sample.name != self._names:
            self._names, self._order = list(sample.name), joint_order(self._arm.names, sample.name)
        if not self._order or len(sample.position) < len(sample.name):
            return
        self._q = np.array([sample.position[i] for i in self._order])
        self.stamp, self.frame = seconds(sample.header.stamp), sample.header.frame_id

    def place(self) -> tuple[Triple, Quaternion]:
        """Position and orientation by forward kinematics."""
        pose = self._arm.forward_kinematics(self._q)
        return triple(pose[:3, 3]), quaternion_from_columns(pose.T.ravel().tolist())

    def speeds(self, velocity: Triple) -> list[float]:
        """The smallest joint speeds that do it, J^+ (v, 0); none is needed for rest."""
        if not any(velocity):
            return [0.0] * len(self._q)
        J = self._arm.jacobian(self._q)
        if self._arm.singular_values(self._q)[-1] < _MIN_SINGULAR_VALUE:
            raise ConnectionLostError(
                "the arm is nearly singular there: the smallest singular value of its Jacobian is below"
                f" {_MIN_SINGULAR_VALUE:g}; press elsewhere"
            )
        rates = np.linalg.lstsq(J, np.array([*velocity, 0.0, 0.0, 0.0]), rcond=None)[0]
        return rates.tolist()


def joint_order(wanted: tuple[str, ...], names: list[str]) -> list[int]:
    """Indices of an arm's joints in a message, found by name, since drivers order them differently.

    A driver may write more around a name, as `left_shoulder_pan_joint` for `shoulder_pan`.

    Returns:
        Places; nothing if the message has none of them.

    Raises:
        InputError: a joint is missing, or several could be it.
    """
    places = []
    for name in wanted:
        exact = [i for i, full_name in enumerate(names) if full_name == name]
        matches = exact or [i for i, full_name in enumerate(names) if name in full_name]
        if len(matches) == 1:
            places.append(matches[0])
        elif places or len(matches) > 1:
            raise InputError(f"joint {name} of the arm is not one of {', '.join(names)}; is it another arm?")
    if places and len(places) < len(wanted):
        raise InputError(f"only {len(places)} of the arm's {len(wanted)} joints are in {', '.join(names)}")
    return places


def seconds(stamp: Any) -> float:
    """A stamp of ROS 2 [s]."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)
