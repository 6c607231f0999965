"""The work of a press: its return in unloading, and the lateness of a force that returns more than it took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.identification.estimators.octaves import Segment
from palpate.identification.pooling import random_effects
from palpate.identification.problem import Problem

_FEWEST = 6


@dataclass(frozen=True)
class Unloading:
    """Results of the unloadings.

    Args:
        curve: depth [m] and force [N] on that of the deepest contact, shape (2, n); empty if there is none.
        loss: share of the work put into it that does not come back; None without a unloading.
        late: by how much the force is read after the position, if it gives back more work than it took, and the
            half-width of that [s]; None if it does not, or if the contacts do not agree on it.
    """

    curve: Array
    loss: float | None
    late: tuple[float, float] | None


def unloading_of(problem: Problem, lag: float, segments: list[Segment]) -> Unloading:
    """The unloadings of a log.

    Args:
        problem: of the log.
        lag: of the force behind the position, taken out [s].
        segments: of its rows, one at least.
    """
    motion = problem.motion
    depth, speed, force, time = motion.moved(0, lag), motion.moved(1, lag), problem.force, problem.time
    s = max(segments, key=lambda s: float(np.ptp(depth[s.first : s.last])))
    own = slice(s.first, s.last)
    turn = _turn(depth[own])
    if turn is None:
        return Unloading(np.empty((2, 0)), None, None)
    rows = [slice(s.first, s.last) for s in segments if _turn(depth[s.first : s.last]) is not None]
    late = _late([(depth[r], speed[r], force[r], time[r]) for r in rows])
    x, f = depth[own], force[own]
    into, back = _works(x, f)
    return Unloading(np.stack([x[turn:], f[turn:]]), 1 - back / into if into > 0 else None, late)


def _turn(x: Array) -> int | None:
    """The deepest row of a contact that is left by at least half of the loading; None of another."""
    top = int(np.argmax(x))
    left = len(x) - top >= _FEWEST and x[top] - x[-1] >= 0.5 * (x[top] - x[0])
    return top if top >= _FEWEST and left else None


def _ends(x: Array) -> tuple[int, int]:
    """The rows between which a contact goes in and out over the same depths."""
    top = int(np.argmax(x))
    start = max(float(x[0]), float(x[top:].min()))
    beyond = x[top:] <= start
    return int(np.argmax(x[: top + 1] >= start)), top + (
        int(np.argmax(beyond)) if beyond.any() else len(x) - 1 - top
    )


def _works(x: Array, f: Array) -> tuple[float, float]:
    """Work put in, and what of it comes back over the same depths [J]; a shaken contact takes and gives many times."""
    first, last = _ends(x)
    way = np.diff(x[first : last + 1])
    work = (f[first:last] + f[first + 1 : last + 1]) / 2 * way
    return float(work[way > 0].sum()), -float(work[way < 0].sum())


def _late(contacts: list[tuple[Array, Array, Array, Array]]) -> tuple[float, float] | None:
    """Lateness of the force by the work that it gives back beyond what it took.

    A force that is read T late does less work in loading and unloading, by T times the integral of F' x'; no passive
    surface gives back more than it takes.

    Args:
        contacts: depth, speed, force and time of each, shape (n,).
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
