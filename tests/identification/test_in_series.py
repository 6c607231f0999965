"""What gives way beside the surface, taken out: against the algebra of two impedances in series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from identification.problems import problem
from identification.synthetic_contacts import pressed, record, shaken
from palpate.errors import InputError
from palpate.identification import Verdict, identify
from palpate.identification.budget import Spread
from palpate.identification.in_series import SeriesSpring
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.identification.result import DynamicStiffness, Press, Tangent
from palpate.identification.selection import answer
from palpate.identification.uncertainty import Measurement

SERIES = 8000.0
SWINGING = 1.2
"""Mass of the tip that swings on SERIES [kg]."""
TRUTH = {"K": 5000.0, "B": 40.0, "M": 0.5}


@pytest.fixture(scope="module")
def seen():
    """An answer of a log, whose numbers the tests replace."""
    return answer(problem(shaken(n=1500), bonded=True), KELVIN_VOIGT_MASS)


def with_numbers(seen, k, b, m):
    theta = np.array([{"K": k, "B": b, "M": m}.get(name, 1.0) for name in seen.names])
    return replace(seen, theta=theta)


def expansion(k, b, m, series):
    """Z series/(Z + series) for Z = k + b s + m s^2, to the second order of s, by a fit at small s."""
    s = np.array([-2, -1, 1, 2]) * 1e-2 * k / b
    z = k + b * s + m * s**2
    together = z * series / (z + series)
    # Exact at s = 0; the four others fix the first four orders.
    rest = (together - k * series / (k + series)) / s
    b_a, m_a, *_ = np.polynomial.polynomial.polyfit(s, rest, 3)
    return k * series / (k + series), b_a, m_a


@settings(max_examples=30, deadline=None)
@given(st.floats(100, 1e5), st.floats(1e-3, 1e-2), st.floats(0.1, 2), st.floats(0.2, 50))
def test_parameters_of_the_surface_come_back(k, damping_time, mass_share, stiffer):
    b = damping_time * k
    m = mass_share * b**2 / k
    series = stiffer * k
    log = answer(problem(shaken(n=600), bonded=True), KELVIN_VOIGT_MASS) if _KEPT is None else _KEPT
    found = SeriesSpring(series).parameters(with_numbers(log, *expansion(k, b, m, series)))
    values = dict(zip(found.names, found.theta, strict=True))
    # The fit of the expansion leaves its fifth order: 1e-2 to the fourth power.
    assert values["K"] == pytest.approx(k, rel=1e-6)
    assert values["B"] == pytest.approx(b, rel=1e-4)
    assert values["M"] == pytest.approx(m, rel=1e-3)


def parts_of(stiffness):
    return Measurement.within(stiffness.real, 1.0), Measurement.within(stiffness.imag, 2.0)


_KEPT = answer(problem(shaken(n=1500), bonded=True), KELVIN_VOIGT_MASS)


def test_the_covariance_goes_through_the_derivatives(seen):
    """Against derivatives by central differences of the numbers themselves."""
    k, b, m = expansion(*TRUTH.values(), SERIES)
    at = with_numbers(seen, k, b, m)

    def moved(name, by):
        i = at.names.index(name)
        theta = at.theta.copy()
        theta[i] += by
        return SeriesSpring(SERIES).parameters(replace(at, theta=theta)).theta

    columns = []
    for name, value in zip(at.names, at.theta, strict=True):
        step = 1e-4 * abs(value)
        columns.append((moved(name, step) - moved(name, -step)) / (2 * step))
    jacobian = np.column_stack(columns)
    found = SeriesSpring(SERIES).parameters(at)
    np.testing.assert_allclose(found.cov, jacobian @ at.cov @ jacobian.T, rtol=1e-4)
    for own in np.eye(len(at.names)):
        part = SeriesSpring(SERIES).parameters(replace(at, budget={"noise": Spread(own)}))
        np.testing.assert_allclose(part.budget["noise"].variance, jacobian**2 @ own, rtol=1e-4)


def test_the_calibration_of_the_series_stiffness_is_a_cause_of_its_own(seen):
    """dK/dk = -(K/k)^2."""
    at = with_numbers(seen, *expansion(*TRUTH.values(), SERIES))
    found = SeriesSpring(SERIES, 8.0).parameters(at)
    part = found.budget["series stiffness"].variance[found.names.index("K")]
    assert np.sqrt(part) == pytest.approx(8.0 * (TRUTH["K"] / SERIES) ** 2, rel=0.01)
    assert SeriesSpring(SERIES).parameters(at).budget["series stiffness"].variance.max() == 0.0


@pytest.mark.parametrize("mass", [0.0, SWINGING])
@given(st.floats(10, 7000), st.floats(-3000, 20000), st.floats(0.1, 10.0))
def test_dynamic_stiffness_behind_a_spring_and_a_mass(mass, storage, loss, frequency):
    z, s = complex(storage, loss), 2j * np.pi * frequency
    together = z * SERIES / (z + SERIES + mass * s**2)
    octave = DynamicStiffness(frequency, *parts_of(together), 9, 0.5)
    (found,) = SeriesSpring(SERIES, 0.0, mass / SERIES).spectrum((octave,))
    assert found.storage == pytest.approx(storage, rel=1e-6, abs=1e-6 * abs(z))
    assert found.loss == pytest.approx(loss, rel=1e-6, abs=1e-6 * abs(z))
    assert (found.frequency, found.blocks, found.share) == (frequency, 9, 0.5)
    if not mass:
        gain = abs((z + SERIES) / SERIES) ** 2
        assert (found.storage_half, found.loss_half) == pytest.approx((gain, 2 * gain), rel=1e-6)


def test_a_slope_and_a_press_behind_a_spring():
    depth = np.linspace(0, 2e-3, 50)
    force = 5000 * depth
    tangent = (
        Tangent(5.0, Measurement.within(5000 * 8 / 13, 10.0)),
        Tangent(9.0, Measurement.within(SERIES, 1.0)),
    )
    press = Press(tangent, np.stack([depth + force / SERIES, force]), np.empty((2, 0)))
    found = SeriesSpring(SERIES).press(press)
    np.testing.assert_allclose(found.loading, np.stack([depth, force]), atol=1e-12)
    assert found.unloading.shape == (2, 0)
    (one,) = found.tangent  # as stiff as what is in series says nothing
    assert one.stiffness == pytest.approx(5000)
    assert one.half == pytest.approx(10 * (13 / 8) ** 2)


@pytest.mark.parametrize("series", [3000.0, 4500.0])
def test_a_log_stiffer_than_what_is_in_series_is_refused(series):
    with pytest.raises(
        InputError, match=rf"{series:.4g} N/m is softer than the log's own [345]\d+"
    ) as caught:
        identify(pressed(), lag=0.0, series_stiffness=series)
    assert "\n" not in str(caught.value)
    assert "leave it out" in str(caught.value)


@pytest.mark.parametrize(("force", "position"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_it_is_taken_out_whichever_way_the_channels_count(force, position):
    log, true = pressed(b=5.0, noise=0.01), pressed(b=5.0, noise=0.0)
    x = log["position"] + true["force"] / SERIES
    turned = record(log["time"], position * x, force * log["force"])
    found = identify(turned, lag=0.0, series_stiffness=SERIES)
    k = found.parameters["K"]
    assert k.verdict is Verdict.IDENTIFIED
    assert k.value == pytest.approx(5000, rel=0.01)
    assert found.working_point.stiffness.value == pytest.approx(5000, rel=0.05)


@pytest.mark.parametrize("lag", [0.0, 0.004])
def test_a_late_force_behind_a_soft_arm_leaves_the_damping_right(lag):
    """Subtracting the late force over the arm's stiffness from the position would take K^2 lag/k off B: 12 of 40."""
    true, late = shaken(noise=0.0, n=3000), shaken(noise=0.1, n=3000, lag=lag)
    soft = record(true["time"], true["position"] + (true["force"] - 10) / SERIES, late["force"])
    found = identify(soft, lag=lag, bonded=True, series_stiffness=SERIES)
    b = found.parameters["B"]
    assert b.ci95 is None or b.ci95[0] < 40 < b.ci95[1]
    assert found.parameters["K"].value == pytest.approx(5000, rel=0.03)


