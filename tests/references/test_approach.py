"""The approach: a hold, then a step each period, each on its own tick."""

import numpy as np
import pytest

from palpate._jit import kernel
from palpate.references import Approach

THESIS = Approach(start=0.454, hold=5.0, first=0.456, step=0.001, period=1.0)
TICK = 0.001


def positions(approach, ticks, out):
    for k in range(ticks):
        out[k] = approach.position(k * 0.001)


def test_it_holds_then_steps_a_millimetre_each_second():
    at = [THESIS.position(k * TICK) for k in range(9000)]
    assert at[:5000] == [0.454] * 5000
    for second in range(4):
        expected = 0.456 + second * 0.001
        assert at[5000 + 1000 * second : 6000 + 1000 * second] == [expected] * 1000


@pytest.mark.parametrize("period", [0.1, 0.3, 0.7, 1.1])
def test_no_step_comes_a_tick_early_or_late(period):
    """k * dt is not exact: 0.3 / 0.1 is 2.9999999999999996."""
    approach = THESIS._replace(hold=0.3, period=period)
    at = np.array([approach.position(k * TICK) for k in range(20000)])
    steps = np.flatnonzero(np.diff(at) > 1e-9) + 1
    np.testing.assert_array_equal(steps, 300 + np.round(np.arange(len(steps)) * period / TICK))


def test_compiled_is_plain():
    plain, compiled = np.empty(8000), np.empty(8000)
    positions(THESIS, 8000, plain)
    kernel(positions)(THESIS, 8000, compiled)
    np.testing.assert_array_equal(plain, compiled)
