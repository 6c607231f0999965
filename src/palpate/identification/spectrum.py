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
from palpate.identification import octaves
from palpate.identification.in_series import SeriesSpring
from palpate.identification.options import Options
from palpate.identification.problem import Problem
from palpate.identification.result import DynamicStiffness, WorkingPoint
from palpate.identification.slope import jump_uncertainty, ripple_error, slope_in
from palpate.identification.steady_press import Slopes
from palpate.identification.uncertainty import Contribution, Measurement, Parameter, Verdict
from palpate.signals.octaves import HIDDEN_SHARE, LINES, OVERLAP
from palpate.signals.types import NORMAL

Complex = NDArray[np.complex128]

_MIN_LINE, _MAX_LINE = 2.0, 6.0
"""Lines that Hann's window lets into these three; a motion elsewhere has only leaked into them."""
_LINE_CORRELATION = np.array([[1, -2 / 3, 1 / 6], [-2 / 3, 1, -2 / 3], [1 / 6, -2 / 3, 1]])
"""Correlation of white noise between the lines of a Hann block: little of it is left across a sine's own lines."""
_ENCODER_PHASES = 4
"""Where a motion may stand between two counts of its encoder: the first three harmonics of the pull are told apart."""
_MIN_LINE_SPREAD = 1e-3
"""Share of the motion's power off the middle line below which a slope over the frequency is not asked for."""


@dataclass(frozen=True)
class _Blocks:
    """Transforms at the three lines, shape (blocks, 3), and the power of noise of the position in one line.

    Args:
        rounded: possible errors of an encoder in the position, one for each phase of its counts.
        friction: forces whose squares add up to that of the friction.
    """

    position: Complex
    velocity: Complex
    force: Complex
    rounded: tuple[Complex, ...]
    friction: tuple[Complex, ...]
    noise: float

    @property
    def pull(self) -> float:
        """Fraction by which the encoder may bias a stiffness, rms over the phases."""
        power = float((np.abs(self.position) ** 2).sum()) or 1e-300
        shares = [complex((self.position.conj() * rounding).sum()) / power for rounding in self.rounded]
        return float(np.sqrt(np.mean(np.abs(shares) ** 2))) if shares else 0.0


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
    problem: Problem, lag: float, lag_std: float, friction: Sequence[Array] = ()
) -> tuple[DynamicStiffness, ...]:
    """Storage and loss in each octave that a contact is long enough for and has motion in, lowest first.

    A force that turns with the direction is friction, of the surface or of a guide, or play before the position's
    sensor. The part of it that follows the position may or may not be stiffness: a fraction from 0 to 1 (JCGM 100,
    4.3.7). The squares of the forces `friction`, each of shape (m,) [N], add up to the square of the possible friction.

    The lag of the force and its standard deviation [s] are removed. The problem has at least one segment.
    """
    dt = problem.period
    position = problem.motion.moved(0, lag)
    speed = problem.motion.moved(1, lag)
    channels = position, speed, problem.force, *friction, *_encoder_errors(problem, position, lag)
    variance = float(position[problem.inside].var()) or 1e-300
    spectrum = []
    length = octaves.longest_length(problem.segments)
    while length >= octaves.MIN_SEGMENT_ROWS:
        blocks = _blocks(problem, channels, length, len(friction))
        octave = _octave(blocks, length, variance, lag_std)
        if _MIN_LINE <= octave.frequency * length * dt <= _MAX_LINE:
            spectrum.append(octave)
        length //= 2
    return tuple(spectrum)


