"""One axis on a spring: edges that are known by hand, proofs, islands, overshoot, a torque arm between ticks."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.certify.discrete_loop import (
    AffineLoop,
    growth,
    is_stable,
    overshoot,
    prove,
    runs_away_in_free_motion,
    split_delay,
    stable_ranges,
)
from palpate.certify.torque_loop import TorqueSpringLoop


def integrator(gain, rate):
    """A velocity arm without delay whose speed is the gain times the force: x+ = (1 - h gain K) x."""
    return AffineLoop(np.array([[Fraction(1), Fraction(gain) / rate]]), 0)


@given(st.floats(1e-4, 1e-2), st.sampled_from([100, 500, 1000]))
def test_the_edge_of_an_integrator_is_two_over_its_gain_a_tick(gain, rate):
    (ends,) = stable_ranges(integrator(gain, rate))
    assert ends[1] == pytest.approx(min(2.0 * rate / gain, 1e7), rel=1e-6)


def test_a_proof_ends_before_the_edge():
    loop, edge = integrator(0.01, 500), 1e5
    assert prove([loop], 1.0, 0.99 * edge) == (1.0, 0.99 * edge)
    low, high = prove([loop], 1.0, 2.0 * edge)
    assert low == 1.0
    assert 0.9 * edge < high < edge
    assert prove([loop], 1.01 * edge, 2.0 * edge) is None


def random_loop(seed):
    """A random law of two states on a position arm with some delay."""
    rng = np.random.default_rng(seed)
    delay, n = int(rng.integers(0, 4)), 3
    rows = np.zeros((n + delay, n + delay + 1))
    rows[:n, :n] = rng.normal(size=(n, n)) * 0.4
    rows[:2, -1] = rng.normal(size=2) * 1e-4
    rows[2, :2] += rng.normal(size=2)
    rows[n:, n - 1 : -2] = np.eye(delay)
    return AffineLoop(np.array([[Fraction(v) for v in row] for row in rows]), len(rows) - 1)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_proved_is_stable_and_nothing_unstable_is_proved(seed):
    loop = random_loop(seed)
    ranges = stable_ranges(loop)
    grid = np.geomspace(1.0, 1e7, 3001)
    inside = np.array([any(low <= K <= high for low, high in ranges) for K in grid])
    assert np.mean(inside == (growth(loop, grid) < 1.0)) > 0.999, "but for edges between two points"
    for low, high in ranges:
        proved = prove([loop], low * 1.001, 0.99 * high)
        assert proved is not None
        assert proved[1] > 0.9 * high
        assert growth(loop, np.geomspace(*proved, 500)).max() < 1.0
        beyond = prove([loop], low * 1.001, 1e9)
        assert beyond is None or beyond[1] <= high * 1.001 or high == 1e7


def test_every_island_of_stability_is_found():
    """A late torque damps the swing again where it is late by whole periods."""
    loop = TorqueSpringLoop((600.0, 60.0), 3.0, 1e-3, 10, 0.0)
    ranges = stable_ranges(loop)
    assert len(ranges) == 4
    edges = [edge for ends in ranges for edge in ends if 1.0 < edge < 1e7]
    assert [is_stable(loop, edge * 1.001) for edge in edges] == [False, True, False, True, False, True]
    assert [is_stable(loop, edge * 0.999) for edge in edges] == [True, False, True, False, True, False]


def test_the_overshoot_of_a_second_order_loop_is_that_of_the_textbook():
    """A mass of 1 kg with a damper of 2 zeta sqrt(K), ticked fast: exp(-pi zeta / sqrt(1 - zeta^2))."""
    zeta, K = 0.3, 1e4
    loop = TorqueSpringLoop((0.0, 2.0 * zeta * 100.0), 1.0, 1e-5, 0, 0.0)
    assert overshoot(loop, [K])[0] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2)), abs=2e-3)
    assert overshoot(integrator(0.01, 500), [1e3, 1e5 * 1.01]).tolist() == [0.0, np.inf]


def test_a_delay_is_split_into_whole_ticks_and_a_rest():
    assert split_delay(0.024, 500.0) == (12, 0)
    assert split_delay(0.0, 1000.0) == (0, 0)
    whole, part = split_delay(0.0125, 100.0)
    assert (whole, float(part)) == (1, pytest.approx(0.25))


def test_a_drift_is_no_running_away():
    assert not runs_away_in_free_motion(integrator(0.01, 500))
    assert runs_away_in_free_motion(AffineLoop(np.array([[Fraction(101, 100), Fraction(1)]]), 0))
