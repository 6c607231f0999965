"""Values that pass between rooms: measurements, tasks, estimates."""

from palpate.signals.low_pass import LowPass
from palpate.signals.types import Estimate, Sense, Task, passive_verdict, verdict

__all__ = ["Estimate", "LowPass", "Sense", "Task", "passive_verdict", "verdict"]
