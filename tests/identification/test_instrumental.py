from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identification.estimators.instrumental_variables import refined_instrumental
from palpate.identification.filters.state_variable import Chain

N = 2000
TIME = np.arange(N) / 1000
K, B, M = 5000.0, 40.0, 0.5


def steady(impedance, size=2e-3):
    """A sum of 25 sines of 0.5 to 40 Hz, and the force that answers it exactly: position [m], force [N]."""
    omega = 2 * np.pi * np.geomspace(0.5, 40, 25)
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, 25)
    turning = np.exp(1j * (omega * TIME[:, None] + phase)) * size / omega
    return turning.imag.sum(1), 10 + (turning * impedance(1j * omega)).imag.sum(1)


def oscillator(s):
    return M * s**2 + B * s + K


def solid(s, k=3000.0, b=20.0, k1=4000.0, tau=0.03):
    return k + b * s + k1 * tau * s / (1 + tau * s)


def least_squares(force, position, cutoff):
    chain = Chain(cutoff, 1e-3)
    columns = np.column_stack([*(chain(position, k) for k in range(3)), np.ones(N)])[300:]
    return np.linalg.lstsq(columns, chain(force)[300:])[0][:3]


@pytest.mark.long
def test_noise_of_the_position_pulls_least_squares_and_not_the_instruments():
    position, force = steady(oscillator)
    truth = np.array([K, B, M])
    refined, plain, inside = [], [], np.zeros(3)
    for seed in range(200):
        noisy = position + np.random.default_rng(seed).normal(0, 2.5e-4, N)  # under a motion of 0.7 mm rms
        found = refined_instrumental(TIME, force, noisy)
        assert found.names == ("K", "B", "M", "offset")
        refined.append(found.theta[:3])
        inside += np.abs(found.theta[:3] - truth) < 1.96 * found.std[:3]
        if seed < 50:
            plain.append(least_squares(force, noisy, 60.0))
    refined, plain = np.array(refined), np.array(plain)
    # The mean over 200 seeds is itself known to 0.07 of a standard deviation.
    assert np.all(np.abs(refined.mean(0) - truth) < refined.std(0) / 3)
    assert np.all(np.abs(plain.mean(0) - truth)[1:] > 10 * plain.std(0)[1:])
    assert np.all(inside >= 0.90 * 200), inside  # binomial: 95 % give 190, four deviations less 178


def test_without_noise_the_answer_is_exact():
    position, force = steady(oscillator)
    found = refined_instrumental(TIME, force, position)
    assert found.theta[:3] == pytest.approx(
        [K, B, M], rel=1e-3
    )  # what a straight line between readings costs


def test_a_contact_without_mass():
    position, force = steady(lambda s: B * s + K)
    noisy = position + np.random.default_rng(0).normal(0, 1e-4, N)
    found = refined_instrumental(TIME, force, noisy, model="kelvin-voigt")
    assert found.names == ("K", "B", "offset")
    assert np.all(np.abs(found.theta - [K, B, 10]) < 4 * found.std)
    assert np.all(found.std[:2] < [0.02 * K, 0.1 * B])


@pytest.mark.parametrize(
    ("noisy", "std"), [("position", 1e-4), pytest.param("force", 0.3, marks=pytest.mark.long)]
)
def test_a_standard_linear_solid_under_noise_of_either_channel(noisy, std):
    position, force = steady(solid)
    truth = np.array([3000, 20, 4000, 0.03])
    found = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0, std, N)
        channels = (force + noise, position) if noisy == "force" else (force, position + noise)
        found.append(refined_instrumental(TIME, *channels, model="standard-linear-solid", noisy=noisy))
    assert found[0].names == ("K", "B", "K1", "tau", "offset")
    theta, claimed = (np.array([getattr(e, what)[:4] for e in found]) for what in ("theta", "std"))
    spread = theta.std(0)
    assert np.all(np.abs(theta.mean(0) - truth) < 4 * spread / np.sqrt(40))
    assert np.all(np.abs(np.median(claimed, axis=0) / spread - 1) < 0.5)  # 40 seeds know a spread to 11 %


def test_what_the_log_does_not_carry_has_a_wide_interval():
    position, force = steady(lambda s: solid(s, tau=2.0))  # relaxes for longer than the log lasts
    noisy = position + np.random.default_rng(0).normal(0, 1e-4, N)
    found = refined_instrumental(TIME, force, noisy, model="standard-linear-solid")
    assert found.verdicts()["tau"] == "not identifiable"


def test_a_lag_that_is_known_is_taken_out():
    position, force = steady(oscillator)
    late = np.interp(TIME - 0.004, TIME, force)
    found = refined_instrumental(TIME, late, position, lag=0.004)
    assert found.theta[:3] == pytest.approx([K, B, M], rel=0.02)  # straight lines stand in for the late force
    assert refined_instrumental(TIME, late, position).theta[1] < 0.85 * B


def _broken(values):
    return np.where(np.arange(N) == 7, np.nan, values)


@pytest.mark.parametrize(
    ("change", "arguments", "words"),
    [
        (lambda t, f, x: (t, f, x), {"model": "hunt-crossley"}, "unknown model 'hunt-crossley'"),
        (lambda t, f, x: (t, f, x), {"noisy": "both"}, "unknown noisy channel 'both'"),
        (lambda t, f, x: (t**2, f, x), {}, "time must be evenly spaced"),
        (lambda t, f, x: (t, _broken(f), x), {}, "force has no reading in row 8"),
        (lambda t, f, x: (t[:20], f[:20], x[:20]), {}, "too few"),
        (lambda t, f, x: (t, f[1:], x), {}, r"one shape \(n,\)"),
    ],
)
def test_wrong_arguments(change, arguments, words):
    position, force = steady(oscillator)
    with pytest.raises(InputError, match=words) as caught:
        refined_instrumental(*change(TIME, force, position), **arguments)
    assert "\n" not in str(caught.value)
