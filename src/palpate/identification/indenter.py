"""Young's modulus from the slope of a press, for a named indenter.

Of an elastic half space, by the reduced modulus E* = E / (1 - nu^2) and the depth d:

    sphere   F = 4/3 E* sqrt(R) d^(3/2)          Hertz, J. reine angew. Math. 92, 1882
    cone     F = 2/pi E* tan(alpha) d^2          Sneddon, Int. J. Engng Sci. 3, 1965; alpha from the axis
    punch    F = 2 a E* d                        Sneddon

Each is F = c E* d^p, with a slope S = p F / d. So the slope at a force gives E* without the surface's place:
E* = S^p / (p^p c F^(p-1)). The same by the depth from the touch is S / (p c d^(p-1)): the two differ where the touch is
not where it was taken to be, or where the press is none of that indenter on that half space. What they differ by, and
what the answer differs by from force to force, is in the interval.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atanh, isfinite, pi, sqrt, tan

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identification.least_squares import estimate_noise
from palpate.identification.result import Identification, Press
from palpate.identification.uncertainty import Contribution, Parameter, Verdict, half_width
from palpate.records import Record
from palpate.signals.samples import block_means, white_noise
from palpate.signals.types import NORMAL
from palpate.units import quantity, unit

ASSUMPTIONS = "a half space (deep and wide compared with the contact), small strain, no adhesion"
"""Assumptions of the laws, which no press can check."""
_SIZE_WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*:?\s*([a-zA-Zµμ°]*)\s*")
"""A number and its unit."""
_UNKNOWN_POISSON = (0.75, 1.0)
"""1 - nu^2 of materials that do not thicken when they are pulled: nu from 0.5 to 0."""


@dataclass(frozen=True)
class Indenter:
    """A shape that presses.

    Args:
        shape: sphere, punch (flat, round) or cone.
        size: radius [m]; of a cone the angle between its axis and its side [rad].
    """

    shape: str
    size: float

    def __post_init__(self) -> None:
        if self.shape not in _LAWS:
            raise InputError(f"an indenter is a {', a '.join(_LAWS)}, got {self.shape!r}")
        if not (isfinite(self.size) and self.size > 0):
            size = "half angle" if self.shape == "cone" else "radius"
            raise InputError(f"the {size} of a {self.shape} must be more than 0, got {self.size:g}")
        if self.shape == "cone" and self.size >= pi / 2:
            angle = np.degrees(self.size)
            raise InputError(f"the half angle of a cone must be under 90 deg, got {angle:g} deg")

    @classmethod
    def parse(cls, text: str) -> Indenter:
        """A shape from `sphere:RADIUS:UNIT`, `punch:RADIUS:UNIT` or `cone:HALF_ANGLE:UNIT`.

        Raises:
            InputError: another shape, no number, or no unit of the right quantity.
        """
        shape, _, size = text.partition(":")
        match = _SIZE_WITH_UNIT.fullmatch(size)
        if shape not in _LAWS or match is None:
            shapes = "sphere:RADIUS, punch:RADIUS or cone:HALF_ANGLE, as sphere:5:mm"
            raise InputError(f"--indenter needs {shapes}, got {text!r}")
        quantity, usual = ("angle", "deg") if shape == "cone" else ("length", "mm")
        if not match[2]:
            raise InputError(f"--indenter {text} needs a unit, as {shape}:{match[1]}:{usual}")
        size_unit = unit(match[2])
        if size_unit.quantity != quantity:
            raise InputError(
                f"{match[2]!r} of --indenter is a unit of {size_unit.quantity}; a {shape} needs one of {quantity}"
            )
        return cls(shape, float(match[1]) * size_unit.factor)

    def contact_radius(self, depth: float) -> float:
        """Radius of the contact at a depth [m]."""
        if self.shape == "sphere":
            return sqrt(self.size * depth)
        return self.size if self.shape == "punch" else 2 / pi * depth * tan(self.size)

    def __str__(self) -> str:
        if self.shape == "cone":
            return f"cone of {np.degrees(self.size):.4g} deg half angle"
        return f"{self.shape} of {1e3 * self.size:.4g} mm radius"


_LAWS: dict[str, tuple[float, Callable[[float], float]]] = {
    "sphere": (1.5, lambda radius: 4 / 3 * sqrt(radius)),
    "punch": (1.0, lambda radius: 2 * radius),
    "cone": (2.0, lambda half_angle: 2 / pi * tan(half_angle)),
}


def with_modulus(
    found: Identification,
    indenter: Indenter,
    poisson: tuple[float, float] | None = None,
    tolerance: float = 0.25,
    record: Record | None = None,
) -> Identification:
    """An identification with Young's modulus E [Pa] among its parameters.

    If the force has a slope before the contact, or the tangents do not give E, E is that of the law above a straight
    baseline, fitted to the approach with the contact point.

    Args:
        found: with its press.
        indenter: that pressed.
        poisson: Poisson's ratio and its standard deviation; None for anything from 0 to 0.5, equally likely.
        tolerance: largest half-width of an identified E's 95 % interval, as a share of its value.
        record: position and force of the whole log, for the baseline.

    Raises:
        InputError: the log is not in N and m, or Poisson's ratio is impossible.
    """
    check_poisson(poisson)
    units = (found.traces.force_unit, found.traces.position_unit) if found.traces else ("N", "m")
    if units != ("N", "m"):
        raise InputError(f"an indenter needs force in N and position in m, not {units[0]} and {units[1]}")
    modulus = _modulus(found.press, indenter, poisson, tolerance)
    baseline = None if record is None else fit_baseline(record, indenter)
    if baseline is not None and (baseline.tilted or modulus.verdict is not Verdict.IDENTIFIED):
        modulus = _above_baseline(baseline, modulus, indenter, poisson, tolerance)
    return replace(found, parameters={"E": modulus, **found.parameters})


def check_poisson(poisson: tuple[float, float] | None) -> None:
    """Refuse a Poisson's ratio that no isotropic material has."""
    if poisson is None:
        return
    value, std = poisson
    if not (-1 < value <= 0.5 and isfinite(std) and std >= 0):
        raise InputError(
            f"Poisson's ratio must be in (-1, 0.5] and its std 0 or more, got {value:g} and {std:g}"
        )


