"""Dynamic stiffness by octaves: force over position in blocks of four periods, and how much the blocks differ.

In the three lines of an octave the force is a storage times the position and a loss times the velocity, each a
straight line of the frequency (the local polynomial method of Pintelon and Schoukens, 2012, ch. 7), fitted to all
blocks and read where the motion is. The velocity has a transform of its own: what leaks into a block from its ends and
from other octaves leaks into all channels alike. The variance between blocks, with Student's t for their effective
number, makes the interval, so that whatever differs from block to block, known or not, widens it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.identification.estimators import octaves
from palpate.identification.estimators.budget import HIDDEN_SHARE
from palpate.identification.estimators.octaves import Segment
from palpate.identification.evidence.slope import slope_in, unseen
from palpate.identification.in_series import SeriesSpring
from palpate.identification.options import Options
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, WorkingPoint
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement, Parameter, Verdict
from palpate.signals.types import NORMAL

Complex = NDArray[np.complex128]

_LOWEST, _HIGHEST = 2.0, 6.0
"""Lines that Hann's window lets into these three; a motion elsewhere has only leaked into them."""
_TIED = np.array([[1, -2 / 3, 1 / 6], [-2 / 3, 1, -2 / 3], [1 / 6, -2 / 3, 1]])
"""Correlation of white noise between the lines of a Hann block: little of it is left across a sine's own lines."""
_PHASES = 4
"""Where a motion may stand between two counts of its encoder: the first three harmonics of the pull are told apart."""
_FLAT = 1e-3
"""Share of the motion's power off the middle line below which a slope over the frequency is not asked for."""


@dataclass(frozen=True)
class _Blocks:
    """Transforms at the three lines, shape (blocks, 3), and the power of noise of the position in one line.

    Args:
        rounded: what an encoder may have added to the position, one for each phase of its counts.
        friction: forces whose squares add up to that of a friction.
    """

    position: Complex
    velocity: Complex
    force: Complex
    rounded: tuple[Complex, ...]
    friction: tuple[Complex, ...]
    noise: float

    @property
    def pull(self) -> float:
        """Share that the encoder may pull a stiffness by, rms over the phases."""
        total = float((np.abs(self.position) ** 2).sum()) or 1e-300
        along = [complex((self.position.conj() * own).sum()) / total for own in self.rounded]
        return float(np.sqrt(np.mean(np.abs(along) ** 2))) if along else 0.0


@dataclass(frozen=True)
class _Line:
    """Stiffness at the rms frequency of the motion [rad/s], its change over the octave, and variances of its two parts.

    Storage and loss, their rms change over the lines and their variances have the shape (2,); the freedom is that of
    the variances.
    """

    omega: float
    parts: Array
    change: Array
    variance: Array
    freedom: float


def dynamic_stiffness(
    problem: Problem, segments: list[Segment], lag: float, lag_std: float, friction: Sequence[Array] = ()
) -> tuple[DynamicStiffness, ...]:
    """Storage and loss in each octave that a contact is long enough for and has motion in, lowest first.

    A force that turns with the way is friction, of the surface or of a guide, or play before the position's sensor, and
    the part of it that follows the position is stiffness or none: the share is within 0 to 1 (JCGM 100, 4.3.7). The
    squares of the forces `friction`, each of shape (m,) [N], add up to what it may be.

    The lag of the force [s], known to its deviation, is taken out of the segments, one at least.
    """
    dt = float(np.median(np.diff(problem.time)))
    position = problem.motion.moved(0, lag)
    besides = *friction, *_round(problem, position, lag)
    channels = position, problem.motion.moved(1, lag), problem.force, *besides
    variance = float(np.concatenate([position[s.first : s.last] for s in segments]).var()) or 1e-300
    found = []
    length = octaves.longest_of(segments)
    while length >= octaves.SHORTEST:
        blocks = _blocks(problem, channels, segments, length, len(friction))
        octave = _octave(blocks, length, dt, variance, lag_std)
        if _LOWEST <= octave.frequency * length * dt <= _HIGHEST:
            found.append(octave)
        length //= 2
    return tuple(found)