def test_a_mass_that_swings_on_the_spring_comes_off_to_the_second_order(seen):
    """Z k/(Z + k + m s^2), expanded by a fit at small s, comes back as Z; without the mass told M is K m/k too low."""
    k, b, m = TRUTH.values()
    s = np.array([-2, -1, 1, 2]) * 1e-3 * k / b
    z = k + b * s + m * s**2
    together = z * SERIES / (z + SERIES + SWINGING * s**2)
    at_rest = k * SERIES / (k + SERIES)
    b_a, m_a, *_ = np.polynomial.polynomial.polyfit(s, (together - at_rest) / s, 3)
    seen = with_numbers(seen, at_rest, b_a, m_a)
    stiff = SeriesSpring(SERIES).parameters(seen)
    found = SeriesSpring(SERIES, 0.0, SWINGING / SERIES, 0.1 / SERIES).parameters(seen)
    values = dict(zip(found.names, found.theta, strict=True))
    # The expansion leaves its fifth order: 1e-3 to the fourth power.
    assert values["K"] == pytest.approx(k, rel=1e-6)
    assert values["B"] == pytest.approx(b, rel=1e-4)
    assert values["M"] == pytest.approx(m, rel=1e-3)
    at = stiff.names.index("M")
    assert stiff.theta[at] == pytest.approx(m - k * SWINGING / SERIES, rel=1e-3)
    assert np.sqrt(found.budget["tip's mass"].variance[at]) == pytest.approx(0.1 * k / SERIES, rel=1e-6)


