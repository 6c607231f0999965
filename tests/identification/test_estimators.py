from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from identification.problems import problem
from identification.synthetic_contacts import pressed, shaken
from palpate.errors import InputError
from palpate.identification.estimators.methods import estimated_by
from palpate.identification.estimators.robust import answer
from palpate.identification.least_squares import covariance, noise_of
from palpate.identification.models import (
    KELVIN_VOIGT,
    KELVIN_VOIGT_MASS,
    hunt_crossley,
    standard_linear_solid,
)
from palpate.identification.options import LEAST_SQUARES, METHODS
from palpate.identification.sampling import channels_of

LOG = shaken(n=3000, noise=1e-3, position_noise=1e-4)
ASKED = problem(LOG, bonded=True, cutoff=60.0)


@cache
def by(method):
    return estimated_by(method, answer(ASKED, KELVIN_VOIGT_MASS), ASKED, channels_of(LOG))


@pytest.mark.parametrize("method", METHODS)
def test_noise_of_the_position_pulls_least_squares_alone(method):
    fitted = by(method)
    off = abs(fitted["M"] - 0.5) / 0.5
    if method == LEAST_SQUARES:
        assert off > 0.08
    else:
        assert abs(fitted["M"] - 0.5) < 3 * fitted.std("M")
    assert fitted["K"] == pytest.approx(5000, rel=0.02)
    assert fitted.r2 > 0.95


def test_the_answer_of_each_is_about_the_same_filtered_force():
    for method in METHODS:
        fitted = by(method)
        assert fitted.predicted + fitted.residuals == pytest.approx(ASKED.force)


@pytest.mark.parametrize(
    ("method", "model", "words"),
    [
        ("instrumental-variables", hunt_crossley, "cannot fit hunt-crossley"),
        ("output-error", lambda _: KELVIN_VOIGT, "kelvin-voigt has no mass"),
        ("output-error", standard_linear_solid, "has K1, tau, x0"),
    ],
)
def test_what_a_method_cannot_do(method, model, words):
    log = pressed()
    asked = problem(log)
    with pytest.raises(InputError, match=words) as caught:
        estimated_by(method, answer(asked, model(asked.motion)), asked, channels_of(log))
    assert "\n" not in str(caught.value)


def test_a_gap_longer_than_any_lag_that_is_looked_at_changes_nothing():
    rng = np.random.default_rng(5)
    columns, residuals = rng.standard_normal((600, 3)), rng.standard_normal(600)
    residuals[1:] += 0.8 * residuals[:-1]

    def found(gap):
        place = np.arange(600) + gap * (np.arange(600) >= 300)
        noise = noise_of(residuals, place, 3)
        return noise.effective, covariance(columns, place, noise)

    (one, first), (other, second) = found(25_000), found(400_000)
    assert one == pytest.approx(other, rel=1e-9)
    assert first == pytest.approx(second, rel=1e-9)
