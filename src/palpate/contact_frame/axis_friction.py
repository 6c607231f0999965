"""Friction of a joint or an axis: Coulomb, viscous, offset and Stribeck, from its force or torque and its motion.

`axis_posterior` has the model and its estimate; the verdicts are here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.axis_motion import SlidingBlocks, sliding_blocks
from palpate.contact_frame.axis_posterior import (
    Terms,
    describe_curvature,
    draw_parameters,
    fit_roughly,
    refine_grid,
)
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.records import Record, Result
from palpate.signals.types import NORMAL
from palpate.units import impedance_units

MAX_UNEQUAL = 0.1
"""Fraction of a friction at one speed by which unequal speeds may move the offset."""
NAMES = {
    "Fc": "Coulomb friction",
    "B": "viscous friction",
    "F0": "offset",
    "Fs": "static friction",
    "vs": "Stribeck speed",
    "F": "friction at the usual speed",
}
"""Parameters and their names, in the order of an answer."""


@dataclass(frozen=True, eq=False)
class AxisFriction(Result):
    """Friction of a joint or an axis, identified from a log.

    Args:
        parameters: Fc, B, F0, Fs, vs and F, the friction at the median speed.
        speeds: slowest, median and fastest speed of the fitted rows, without sign.
        directions: how many directions there are, 0 for no motion.
        units: of force and speed.
        rmse: root mean square of the residuals of the block means.
        r2: fraction of their variance that is explained.
        rows: fitted rows.
        notes: doubts about the log, as in a record's meta.
        points: speed, friction without nuisances of each block, shape (n, 2).
        curve: speed, friction and both ends of its interval, shape (m, 4).
    """

    parameters: dict[str, Parameter]
    speeds: tuple[float, float, float]
    directions: int
    units: tuple[str, str]
    rmse: float
    r2: float
    rows: int
    notes: Sequence[Mapping[str, str]] = ()
    points: Array = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    curve: Array = field(default_factory=lambda: np.empty((0, 4)), repr=False)

    @property
    def identified(self) -> bool:
        """True if a parameter is identified."""
        return any(p.verdict is Verdict.IDENTIFIED for p in self.parameters.values())

    def to_json(self) -> dict[str, Any]:
        """Plain values that JSON can hold."""
        slowest, median, fastest = self.speeds
        return {
            "model": "coulomb-viscous-stribeck",
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "speeds": {
                "slowest": slowest, "median": median, "fastest": fastest, "unit": self.units[1],
                "directions": self.directions,
            },
            "fit": {"r2": self.r2, "rmse": self.rmse, "n": self.rows},
            "warnings": [dict(note) for note in self.notes],
        }  # fmt: skip


def identify_friction(record: Record, tolerance: float = 0.25, lag: float = 0.0) -> AxisFriction:
    """Identify the friction of a joint or an axis from its force or torque and its motion.

    Args:
        record: columns time, force (or torque), and position or velocity or both, in SI units.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a fraction of its value.
        lag: of the force behind the motion [s], if it is known; one of 20 ms and more biases Fc and B.

    Returns:
        The friction along the motion. The sign of the force is that by which the motion loses power.

    Raises:
        InputError: a column is missing, or there are too few rows.
    """
    blocks, units = sliding_blocks(record, lag)
    notes = [dict(note) for note in record.meta.get("notes", ())]
    if blocks is None:
        reason = "the log shows too little motion above the noise of its speed; move the axis back and forth"
        unknown = {name: Parameter.unknown(_unit(name, units), reason) for name in NAMES}
        return AxisFriction(unknown, (0.0, 0.0, 0.0), 0, units, 0.0, 0.0, 0, notes)
    return _identify(blocks, units, tolerance, notes)


def _identify(
    blocks: SlidingBlocks, units: tuple[str, str], tolerance: float, notes: list[dict[str, str]]
) -> AxisFriction:
    spread, opposed = fit_roughly(blocks)
    if opposed:
        text = "the force acts against the motion that it drives, so its sign is turned"
        notes.append({"code": "force-sign-turned", "text": text})
    force = -blocks.force if opposed else blocks.force
    posterior = refine_grid(blocks, force, spread)
    terms, draws = posterior.terms, draw_parameters(posterior.terms, posterior.cells)
    curvature = describe_curvature(posterior, blocks.limits[2])
    if curvature:
        notes.append({"code": "model-rejected", "text": curvature})
    parameters = _Judge(blocks.limits, units, tolerance, curvature).parameters(draws, terms, posterior.shows)
    best, i, k = posterior.best
    parts = terms.design[:, best.columns[k]] * best.theta[i, k]
    residual = force - parts.sum(axis=1)
    friction = np.isin(best.columns[k], [*terms.base[1:], *terms.effects])
    mean_square = np.average(residual**2, weights=blocks.count)
    variance = np.average((force - np.average(force, weights=blocks.count)) ** 2, weights=blocks.count)
    return AxisFriction(
        parameters, blocks.limits, len(set(np.sign(blocks.speed))), units, float(np.sqrt(mean_square)),
        float(1.0 - mean_square / max(variance, 1e-300)), int(blocks.count.sum()), notes,
        np.column_stack([blocks.speed, residual + parts[:, friction].sum(axis=1)]), _curve(draws, blocks),
    )  # fmt: skip


def _curve(draws: dict[str, Array], blocks: SlidingBlocks) -> Array:
    """Speed, friction and both ends of its interval over the speeds of the log, in each direction."""
    slowest, _, fastest = blocks.limits
    speeds = np.geomspace(slowest, fastest, 40)
    middle, low, high = np.quantile([_at(draws, speed) for speed in speeds], (0.5, 0.025, 0.975), axis=1)
    forth = np.column_stack([speeds, middle, low, high])
    back = -np.column_stack([speeds, middle, high, low])[::-1]
    return np.concatenate([back] * bool((blocks.speed < 0).any()) + [forth] * bool((blocks.speed > 0).any()))


def _at(draws: dict[str, Array], speed: float) -> Array:
    """Friction at a speed, for each draw; without the Coulomb friction where one direction does not show it."""
    level = draws.get("Fc", 0.0) + draws.get("B", 0.0) * speed
    return np.asarray(level + draws["rise"] * np.exp(-((speed / draws["vs"]) ** 2)))


class _Judge(NamedTuple):
    """Verdicts on the parameters.

    Args:
        limits: slowest, median and fastest speed.
        units: of force and speed.
        tolerance: largest half-width of an identified parameter, as a fraction of its value.
        rejected: why the model does not hold; empty if it does.
    """

    limits: tuple[float, float, float]
    units: tuple[str, str]
    tolerance: float
    rejected: str

    def parameters(self, draws: dict[str, Array], terms: Terms, shows: bool) -> dict[str, Parameter]:
        """All parameters, by name in the order of `NAMES`."""
        one_speed = "B" not in terms.names
        parameters = {name: self._unknown(name, _ONE_DIRECTION) for name in NAMES}
        if not one_speed:
            parameters["B"] = self._judge("B", draws["B"], positive=True)
        if "Fc" not in terms.names:
            return parameters
        parameters["F0"] = self._judge("F0", draws["F0"])
        parameters["F"] = self._judge("F", _at(draws, self.limits[1]), positive=True)
        if one_speed:
            return parameters | self._of_one_speed(draws)
        parameters["Fc"] = self._judge("Fc", draws["Fc"], positive=True)
        parameters |= self._stribeck(draws, terms, shows)
        if self.rejected:
            parameters |= {
                name: parameters[name].without_number(self.rejected, Verdict.REJECTED)
                for name in ("Fc", "B", "Fs", "vs", "F")
            }
        return parameters

    def _stribeck(self, draws: dict[str, Array], terms: Terms, shows: bool) -> dict[str, Parameter]:
        slowest = f"{self.limits[0]:.3g} {self.units[1]}"
        if not shows:
            reason = f"no Stribeck effect shows at {slowest} and above; move more slowly, too"
            return {name: self._unknown(name, reason) for name in ("Fs", "vs")}
        step = np.log(terms.grid[1] / terms.grid[0])
        draws = {name: values[np.isfinite(draws["vs"])] for name, values in draws.items()}
        within = np.random.default_rng(2).uniform(-0.5, 0.5, len(draws["vs"]))
        speed = self._judge("vs", draws["vs"] * np.exp(step * within), positive=True)
        reason = f"the slowest speed, {slowest}, is above half of vs: Fs would be extrapolated; move more slowly, too"
        reaches = self.limits[0] < 0.5 * float(np.median(draws["vs"]))
        level = draws["Fc"] + draws["rise"]
        static = self._judge("Fs", level, positive=True) if reaches else self._unknown("Fs", reason)
        return {"Fs": static, "vs": speed}

    def _of_one_speed(self, draws: dict[str, Array]) -> dict[str, Parameter]:
        """Bounds by a friction that is passive: neither Coulomb nor viscous friction is below zero."""
        slowest, median, fastest = self.limits
        high = max(float(np.quantile(_at(draws, median), 0.975)), 0.0)
        bounds = {"Fc": (0.0, high), "B": (0.0, high / median), "Fs": None, "vs": None}
        reason = (
            f"the log has one speed of {median:.3g} {self.units[1]} in a direction, where Fc + B v is one number, F;"
            " add strokes at half and at twice the speed"
        )
        parameters = {name: self._unknown(name, reason, ends) for name, ends in bounds.items()}
        # B v of unequal speeds is in the mean of both directions.
        unequal = high / median * (fastest - slowest) / 2
        if unequal > MAX_UNEQUAL * high:
            low, top = (float(end) for end in np.quantile(draws["F0"], (0.025, 0.975)))
            reason = "the speeds of the two directions differ, and viscous friction is in the mean of both"
            parameters["F0"] = self._unknown("F0", reason, (low - unequal, top + unequal))
        return parameters

    def _unknown(self, name: str, reason: str, ci95: tuple[float, float] | None = None) -> Parameter:
        return Parameter(None, None, ci95, _unit(name, self.units), Verdict.NOT_IDENTIFIABLE, reason)

    def _judge(self, name: str, draws: Array, *, positive: bool = False) -> Parameter:
        unit = _unit(name, self.units)
        quantiles = np.quantile(draws, (0.025, 0.5, 0.975))
        value = float(quantiles[1])
        # A Stribeck effect that may be there or not makes one side short: the longer one holds for both.
        half = float(np.diff(quantiles).max())
        low, high = value - half, value + half
        parameter = Parameter(
            value, half / NORMAL, (low, high), unit, Verdict.NOT_IDENTIFIABLE, "", {"noise": half}
        )
        bounds = f"95 %: {low:.3g} to {high:.3g} {unit}"
        if positive and high < 0.0:
            reason = f"{bounds}: below zero, which no passive friction is; is another force in the log?"
            return parameter.without_number(reason, Verdict.REJECTED)
        if low <= 0.0 <= high:
            return parameter.without_number(f"{bounds}; zero is within it", ci95=(low, high))
        if half > self.tolerance * abs(value):
            reason = f"{bounds}; wider than {self.tolerance:.0%}: move longer, and at more speeds in both directions"
            return replace(parameter, reason=reason)
        reason = f"known to {100 * half / abs(value):.2g} % (95 %)"
        return replace(parameter, verdict=Verdict.IDENTIFIED, reason=reason)


_ONE_DIRECTION = (
    "the axis moves in one direction, where Coulomb friction and offset are one number; move it back, too"
)


def _unit(name: str, units: tuple[str, str]) -> str:
    """Unit of a parameter, from those of force and speed."""
    force, speed = units
    if name == "B":
        return impedance_units(force, speed.removesuffix("/s"))["B"]
    return speed if name == "vs" else force
