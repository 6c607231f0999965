"""The answer on a slide in a log: friction, normal, and stiffness along the path, each with an interval."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.arm import ArmDynamics
from palpate.contact_frame.projecting import residual_of_press
from palpate.contact_frame.signals_in_base import BaseSignals, CompensatedForce, ContactFrame
from palpate.contact_frame.slide_log import (
    BLOCKS,
    MIN_APPROACH_COSINE,
    RELAXATION_SPREAD,
    SlideFit,
    SlideProblem,
    SlideWindows,
    compensate_slide,
    fit_relaxation,
    nearest,
    slide_windows,
)
from palpate.identification import Code, Identification, Parameter, Verdict, Warn
from palpate.identification.options import USUAL_LAG, USUAL_LAG_STD
from palpate.identification.result import LagFound, SlideFound
from palpate.identification.uncertainty import student
from palpate.records import Record
from palpate.signals.rotations import dot_rows
from palpate.units import cone95

UNKNOWN_WEIGHT_STD = 20.0
"""Standard deviation of an unknown weight [N]: robots carry tools of some kilograms."""
FALSE_ALARM = 1e-3
"""Probability at which a dependence on speed, or a slide of a contact that hardly slips, is ascribed to chance."""
MAX_PUSHING_FRACTION = 0.05
"""Fraction of the windows in which friction may seem to push, against its noise."""
MAX_NORMAL_ANGLE = np.radians(30.0)
"""Largest angle between the normal from the force and the normal of the path's plane [rad]."""
PART_SECONDS = 2.5
"""Length of a part of a slide for which a stiffness is estimated [s]."""
TANGENTIAL = (2.0 / 3.0 / RELAXATION_SPREAD, RELAXATION_SPREAD)
"""Tangential over normal stiffness of a contact: 2 (1 - nu)/(2 - nu) (Mindlin 1949), within `RELAXATION_SPREAD`."""
RADIUS_95 = 2.4477
"""Radius of the 95 % of two normal numbers of variance 1."""
SHOWN_PLACES = 200
"""Places of the path in the answer."""


class Coefficient(NamedTuple):
    """Friction over the windows, the half-width of its 95 % interval, and by class of speeds.

    The table's rows are speed [m/s], mu and half-width, shape (j, 3); one if friction does not depend on speed.
    """

    value: float
    half: float
    table: Array


def slide_in(
    signals: BaseSignals,
    frame: ContactFrame,
    arm: ArmDynamics,
    tolerance: float,
    calibration: float,
    press: Identification,
    along: Record,
) -> Identification | None:
    """Identify a slide; None for a press, and the press without its K where the log fits both.

    Args:
        signals: wrench and pose over time.
        frame: as declared by the user.
        arm: whose own stiffness is taken out of K, if it is known.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        press: what the log says if it is one of a press.
        along: the record along the normal of that press.
    """
    compensated = compensate_slide(signals, frame)
    windows = None if compensated is None else slide_windows(signals, compensated, frame)
    claims = press.parameters["K"].verdict is Verdict.IDENTIFIED
    retried = compensated is not None and windows is None and compensated.free.any() and claims
    retried = retried and frame.free is None
    if retried:  # what looks like free motion may be a slide, and its touch friction that begins
        compensated = compensate_slide(signals, frame, touches=False)
        windows = None if compensated is None else slide_windows(signals, compensated, frame)
    if compensated is None or windows is None:
        return None
    fit = _least_squares(windows, compensated, np.zeros(len(windows.speed), int), frame)
    fitted = fit, *fit_relaxation(fit)
    better = advantage(windows, fitted[1], fitted[2], compensated, press, along.meta["contact_frame"])
    certain = student(BLOCKS - 1)
    if better < (certain if retried else -certain):
        return None
    slide = None
    from scipy.special import stdtrit

    # A contact that never slips in full is named a slide against far better evidence alone.
    surely = better > (
        certain if fitted[1].slips or not windows.load_known else stdtrit(BLOCKS - 1, 1.0 - FALSE_ALARM)
    )
    if not retried and (surely or (fitted[1].slips and not claims)):
        slide = _identification(signals, frame, arm, (tolerance, calibration), compensated, windows, fitted)
    if claims:
        return slide or replace(
            press, parameters=press.parameters | {"K": _press_or_slide(press.parameters["K"])}
        )
    significant = slide is not None and (surely or slide.parameters["mu"].value is not None)
    return slide if significant or Code.NO_CONTACT.word in press.codes else None


