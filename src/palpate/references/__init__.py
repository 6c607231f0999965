"""What is asked for: the approach to the surface, and the force to press with."""

from palpate.references.approach import Approach
from palpate.references.force_schedule import ForceSchedule
from palpate.references.waves import Chirp, Multisine

__all__ = ["Approach", "Chirp", "ForceSchedule", "Multisine"]