def storage_near(problem: Problem, frequency: float) -> float | None:
    """Storage of the octave within half an octave of a frequency [Hz]; None if no segment shows it [N/m]."""
    motion = problem.motion
    lag = problem.lag.value
    dt = problem.period
    channels = motion.moved(0, lag), motion.moved(1, lag), problem.force
    length = octaves.longest_length(problem.segments)
    while length >= octaves.MIN_SEGMENT_ROWS:
        if _MIN_LINE < np.sqrt(2) * frequency * length * dt < 2 * _MAX_LINE:
            line = _fit(_blocks(problem, channels, length, 0))
            line_frequency = line.omega / (2 * np.pi)
            in_lines = _MIN_LINE <= line_frequency * length * dt <= _MAX_LINE
            if in_lines and abs(np.log2(line_frequency / frequency)) < 0.5:
                return float(line.parts[0])
        length //= 2
    return None


def _encoder_errors(problem: Problem, position: Array, lag: float) -> list[Array]:
    """Error of an encoder in this motion, once for each phase of its counts, behind the same filter, shape (m,) each.

    A coarse encoder's error is no noise but follows the motion: in a sine of a few counts it is part of the sine (the
    describing function of a uniform quantiser), in two held positions a part of their distance. The motion is stretched
    by a part of a count over its reach, so that positions read as whole counts lie between them.
    """
    count = problem.motion.noise.count
    if not count:
        return []
    smooth = np.interp(np.arange(len(problem.motion.position)), problem.motion.instants, position)
    errors = []
    stretch = count / max(float(np.ptp(smooth)), count)
    for phase in (np.arange(_ENCODER_PHASES) + 0.5) / _ENCODER_PHASES:
        counts = smooth * (1 + phase * stretch) / count
        rounding = np.round(counts + phase) - phase - counts
        errors.append(problem.motion.filtered(count * rounding, 0, lag))
    return errors


