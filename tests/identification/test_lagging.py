from __future__ import annotations

import numpy as np
import pytest

from identification.questions import question
from identification.synthetic_contacts import pressed
from palpate.identification.estimators.fit import fit
from palpate.identification.lagging import flat_between
from palpate.identification.models import KELVIN_VOIGT
from palpate.identification.prior import Lag


def test_the_misfit_is_flat_where_it_is_said_to_be():
    asked = question(pressed(k=3000.0, b=60.0, lag=0.008, noise=0.3))
    low, high = flat_between(asked.motion, asked.force, 0.008, 0.002)
    assert low < 0.008 < high

    def misfit(lag):
        return fit(KELVIN_VOIGT, asked.motion, asked.force, Lag(lag)).rmse

    least = min(misfit(lag) for lag in np.linspace(low, high, 9))
    for end in (low, high):  # a parabola stands for the valley
        assert misfit(end) == pytest.approx(1.001 * least, rel=1e-4)
