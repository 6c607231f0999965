"""No passive surface gives back more work than it takes: a log that shows it has a force that is read late."""

from __future__ import annotations

import numpy as np
import pytest

from identification.synthetic_contacts import force_of, record
from palpate.identification import identify

TIME = np.arange(120 * 20) / 20


def ramps(t):
    """Ten millimetres in and out in sixteen seconds, from a millimetre in free motion."""
    return np.interp(t % 24, [0, 4, 12, 20, 24], [-1e-3, -1e-3, 9e-3, -1e-3, -1e-3])


def pressed(late, damping=0.0):
    force = force_of(ramps(TIME - late), lambda d, v: 3000 * d + damping * v, 1 / 20)
    return identify(record(TIME, ramps(TIME), force + np.random.default_rng(0).normal(0, 0.02, len(TIME))))


@pytest.mark.parametrize("late", [0.3, 0.6])
def test_a_late_force_is_named_with_its_lag(late):
    found = pressed(late)
    assert "force-lags-position" in found.codes
    value, half = found.press.late
    assert value == pytest.approx(late - 0.005, abs=max(half, 0.1 * late))  # to the first order of the lag
    assert found.press.hysteresis_loss < 0
    assert found.parameters["B"].verdict != "identified"


@pytest.mark.parametrize("damping", [0.0, 300.0])
def test_a_force_in_time_is_not(damping):
    found = pressed(0.0, damping)
    assert "force-lags-position" not in found.codes
