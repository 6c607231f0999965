"""Identification of an inner loop from a log of commanded and measured position: w, z and delay, with intervals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, log, pi

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.arm import Arm, PositionLoop
from palpate.force.sampled_loop import held

BLOCKS = 8
"""Parts of a log whose scores tell how far each number may be off, whatever the noise's colour."""
FEWEST = 50 * BLOCKS
"""Samples of a log."""
TOLERANCE = 0.25
"""Largest half-width of a number that counts as identified, as a share of its value: as for `palpate identify`."""
_STARTS = ((3.0, 1.0), (10.0, 0.7), (30.0, 0.7))
"""w/2 pi [Hz] and z from which a fit starts; the delay starts from what is left of the whole lag."""


@dataclass(frozen=True)
class Parameter:
    """A number and its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.high - self.low)

    def to_json(self) -> dict[str, object]:
        """As plain JSON values."""
        return {"value": self.value, "ci95": [self.low, self.high]}


@dataclass(frozen=True)
class InnerLoop:
    """An inner loop w^2/(s^2 + 2 z w s + w^2), late by a delay.

    Args:
        bandwidth: w/2 pi [Hz].
        damping: z.
        delay: [s].
        gain: of the position measured over the one commanded; 1 where units and axes agree.
        explained: share that the model explains of how the position lags the command.
        rate: rows a second [Hz].
    """

    bandwidth: Parameter
    damping: Parameter
    delay: Parameter
    gain: Parameter
    explained: float
    rate: float

    def to_json(self) -> dict[str, object]:
        """As plain JSON values."""
        return {
            "bandwidth_hz": self.bandwidth.to_json(),
            "damping": self.damping.to_json(),
            "delay_s": self.delay.to_json(),
            "gain": self.gain.to_json(),
            "explained": self.explained,
            "rate_hz": self.rate,
        }

    def of(self, arm: Arm, source: str) -> Arm:
        """The arm with this inner loop instead of its own.

        Raises:
            InputError: a torque arm, whose loop is what its file says.
        """
        if not isinstance(arm.inner, PositionLoop):
            raise InputError(
                f"--loop-from is for an arm that is commanded by position; {arm.title} has its loop from its own "
                "stiffness and damping: set mass, stiffness and damping in [inner]"
            )
        inner = msgspec.structs.replace(
            arm.inner,
            **{
                name: found
                for key in ("bandwidth", "damping", "delay")
                for name, found in (
                    (key, getattr(self, key).value),
                    (f"{key}_interval", (getattr(self, key).low, getattr(self, key).high)),
                )
            },
        )
        return msgspec.structs.replace(arm, inner=inner, title=f"{arm.title}, inner loop from {source}")


def identify_inner_loop(time: Array, command: Array, position: Array, where: str = "the log") -> InnerLoop:
    """Identify an inner loop by output error: the model's own answer to the commands, fitted to the positions.

    The command is held from row to row. Offset, gain and the state at the start are fitted with it, linearly. Standard
    deviations come from the scores of eight parts of the log (a sandwich of independent blocks), so that they hold for
    coloured noise too; where the two halves of the log, fitted apart, differ by more than that, by half of that
    difference. The intervals are Student's of the blocks.

    Args:
        time: of the rows, evenly spaced [s], shape (n,).
        command: position sent [m], shape (n,).
        position: position measured at the same moment [m], shape (n,).
        where: names the log in errors.

    Raises:
        InputError: too short, uneven, without motion, or without the excitation to tell the numbers apart.
    """
    from scipy.stats import t as student

    log_ = _Log.of(time, command, position, where)
    p = _fitted(log_)
    halves = [_fitted(part, p) for part in log_.cut(2)]
    std = np.maximum(_deviations(log_, p), 0.5 * np.abs(halves[0] - halves[1])).tolist()
    quantile = float(student.ppf(0.975, BLOCKS - 1))
    w, z, late = exp(p[0]), exp(p[1]), float(p[2])
    grow = [exp(min(quantile * s, 50.0)) for s in std[:2]]
    gain, gain_std = _gain(log_, p)
    found = InnerLoop(
        Parameter(w / (2.0 * pi), w / (2.0 * pi) / grow[0], w / (2.0 * pi) * grow[0]),
        Parameter(z, z / grow[1], z * grow[1]),
        Parameter(late, max(late - quantile * float(std[2]), 0.0), late + quantile * float(std[2])),
        Parameter(gain, gain - quantile * gain_std, gain + quantile * gain_std),
        1.0 - float(np.mean(_residual(log_, p) ** 2) / gain**2 / np.mean(log_.behind**2)),
        1.0 / log_.tick,
    )
    _check(found, where)
    return found


def _check(found: InnerLoop, where: str) -> None:
    if found.explained < 0.5:
        raise InputError(
            f"{where}: a second-order inner loop explains {100.0 * max(found.explained, 0.0):.0f} % of how the "
            "position lags the command, so it is none; check that both columns are of one axis, in free motion and "
            "below the speed limit"
        )
    if abs(found.gain.value - 1.0) > TOLERANCE:
        raise InputError(
            f"{where}: the position moves {found.gain.value:.4g} times as far as the command; name the units of both "
            "(as --command x_mm:mm), or check that both are of one axis"
        )
    lag = found.damping.value / (pi * found.bandwidth.value) + found.delay.value
    wide = [
        name
        for name, p, size in (
            ("bandwidth", found.bandwidth, found.bandwidth.value),
            ("damping", found.damping, found.damping.value),
            ("delay", found.delay, lag),
        )
        if p.half > TOLERANCE * size
    ]
    if wide:
        raise InputError(
            f"{where}: its motion does not tell {', '.join(wide)} to {100.0 * TOLERANCE:.0f} %; record steps, or a "
            f"sweep up to {2.0 * found.bandwidth.value:.2g} Hz and more, in free motion, for longer"
        )


@dataclass(frozen=True)
class _Log:
    tick: float
    command: Array
    position: Array
    before: Array  # commands before the first row

    @classmethod
    def of(cls, time: Array, command: Array, position: Array, where: str) -> _Log:
        t, u, x = (np.asarray(a, dtype=float) for a in (time, command, position))
        if not (np.isfinite(t).all() and np.isfinite(u).all() and np.isfinite(x).all()):
            raise InputError(f"{where}: a row has no number; leave it out (--start, --end), or fill the gap")
        if len(t) < FEWEST:
            raise InputError(f"{where}: {len(t)} rows are too few; record at least {FEWEST}")
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
        return cls(tick, u - u[0], x - u[0], np.zeros(1))

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
                before=np.append(self.before, self.command[: i * n]),
            )
            for i in range(parts)
        ]


def _fitted(log_: _Log, start: Array | None = None) -> Array:
    """log w, log z and delay [s], shape (3,), of the least residual."""
    from scipy.optimize import least_squares

    longest = 0.25 * len(log_.command) * log_.tick
    low = [log(2.0 * pi * 0.05), log(0.05), 0.0]
    high = [log(pi / log_.tick), log(20.0), max(longest, 2.0 * log_.tick)]
    starts = [start] if start is not None else [_start(log_, f, z) for f, z in _STARTS]
    scale = [0.1, 0.1, log_.tick]
    found = [
        least_squares(
            lambda p: _residual(log_, p), np.clip(s, np.array(low) + 1e-9, np.array(high) - 1e-9),
            bounds=(low, high), x_scale=scale, diff_step=1e-5, max_nfev=60, gtol=None,
        )
        for s in starts
    ]  # fmt: skip
    return np.asarray(min(found, key=lambda f: float(f.cost)).x)


def _start(log_: _Log, hertz: float, z: float) -> Array:
    """A start of this bandwidth, late by what is left of the lag that a straight line through the rates tells."""
    rate = np.gradient(log_.command, log_.tick)
    whole = max(float(rate @ log_.behind / max(float(rate @ rate), 1e-300)), 0.0)
    return np.array([log(2.0 * pi * hertz), log(z), max(whole - z / (pi * hertz), 0.0)])


def _residual(log_: _Log, p: Array) -> Array:
    """Position less the model's, offset, gain and start fitted [m], shape (n,)."""
    columns = _columns(log_, p)
    return np.asarray(log_.position - columns @ np.linalg.lstsq(columns, log_.position, rcond=None)[0])


