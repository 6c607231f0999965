"""A tool beyond the force sensor: its file, and the load files of controllers that hold its mass and centre.

- `.script`, Universal Robots: `set_target_payload(m, cog)` of URScript (Script Manual, e-Series), from the flange.
- `.json`, Franka: `endeffector-config.json` of an end effector archive (Franka RIDE documentation 1.1.1, End effector
  commissioning): mass, centerOfMass, inertia and transformation by columns, from the flange.
- `.yaml`, ROS 2: the gravity compensation filter of control_toolbox (tool.mass, tool.CoG and
  tool.gravity_field of its parameters file), and gravity_compensation.CoG of the admittance controller of
  ros2_controllers, from the sensor.
"""

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from palpate.errors import InputError
from palpate.files import MADE, WRITTEN, as_json, as_toml, read_text, write_text
from palpate.force.arm import NotNegative, Table, from_toml
from palpate.signals.rotations import matrix_from_rpy

Vector = tuple[float, float, float]


class Payload(Table):
    """A tool beyond a force sensor, and the sensor's bias when it was weighed.

    Raises:
        InputError: numbers that do not fit together.
    """

    mass: NotNegative
    """[kg]."""
    mass_std: NotNegative
    weight: Vector
    """Weight as the sensor reads it, in the base's axes [N]; it points up where the sensor shows the action, since the
    arm exerts what holds a tool as it exerts what presses it on."""
    weight_std: NotNegative
    """Standard deviation of the weight in an axis [N]."""
    bias: Vector
    """Bias of the force, in the tool's axes [N]."""
    bias_std: NotNegative
    """Standard deviation of the bias in an axis [N]."""
    noise: NotNegative
    """Standard deviation of a reading of an axis [N]."""
    wrench_frame: Annotated[str, Meta(pattern="^(base|tool|sensor)$")]
    """Axes of the wrench in the log that it was weighed by."""
    sensor_rpy: Vector | None = None
    """Roll, pitch, yaw of the sensor in the tool [rad]."""
    drift: Vector | None = None
    """Drift of the bias [N/s]; None where the log does not determine it."""
    centre: Vector | None = None
    """Centre of mass, in the tool's axes from the point that the torque is about [m]; None without a torque."""
    centre_std: NotNegative | None = None
    inertia: float | None = None
    """Mass by which the force follows the acceleration when free, against gravity's sense [kg]: the tool's own where
    nothing takes it off, 0 where a driver does, below 0 where one does so with the wrong sign; None if unknown."""
    inertia_std: NotNegative | None = None

    def __post_init__(self) -> None:
        if (self.wrench_frame == "sensor") != (self.sensor_rpy is not None):
            raise InputError("sensor_rpy belongs to wrench_frame = 'sensor', and only to that")

    @property
    def beyond(self) -> tuple[float, float] | None:
        """The mass that is in the force beside the surface's, and its std [kg]; None if it is not told.

        The one that follows the acceleration, where it was shaken; else the one that hangs, unless that is nothing: a
        driver that takes off the weight may leave the inertia in.
        """
        if self.inertia_followed is not None:
            return max(self.inertia_followed[0], 0.0), self.inertia_followed[1]
        return (self.mass, self.mass_std) if self.mass > 2.0 * self.mass_std else None

    @property
    def meta(self) -> dict[str, list[float]]:
        """Metadata of this tool in the record of a press, for `identify_contact` [kg]."""
        intervals = {"tool_mass_kg": self.beyond, "tool_inertia_kg": self.inertia_followed}
        return {name: list(value) for name, value in intervals.items() if value is not None}

    @property
    def inertia_followed(self) -> tuple[float, float] | None:
        """The mass by which the force follows the acceleration, and its std [kg]; None if it is not told."""
        if self.inertia is None or self.inertia_std is None:
            return None
        return self.inertia, self.inertia_std

    def to_toml(self) -> str:
        """The text of the payload's file."""
        head = "# Made by palpate payload; palpate identify and palpate tune take it by --payload. SI units."
        return f"{head}\n{as_toml(msgspec.to_builtins(self)).rstrip()}\n"

    def save(self, path: Path) -> None:
        """Writes the file, atomically."""
        write_text(path, self.to_toml())


def load_payload(path: Path) -> Payload:
    """A payload from the file that `palpate payload` wrote.

    Raises:
        InputError: no such file, an unknown or missing key, a value out of range.
    """
    return from_toml(read_text(path, "a payload"), str(path), Payload)


_NO_CENTRE = "the log has no torque that shows the centre of mass, and a load file needs it"


def load_text(payload: Payload, mass_half: float, ending: str, flange: Vector) -> str:
    """The load file of a weighed tool.

    Args:
        payload: of the tool.
        mass_half: half-width of the mass' 95 % interval [kg].
        ending: `.script`, `.json`, `.yaml` or `.toml`.
        flange: or the sensor, from the point that the torque is about, in the tool's axes [m].

    Raises:
        InputError: the log does not show the centre of mass, or no weight.
    """
    if ending == ".toml":
        return payload.to_toml()
    if payload.centre is None:
        raise InputError(_NO_CENTRE)
    if payload.mass <= mass_half:
        raise InputError("the log shows no weight: its driver subtracts the tool; log without that")
    mass = round(payload.mass, 5)
    x, y, z = _centre(payload, flange, in_sensor_axes=ending == ".yaml")
    if ending == ".script":
        note = f"{MADE} payload. The inertia matrix is not in the log; that of the controller stays."
        return f"{note}\nset_target_payload({mass}, [{x}, {y}, {z}])\n"
    if ending == ".json":
        file = {
            "id": "palpate-tool",
            "name": "Tool",
            "color": "#808080",
            "mass": mass,
            "centerOfMass": [x, y, z],
        }
        frame = {"transformation": np.eye(4).ravel().tolist(), "inertia": [0.0] * 9}
        return as_json({WRITTEN: "palpate payload", **file, **frame}).decode()
    field = [round(w / payload.mass, 5) for w in payload.weight]
    return _ROS2.format(
        made=f"{MADE} payload", mass=mass, centre=[x, y, z], field=field, force=-payload.weight[2]
    )


_ROS2 = """{made}
# The filter, in the node that has the sensor; name its frames.
sensor_filter_chain:
  filter1:
    name: gravity_compensation
    type: control_filters/GravityCompensationWrench
    params:
      world_frame: base
      sensor_frame: sensor
      tool:
        mass: {mass}
        CoG: {centre}
        gravity_field: {field}
# Or in the admittance controller of ros2_controllers.
gravity_compensation:
  frame: {{id: sensor}}
  CoG: {{pos: {centre}, force: {force:.5f}}}
"""


def _centre(payload: Payload, flange: Vector, *, in_sensor_axes: bool) -> list[float]:
    """Centre of mass from the flange, in the tool's axes or the sensor's, to 10 micrometres [m]."""
    centre = np.subtract(payload.centre or (0.0, 0.0, 0.0), flange)
    if in_sensor_axes and payload.sensor_rpy is not None:
        centre = matrix_from_rpy(payload.sensor_rpy).T @ centre
    return [round(float(part), 5) for part in centre]