def _modulus(
    press: Press | None, indenter: Indenter, poisson: tuple[float, float] | None, tolerance: float
) -> Parameter:
    if press is None or not press.tangent or not press.loading.size:
        return Parameter.unknown("Pa", "the log has no loading whose slope could be estimated")
    not_rising = next((t for t in press.tangent if t.stiffness <= t.half), None)
    if not_rising is not None:
        shown = f"{not_rising.stiffness:.3g} ± {not_rising.half:.3g} N/m"
        reason = f"at {not_rising.force:.3g} N the force does not rise with the depth ({shown})"
        return Parameter.unknown("Pa", reason)
    if len(press.tangent) < 2:
        return Parameter.unknown("Pa", "the slope is known at one force only; its growth is not")
    if press.tangent[0].force <= 0:
        return Parameter.unknown("Pa", "the force of the press is not above zero")
    p, factor = _LAWS[indenter.shape]  # F = c E* d^p, c in m^(2-p)
    c = factor(indenter.size)
    force, slope, slope_halves = np.array([(t.force, t.stiffness, t.half) for t in press.tangent]).T
    by_force = slope**p / (p**p * c * force ** (p - 1))
    half_widths = p * slope_halves / slope * by_force
    weight = half_widths**-2 / (half_widths**-2).sum()
    depth = float(p * np.mean(force / slope))
    reduced = float(weight @ by_force)
    parts = {
        "tangent": float(
            weight @ half_widths
        ),  # the slopes are of one loading: their errors do not average out
        "the indenter's law": float(np.maximum(abs(by_force - reduced) - half_widths, 0.0).max()),
        "surface position": float(abs(_modulus_by_depth(press, slope, force, p, c, reduced) - reduced).max()),
    }
    if indenter.shape == "sphere":
        if depth >= indenter.size:
            deep = 1e3 * depth
            radius = 1e3 * indenter.size
            reason = f"the press goes {deep:.3g} mm deep, beyond the sphere's radius of {radius:.3g} mm"
            return Parameter.unknown("Pa", reason)
        parts["small strain"] = abs(_hertz_ratio(depth / indenter.size) - 1) * reduced
    return _judge_modulus(reduced, parts, indenter, poisson, depth, tolerance)


def _modulus_by_depth(press: Press, slope: Array, force: Array, p: float, c: float, reduced: float) -> Array:
    """E* by the depth from the touch that the log shows, at each force that it reaches [Pa], shape (n,).

    A touch is found at a force, and where that grows slowly the surface lies before it by what the law needs for it: a
    cone has 5 % of its force at 22 % of its depth.
    """
    depth, force_curve = press.loading
    monotone_force = np.maximum.accumulate(force_curve)
    touch_force = max(float(np.interp(0.0, depth, force_curve)), 0.0)
    depth_at_touch = (touch_force / (c * reduced)) ** (1 / p)
    min_depth = 1e-3 * float(np.abs(depth).max())  # a touch found too late leaves a force at no depth
    depths = np.maximum(np.interp(force, monotone_force, depth) + depth_at_touch, min_depth)
    return np.asarray(slope / (p * c * depths ** (p - 1)))


