"""Identification of an inner loop from a log of commanded and measured position: w, z and delay, with intervals.

With a force and a push in the log, of a servo that yields: its stiffness, damping, mass and delay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, hypot, log, pi

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop, ServoLoop
from palpate.force.lag import worst_stiffness, yielding_lag
from palpate.force.sampled_loop import zero_order_hold
from palpate.signals.samples import recursive_filter
from palpate.signals.types import NORMAL

BLOCKS = 8
"""Parts of a log whose scores tell how far each number may be off, whatever the noise's colour."""
MIN_ROWS = 50 * BLOCKS
"""Samples of a log."""
MAX_HALF_WIDTH = 0.25
"""Largest half-width of a number that counts as identified, as a share of its value: as for `palpate identify`."""
_STARTS = ((3.0, 1.0), (10.0, 0.7), (30.0, 0.7), (5.0, 4.0))
"""w/2 pi [Hz] and z from which a fit starts, a servo's last; the delay starts from what is left of the whole lag."""
_THETA_STEPS = (1e-3, 1e-3, 1e-5, 1e-3)
"""Steps of log w, log z, delay [s] and log K_s, for the slope of theta."""
ONE_MASS_ERRORS = {"lag": 0.015, "stiffness": 0.006, "delay": 0.08, "theta": 0.025}
"""Deviations by which one mass misses an arm of several joints: shares of the number, of the delay of m/D.
Chosen on 79 logs of the kind of `benchmarks/arms/servo_logs.py`, which counts on others how often they hold."""


@dataclass(frozen=True)
class LoopParameter:
    """A number and its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.high - self.low)

    def to_json(self) -> dict[str, object]:
        """Values and intervals as plain JSON values."""
        return {"value": self.value, "ci95": [self.low, self.high]}

    def beside(self, std: float) -> LoopParameter:
        """The number with another error beside its own, of this standard deviation."""
        wider = hypot(self.half, NORMAL * std) - self.half
        return LoopParameter(self.value, max(self.low - wider, 0.0), self.high + wider)


@dataclass(frozen=True, eq=False)
class FitErrors:
    """Covariance of log w, log z, delay [s] and, of a servo, log K_s; difference of the fits of the log's halves."""

    covariance: Array
    halves: Array

    def half(self, slope: Array) -> float:
        """Half of the 95 % interval of a number with this slope in them, shape (n,)."""
        from scipy.special import stdtrit

        std = max(float(slope @ self.covariance @ slope) ** 0.5, 0.5 * abs(float(slope @ self.halves)))
        return float(stdtrit(BLOCKS - 1, 0.975)) * std

    def factor(self, value: float, *slope: float) -> LoopParameter:
        """A number whose logarithm has this slope in the first of them."""
        wide = np.zeros(len(self.halves))
        wide[: len(slope)] = slope
        grow = exp(min(self.half(wide), 50.0))
        return LoopParameter(value, value / grow, value * grow)


