"""The answer on a slide in a log: friction, normal, and stiffness along the path, each with an interval."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array, Mask
from palpate.contact_frame.arm import ArmDynamics
from palpate.contact_frame.projecting import residual_of_press
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, Unloaded
from palpate.identification import Code, Identification, Parameter, Verdict, Warn
from palpate.identification.options import USUAL_LAG, USUAL_LAG_STD
from palpate.identification.result import LagFound, SlideFound
from palpate.identification.uncertainty import student
from palpate.records import Record
from palpate.units import cone95
from palpate_slide.from_log import (
    ALONG,
    BLOCKS,
    SHAPE,
    Fit,
    SlideFit,
    SlideWindows,
    course_of,
    freed_of,
    nearest,
    with_length,
)

PAYLOAD = 20.0
"""Standard deviation of a weight of which nothing is known [N]: robots carry tools of some kilograms."""
BY_CHANCE = 1e-3
"""How probable a dependence on speed may be by chance."""
CONTRARY = 0.05
"""Share of the windows in which friction may seem to push, against its noise."""
ASKEW = np.radians(30.0)
"""Angle between the normal by the force and that of the path's own plane, at most."""
PART = 2.5
"""Length of a part of a slide for which a stiffness is estimated [s]."""
TANGENTIAL = (2.0 / 3.0 / SHAPE, SHAPE)
"""Tangential over normal stiffness of a contact: 2 (1 - nu)/(2 - nu) (Mindlin 1949), within `SHAPE`."""
CHI2_95 = 2.4477
"""Radius of the 95 % of two normal numbers of variance 1."""
PLACES = 200
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
    """The identification of a slide; None of a press; that of the press without its K, where the log tells neither.

    Args:
        signals: wrench and pose over time.
        frame: as declared by the user.
        arm: whose own stiffness is taken out of K, if it is known.
        tolerance: largest half-width of an identified parameter's 95 % interval, as a share of its value.
        calibration: relative standard deviation of the scales of force and position together.
        press: what the log says if it is one of a press.
        along: the record along the normal of that press.
    """
    freed = freed_of(signals, frame)
    course = None if freed is None else course_of(signals, freed, frame)
    claims = press.parameters["K"].verdict is Verdict.IDENTIFIED
    again = freed is not None and course is None and freed.free.any() and claims
    if again:  # what looks like free motion may be a slide, and its touch friction that begins
        freed = freed_of(signals, frame, touches=False)
        course = None if freed is None else course_of(signals, freed, frame)
    if freed is None or course is None:
        return None
    fit = _problem(course, freed, np.zeros(len(course.speed), int), frame)
    fitted = fit, *with_length(fit)
    better = advantage(course, fitted[1], fitted[2], freed, press, along.meta["contact_frame"])
    certain = student(BLOCKS - 1)
    if better < (certain if again else -certain):
        return None
    found = None
    if (fitted[1].slips or not course.known) and not again and (better > certain or not claims):
        found = _identification(signals, frame, arm, (tolerance, calibration), freed, course, fitted)
    if claims:
        return found or replace(press, parameters=press.parameters | {"K": _unclear(press.parameters["K"])})
    mu = None if found is None else found.parameters["mu"]
    shown = mu is not None and (mu.value is not None or (mu.ci95 is not None and better > certain))
    return found if shown or Code.NO_CONTACT.word in press.codes else None


