from __future__ import annotations

import numpy as np
import pytest

from identification.questions import question
from identification.synthetic_contacts import pressed
from palpate.identification.estimators.fit import fit, part_of
from palpate.identification.held_out import foretold, held_out
from palpate.identification.models import KELVIN_VOIGT, standard_linear_solid


def test_rows_left_out_are_predicted_by_the_others():
    asked = question(pressed())
    fitted = fit(KELVIN_VOIGT, asked.motion, asked.force, asked.lag)
    missed = held_out(fitted, asked.motion)
    count = len(missed)
    fold = (np.arange(count) * 20 // count) % 5
    columns = np.column_stack(KELVIN_VOIGT.columns(asked.motion, {}, 0.0))
    for k in range(5):
        others = part_of(fitted, asked.motion, asked.force, fold != k)[0]
        expected = asked.force[fold == k] - columns[fold == k] @ others.theta
        assert missed[fold == k] == pytest.approx(expected, abs=1e-9)


def test_what_was_not_fitted_is_missed_by_more():
    asked = question(pressed())
    for model in (KELVIN_VOIGT, standard_linear_solid(asked.motion)):
        fitted = fit(model, asked.motion, asked.force, asked.lag)
        assert np.sqrt(np.mean(held_out(fitted, asked.motion) ** 2)) > fitted.rmse


def test_loading_foretells_the_rest_of_a_plain_contact():
    asked = question(pressed(noise=0.01))
    fitted = fit(KELVIN_VOIGT, asked.motion, asked.force, asked.lag)
    missed = foretold(fitted, asked.motion, asked.force)
    speed = asked.motion.moved(1, 0.0)
    assert np.all(missed[speed > 0.06 * speed.max()] == 0)
    rest = missed[speed < 0]
    assert 0 < np.sqrt(np.mean(rest**2)) < 20 * fitted.rmse
    assert np.sqrt(np.mean(rest**2)) < 0.02 * asked.force.max()
