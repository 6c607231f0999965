"""The press: force over depth in loading and unloading, its tangents, the lost work, and the relaxation of a hold."""

from dataclasses import replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.budget import FittedParameters
from palpate.identification.in_series import SeriesSpring
from palpate.identification.least_squares import estimate_noise
from palpate.identification.options import Options
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, Press, Relaxation, Tangent, WorkingPoint
from palpate.identification.slope import (
    MIN_LOADING_ROWS,
    REST_SPEED_RATIO,
    Drag,
    loadings_in,
    loadings_read_later,
    ripple_error,
    slope_between,
    tangent_at,
    upper_slope,
)
from palpate.identification.spectrum import (
    build_working_point,
    dynamic_stiffness,
    storage_near,
    working_point,
)
from palpate.identification.steady_press import HALF_WINDOW, WINDOW, Slopes, SteadyPress, thin_curve
from palpate.identification.uncertainty import Contribution, Measurement, half_width
from palpate.signals.samples import runs


def relaxation(problem: Problem, slope: Slopes | None) -> Relaxation | None:
    """Relaxation in the longest hold after a loading, less the elastic effect of the position's change.

    It is a monotone fall of the force; None if the fall is within the noise and the uncertainty of the elastic effect.
    """
    from scipy.optimize import isotonic_regression

    lag = problem.lag.value
    depth = problem.motion.moved(0, lag)
    speed = problem.motion.moved(1, lag)
    resting = np.abs(speed) < REST_SPEED_RATIO * float(np.percentile(np.abs(speed), 98))
    holds = []
    for segment in problem.segments:
        begin = segment.first
        rests = runs(resting[segment.rows])
        holds += [(begin + first, begin + last) for first, last in rests if first > 0]
    first, last = max(holds, key=lambda hold: hold[1] - hold[0], default=(0, 0))
    if last - first < 4 * MIN_LOADING_ROWS:
        return None
    displacement = depth[first:last] - depth[last - 1]
    time = problem.time[first:last]
    stiffness = Measurement(0.0, {}) if slope is None else slope.stiffness
    force = problem.force[first:last] - stiffness.value * displacement
    force_uncertainty = stiffness.half * float(np.ptp(displacement))
    falls = np.asarray(isotonic_regression(force, increasing=False).x)
    noise = estimate_noise(force - falls, np.arange(len(force)), 2)
    end_rows = max(len(force) // 20, 2)
    high = float(np.median(falls[:end_rows]))
    low = float(np.median(falls[-end_rows:]))
    variance = 2 * noise.variance * len(force) / noise.effective / end_rows
    min_fall = np.hypot(2 * np.sqrt(variance), force_uncertainty)
    if high <= 0 or high - low <= min_fall:
        return None
    half_row = int(np.argmax(falls <= (high + low) / 2))
    half_time = float(time[half_row] - time[0])
    return Relaxation((high - low) / high, half_time, float(time[-1] - time[0]))


_MIN_TURN_ROWS = 6


def _find_unloading(
    problem: Problem, drawn_lag: float
) -> tuple[Array, float | None, tuple[float, float] | None]:
    """The unloadings of a log, with the lag of the force removed.

    Returns:
        Depth [m] and force [N] of the deepest contact's unloading by the lag that is drawn [s], shape (2, n), empty if
        there is none; its fraction of lost work, and the lateness of the force, both as in `Press`.
    """
    motion = problem.motion
    lag = problem.lag.value
    depth = motion.moved(0, lag)
    speed = motion.moved(1, lag)
    force = problem.force
    time = problem.time
    deepest = max(problem.segments, key=lambda segment: float(np.ptp(depth[segment.rows])))
    contact_depth = depth[deepest.rows]
    contact_force = force[deepest.rows]
    turn = _turn(contact_depth)
    if turn is None:
        return np.empty((2, 0)), None, None
    every = (segment.rows for segment in problem.segments)
    unloaded = [rows for rows in every if _turn(depth[rows]) is not None]
    contacts = [(depth[rows], speed[rows], force[rows], time[rows]) for rows in unloaded]
    work_in, work_out = _works(contact_depth, contact_force)
    loss = 1 - work_out / work_in if work_in > 0 else None
    unloading = np.stack([motion.moved(0, drawn_lag)[deepest.rows][turn:], contact_force[turn:]])
    return unloading, loss, _lateness(contacts)


def _turn(x: Array) -> int | None:
    """The deepest row of a contact that retreats by at least half of its loading; None for another contact."""
    top = int(np.argmax(x))
    is_left = len(x) - top >= _MIN_TURN_ROWS and x[top] - x[-1] >= 0.5 * (x[top] - x[0])
    return top if top >= _MIN_TURN_ROWS and is_left else None


def _ends(x: Array) -> tuple[int, int]:
    """The rows between which a contact goes in and out over the same depths."""
    top = int(np.argmax(x))
    start = max(float(x[0]), float(x[top:].min()))
    first = int(np.argmax(x[: top + 1] >= start))
    beyond = np.flatnonzero(x[top:] <= start)
    last = top + int(beyond[0]) if len(beyond) else len(x) - 1
    return first, last


def _works(x: Array, f: Array) -> tuple[float, float]:
    """Work put in and work returned over the same depths [J], summed over all advances and retreats."""
    first, last = _ends(x)
    steps = np.diff(x[first : last + 1])
    mean_force = (f[first:last] + f[first + 1 : last + 1]) / 2
    work = mean_force * steps
    return float(work[steps > 0].sum()), -float(work[steps < 0].sum())


def _lateness(contacts: list[tuple[Array, Array, Array, Array]]) -> tuple[float, float] | None:
    """Lateness of the force [s] and its half-width, by the excess of returned work; None without an excess.

    A force that is read T late does less work in loading and unloading, by T times the integral of F' x'; no passive
    surface returns more work than it takes. Depth, speed, force and time of each contact have the shape (n,).
    """
    delays = []
    for x, v, f, t in contacts:
        first, last = _ends(x)
        rows = slice(first, last + 1)
        power = np.gradient(f, t)[rows] * v[rows]
        rate = float(np.trapezoid(power, t[rows]))
        if rate > 0:
            work_in, work_out = _works(x, f)
            delays.append((work_out - work_in) / rate)
    if len(delays) < 2:
        return None
    mean = random_effects(np.array(delays), np.full(len(delays), 1e-12))
    return (mean.value, mean.half) if mean.value > mean.half else None


TANGENT_LEVELS = (0.3, 0.5, 0.7, 0.9)
_DAMPING_VARIATION = 0.5
"""Relative deviation of the damping at one depth from a model's: `benchmarks/identification/force_steps.py`."""


def find_press(problem: Problem, answer: FittedParameters | None) -> Press | None:
    """The press of a log, its tangents less the damping of an answer; None without a loading."""
    loadings = loadings_in(problem, problem.lag.value)
    if not loadings:
        return None
    lag = problem.lag.value if answer is None else answer.fit.lag
    drawn = loadings_in(problem, lag) or loadings
    loading = max(drawn, key=lambda loading: len(loading.depth))
    later = loadings_read_later(problem, loadings)
    unloading, loss, lateness = _find_unloading(problem, lag)
    return Press(
        _find_tangents(problem, answer, lag),
        thin_curve(np.stack([loading.depth, loading.force])),
        thin_curve(unloading),
        loss,
        relaxation(problem, slope_between(loadings, later)),
        lateness,
    )


def _find_tangents(problem: Problem, answer: FittedParameters | None, lag: float) -> tuple[Tangent, ...]:
    """Tangents at fractions of the force, if known to their own size.

    A lag T looks like a damping of -K T, so the answer's damping needs the answer's lag.
    """
    loadings = loadings_in(problem, lag)
    low, high = np.percentile(problem.force[problem.inside], [2, 98])
    tangents = []
    within = HALF_WINDOW * (high - low)
    for force in (low + share * (high - low) for share in TANGENT_LEVELS):
        slope = tangent_at(problem, lag, loadings, float(force), within, _drag(answer, force))
        if slope is not None and slope.known_to(1.0):
            tangents.append(Tangent(float(force), slope))
    return tuple(tangents)


def _drag(answer: FittedParameters | None, force: float) -> Drag | None:
    """The damping of an answer at a force [N]; None for a model with damping in its branch as well.

    The damping of a power law grows with the force. Its half-width is the damping itself, because the scale and the
    exponent are correlated.
    """
    if answer is None or not {"K", "B"} <= set(answer.names) or "tau" in answer.names:
        return None
    if answer.fit.model.of_power:
        largest = answer["B"] / answer["K"] * force if answer["K"] else 0.0
        return Drag(largest, abs(largest))
    causes = dict(answer.contributions("B"))
    causes.pop("lag", None)
    half = half_width(causes)
    return Drag(answer["B"], half + _DAMPING_VARIATION * abs(answer["B"]))


def at_constant_speed(steady: SteadyPress, seen: Press | None, origin: float, resting: float) -> Press:
    """A press at constant speed, with the lost work and the relaxation of the filtered contact, if there are any.

    The curves of its strokes count from the position of the surface [m] and the force out of contact [N].
    """
    known = [slopes for slopes in (*steady.others, steady.headline) if slopes.stiffness.known_to(1.0)]
    tangents = [Tangent(slopes.force, slopes.stiffness) for slopes in known]
    surface = np.array([[origin], [resting]])
    ordered = tuple(sorted(tangents, key=lambda slopes: slopes.force))
    curves = steady.loading - surface, steady.unloading - surface
    if seen is None:
        return Press(ordered, *curves)
    return replace(seen, tangent=ordered, loading=curves[0], unloading=curves[1])


Evidence = tuple[tuple[DynamicStiffness, ...], Press | None, WorkingPoint | None]


def gather_evidence(
    problem: Problem, options: Options, unit: str, answer: FittedParameters | None = None
) -> Evidence:
    """Dynamic stiffness, press and working point of the surface, whose stiffness has a unit.

    The options have the tolerance, and the stiffness in series with the surface; the answer, where there is one, the
    forces beside the contact.
    """
    if not problem.segments:
        return (), None, None
    lag = problem.lag
    instants = problem.motion.instants
    friction = []
    if answer:
        fitted_instants = answer.problem.motion.instants
        friction = [np.interp(instants, fitted_instants, force) for force in answer.friction.T]
    spectrum = dynamic_stiffness(problem, lag.value, lag.std, friction)
    wider = problem.with_touches  # a press may be over before a filter has settled
    if wider is None or not wider.segments:
        wider = problem
    press = find_press(wider, answer)
    steady = problem.contacts.press
    headline = None
    if steady is not None:
        headline = _among_loadings(steady.headline, wider)
        headline = replace(headline, depth=headline.depth - problem.origin)
        press = at_constant_speed(steady, press, problem.origin, problem.contacts.resting)
    ripple = ripple_error(wider)
    if headline is not None and ripple is not None:
        headline = replace(headline, stiffness=headline.stiffness.with_cause("ripple", ripple))
    if press is not None and ripple is not None:
        tangents = (replace(t, slope=t.slope.with_cause("ripple", ripple)) for t in press.tangent)
        press = replace(press, tangent=tuple(tangents))
    series = SeriesSpring.of(options)
    if series is not None:
        spectrum = series.spectrum(spectrum)
        press = None if press is None else series.press(press)
        headline = None if headline is None else series.slopes(headline)
    if headline is not None:
        return spectrum, press, build_working_point(headline, "press", problem, options, unit)
    hidden = answer.hidden if answer else 0.0
    return spectrum, press, working_point(wider, spectrum, options, unit, hidden)


def _among_loadings(headline: Slopes, problem: Problem) -> Slopes:
    """A tangent of strokes at constant speed, with its difference from the log's other loadings as a cause.

    The square of the difference, less those of the half-widths, is the variance between the two (Paule and Mandel,
    1982): a stroke may be the second on a surface that has yielded. Loadings that end below the tangent's force are
    compared at a force that all reach, and the relative scatter there counts.
    """
    lag = problem.lag.value
    loadings = loadings_in(problem, lag)
    if not loadings:
        return headline
    resting = 0.0 if problem.counted else problem.contacts.resting
    forces = np.concatenate([loading.force for loading in loadings])
    low, high = np.percentile(forces, [2, 98])
    within = HALF_WINDOW * float(high - low)
    tangent = tangent_at(problem, lag, loadings, headline.force + resting, within, None)
    if tangent is None:
        return headline
    stiffness = headline.stiffness
    difference = tangent.value - stiffness.value
    excess = max(difference**2 - tangent.half**2 - stiffness.half**2, 0.0)
    scatter = Contribution.within(float(np.sqrt(excess)))
    lowest = min(float(loading.force.max()) for loading in loadings)
    if lowest < headline.force + resting:
        level = low + float(np.mean(WINDOW)) * (lowest - low)
        shared = tangent_at(problem, lag, loadings, level, within, None)
        if shared is not None and "repetition" in shared.contributions:
            relative = shared.contributions["repetition"].times(stiffness.value / shared.value)
            scatter = max(scatter, relative, key=lambda contribution: contribution.half)
    return headline.with_cause("loadings", scatter)


def stiffness_at_point(problem: Problem, force: Array, point: WorkingPoint) -> float | None:
    """Stiffness at a working point by another force, shape (m,), at the same rows [N/m]; None if it shows none."""
    problem = replace(problem, force=force)
    if point.source == "press":
        slope = upper_slope(loadings_in(problem, problem.lag.value))
        return None if slope is None else slope.stiffness.value
    return storage_near(problem, point.frequency_Hz)
