"""Prior of the mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.problems import problem as question
from identification.synthetic_contacts import pressed, shaken
from palpate.errors import InputError
from palpate.identification import Verdict, identify
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS
from palpate.identification.options import Lag, mass_std
from palpate.identification.selection import answer


@pytest.mark.parametrize(("value", "std"), [(0.3, 0.3e-3), (0.0, 1e-9)])
def test_an_exact_mass_is_known_to_a_thousandth(value, std):
    """And one of 0 to a microgram: the weight of a deviation of 0 would be infinite."""
    assert mass_std((value, 0.0)) == pytest.approx(std)


def test_an_exact_mass_leaves_the_rest_as_if_its_force_were_taken_off():
    asked = question(shaken(noise=1.0))
    inertia = 0.4 * asked.motion.filtered(asked.motion.position, 2, 0.0)
    given = answer(replace(asked, lag=Lag(mass=(0.4, 0.0))), KELVIN_VOIGT_MASS)
    rest = answer(replace(asked, lag=Lag(), force=asked.force - inertia), KELVIN_VOIGT)
    assert given["M"] == pytest.approx(0.4, abs=3 * 0.4e-3)
    for name in ("K", "B"):
        assert given[name] == pytest.approx(rest[name], abs=0.1 * rest.half_of(name)), name
        assert given.half_of(name) < 1.1 * rest.half_of(name), name


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
