"""Wires to real arms: readings in, commands out, each by the arm's own library."""

from palpate.wires.at_rest import AtRest, look
from palpate.wires.opening import KINDS, open_wire
from palpate.wires.order import Limits, Order, Task, checked
from palpate.wires.outcome import Outcome, Rows, recover
from palpate.wires.press import press
from palpate.wires.protocol import Command, LostError, Sense, Wire

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