def _identification(
    signals: BaseSignals,
    frame: ContactFrame,
    arm: ArmDynamics,
    wide: tuple[float, float],
    compensated: CompensatedForce,
    windows: SlideWindows,
    fitted: tuple[SlideProblem, SlideFit, float, Array],
) -> Identification:
    """The identification of a slide; `wide` is its tolerance and calibration."""
    fit, result, length, alternatives = fitted
    fractions, slips = windows.fractions(length)
    rows = slips if result.slips else np.ones(len(slips), bool)
    mu = _coefficient(windows, compensated, frame, fitted, rows)
    if windows.load_known:
        K, parts = _stiffness(windows, result, alternatives[:, 0], length, arm, *wide)
    else:
        K = _not_identifiable("N/m", _NO_ZERO)
        parts = np.zeros((0, 5))
    normal, cone = _normals(windows, fit, result, mu, fractions)
    friction = _verdict(
        mu, _contradiction(windows, fit, result, normal, rows, compensated), windows.load_known, wide[0]
    )
    std = float(np.sqrt(result.covariance[len(result.mu) + 1, len(result.mu) + 1]))
    inside = signals.time[compensated.inside]
    return Identification(
        model="slide",
        parameters={"mu": friction, "K": K},
        contacts=((float(inside[0]), float(inside[-1])),),
        lag=LagFound(USUAL_LAG + result.lag, std, 1.96 * std, "prior"),
        r2=float("nan"),
        rmse=float(np.sqrt(np.mean((result.angle[rows] * windows.noise[rows]) ** 2))),
        n=int(rows.sum()),
        warnings=() if windows.load_known else (Warn(Code.CONTACT_AT_START, _NO_ZERO),),
        slide=_answer(windows, mu, friction, normal, cone, parts, length),
    )


