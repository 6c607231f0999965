"""Wires to real arms: readings in, commands out, each by the arm's own library."""

from palpate.wires import ArmReading, Command, LostError, Wire
from palpate_wires.at_rest import AtRest, look
from palpate_wires.opening import KINDS, open_wire
from palpate_wires.order import Order, PressLimits, PressTask, check_order
from palpate_wires.outcome import Outcome, Rows, recover
from palpate_wires.press import press

__all__ = [
    "KINDS",
    "ArmReading",
    "AtRest",
    "Command",
    "LostError",
    "Order",
    "Outcome",
    "PressLimits",
    "PressTask",
    "Rows",
    "Wire",
    "check_order",
    "look",
    "open_wire",
    "press",
    "recover",
]
