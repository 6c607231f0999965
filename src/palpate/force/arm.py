"""Model of an arm for a force loop: response of the tip to a command, sensor, and limits."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta

from palpate.errors import InputError, unknown
from palpate.files import read_table, read_text
from palpate.records import Readable
from palpate.signals.low_pass import LowPass

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
T = TypeVar("T")
_REMEDIES = {
    "bandwidth": "measure it with palpate tune --loop-from LOG",
    "damping": "measure it with palpate tune --loop-from LOG, or take D of a torque arm",
    "delay": "measure it with palpate tune --loop-from LOG; without it there is no lag to tune for",
    "stiffness": "press the tip on something rigid and run palpate identify on it: that is the arm's own",
    "mass": "take the tip's, 1/(n^T J M^-1 J^T n), from the arm's model",
    "noise": "record the sensor in free motion: it is the readings' standard deviation",
}


class Table(Readable, msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of an arm's file: its keys and no others."""


Interval = tuple[NotNegative, NotNegative]


class PositionLoop(Table, tag="position", tag_field="kind", omit_defaults=True):
    """A tip that follows a commanded position as w^2/(s^2 + 2 z w s + w^2), late by a delay.

    An interval says how well a number is known; theta and the certificate are of everything in it.

    Raises:
        InputError: an interval without its number in it.
    """

    bandwidth: Positive
    """w/2 pi [Hz]."""
    damping: Positive
    """z."""
    delay: NotNegative
    """Time between sending a command and the arm's loop having it [s]."""
    stiffness: Positive
    """Stiffness of the arm itself, between its encoders and the surface [N/m]."""
    mass: Positive | None = None
    """Mass of the tip along the normal, which swings on that stiffness [kg]; none if left out."""
    bandwidth_interval: Interval | None = None
    damping_interval: Interval | None = None
    delay_interval: Interval | None = None

    def __post_init__(self) -> None:
        for name in ("bandwidth", "damping", "delay"):
            value = getattr(self, name)
            ends = getattr(self, f"{name}_interval")
            if ends is not None and not ends[0] <= value <= ends[1]:
                raise InputError(
                    f"{name}_interval must be an interval around {name} = {value:g}, got {ends[0]:g} to {ends[1]:g}"
                )
            if ends is not None and name != "delay" and not ends[0] > 0.0:
                raise InputError(f"{name}_interval must be above 0, got {ends[0]:g} to {ends[1]:g}")

    @property
    def squared(self) -> tuple[float, float]:
        """w^2 [1/s^2] and 2 z w [1/s], in which the equation of motion is linear."""
        w = 2.0 * math.pi * self.bandwidth
        return w**2, 2.0 * self.damping * w

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Those of a box of w^2 and 2 z w that holds everything within the intervals; one where there are none."""
        w = self.bandwidth_interval or (self.bandwidth, self.bandwidth)
        z = self.damping_interval or (self.damping, self.damping)
        if w[0] == w[1] and z[0] == z[1]:
            return [self.squared]
        own = [2.0 * math.pi * f for f in w]
        return [(a**2, 2.0 * d) for a in own for d in (z[0] * own[0], z[1] * own[1])]

    @property
    def swing(self) -> float:
        """Natural period of the tip's mass on the arm's own stiffness, in free motion [s]; 0 of a tip without mass."""
        return 0.0 if self.mass is None else 2.0 * math.pi * math.sqrt(self.mass / self.stiffness)


class SpringLoop(Table):
    """A tip with a mass that a spring and a damper pull to the commanded position."""

    mass: Positive
    """Mass of the tip along the normal [kg]."""
    stiffness: Positive
    """K_p or K_s [N/m]."""
    damping: Positive
    """D [N s/m]."""
    delay: NotNegative
    """Time from reading the encoders to the torque, or from sending a command to the servo having it [s]."""


class TorqueLoop(SpringLoop, tag="torque", tag_field="kind"):
    """A tip under K_p (x_c - x) - D xdot, which makes it a position with a spring in series."""


class ServoLoop(SpringLoop, tag="servo", tag_field="kind"):
    """A tip that a servo pulls with K_s (x_c - x) - D xdot, between ticks too; its encoders show how it yields."""

    @property
    def lag(self) -> float:
        """D/K_s, in free motion [s]."""
        return self.damping / self.stiffness

    @property
    def inertia(self) -> float:
        """4 m K_s/D^2: above 1 the tip swings."""
        return 4.0 * self.mass * self.stiffness / self.damping**2


class Sensor(Table, omit_defaults=True):
    """The force sensor, as the control loop reads it."""

    sampling: Positive
    """Fresh readings a second [Hz]."""
    noise: Positive
    """Standard deviation of a reading [N]."""
    full_scale: Positive
    """Largest force that it reads [N]."""
    low_pass: str = "none"  # noqa: S105 - a filter
    """Before the sampling, as butterworth3:120."""
    accuracy: Positive | None = None
    """Accuracy of a reading, as the maker states it [N]; a tare takes its constant part off."""
    resolution: Positive | None = None
    """Step in which it reads [N]; left out if it is finer than the noise."""
    drift: Positive | None = None
    """Largest change of the reading at rest [N/s], as stated or reported."""


class Limits(Table):
    """Limits of the arm."""

    speed: Positive
    """Largest speed of the tip along the normal [m/s]."""
    stiffness: Positive = 1e6
    """The stiffest surface that there may be, K + B/theta [N/m]."""


class Arm(Table):
    """An arm as its force loop sees it.

    Raises:
        InputError: numbers that do not fit together.
    """

    title: str
    rate: Annotated[float, Meta(ge=20, le=20000)]
    """Ticks a second [Hz]."""
    inner: PositionLoop | TorqueLoop | ServoLoop
    sensor: Sensor
    limits: Limits

    def __post_init__(self) -> None:
        low_pass = LowPass.parse(self.sensor.low_pass)
        if low_pass.roll_off > 3:
            raise InputError(
                f"{self.title}: the sensor's low-pass {low_pass} has order {low_pass.roll_off}; the force loop takes "
                "one up to the third order: describe it by one of the same lag"
            )
        if self.delay_ticks > 100:
            raise InputError(
                f"{self.title}: a delay of {self.longest_delay:g} s, {self.delay_ticks} ticks; at most 100 are taken: "
                "run the force loop slower"
            )

    @property
    def kind(self) -> str:
        """`position`, `torque` or `servo`."""
        return str(self.inner.__struct_config__.tag)

    @property
    def tick(self) -> float:
        """Time between ticks [s]."""
        return 1.0 / self.rate

    @property
    def low_pass(self) -> LowPass:
        """Low-pass of the force sensor."""
        return LowPass.parse(self.sensor.low_pass)

    @property
    def delay_ticks(self) -> int:
        """The inner loop's delay in whole ticks, rounded up."""
        return _ticks(self.longest_delay * self.rate)

    @property
    def longest_delay(self) -> float:
        """The inner loop's delay, at most [s]."""
        return (getattr(self.inner, "delay_interval", None) or (0.0, self.inner.delay))[1]

    @property
    def unsure_ticks(self) -> int:
        """Whole ticks by which the delay may be shorter than `delay_ticks`."""
        ends = getattr(self.inner, "delay_interval", None)
        return 0 if ends is None else self.delay_ticks - math.floor(ends[0] * self.rate + 1e-9)

    @property
    def sensor_ticks(self) -> int:
        """Age that a reading may have when it is used, in whole ticks, rounded up."""
        return max(_ticks(self.rate / self.sensor.sampling), 1)

    @property
    def series(self) -> float:
        """Stiffness between the commanded position and the surface [N/m]."""
        return self.inner.stiffness

    def seen(self, stiffness: float) -> float:
        """K_eff: the surface's stiffness and the series' in one, as the command feels them [N/m]."""
        return stiffness / (1.0 + stiffness / self.series)

    def surface(self, seen: float) -> float:
        """The surface's own stiffness from K_eff [N/m]; infinite where that reaches the series stiffness."""
        return seen / (1.0 - seen / self.series) if seen < self.series else math.inf


