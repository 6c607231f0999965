"""The same log with its touches in it: rows from before each touch to where the probe leaves.

In contact, the place of the surface is only an offset, and the first depths are behind the filter's settling. But a
contact whose stiffness grows from zero shows its exponent there more than anywhere. Models that are one-sided by
themselves, with the place of the surface as a parameter, hold before the touch as after it, so nothing has to settle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.identification.problem.seen import Rows, Seen


@dataclass(frozen=True)
class Touch:
    """Rows that hold the touches.

    Args:
        rows: shape (m,).
        spans: number of the contact that each belongs to, shape (m,).
        force: filtered, less what it rests at out of contact, shape (m,).
    """

    rows: Rows
    spans: Rows
    force: Array


def touching(seen: Seen, resting: float, reach: int = 0) -> Touch | None:
    """The rows in contact and those before each touch; None if no touch is in the log.

    As many before as the filter remembers; fewer where the contact before is nearer, none where it is too near.

    Args:
        seen: the force and the rows in contact, by a front end.
        resting: what the force rests at out of contact [N].
        reach: rows before the touch for each of the contact, if there are so many; those of the memory at least.
    """
    rows, spans, memory = seen.motion.rows, seen.spans, seen.memory
    before, left = [], 0
    edges = np.flatnonzero(np.diff(spans, prepend=-1))
    for number, own in zip(spans[edges], np.split(rows, edges[1:]), strict=True):
        begin, wanted = seen.begins[number], max(memory, reach * int(own[-1] - own[0]))
        first = max(begin - wanted, left + memory, memory)
        if first < begin:
            step = int(own[1] - own[0]) if len(own) > 1 else 1
            fresh = np.arange(own[0] - step, first - 1, -step)
            before += [(row, number) for row in fresh if seen.usable[row]]
        left = int(own[-1])
    if not before:
        return None
    fresh, numbers = np.array(before, dtype=np.intp).T
    every = np.r_[rows, fresh]
    order = np.argsort(every)
    return Touch(every[order], np.r_[spans, numbers][order], seen.force[every[order]] - resting)
