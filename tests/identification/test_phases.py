"""Changes of a force with time: a sensor that leaks, a specimen that breaks, a fluid, a creep test."""

from __future__ import annotations

import numpy as np
import pytest

import palpate
from palpate.identification import Verdict
from palpate.records import Record
from palpate.report.identification.words import sentence

UNITS = {"time": "s", "position": "m", "force": "N"}
K = 4000.0


def identified(time, depth, force, seed=0, **options):
    noise = 2e-3 * np.random.default_rng(seed).standard_normal(len(time))
    columns = {"time": time, "position": depth, "force": force + noise}
    return palpate.identify(Record(columns, UNITS), lag=0.0, lag_std=1e-4, **options)


def pressed(rate=200, hold=0.3):
    """Three presses at constant speed, 1 mm deep from 1 mm away."""
    knots = np.cumsum([0.0, 1.0, *(2.0, hold, 2.0, 1.0) * 3])
    time = np.arange(0, knots[-1], 1 / rate)
    return time, np.interp(time, knots, 1e-3 * np.array([-1, -1, *(1, 1, -1, -1) * 3]))


@pytest.mark.parametrize("seconds", [1.5, 6.0, 40.0])
def test_the_leak_of_a_charge_amplifier_is_removed(seconds):
    time, depth = pressed()
    force = K * np.maximum(depth, 0)
    read = np.zeros(len(force))
    for i in range(1, len(force)):  # r' = f' - r / T
        read[i] = np.exp(-(time[1] - time[0]) / seconds) * (read[i - 1] + force[i] - force[i - 1])
    found = identified(time, depth, read)
    assert "force-drifts" in found.codes
    assert found.K.verdict is Verdict.IDENTIFIED
    assert abs(found.K.value - K) < 0.01 * K
    assert "force-drifts" not in identified(time, depth, force).codes


@pytest.mark.parametrize("remaining", [0.0, 0.5])
def test_a_break_ends_the_log_and_is_said(remaining):
    time, depth = pressed()
    broken = np.cumsum((time > 1) & (depth > 0.8e-3)) > 0
    found = identified(time, depth, K * np.maximum(depth, 0) * np.where(broken, remaining, 1.0))
    assert "force-drops" in found.codes
    assert abs(float(sentence(found).split()[1]) - 2.8) < 0.05
    assert found.working_point.stiffness.ci95[0] < K < found.working_point.stiffness.ci95[1]


@pytest.mark.parametrize("plastic", [0.0, 0.1, 3.0])
def test_a_specimen_that_breaks_for_good_was_touched(plastic):
    """A rivet is drawn from rest until it yields and breaks some seconds later; what is left has no force."""
    time = np.arange(0, 15, 0.02)
    force = np.where(time < 9 + plastic, 2e5 * 1e-4 * np.minimum(time, 9), 0.0)
    found = identified(time, 1e-4 * time, force)
    assert "force-drops" in found.codes
    assert abs(found.working_point.stiffness.value - 2e5) < 0.02 * 2e5


def test_a_fluid_has_no_stiffness():
    time, depth = pressed(hold=2.0)
    found = identified(time, depth, 800.0 * np.maximum(np.gradient(depth, time), 0) * (depth > 0))
    assert "flows" in sentence(found)
    assert "force-flows" in found.codes
    assert "force-drops" not in found.codes
    assert found.working_point is None
    assert found.K.verdict is not Verdict.IDENTIFIED


def test_a_creep_test_has_its_loading():
    """A load is put on within a second, and held for ten minutes."""
    time = np.arange(0, 620, 0.1)
    load = 20 * np.interp(time, [5, 6, 606, 607], [0, 1, 1, 0])
    creep = 1 + 0.2 * np.clip((time - 6) / 600, 0, 1)
    depth = load / K * creep - 1e-3 * np.interp(time, [3, 5, 608, 610], [1, 0, 0, 1])
    found = identified(time, depth, load)
    assert abs(found.working_point.stiffness.value - K) < 0.1 * K
