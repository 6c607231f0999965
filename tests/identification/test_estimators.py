"""Least squares under coloured noise."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.identification.least_squares import covariance, noise_of


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
