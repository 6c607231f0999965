"""Free stroke before a press: away from the surface and back, to learn how the force changes with the position.

A cable pulls harder the farther the tip goes, and an arm's estimate of the force changes with its pose. A force in
proportion to the position is subtracted from the readings of the press; another one is refused. A force that begins
only on the way to the surface cannot be seen from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.gains import Gains
from palpate.press.at_rest import DRIFT_SIGNIFICANCE
from palpate.press.sequence import MovableArm, lag_ticks
from palpate.press.unload import REST_LAGS

MAX_STROKE = 0.02
"""Length of the stroke where the press may travel farther and none is given [m]."""
PARTS = 60
"""Parts of the stroke whose means are fitted, so that a hum, or the memory of a low-pass, counts once in each."""
REACH = 1.2
"""Way from the start for which a slope is believed, over the length of the stroke that has shown it."""
SLOPE_SIGNIFICANCE = 3.0
"""Standard errors from which on a slope is subtracted: wrong once in 300, and then by little."""
MET_FRACTION = 0.5
"""Fraction of the desired force by which the force changes if the stroke has met something: that of an obstacle behind
the tip in a retreat."""


class StrokePlan(NamedTuple):
    """Way and speed of a stroke.

    Args:
        normal: into the surface, of unit length, shape (3,).
        length: of the way from the start and back [m].
        speed: at most [m/s].
        gains: of the loop.
        force: desired force of the press [N].
    """

    normal: Array
    length: float
    speed: float
    gains: Gains
    force: float

    @property
    def ticks(self) -> int:
        """Ticks of each way, whose mean speed is half of the largest."""
        return int(np.ceil(2.0 * self.length / (self.speed * self.gains.arm.tick)))

    @property
    def speeds(self) -> Array:
        """Speed along the normal in each tick [m/s], shape (n,): smooth, so that lag and inertia show little."""
        phase = 2.0 * np.pi * (np.arange(self.ticks) + 0.5) / self.ticks
        there = np.concatenate([np.cos(phase) - 1.0, np.zeros(REST_LAGS * lag_ticks(self.gains))])
        return np.concatenate([there, -there]) * self.length / (self.ticks * self.gains.arm.tick)

    @property
    def seconds(self) -> float:
        """Duration of the stroke [s]."""
        return len(self.speeds) * self.gains.arm.tick


class StrokeMetError(InputError):
    """The stroke has met something; the text says what was seen."""


@dataclass(frozen=True)
class FreeForce:
    """Force in free motion along the normal, as a stroke shows it: a line over the position, and more than that.

    Args:
        length: of the stroke [m].
        slope: change of the force with the position [N/m], and its standard deviation.
        bend: coefficient of the square of the position [N/m^2], and its standard deviation.
        rest: standard deviation of what else changes from part to part of the stroke [N].
    """

    length: float
    slope: tuple[float, float]
    bend: tuple[float, float]
    rest: float

    def slope_to_subtract(self, travel: float, level: float) -> float:
        """Slope of the force over the position that is subtracted [N/m]; 0 if it is not significant, or harmless.

        Args:
            travel: farthest place of the press from its start [m].
            level: largest force that free motion may show [N].

        Raises:
            InputError: the force changes in another way, or was measured over a shorter way than the press may go.
        """
        allowed = f"and free motion may show {level:.2g} N"
        slope, std = self.slope
        changes = f"in free motion the force changes with the position by {slope:.3g} N/m (std {std:.2g})"
        bend = abs(self.bend[0]) - DRIFT_SIGNIFICANCE * self.bend[1]
        if bend * travel**2 > level:
            raise InputError(
                f"{changes}, and by {bend * travel**2:.2g} N more within the {1e3 * travel:.3g} mm of this press,"
                f" {allowed}: start within {1e3 * sqrt(level / bend):.2g} mm of the surface (--travel-limit), and see"
                " what pulls at the tool, or whether it touches something"
            )
        if self.rest > level:
            raise InputError(
                f"in free motion the force changes with the position by {self.rest:.2g} N (standard deviation) beside a"
                f" parabola, {allowed}: see what pulls at the tool, or whether it touches something"
            )
        if abs(slope) <= SLOPE_SIGNIFICANCE * std or abs(slope) * travel <= level:
            return 0.0
        if travel > REACH * self.length or SLOPE_SIGNIFICANCE * std * travel > level:
            raise InputError(
                f"{changes} over {1e3 * self.length:.3g} mm, which is not enough for the {1e3 * travel:.3g} mm of this"
                f" press, {allowed}: make --free-stroke longer, or --travel-limit shorter"
            )
        return slope

    def to_json(self, subtracted: float) -> dict[str, Any]:
        """Length, slope and the slope that is subtracted, as plain JSON values."""
        return {
            "length_m": self.length,
            "slope_N_per_m": self.slope,
            "subtracted_N_per_m": subtracted,
        }


def make_stroke(arm: MovableArm, plan: StrokePlan) -> FreeForce:
    """Move the tip away from the surface, rest, and move it back, by readings of the arm; fit the force.

    Raises:
        StrokeMetError: the force has changed as by a surface; the tip is then where it was met.
    """
    normal = plan.normal
    rows: list[tuple[float, float, float]] = []
    for speed in plan.speeds.tolist():
        time, force, position, *_ = arm.read()
        rows.append((time, float(normal @ position), float(normal @ force)))
        out, met = rows[-1][1] - rows[0][1], abs(rows[-1][2] - rows[0][2])
        if met > MET_FRACTION * plan.force:
            raise StrokeMetError(
                f"the tip met {met:.3g} N, {1e3 * abs(out):.3g} mm from the start: is --normal right, is something"
                " behind the tool, or did it touch the surface before?"
            )
        # An arm that came back faster than it went, as after lost ticks, stops at its start.
        arm.move((0.0 if speed > 0.0 and out >= 0.0 else speed) * normal)
    return fit_free_force(np.array(rows), plan.length)


def fit_free_force(rows: Array, length: float) -> FreeForce:
    """Fit the force over the position and its square; speed, acceleration and time are fitted beside them.

    The acceleration takes the tool's inertia out of the slope; the press moves too evenly to show it.

    Args:
        rows: time [s], position along the normal [m] and force along the normal [N], shape (n, 3).
        length: of the stroke [m].
    """
    count = min(PARTS, len(rows) // 2)
    t, u, f = np.array([part.mean(axis=0) for part in np.array_split(rows - rows[0], count)]).T
    step = float(np.ptp(t)) / (count - 1)
    speed, acceleration = np.gradient(u, step), np.zeros(count)
    acceleration[1:-1] = np.diff(u, 2) / step**2
    columns = np.column_stack([np.ones(count), t - t.mean(), speed, acceleration, u, u * u])
    values, stds, rest = _least_squares(columns, f)
    bend = values[5], stds[5]
    if abs(bend[0]) <= SLOPE_SIGNIFICANCE * bend[1]:
        values, stds, rest = _least_squares(columns[:, :5], f)
    return FreeForce(length, (values[4], stds[4]), bend, rest)


def subtraction_notes(stroke: Mapping[str, Any] | None) -> list[str]:
    """Name the slope that a stroke, as `FreeForce.to_json` has it, took off the readings of the press, if any."""
    if not stroke or not stroke["subtracted_N_per_m"]:
        return []
    text = "the force in free motion changes by {:.3g} N/m (std {:.2g}), which was subtracted"
    return [text.format(*stroke["slope_N_per_m"])]


def _least_squares(columns: Array, f: Array) -> tuple[list[float], list[float], float]:
    """Coefficients, their standard deviations, and that of the residual."""
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-300)
    inverse = np.linalg.pinv(columns / scale)
    values = inverse @ f
    residual = f - columns / scale @ values
    spread = float(np.sqrt(residual @ residual / (len(f) - columns.shape[1])))
    stds = spread * np.sqrt((inverse**2).sum(axis=1)) / scale
    return (values / scale).tolist(), stds.tolist(), spread
