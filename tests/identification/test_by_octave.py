"""Least squares weighted by octave: against sums by hand, and noise of each octave by what is left there."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.identification.octaves import (
    Segment,
    build_system,
    estimate,
    estimate_with_fixed,
    longest_length,
    solve,
    sum_octaves,
)

DT = 1e-2
ROWS = 2000
TRUTH = np.array([5.0, -2.0])


def coloured_columns(seed, count=2):
    """Columns with power at all frequencies, more of it at low ones, without a mean."""
    rng = np.random.default_rng(seed)
    own = rng.normal(size=(ROWS, count))
    return own + np.cumsum(rng.normal(size=(ROWS, count)), axis=0) / 10


def system(columns, force, names="KBM", prior=None):
    segments = [Segment(0, len(force))]
    octaves = sum_octaves(np.column_stack([columns, force]), segments, DT, longest_length(segments))
    return build_system(octaves, tuple(names[: columns.shape[1]]), prior or {})


def two_columns(seed=0, noise=0.5, extra=None):
    own = coloured_columns(seed)
    rng = np.random.default_rng([seed, 1])
    return own, own @ TRUTH + rng.normal(0, noise, ROWS) + (0.0 if extra is None else extra)


def level(own, noise=1.0):
    return np.full(len(own.lines), noise)


@pytest.mark.parametrize("last", [1.0, 0.1])
def test_it_is_weighted_least_squares(last):
    """Over lines, summed by hand; but for the weak prior that no term is many times the force."""
    own, force = two_columns()
    asked = system(own, force)
    noise = np.geomspace(1.0, last, len(asked.lines))
    gram = sum(part[:2, :2] / s for part, s in zip(asked.products, noise, strict=True))
    right = sum(part[:2, 2] / s for part, s in zip(asked.products, noise, strict=True))
    found = solve(asked, noise)
    np.testing.assert_allclose(found.theta, np.linalg.solve(gram, right), rtol=1e-5)
    np.testing.assert_allclose(found.cov, np.linalg.inv(gram), rtol=1e-5)


def test_the_noise_of_each_octave_is_found():
    """Noise of one level below a frequency and another above."""
    from scipy.signal import butter, sosfiltfilt

    own = coloured_columns(3)
    white = np.random.default_rng(4).normal(size=ROWS)
    slow = sosfiltfilt(butter(6, 2.0, fs=1 / DT, output="sos"), white)
    force = own @ TRUTH + 3.0 * slow + np.random.default_rng(5).normal(0, 0.1, ROWS)
    segments = [Segment(0, ROWS)]
    octaves = sum_octaves(np.column_stack([own, force]), segments, DT, ROWS)
    found = estimate(build_system(octaves, ("K", "B"), {}))
    low = (octaves.all_lines >= 16) & (1.4 * octaves.frequency < 1.5)
    high = octaves.frequency / 1.4 > 3.5
    assert low.any()
    assert high.any()
    # An octave of 16 lines knows its level to a third; the window lets a hundredth of the power below through.
    assert found.noise[low] == pytest.approx(9.0, rel=0.9)
    assert found.noise[high] == pytest.approx(0.01, rel=0.5)
    # The quiet octaves tell the parameters.
    assert (np.abs(found.theta - TRUTH) < 4 * np.sqrt(np.diag(found.cov))).all()


def test_parameters_are_found_as_well_as_said():
    """White noise: 95 % within two deviations, of which 60 are judged; a binomial's four deviations less is 50."""
    inside = np.zeros(2)
    for seed in range(60):
        found = estimate(system(*two_columns(seed)))
        inside += np.abs(found.theta - TRUTH) < 1.96 * np.sqrt(np.diag(found.cov))
    assert inside.min() >= 50, inside


def test_a_direction_without_information_is_not_known():
    """Two columns that are one: what they do together is known, and each of them not at all."""
    for seed in range(20):
        own, force = two_columns(seed, noise=1e-6)
        size = float(np.random.default_rng(seed).uniform(0.1, 10))
        asked = system(np.column_stack([own[:, 0], size * own[:, 0]]), force)
        found = solve(asked, level(asked, 1e-12))
        std = np.sqrt(np.diag(found.cov))
        alone = system(own[:, :1], force)
        expected = solve(alone, level(alone, 1e-12)).theta[0]
        assert found.theta @ [1, size] == pytest.approx(expected, rel=1e-4)
        assert (std > 0.5 * np.abs(found.theta)).all()  # half-widths as large as the numbers themselves


def test_a_prior_is_an_observation_as_good_as_its_deviation():
    own, force = two_columns()
    free = system(own, force)
    alone = solve(free, level(free, 0.25))
    std = np.sqrt(alone.cov[0, 0])
    told = system(own, force, prior={"K": (4.0, std)})
    found = solve(told, level(told, 0.25))
    assert found.theta[0] == pytest.approx((alone.theta[0] + 4.0) / 2, rel=1e-5)
    assert found.cov[0, 0] == pytest.approx(std**2 / 2, rel=1e-4)


def test_a_parameter_that_is_held_leaves_the_others_as_if_its_force_were_taken_off():
    own, force = two_columns()
    found = estimate_with_fixed(system(own, force), {1: -1.5})
    alone = estimate(system(own[:, :1], force + 1.5 * own[:, 1]))
    # But for the weak prior, which goes with the power of the force.
    assert found.theta == pytest.approx([alone.theta[0], -1.5], rel=1e-4)
    assert found.noise == pytest.approx(alone.noise, rel=1e-4)
    assert found.cov == pytest.approx(np.diag([alone.cov[0, 0], 0.0]), rel=1e-4)
