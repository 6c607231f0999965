"""Response of the linear loop to a touch, and its stability margins."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.force.boundary import rank_one
from palpate.force.gains import Gains
from palpate.force.lag import ultimate_gain
from palpate.force.sampled_loop import SampledLoop, law_for

BAND = 0.05
"""Of F_d, within which a press counts as settled."""


@dataclass(frozen=True)
class Step:
    """The force after a touch, or a step, without noise.

    Args:
        time: [s], shape (n,).
        force: over F_d, shape (n,).
    """

    time: Array
    force: Array

    @property
    def overshoot(self) -> float:
        """Overshoot beyond the desired force, over F_d."""
        return max(float(self.force.max()) - 1.0, 0.0)

    @property
    def settling(self) -> float:
        """When it enters the band for good [s]; infinite if it does not."""
        outside = np.flatnonzero(np.abs(self.force - 1.0) > BAND)
        if len(outside) == len(self.force) or (len(outside) and outside[-1] == len(self.force) - 1):
            return inf
        return float(self.time[outside[-1] + 1]) if len(outside) else 0.0


@dataclass(frozen=True)
class Margins:
    """How far the loop is from growing.

    Args:
        gain: factor.
        phase: [deg].
        delay: [s].
    """

    gain: float
    phase: float
    delay: float


def step_of(gains: Gains, bound: float, held: float | None = None) -> Step:
    """The force on a surface without damping of this stiffness, as felt.

    Args:
        gains: of the loop.
        bound: K [N/m].
        held: K_u in use; the surface's own K if left out [N/m].
    """
    loop = SampledLoop(gains.arm)
    used = bound if held is None else held
    g = gains.gain_at(used)
    Phi = loop.phi(bound, 0.0, law_for(gains.arm, g, used))
    reading = np.zeros(loop.size)
    reading[0] = bound / loop.force_unit
    slowest = gains.theta / gains.alpha * max(gains.gain_at(bound) / g, 1.0)
    n = int(min(12.0 * slowest * gains.arm.rate, 20000.0))
    # About the state of rest under F_d: it starts from no force, all else at rest.
    x = np.zeros(loop.size)
    tip = -loop.force_unit / bound
    x[0] = tip
    p = 2 + len(loop.low_pass[1])
    if p > 2:
        x[2] = -1.0
    x[p : p + loop.lines[0]] = -1.0
    first = p + loop.lines[0] + 1
    seen = loop.arm.seen(bound) if loop.arm.kind != "position" else bound
    x[first : first + loop.lines[1]] = -loop.force_unit / seen
    if loop.arm.kind == "torque":
        x[first + 1 : first + loop.lines[1]] = -1.0
    force = np.empty(n)
    for k in range(n):
        force[k] = 1.0 + float(reading @ x)
        x = Phi @ x
    return Step(np.arange(n) / gains.arm.rate, force)


def frequency_response(gains: Gains, bound: float) -> tuple[Array, NDArray[np.complex128]]:
    """Frequencies [Hz] and the open loop on a surface of this stiffness, K_u being just that."""
    loop = SampledLoop(gains.arm)
    start, closed = (loop.phi(bound, 0.0, law_for(gains.arm, g, bound)) for g in (0.0, gains.gain_at(bound)))
    b, c = rank_one(closed - start)
    low, high = 0.01 / gains.theta / (2.0 * pi), 0.5 * gains.arm.rate
    frequencies = np.geomspace(low, high, 2000)
    z = np.exp(2j * pi * frequencies / gains.arm.rate)
    eye = np.eye(loop.size)
    return frequencies, np.array([-(c @ np.linalg.solve(v * eye - start, b)) for v in z])


def margins(gains: Gains, bound: float) -> Margins:
    """Of the loop on a surface of this stiffness, K_u being just that."""
    most = ultimate_gain(SampledLoop(gains.arm), bound)
    seen = bound if gains.arm.kind == "position" else gains.arm.seen(bound)
    gain = most / (gains.gain_at(bound) * seen)
    frequencies, L = frequency_response(gains, bound)
    above = np.abs(L) >= 1.0
    crossing = np.flatnonzero(above[:-1] & ~above[1:])
    phase = [180.0 + float(np.degrees(np.unwrap(np.angle(L)))[i + 1]) for i in crossing]
    if not phase:
        return Margins(gain, inf, inf)
    delays = [max(p, 0.0) / 360.0 / float(frequencies[i + 1]) for p, i in zip(phase, crossing, strict=True)]
    return Margins(gain, min(phase), min(delays))
