"""Options of an arm: frames of its wrench and pose, and the mass and stiffness between sensors and surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from palpate.cli.options.values import FLAG, SIGNED, Angles, Interval, Point, si, vector, with_std
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame import ArmDynamics, ContactFrame, Payload


@Parameter(name="*", group=Group("Wrench and pose, and the sign of the force", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class FrameOptions:
    """Axes, points and signs of a wrench and a pose."""

    wrench_frame: Literal["base", "tool", "sensor"] | None = None
    "Axes of the wrench: the arm's base, the tool (those of the pose), or a sensor turned against the tool."
    sensor_rpy: Angles | None = None
    "Rotation of the sensor against the tool: roll,pitch,yaw in degrees, or with :rad."
    tcp: Point | None = None
    "The contact point, in the tool's axes from the pose's origin: x,y,z in m, or with :mm."
    wrench_at: Point | None = None
    "The reference point of the torque, likewise; the pose's origin if not given."
    force_sign: Annotated[Literal["action", "reaction", "+1", "1", "-1"] | None, SIGNED] = None
    """+1 or action: the force acts from the tool on the surface, and grows with penetration; -1 or reaction:
    from the surface on the tool. Detected if not given."""
    normal: Annotated[str | None, SIGNED] = None
    """Into the surface, x,y,z in the base's axes, or tool:x,y,z in the tool's. Estimated from the force if not
    given."""
    gravity_compensated: Annotated[bool, FLAG] = False
    "The tool's weight is already subtracted from the wrench."
    free: Interval | None = None
    "BEGIN,END in seconds of an interval of free motion; detected if not given."

    @property
    def sign(self) -> int | None:
        """1 if the force grows with penetration, -1 if it falls; None if not given."""
        if self.force_sign is None:
            return None
        return -1 if self.force_sign in {"reaction", "-1"} else 1

    @property
    def of_space(self) -> bool:
        """Whether an option was given that needs a wrench and a pose."""
        return replace(self, force_sign=None) != FrameOptions()

    def frame(self, hung: Payload | None = None) -> ContactFrame | None:
        """The contact frame; None if not given."""
        from palpate.contact_frame import ContactFrame

        if self == FrameOptions() and hung is None:
            return None
        sides: dict[int | None, Literal["action", "reaction"] | None] = {
            None: None,
            1: "action",
            -1: "reaction",
        }
        axes, colon, plain = (self.normal or "").rpartition(":")
        if colon and axes not in {"base", "tool"}:
            raise InputError(f"--normal needs x,y,z, base:x,y,z or tool:x,y,z, got {self.normal!r}")
        return ContactFrame(
            wrench_frame=self.wrench_frame,
            sensor_rpy=si(self.sensor_rpy),
            tcp=si(self.tcp) or (0.0, 0.0, 0.0),
            wrench_at=si(self.wrench_at) or (0.0, 0.0, 0.0),
            force_sign=sides[self.sign],
            normal=vector("--normal", plain, "number") if plain else None,
            normal_frame="tool" if axes == "tool" else "base",
            gravity_compensated=self.gravity_compensated,
            free=si(self.free),
            payload=hung,
        )


@Parameter(name="*", group=Group("The arm", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class ArmOptions:
    """Mass and stiffness between the sensors and the surface."""

    tool_mass: str | None = None
    "Mass between force sensor and surface in kg, VALUE or VALUE:STD; it is subtracted from M."
    payload: Path | None = None
    "File of palpate payload: the tool's weight, and the mass to subtract from M."
    robot_stiffness: Annotated[str | None, Parameter(name=["--robot-stiffness", "--series-stiffness"])] = None
    """Stiffness between position sensor and surface, N/m or N/m:STD; its compliance is subtracted from that of
    K."""
    robot_mass: str | None = None
    "The arm's mass at the tip, before the force sensor, which swings on its own stiffness, in kg or kg:STD."
    robot_stiffness_from: Path | None = None
    "A log of a press on a rigid wall, with the same columns or topics: only the arm deflects in it."
    position_from: Literal["joints", "tip"] | None = None
    "joints: the position comes from joint encoders and does not contain the arm's deflection; tip: it does."

    def weighed_tool(self) -> Payload | None:
        """The payload on the sensor, if it was weighed."""
        from palpate.contact_frame import load_payload

        return None if self.payload is None else load_payload(self.payload)

    def arm(self) -> ArmDynamics:
        """The arm as given; a press on a wall is another log."""
        from palpate.contact_frame import ArmDynamics

        if self.robot_stiffness is not None and self.robot_stiffness_from is not None:
            raise InputError("give --robot-stiffness or --robot-stiffness-from, not both")
        hung = self.weighed_tool()
        return ArmDynamics(
            tool_mass=with_std("tool-mass", self.tool_mass, "0.8:0.02") or (hung.beyond if hung else None),
            stiffness=with_std("robot-stiffness", self.robot_stiffness, "40000:2000"),
            mass=with_std("robot-mass", self.robot_mass, "3.7:0.4"),
            position_from=self.position_from,
        )
