"""Desired motion and force: the approach to the surface, and the force schedule."""

from palpate.references.approach import Approach
from palpate.references.force_schedule import ForceSchedule
from palpate.references.waves import Chirp, Multisine

__all__ = ["Approach", "Chirp", "ForceSchedule", "Multisine"]
