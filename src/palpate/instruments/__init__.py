"""Instruments: each states its lag [s], the group delay at zero frequency."""

from palpate.instruments.converter import Converter
from palpate.instruments.encoder import Encoder
from palpate.instruments.force_sensor import ForceSensor, ForceSensorState, force_sensor
from palpate.instruments.sallen_key import analog_filter_190, sallen_key

__all__ = [
    "Converter",
    "Encoder",
    "ForceSensor",
    "ForceSensorState",
    "analog_filter_190",
    "force_sensor",
    "sallen_key",
]
