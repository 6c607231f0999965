from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.questions import question
from identification.synthetic_contacts import coloured, force_of, press_path, pressed, record
from palpate.identification import Verdict
from palpate.identification.choosing import choose
from palpate.identification.surface import correlation, surface

TIME = np.arange(6000) / 1000
PATH = press_path(TIME, 0.06)


def chosen(place, sign=1.0, noise=0.03):
    """A power-law contact whose surface is at `place` on the log's own scale."""
    force = force_of(PATH, lambda d, v: 3e6 * d**1.5 * (1 + 1.5 * v), 1e-3)
    noisy = force + coloured(len(force), noise, 0.9, np.random.default_rng(0))
    return choose(question(record(TIME, place + sign * PATH, noisy)), "hunt-crossley").candidate


@pytest.mark.parametrize(("place", "sign"), [(0.0, 1.0), (0.7, 1.0), (0.7, -1.0)])
def test_the_surface_is_found_on_the_logs_own_scale(place, sign):
    found = surface(chosen(place, sign), False, 0.25, "m")
    assert found.verdict is Verdict.IDENTIFIED
    assert found.value == pytest.approx(place, abs=3e-5)
    assert found.ci95[0] < place < found.ci95[1]
    assert "of the depth" in found.reason


def test_exponent_and_surface_are_told_together():
    candidate = chosen(0.0)
    assert correlation(candidate, "n", "x0") < -0.8
    assert "n and x0 are told together only" in surface(candidate, False, 0.25, "m").reason
    assert correlation(candidate, "n", "M") == 0.0


def test_a_place_that_is_not_told_is_not_given():
    candidate = chosen(0.0)
    wide = replace(candidate.fit, cov=candidate.fit.cov * 1e6)
    found = surface(replace(candidate, fit=wide), False, 0.25, "m")
    assert found.verdict is Verdict.NOT_IDENTIFIABLE
    assert found.value is None


def test_of_a_model_that_does_not_hold_it_is_rejected():
    found = surface(chosen(0.0), True, 0.25, "m")
    assert found.verdict is Verdict.REJECTED
    assert found.value == pytest.approx(0.0, abs=3e-5)


def test_a_plain_contact_has_none():
    assert surface(choose(question(pressed()), "kelvin-voigt").candidate, False, 0.25, "m") is None
