"""Options of an identification: signals of a log, frames of wrench and pose, the arm, the model, the indenter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from palpate.cli.options import values
from palpate.cli.options.common import QUIET, Model
from palpate.errors import InputError
from palpate.logs import formats
from palpate.logs.signals import Rotation, Signals  # noqa: F401 - cyclopts looks for Rotation here

if TYPE_CHECKING:
    from palpate.contact_frame.arm import ArmDynamics
    from palpate.contact_frame.payload import Payload
    from palpate.contact_frame.signals_in_base import ContactFrame
    from palpate.identification.indenter import Indenter
    from palpate.records import Record


@values.options("Signals of the log", 1)
class LogOptions(Signals):
    """Columns or topics of a log, and which rows of it."""

    force: Annotated[str | None, Parameter(name=["--force-column", "--force"])] = None
    "Column of the force, in N if no unit is given; g is the reading of a scale. TOPIC.FIELD of a bag."
    start: Annotated[float | None, values.SIGNED] = None
    "Leave out the rows before this time, in seconds from the first row."
    missing: Annotated[tuple[str, ...], Parameter(allow_leading_hyphen=True, negative=())] = ()
    'A value that means "no reading", as -1; may be repeated. Common ones are detected.'

    def read_axis(self, log: Path, velocity: str | None) -> Record:
        """The record of an axis: time, force, and position or velocity or both.

        Args:
            log: path of it.
            velocity: column of the speed; None where it is made from the position.

        Raises:
            InputError: the log or an option is wrong, or a signal has no name.
        """
        from palpate.logs.read import columns_of, read_log

        bag = formats.kind_of(log).is_bag
        present = [] if bag else columns_of(log, self.delimiter)
        roles = {"time": self.time, "position": self.position, "velocity": velocity, "force": self.force}
        if self.rate is not None and self.time is None:
            del roles["time"]
        columns: dict[str, Any] = {
            role: name or role for role, name in roles.items() if name is not None or role in present
        }
        lacking = [] if "force" in columns else ["--force-column"]
        lacking += [] if {"position", "velocity"} & {*columns} else ["--position or --velocity"]
        lacking += [] if "time" in columns or self.rate or bag else ["--time or --rate"]
        if lacking or self.wrench or self.pose:
            lacking = lacking or ["--force-column"]
            raise InputError(
                f"--friction is of one axis: name its columns in {log} with {' and '.join(lacking)}"
                f" (palpate topics {log} lists them)"
            )
        reading = {
            name: getattr(self, name) for name in ("rate", "start", "end", "missing", "delimiter", "join")
        }
        return read_log(log, limits=self.limits, **reading, **columns)


@values.options("Wrench and pose, and the sign of the force", 2)
class FrameOptions:
    """Axes, points and signs of a wrench and a pose."""

    wrench_frame: Literal["base", "tool", "sensor"] | None = None
    "Axes of the wrench: the arm's base, the tool (those of the pose), or a sensor turned against the tool."
    sensor_rpy: values.Angles | None = None
    "Rotation of the sensor against the tool: roll,pitch,yaw in degrees, or with :rad."
    tcp: values.Point | None = None
    "The contact point, in the tool's axes from the pose's origin: x,y,z in m, or with :mm."
    wrench_at: values.Point | None = None
    "The reference point of the torque, as for --tcp; the pose's origin if not given."
    force_sign: Annotated[Literal["action", "reaction", "+1", "1", "-1"] | None, values.SIGNED] = None
    """+1 or action: the force acts from the tool on the surface, and grows with penetration; -1 or reaction:
    from the surface on the tool. Detected if not given."""
    normal: Annotated[str | None, values.SIGNED] = None
    """Direction into the surface, x,y,z in the base's axes, or tool:x,y,z in the tool's. Estimated from the force if
    not given."""
    gravity_compensated: Annotated[bool, values.FLAG] = False
    "The tool's weight is already subtracted from the wrench."
    free: values.Interval | None = None
    "BEGIN,END in seconds of an interval of free motion; detected if not given."

    @property
    def sign(self) -> int | None:
        """1 if the force grows with penetration, -1 if it falls; None if not given."""
        if self.force_sign is None:
            return None
        return -1 if self.force_sign in {"reaction", "-1"} else 1

    def frame(self) -> ContactFrame | None:
        """The contact frame; None if not given."""
        from palpate.contact_frame.signals_in_base import ContactFrame

        if self == FrameOptions():
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
            sensor_rpy=values.si(self.sensor_rpy),
            tcp=values.si(self.tcp) or (0.0, 0.0, 0.0),
            wrench_at=values.si(self.wrench_at) or (0.0, 0.0, 0.0),
            force_sign=sides[self.sign],
            normal=values.vector("--normal", plain, "number") if plain else None,
            normal_frame="tool" if axes == "tool" else "base",
            gravity_compensated=self.gravity_compensated,
            free=values.si(self.free),
        )


@values.options("The arm", 3)
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
    "Mass of the arm at its tip, before the force sensor, in kg or kg:STD; it swings on the arm's stiffness."
    robot_stiffness_from: Path | None = None
    "A log of a press on a rigid wall, with the same columns or topics: only the arm deflects in it."
    position_from: Literal["joints", "tip"] | None = None
    "joints: the position comes from joint encoders and does not contain the arm's deflection; tip: it does."

    def weighed_tool(self) -> Payload | None:
        """The payload on the sensor, if it was weighed."""
        from palpate.contact_frame.payload import load_payload

        return None if self.payload is None else load_payload(self.payload)

    def arm(self) -> ArmDynamics:
        """The arm as given; a press on a wall is another log."""
        from palpate.contact_frame.arm import ArmDynamics

        if self.robot_stiffness is not None and self.robot_stiffness_from is not None:
            raise InputError("give --robot-stiffness or --robot-stiffness-from, not both")
        hung = self.weighed_tool()
        return ArmDynamics(
            tool_mass=values.with_std("tool-mass", self.tool_mass, "0.8:0.02")
            or (hung.beyond if hung else None),
            stiffness=values.with_std("robot-stiffness", self.robot_stiffness, "40000:2000"),
            mass=values.with_std("robot-mass", self.robot_mass, "3.7:0.4"),
            position_from=self.position_from,
        )


@values.options("Young's modulus", 5)
class IndenterOptions:
    """Shape of the indenter, if it is known."""

    indenter: str | None = None
    """sphere:RADIUS, punch:RADIUS (flat, round) or cone:HALF_ANGLE (from its axis), as sphere:5:mm or
    cone:70:deg. It adds Young's modulus E."""
    poisson: Annotated[str | None, values.SIGNED] = None
    "Poisson's ratio of the material, VALUE or VALUE:STD; unknown from 0 to 0.5 if not given."

    def check(self) -> None:
        """Check the options before any work is done."""
        if self.poisson is None and self.indenter is None:
            return
        from palpate.identification.indenter import check_poisson

        if self.indenter is None:
            raise InputError("--poisson needs a known shape of the indenter; add --indenter")
        check_poisson(self.ratio)
        self.shape()

    def shape(self) -> Indenter | None:
        """The shape; None if not given."""
        from palpate.identification.indenter import Indenter

        return None if self.indenter is None else Indenter.parse(self.indenter)

    @property
    def ratio(self) -> tuple[float, float] | None:
        """Poisson's ratio, with its standard deviation."""
        return values.with_std("poisson", self.poisson, "0.45:0.05")