def storage_near(problem: Problem, segments: list[Segment], frequency: float) -> float | None:
    """Storage of the octave within half an octave of a frequency [Hz]; None if none of the segments shows it [N/m]."""
    motion, lag = problem.motion, problem.lag.value
    dt = float(np.median(np.diff(problem.time)))
    channels = motion.moved(0, lag), motion.moved(1, lag), problem.force
    length = octaves.longest_of(segments)
    while length >= octaves.SHORTEST:
        if _LOWEST < np.sqrt(2) * frequency * length * dt < 2 * _HIGHEST:
            line = _fit(_blocks(problem, channels, segments, length, 0))
            own = line.omega / (2 * np.pi)
            if _LOWEST <= own * length * dt <= _HIGHEST and abs(np.log2(own / frequency)) < 0.5:
                return float(line.parts[0])
        length //= 2
    return None


def _round(problem: Problem, position: Array, lag: float) -> list[Array]:
    """Error of an encoder in this motion, once for each phase of its counts, behind the same filter, shape (m,) each.

    A coarse encoder's error goes with the motion: of a sine of a few counts it is part of the sine (the describing
    function of a uniform quantiser), of two places that are held a part of their distance, and no noise. The motion is
    drawn out by a part of a count over its reach, so that places that were read as whole counts lie between them.
    """
    count = problem.motion.noise.count
    if not count:
        return []
    smooth = np.interp(np.arange(len(problem.motion.position)), problem.motion.instants, position)
    found = []
    longer = count / max(float(np.ptp(smooth)), count)
    for phase in (np.arange(_PHASES) + 0.5) / _PHASES:
        drawn = smooth * (1 + phase * longer) / count
        found.append(problem.motion.filtered(count * (np.round(drawn + phase) - phase - drawn), 0, lag))
    return found


