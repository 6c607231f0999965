"""The desired force: levels that alternate, a sine on top, a clock that may start anew."""

import math

import numpy as np
import pytest

from palpate._jit import kernel
from palpate.references import ForceSchedule

STEPS = ForceSchedule(10.0, 20.0, 2.5, 0.0, 0.5, 0.0)
TICK = 0.001


def forces(schedule, ticks, out):
    for k in range(ticks):
        out[k] = schedule.force(k * 0.001)


def test_the_levels_alternate_on_their_ticks():
    at = [STEPS.force(k * TICK) for k in range(10000)]
    for interval in range(4):
        level = (10.0, 20.0)[interval % 2]
        assert at[2500 * interval : 2500 * (interval + 1)] == [level] * 2500


def test_the_sine_of_figure_6_12():
    schedule = STEPS._replace(amplitude=4.0)
    for t in (0.0, 0.3, 1.7, 2.6, 4.9, 12.2):
        level = 10.0 if int(t / 2.5) % 2 == 0 else 20.0
        assert schedule.force(t) == pytest.approx(level + 4.0 * math.sin(math.pi * t), abs=1e-12)


def test_a_clock_that_restarts_each_five_seconds_flips_the_sine():
    """5 s are two and a half turns of 0.5 Hz: the listing's sine starts anew where a running one is at half."""
    running = STEPS._replace(amplitude=4.0)
    restarting = running._replace(restart=5.0)
    for t in (0.25, 1.0, 4.999):
        assert restarting.force(t) == running.force(t)
        level = STEPS.force(t + 5.0)
        assert restarting.force(t + 5.0) - level == pytest.approx(running.force(t) - STEPS.force(t), abs=1e-9)
        assert restarting.force(t + 5.0) - level == pytest.approx(level - running.force(t + 5.0), abs=1e-9)


def test_a_wave_lies_on_top_of_all_and_ends():
    wave = np.random.default_rng(0).normal(size=700)
    schedule = STEPS._replace(amplitude=4.0, wave=wave)
    plain = STEPS._replace(amplitude=4.0)
    added = np.array([schedule.force(k * TICK) - plain.force(k * TICK) for k in range(2000)])
    np.testing.assert_allclose(added[:700], wave, rtol=0, atol=1e-13)
    assert not added[700:].any()


@pytest.mark.parametrize("rate", [300.0, 1000.0, 3000.0, 20000.0])
def test_no_value_of_a_wave_comes_a_tick_early_or_late(rate):
    schedule = ForceSchedule(0.0, 0.0, 2.5, 0.0, 0.5, 0.0, np.arange(5000.0), rate)
    assert [schedule.force(k * (1.0 / rate)) for k in range(5000)] == list(range(5000))


def test_compiled_is_plain():
    schedule = STEPS._replace(amplitude=4.0, restart=5.0, wave=np.linspace(0.0, 3.0, 5000))
    plain, compiled = np.empty(12000), np.empty(12000)
    forces(schedule, 12000, plain)
    kernel(forces)(schedule, 12000, compiled)
    np.testing.assert_allclose(plain, compiled, rtol=0, atol=1e-12)  # two libraries' sines
