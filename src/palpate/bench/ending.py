"""Early end of a run and its reason, for instance too large a learning rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.bench.row import COLUMNS
from palpate.bench.sequence import CONTACT, LOST

DONE, NO_CONTACT, DIVERGED, LOST_CONTACT, INTERRUPTED = (
    "done",
    "no contact",
    "diverged",
    "lost contact",
    "interrupted",
)


@dataclass(frozen=True)
class Ending:
    """Why a run ended.

    Args:
        end: the stable word.
        why: a sentence with the time.
    """

    end: str
    why: str


class StopCondition:
    """Looks through the rows as they come and says when the run should end.

    Args:
        losses: how many losses of contact are enough; 0 for never.
    """

    def __init__(self, losses: int):
        self._losses = losses
        self._lost = 0
        self._phase = 0.0

    def judge(self, out: Array, trouble: str) -> tuple[int, Ending | None]:
        """How many of these rows to keep, and the ending if there is one.

        Args:
            out: rows in the order of `COLUMNS`.
            trouble: what the controller says is wrong with itself after them; "" if nothing is.
        """
        finite = np.isfinite(out).all(axis=1)
        if not finite.all():
            row = int(np.argmin(finite))
            name = list(COLUMNS)[int(np.argmin(np.isfinite(out[row])))]
            return row, Ending(DIVERGED, f"{name} is not a finite number from {_time(out, row)} on")
        phases = np.concatenate([[self._phase], out[:, 1]])
        self._phase = phases[-1]
        lost = np.flatnonzero((phases[1:] == LOST) & (phases[:-1] == CONTACT))
        if self._losses and self._lost + len(lost) >= self._losses:
            row = int(lost[self._losses - self._lost - 1])
            return row + 1, Ending(
                LOST_CONTACT, f"contact was lost for the {_ordinal(self._losses)} time at {_time(out, row)}"
            )
        self._lost += len(lost)
        if self._losses and trouble:
            return len(out), Ending(DIVERGED, f"{trouble}, found at {_time(out, len(out) - 1)}")
        return len(out), None


def _time(out: Array, row: int) -> str:
    return f"{out[max(row, 0), 0]:.3f} s"


def _ordinal(n: int) -> str:
    return {1: "first", 2: "second", 3: "third"}.get(n, f"{n}th")
