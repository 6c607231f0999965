"""Wires to real arms: readings in, commands out, each by the arm's own library.

A wire of your own is a class with the methods of `Wire`; `press` runs a force loop over any wire.
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.wires.at_rest import AtRest, check_at_rest
    from palpate.wires.opening import KINDS, open_wire
    from palpate.wires.order import Order, PressLimits, PressTask, check_order
    from palpate.wires.outcome import Outcome, Rows, recover
    from palpate.wires.pressing import press
    from palpate.wires.wire import (
        SILENCE,
        ArmReading,
        Command,
        ConnectionLostError,
        NoReadingError,
        PressEndedError,
        WatchdogStopError,
        Wire,
        unreadable,
    )

__all__ = [
    "KINDS",
    "SILENCE",
    "ArmReading",
    "AtRest",
    "Command",
    "ConnectionLostError",
    "NoReadingError",
    "Order",
    "Outcome",
    "PressEndedError",
    "PressLimits",
    "PressTask",
    "Rows",
    "WatchdogStopError",
    "Wire",
    "check_at_rest",
    "check_order",
    "open_wire",
    "press",
    "recover",
    "unreadable",
]

_HOMES = {
    "at_rest": ("AtRest", "check_at_rest"),
    "opening": ("KINDS", "open_wire"),
    "order": ("Order", "PressLimits", "PressTask", "check_order"),
    "outcome": ("Outcome", "Rows", "recover"),
    "pressing": ("press",),
    "wire": (
        "SILENCE",
        "ArmReading",
        "Command",
        "PressEndedError",
        "WatchdogStopError",
        "ConnectionLostError",
        "NoReadingError",
        "Wire",
        "unreadable",
    ),
}
__getattr__ = importer(__name__, _HOMES)
