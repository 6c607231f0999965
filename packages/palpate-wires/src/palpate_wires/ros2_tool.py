"""Where an arm's tool is, from what ROS 2 publishes of it: its pose, or the positions of the arm's joints."""

from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.wires import LostError, Quaternion, Triple, triple
from palpate_wires.orientation import from_matrix_by_columns

_NEARLY = 0.02
"""Smallest singular value of the Jacobian at which joints are still moved [m]: there 20 mm/s take a joint 1 rad/s."""


class PoseTool:
    """Tool's pose by messages of PoseStamped."""

    def __init__(self) -> None:
        self.stamp: float | None = None
        self.frame = ""
        self._pose: Any = None

    def take(self, sample: Any) -> None:
        """A message has come."""
        self.stamp, self.frame, self._pose = seconds(sample.header.stamp), sample.header.frame_id, sample.pose

    def place(self) -> tuple[Triple, Quaternion]:
        """Position and orientation as they came."""
        p, o = self._pose.position, self._pose.orientation
        return (p.x, p.y, p.z), (o.x, o.y, o.z, o.w)

    def speeds(self, velocity: Triple) -> list[float]:
        """A pose says nothing of joints."""
        raise NotImplementedError


class JointTool:
    """By JointState and the arm's own kinematics.

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
        """A message has come; others may bring other joints, a gripper's for one."""
        if sample.name != self._names:
            self._names, self._order = list(sample.name), order_of(self._arm.names, sample.name)
        if not self._order or len(sample.position) < len(sample.name):
            return
        self._q = np.array([sample.position[i] for i in self._order])
        self.stamp, self.frame = seconds(sample.header.stamp), sample.header.frame_id

    def place(self) -> tuple[Triple, Quaternion]:
        """Position and orientation by forward kinematics."""
        pose = self._arm.forward_kinematics(self._q)
        return triple(pose[:3, 3]), from_matrix_by_columns(pose.T.ravel().tolist())

    def speeds(self, velocity: Triple) -> list[float]:
        """The smallest joint speeds that do it, J^+ (v, 0); none is needed for rest."""
        if not any(velocity):
            return [0.0] * len(self._q)
        J = self._arm.jacobian(self._q)
        if self._arm.singular_values(self._q)[-1] < _NEARLY:
            raise LostError(
                "the arm is nearly singular there: the smallest singular value of its Jacobian is below"
                f" {_NEARLY:g}; press elsewhere"
            )
        found = np.linalg.lstsq(J, np.array([*velocity, 0.0, 0.0, 0.0]), rcond=None)[0]
        return found.tolist()


def order_of(wanted: tuple[str, ...], there: list[str]) -> list[int]:
    """Where an arm's joints stand among those of a message, by name: never by place, as drivers order them otherwise.

    A driver may write more around a name, as `left_shoulder_pan_joint` for `shoulder_pan`.

    Returns:
        Places; nothing if the message has none of them.

    Raises:
        InputError: a joint is missing, or several could be it.
    """
    found = []
    for name in wanted:
        exact = [i for i, other in enumerate(there) if other == name]
        alike = exact or [i for i, other in enumerate(there) if name in other]
        if len(alike) == 1:
            found.append(alike[0])
        elif found or len(alike) > 1:
            raise InputError(f"joint {name} of the arm is not one of {', '.join(there)}; is it another arm?")
    if found and len(found) < len(wanted):
        raise InputError(f"only {len(found)} of the arm's {len(wanted)} joints are in {', '.join(there)}")
    return found


def seconds(stamp: Any) -> float:
    """A stamp of ROS 2 [s]."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)