@dataclass(frozen=True)
class InnerLoop:
    """An inner loop w^2/(s^2 + 2 z w s + w^2), late by a delay; where it yields to a force, that of a servo.

    Bandwidth w/2 pi [Hz], damping z, delay [s], lag 2 z/w [s], which is D/K_s of a servo; gain of the position measured
    over the one commanded; share explained of how the position lags the command; rows a second [Hz]; errors of the fit;
    K_s of a servo [N/m], None where nothing was pushed.
    """

    bandwidth: LoopParameter
    damping: LoopParameter
    delay: LoopParameter
    lag: LoopParameter
    gain: LoopParameter
    explained: float
    rate: float
    errors: FitErrors
    stiffness: LoopParameter | None

    def to_json(self) -> dict[str, object]:
        """Values and intervals as plain JSON values."""
        named = {
            "bandwidth_hz": self.bandwidth,
            "damping": self.damping,
            "delay_s": self.delay,
            "lag_s": self.lag,
        }
        named |= {"gain": self.gain} | ({} if self.stiffness is None else {"stiffness_N_m": self.stiffness})
        numbers = {name: p.to_json() for name, p in named.items()}
        return {**numbers, "explained": self.explained, "rate_hz": self.rate}

    def of(self, arm: Arm, source: str) -> Arm:
        """The arm with this inner loop instead of its own; a servo takes the place of any.

        Raises:
            InputError: another than a position arm, and nothing was pushed.
        """
        title = f"{arm.title}, inner loop from {source}"
        if self.stiffness is not None:
            return msgspec.structs.replace(arm, inner=self._servo(np.zeros(4)), title=title)
        if not isinstance(arm.inner, PositionLoop):
            raise InputError(
                f"--loop-from without --push is for an arm that is commanded by position; {arm.title} is of "
                f"kind {arm.kind}: record a push and name the column of its force with --push, which makes it "
                "a servo, or set [inner] by hand"
            )
        parameters = {name: getattr(self, name) for name in ("bandwidth", "damping", "delay")}
        ends = {f"{name}_interval": (p.low, p.high) for name, p in parameters.items()}
        inner = msgspec.structs.replace(
            arm.inner, **{name: p.value for name, p in parameters.items()}, **ends
        )
        return msgspec.structs.replace(arm, inner=inner, title=title)

    def _servo(self, shift: Array) -> ServoLoop:
        """The servo, its log w, log z, delay and log K_s shifted by so much, shape (4,)."""
        assert self.stiffness is not None
        w = 2.0 * pi * self.bandwidth.value * exp(shift[0])
        z = self.damping.value * exp(shift[1])
        K = self.stiffness.value * exp(shift[3])
        delay = max(self.delay.value + float(shift[2]), 0.0)
        return ServoLoop(mass=K / w**2, stiffness=K, damping=2.0 * z / w * K, delay=delay)

    def theta(self, arm: Arm) -> LoopParameter:
        """Whole lag of the force loop of an arm that `of` has made a servo of, led by these numbers [s].

        Raises:
            InputError: an interval wider than 25 % of it.
        """
        K = worst_stiffness(arm)
        value = yielding_lag(arm, self._servo(np.zeros(4)), K)
        slope = np.empty(4)
        for i, step in enumerate(_THETA_STEPS):
            ends = (yielding_lag(arm, self._servo(sign * step * np.eye(4)[i]), K) for sign in (1.0, -1.0))
            slope[i] = (next(ends) - next(ends)) / (2.0 * step)
        half = self.errors.half(slope)
        if half > MAX_HALF_WIDTH * value:
            raise InputError(
                f"{arm.title}: the lag of the force loop is {1e3 * value:.3g} +- {1e3 * half:.2g} ms; record steps, or "
                f"a sweep to {self.bandwidth.value:.2g} Hz and more, for longer"
            )
        return LoopParameter(value, value - half, value + half).beside(ONE_MASS_ERRORS["theta"] * value)