def _blocks(problem: Problem, channels: tuple[Array, ...], length: int, friction_count: int) -> _Blocks:
    """Transform the half-overlapping blocks of all segments, without their mean and mean slope."""
    transform = octaves.block_transform(length, LINES)
    count = len(LINES)

    def lines(values: Array) -> Complex:
        stretches = [values[segment.rows] for segment in problem.segments if segment.length >= length]
        step = max(length // 2, 1)
        parts = []
        for samples in stretches:
            blocks = np.lib.stride_tricks.sliding_window_view(samples, length)[::step]
            parts.append(blocks @ transform)
        both = np.concatenate(parts)
        return np.asarray(both[:, :count] + 1j * both[:, count:])

    chain = problem.motion.chain
    dt = problem.period
    frequency = np.array([octaves.PERIODS / (length * dt)])
    line = problem.motion.noise.power(frequency, chain.dt) * chain.position_gain(frequency) ** 2
    position, velocity, force, *others = (lines(values) for values in channels)
    rounded = tuple(others[friction_count:])
    friction = tuple(others[:friction_count])
    noise = 2 * float(line[0]) * chain.dt / dt
    return _Blocks(position, velocity, force, rounded, friction, noise)


def _octave(blocks: _Blocks, length: int, variance: float, lag_std: float) -> DynamicStiffness:
    power = float((np.abs(blocks.position) ** 2).sum())
    line = _fit(blocks)
    omega = line.omega
    parts = line.parts
    by_lag = NORMAL * omega * lag_std
    noise = min(3 * blocks.noise * len(blocks.position) / max(power, 1e-300), 1.0)
    storage_size, loss_size = abs(parts)
    bounds = {
        "lag": (loss_size * by_lag + storage_size * by_lag**2 / 2, storage_size * by_lag),
        "position noise": noise * np.abs(parts) + NORMAL * blocks.pull * np.hypot(*parts),
        "within the octave": np.abs(line.change),
    }
    scatter = np.sqrt(line.variance)
    friction_std = np.zeros(2)
    if blocks.friction:
        friction_parts = [_fit(replace(blocks, force=friction)).parts for friction in blocks.friction]
        friction_std = np.sqrt(np.square(friction_parts).sum(axis=0) / 3)
    measurements = []
    for i in range(2):
        causes = {
            "blocks": Contribution(float(scatter[i]), line.freedom),
            "friction": Contribution(float(friction_std[i])),
        }
        for cause, half_widths in bounds.items():
            causes[cause] = Contribution.within(float(half_widths[i]))
        measurements.append(Measurement(float(parts[i]), causes))
    block_count = len(blocks.position)
    share = power / block_count / length / variance
    storage, loss = measurements
    return DynamicStiffness(omega / (2 * np.pi), storage, loss, block_count, float(min(share, 1.0)))


def _fit(blocks: _Blocks) -> _Line:
    """Fit the force by position and velocity, with storage and loss linear in the frequency."""
    x = blocks.position
    v = blocks.velocity
    f = blocks.force
    power = np.abs(x) ** 2
    total = float(power.sum()) or 1e-300
    omega = float(np.sqrt((np.abs(v) ** 2).sum() / total)) or 1e-300
    u = np.array(LINES) - float((power @ LINES).sum()) / total
    spread = float((power @ u**2).sum()) / total
    slope = spread > _MIN_LINE_SPREAD
    terms = [x, v / omega]
    if slope:
        terms += [u * x, u * v / omega]
    columns = np.stack(terms, axis=-1)
    stacked = columns.reshape(-1, columns.shape[-1])
    adjoint = stacked.conj().T
    inverse_normal = np.linalg.pinv((adjoint @ stacked).real)
    theta = inverse_normal @ (adjoint @ f.ravel()).real
    residual = f - columns @ theta
    block_power = power.sum(axis=1)
    independent = max(OVERLAP * total**2 / float((block_power**2).sum() or 1e-300), 1.0)
    correlated = (_LINE_CORRELATION @ columns).reshape(stacked.shape)
    influence = inverse_normal @ (adjoint @ correlated).real
    free = max(3 * len(x) - float(np.trace(influence)) / 2, 1e-3)
    noise = float((np.abs(residual) ** 2).sum()) / free
    white_variance = noise / 2 * np.diag(influence @ inverse_normal)[:2] / OVERLAP
    block_pull = np.einsum("blp,bl->bp", columns.conj(), residual).real @ inverse_normal[:, :2]
    inflation = independent / max(independent - 1, 0.5) / OVERLAP
    freedom = max(independent - 1, 2.0 * min(1.0, 2 / independent))
    change = theta[2:] * np.sqrt(spread) if slope else np.zeros(2)
    variance = np.maximum((block_pull**2).sum(axis=0) * inflation, white_variance)
    return _Line(omega, theta[:2], change, variance, freedom)


_ROUNDING_DEPTH = 1e-9
"""Depth, as a fraction of the motion, that may be rounding alone."""
_MIN_VARIANCE_SHARE = 0.05
"""Least fraction of the position's variance in an octave that gives the working point."""


def working_point(
    problem: Problem,
    spectrum: Sequence[DynamicStiffness],
    options: Options,
    unit: str,
    hidden: float,
) -> WorkingPoint | None:
    """The most excited octave whose interval is within the tolerance; else the press; else the narrower of them.

    An octave whose storage falls below a lower one's by more than both half-widths shows something other than the
    surface (a probe that follows it, an inertia), and is passed over. An unexplained force, as of a bouncing probe, has
    all frequencies: as much of it may be at the octave's own.
    """
    tolerance = options.tolerance
    bonded = problem.contacts.bonded
    press = slope_in(problem)
    octave = _octave_point(spectrum, tolerance)
    series = SeriesSpring.of(options)
    if press is not None and series is not None:
        press = series.slopes(press)
    if octave is not None and (press is None or not _press_is_better(press, octave, tolerance)):
        slopes = _at_octave(octave, problem, hidden)
        source = "octave"
    elif press is not None:
        slopes = press
        source = "press"
    else:
        return None
    if bonded and not options.bonded:  # the first reading need not be in contact
        jump_error = Contribution.within(abs(slopes.stiffness.value) * jump_uncertainty(problem))
        slopes = replace(slopes, stiffness=slopes.stiffness.with_cause("unseen way", jump_error))
    ripple = ripple_error(problem)
    if ripple is not None:
        slopes = replace(slopes, stiffness=slopes.stiffness.with_cause("ripple", ripple))
    resting = 0.0 if problem.counted else problem.contacts.resting
    point = build_working_point(replace(slopes, force=slopes.force - resting), source, problem, options, unit)
    falls = slopes.stiffness.value < 0 and not options.bonded
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


def _press_is_better(press: Slopes, octave: DynamicStiffness, tolerance: float) -> bool:
    """True if an octave's storage is wider than the tolerance, and the press narrower than the storage."""
    storage = octave.in_phase
    return not storage.known_to(tolerance) and press.stiffness.relative_half < storage.relative_half


def _at_octave(octave: DynamicStiffness, problem: Problem, hidden: float) -> Slopes:
    """The storage of an octave, at the mean force and depth of the contact."""
    inside = problem.inside
    depths = problem.motion.moved(0, problem.lag.value)[inside]
    force = float(problem.force[inside].mean())
    depth = float(depths.mean())
    deepest = float(np.abs(depths).max())
    depth *= abs(depth) > _ROUNDING_DEPTH * deepest  # a depth that counts from its mean is rounding
    hidden_force = HIDDEN_SHARE * hidden * float(np.hypot(octave.storage, octave.loss))
    storage = octave.in_phase.with_cause("unexplained", Contribution.within(hidden_force))
    return Slopes(force, depth, storage, (storage.value,), None, 0.25 / octave.frequency)


def build_working_point(
    found: Slopes, source: str, problem: Problem, options: Options, unit: str
) -> WorkingPoint:
    """The working point of a stiffness of an octave or the press, with a verdict."""
    value = found.stiffness.value
    next_half = found.again
    interval = None if next_half is None else (value - next_half, value + next_half)
    stiffness = _judge(found.stiffness, options, unit)
    each_press = found.each if source == "press" else ()
    allowed = 2 * options.tolerance * abs(value)
    scattered = len(each_press) > 1 and float(np.ptp(each_press)) > allowed
    return WorkingPoint(
        stiffness,
        found.force,
        found.depth,
        frequency_Hz=0.25 / found.rise,
        source=source,
        prediction95=interval,
        from_surface=not problem.contacts.bonded,
        each=each_press,
        differs=scattered and stiffness.verdict is not Verdict.IDENTIFIED,
    )


def _octave_point(spectrum: Sequence[DynamicStiffness], tolerance: float) -> DynamicStiffness | None:
    """The most excited octave whose storage is known to the tolerance; else the most excited one.

    At a resonance the motion is largest, and the storage, which crosses zero there, is least certain.
    """
    octaves = []
    for i, octave in enumerate(spectrum):
        lower = [o for o in spectrum[:i] if o.share >= _MIN_VARIANCE_SHARE]
        falls = any(octave.storage + octave.storage_half < o.storage - o.storage_half for o in lower)
        if octave.share >= _MIN_VARIANCE_SHARE and not falls:
            octaves.append(octave)
    told = [octave for octave in octaves if octave.in_phase.known_to(tolerance)]
    return max(told or octaves, key=lambda octave: octave.share, default=None)


def _judge(own: Measurement, options: Options, unit: str) -> Parameter:
    """A verdict on a stiffness; the calibration of the scales is one more cause of its interval."""
    own = own.with_cause("calibration", Contribution(options.calibration * abs(own.value)))
    value = own.value
    half = own.half
    if value and own.known_to(options.tolerance):
        reason = f"known to {100 * half / abs(value):.2g} % (95 %), whatever the model"
        return Parameter.of(value, unit, Verdict.IDENTIFIED, reason, own.contributions)
    reason = f"95 %: {value - half:.3g} to {value + half:.3g} {unit}; wider than {options.tolerance:.0%}"
    return Parameter.of(value, unit, Verdict.NOT_IDENTIFIABLE, reason, own.contributions)
