"""The force's way into the controller, from the numbers of a sensor."""

from __future__ import annotations

from palpate.bench.experiments.tables import ForceSensor
from palpate.bench.force_input import ForceInput
from palpate.instruments import Converter, analog_filter_190, force_sensor


def force_input(of: ForceSensor, physics: int, full_scale: float = 200.0) -> ForceInput:
    """The way into the controller of a force sensor's numbers.

    Args:
        of: the numbers, as an experiment has them.
        physics: steps of the physics a second [Hz].
        full_scale: of the controller's own converter [N].
    """
    sensor = force_sensor(of.cutoff, of.sampling, of.bits, of.full_scale, of.noise, physics, of.phase)
    filtered = 1.0 if of.analog_filter else 0.0
    analog = analog_filter_190(float(physics))
    return ForceInput(sensor, analog, filtered, Converter(16, full_scale), float(of.roughness))