@values.options("The model", 4)
class ModelOptions:
    """The model, the lag, and the priors."""

    model: Annotated[Model | None, QUIET] = None
    """kelvin-voigt, kelvin-voigt-mass, standard-linear-solid, hunt-crossley or quasi-linear-viscoelastic;
    chosen if not given."""
    lag: Annotated[str | None, values.SIGNED] = None
    """Calibrated lag of the force behind the position, as 0.0076, 7.6:ms or 7.6:0.2:ms (with its standard
    deviation); 0:1:ms where one converter reads both channels every ms, unfiltered."""
    force_filter: str | None = None
    "Low-pass of the force before sampling, as butterworth3:120 (order and Hz), joined by +; or none."
    mass: str | None = None
    "Prior of the mass, in kg, VALUE or VALUE:STD."
    tolerance: float = 0.25
    "Largest half-width of an identified parameter's 95 % interval, as a fraction of its value."
    calibration: float = 0.0
    "Relative standard deviation of the scales of force and position together, as 0.01."
    bonded: bool | None = None
    "Whether the probe is fixed to the surface; detected if not given."
    cutoff: float | None = None
    "Cut-off of the filters of all channels, in Hz; chosen if not given."

    def keywords(self) -> dict[str, Any]:
        """The keywords of `palpate.identify`."""
        known: dict[str, Any] = {}
        lag = values.parse_lag(self.lag)
        if lag is not None:
            known |= {"lag": lag[0], "lag_std": lag[1]}
        if self.force_filter is not None:
            known["force_filter"] = self.force_filter
        if self.mass is not None:
            known["mass"] = values.with_std("mass", self.mass, "0.5:0.02")
        names = ("model", "tolerance", "calibration", "bonded", "cutoff")
        return known | {name: getattr(self, name) for name in names}