# More than five arguments: the columns of a log, and its name.
def identify_inner_loop(
    time: Array, command: Array, position: Array, where: str = "the log", force: Array | None = None
) -> InnerLoop:
    """Identify an inner loop by output error: the model's own answer to the commands, fitted to the positions.

    The command is held from row to row. Offset, gain and the state at the start are fitted with it, linearly. Standard
    deviations come from the scores of eight parts of the log (a sandwich of independent blocks), so that they hold for
    coloured noise too; where the two halves of the log, fitted apart, differ by more than that, by half of that
    difference. The intervals are Student's of the blocks.

    A force moves a servo as the command does, less 1/K_s of it, and its rate takes up what its sensor is late. The
    blocks of K_s are eight parts of the push.
    Time of the rows, evenly spaced [s], position sent and position measured at the same moment [m], and force on the
    tip along it, of either sign [N], with which a servo is identified, shapes (n,); `where` names the log in errors.

    Raises:
        InputError: too short, uneven, without motion, or without the excitation to tell the numbers apart.
    """
    log_ = _Log.of(time, command, position, force, where)
    p = _fit_loop(log_)
    errors, best, gain_std = _errors(log_, p, [_fit_loop(part, p) for part in log_.cut(2)])
    w = exp(p[0])
    z = exp(p[1])
    late = float(p[2])
    gain = float(best[0])
    half = errors.half(np.eye(len(errors.halves))[2])
    delay = LoopParameter(late, max(late - half, 0.0), late + half)
    lag = errors.factor(2.0 * z / w, -1.0, 1.0)
    stiffness = None
    if force is not None:
        K = 1.0 / abs(float(best[4]))
        stiffness = errors.factor(K, 0.0, 0.0, 0.0, 1.0).beside(ONE_MASS_ERRORS["stiffness"] * K)
        delay = delay.beside(ONE_MASS_ERRORS["delay"] * 0.5 / (z * w))
        lag = lag.beside(ONE_MASS_ERRORS["lag"] * lag.value)
    loop = InnerLoop(
        bandwidth=errors.factor(w / (2.0 * pi), 1.0),
        damping=errors.factor(z, 0.0, 1.0),
        delay=delay,
        lag=lag,
        gain=LoopParameter(gain, gain - gain_std, gain + gain_std),
        explained=1.0 - float(np.mean(_residual(log_, p) ** 2) / gain**2 / np.mean(log_.behind**2)),
        rate=1.0 / log_.tick,
        errors=errors,
        stiffness=stiffness,
    )
    _check(loop, where)
    return loop


def _check(loop: InnerLoop, where: str) -> None:
    if loop.explained < 0.5:
        raise InputError(
            f"{where}: a second-order inner loop explains {100.0 * max(loop.explained, 0.0):.0f} % of how the "
            "position lags the command, so it is none; check that both columns are of one axis, in free motion and "
            "below the speed limit"
        )
    if abs(loop.gain.value - 1.0) > MAX_HALF_WIDTH:
        raise InputError(
            f"{where}: the position moves {loop.gain.value:.4g} times as far as the command; name the units of both "
            "(as --command x_mm:mm), or check that both are of one axis"
        )
    lag = loop.lag.value + loop.delay.value
    sizes = {"bandwidth": loop.bandwidth.value, "damping": loop.damping.value, "delay": lag}
    sizes = sizes if loop.stiffness is None else {"lag": loop.lag.value}  # theta counts the rest of a servo
    wide = [name for name, size in sizes.items() if getattr(loop, name).half > MAX_HALF_WIDTH * size]
    if wide:
        raise InputError(
            f"{where}: its motion does not tell {', '.join(wide)} to {100.0 * MAX_HALF_WIDTH:.0f} %; record steps, or "
            f"a sweep up to {2.0 * loop.bandwidth.value:.2g} Hz and more, in free motion, for longer"
        )
    if loop.stiffness is not None and loop.stiffness.half > MAX_HALF_WIDTH * loop.stiffness.value:
        raise InputError(
            f"{where}: its push does not tell how the servo yields to {100.0 * MAX_HALF_WIDTH:.0f} %; push harder and "
            "for longer, or leave --push out for an arm whose encoders do not show it"
        )