def _identification(
    signals: BaseSignals,
    frame: ContactFrame,
    arm: ArmDynamics,
    wide: tuple[float, float],
    freed: Unloaded,
    course: SlideWindows,
    fitted: tuple[Fit, SlideFit, float, Array],
) -> Identification:
    """That of a slide, with tolerance and calibration."""
    fit, found, length, beside = fitted
    share, slips = course.share(length)
    rows = slips if found.slips else np.ones(len(slips), bool)
    mu = _coefficient(course, freed, frame, fitted, rows)
    if course.known:
        K, parts = _stiffness(course, found, beside[:, 0], length, arm, *wide)
    else:
        K, parts = _nothing("N/m", _NO_ZERO), np.zeros((0, 5))
    normal, cone = _normals(course, fit, found, mu, share)
    own = _verdict(mu, _contradiction(course, fit, found, normal, rows, freed), course.known, wide[0])
    std = float(np.sqrt(found.covariance[len(found.mu) + 1, len(found.mu) + 1]))
    inside = signals.time[freed.inside]
    return Identification(
        model="slide",
        parameters={"mu": own, "K": K},
        contacts=((float(inside[0]), float(inside[-1])),),
        lag=LagFound(USUAL_LAG + found.lag, std, 1.96 * std, "prior"),
        r2=float("nan"),
        rmse=float(np.sqrt(np.mean((found.angle[rows] * course.noise[rows]) ** 2))),
        n=int(rows.sum()),
        warnings=() if course.known else (Warn(Code.CONTACT_AT_START, _NO_ZERO),),
        slide=_answer(course, mu, own, normal, cone, parts, length),
    )


