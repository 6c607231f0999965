from __future__ import annotations

import pytest

from identification.questions import question
from identification.synthetic_contacts import pressed, shaken
from palpate.errors import InputError
from palpate.identification.choosing import choose
from palpate.identification.estimators.methods import LEAST_SQUARES, METHODS, estimated_by

LOG = shaken(n=3000, noise=1e-3, position_noise=1e-4)
CHOSEN = choose(question(LOG, bonded=True, cutoff=60.0), "kelvin-voigt-mass").candidate


@pytest.mark.parametrize("method", METHODS)
def test_noise_of_the_position_pulls_least_squares_alone(method):
    fitted = estimated_by(method, CHOSEN, LOG["force"]).fit
    off = abs(fitted["M"] - 0.5) / 0.5
    if method == LEAST_SQUARES:
        assert off > 0.08
    else:
        assert abs(fitted["M"] - 0.5) < 3 * fitted.std("M")
    assert fitted["K"] == pytest.approx(5000, rel=0.02)
    assert fitted.r2 > 0.95


def test_the_answer_of_each_is_about_the_same_filtered_force():
    for method in METHODS:
        fitted = estimated_by(method, CHOSEN, LOG["force"]).fit
        assert fitted.predicted + fitted.residuals == pytest.approx(CHOSEN.question.force)
        assert fitted.rmse >= CHOSEN.fit.rmse  # least squares has the least there is


@pytest.mark.parametrize(
    ("method", "model", "words"),
    [
        ("guessing", "kelvin-voigt", "unknown method 'guessing'"),
        ("instrumental-variables", "hunt-crossley", "cannot fit hunt-crossley"),
        ("output-error", "kelvin-voigt", "kelvin-voigt has no mass"),
        ("output-error", "standard-linear-solid", "has K1, tau, x0"),
    ],
)
def test_what_a_method_cannot_do(method, model, words):
    log = pressed()
    candidate = choose(question(log), model).candidate
    with pytest.raises(InputError, match=words) as caught:
        estimated_by(method, candidate, log["force"])
    assert "\n" not in str(caught.value)