def _columns(log_: _Log, p: Array) -> Array:
    """Answer to the commands, 1, and what two states at the start leave behind, shape (n, 4)."""
    from scipy.signal import lfilter

    w, z, late = exp(p[0]), exp(p[1]), float(p[2])
    A, b = np.array([[0.0, w], [-w, -2.0 * z * w]]), np.array([0.0, w])
    whole, part = divmod(late / log_.tick, 1.0)
    E, early = held(A, b, log_.tick)
    # Within a tick the command before acts for `part` of it, and then the newer one.
    later = held(A, b, (1.0 - part) * log_.tick)[1]
    denominator = np.array([1.0, -E[0, 0] - E[1, 1], E[0, 0] * E[1, 1] - E[0, 1] * E[1, 0]])
    first = _numerator(E, early - later)
    second = _numerator(E, later)
    n = len(log_.command)
    shift = int(whole)
    lacking = max(shift + 1 - len(log_.before), 0)
    known = np.concatenate([np.full(lacking, log_.before[0]), log_.before, log_.command])
    end = len(known) - shift
    u, older = known[end - n : end], known[end - n - 1 : end - 1]
    answer = lfilter(second, denominator, u) + lfilter(first, denominator, older)
    kick = np.zeros(n)
    kick[0] = 1.0
    free = lfilter([1.0], denominator, kick)
    return np.column_stack([answer, np.ones(n), free, np.concatenate([[0.0], free[:-1]])])


