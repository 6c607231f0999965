"""Reading through a low-pass between samples: against exact sines, a fine simulation, and its own laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from palpate.signals.low_pass import FRACTIONS, LowPass, read, taps

DT = 1e-3
SENSOR = LowPass(((3, 120.0),))
CHAINS = {
    "sensor": SENSOR,
    "two": LowPass(((3, 120.0), (2, 120.0))),
    "slow": LowPass(((2, 20.0),)),
    "sixth": LowPass(((6, 60.0),)),
    "none": LowPass(),
}
each_chain = pytest.mark.parametrize("low_pass", CHAINS.values(), ids=CHAINS.keys())
COUNT = 2000
ROWS = np.arange(COUNT, dtype=float)
ROUNDED = 0.5 / FRACTIONS
"""How far an instant is moved at most [samples]."""


def on_the_grid(rng, count=60, low=700, high=1300):
    """Instants that need no rounding, any fraction among them."""
    return rng.integers(low * FRACTIONS, high * FRACTIONS, count) / FRACTIONS


def sine_through(low_pass, omega, instants):
    """The steady answer to sin(omega t), omega in rad a sample, and its derivatives, shape (5, m)."""
    gain = low_pass.at(np.array(omega / DT))
    return np.stack([((1j * omega) ** d * gain * np.exp(1j * omega * instants)).imag for d in range(5)])


@each_chain
@pytest.mark.parametrize("frequency", [0.7, 12.0, 60.0, 150.0, 240.0])
def test_a_sine_comes_out_as_the_low_pass_makes_it(low_pass, frequency):
    omega = 2 * np.pi * frequency * DT
    instants = on_the_grid(np.random.default_rng(1))
    got = read(np.sin(omega * ROWS), instants, taps(low_pass, DT, 5))
    wanted = sine_through(low_pass, omega, instants)
    # Weights below 1e-6 of the largest are left out, some hundreds of them: of a derivative, each counts for
    # what the derivative can make of a sample, which is pi^d.
    for d in range(5):
        np.testing.assert_allclose(got[d], wanted[d], rtol=0, atol=4e-5 * np.pi**d)


@given(st.floats(900.0, 1100.0), st.floats(1.0, 200.0))
def test_any_fraction(instant, frequency):
    """Between the places that weights are kept for, an instant is rounded: the error is the signal's slope times it."""
    omega = 2 * np.pi * frequency * DT
    got = read(np.sin(omega * ROWS), np.array([instant]), taps(SENSOR, DT, 3))[:, 0]
    wanted = sine_through(SENSOR, omega, np.array([instant]))[:3, 0]
    gain = abs(SENSOR.at(np.array(omega / DT)))
    for d in range(3):
        assert abs(got[d] - wanted[d]) <= 1.01 * ROUNDED * gain * omega ** (d + 1) + 4e-5 * np.pi**d


@each_chain
def test_a_straight_line_comes_out_late_by_the_lag(low_pass):
    instants = on_the_grid(np.random.default_rng(2), low=900, high=1100)
    got = read(0.3 * (ROWS - 1000), instants, taps(low_pass, DT, 3))
    # As for the sines; the samples stand up to 0.3 * 500 away within the weights' reach.
    np.testing.assert_allclose(got[0], 0.3 * (instants - 1000 - low_pass.lag / DT), rtol=0, atol=2e-3)
    np.testing.assert_allclose(got[1], 0.3, rtol=0, atol=1e-4)
    np.testing.assert_allclose(got[2], 0.0, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    "name", ["sensor", "slow", *(pytest.param(n, marks=pytest.mark.long) for n in ("two", "sixth"))]
)
def test_it_is_the_convolution_on_a_fine_grid(name):
    """A bump no faster than 100 Hz, through scipy's integrator at twenty steps a sample."""
    low_pass, steps = CHAINS[name], 20
    fine = np.arange(1200 * steps) / steps

    def bump(t):
        u = (t - 900) / 5.0
        return np.stack([np.exp(-(u**2) / 2), -u / 5 * np.exp(-(u**2) / 2)])

    out = bump(fine)
    for order, cutoff in low_pass.sections:
        state = signal.butter(order, 2 * np.pi * cutoff * DT, analog=True, output="zpk")
        out = np.stack([signal.lsim(signal.zpk2ss(*state), row, fine)[1] for row in out])
    at = np.arange(850 * steps, 1100 * steps, 7)
    got = read(bump(ROWS)[0], fine[at], taps(low_pass, DT, 2))
    # Rounded instants: half of 1/1024 of a sample times the steepest slope (0.12 a sample, then 0.04).
    np.testing.assert_allclose(got[0], out[0][at], rtol=0, atol=1.2e-4)
    np.testing.assert_allclose(got[1], out[1][at], rtol=0, atol=1.2e-4)