def _blocks(
    problem: Problem, channels: tuple[Array, ...], segments: list[Segment], length: int, besides: int
) -> _Blocks:
    """Of all segments that hold one; half overlapping, without their mean and their mean slope."""
    seen, count = octaves.transform_of(length, octaves.LINES), len(octaves.LINES)

    def lines(values: Array) -> Complex:
        parts = [values[s.first : s.last] for s in segments if s.length >= length]
        strided = np.lib.stride_tricks.sliding_window_view
        views = (strided(own, length)[:: max(length // 2, 1)] for own in parts)
        real = np.concatenate([own @ seen for own in views])
        return np.asarray(real[:, :count] + 1j * real[:, count:])

    chain, dt = problem.motion.chain, float(np.median(np.diff(problem.time)))
    frequency = np.array([octaves.PERIODS / (length * dt)])
    line = problem.motion.noise.power(frequency, chain.dt) * chain.position_gain(frequency) ** 2
    x, v, f, *others = (lines(values) for values in channels)
    rounded, friction = tuple(others[besides:]), tuple(others[:besides])
    return _Blocks(x, v, f, rounded, friction, 2 * float(line[0]) * chain.dt / dt)


def _octave(blocks: _Blocks, length: int, dt: float, variance: float, lag_std: float) -> DynamicStiffness:
    power = float((np.abs(blocks.position) ** 2).sum())
    line = _fit(blocks)
    omega, parts = line.omega, line.parts
    by_lag = NORMAL * omega * lag_std
    noise = min(3 * blocks.noise * len(blocks.position) / max(power, 1e-300), 1.0)
    bounds = {
        "lag": np.array([abs(parts[1]) * by_lag + abs(parts[0]) * by_lag**2 / 2, abs(parts[0]) * by_lag]),
        "position noise": noise * np.abs(parts) + NORMAL * blocks.pull * np.hypot(*parts),
        "within the octave": np.abs(line.change),
    }
    scatter = np.sqrt(line.variance)
    turned = [_fit(replace(blocks, force=own)).parts for own in blocks.friction]
    turning = np.sqrt(np.square(turned).sum(axis=0) / 3) if turned else np.zeros(2)
    storage, loss = (
        Measurement(
            float(parts[i]),
            {"blocks": Contribution(float(scatter[i]), line.freedom)}
            | {"friction": Contribution(float(turning[i]))}
            | {cause: Contribution.within(float(half[i])) for cause, half in bounds.items()},
        )
        for i in range(2)
    )
    share = power / len(blocks.position) / length / variance
    return DynamicStiffness(omega / (2 * np.pi), storage, loss, len(blocks.position), float(min(share, 1.0)))


def _fit(blocks: _Blocks) -> _Line:
    """Least squares of the force on position and velocity, both stiffnesses straight lines of the frequency."""
    x, v, f = blocks.position, blocks.velocity, blocks.force
    power = np.abs(x) ** 2
    total = float(power.sum()) or 1e-300
    omega = float(np.sqrt((np.abs(v) ** 2).sum() / total)) or 1e-300
    u = np.array(octaves.LINES) - float((power @ octaves.LINES).sum()) / total
    spread = float((power @ u**2).sum()) / total
    slope = spread > _FLAT
    columns = np.stack([x, v / omega, u * x, u * v / omega] if slope else [x, v / omega], axis=-1)
    flat = columns.reshape(-1, columns.shape[-1])
    bread = np.linalg.pinv((flat.conj().T @ flat).real)
    theta = bread @ (flat.conj().T @ f.ravel()).real
    left = f - columns @ theta
    own = power.sum(axis=1)
    independent = max(octaves.OVERLAP * total**2 / float((own**2).sum() or 1e-300), 1.0)
    tied = bread @ (flat.conj().T @ (_TIED @ columns).reshape(flat.shape)).real
    noise = float((np.abs(left) ** 2).sum()) / max(3 * len(x) - float(np.trace(tied)) / 2, 1e-3)
    within = noise / 2 * np.diag(tied @ bread)[:2] / octaves.OVERLAP
    moved = np.einsum("blp,bl->bp", columns.conj(), left).real @ bread[:, :2]
    grown = independent / max(independent - 1, 0.5) / octaves.OVERLAP
    freedom = max(independent - 1, 2.0 * min(1.0, 2 / independent))
    change = theta[2:] * np.sqrt(spread) if slope else np.zeros(2)
    variance = np.maximum((moved**2).sum(axis=0) * grown, within)
    return _Line(omega, theta[:2], change, variance, freedom)


_ROUNDING = 1e-9
"""Share of the motion that a depth may be by rounding alone."""
_EXCITED = 0.05
"""Share of the position's variance that makes an octave worth a headline: one part in twenty of the motion."""


def working_point(
    problem: Problem,
    spectrum: Sequence[DynamicStiffness],
    options: Options,
    unit: str,
    hidden: float,
) -> WorkingPoint | None:
    """The most excited octave whose interval is within the tolerance; else the press; else the narrower of them.

    An octave whose storage falls below a lower one's by more than both half-widths shows something other than the
    surface (a probe that follows it, an inertia), and is passed over. A force that nothing explains, as where the probe
    bounces, is at every frequency at once: as much of it as is seen may be at the octave's own.
    """
    tolerance, bonded = options.tolerance, problem.contacts.bonded
    segments = octaves.segments_of(problem.motion.rows, problem.spans)
    press, octave = slope_in(problem, segments), _octave_point(spectrum, tolerance)
    series = SeriesSpring.of(options)
    if press is not None and series is not None:
        press = series.slopes(press)
    own = None if octave is None or octave.in_phase.known_to(tolerance) else octave.in_phase.relative_half
    if press is not None and (octave is None or (own is not None and press.stiffness.relative_half < own)):
        found, source = press, "press"
    elif octave is not None:
        found, source = _at_octave(octave, problem, segments, hidden), "octave"
    else:
        return None
    if bonded and not options.bonded:  # nothing tells that the first reading is in contact
        reach = Contribution.within(abs(found.stiffness.value) * unseen(problem))
        found = replace(found, stiffness=found.stiffness.with_cause("unseen way", reach))
    rest = 0.0 if problem.counted else problem.contacts.resting
    point = point_of(replace(found, force=found.force - rest), source, problem, options, unit)
    falls = found.stiffness.value < 0 and not options.bonded
    if not problem.contacts.signed or (bonded and falls):
        against = "the signs of force and position are not known (give --force-sign)"
    elif falls:
        against = (
            "the force falls as the probe goes in: either the surface yields, or it moves, and then this is the"
            " stiffness of what holds the probe"
        )
    else:
        return point
    reason = f"{point.stiffness.reason}; {against}"
    return replace(point, stiffness=replace(point.stiffness, verdict=Verdict.NOT_IDENTIFIABLE, reason=reason))


def _at_octave(octave: DynamicStiffness, problem: Problem, segments: list[Segment], hidden: float) -> Slopes:
    """The storage of an octave, where the contact is in the mean."""
    inside = np.concatenate([np.arange(s.first, s.last) for s in segments])
    depths = problem.motion.moved(0, problem.lag.value)[inside]
    force, depth = float(problem.force[inside].mean()), float(depths.mean())
    depth *= abs(depth) > _ROUNDING * float(np.abs(depths).max())  # of a depth that counts from its mean
    hidden_force = HIDDEN_SHARE * hidden * float(np.hypot(octave.storage, octave.loss))
    own = octave.in_phase.with_cause("unexplained", Contribution.within(hidden_force))
    return Slopes(force, depth, own, (own.value,), None, 0.25 / octave.frequency)


def point_of(found: Slopes, source: str, problem: Problem, options: Options, unit: str) -> WorkingPoint:
    """The working point of a stiffness at the force that is named, of an octave or the press, with a verdict."""
    value, again = found.stiffness.value, found.again
    interval = None if again is None else (value - again, value + again)
    own, each = _judge(found.stiffness, options, unit), found.each if source == "press" else ()
    apart = len(each) > 1 and float(np.ptp(each)) > 2 * options.tolerance * abs(value)
    return WorkingPoint(
        own, found.force, found.depth, 0.25 / found.rise, source, interval, not problem.contacts.bonded, each,
        apart and own.verdict is not Verdict.IDENTIFIED,
    )  # fmt: skip


def _octave_point(spectrum: Sequence[DynamicStiffness], tolerance: float) -> DynamicStiffness | None:
    """The most excited octave that tells its storage within the tolerance; else the most excited one.

    At a resonance the motion is largest, and the storage, which goes through zero there, is told least.
    """
    kept = []
    for i, own in enumerate(spectrum):
        lower = [o for o in spectrum[:i] if o.share >= _EXCITED]
        falls = any(own.storage + own.storage_half < o.storage - o.storage_half for o in lower)
        if own.share >= _EXCITED and not falls:
            kept.append(own)
    told = [own for own in kept if own.in_phase.known_to(tolerance)]
    return max(told or kept, key=lambda own: own.share, default=None)


def _judge(own: Measurement, options: Options, unit: str) -> Parameter:
    """A verdict on a stiffness; the calibration of the scales is one more cause of its interval."""
    own = own.with_cause("calibration", Contribution(options.calibration * abs(own.value)))
    value, half = own.value, own.half
    if value and own.known_to(options.tolerance):
        reason = f"known to {100 * half / abs(value):.2g} % (95 %), whatever the model"
        return Parameter.of(value, unit, Verdict.IDENTIFIED, reason, own.contributions)
    reason = f"95 %: {value - half:.3g} to {value + half:.3g} {unit}; wider than {options.tolerance:.0%}"
    return Parameter.of(value, unit, Verdict.NOT_IDENTIFIABLE, reason, own.contributions)
