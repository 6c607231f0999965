"""Values that pass between rooms: measurements, tasks, estimates."""

from palpate.signals.types import Estimate, Sense, Task, passive_verdict, verdict

__all__ = ["Estimate", "Sense", "Task", "passive_verdict", "verdict"]