@each_chain
def test_a_derivative_is_the_slope_of_the_one_before(low_pass):
    """Of anything, also of what is faster than the low-pass: noise."""
    noise = np.random.default_rng(3).standard_normal(COUNT)
    step = 4 / FRACTIONS
    instants = on_the_grid(np.random.default_rng(4))
    weights = taps(low_pass, DT, 5)
    got, ahead, back = (read(noise, instants + shift, weights) for shift in (0.0, step, -step))
    slope = (ahead - back) / (2 * step)
    # Central differences: step^2/6 times the third derivative, at most pi^3 of a signal of some units.
    for d in range(4):
        np.testing.assert_allclose(
            got[d + 1], slope[d], rtol=0, atol=step**2 * np.pi ** (d + 3) + 1e-4 * np.pi**d
        )


def test_samples_later_is_instants_later():
    noise = np.random.default_rng(5).standard_normal(COUNT)
    instants = np.random.default_rng(6).uniform(600, 1400, 40)
    weights = taps(SENSOR, DT, 3)
    np.testing.assert_allclose(
        read(noise, instants + 17, weights), read(np.roll(noise, -17), instants, weights), rtol=0, atol=1e-12
    )


def test_it_is_linear():
    rng = np.random.default_rng(7)
    one, other = rng.standard_normal((2, COUNT))
    instants = rng.uniform(0, COUNT, 40)
    weights = taps(SENSOR, DT, 3)
    together = read(2 * one - 3 * other, instants, weights)
    apart = 2 * read(one, instants, weights) - 3 * read(other, instants, weights)
    np.testing.assert_allclose(together, apart, rtol=0, atol=1e-12)


def test_many_instants_of_one_fraction_are_read_as_few_are():
    """They go by way of the spectrum, the few one by one."""
    noise = np.random.default_rng(8).standard_normal(COUNT)
    weights = taps(SENSOR, DT, 3)
    instants = np.concatenate([ROWS + 0.25, [500.5, 501.75]])
    together = read(noise, instants, weights)
    apart = np.concatenate(
        [read(noise, instants[i : i + 50], weights) for i in range(0, len(instants), 50)], axis=1
    )
    np.testing.assert_allclose(together, apart, rtol=0, atol=1e-12)


def test_before_the_first_and_after_the_last_sample_nothing_moves():
    noise = np.random.default_rng(9).standard_normal(COUNT)
    weights = taps(SENSOR, DT, 2)
    still = np.pad(noise, 400, mode="edge")
    instants = np.linspace(-100, COUNT + 100, 333)
    np.testing.assert_allclose(
        read(noise, instants, weights), read(still, instants + 400, weights), rtol=0, atol=1e-12
    )
    far = read(noise, np.array([-5000.0, 9000.0]), weights)
    np.testing.assert_allclose(far, [[noise[0], noise[-1]], [0, 0]], rtol=0, atol=1e-12)


def test_only_the_samples_that_it_states_count():
    """`before` and `after` of the instant's own: what a stream has to keep and to wait for."""
    weights = taps(SENSOR, DT, 3)
    instant = 1000.25
    noise = np.random.default_rng(10).standard_normal(COUNT)
    first, last = 1000 - weights.before, 1000 + weights.after
    inside = noise.copy()
    inside[:first], inside[last + 1 :] = noise[first], noise[last]
    at = np.array([instant])
    np.testing.assert_allclose(read(inside, at, weights), read(noise, at, weights), rtol=0, atol=1e-12)
    assert weights.weights.shape == (FRACTIONS + 1, 3, weights.before + 1 + weights.after)
    by_hand = weights.weights[FRACTIONS // 4] @ noise[first : last + 1]
    np.testing.assert_allclose(read(noise, at, weights)[:, 0], by_hand, rtol=0, atol=1e-12)
