"""What passes between rooms: what is sensed, what is asked for, what is estimated."""

from palpate.signals.types import Estimate, Sense, Task, passive_verdict, verdict

__all__ = ["Estimate", "Sense", "Task", "passive_verdict", "verdict"]
