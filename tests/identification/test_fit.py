"""Noise of the position makes least squares' columns uncertain: its pull is taken out, what is left is said."""

from dataclasses import replace

import numpy as np
import pytest

from identification.problems import problem
from identification.sensor_logs import TRUTH, sensor_log
from palpate.identification.estimators.fit import compensation, fit, resting
from palpate.identification.filters.sensor_path import NOISELESS
from palpate.identification.models import KELVIN_VOIGT_MASS
from palpate.identification.options import Lag


def regression(seed, noise, count=400):
    """Two columns, each seen with noise of its own; one answer."""
    rng = np.random.default_rng(seed)
    clean = np.column_stack([np.sin(np.arange(count) / 9), np.cos(np.arange(count) / 23)])
    target = clean @ [3.0, -2.0] + rng.normal(0, 0.05, count)
    return clean + rng.normal(0, noise, clean.shape), target


def solved(columns, target, noise, weight=(0.0, 0.0)):
    """Least squares and their compensation, for columns with white noise of their own."""
    theta = np.linalg.lstsq(columns, target, rcond=None)[0]
    spread = noise**2 * np.eye(2)
    return theta, compensation(columns, np.eye(2), theta, spread, np.array(weight))


def test_the_answer_is_the_one_of_corrected_normal_equations():
    """(Phi' Phi - n S)^-1 Phi' f, solved by hand."""
    columns, target = regression(0, 0.3)
    theta, found = solved(columns, target, 0.3)
    corrected = columns.T @ columns - len(columns) * 0.09 * np.eye(2)
    np.testing.assert_allclose(theta + found.step, np.linalg.solve(corrected, columns.T @ target), rtol=1e-10)
    np.testing.assert_allclose(found.less, len(columns) * 0.09 * np.eye(2), rtol=1e-10, atol=1e-9)


def test_least_squares_are_pulled_towards_zero_and_the_compensated_are_not():
    pulled, mended = [], []
    for seed in range(200):
        theta, found = solved(*regression(seed, 0.3), 0.3)
        pulled.append(theta)
        mended.append(theta + found.step)
    mean, error = np.mean(mended, axis=0), np.std(mended, axis=0) / np.sqrt(200)
    assert (np.abs(mean - [3.0, -2.0]) < 4 * error).all()
    assert (np.abs(np.mean(pulled, axis=0)) < 0.9 * np.array([3.0, 2.0])).all()


def test_the_doubt_is_what_a_wrong_power_of_the_noise_does():
    """Of one column: the change of the step by its derivative, for a power that is off by three tenths."""
    rng = np.random.default_rng(5)
    clean = np.sin(np.arange(4000) / 9)[:, None]
    columns = clean + rng.normal(0, 0.4, clean.shape)
    theta = np.linalg.lstsq(columns, clean[:, 0] * 3.0, rcond=None)[0]

    def step(power):
        return compensation(columns, np.eye(1), theta, power * np.eye(1), np.zeros(1))

    slope = (step(0.1601).step - step(0.1599).step)[0] / 0.0002
    assert np.sqrt(step(0.16).doubt[0, 0]) == pytest.approx(0.3 * 0.16 * slope, rel=1e-4)


def test_without_noise_nothing_is_done():
    columns, target = regression(1, 0.0)
    _, found = solved(columns, target, 0.0)
    for part in (found.step, found.less, found.doubt):
        np.testing.assert_array_equal(part, 0.0)


@pytest.mark.parametrize("times", [1.5, 10.0, 1e4])
def test_noise_larger_than_all_there_is_does_not_turn_the_answer_round(times):
    """A tenth of the information stays; the answer is said to be open by more than itself."""
    columns, target = regression(2, 0.0)
    noise = times * float(np.sqrt((columns**2).mean()))
    theta, found = solved(columns, target, noise)
    gram = columns.T @ columns
    left = np.linalg.eigvalsh(np.linalg.solve(gram, gram - found.less))
    assert left.min() == pytest.approx(0.1, rel=1e-6)
    assert (np.abs(theta + found.step) <= 10.001 * np.linalg.norm(theta)).all()
    assert (np.sqrt(np.diag(found.doubt)) > 3 * np.abs(theta + found.step)).any()


