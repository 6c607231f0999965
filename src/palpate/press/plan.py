"""Plan of a press from the touch on: a force, lowered now and then so that the surface is identifiable."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from palpate.errors import InputError

_STEPS = 6
"""Down and up again, three times."""
_PATIENCE = 3.0
"""How many times longer than the approach should take the surface is looked for."""


@dataclass(frozen=True)
class Plan:
    """The plan's numbers.

    Args:
        force: [N].
        seconds: from the first touch on [s].
        probe: share of the force by which it is lowered now and then, so that the surface shows itself; 0 for never.
        longest: time to look for the surface [s].
    """

    force: float
    seconds: float
    probe: float = 0.2
    longest: float = 60.0

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < inf:
            raise InputError(f"the press must last longer than 0 s, got {self.seconds:g} s")
        if not 0.0 <= self.probe <= 0.9:
            raise InputError(f"the probe is a share of the force from 0 to 0.9, got {self.probe:g}")

    def desired(self, since: float) -> float:
        """Desired force at a time since the touch [N]: steady, in the middle third in steps down and up, steady."""
        third = self.seconds / 3.0
        if not third <= since < 2.0 * third:
            return self.force
        lowered = int((since - third) / (third / _STEPS)) % 2 == 0
        return self.force * (1.0 - self.probe * lowered)


def plan_for(force: float, seconds: float, probe: float, gap: float, speed: float) -> Plan:
    """A plan that looks for the surface three times as long as the way to it takes, and a second."""
    return Plan(force, seconds, probe, 1.0 + _PATIENCE * gap / speed)
