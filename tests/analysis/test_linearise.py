"""The linear model against derivations by hand, against simulation, and against itself."""

import math

import numpy as np
import pytest

from analysis.one_direction import growth
from analysis.worlds import decoupled, ringing, surface, tip_mass
from palpate.bench import load
from palpate.bench.tables import with_values
from palpate.errors import InputError
from palpate.studies.analysis import growth_with, linearise, stable_stiffness

CASES = [(12e3, 60.0, 1.0, 0.003), (30e3, 60.0, 0.25, 0.0015), (430e3, 480.0, 0.25, 0.0015)]


@pytest.mark.parametrize("case", CASES)
def test_one_direction_agrees_with_continuous_time_as_the_physics_is_stepped_finer(case):
    """At a tenth of a newton, where the arm's geometry plays no part; the bench's step is of first order."""
    stiffness, damping, kf, ki = case
    apart = []
    for steps in (20, 320):
        one = decoupled(surface(stiffness, damping, kf, ki, **{"run.steps": steps}))
        loop = linearise(one, force=0.1, x=0.4686)
        exact = growth(tip_mass(loop), (0.05, damping, stiffness), kf, ki, steps)
        apart.append(abs(math.log(loop.growth / exact)) / loop.tick)
    # Rates of growth here are 0.4 to 0.7 a second; the sixteenth part of the step leaves some of the 0.1 N.
    assert apart[0] < 0.025
    assert apart[1] < min(0.2 * apart[0], 0.002)


def swing(f):
    """Rate of growth [1/s] and frequency [Hz] of what rings."""
    peaks = np.flatnonzero((f[1:-1] > f[:-2]) & (f[1:-1] >= f[2:]) & (f[1:-1] > 0.0)) + 1
    rate = np.polyfit(1e-3 * peaks, np.log(f[peaks]), 1)[0]
    rises = np.flatnonzero((f[:-1] < 0.0) & (f[1:] >= 0.0))
    at = rises - f[rises] / (f[rises + 1] - f[rises])
    return rate, (len(rises) - 1) / (at[-1] - at[0]) * 1e3


@pytest.mark.parametrize(
    ("damping", "kf", "ki", "low", "high"),
    [(60.0, 1.0, 0.003, 1e4, 2e4), pytest.param(480.0, 0.25, 0.0015, 3e5, 6e5, marks=pytest.mark.long)],
)
def test_the_simulated_bench_swings_as_predicted_on_both_sides_of_the_boundary(damping, kf, ki, low, high):
    """All that is nonlinear in it included: geometry, one-sided contact, stick and slip along the surface."""
    base = surface(low, damping, kf, ki)
    boundary = stable_stiffness(base, low, high, x=0.466)[1]
    assert low < boundary < high
    for share in (0.97, 1.03):
        loop = linearise(with_values(base, {"surface.stiffness": share * boundary}), x=0.466)
        assert loop.stable == (share < 1.0)
        # After half a second the slowest swing is alone but for the integral's exponential, which the mean takes out.
        error = ringing(loop, 4000, 0.1)[2000:]
        rate, frequency = swing(error - error.mean())
        assert (rate > 0.0) == (not loop.stable)
        assert rate == pytest.approx(loop.modes[0].rate if share > 1.0 else swinging(loop).rate, abs=0.02)
        assert frequency == pytest.approx(swinging(loop).frequency, rel=2e-3)


def swinging(loop):
    """The slowest mode that swings."""
    return next(mode for mode in loop.modes if mode.frequency > 0.0)


@pytest.mark.long
def test_a_neural_controller_is_the_integrator_that_its_gain_says():
    """Its 200 weights and the PI of ki = eta (A/2)^2 / tick have the same slowest motions, to 1 %."""
    neural, plain = linearise(load("foam-neural")), linearise(load("foam-pi"))
    assert neural.stable
    assert plain.stable
    ours, theirs = ([mode.rate for mode in loop.modes[:3]] for loop in (neural, plain))
    np.testing.assert_allclose(ours, theirs, rtol=0.01)
    faster = linearise(with_values(load("foam-neural"), {"controller.learning_rate": 1e-4}))
    assert faster.modes[0].rate < 1.2 * neural.modes[0].rate  # both negative


def test_friction_at_rest_holds_what_would_swing_without_it():
    foam = load("foam-viscoelastic")
    assert not linearise(foam).stable
    assert linearise(foam, friction=True).stable


def test_ticks_multiply_to_a_period_and_the_eigenvalues_are_of_both():
    loop = linearise(load("foam-hybrid"))
    assert loop.period == len(loop.ticks) == 25
    assert growth_with(loop) == pytest.approx(loop.growth, rel=1e-7)
    assert abs(loop.eigenvalues[0]) == pytest.approx(loop.growth, rel=1e-12)
    # Conjugates stand beside each other: the sum is real.
    assert abs(loop.eigenvalues.sum().imag) < 1e-12
    assert loop.force == pytest.approx(20.0, abs=1e-3)


def test_when_the_sensor_s_clock_starts_does_not_matter():
    base = load("foam-hybrid")
    late = with_values(base, {"force_sensor.phase": 1.3e-3})
    # A sample is taken at the first physics step after the clock's tick: up to 50 us, 1/150 of the lag.
    assert linearise(late).growth == pytest.approx(linearise(base).growth, abs=2e-6)


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("foam-hybrid", {"force": 0.0}, "above 0 N"),
        ("foam-hybrid", {"force": 40.0}, "motor 2 would have to give"),
        ("foam-hybrid", {"x": 0.6}, "out of reach"),
    ],
)
def test_what_cannot_be_linearised_is_told(name, options, said):
    with pytest.raises(InputError, match=said):
        linearise(load(name), **options)
