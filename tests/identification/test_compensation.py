"""Noise of the position makes least squares' columns uncertain: its pull is taken out, what is left is said."""

import numpy as np
import pytest

from identification.sensor_logs import TRUTH, sensor_log
from palpate.identification.beforehand import Lag
from palpate.identification.compensation import compensation
from palpate.identification.fitting import fit
from palpate.identification.matching import matched_question, samples_of
from palpate.identification.models import KELVIN_VOIGT_MASS, without_noise
from palpate.identification.preparing import filter_and_contacts
from palpate.identification.timebase import channels_of, held_force


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
    # The doubt covers a wrong power of the noise by a third, not chance: a third of the step.
    np.testing.assert_allclose(found.doubt, 0.3 * np.abs(found.step), rtol=1e-12)


def test_without_noise_nothing_is_done():
    columns, target = regression(1, 0.0)
    _, found = solved(columns, target, 0.0)
    for part in (found.step, found.less, found.doubt):
        np.testing.assert_array_equal(part, 0.0)


@pytest.mark.parametrize("times", [1.5, 10.0, 1e4])
def test_noise_larger_than_all_there_is_does_not_turn_the_answer_round(times):
    """A tenth of the information stays; all that the rest may have done is said to be open."""
    columns, target = regression(2, 0.0)
    noise = times * float(np.sqrt((columns**2).mean()))
    theta, found = solved(columns, target, noise)
    gram = columns.T @ columns
    left = np.linalg.eigvalsh(np.linalg.solve(gram, gram - found.less))
    assert left.min() == pytest.approx(0.1, rel=1e-6)
    assert (np.abs(theta + found.step) <= 10.001 * np.linalg.norm(theta)).all()
    assert (found.doubt > 0.3 * np.abs(found.step)).any()


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
    np.testing.assert_allclose(scaled.doubt * scale, found.doubt, rtol=1e-8)


def fits(log):
    """As the identification fits it, and as if the position were exact."""
    channels = channels_of(log.record)
    samples = samples_of(channels, held_force(log.record, channels), log.low_pass)
    coarse, chain, contacts = filter_and_contacts(channels, None, None)
    asked = matched_question(samples, contacts, chain, coarse, Lag(log.lag), 0.25)
    return [
        fit(KELVIN_VOIGT_MASS, motion, asked.force, asked.lag)
        for motion in (asked.motion, without_noise(asked.motion))
    ]


@pytest.mark.parametrize(
    ("noise", "resolution"), [(1.5e-5, 0.0), (0.0, 4e-5)], ids=["noisy", "through a coarse encoder"]
)
def test_a_press_with_a_noisy_position(noise, resolution):
    """Over some presses the mass is pulled by many deviations; compensated, by none that chance does not explain."""
    count = 16
    pairs = [fits(sensor_log("chirp", seed, noise, resolution=resolution)) for seed in range(count)]
    for name in ("B", "M"):
        errors = np.array([[fitted[name] - TRUTH[name] for fitted in pair] for pair in pairs])
        stated = np.array([[fitted.std(name) for fitted in pair] for pair in pairs])
        mended, pulled = (errors / stated).T
        # Compensated: the mean of 16 numbers of deviation 1, at most; what the doubt adds makes them smaller.
        assert abs(mended.mean()) < 3 / np.sqrt(count), name
        assert np.sqrt(np.mean(mended**2)) < 1.5, name
        if name == "M":
            assert abs(pulled.mean()) > 5, name


def test_intervals_are_wider_for_the_noise_that_was_taken_out():
    exact, noisy = (fits(sensor_log("chirp", 3, noise))[0] for noise in (0.0, 1.5e-5))
    assert noisy.std("M") > 1.2 * exact.std("M")
    assert noisy.attenuation[noisy.names.index("M")] > 0
