"""Readings of a force sensor in free motion, its payload, and the contact's normal.

The weight w keeps its direction in the base, the bias b in the sensor: f = R^T w + b with the tool's rotation R. Only
a tool that turns distinguishes the two. Least squares over all orientations: with R' the mean of R,

    (1 - R' R'^T) w = mean(R f) - R' mean(f),    b = mean(f) - R'^T w

whose matrix has an eigenvalue of about the square of the angle for each direction that the tool turns w in, and 0 for
one that it leaves as it is. The part of w that is not determined is left to b: their sum is right where the tool
stands so.

The normal is the direction in which the force changes: a bias of the sensor that nobody has taken off has a direction
of its own and does not change. A force with friction stands off the normal by up to the arctangent of the coefficient
of friction, and no log of one motion tells; so the direction of the force is estimated. A normal that is off by a
small angle d turns both the force and the position. K, B and M scale as F(n)/x(n), so where tool and force go along
the normal the two cosines cancel up to d^2; where the tool moves along the surface by s for each unit of penetration
they leave an error of s d.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from palpate.arrays import Array
from palpate.contact_frame.free_motion import BLOCKS, Vector
from palpate.errors import InputError
from palpate.files import read_text, write_text
from palpate.force.arm import NotNegative, Table, from_toml

_TOLD = np.radians(3.0) ** 2
"""Least eigenvalue for which a weight is told from a bias: by a smaller turn, a pose that errs by 0.3 deg makes a tenth
of the weight."""
_ROUNDS = 30
"""Of reweighting. The load that they find only begins the search for the free rows, which finds it anew."""
_ENOUGH = 20_000
"""Rows that are looked at, of a longer log evenly: that is a matter of time, not of what is found."""


@dataclass(frozen=True)
class Load:
    """Weight and bias of a force sensor.

    Args:
        weight: in the base's axes, as the sensor shows it [N], shape (3,).
        bias: in the tool's axes [N], shape (3,).
        std: standard deviation of an axis of their sum [N].
        separable: whether the log separates the whole weight from the bias.
        weight_std: standard deviation of an axis of the weight [N]; infinite if it is not separable.
    """

    weight: Array
    bias: Array
    std: float
    separable: bool
    weight_std: float

    def taken_off(self, force: Array, rotations: Array) -> Array:
        """The force in the base's axes without weight and bias, of one in the tool's axes, shape (n, 3)."""
        return np.einsum("nij,nj->ni", rotations, force - self.bias) - self.weight


def no_load() -> Load:
    """Where nothing is known."""
    return Load(np.zeros(3), np.zeros(3), 0.0, False, np.inf)


def turns(rotations: Array) -> bool:
    """Whether rotations, shape (n, 3, 3), differ by enough to tell a weight from a bias, at least in part."""
    mean = rotations.mean(axis=0)
    return bool(np.linalg.eigvalsh(np.eye(3) - mean @ mean.T)[-1] > _TOLD)


def known_load(force: Array, rotations: Array, payload: "Payload") -> Load:
    """The bias by least squares over free rows, shape (n, 3), with the weight known; the payload's where n is 0."""
    weight = np.array(payload.weight)
    if not len(force):
        return Load(weight, np.array(payload.bias), payload.bias_std, True, payload.weight_std)
    left = force - np.einsum("nji,j->ni", rotations, weight)
    bias = left.mean(axis=0)
    return Load(weight, bias, _std_of_mean(left - bias), True, payload.weight_std)


def load_of(force: Array, rotations: Array, *, weighs: bool, weights: Array | None = None) -> Load:
    """Weight and bias by least squares over free rows.

    Args:
        force: in the tool's axes [N], shape (n, 3).
        rotations: of the tool, shape (n, 3, 3).
        weighs: whether the tool's weight is in it.
        weights: of the rows, shape (n,).
    """
    share = np.full(len(force), 1 / len(force)) if weights is None else weights / weights.sum()
    mean_turn, mean_force = np.einsum("n,nij->ij", share, rotations), share @ force
    in_base = share @ np.einsum("nij,nj->ni", rotations, force)
    values, axes = np.linalg.eigh(np.eye(3) - mean_turn @ mean_turn.T)
    told = (values > _TOLD) & weighs
    weight = axes[:, told] @ ((axes[:, told].T @ (in_base - mean_turn @ mean_force)) / values[told])
    bias = mean_force - mean_turn.T @ weight
    std = _std_of_mean(force - np.einsum("nji,j->ni", rotations, weight) - bias)
    whole = bool(told.all())
    return Load(weight, bias, std, whole, std / float(np.sqrt(values[0])) if whole else np.inf)