@pytest.fixture(scope="module")
def swung():
    """What a tip of 4 kg on an arm of 20 kN/m finds of a surface, without and with that mass told.

    Solved as a differential equation, not as algebra.
    """
    k, m, K, B = 20e3, 4.0, 5000.0, 40.0
    t = np.arange(4000) / 1000
    motors = 2e-3 + 5e-4 * (np.sin(2 * np.pi * 1.1 * t) + 0.6 * np.sin(2 * np.pi * 4.3 * t + 1))
    system = signal.lti([k], [m, B, K + k])
    _, tip, _ = signal.lsim(system, motors, t, X0=None)
    force = K * tip + B * np.gradient(tip, t) + np.random.default_rng(1).normal(0, 0.02, len(t))
    settled = t > 0.5
    log = record(t[settled], motors[settled], force[settled])
    told = {"lag": 0.0, "bonded": True, "series_stiffness": k}
    return identify(log, **told).parameters, identify(log, **told, series_mass=(m, 0.0)).parameters


def test_a_tip_that_swings_is_no_negative_mass(swung):
    without, found = swung
    assert without["M"].verdict is Verdict.REJECTED
    assert "below zero" in without["M"].reason
    assert found["K"].verdict is found["B"].verdict is Verdict.IDENTIFIED
    assert found["K"].ci95[0] < 5000.0 < found["K"].ci95[1]


def test_the_damping_behind_a_tip_that_swings_fast(swung):
    """Beyond the second order the tip's mass makes it a tenth too large, which its interval has to cover."""
    _, found = swung
    assert found["B"].ci95[0] < 40.0 < found["B"].ci95[1]


def test_a_mass_needs_a_spring_to_swing_on():
    with pytest.raises(InputError, match="give that too"):
        identify(pressed(), series_mass=(3.0, 0.0))
    with pytest.raises(InputError, match="mass in series and its std must be 0 or more, got -1 and 0"):
        identify(pressed(), series_stiffness=2e4, series_mass=(-1.0, 0.0))
