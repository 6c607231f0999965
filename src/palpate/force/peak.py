"""A bound of the first peak at a touch, whatever the estimator does while its bound is one."""

from math import exp, pi, sqrt

import numpy as np

from palpate.arrays import Array
from palpate.force.arm import PositionLoop
from palpate.force.gains import Gains
from palpate.force.sampled_loop import Law, SampledLoop

LAGS = 5.0
"""From the touch until the reading reaches F_d: a worst case is sought for each number of ticks up to these.
Longer ones are a wait and then the same: in tests/force/test_peak.py twice the lags change nothing."""


def peak_bound(gains: Gains, share: float = 1.0, lags: float = LAGS) -> float | None:
    """Bound of the force's first peak after a touch [N]; None for a torque arm.

    Until the reading reaches F_d, the law moves the command by T s alpha/(theta K_eff) (F_d - F_m) a tick, s between 0
    and a largest share as the estimator likes. The largest sum of such steps, over all s, is a linear program: steps d,
    0 <= d_k <= share a (F_d - sum_j G_(k-j) d_j), where G is the reading's answer to a step of the command; the tip's
    speed at the touch is in it too. Thereafter the command only goes back, so that the force never exceeds this
    sum times the inner loop's own overshoot. A surface without damping, no noise; the touch may fall between ticks.

    Args:
        gains: of the loop.
        share: largest g theta K_eff/alpha; 1 while K_u is not below K.
        lags: see `LAGS`.
    """
    from scipy.optimize import linprog

    arm = gains.arm
    if not isinstance(arm.inner, PositionLoop):
        return None
    worst = 1.0
    for corner in arm.inner.corners:
        loop = SampledLoop(arm, 1, gains.seen_cap, corner)  # the touch falls between ticks: read a tick later
        step = share * gains.alpha * arm.tick / gains.theta
        longest = round(lags * gains.theta * arm.rate)
        answer, arriving, lead = answers(loop, gains.seen_cap, longest)
        A = np.zeros((longest, longest + 1))
        A[:, 0] = step * arriving
        for k in range(longest):
            A[k, 1 : k + 2] = step * answer[k::-1]
            A[k, k + 1] += 1.0
        for n in range(1, longest + 1):
            limits = [(0.0, step)] + [(0.0, None)] * n
            objective = -np.append(lead, np.ones(n))
            solution = linprog(objective, A_ub=A[:n, : n + 1], b_ub=np.full(n, step), bounds=limits)
            worst = max(worst, -float(solution.fun) * _overshoot(corner))
    return gains.force * worst


def answers(loop: SampledLoop, stiffness: float, n: int) -> tuple[Array, Array, float]:
    """Readings in the n ticks after a step of the command, and after a touch with a constant command.

    Both in units of the force that the step, or a tick of the approach, comes to in the end.

    Args:
        loop: of a position arm.
        stiffness: K as felt [N/m].
        n: ticks.

    Returns:
        Shapes (n,), (n,); and how many ticks of the approach the command is ahead of the tip at the touch.
    """
    Phi, free = loop.phi(stiffness, 0.0, Law(0.0)), loop.phi(0.0, 0.0, Law(0.0))
    p, read = len(loop.rates(1.0, 0.0)[1]), len(loop.rates(1.0, 0.0)[1]) + loop.lines[0] - 1
    command, unit = p + loop.lines[0] + 1, loop.force_unit / stiffness
    x = np.zeros(loop.size)
    x[command] = 1.0
    after = np.empty(n)
    for k in range(n):
        after[k] = unit * x[read]
        x = Phi @ x
    x = np.zeros(loop.size)
    for _ in range(400):  # a steady approach: far longer than any lag
        x[command] += 1.0
        x = free @ x
    x[command:] -= x[0]
    lead, x[0] = float(x[command]), 0.0
    arriving = np.empty(n)
    for k in range(n):
        arriving[k] = unit * x[read]
        x = Phi @ x
    return after, arriving, lead


def _overshoot(corner: tuple[float, float]) -> float:
    """Largest answer of the inner loop to a step of 1."""
    z = 0.5 * corner[1] / sqrt(corner[0])
    return 1.0 + exp(-pi * z / sqrt(1.0 - z * z)) if z < 1.0 else 1.0