def advantage(
    course: SlideWindows,
    found: SlideFit,
    length: float,
    freed: Unloaded,
    press: Identification,
    about: dict[str, Any],
) -> float:
    """How much more of the force a press leaves than a slide does, in standard deviations of the difference.

    A press says that the force is a function of the depth along one direction, F = F_0 + n (K d + B d'), with its own
    n, K and contacts. A slide says that the force goes on while the tip moves across it: |F| = F_0, at the angle of
    friction to the motion. Each is compared with the force in newtons, in the same rows, where the tip moves across the
    force and in free motion. Where the zero of the force is unknown, so is its size: a slide says its angle alone.
    The deviation is that of a sum over parts of the log: Vuong's test (Econometrica 57, 1989), of models of which none
    holds the other.

    Args:
        course: of the slide.
        found: its parameters.
        length: on which its friction relaxes [m].
        freed: rows in free motion and in contact by the slide.
        press: its K counts as it is, if it is identified; otherwise the best one does.
        about: normal, sign and bias of the press, as `project` gives them.
    """
    s = course.smooth
    free = np.interp(s.time, course.turns[0], freed.free.astype(float)) > 0.999
    rows = np.flatnonzero(course.slides | free)[:: max(s.rows // 2, 1)]
    slides = course.slides[rows]
    F, angle, _ = (values[rows] for values in course.friction_angle(found, length))
    size = np.linalg.norm(F, axis=1)
    usual = size[slides].mean() if course.known else size
    R = course.turns[1][nearest(course.turns[0], s.time[rows])]
    read = s.force[rows] + freed.load.weight + R @ (freed.load.bias - np.array(about["bias_N"]))
    by_slide = np.where(slides, (size - usual) ** 2 + (size * angle) ** 2, size**2)
    by_press = np.sum(
        residual_of_press(press, about, s.time[rows], s.place[rows], s.velocity[rows], read) ** 2, axis=1
    )
    # A direction of the motion is noisier than a depth: that is no fault of a slide, and counts for both.
    by_press[slides] += (size[slides] * s.blur / np.linalg.norm(s.velocity[rows][slides], axis=1)) ** 2
    # Both are normal with a variance of their own: the parts' log-likelihoods against each other.
    one, other = (values / values.mean() for values in (by_press, by_slide))
    parts = np.array([part.mean() for part in np.array_split(one - other, BLOCKS)])
    ratio = np.log(by_press.mean() / by_slide.mean())
    return float(np.sqrt(BLOCKS) * ratio / max(np.std(parts, ddof=1), 1e-300))


def _nothing(unit: str, why: str) -> Parameter:
    return Parameter(None, None, None, unit, Verdict.NOT_IDENTIFIABLE, why)


def _unclear(K: Parameter) -> Parameter:
    why = "the tip may slide: force and motion fit a slide as well as a press; give --payload, or press at one place"
    return replace(K, value=None, std=None, verdict=Verdict.NOT_IDENTIFIABLE, reason=why)


_NO_ZERO = (
    "no free motion in the log: the zero of the force is unknown, and friction with it; begin the log before the tip"
    " touches, or give --payload"
)


def _problem(course: SlideWindows, freed: Unloaded, classes: Array, frame: ContactFrame) -> Fit:
    """The least-squares problem, with what free motion leaves unknown of bias and weight."""
    usual = float(np.median(np.linalg.norm(course.force, axis=1)))
    bias = max(freed.load.std, 1e-3) if course.known else usual
    weight = freed.load.weight_std if freed.load.separable else PAYLOAD
    turns = float(np.abs(course.turned @ course.rest.T - np.eye(3)).max()) > 0.02
    weighs = turns and not frame.gravity_compensated
    std = [USUAL_LAG_STD, *[bias] * 3, *[max(weight, 1e-3)] * 3 * weighs]
    return Fit(course, classes, np.array(std))


def _classes(speed: Array, rows: Mask) -> Array:
    """Octaves of the speed, those with few windows joined to the next, shape (m,)."""
    low = float(np.quantile(speed[rows], 0.02))
    own = np.clip(np.floor(np.log2(np.maximum(speed / low, 1.0))), 0, 9).astype(int)
    names, kept = np.zeros(10, int), 0
    many = np.bincount(own[rows], minlength=10)
    total = 0
    for octave in range(10):
        names[octave] = kept
        total += int(many[octave])
        if total >= 3 * BLOCKS and many[octave + 1 :].sum() >= 3 * BLOCKS:
            kept, total = kept + 1, 0
    return names[own]


def _coefficient(
    course: SlideWindows,
    freed: Unloaded,
    frame: ContactFrame,
    fitted: tuple[Fit, SlideFit, float, Array],
    rows: Mask,
) -> Coefficient:
    fit, found, length, beside = fitted
    share, slips = course.share(length)
    t = student(BLOCKS - 1)
    spread = np.abs(beside[:, 1] - found.mu[0]).max()
    if len(found.load) > 3 and not freed.load.separable:  # with a weight that turns, or without: both count
        still = Fit(course, fit.classes, fit.prior[:4]).solve(share, slips)
        spread = np.hypot(spread, still.mu[0] - found.mu[0])
    # What the model leaves beyond the noise is as slow as the path, and may be of friction as a whole.
    size = np.linalg.norm(course.force[rows], axis=1)
    left = np.median(np.abs(found.angle[rows] * course.noise[rows] / size)) * 1.4826
    own = np.median(course.noise[rows] / size)
    spread = np.hypot(spread, np.sqrt(max(left**2 - own**2, 0.0)))
    lacks = np.mean(1.0 - share[rows, 0])  # of gross slip, by one length: in doubt as a whole

    def half(values: Array, stds: Array, spread: float) -> Array:
        return np.sqrt((t * stds) ** 2 + (lacks * values) ** 2 + spread**2)

    whole = half(found.mu, np.sqrt(np.diag(found.covariance)[:1]), spread)
    value, wide = float(found.mu[0]), float(whole[0])
    one = np.array([[float(np.median(course.speed[rows])), value, wide]])
    alike = Coefficient(value, wide, one)
    classes = _classes(course.speed, rows)
    j = int(classes.max()) + 1
    if j == 1 or not found.slips:
        return alike
    by = _problem(course, freed, classes, frame).solve(share, slips)
    if not by.slips:
        return alike
    D = np.diff(np.eye(j), axis=0)
    step, C = D @ by.mu, D @ by.covariance[:j, :j] @ D.T
    from scipy.special import fdtrc

    wald = float(step @ np.linalg.solve(C, step)) / (j - 1)
    if fdtrc(j - 1, BLOCKS - j, wald) > BY_CHANCE:
        return alike
    halves = half(by.mu, np.sqrt(np.diag(by.covariance)[:j]), spread)
    weight = np.bincount(classes[rows], minlength=j) / rows.sum()
    speeds = np.array([np.mean(course.speed[rows & (classes == i)]) for i in range(j)])
    mean = float(weight @ by.mu)
    std = float(np.sqrt(weight @ by.covariance[:j, :j] @ weight))
    wide = float(half(np.array([mean]), np.array([std]), spread)[0])
    return Coefficient(mean, wide, np.column_stack([speeds, by.mu, halves]))


def _verdict(mu: Coefficient, wrong: str, known: bool, tolerance: float) -> Parameter:
    ends = (max(mu.value - mu.half, 0.0), mu.value + mu.half)
    if not known:
        return _nothing("1", _NO_ZERO)
    if wrong:
        return replace(_nothing("1", wrong), verdict=Verdict.REJECTED)
    speeds = "" if len(mu.table) == 1 else ", the mean; it depends on the speed"
    why = f"95 %: {ends[0]:.3g} to {ends[1]:.3g}{speeds}"
    good = mu.half <= tolerance * mu.value
    return Parameter(
        mu.value if good else None, mu.half / 1.96 if good else None, ends, "1",
        Verdict.IDENTIFIED if good else Verdict.NOT_IDENTIFIABLE, why,
    )  # fmt: skip


def _contradiction(
    course: SlideWindows, fit: Fit, found: SlideFit, normal: Array, rows: Mask, freed: Unloaded
) -> str:
    """Why force and motion do not belong together; empty if they do."""
    _, _, F = fit.psi(found.lag, found.load)
    psi = np.arctan(found.mu[0]) + found.angle * course.noise / np.linalg.norm(F, axis=1)
    axes = "are force and position in the same axes (--wrench-frame), and is --force-sign right?"
    contrary = float(np.mean(psi[rows] < -np.radians(3.0)))
    if found.mu[0] < -0.02 or contrary > CONTRARY:
        return f"friction would push the tip on in {100 * contrary:.0f} % of the path: {axes}"
    s, touch = course.smooth, int(np.argmax(course.smooth.inside))
    before = course.turns[0][freed.free & (course.turns[0] < s.time[touch])]
    came = s.place[touch] - s.place[nearest(s.time, before[-1:])].sum(axis=0)
    if len(before) and came @ normal[0] < -ALONG * np.linalg.norm(came):
        return f"the tip came from within the surface, as the force says its normal: {axes}"
    spread, directions = np.linalg.eigh(np.cov(course.place.T))
    if spread[1] > 0.05 * spread[2] and spread[0] < 0.05 * spread[1]:
        mean = normal.mean(axis=0)
        off = float(np.arccos(min(abs(directions[:, 0] @ mean) / np.linalg.norm(mean), 1.0)))
        if off > ASKEW:
            return (
                f"the force stands {np.degrees(off):.0f} deg off the normal of the path's own plane, friction taken"
                f" off: {axes}"
            )
    return ""


def _normals(
    course: SlideWindows, fit: Fit, found: SlideFit, mu: Coefficient, share: Array
) -> tuple[Array, Array]:
    """Normals into the surface along the path, shape (m, 3), and the radii of their 95 % cones [rad], shape (m,)."""
    _, _, F = fit.psi(found.lag, found.load)
    size = np.linalg.norm(F, axis=1)
    pull = mu.value * share[:, 2:]
    N = size / np.sqrt(1.0 + np.einsum("ij,ij->i", pull, pull))
    normal = F / N[:, None] - pull
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    j = len(found.mu) + 2
    load = np.sqrt(np.max(np.diag(found.covariance)[j : j + 3]))
    own = np.hypot(course.noise * np.maximum(found.scale, 1.0), load) / size
    own = np.hypot(own, 0.5 * (SHAPE - 1.0) * mu.value * np.sqrt(share[:, 1]))
    return normal, CHI2_95 * np.hypot(own, mu.half / (2.0 * (1.0 + mu.value**2)))


def _stiffness(
    course: SlideWindows,
    found: SlideFit,
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
    none = _nothing("N/m", _NO_DITHER)
    places: Array = np.zeros((0, 5))
    main = _dips(course, found, length)
    whole = _ratio(main, BLOCKS) if len(main.dip) >= 4 * BLOCKS else None
    if whole is None:
        return none, places
    usual = float(np.median(np.linalg.norm(course.force, axis=1)))
    tied = abs(float(found.mu[0])) * usual / whole[0] / np.array(TANGENTIAL)
    ends = min(lengths.min(), tied.min()), max(lengths.max(), tied.max())
    others = [_ratio(_dips(course, found, float(x)), BLOCKS) for x in ends]
    spread = max(float("inf") if one is None else abs(one[0] / whole[0] - 1.0) for one in others)

    def surface(K: float, half: float) -> tuple[float, float]:
        return _surface(K, float(np.hypot(half, spread * K)), arm, calibration)

    rows = []
    for i in np.unique(main.part):
        at = main.part == i
        own = Dips(main.noise, *(values[at] for values in main[1:]))
        one = _ratio(own, 8) if len(own.dip) > 32 else None
        if one is not None:
            K, half = surface(*one)
            rows += [(*own.place.mean(axis=0), K, half)] if 0.0 < half < 0.5 * K else []
    places = np.array(rows).reshape(-1, 5)
    K, half = surface(*whole)
    if not (0.0 < half <= tolerance * K):
        return none, places
    why = f"95 %: {K - half:.4g} to {K + half:.4g} N/m, by the changes of the force along the path"
    if arm.stiffness is None:
        why += "; as the position shows it (--robot-stiffness takes out the arm's own)"
    return Parameter(K, half / 1.96, (K - half, K + half), "N/m", Verdict.IDENTIFIED, why), places


class Dips(NamedTuple):
    """How fast the tip dips, |v| (psi - atan mu c) [m/s], shape (n,), and the rate of the force.

    The columns are |v|, rate of the normal force [N/s], and its rate, shape (n, 3); then parts of the slide, shape
    (n,), places [m], shape (n, 3), and the variance of the rate by the sensor's noise [N^2/s^2].
    """

    noise: float
    dip: Array
    columns: Array
    part: Array
    place: Array


def _dips(course: SlideWindows, found: SlideFit, length: float) -> Dips:
    """The dips of a slide whose friction relaxes on a length [m]."""
    s = course.smooth
    speed = np.linalg.norm(s.velocity, axis=1)
    mu = float(found.mu[0])
    F, left, slips = course.friction_angle(found, length)
    size = np.linalg.norm(F, axis=1)
    u = np.linspace(-1.0, 1.0, s.longer + 2)[1:-1]
    kernel = (1.0 - u**2) / np.sum(1.0 - u**2)  # least squares' slope is the rate seen through it
    dip = np.convolve(np.where(slips, speed * left, 0.0), kernel, "same")
    carried = np.convolve(np.where(slips, speed, 0.0), kernel, "same")
    rate = np.einsum("ij,ij->i", F, course.sign * s.rate) / np.maximum(size, 1e-9) / np.sqrt(1.0 + mu**2)
    whole = np.convolve(slips, np.ones(s.longer), "same") > s.longer - 0.5
    rows = np.flatnonzero(whole)[:: max(s.longer // 4, 1)]
    part = np.floor((s.time[rows] - s.time[rows[0]]) / PART) if len(rows) else s.time[rows]
    columns = np.column_stack([carried, rate, np.gradient(rate, s.step)])[rows]
    noise = s.noise**2 * 12.0 / (s.longer**3 * s.step**2) / (1.0 + mu**2)
    return Dips(noise, dip[rows], columns, part, s.place[rows])


_NO_DITHER = (
    "the force changes too little or too slowly along the path to show it: dither it by a tenth, at a hertz"
)


def _ratio(dips: Dips, blocks: int) -> tuple[float, float] | None:
    """1/slope of a dip over a rate, and the half-width of its interval [N/m]; None where noise makes the rate.

    Each part has a friction of its own. What noise adds to the rate's variance is taken off, and half of it counts.
    """
    dip, columns, part, noise = dips.dip, dips.columns, dips.part, dips.noise
    if len(dip) < 2 * blocks:
        return None
    own = np.column_stack([columns[:, 0] * (part == i) for i in np.unique(part)] + [columns[:, 1:]])
    rest = own[:, :-2]
    rate = columns[:, 1] - rest @ np.linalg.lstsq(rest, columns[:, 1], rcond=None)[0]
    faint = noise / max(float(np.mean(rate**2)), 1e-300)
    if faint >= 1.0:
        return None
    theta = np.linalg.lstsq(own, dip, rcond=None)[0]
    left = [
        np.linalg.lstsq(np.delete(own, gone, 0), np.delete(dip, gone), rcond=None)[0][-2]
        for gone in np.array_split(np.arange(len(dip)), blocks)
    ]
    slope = float(theta[-2]) / (1.0 - faint)
    if not slope > 0.0:
        return None
    std = np.sqrt(blocks - 1) * np.std(left)
    wide = float(np.hypot(student(blocks - 1) * std / slope, 0.5 * faint))
    return 1.0 / slope, wide / slope


def _surface(K: float, half: float, arm: ArmDynamics, calibration: float) -> tuple[float, float]:
    """The surface's own stiffness and half-width, the arm's taken out where it is known [N/m]."""
    half = float(np.hypot(half, 1.96 * calibration * K))
    if arm.stiffness is None or not arm.stiffness[0] > K:
        return K, half
    series, std = arm.stiffness
    own = K / (1.0 - K / series)
    return own, float(np.hypot(half, 1.96 * std * (K / series) ** 2)) / (1.0 - K / series) ** 2


def _answer(
    course: SlideWindows,
    mu: Coefficient,
    own: Parameter,
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
    if own.value is None and own.ci95 is not None:
        first = f"The tip slides: mu is at most {own.ci95[1]:.3g}."
    elif own.value is None:
        why = own.reason if own.reason.endswith("?") else f"{own.reason}."
        first = f"The tip slides, but the log does not give its friction: {why}"
    elif len(mu.table) > 1:
        each = ", ".join(f"{m:.3g} ± {h:.1g} at {1e3 * v:.2g} mm/s" for v, m, h in mu.table)
        first = f"The tip slides, and friction depends on the speed: mu = {each}."
    else:
        first = f"The tip slides: mu = {mu.value:.3g} ± {mu.half:.1g}."
    if own.verdict is Verdict.REJECTED:
        return SlideFound(first, (), {"friction": None, "path_m": course.path})
    towards = ", ".join(f"{x + 0.0:.3f}" for x in mean)
    normals = (
        f"({towards}) in the base, 95 % cone {wide:.2g} deg, turns by {turns:.2g} deg"
        if wide is not None
        else "unknown"
    )
    facts = [f"Normal into the surface {normals}.", f"Path {1e3 * course.path:.3g} mm."]
    if len(parts):
        ends = f"{parts[:, 3].min():.4g} to {parts[:, 3].max():.4g}"
        facts.append(f"Stiffness along the path at {len(parts)} places: {ends} N/m.")
    every = max(len(normal) // PLACES, 1)
    known = own.value is not None
    table = [dict(zip(("speed_m_s", "mu", "half"), row, strict=True)) for row in mu.table.tolist()]
    keys = ("x", "y", "z", "stiffness", "half")
    shown = (values[::every].tolist() for values in (course.place, normal, cone))
    values: dict[str, Any] = {
        "friction": {"value": mu.value, "ci95": [mu.value - mu.half, mu.value + mu.half]} if known else None,
        "by_speed": table if known else [],
        "normal": {"mean": mean.tolist(), "cone95_deg": wide, "turns_deg": turns},
        "path_m": course.path,
        "relaxation_m": length,
        "stiffness": [dict(zip(keys, row, strict=True)) for row in parts.tolist()],
        "places": [
            {"x": p[0], "y": p[1], "z": p[2], "normal": n, "cone95_deg": cone95(c)}
            for p, n, c in zip(*shown, strict=True)
        ],
    }
    return SlideFound(first, tuple(facts), values)
