"""Wires to real arms: readings in, commands out, each by the arm's own library."""

from palpate.wires.opening import KINDS, open_wire
from palpate.wires.press import Air, Limits, Order, Outcome, Task, checked, look, press
from palpate.wires.protocol import Command, LostError, Sense, Wire
from palpate.wires.recording import Rows, recover

__all__ = [
    "KINDS",
    "Air",
    "Command",
    "Limits",
    "LostError",
    "Order",
    "Outcome",
    "Rows",
    "Sense",
    "Task",
    "Wire",
    "checked",
    "look",
    "open_wire",
    "press",
    "recover",
]
