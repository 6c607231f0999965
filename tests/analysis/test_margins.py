"""Margins of the averaged loop against the exact eigenvalues of the periodic one."""

import math

import numpy as np
import pytest

from analysis.worlds import surface
from palpate.bench import load
from palpate.bench.tables import with_values
from palpate.errors import InputError
from palpate.studies.analysis import growth_with, linearise, loop_gain, margins


@pytest.fixture(scope="module")
def foam():
    return linearise(load("foam-hybrid"))


def test_the_gain_margin_is_where_the_exact_loop_turns_unstable(foam):
    found = margins(foam)
    # The average misses what the sensor's clock folds: a few parts in ten thousand at these frequencies.
    assert growth_with(foam, gain=0.998 * found.gain) < 1.0 < growth_with(foam, gain=1.002 * found.gain)


def test_the_delay_margin_is_where_the_exact_loop_turns_unstable(foam):
    late = margins(foam).delay / foam.tick
    assert growth_with(foam, late=math.floor(late)) < 1.0 < growth_with(foam, late=math.ceil(late))


def test_the_loop_s_gain_at_low_frequency_is_its_integrator(foam):
    """An error e becomes ki e a tick, of which the feed-forward takes 1 + kf: L = kf + ki/(j omega tick), slowly."""
    f = 0.01
    wanted = 1.0 + 0.003 / (2j * math.pi * f * foam.tick)
    assert loop_gain(foam, f) == pytest.approx(wanted, rel=0.01)


def test_a_lag_turns_the_phase_and_nothing_else():
    """A millisecond of further sampling delay at 20 Hz: 7.2 degrees."""
    base = load("foam-hybrid")
    f = np.array([2.0, 5.0, 20.0])
    before = loop_gain(linearise(with_values(base, {"force_sensor.sampling": 1000})), f)
    after = loop_gain(linearise(with_values(base, {"force_sensor.sampling": 500})), f)
    # One more period of computing, half a period more of holding: 1 ms + 0.5 ms.
    np.testing.assert_allclose(np.degrees(np.angle(before / after)), 360.0 * f * 1.5e-3, rtol=0.05)
    np.testing.assert_allclose(np.abs(after / before), 1.0, rtol=0.01)


def test_an_unstable_loop_has_no_margins():
    with pytest.raises(InputError, match="unstable"):
        margins(linearise(surface(300e3, 480.0, 1.0, 0.003)))
