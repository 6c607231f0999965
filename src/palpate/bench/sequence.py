"""The phases of a run, the columns of its record, and its early end with the reason.

A run looks for the surface, presses on it, finds that it is lost (thesis, ch. 4). One tick is one row, every column a
number with a unit.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate._jit import law, part
from palpate.arrays import Array
from palpate.references import Approach

APPROACH, CONTACT, LOST = 0.0, 1.0, 2.0
PHASES = {APPROACH: "approach", CONTACT: "contact", LOST: "lost contact"}


@part
class SequenceState(NamedTuple):
    phase: float  # APPROACH, CONTACT or LOST
    ticks: float  # of this phase so far
    since: float  # how long that is [s]: ticks times the tick, not a running sum
    x_d: float  # desired x of the approach [m]
    x0: float  # x where the force first reached the switch: displacement counts from here [m]
    contacts: float  # how often contact was made


@part
class Sequence(NamedTuple):
    """Switches between position control and force control by the measured force.

    Args:
        approach: desired x until the force is felt.
        switch: measured force at which the contact controller takes over [N].
        release: measured force under which the contact is taken to be lost [N].
        wait: time that the arm holds after a loss before it approaches anew [s].
        tick: time between ticks [s].
    """

    approach: Approach
    switch: float
    release: float
    wait: float
    tick: float

    def start(self):
        return SequenceState(APPROACH, 0.0, 0.0, self.approach.start, self.approach.start, 0.0)

    def step(self, state, x, force):
        """The state at this tick, from the measured x [m] and the measured force [N]."""
        phase, ticks, _, x_d, x0, contacts = state
        ticks += 1.0
        since = ticks * self.tick
        if phase == CONTACT:
            if force < self.release:
                return SequenceState(LOST, 0.0, 0.0, x_d, x0, contacts)
            return SequenceState(CONTACT, ticks, since, x_d, x0, contacts)
        if force >= self.switch:
            return SequenceState(CONTACT, 0.0, 0.0, x_d, x, contacts + 1.0)
        if phase == LOST:
            if since < self.wait:
                return SequenceState(LOST, ticks, since, x_d, x0, contacts)
            ticks, since = self.approach.hold / self.tick, self.approach.hold  # the hold is not repeated
        return SequenceState(APPROACH, ticks, since, self.approach.position(since), x0, contacts)


#: Name and unit of every column, in the order of `tick.write`.
COLUMNS = {
    "t": "s",
    "phase": "1",  # 0 approach, 1 contact, 2 lost contact
    **{f"q{i}": "rad" for i in (1, 2, 3)},  # true joint angles
    **{f"qd{i}": "rad/s" for i in (1, 2, 3)},
    "x": "m",  # true pose of the tip
    "y": "m",
    "phi": "rad",
    "x_measured": "m",  # as the controller computes it from the encoders
    "y_measured": "m",
    "phi_measured": "rad",
    "vx_measured": "m/s",  # filtered
    "vy_measured": "m/s",
    "vphi_measured": "rad/s",
    "vx_raw": "m/s",  # first difference
    "ax_raw": "m/s^2",  # second difference
    "ax_measured": "m/s^2",  # filtered
    "x_desired": "m",
    "y_desired": "m",
    "phi_desired": "rad",
    "force": "N",  # true normal force during the step before, positive when pressed
    "force_side": "N",  # true force along y
    "force_sampled": "N",
    "force_measured": "N",  # filtered: what the controller sees
    "force_desired": "N",
    **{f"torque{i}": "N m" for i in (1, 2, 3)},  # as applied
    **{f"saturated{i}": "1" for i in (1, 2, 3)},  # 1 where the limit held the torque back
    **{f"friction{i}": "N m" for i in (1, 2, 3)},
    "penetration": "m",  # true
    "touching": "1",  # true
    "displacement": "m",  # measured x from where the contact controller took over
    **{
        f"{name}_{front}": unit
        for front in ("thesis", "raw", "matched")
        for name, unit in (("M", "kg"), ("B", "N s/m"), ("K", "N/m"))
    },
    "M_matched_std": "kg",
    "B_matched_std": "N s/m",
    "K_matched_std": "N/m",
    "memory_fx": "N",  # the force command that the controller has gathered or learned
    "memory_fy": "N",
    "memory_moment": "N m",
    # What an adaptive controller reports of itself; zero for others.
    **{f"adapted{i}": "1" for i in (1, 2, 3)},
}


@law
def put(out, at, vector):
    """Writes a vector's three components into out from column `at` on; the next free column."""
    out[at], out[at + 1], out[at + 2] = vector.x, vector.y, vector.z
    return at + 3


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
