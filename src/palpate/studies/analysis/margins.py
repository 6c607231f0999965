"""Gain, phase and delay margins of the force loop: its response at the input of the measured force."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.arrays import Complex, Mask
from palpate.errors import InputError
from palpate.studies.analysis.linear_loop import LinearLoop, moving

Array = NDArray[np.floating]
CUT = "force.line"
"""The loop is opened at the force on the controller's converter."""
POINTS = 1200
LOWEST = 0.05
"""Lowest frequency of the response [Hz]."""


@dataclass(frozen=True)
class LoopMargins:
    """Stability margins of the force loop, averaged over a period of sensor and tick.

    Args:
        gain: factor on the loop gain from which it is unstable; infinite if none is.
        gain_frequency: at which it then swings [Hz]; NaN if none.
        phase: further lag from which it is unstable [degrees]; infinite where the gain never reaches 1.
        phase_frequency: at which the gain is 1 and the phase nearest to instability [Hz]; NaN if none.
        delay: further delay from which it is unstable [s].
        sensitivity: largest amplification of a disturbance of the measured force; above 2 it is a nervous loop.
    """

    gain: float
    gain_frequency: float
    phase: float
    phase_frequency: float
    delay: float
    sensitivity: float


def margins(loop: LinearLoop) -> LoopMargins:
    """Stability margins of the force loop, from `loop_gain`.

    Raises:
        InputError: a loop that is unstable as it is, and has no margins.
    """
    if not loop.stable:
        raise InputError("the loop is unstable and has no margins; lower a gain until it is stable")
    f = np.geomspace(LOWEST, 0.5 / loop.tick, POINTS, endpoint=False)
    L = loop_gain(loop, f)
    gains, at = _crossings(L.imag, -1.0 / L.real, f, where=L.real < 0.0)
    rising = gains > 1.0
    gain, gain_frequency = _least(gains[rising], at[rising])
    phases, at = _crossings(np.log(np.abs(L)), np.unwrap(np.angle(-L)), f)
    turned = np.degrees(phases % (2.0 * math.pi))
    phase, phase_frequency = _least(turned, at)
    delay, _ = _least(turned / (360.0 * at), at)
    return LoopMargins(
        gain, gain_frequency, phase, phase_frequency, delay, float((1.0 / np.abs(1.0 + L)).max())
    )


def growth_with(loop: LinearLoop, gain: float = 1.0, late: int = 0) -> float:
    """Factor per tick of the fastest mode, with the measured force multiplied and delayed by so many ticks: exact."""
    cut, n = loop.motion.names.index(CUT), len(loop.x)
    steps = np.concatenate([loop.motion.steps, np.full(late, loop.motion.steps[cut])])
    period = np.eye(n + late)
    for A in loop.ticks:
        tick = np.zeros((n + late, n + late))
        tick[:n, :n] = A
        tick[:n, cut] = 0.0
        tick[:n, n + late - 1 if late else cut] = gain * A[:, cut]
        for i in range(late):
            tick[n + i, n + i - 1 if i else cut] = 1.0
        period = tick @ period
    return float(np.abs(moving(period, steps)[0]).max()) ** (1.0 / loop.period)


def loop_gain(loop: LinearLoop, frequency: ArrayLike) -> Complex:
    """Loop gain at the measured force, L of 1 + L = 0, shape as `frequency`'s.

    The sensor samples out of step with the ticks, so that a sine returns with others beside it; this is the part of
    its own frequency, averaged over a period, as a measurement with sines would give it.

    Args:
        loop: its position loops stay closed.
        frequency: [Hz], below half the rate of the ticks. Where a period holds whole turns (40 Hz and its multiples)
            it is taken a little beside: what stands still for ever has no answer there.
    """
    f = np.atleast_1d(np.asarray(frequency, dtype=float))
    turns = f * loop.period * loop.tick
    f = np.where(np.abs(turns - np.round(turns)) < 1e-4 * turns, f * (1.0 + 2e-4), f)
    turn = np.exp(-2j * math.pi * f * loop.tick)[:, None]
    cut = loop.motion.names.index(CUT)
    others = np.arange(len(loop.x)) != cut
    steps = loop.motion.steps[others]
    inside = [A[np.ix_(others, others)] / steps[:, None] * steps for A in loop.ticks]
    into = [A[others, cut] / steps for A in loop.ticks]
    period = np.eye(len(steps))
    for A in inside:
        period = A @ period
    driven = _around(inside, into, turn, np.zeros((len(f), len(steps)), complex))[-1]
    start = np.linalg.solve(np.eye(len(steps)) - turn[:, :, None] ** loop.period * period, driven[:, :, None])
    returned = np.zeros(len(f), complex)
    for A, z in zip(loop.ticks, _around(inside, into, turn, start[:, :, 0])[:-1], strict=True):
        returned += turn[:, 0] * (z @ (A[cut, others] * steps) + A[cut, cut])
    return np.reshape(-returned / loop.period, np.shape(frequency))


def _around(inside: list[Array], into: list[Array], turn: Complex, z: Complex) -> list[Complex]:
    """A sine's amplitude in the state before each tick of a period and after the last, from that before the first.

    Args:
        inside: of each tick, state to state, shape (n, n).
        into: of each tick, measured force to state, shape (n,).
        turn: exp(-j omega tick) of each sine, shape (sines, 1).
        z: before the first tick, shape (sines, n).
    """
    amplitudes = [z]
    for A, b in zip(inside, into, strict=True):
        amplitudes.append(turn * (amplitudes[-1] @ A.T + b))
    return amplitudes


def _crossings(level: Array, value: Array, f: Array, where: Mask | None = None) -> tuple[Array, Array]:
    """A value, and the frequency, wherever the level goes through zero, by straight lines between two points."""
    through = np.sign(level[1:]) != np.sign(level[:-1])
    if where is not None:
        through &= where[1:] & where[:-1]
    i = np.flatnonzero(through)
    share = level[i] / (level[i] - level[i + 1])
    return value[i] + share * (value[i + 1] - value[i]), f[i] + share * (f[i + 1] - f[i])


def _least(values: Array, at: Array) -> tuple[float, float]:
    """The smallest, and where it is; infinite and NaN if there are none."""
    if not len(values):
        return math.inf, math.nan
    i = int(np.argmin(values))
    return float(values[i]), float(at[i])