_MAX_POINTS = 1000
"""Maximum points of an approach that the law is fitted to; more are averaged."""
_MIN_POINTS = 50
_CONTACT_RANGE = (0.1, 0.9)
"""Fractions of the approach between which the contact point is looked for."""
_MAX_MISFIT = 0.005
"""Root mean square of the residuals beyond white noise, over the force, above which law and baseline do not describe
the approach: those of another indenter are 0.008 at least."""
_UNLIKELY = 7.0
"""Logarithm of the ratio to the largest likelihood from which on a contact point is left out: one in a thousand."""
_TILTED = 3.3
"""Standard deviations from which on a baseline has a slope (one in 1000)."""


@dataclass(frozen=True)
class Baseline:
    """The law of an indenter above a straight baseline: values with half-widths of their 95 % intervals.

    Args:
        reduced: E* [Pa].
        contact: position of the contact point, on the log's own scale [m].
        force, slope: of the baseline at the contact point [N], [N/m].
        by_depth: difference of E* in the upper half of the depth, beyond its noise [Pa].
        depth: of the press [m].
        tilted: the slope is significant.
    """

    reduced: tuple[float, float]
    contact: tuple[float, float]
    force: tuple[float, float]
    slope: tuple[float, float]
    by_depth: float
    depth: float
    tilted: bool


