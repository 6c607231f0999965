"""Properties of an arm's log declared by the user: axes of the wrench, tool, normal of the contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from palpate.contact_frame.vectors import Vector
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame.payload import Payload


@dataclass(frozen=True)
class ContactFrame:
    """How wrench and pose stand to each other and to the surface.

    Args:
        wrench_frame: axes that the wrench is given in: the arm's base, the tool (the axes of the pose), or a sensor
            that is turned against the tool; None to use the frames of the messages' headers.
        sensor_rpy: how the sensor is turned against the tool: roll, pitch and yaw about fixed axes [rad].
        tcp: the point that touches, in the tool's axes from the pose's origin [m].
        wrench_at: the point that the torque is about, likewise [m]; only the lever arm's check needs it.
        force_sign: `action` acts from the tool on the surface, `reaction` from the surface on the tool;
            None to find out.
        normal: into the surface; None to find it from the force.
        normal_frame: axes of the normal: the base's, or the tool's.
        gravity_compensated: the tool's weight is already subtracted from the wrench.
        free: begin and end of a stretch in which nothing is touched [s]; None to find such stretches.
        payload: of the sensor, if it was weighed; its wrench must be in the same axes.

    Raises:
        InputError: they contradict each other.
    """

    wrench_frame: Literal["base", "tool", "sensor"] | None = None
    sensor_rpy: Vector | None = None
    tcp: Vector = (0.0, 0.0, 0.0)
    wrench_at: Vector = (0.0, 0.0, 0.0)
    force_sign: Literal["action", "reaction"] | None = None
    normal: Vector | None = None
    normal_frame: Literal["base", "tool"] = "base"
    gravity_compensated: bool = False
    free: tuple[float, float] | None = None
    payload: Payload | None = None

    def __post_init__(self) -> None:
        if (self.wrench_frame == "sensor") != (self.sensor_rpy is not None):
            raise InputError("a wrench in the sensor's axes needs --sensor-rpy, and no other frame takes it")
        if self.normal is not None and not np.linalg.norm(self.normal) > 0:
            raise InputError(
                "the normal must have a length, got 0,0,0; it points into the surface, as 0,0,-1"
            )
        if self.free is not None and not self.free[0] < self.free[1]:
            raise InputError(
                f"the interval of free motion must end after it begins, got {self.free[0]:g} to {self.free[1]:g} s"
            )
        if self.payload is not None:
            self._check_axes(self.payload)

    def _check_axes(self, payload: Payload) -> None:
        said = (self.wrench_frame, self.sensor_rpy)
        if self.wrench_frame is not None and said != (payload.wrench_frame, payload.sensor_rpy):
            raise InputError(
                f"the payload was weighed with a wrench in the {payload.wrench_frame}'s axes, and this wrench is said"
                f" to be in the {self.wrench_frame}'s: give the same --wrench-frame and --sensor-rpy, or weigh again"
            )


@dataclass(frozen=True)
class Arm:
    """Mass and stiffness between the sensors and the surface.

    Args:
        tool_mass: mass between the force sensor and the surface and its standard deviation [kg]; None if not known.
        stiffness: of the arm between the position sensors and the surface, with its std [N/m]; None if not known.
        mass: of the arm's tip before the force sensor, which swings on that stiffness, with its std [kg].
        position_from: source of the position: encoders in the `joints`, or a sensor of the `tip`.

    Raises:
        InputError: a negative mass, or one that no stiffness holds.
    """

    tool_mass: tuple[float, float] | None = None
    stiffness: tuple[float, float] | None = None
    mass: tuple[float, float] | None = None
    position_from: Literal["joints", "tip"] | None = None

    def __post_init__(self) -> None:
        if self.tool_mass is not None and not (self.tool_mass[0] >= 0 and self.tool_mass[1] >= 0):
            raise InputError(
                f"the tool's mass must be 0 kg or more, got {self.tool_mass[0]:g}:{self.tool_mass[1]:g}"
            )
        if self.mass is not None and not (self.mass[0] >= 0 and self.mass[1] >= 0):
            raise InputError(f"the robot's mass must be 0 kg or more, got {self.mass[0]:g}:{self.mass[1]:g}")