@dataclass(frozen=True)
class _Log:
    tick: float
    command: Array
    position: Array
    force: Array | None  # on a servo
    before: Array  # commands before the first row

    @classmethod
    def of(cls, time: Array, command: Array, position: Array, force: Array | None, where: str) -> _Log:
        t, u, x, f = (
            np.asarray(a, dtype=float) for a in (time, command, position, 0.0 if force is None else force)
        )
        if not all(np.isfinite(a).all() for a in (t, u, x, f)):
            raise InputError(f"{where}: a row has no number; leave it out (--start, --end), or fill the gap")
        if len(t) < MIN_ROWS:
            raise InputError(f"{where}: {len(t)} rows are too few; record at least {MIN_ROWS}")
        tick = float(t[-1] - t[0]) / (len(t) - 1)
        if not tick > 0.0 or np.abs(t - t[0] - tick * np.arange(len(t))).max() > 0.5 * tick:
            raise InputError(
                f"{where}: rows are not evenly spaced in time; record every tick, or give --rate"
            )
        if np.ptp(u) == 0.0:
            raise InputError(
                f"{where}: the command does not move, so it tells nothing of the inner loop; record steps or a sweep"
            )
        if np.ptp(x) == 0.0:
            raise InputError(
                f"{where}: the position does not move; check the columns, and that the arm was on"
            )
        if force is not None and np.ptp(f) == 0.0:
            raise InputError(f"{where}: the force does not change; push the tip once, and check --push")
        return cls(tick, u - u[0], x - u[0], None if force is None else f - np.median(f), np.zeros(1))

    @property
    def behind(self) -> Array:
        """Lag of the position behind the command, without offset and gain [m]."""
        columns = np.column_stack([self.command, np.ones(len(self.command))])
        fit = np.linalg.lstsq(columns, self.position, rcond=None)[0]
        return np.asarray((columns @ fit - self.position) / (fit[0] if fit[0] > 0.0 else 1.0))

    def cut(self, parts: int) -> list[_Log]:
        """Parts of one length."""
        n = len(self.command) // parts
        return [
            replace(
                self,
                command=self.command[i * n : (i + 1) * n],
                position=self.position[i * n : (i + 1) * n],
                force=None if self.force is None else self.force[i * n : (i + 1) * n],
                before=np.append(self.before, self.command[: i * n]),
            )
            for i in range(parts)
        ]


def _fit_loop(log_: _Log, start: Array | None = None) -> Array:
    """log w, log z and delay [s], shape (3,), of the least residual."""
    from scipy.optimize import least_squares

    longest = 0.25 * len(log_.command) * log_.tick
    low = [log(2.0 * pi * 0.05), log(0.05), 0.0]
    high = [log(pi / log_.tick), log(20.0), max(longest, 2.0 * log_.tick)]
    starts = [start] if start is not None else [_start(log_, f, z) for f, z in _STARTS]
    scale = [0.1, 0.1, log_.tick]
    fits = [
        least_squares(
            lambda p: _residual(log_, p), np.clip(s, np.array(low) + 1e-9, np.array(high) - 1e-9),
            bounds=(low, high), x_scale=scale, diff_step=1e-5, max_nfev=60, gtol=None,
        )
        for s in starts
    ]  # fmt: skip
    return np.asarray(min(fits, key=lambda f: float(f.cost)).x)


def _start(log_: _Log, hertz: float, z: float) -> Array:
    """A start of this bandwidth, late by what is left of the lag that a straight line through the rates tells."""
    rate = np.gradient(log_.command, log_.tick)
    lag = max(float(rate @ log_.behind / max(float(rate @ rate), 1e-300)), 0.0)
    return np.array([log(2.0 * pi * hertz), log(z), max(lag - z / (pi * hertz), 0.0)])


def _residual(log_: _Log, p: Array) -> Array:
    """Position less the model's, offset, gain and start fitted [m], shape (n,)."""
    columns = _columns(log_, p)
    return np.asarray(log_.position - columns @ np.linalg.lstsq(columns, log_.position, rcond=None)[0])