def robust_load(force: Array, rotations: Array, *, weighs: bool) -> Load:
    """Weight and bias where rows in contact are among the others, the fewer: by least absolute deviations."""
    every = slice(None, None, -(-len(force) // _ENOUGH))
    force, rotations = force[every], rotations[every]
    load = load_of(force, rotations, weighs=weighs)
    for _ in range(_ROUNDS):
        far = np.linalg.norm(load.taken_off(force, rotations), axis=1)
        weights = 1 / np.maximum(far, 1e-3 * float(np.median(far)) + 1e-12)
        load = load_of(force, rotations, weighs=weighs, weights=weights)
    return load


def _std_of_mean(residual: Array) -> float:
    """Of the mean of an axis of coloured noise, shape (n, 3), by the means of blocks."""
    blocks = [block.mean(axis=0) for block in np.array_split(residual, min(BLOCKS, len(residual)))]
    return float(np.sqrt(np.mean(np.var(blocks, axis=0, ddof=1)) / len(blocks))) if len(blocks) > 1 else 0.0


MATTERS = 0.02
"""Relative standard deviation that the normal may add to K, B and M unsaid: 4 % at 95 %, which in quadrature takes a
hundredth from the 25 % that an identified parameter may have."""
_NOTHING = 0.99
"""Relative standard deviation of a number of which nothing is known; at 1 the interval holds zero for certain."""
_NO_AXIS = MATTERS**0.5
"""Standard deviation of the angle d above which the force has no direction [rad]: its square alone matters then."""


@dataclass(frozen=True)
class Normal:
    """A direction in the base's axes.

    Args:
        direction: of unit length, shape (3,).
        std: standard deviation of its angle about each of the two axes across it [rad]; 0 for one that was given.
        found: from the force; otherwise it was given.
    """

    direction: Array
    std: float
    found: bool

    @property
    def shown(self) -> bool:
        """Whether the log shows a normal at all."""
        return self.std <= _NO_AXIS


def direction_of(force: Array) -> tuple[Array, float]:
    """The axis along which a force, shape (n, 3), changes most, and the standard deviation of its angle [rad].

    It is the first axis of the covariance. To first order, noise turns it towards another axis by what the covariance
    between the two should not be, over the difference of their variances; the scatter of that from block to block of
    the log says how well the axis is known, whatever the noise's colour. A force that changes in all directions alike,
    as noise does, has no axis, and the angle's deviation says so.
    """
    changes = force - force.mean(axis=0)
    variances, axes = np.linalg.eigh(changes.T @ changes)
    along, across = changes @ axes[:, 2], changes @ axes[:, :2]
    blocks = np.array([block.sum(axis=0) for block in np.array_split(along[:, None] * across, BLOCKS)])
    turned = np.sum(blocks**2, axis=0) * BLOCKS / (BLOCKS - 1) / (variances[2] - variances[:2]) ** 2
    return axes[:, 2], float(np.sqrt(np.mean(turned)))


def across_per_along(vectors: Array, axis: Array) -> Array:
    """How far vectors, shape (n, 3), go across an axis for each unit along it, shape (3,)."""
    changes = vectors - vectors.mean(axis=0)
    along = changes @ axis
    slope: Array = (along @ changes) / (along @ along)
    return slope - axis


def scale_std(normal: Normal, force: Array, place: Array) -> float:
    """Effect of the normal's uncertainty on K, B and M, as a relative standard deviation.

    Args:
        normal: with its uncertainty.
        force: in contact [N], shape (n, 3).
        place: of the point that touches, in contact [m], shape (m, 3).

    Returns:
        Below 1: at that, nothing is known.
    """
    if not normal.std:
        return 0.0
    if not normal.shown:
        return _NOTHING
    slip = across_per_along(place, normal.direction) - across_per_along(force, normal.direction)
    return min(float(np.hypot(np.linalg.norm(slip) * normal.std, normal.std**2)), _NOTHING)


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
    """Mass by which the force follows the acceleration when free, against gravity's sense [kg]: the tool's own where
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
        if self.inertia_followed is not None:
            return max(self.inertia_followed[0], 0.0), self.inertia_followed[1]
        return (self.mass, self.mass_std) if self.mass > 2.0 * self.mass_std else None

    @property
    def meta(self) -> dict[str, list[float]]:
        """Metadata of this tool in the record of a press, for `identify_contact` [kg]."""
        known = {"tool_mass_kg": self.beyond, "tool_inertia_kg": self.inertia_followed}
        return {name: list(value) for name, value in known.items() if value is not None}

    @property
    def inertia_followed(self) -> tuple[float, float] | None:
        """The mass by which the force follows the acceleration, and its std [kg]; None if it is not told."""
        if self.inertia is None or self.inertia_std is None:
            return None
        return self.inertia, self.inertia_std

    def to_toml(self) -> str:
        """The text of the payload's file."""
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
