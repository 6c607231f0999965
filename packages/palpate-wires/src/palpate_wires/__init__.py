"""Wires to real arms: readings in, commands out, each by the arm's own library."""

from palpate.wires import Command, LostError, Sense, Wire
from palpate_wires.at_rest import AtRest, look
from palpate_wires.opening import KINDS, open_wire
from palpate_wires.order import Limits, Order, Task, checked
from palpate_wires.outcome import Outcome, Rows, recover
from palpate_wires.press import press

__all__ = [
    "KINDS",
    "AtRest",
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
