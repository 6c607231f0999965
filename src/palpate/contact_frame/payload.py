"""Payload of a force sensor, as one value and one TOML file: the tool's mass and centre, the sensor's bias."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from palpate.contact_frame.vectors import Vector
from palpate.errors import InputError
from palpate.files import read_text, write_text
from palpate.force.arm import NotNegative, Table, from_toml


class Payload(Table):
    """A tool beyond a force sensor, and the sensor's bias when it was weighed.

    Raises:
        InputError: numbers that do not fit together.
    """

    mass: NotNegative
    """[kg]."""
    mass_std: NotNegative
    weight: Vector
    """As the sensor shows it, in the base's axes [N]; it points up where the sensor shows the action, since the
    arm exerts what holds a tool as it exerts what presses it on."""
    weight_std: NotNegative
    """Of an axis [N]."""
    bias: Vector
    """Of the force, in the tool's axes [N]."""
    bias_std: NotNegative
    """Of an axis [N]."""
    noise: NotNegative
    """Standard deviation of a reading of an axis [N]."""
    wrench_frame: Annotated[str, Meta(pattern="^(base|tool|sensor)$")]
    """Axes of the wrench in the log that it was weighed by."""
    sensor_rpy: Vector | None = None
    """How the sensor is turned against the tool [rad]."""
    drift: Vector | None = None
    """Of the bias [N/s]; None where the log does not tell it."""
    centre: Vector | None = None
    """Of mass, in the tool's axes from the point that the torque is about [m]; None without a torque."""
    centre_std: NotNegative | None = None
    inertia: float | None = None
    """Mass by which the force follows the acceleration in the air, against gravity's sense [kg]: the tool's own where
    nothing takes it off, 0 where a driver does, below 0 where one does so with the wrong sign; None if not told."""
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
        if self.followed is not None:
            return max(self.followed[0], 0.0), self.followed[1]
        return (self.mass, self.mass_std) if self.mass > 2.0 * self.mass_std else None

    @property
    def meta(self) -> dict[str, list[float]]:
        """Metadata of this tool in the record of a press, for `identify_contact` [kg]."""
        known = {"tool_mass_kg": self.beyond, "tool_inertia_kg": self.followed}
        return {name: list(value) for name, value in known.items() if value is not None}

    @property
    def followed(self) -> tuple[float, float] | None:
        """The mass by which the force follows the acceleration, and its std [kg]; None if it is not told."""
        if self.inertia is None or self.inertia_std is None:
            return None
        return self.inertia, self.inertia_std

    def to_toml(self) -> str:
        """The file's text."""
        plain = {name: value for name, value in msgspec.to_builtins(self).items() if value is not None}
        lines = [f"{name} = {_toml_value(value)}" for name, value in plain.items()]
        head = "# Made by palpate payload; palpate identify and palpate tune take it by --payload. SI units."
        return "\n".join([head, *lines]) + "\n"

    def save(self, path: Path) -> None:
        """Writes the file, atomically."""
        write_text(path, self.to_toml())


def load_payload(path: Path) -> Payload:
    """A payload from the file that `palpate payload` wrote.

    Raises:
        InputError: no such file, an unknown or missing key, a value out of range.
    """
    return from_toml(read_text(path, "a payload"), str(path), Payload)


def _toml_value(value: object) -> str:
    if isinstance(value, str):
        return msgspec.json.encode(value).decode()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(repr(float(v)) for v in value) + "]"
    return repr(float(value))  # type: ignore[arg-type]