def test_what_is_known_beforehand_is_not_pulled():
    columns, target = regression(3, 0.3)
    theta, free = solved(columns, target, 0.3)
    _, held = solved(columns, target, 0.3, weight=(1e12, 0.0))
    assert abs(free.step[0]) > 0.1
    assert abs(held.step[0]) < 1e-6
    assert np.isfinite(theta + held.step).all()


def test_columns_of_very_different_size_are_taken_as_they_are():
    columns, target = regression(4, 0.3)
    theta, found = solved(columns, target, 0.3)
    scale = np.array([1e-6, 1e5])
    spread = 0.09 * np.diag(scale**2)
    scaled = compensation(columns * scale, np.eye(2), theta / scale, spread, np.zeros(2))
    np.testing.assert_allclose(scaled.step * scale, found.step, rtol=1e-8)
    np.testing.assert_allclose(scaled.doubt * np.outer(scale, scale), found.doubt, rtol=1e-8)


def fits(log):
    """As the identification fits it, and as if the position were exact."""
    asked = problem(log.record, log.lag, force_filter=log.low_pass)
    return [
        fit(KELVIN_VOIGT_MASS, motion, asked.force, Lag(log.lag))
        for motion in (asked.motion, replace(asked.motion, noise=NOISELESS))
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    ("noise", "resolution"), [(1.5e-5, 0.0), (0.0, 4e-5)], ids=["noisy", "through a coarse encoder"]
)
def test_a_press_with_a_noisy_position(noise, resolution):
    """Over some presses the mass is pulled by many deviations; compensated, all stay within their intervals.

    What is left is an error of the noise's measured power, the same in all presses: it does not average out.
    """
    count = 16
    pairs = [fits(sensor_log("chirp", seed, noise, resolution=resolution)) for seed in range(count)]
    for name in ("B", "M"):
        errors = np.array([[fitted[name] - TRUTH[name] for fitted in pair] for pair in pairs])
        stated = np.array([[fitted.std(name) for fitted in pair] for pair in pairs])
        mended, pulled = (errors / stated).T
        # 95 % of intervals, of which 16 fall short by two at most in all but one case in twenty.
        assert np.sum(np.abs(mended) > 1.96) <= 2, name
        if name == "M":
            assert abs(pulled.mean()) > 5, name


def test_intervals_are_wider_for_the_noise_that_was_taken_out():
    exact, noisy = (fits(sensor_log("chirp", 3, noise))[0] for noise in (0.0, 1.5e-5))
    assert noisy.std("M") > 1.2 * exact.std("M")


def test_a_resting_position_errs_by_the_same_everywhere():
    """Two rests of many samples: their means stay uncertain by a count's error each, however long they last."""
    for length in (50, 5000):
        position = np.repeat([0.0, 1e-3], length)
        columns = np.column_stack([position, np.ones_like(position)])
        inverse = np.linalg.inv(columns.T @ columns)
        found = inverse @ resting(columns, position, 4e-6, 2e4) @ inverse
        # K (x2 - x1) = f2 - f1, and two encoders' errors of 4 um / sqrt(12) at either end.
        assert np.sqrt(found[0, 0]) == pytest.approx(2e4 * 4e-6 / np.sqrt(12) * 2 / 1e-3, rel=1e-9)


def test_a_moving_position_errs_anew_in_each_count():
    position = np.linspace(0, 1e-3, 250 * 40, endpoint=False)
    columns = np.ones((len(position), 1))
    found = resting(columns, position, 4e-6, 2e4)[0, 0] / len(position) ** 2
    assert found == pytest.approx(2 * (2e4 * 4e-6) ** 2 / 12 / 250, rel=0.01)
    assert (resting(columns, position, 0.0, 2e4) == 0).all()
