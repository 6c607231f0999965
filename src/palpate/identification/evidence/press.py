"""The press: force over depth in loading and unloading, its tangents, the lost work, and the relaxation of a hold."""

from dataclasses import replace

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.budget import Answer
from palpate.identification.estimators.octaves import Segment, segments_of
from palpate.identification.evidence.slope import (
    FEWEST,
    STILL,
    Drag,
    loadings_in,
    read_later,
    slope_between,
    slope_of,
    tangent_at,
)
from palpate.identification.evidence.spectrum import dynamic_stiffness, point_of, storage_near, working_point
from palpate.identification.in_series import SeriesSpring
from palpate.identification.least_squares import noise_of
from palpate.identification.options import Options
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, Press, Relaxation, Tangent, WorkingPoint
from palpate.identification.steady_press import NEAR, Slopes, SteadyPress, few_points
from palpate.identification.uncertainty import Contribution, Measurement, half_width
from palpate.signals.samples import runs


def relaxation(
    problem: Problem, lag: float, segments: list[Segment], slope: Slopes | None
) -> Relaxation | None:
    """Of the longest hold after a loading, what the position gives back by its slope left aside.

    A monotone fall of the force; None if that is within its noise and the uncertainty of what the position gives back.
    """
    from scipy.optimize import isotonic_regression

    depth, speed = problem.motion.moved(0, lag), problem.motion.moved(1, lag)
    still = np.abs(speed) < STILL * float(np.percentile(np.abs(speed), 98))
    holds = [(s.first + a, s.first + b) for s in segments for a, b in runs(still[s.first : s.last]) if a > 0]
    first, last = max(holds, key=lambda hold: hold[1] - hold[0], default=(0, 0))
    if last - first < 4 * FEWEST:
        return None
    moved, time = depth[first:last] - depth[last - 1], problem.time[first:last]
    stiffness = Measurement(0.0, {}) if slope is None else slope.stiffness
    force, doubt = problem.force[first:last] - stiffness.value * moved, stiffness.half * float(np.ptp(moved))
    falls = np.asarray(isotonic_regression(force, increasing=False).x)
    noise = noise_of(force - falls, np.arange(len(force)), 2)
    few = max(len(force) // 20, 2)
    begin, end = float(np.median(falls[:few])), float(np.median(falls[-few:]))
    least = np.hypot(2 * np.sqrt(2 * noise.variance * len(force) / noise.effective / few), doubt)
    if begin <= 0 or begin - end <= least:
        return None
    half = int(np.argmax(falls <= (begin + end) / 2))
    return Relaxation((begin - end) / begin, float(time[half] - time[0]), float(time[-1] - time[0]))


_FEWEST = 6


def _unloading_of(
    problem: Problem, lag: float, segments: list[Segment]
) -> tuple[Array, float | None, tuple[float, float] | None]:
    """The unloadings of a log, the lag of the force taken out [s].

    Returns:
        Depth [m] and force [N] on that of the deepest contact, shape (2, n), empty if there is none; the share of the
        work put into it that does not come back, and by how much the force is read late, both as in `Press`.
    """
    motion = problem.motion
    depth, speed, force, time = motion.moved(0, lag), motion.moved(1, lag), problem.force, problem.time
    s = max(segments, key=lambda s: float(np.ptp(depth[s.first : s.last])))
    own = slice(s.first, s.last)
    turn = _turn(depth[own])
    if turn is None:
        return np.empty((2, 0)), None, None
    rows = [slice(s.first, s.last) for s in segments if _turn(depth[s.first : s.last]) is not None]
    late = _late([(depth[r], speed[r], force[r], time[r]) for r in rows])
    x, f = depth[own], force[own]
    into, back = _works(x, f)
    return np.stack([x[turn:], f[turn:]]), 1 - back / into if into > 0 else None, late


def _turn(x: Array) -> int | None:
    """The deepest row of a contact that is left by at least half of the loading; None of another."""
    top = int(np.argmax(x))
    left = len(x) - top >= _FEWEST and x[top] - x[-1] >= 0.5 * (x[top] - x[0])
    return top if top >= _FEWEST and left else None


def _ends(x: Array) -> tuple[int, int]:
    """The rows between which a contact goes in and out over the same depths."""
    top = int(np.argmax(x))
    start = max(float(x[0]), float(x[top:].min()))
    beyond = np.flatnonzero(x[top:] <= start)
    return int(np.argmax(x[: top + 1] >= start)), top + int(beyond[0]) if len(beyond) else len(x) - 1


def _works(x: Array, f: Array) -> tuple[float, float]:
    """Work put in, and what of it comes back over the same depths [J]; a shaken contact takes and gives many times."""
    first, last = _ends(x)
    way = np.diff(x[first : last + 1])
    work = (f[first:last] + f[first + 1 : last + 1]) / 2 * way
    return float(work[way > 0].sum()), -float(work[way < 0].sum())


def _late(contacts: list[tuple[Array, Array, Array, Array]]) -> tuple[float, float] | None:
    """Lateness of the force by the work that it gives back beyond what it took.

    A force that is read T late does less work in loading and unloading, by T times the integral of F' x'; no passive
    surface gives back more than it takes. Of each contact, depth, speed, force and time have the shape (n,).
    """
    late = []
    for x, v, f, t in contacts:
        first, last = _ends(x)
        rows = slice(first, last + 1)
        rate = float(np.trapezoid(np.gradient(f, t)[rows] * v[rows], t[rows]))
        if rate > 0:
            into, back = _works(x, f)
            late.append((back - into) / rate)
    if len(late) < 2:
        return None
    mean = random_effects(np.array(late), np.full(len(late), 1e-12))
    return (mean.value, mean.half) if mean.value > mean.half else None


LEVELS = (0.3, 0.5, 0.7, 0.9)
_DAMPING = 0.5
"""Share of a model's damping by which that at one depth may differ: `benchmarks/identification/force_steps.py`."""


def press_of(problem: Problem, answer: Answer | None, segments: list[Segment]) -> Press | None:
    """The press of a log, its tangents less the damping of an answer; None without a loading."""
    lag = problem.lag.value
    loadings = loadings_in(problem, lag, segments)
    if not loadings:
        return None
    loading = max(loadings, key=lambda loading: len(loading.depth))
    later = read_later(problem, lag, segments, loadings)
    unloading, loss, late = _unloading_of(problem, lag, segments)
    return Press(
        _tangents(problem, answer, segments),
        few_points(np.stack([loading.depth, loading.force])),
        few_points(unloading),
        loss,
        relaxation(problem, lag, segments, slope_between(loadings, later)),
        late,
    )


def _tangents(problem: Problem, answer: Answer | None, segments: list[Segment]) -> tuple[Tangent, ...]:
    """Tangents at shares of the force, those that are known to their own size.

    A lag is a damping of -K times as much: the answer's damping belongs to the answer's lag.
    """
    lag = problem.lag.value if answer is None else answer.fit.lag
    loadings = loadings_in(problem, lag, segments)
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    low, high = np.percentile(problem.force[inside], [2, 98])
    found = []
    for force in (low + share * (high - low) for share in LEVELS):
        slope = tangent_at(problem, lag, loadings, float(force), NEAR * (high - low), _drag(answer, force))
        if slope is not None and slope.known_to(1.0):
            found.append(Tangent(float(force), slope))
    return tuple(found)


def _drag(answer: Answer | None, force: float) -> Drag | None:
    """The damping of an answer at a force [N]; None of a model whose damping is in its branch as well.

    That of a power law grows with the force, and is known to within itself at best, as its scale and its exponent are
    known together.
    """
    if answer is None or not {"K", "B"} <= set(answer.names) or "tau" in answer.names:
        return None
    if answer.fit.model.of_power:
        most = answer["B"] / answer["K"] * force if answer["K"] else 0.0
        return Drag(most, abs(most))
    half = half_width({cause: part for cause, part in answer.contributions("B").items() if cause != "lag"})
    return Drag(answer["B"], half + _DAMPING * abs(answer["B"]))


def at_constant_speed(steady: SteadyPress, seen: Press | None, origin: float) -> Press:
    """A press at constant speed, with the lost work and the relaxation that the filtered contact shows, if it does.

    The curves of its strokes count from the position of the surface [m].
    """
    known = [own for own in (*steady.others, steady.headline) if own.stiffness.known_to(1.0)]
    tangents = [Tangent(own.force, own.stiffness) for own in known]
    surface = np.array([[origin], [0.0]])
    ordered = tuple(sorted(tangents, key=lambda own: own.force))
    curves = steady.loading - surface, steady.unloading - surface
    if seen is None:
        return Press(ordered, *curves)
    return replace(seen, tangent=ordered, loading=curves[0], unloading=curves[1])


Evidence = tuple[tuple[DynamicStiffness, ...], Press | None, WorkingPoint | None]


def evidence_of(problem: Problem, options: Options, unit: str, answer: Answer | None = None) -> Evidence:
    """Dynamic stiffness, press and working point of the surface, whose stiffness has a unit.

    The options have the tolerance, and the stiffness in series with the surface; the answer, where there is one, the
    forces beside the contact.
    """
    segments = segments_of(problem.motion.rows, problem.spans)
    if not segments:
        return (), None, None
    lag = problem.lag
    at = problem.motion.instants
    friction = (
        [np.interp(at, answer.problem.motion.instants, own) for own in answer.friction.T] if answer else []
    )
    spectrum = dynamic_stiffness(problem, segments, lag.value, lag.std, friction)
    whole = problem.with_touches or problem  # a press may be over before a filter has settled
    press = press_of(whole, answer, segments_of(whole.motion.rows, whole.spans) or segments)
    steady = problem.contacts.press
    headline = None
    if steady is not None:
        headline = _among_loadings(steady.headline, whole)
        headline = replace(headline, depth=headline.depth - problem.origin)
        press = at_constant_speed(steady, press, problem.origin)
    series = SeriesSpring.of(options)
    if series is not None:
        spectrum = series.spectrum(spectrum)
        press = None if press is None else series.press(press)
        headline = None if headline is None else series.slopes(headline)
    if headline is not None:
        return spectrum, press, point_of(headline, "press", problem, options, unit)
    return spectrum, press, working_point(whole, spectrum, options, unit, answer.hidden if answer else 0.0)


def _among_loadings(headline: Slopes, problem: Problem) -> Slopes:
    """A tangent of strokes at constant speed, no more certain than the log's other loadings agree with it.

    The square of their difference, less what their intervals let it be, is the variance between them (Paule and Mandel,
    1982, of two): a stroke may be the second on a surface that has yielded.
    """
    segments, lag = segments_of(problem.motion.rows, problem.spans), problem.lag.value
    loadings = loadings_in(problem, lag, segments)
    if not loadings:
        return headline
    rest = 0.0 if problem.counted else problem.contacts.resting
    low, high = np.percentile(np.concatenate([own.force for own in loadings]), [2, 98])
    both = tangent_at(problem, lag, loadings, headline.force + rest, NEAR * float(high - low), None)
    if both is None:
        return headline
    own = headline.stiffness
    between = max((both.value - own.value) ** 2 - both.half**2 - own.half**2, 0.0)
    differ = Contribution.within(float(np.sqrt(between)))
    return replace(headline, stiffness=own.with_cause("loadings", differ))


def stiffness_of(problem: Problem, force: Array, point: WorkingPoint) -> float | None:
    """Stiffness at a working point by another force, shape (m,), at the same rows [N/m]; None if it shows none."""
    problem = replace(problem, force=force)
    segments = segments_of(problem.motion.rows, problem.spans)
    if point.source == "press":
        slope = slope_of(loadings_in(problem, problem.lag.value, segments))
        return None if slope is None else slope.stiffness.value
    return storage_near(problem, segments, point.frequency_Hz)