def _ticks(ticks: float) -> int:
    if not math.isfinite(ticks):
        raise InputError(
            "a delay of the arm is more ticks than can be counted; check its delays and its rate"
        )
    return math.ceil(ticks - 1e-9)


def names() -> list[str]:
    """The arms that come with palpate."""
    return sorted(f.name.removesuffix(".toml") for f in files("palpate.force").joinpath("arms").iterdir())


def load_arm(name: str) -> Arm:
    """An arm by its name, or from a TOML file.

    Raises:
        InputError: no such arm or file, TOML that does not parse, an unknown or missing key, a value out of range.
    """
    if name in names():
        text = files("palpate.force").joinpath("arms", f"{name}.toml").read_text(encoding="utf-8")
        return parse_arm(text, name)
    path = Path(name)
    if path.suffix.lower() != ".toml":
        raise unknown("arm", name, [*names(), "a TOML file"])
    return parse_arm(read_text(path, "an arm"), name)


def parse_arm(text: str, where: str) -> Arm:
    """An arm from TOML; `where` names the text in errors."""
    return from_toml(text, where, Arm)


def from_toml(text: str, where: str, kind: type[T]) -> T:
    """A table of this kind from TOML.

    Raises:
        InputError: TOML that does not parse, an unknown or missing key, a value out of range or not finite.
    """
    return read_table(text, where, kind, _remedy)


def _remedy(error: str) -> str:
    """Remedy of a missing number."""
    name = error.partition("missing required field `")[2].partition("`")[0]
    return f"; {_REMEDIES[name]}" if name in _REMEDIES else ""