def fit_baseline(record: Record, indenter: Indenter) -> Baseline | None:
    """Fit the law above a baseline to the approach of a log; None if they do not describe it.

    Position and force may have either direction. The part up to half of the depth is fitted again: the two differ
    where the press is none of that indenter on that half space.
    """
    finite = np.isfinite(record["position"] + record["force"])
    position, force = record["position"][finite], record["force"][finite]
    fits = []
    for way in (1.0, -1.0):
        top = int(np.argmax(way * position))
        begin = int(np.argmin(way * position[: top + 1]))
        size = max((top - begin) // _MAX_POINTS, 1)
        x, f = (block_means(values[begin : top + 1], size) for values in (way * position, force))
        for sign in (1.0, -1.0):
            fit = _above_line(x, sign * f, indenter)
            if fit is not None:
                fits.append((fit[2], way, x, sign * f, fit))
    if not fits:
        return None
    misfit, way, x, f, (theta, half, _) = min(fits, key=lambda entry: entry[0])
    if misfit > _MAX_MISFIT or half[2] >= theta[2]:
        return None
    shallow = x < (theta[3] + x.max()) / 2
    part = _above_line(x[shallow], f[shallow], indenter)
    by_depth = theta[2] if part is None else max(abs(part[0][2] - theta[2]) - part[1][2], 0.0)
    values = [(float(value), float(width)) for value, width in zip(theta, half, strict=True)]
    contact = way * values[3][0], values[3][1]
    tilted = abs(theta[1]) > _TILTED / NORMAL * half[1]
    return Baseline(
        values[2], contact, values[0], values[1], float(by_depth), float(x.max() - theta[3]), bool(tilted)
    )


def _above_line(x: Array, force: Array, indenter: Indenter) -> tuple[Array, Array, float] | None:
    """Baseline at the contact [N], its slope [N/m], E* [Pa] and contact point [m]; half-widths; relative misfit.

    The contact point is integrated over by its likelihood; None if E* is not above zero, or there are too few points.
    """
    if len(x) < _MIN_POINTS or np.ptp(x) == 0 or np.ptp(force) == 0:
        return None
    p, factor = _LAWS[indenter.shape]
    low, reach = float(x.min()), float(np.ptp(x))

    def fit(place: float) -> tuple[Array, Array, Array]:
        depth = np.maximum(x - place, 0.0)
        design = np.column_stack([np.ones(len(x)), x - place, factor(indenter.size) * depth**p])
        scale = np.linalg.norm(design, axis=0)
        theta = np.linalg.lstsq(design / scale, force, rcond=None)[0] / scale
        gram = np.linalg.pinv((design / scale).T @ (design / scale)) / np.outer(scale, scale)
        return theta, gram, force - design @ theta

    places = low + reach * np.linspace(*_CONTACT_RANGE, 81)
    for _ in range(4):  # finer about the most likely places
        losses = np.array([float(np.sum(fit(place)[2] ** 2)) for place in places])
        best = int(np.argmin(losses))
        noise = estimate_noise(fit(places[best])[2], np.arange(len(x)), 4)
        variance = max(noise.variance, 1e-300) * len(x) / noise.effective
        likely = np.flatnonzero(losses - losses[best] < 2.0 * _UNLIKELY * variance)
        ends = places[max(likely[0] - 1, 0)], places[min(likely[-1] + 1, len(places) - 1)]
        places = np.linspace(*ends, 81)
    fits = [fit(place) for place in places]
    losses = np.array([float(residual @ residual) for *_, residual in fits])
    weight = np.exp(-(losses - losses.min()) / (2.0 * variance))
    weight /= weight.sum()
    values = np.array([[*theta, place] for (theta, *_), place in zip(fits, places, strict=True)])
    within = np.array([[*(variance * np.diag(gram)), 0.0] for _, gram, _ in fits])
    mean = weight @ values
    half = NORMAL * np.sqrt(weight @ (within + (values - mean) ** 2))
    misfit = float(np.sqrt(max(losses.min() / len(x) - white_noise(force) ** 2, 0.0)) / np.ptp(force))
    return (mean, half, misfit) if mean[2] > 0 else None


def _above_baseline(
    baseline: Baseline,
    modulus: Parameter,
    indenter: Indenter,
    poisson: tuple[float, float] | None,
    tolerance: float,
) -> Parameter:
    """Young's modulus above a baseline; the given one if the press is too deep."""
    reduced, half = baseline.reduced
    parts = {"tangent": half, "the indenter's law": baseline.by_depth}
    if indenter.shape == "sphere":
        if baseline.depth >= indenter.size:
            return modulus
        parts["small strain"] = abs(_hertz_ratio(baseline.depth / indenter.size) - 1) * reduced
    judged = _judge_modulus(reduced, parts, indenter, poisson, baseline.depth, tolerance)
    place, force, slope = (
        quantity(*number[:1], symbol, number[1])
        for number, symbol in ((baseline.contact, "m"), (baseline.force, "N"), (baseline.slope, "N/m"))
    )
    known, colon, terms = judged.reason.partition(": ")
    line = f"above a baseline of {force} with a slope of {slope}, contact at {place}"
    return replace(judged, reason=f"{known}, {line}{colon}{terms}")


def _hertz_ratio(strain: float) -> float:
    """Force on a rigid sphere over Hertz's, which takes it for a paraboloid, by depth over radius (Sneddon)."""
    from scipy.optimize import brentq

    u = brentq(lambda u: u * atanh(u) - strain, 1e-9, 1 - 1e-12)
    return ((1 + u**2) * atanh(u) - u) / (4 / 3 * strain**1.5)


def _judge_modulus(
    reduced: float,
    causes: dict[str, float],
    indenter: Indenter,
    poisson: tuple[float, float] | None,
    depth: float,
    tolerance: float,
) -> Parameter:
    """Young's modulus from E* with the half-widths of its causes [Pa]."""
    if poisson is None:
        factor = sum(_UNKNOWN_POISSON) / 2
        unknown = (_UNKNOWN_POISSON[1] - _UNKNOWN_POISSON[0]) / sum(_UNKNOWN_POISSON)
    else:
        factor = 1 - poisson[0] ** 2
        unknown = NORMAL * abs(2 * poisson[0]) * poisson[1] / factor
    value = factor * reduced
    causes = {
        cause: factor * part for cause, part in (causes | {"Poisson's ratio": unknown * reduced}).items()
    }
    main = max(causes, key=lambda cause: causes[cause])
    ratio = "Poisson's ratio 0 to 0.5 (none given)" if poisson is None else f"Poisson's ratio {poisson[0]:g}"
    radius = 1e3 * indenter.contact_radius(depth)
    terms = f"a {indenter}, {ratio}, contact radius about {radius:.2g} mm; assumed: {ASSUMPTIONS}"
    bounds = {cause: Contribution.within(half_of_cause) for cause, half_of_cause in causes.items()}
    half = half_width(bounds)
    modulus = Parameter.of(value, "Pa", Verdict.NOT_IDENTIFIABLE, "", bounds)
    if half >= value:
        reason = f"the press does not follow a {indenter}: 95 % 0 to {value + half:.3g} Pa, most of it {main}"
        return modulus.without_number(reason, ci95=modulus.ci95)
    percentage = f"{100 * half / value:.2g} %"
    if half <= tolerance * value:
        return replace(modulus, verdict=Verdict.IDENTIFIED, reason=f"known to {percentage} (95 %): {terms}")
    return replace(modulus, reason=f"known to {percentage} only (95 %), most of it {main}: {terms}")
