"""One's own linear law: edges by hand, its state space, and laws that are refused."""

import numpy as np
import pytest

from palpate.certify import certify_law, transfer_function
from palpate.errors import InputError


def edge(verdict):
    ((_, high),) = verdict.ranges
    return high


@pytest.mark.parametrize(("numerator", "factor"), [([1e-5, 0.0], 2.0), ([1e-5], 1.0)])
def test_the_edge_of_an_integrating_position_law(numerator, factor):
    """c <- c + g e of this tick: g K < 2; of the last tick, z^2 - z + g K: g K < 1."""
    verdict = certify_law(numerator, [1.0, -1.0], rate=500.0, delay=0.0, interface="position")
    assert edge(verdict) == pytest.approx(factor * 1e5, rel=1e-6)
    assert verdict.proved[1] < edge(verdict)


def test_a_law_is_that_of_the_force_controller_with_its_numbers():
    """v <- 0.9 (v + 0.02 * 0.025 e): 23.9 kN/m at 10 ms and 500 Hz."""
    verdict = certify_law([0.9 * 0.02 * 0.025, 0.0], [1.0, -0.9], rate=500.0, delay=0.010)
    assert edge(verdict) == pytest.approx(23.9e3, rel=0.001)


def test_a_scale_of_both_polynomials_cancels():
    one = certify_law([4.5e-4, 0.0], [1.0, -0.9], rate=500.0, delay=0.003)
    assert edge(certify_law([9e-4, 0.0], [2.0, -1.8], rate=500.0, delay=0.003)) == pytest.approx(edge(one))


def test_a_gain_alone_has_no_state():
    assert edge(certify_law([1e-3], [1.0], rate=500.0, delay=0.0)) == pytest.approx(1e6)


def test_a_state_space_has_the_transfer_function_of_its_impulse_response():
    rng = np.random.default_rng(0)
    A, B, C, D = rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3), 0.7
    numerator, denominator = transfer_function(A, B, C, D)
    z = np.exp(0.3j)
    expected = C @ np.linalg.solve(z * np.eye(3) - A, B) + D
    assert np.polyval(numerator, z) / np.polyval(denominator, z) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        (([1.0, 0.0], [1.0]), "cannot look ahead"),
        (([1.0], [0.0, 1.0]), "begins with none of 0"),
        (([float("nan")], [1.0]), "finite coefficients"),
        (([1.0], [1.0] * 41), "at most 40"),
        (([], [1.0]), "cannot look ahead"),
    ],
)
def test_impossible_laws_are_refused(numbers, says):
    with pytest.raises(InputError, match=says):
        certify_law(*numbers, rate=500.0, delay=0.0)


def test_impossible_times_are_refused():
    with pytest.raises(InputError, match="a rate from 1"):
        certify_law([1.0], [1.0], rate=0.0, delay=0.0)
    with pytest.raises(InputError, match="up to 200 ticks"):
        certify_law([1.0], [1.0], rate=500.0, delay=10.0)
    with pytest.raises(InputError, match="interface must be"):
        certify_law([1.0], [1.0], rate=500.0, delay=0.0, interface="torque")
