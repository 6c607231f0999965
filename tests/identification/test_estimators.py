"""The noise that residuals show."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.identification.least_squares import estimate_noise


def test_a_gap_longer_than_any_lag_that_is_looked_at_changes_nothing():
    rng = np.random.default_rng(5)
    residuals = rng.standard_normal(600)
    residuals[1:] += 0.8 * residuals[:-1]

    def found(gap):
        place = np.arange(600) + gap * (np.arange(600) >= 300)
        return estimate_noise(residuals, place, 3).effective

    assert found(25_000) == pytest.approx(found(400_000), rel=1e-9)