def _columns(log_: _Log, p: Array) -> Array:
    """Answer to the commands, 1, and what two states at the start leave behind, shape (n, 4).

    Of a servo, also the answer to the force, and the rate of that, shape (n, 6).
    """
    w = exp(p[0])
    z = exp(p[1])
    late = float(p[2])
    A = np.array([[0.0, w], [-w, -2.0 * z * w]])
    b = np.array([0.0, w])
    ticks_late, fraction = divmod(late / log_.tick, 1.0)
    E, early = zero_order_hold(A, b, log_.tick)
    # Within a tick the command before acts for `part` of it, and then the newer one.
    later = zero_order_hold(A, b, (1.0 - fraction) * log_.tick)[1]
    denominator = np.array([1.0, -E[0, 0] - E[1, 1], E[0, 0] * E[1, 1] - E[0, 1] * E[1, 0]])
    first = _numerator(E, early - later)
    second = _numerator(E, later)
    n = len(log_.command)
    shift = int(ticks_late)
    lacking = max(shift + 1 - len(log_.before), 0)
    known = np.concatenate([np.full(lacking, log_.before[0]), log_.before, log_.command])
    end = len(known) - shift
    u = known[end - n : end]
    older = known[end - n - 1 : end - 1]
    answer = recursive_filter(second, denominator, u) + recursive_filter(first, denominator, older)
    kick = np.zeros(n)
    kick[0] = 1.0
    free = recursive_filter(np.ones(1), denominator, kick)
    columns = [answer, np.ones(n), free, np.concatenate([[0.0], free[:-1]])]
    if log_.force is not None:
        pushed = recursive_filter(_numerator(E, early), denominator, log_.force)
        columns += [pushed, np.gradient(pushed, log_.tick)]
    return np.column_stack(columns)


def _numerator(E: Array, b: Array) -> Array:
    """Numerator of x' = E x + b u by powers of 1/z; the first number of x is read before a step."""
    return np.array([0.0, b[0], E[0, 1] * b[1] - E[1, 1] * b[0]])


def _errors(log_: _Log, p: Array, halves: list[Array]) -> tuple[FitErrors, Array, float]:
    """Errors of the nonlinear numbers and of log K_s, the linear numbers, and half of the interval of the gain."""
    columns = _columns(log_, p)
    best = np.asarray(np.linalg.lstsq(columns, log_.position, rcond=None)[0], dtype=np.float64)
    J = np.column_stack([*_slopes(log_, p, best), columns])
    size = np.linalg.norm(J, axis=0)  # metres and seconds are far apart
    scores = J / size * (log_.position - columns @ best)[:, None]
    influence = scores @ np.linalg.pinv((J / size).T @ (J / size)) / size
    even = _blocks(influence, np.ones(len(scores)))
    covariance = even[:3, :3]
    difference = halves[0] - halves[1]
    if log_.force is not None:
        slope = -1.0 / best[4]  # of log K_s in the compliance
        covariance = np.zeros((4, 4))
        difference = np.append(difference, 0.0)
        covariance[:3, :3] = even[:3, :3]
        covariance[3, 3] = slope**2 * _blocks(influence, columns[:, 4] ** 2)[7, 7]
    errors = FitErrors(covariance, difference)
    gain = FitErrors(even[3:4, 3:4], np.zeros(1)).half(np.ones(1))
    return errors, best, gain


def _blocks(influence: Array, energy: Array) -> Array:
    """Covariance of what the sums of influences over blocks are, each of which has the same share of the energy."""
    fraction = np.cumsum(energy) / energy.sum()
    edges = np.searchsorted(fraction, np.arange(1, BLOCKS) / BLOCKS)
    sums = np.array([part.sum(axis=0) for part in np.split(influence, edges)])
    return np.asarray(sums.T @ sums * BLOCKS / (BLOCKS - 1.0))


def _slopes(log_: _Log, p: Array, best: Array) -> list[Array]:
    """Change of the fitted position with each nonlinear number, shapes (n,)."""
    slopes = []
    for i, step in enumerate((1e-5, 1e-5, 1e-3 * log_.tick)):
        ahead = p.copy()
        behind = p.copy()
        ahead[i] += step
        behind[i] -= min(step, p[2]) if i == 2 else step
        slopes.append((_columns(log_, ahead) - _columns(log_, behind)) @ best / (ahead[i] - behind[i]))
    return slopes