def _numerator(E: Array, b: Array) -> Array:
    """Of x in x' = E x + b u, the first number of x being read before the step: by powers of 1/z."""
    return np.array([0.0, b[0], E[0, 1] * b[1] - E[1, 1] * b[0]])


def _deviations(log_: _Log, p: Array) -> Array:
    """Standard deviations of the three, by the scores of blocks, shape (3,)."""
    J, r = _slopes(log_, p), _residual(log_, p)
    bread = np.linalg.pinv(J.T @ J)
    n = len(r) // BLOCKS
    scores = np.array([J[i * n : (i + 1) * n].T @ r[i * n : (i + 1) * n] for i in range(BLOCKS)])
    meat = scores.T @ scores * BLOCKS / (BLOCKS - 1.0)
    return np.asarray(np.sqrt(np.maximum(np.diag(bread @ meat @ bread), 0.0)))


def _slopes(log_: _Log, p: Array) -> Array:
    """d residual/d p, shape (n, 3)."""
    steps = np.array([1e-5, 1e-5, 1e-3 * log_.tick])
    down = np.where(p - steps >= 0.0, p - steps, p) if p[2] < steps[2] else p - steps
    columns = []
    for i, step in enumerate(steps):
        ahead, behind = p.copy(), p.copy()
        ahead[i] += step
        behind[i] = down[i] if i == 2 else p[i] - step
        columns.append((_residual(log_, ahead) - _residual(log_, behind)) / (ahead[i] - behind[i]))
    return np.column_stack(columns)


def _gain(log_: _Log, p: Array) -> tuple[float, float]:
    """Gain of the position over the command, and its standard deviation."""
    columns = _columns(log_, p)
    best = np.linalg.lstsq(columns, log_.position, rcond=None)[0]
    r = log_.position - columns @ best
    bread = np.linalg.pinv(columns.T @ columns)
    n = len(r) // BLOCKS
    scores = np.array([columns[i * n : (i + 1) * n].T @ r[i * n : (i + 1) * n] for i in range(BLOCKS)])
    spread = bread @ (scores.T @ scores) @ bread
    return float(best[0]), float(np.sqrt(max(spread[0, 0], 0.0)))
