"""Options of `palpate tune` and `palpate certify`, in groups."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.cli.options import values
from palpate.cli.options.common import QUIET, WRITTEN, FileOptions, LoopArm
from palpate.cli.options.values import FLAG, SIGNED, only, options
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.force import Arm, Gains
    from palpate.force.inner_loop import InnerLoop


@options("The arm", 1)
class LoopArmOptions:
    """The arm whose loop is tuned."""

    arm: Annotated[LoopArm, QUIET]
    "ur5e, fr3, panda, iiwa14, thesis, or a TOML file."
    loop_from: Path | None = None
    "A log of commanded and measured position in free motion: it identifies the arm's inner loop and delay."
    push: str | None = None
    """Column of the measured force in that log, in which the tip is pushed once: it identifies a servo that
    yields."""

    def load(self, columns: ColumnOptions) -> tuple[Arm, InnerLoop | None]:
        """The arm, and notes on the identification of its inner loop."""
        from palpate.force import load_arm

        arm = load_arm(self.arm)
        if self.loop_from is None:
            if self.push is not None:
                raise InputError("--push names a column of the log of --loop-from; give that log")
            return arm, None
        inner = inner_loop(self.loop_from, columns, self.push)
        return inner.of(arm, self.loop_from.name), inner


@options("The surface", 2)
class SurfaceOptions:
    """Prior of the surface, without a log."""

    stiffness: values.StiffnessRange | None = None
    "Range of its stiffness, LOW:HIGH in N/m or LOW:HIGH:UNIT."
    stiffness_cap: values.Stiffness | None = None
    "Largest possible stiffness, N/m."
    damping_max: values.Damping | None = None
    "Largest possible damping, N s/m; if not given, the upper end of the interval that the log gives."


@options("The press", 3)
class PressOptions:
    """Desired force and its limit."""

    force: values.Force
    "Desired force, N; the smallest one if it varies."
    force_max: values.Force | None = None
    """F_max, N: the force that is not exceeded, on layers and after a false touch, too. It limits the speed. Five times
    the force if not given, and at most what the sensor reads; none for a slide."""

    def highest_force(self, arm: Arm, *, slides: bool) -> float | None:
        """F_max, as given or as usual, in newtons; None for a slide."""
        from palpate.force.ceiling import usual_force_max

        if self.force_max is not None:
            return self.force_max.si
        return None if slides else usual_force_max(self.force.si, arm.sensor)


@dataclass(frozen=True, kw_only=True)
class SlideLimits:
    """Numbers that every slide has, in palpate tune --slide and in palpate slide."""

    mu_max: Annotated[float, SIGNED] = 0.9
    "Upper bound of the friction coefficient."
    speed: values.Velocity = values.quantity_default("30:mm/s", "velocity")
    "Speed along the surface, as 30:mm/s."
    tilt: Annotated[float, SIGNED] = 7.0
    "Standard deviation of the given normal, in degrees."
    step: values.Length = values.quantity_default("0:mm", "length")
    "Highest step that is expected in the surface, as 1:mm: the slide is slow enough to stop on it."
    touches: values.Length = values.quantity_default("10:mm", "length")
    "Spacing of three light touches that measure the normal before the slide; 0:mm for none."

    def gains_with(self, gains: Gains, radius: float) -> Gains:
        """The gains with a table `slide`.

        Args:
            gains: of the force loop.
            radius: smallest radius of curvature of the surface [m].

        Raises:
            InputError: a number out of range.
        """
        from msgspec.structs import replace

        from palpate.force.slide_table import Slide

        v, max_speed = self.speed.si, gains.speed
        if not 0.0 < self.mu_max <= 2.0:
            raise InputError(
                f"--mu-max must be above 0 and at most 2 (friction never is 0; 0.9 is usual), got {self.mu_max:g}"
            )
        if not 0.0 < v <= max_speed:
            raise InputError(
                f"--speed must be above 0 and at most the arm's {max_speed:g} m/s, got {v:g} m/s"
            )
        if not 1e-3 <= radius < 1e4:
            raise InputError(f"--radius must be from 1 mm to 10 km, got {radius:g} m")
        if not 0.1 <= self.tilt <= 25.0:
            raise InputError(f"--tilt must be from 0.1 to 25 degrees, got {self.tilt:g}")
        for name, length in (("--step", self.step.si), ("--touches", self.touches.si)):
            if not 0.0 <= length <= 0.1:
                raise InputError(f"{name} must be from 0 to 100 mm, got {1e3 * length:g} mm")
        slope = radians(self.tilt)
        slide = Slide(
            speed=v,
            mu_max=self.mu_max,
            radius=radius,
            slope=slope,
            step=self.step.si,
            touches=self.touches.si,
        )
        return replace(gains, slide=slide)


@options("A slide along the surface", 4)
class SlideTuningOptions(SlideLimits):
    """A slide, for palpate slide and palpate.force.SlidingLoop."""

    slide: Annotated[bool, FLAG] = False
    "Tune for a slide too, and print on which surfaces it holds the force within 3 % rms."
    radius: values.Length = values.quantity_default("100:mm", "length")
    "Smallest radius of curvature of the surface, as 100:mm."

    def tuned_for(self, gains: Gains) -> Gains:
        """The gains with a table `slide`, if one is wanted."""
        if self.slide:
            return self.gains_with(gains, self.radius.si)
        only(self, "a slide; add --slide")
        return gains


@options("Signals of the logs", 4)
class ColumnOptions:
    """Columns of a log of a press, and of the one that --loop-from names."""

    time: str | None = None
    "Column of the time, in s if no unit is given."
    rate: float | None = None
    "Rows per second, for a log without a column of time."
    position: str | None = None
    "Column of the measured position, as position_mm:mm."
    force_column: str | None = None
    "Column of the force in the log of a press, as force_mN:mN."
    command: str | None = None
    "Column of the commanded position in the log of --loop-from, as target_mm:mm."
    payload: Path | None = None
    "For a log of a press: the file of palpate payload, whose mass is subtracted from M."

    @property
    def press_roles(self) -> dict[str, Any]:
        """The columns and the payload, as for `palpate.identify_log`."""
        columns = {
            "time": self.time,
            "rate": self.rate,
            "position": self.position,
            "force": self.force_column,
        }
        return {
            name: value for name, value in {**columns, "payload": self.payload}.items() if value is not None
        }


@options(WRITTEN)
class TuningOutputOptions(FileOptions):
    """Files to write, and how much to print."""

    out: Path | None = None
    "Where to write the gains (a TOML file) or the certificate (a JSON file)."
    verbose: Annotated[bool, FLAG] = False
    "Print every figure, every warning, and the cases that no proof covers."


def inner_loop(log: Path, columns: ColumnOptions, push: str | None = None) -> InnerLoop:
    """The inner loop identified from a log of commanded and measured position; a servo, with a column of a push.

    Raises:
        InputError: the log or its columns are wrong, or it does not excite the loop.
    """
    from palpate.force.inner_loop import identify_inner_loop
    from palpate.logs import read_log

    names: dict[str, Any] = {"command": columns.command, "position": columns.position, "time": columns.time}
    lacking = [f"--{role}" for role in ("command", "position") if names[role] is None]
    if columns.time is None and columns.rate is None:
        lacking.append("--time (or --rate)")
    if lacking:
        raise InputError(
            f"name the columns of {log} with {', '.join(lacking)} (palpate topics {log} lists them)"
        )
    for role in ("command", "position"):
        if ":" not in names[role]:
            names[role] += ":m"
    names["force"] = push if push is None or ":" in push else f"{push}:N"
    columns_given = {role: name for role, name in names.items() if name is not None}
    record = read_log(log, rate=columns.rate, **columns_given)
    force = None if push is None else record["force"]
    return identify_inner_loop(
        record["time"], record["command"], record["position"], where=str(log), force=force
    )
