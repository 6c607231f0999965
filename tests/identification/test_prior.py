"""What is known before a log is fitted: observations beside the log's, of the mass and of the lag."""

from __future__ import annotations

import numpy as np
import pytest

from identification.problems import problem as question
from identification.synthetic_contacts import pressed, shaken
from palpate.errors import InputError
from palpate.identification import Verdict, identify
from palpate.identification.estimators.fit import fit
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS
from palpate.identification.options import LAG, NOTHING, Lag, Prior, prior_of

NAMES = ("K", "B", "M", "offset", LAG)
NOISE = 0.6


def test_a_mass_is_an_observation_as_far_off_as_its_deviation():
    """One row w M = w value, whose residual has the noise's own deviation: w = noise / std."""
    known = prior_of(Lag(mass=(0.3, 0.02)), NOISE, free_lag=False)
    rows, targets = known.rows(NAMES)
    np.testing.assert_allclose(rows, [[0, 0, NOISE / 0.02, 0, 0]], rtol=1e-12)
    np.testing.assert_allclose(targets, [0.3 * NOISE / 0.02], rtol=1e-12)
    np.testing.assert_allclose(known.std(NAMES, NOISE), [np.inf, np.inf, 0.02, np.inf, np.inf], rtol=1e-12)


def test_a_lag_is_one_where_the_log_is_asked_for_it():
    lag = Lag(3e-3, 2e-4, mass=(0.3, 0.02))
    rows, targets = prior_of(lag, NOISE, free_lag=True).rows(NAMES)
    by_name = dict(
        zip(np.array(NAMES)[rows.argmax(axis=1)], zip(rows.max(axis=1), targets, strict=True), strict=True)
    )
    assert by_name == {
        "M": (pytest.approx(NOISE / 0.02), pytest.approx(0.3 * NOISE / 0.02)),
        LAG: (pytest.approx(NOISE / 2e-4), pytest.approx(3e-3 * NOISE / 2e-4)),
    }
    assert np.count_nonzero(rows) == 2
    assert LAG not in prior_of(lag, NOISE, free_lag=False).known
    assert prior_of(Lag(3e-3), NOISE, free_lag=True) == NOTHING  # exact: there is nothing to ask


@pytest.mark.parametrize(("value", "std"), [(0.3, 0.3e-3), (0.0, 1e-9)])
def test_an_exact_mass_is_known_to_a_thousandth(value, std):
    """And one of 0 to a microgram: the weight of a deviation of 0 would be infinite."""
    assert prior_of(Lag(mass=(value, 0.0)), NOISE, False).std(("M",), NOISE) == pytest.approx([std])


def test_nothing_known_is_no_row():
    for known, names in ((NOTHING, NAMES), (Prior({"M": (0.3, 1.0)}), ("K", "B"))):
        rows, targets = known.rows(names)
        assert rows.shape == (0, len(names))
        assert targets.shape == (0,)
        assert known.std(names, NOISE) is None


@pytest.mark.parametrize("std", [1e-4, 3e-3, 0.1])
def test_the_fit_is_the_mean_that_bayes_gives(std):
    """(Phi'Phi / s^2 + P^-1) theta = Phi'f / s^2 + P^-1 prior, s^2 being what is left of the log by that theta."""
    asked = question(shaken(noise=2.0))
    prior = (0.53, std)
    fitted = fit(KELVIN_VOIGT_MASS, asked.motion, asked.force, Lag(mass=prior))
    columns = np.column_stack(KELVIN_VOIGT_MASS.columns(asked.motion, {}, 0.0))
    m = KELVIN_VOIGT_MASS.linear.index("M")
    gram, right = columns.T @ columns, columns.T @ asked.force
    theta = np.linalg.solve(gram, right)
    free = theta[m]
    for _ in range(20):
        variance = np.sum((asked.force - columns @ theta) ** 2) / (len(columns) - len(theta))
        inverse = np.zeros_like(gram)
        inverse[m, m] = 1 / std**2
        theta = np.linalg.solve(gram / variance + inverse, right / variance + inverse[:, m] * prior[0])
    # The fit looks at what is left twice, not twenty times; the normal equations lose half of the digits.
    np.testing.assert_allclose(fitted.theta[: len(theta)], theta, rtol=1e-4)
    assert min(free, prior[0]) - 1e-6 <= fitted["M"] <= max(free, prior[0]) + 1e-6


def test_an_exact_mass_leaves_the_rest_as_if_its_force_were_taken_off():
    asked = question(shaken(noise=1.0))
    fitted = fit(KELVIN_VOIGT_MASS, asked.motion, asked.force, Lag(mass=(0.4, 0.0)))
    inertia = 0.4 * asked.motion.filtered(asked.motion.position, 2, 0.0)
    rest = fit(KELVIN_VOIGT, asked.motion, asked.force - inertia, Lag())
    assert fitted["M"] == pytest.approx(0.4, abs=3 * 0.4e-3)
    # By what M may still move, a thousandth of its value, times what that moves the other by.
    moves = np.abs(fit(KELVIN_VOIGT, asked.motion, asked.force, Lag()).theta - rest.theta) / 0.4
    for name, by in zip(rest.names, moves, strict=True):
        if name != LAG:
            assert fitted[name] == pytest.approx(rest[name], abs=3 * 0.4e-3 * by + 1e-9), name
            assert fitted.std(name) == pytest.approx(rest.std(name), rel=0.02), name


def test_a_mass_so_vague_that_it_says_nothing_changes_nothing():
    asked = question(shaken())
    free, vague = (
        fit(KELVIN_VOIGT_MASS, asked.motion, asked.force, Lag(mass=mass)) for mass in (None, (7.0, 1e6))
    )
    np.testing.assert_allclose(vague.theta, free.theta, rtol=1e-6)
    np.testing.assert_allclose(vague.cov, free.cov, rtol=1e-4, atol=1e-12 * np.abs(free.cov).max())


def test_a_log_that_shows_no_mass_gives_back_what_was_known_of_it():
    """A slow press: M is the prior's, in value and deviation, and no more is claimed of it."""
    log = pressed(ramp=0.3, b=60.0, noise=0.3)
    found = identify(log, lag=0.0, model="kelvin-voigt-mass", mass=(0.3, 0.01)).parameters["M"]
    assert found.value == pytest.approx(0.3, abs=0.01)
    assert found.std == pytest.approx(0.01, rel=0.05)
    vague = identify(log, lag=0.0, model="kelvin-voigt-mass", mass=(0.3, 0.1)).parameters["M"]
    assert vague.verdict is Verdict.NOT_IDENTIFIABLE


@pytest.mark.parametrize(
    "mass", [(-0.5, 0.1), (0.5, -0.1), (np.nan, 0.1), (0.5, np.nan), (np.inf, 0.1), (0.5, np.inf)]
)
def test_a_mass_that_is_none_is_refused(mass):
    with pytest.raises(InputError, match="the mass and its std must be 0 or more, got") as caught:
        identify(shaken(n=2500), lag=0.0, mass=mass)
    assert "\n" not in str(caught.value)
