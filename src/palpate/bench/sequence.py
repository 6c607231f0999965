"""The phases of a run: look for the surface, press on it, find that it is lost (thesis, ch. 4)."""

from typing import NamedTuple

from palpate._jit import part
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