def advantage(
    windows: SlideWindows,
    result: SlideFit,
    length: float,
    compensated: CompensatedForce,
    press: Identification,
    about: dict[str, Any],
) -> float:
    """Evidence for a slide over a press: the difference of their residuals, in its standard deviations.

    A press says that the force is a function of the depth along one direction, F = F_0 + n (K d + B d'), with its own
    n, K and contacts. A slide says that the force goes on while the tip moves across it: |F| = F_0, at the angle of
    friction to the motion. Each is compared with the force in newtons, in the same rows, where the tip moves across the
    force and in free motion. Where the zero of the force is unknown, so is its size: a slide says its angle alone.
    The deviation is that of a sum over parts of the log: Vuong's test (Econometrica 57, 1989), of models of which none
    holds the other.

    Args:
        windows: of the slide.
        result: its parameters.
        length: on which its friction relaxes [m].
        compensated: rows in free motion and in contact by the slide.
        press: its K counts as it is, if it is identified; otherwise the best one does.
        about: normal, sign and bias of the press, as `project` gives them.
    """
    s = windows.smooth
    free = np.interp(s.time, windows.turns[0], compensated.free.astype(float)) > 0.999
    rows = np.flatnonzero(windows.slides | free)[:: max(s.rows // 2, 1)]
    slides = windows.slides[rows]
    F, angle, _ = (values[rows] for values in windows.friction_angle(result, length))
    size = np.linalg.norm(F, axis=1)
    usual = size[slides].mean() if windows.load_known else size
    R = windows.turns[1][nearest(windows.turns[0], s.time[rows])]
    bias = compensated.load.bias - np.array(about["bias_N"])
    read = s.force[rows] + compensated.load.weight + R @ bias
    by_slide = np.where(slides, (size - usual) ** 2 + (size * angle) ** 2, size**2)
    residual = residual_of_press(press, about, s.time[rows], s.position[rows], s.velocity[rows], read)
    by_press = np.sum(residual**2, axis=1)
    # A direction of the motion is noisier than a depth: that is no fault of a slide, and counts for both.
    speed = np.linalg.norm(s.velocity[rows][slides], axis=1)
    by_press[slides] += (size[slides] * s.blur / speed) ** 2
    # Both are normal with a variance of their own: the parts' log-likelihoods against each other.
    press_losses, slide_losses = (values / values.mean() for values in (by_press, by_slide))
    parts = np.array([part.mean() for part in np.array_split(press_losses - slide_losses, BLOCKS)])
    ratio = np.log(by_press.mean() / by_slide.mean())
    return float(np.sqrt(BLOCKS) * ratio / max(np.std(parts, ddof=1), 1e-300))


def _not_identifiable(unit: str, why: str) -> Parameter:
    return Parameter(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, why)


def _press_or_slide(K: Parameter) -> Parameter:
    why = "the tip may slide: force and motion fit a slide as well as a press; give --payload, or press at one place"
    return replace(K, value=None, std=None, verdict=Verdict.NOT_IDENTIFIABLE, reason=why)


_NO_ZERO = (
    "no free motion in the log: the zero of the force is unknown, and friction with it; begin the log before the tip"
    " touches, or give --payload"
)


def _least_squares(
    windows: SlideWindows, compensated: CompensatedForce, classes: Array, frame: ContactFrame
) -> SlideProblem:
    """The least-squares problem, with what free motion leaves unknown of bias and weight."""
    usual = float(np.median(np.linalg.norm(windows.force, axis=1)))
    bias = max(compensated.load.std, 1e-3) if windows.load_known else usual
    weight = compensated.load.weight_std if compensated.load.separable else UNKNOWN_WEIGHT_STD
    turns = float(np.abs(windows.tool_rotations @ windows.reference_rotation.T - np.eye(3)).max()) > 0.02
    weighs = turns and not frame.gravity_compensated
    std = [USUAL_LAG_STD, *[bias] * 3, *[max(weight, 1e-3)] * 3 * weighs]
    return SlideProblem(windows, classes, np.array(std))


def _classes(speed: Array, rows: Mask) -> Array:
    """Octaves of the speed, those with few windows joined to the next, shape (m,)."""
    low = float(np.quantile(speed[rows], 0.02))
    exponents = np.floor(np.log2(np.maximum(speed / low, 1.0)))
    octaves = np.clip(exponents, 0, 9).astype(int)
    names = np.zeros(10, int)
    count = 0
    rows_per_octave = np.bincount(octaves[rows], minlength=10)
    total = 0
    for octave in range(10):
        names[octave] = count
        total += int(rows_per_octave[octave])
        if total >= 3 * BLOCKS and rows_per_octave[octave + 1 :].sum() >= 3 * BLOCKS:
            count, total = count + 1, 0
    return names[octaves]


def _coefficient(
    windows: SlideWindows,
    compensated: CompensatedForce,
    frame: ContactFrame,
    fitted: tuple[SlideProblem, SlideFit, float, Array],
    rows: Mask,
) -> Coefficient:
    """Friction with its interval, by class of speeds where it depends on the speed."""
    _, result, length, _ = fitted
    fractions, slips = windows.fractions(length)
    half_widths = _HalfWidths(
        systematic=_systematic_half(windows, compensated, fitted, rows),
        missing_slip=float(np.mean(1.0 - fractions[rows, 0])),
    )
    value = float(result.mu[0])
    half = float(half_widths.of(result.mu, np.sqrt(np.diag(result.covariance)[:1]))[0])
    speed = float(np.median(windows.speed[rows]))
    single = Coefficient(value, half, np.array([[speed, value, half]]))
    classes = _classes(windows.speed, rows)
    count = int(classes.max()) + 1
    if count == 1 or not result.slips:
        return single
    by_class = _least_squares(windows, compensated, classes, frame).solve(fractions, slips)
    if not by_class.slips or not _depends_on_speed(by_class, count):
        return single
    covariance = by_class.covariance[:count, :count]
    halves = half_widths.of(by_class.mu, np.sqrt(np.diag(covariance)))
    weight = np.bincount(classes[rows], minlength=count) / rows.sum()
    speeds = np.array([np.mean(windows.speed[rows & (classes == i)]) for i in range(count)])
    mean = float(weight @ by_class.mu)
    std = float(np.sqrt(weight @ covariance @ weight))
    half = float(half_widths.of(np.array([mean]), np.array([std]))[0])
    return Coefficient(mean, half, np.column_stack([speeds, by_class.mu, halves]))


class _HalfWidths(NamedTuple):
    """Half-widths of friction: of the fit, of systematic errors, and of the missing fraction of slip."""

    systematic: float
    missing_slip: float

    def of(self, values: Array, stds: Array) -> Array:
        """Half-widths of values with the standard deviations of their fit, shape (j,) each."""
        t = student(BLOCKS - 1)
        squares = (t * stds) ** 2 + (self.missing_slip * values) ** 2 + self.systematic**2
        return np.asarray(np.sqrt(squares))


def _systematic_half(
    windows: SlideWindows,
    compensated: CompensatedForce,
    fitted: tuple[SlideProblem, SlideFit, float, Array],
    rows: Mask,
) -> float:
    """Half-width of friction by the length of relaxation, a weight that may turn, and residuals beyond the noise."""
    fit, result, length, alternatives = fitted
    half = np.abs(alternatives[:, 1] - result.mu[0]).max()
    if (
        len(result.load) > 3 and not compensated.load.separable
    ):  # with a weight that turns, or without: both count
        still = SlideProblem(windows, fit.classes, fit.prior[:4]).solve(*windows.fractions(length))
        half = np.hypot(half, still.mu[0] - result.mu[0])
    # What the model leaves beyond the noise is as slow as the path, and may be of friction as a whole.
    size = np.linalg.norm(windows.force[rows], axis=1)
    residual = np.median(np.abs(result.angle[rows] * windows.noise[rows] / size)) * 1.4826
    noise = np.median(windows.noise[rows] / size)
    return float(np.hypot(half, np.sqrt(max(residual**2 - noise**2, 0.0))))


def _depends_on_speed(by_class: SlideFit, count: int) -> bool:
    """True if the differences of friction between classes of speeds are no chance, by Wald's test."""
    from scipy.special import fdtrc

    D = np.diff(np.eye(count), axis=0)
    step = D @ by_class.mu
    C = D @ by_class.covariance[:count, :count] @ D.T
    wald = float(step @ np.linalg.solve(C, step)) / (count - 1)
    return not fdtrc(count - 1, BLOCKS - count, wald) > FALSE_ALARM


def _verdict(mu: Coefficient, wrong: str, load_known: bool, tolerance: float) -> Parameter:
    ends = (max(mu.value - mu.half, 0.0), mu.value + mu.half)
    if not load_known:
        return _not_identifiable("1", _NO_ZERO)
    if wrong:
        return replace(_not_identifiable("1", wrong), verdict=Verdict.REJECTED)
    speeds = "" if len(mu.table) == 1 else ", the mean; it depends on the speed"
    why = f"95 %: {ends[0]:.3g} to {ends[1]:.3g}{speeds}"
    good = mu.half <= tolerance * mu.value
    return Parameter(
        mu.value if good else None, mu.half / 1.96 if good else None, ends, "1",
        Verdict.IDENTIFIED if good else Verdict.NOT_IDENTIFIABLE, why,
    )  # fmt: skip


def _contradiction(
    windows: SlideWindows,
    fit: SlideProblem,
    result: SlideFit,
    normal: Array,
    rows: Mask,
    compensated: CompensatedForce,
) -> str:
    """Why force and motion do not belong together; empty if they do."""
    _, _, F = fit.psi(result.lag, result.load)
    psi = np.arctan(result.mu[0]) + result.angle * windows.noise / np.linalg.norm(F, axis=1)
    axes = "are force and position in the same axes (--wrench-frame), and is --force-sign right?"
    contrary = float(np.mean(psi[rows] < -np.radians(3.0)))
    if result.mu[0] < -0.02 or contrary > MAX_PUSHING_FRACTION:
        return f"friction would push the tip on in {100 * contrary:.0f} % of the path: {axes}"
    s = windows.smooth
    touch = int(np.argmax(windows.smooth.inside))
    before = windows.turns[0][compensated.free & (windows.turns[0] < s.time[touch])]
    came = s.position[touch] - s.position[nearest(s.time, before[-1:])].sum(axis=0)
    if len(before) and came @ normal[0] < -MIN_APPROACH_COSINE * np.linalg.norm(came):
        return f"the tip came from within the surface, as the force says its normal: {axes}"
    spread, directions = np.linalg.eigh(np.cov(windows.position.T))
    if spread[1] > 0.05 * spread[2] and spread[0] < 0.05 * spread[1]:
        mean = normal.mean(axis=0)
        cosine = abs(directions[:, 0] @ mean) / np.linalg.norm(mean)
        off = float(np.arccos(min(cosine, 1.0)))
        if off > MAX_NORMAL_ANGLE:
            return (
                f"the force stands {np.degrees(off):.0f} deg off the normal of the path's own plane, friction taken"
                f" off: {axes}"
            )
    return ""


def _normals(
    windows: SlideWindows, fit: SlideProblem, result: SlideFit, mu: Coefficient, fractions: Array
) -> tuple[Array, Array]:
    """Normals into the surface along the path, shape (m, 3), and the radii of their 95 % cones [rad], shape (m,)."""
    _, _, F = fit.psi(result.lag, result.load)
    size = np.linalg.norm(F, axis=1)
    pull = mu.value * fractions[:, 2:]
    N = size / np.sqrt(1.0 + dot_rows(pull, pull))
    normal = F / N[:, None] - pull
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    j = len(result.mu) + 2
    load = np.sqrt(np.max(np.diag(result.covariance)[j : j + 3]))
    angle_std = np.hypot(windows.noise * np.maximum(result.scale, 1.0), load) / size
    angle_std = np.hypot(angle_std, 0.5 * (RELAXATION_SPREAD - 1.0) * mu.value * np.sqrt(fractions[:, 1]))
    return normal, RADIUS_95 * np.hypot(angle_std, mu.half / (2.0 * (1.0 + mu.value**2)))


def _stiffness(
    windows: SlideWindows,
    result: SlideFit,
    lengths: Array,
    length: float,
    arm: ArmDynamics,
    tolerance: float,
    calibration: float,
) -> tuple[Parameter, Array]:
    """K of the whole slide, and places, K and half-width of its parts, shape (k, 5).

    The tip dips below the surface by the rate of the normal force over K: |v| (psi - atan mu c) is
    d|F|/dt cos(atan mu)/K, each side seen through the same window. A lag of the force adds the rate of that. The
    length of relaxation counts, as friction lags a force that changes.
    """
    none = _not_identifiable("N/m", _NO_DITHER)
    places: Array = np.zeros((0, 5))
    main = _dips(windows, result, length)
    main_ratio = _ratio(main, BLOCKS) if len(main.dip) >= 4 * BLOCKS else None
    if main_ratio is None:
        return none, places
    usual = float(np.median(np.linalg.norm(windows.force, axis=1)))
    tied = abs(float(result.mu[0])) * usual / main_ratio[0] / np.array(TANGENTIAL)
    ends = min(lengths.min(), tied.min()), max(lengths.max(), tied.max())
    end_ratios = [_ratio(_dips(windows, result, float(x)), BLOCKS) for x in ends]
    spread = max(
        float("inf") if ratio is None else abs(ratio[0] / main_ratio[0] - 1.0) for ratio in end_ratios
    )

    def surface(K: float, half: float) -> tuple[float, float]:
        return _without_arm(K, float(np.hypot(half, spread * K)), arm, calibration)

    rows = []
    for i in np.unique(main.part):
        at = main.part == i
        local_dips = Dips(main.noise, *(values[at] for values in main[1:]))
        ratio = _ratio(local_dips, 8) if len(local_dips.dip) > 32 else None
        if ratio is not None:
            K, half = surface(*ratio)
            rows += [(*local_dips.position.mean(axis=0), K, half)] if 0.0 < half < 0.5 * K else []
    places = np.array(rows).reshape(-1, 5)
    K, half = surface(*main_ratio)
    if not (0.0 < half <= tolerance * K):
        return none, places
    why = f"95 %: {K - half:.4g} to {K + half:.4g} N/m, by the changes of the force along the path"
    if arm.stiffness is None:
        why += "; as the position shows it (--robot-stiffness takes out the arm's own)"
    return Parameter(K, half / 1.96, (K - half, K + half), "N/m", Verdict.IDENTIFIED, why), places


class Dips(NamedTuple):
    """Speed at which the tip dips, |v| (psi - atan mu c) [m/s], shape (n,), and the rate of the force.

    The columns are |v|, rate of the normal force [N/s], and its rate, shape (n, 3); then parts of the slide, shape
    (n,), places [m], shape (n, 3), and the variance of the rate by the sensor's noise [N^2/s^2].
    """

    noise: float
    dip: Array
    columns: Array
    part: Array
    position: Array


def _dips(windows: SlideWindows, result: SlideFit, length: float) -> Dips:
    """The dips of a slide whose friction relaxes on a length [m]."""
    s = windows.smooth
    speed = np.linalg.norm(s.velocity, axis=1)
    mu = float(result.mu[0])
    F, residual, slips = windows.friction_angle(result, length)
    size = np.linalg.norm(F, axis=1)
    u = np.linspace(-1.0, 1.0, s.longer + 2)[1:-1]
    kernel = (1.0 - u**2) / np.sum(1.0 - u**2)  # least squares' slope is the rate seen through it
    dip = np.convolve(np.where(slips, speed * residual, 0.0), kernel, "same")
    carried = np.convolve(np.where(slips, speed, 0.0), kernel, "same")
    along = dot_rows(F, windows.sign * s.rate) / np.maximum(size, 1e-9)
    rate = along / np.sqrt(1.0 + mu**2)
    slips_throughout = np.convolve(slips, np.ones(s.longer), "same") > s.longer - 0.5
    rows = np.flatnonzero(slips_throughout)[:: max(s.longer // 4, 1)]
    part = np.floor((s.time[rows] - s.time[rows[0]]) / PART_SECONDS) if len(rows) else s.time[rows]
    columns = np.column_stack([carried, rate, np.gradient(rate, s.step)])[rows]
    noise = s.noise**2 * 12.0 / (s.longer**3 * s.step**2) / (1.0 + mu**2)
    return Dips(noise, dip[rows], columns, part, s.position[rows])


_NO_DITHER = (
    "the force changes too little or too slowly along the path to show it: dither it by a tenth, at a hertz"
)


def _ratio(dips: Dips, blocks: int) -> tuple[float, float] | None:
    """1/slope of a dip over a rate, and the half-width of its interval [N/m]; None where noise makes the rate.

    Each part has a friction of its own. What noise adds to the rate's variance is taken off, and half of it counts.
    """
    dip = dips.dip
    columns = dips.columns
    part = dips.part
    noise = dips.noise
    if len(dip) < 2 * blocks:
        return None
    by_part = [columns[:, 0] * (part == i) for i in np.unique(part)]
    regressors = np.column_stack([*by_part, columns[:, 1:]])
    nuisance = regressors[:, :-2]
    rate = columns[:, 1] - nuisance @ np.linalg.lstsq(nuisance, columns[:, 1], rcond=None)[0]
    faint = noise / max(float(np.mean(rate**2)), 1e-300)
    if faint >= 1.0:
        return None
    theta = np.linalg.lstsq(regressors, dip, rcond=None)[0]
    jackknifed = []
    for rows in np.array_split(np.arange(len(dip)), blocks):
        remaining = np.delete(regressors, rows, 0)
        jackknifed.append(np.linalg.lstsq(remaining, np.delete(dip, rows), rcond=None)[0][-2])
    slope = float(theta[-2]) / (1.0 - faint)
    if not slope > 0.0:
        return None
    std = np.sqrt(blocks - 1) * np.std(jackknifed)
    wide = float(np.hypot(student(blocks - 1) * std / slope, 0.5 * faint))
    return 1.0 / slope, wide / slope


def _without_arm(K: float, half: float, arm: ArmDynamics, calibration: float) -> tuple[float, float]:
    """Stiffness of the surface and half-width, without a known compliance of the arm [N/m]."""
    half = float(np.hypot(half, 1.96 * calibration * K))
    if arm.stiffness is None or not arm.stiffness[0] > K:
        return K, half
    series, std = arm.stiffness
    fraction = K / series
    half = float(np.hypot(half, 1.96 * std * fraction**2))
    return K / (1.0 - fraction), half / (1.0 - fraction) ** 2


def _answer(
    windows: SlideWindows,
    mu: Coefficient,
    friction: Parameter,
    normal: Array,
    cone: Array,
    parts: Array,
    length: float,
) -> SlideFound:
    """The slide in words and numbers."""
    mean = normal.mean(axis=0)
    mean /= np.linalg.norm(mean)
    turns = float(np.degrees(np.arccos(np.clip(normal @ mean, -1.0, 1.0)).max()))
    wide = cone95(float(np.median(cone)))
    if friction.value is None and friction.ci95 is not None:
        first = f"The tip slides: mu is at most {friction.ci95[1]:.3g}."
    elif friction.reason == _NO_ZERO:
        first = f"The tip slides; its friction needs the force's zero: {_NO_ZERO}."
    elif friction.value is None:
        why = friction.reason if friction.reason.endswith("?") else f"{friction.reason}."
        first = f"The tip slides, but the log does not give its friction: {why}"
    elif len(mu.table) > 1:
        coefficients = ", ".join(f"{m:.3g} ± {h:.1g} at {1e3 * v:.2g} mm/s" for v, m, h in mu.table)
        first = f"The tip slides, and friction depends on the speed: mu = {coefficients}."
    else:
        first = f"The tip slides: mu = {mu.value:.3g} ± {mu.half:.1g}."
    if friction.verdict is Verdict.REJECTED:
        return SlideFound(first, (), {"friction": None, "path_m": windows.path})
    towards = ", ".join(f"{x + 0.0:.3f}" for x in mean)
    normals = (
        f"({towards}) in the base, 95 % cone {wide:.2g} deg, turns by {turns:.2g} deg"
        if wide is not None
        else "unknown"
    )
    facts = [f"Normal into the surface {normals}.", f"Path {1e3 * windows.path:.3g} mm."]
    if len(parts):
        ends = f"{parts[:, 3].min():.4g} to {parts[:, 3].max():.4g}"
        facts.append(f"Stiffness along the path at {len(parts)} places: {ends} N/m.")
    every = max(len(normal) // SHOWN_PLACES, 1)
    identified = friction.value is not None
    table = [dict(zip(("speed_m_s", "mu", "half"), row, strict=True)) for row in mu.table.tolist()]
    keys = ("x", "y", "z", "stiffness", "half")
    thinned = (values[::every].tolist() for values in (windows.position, normal, cone))
    values: dict[str, Any] = {
        "friction": {"value": mu.value, "ci95": [mu.value - mu.half, mu.value + mu.half]}
        if identified
        else None,
        "by_speed": table if identified else [],
        "normal": {"mean": mean.tolist(), "cone95_deg": wide, "turns_deg": turns},
        "path_m": windows.path,
        "relaxation_m": length,
        "stiffness": [dict(zip(keys, row, strict=True)) for row in parts.tolist()],
        "places": [
            {"x": p[0], "y": p[1], "z": p[2], "normal": n, "cone95_deg": cone95(c)}
            for p, n, c in zip(*thinned, strict=True)
        ],
    }
    return SlideFound(first, tuple(facts), values)
