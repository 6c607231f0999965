"""What passes between rooms: what is sensed, what is asked for, what is estimated."""

from palpate.signals.types import ArmModel, Estimate, Sense, Task

__all__ = ["ArmModel", "Estimate", "Sense", "Task"]
