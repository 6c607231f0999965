"""Since when there is contact: lines through the readings from several starts back."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.force.contact_evidence import EMPTY, NO_STARTS, explained_variance, later, latest

NEVER = 1e12
"""Readings in free motion without end: its mean is exact."""


def told(force, step=1e-5, every=8.0):
    starts = NO_STARTS
    for k, f in enumerate(force):
        starts = later(starts, every, step * k, float(f))
    return starts


def test_a_line_is_least_squares_with_neither_slope_nor_step_below_nothing():
    x, f = 1e-5 * np.arange(30), np.random.default_rng(0).normal(size=30) + 0.1 * np.arange(30) + 3.0
    line = EMPTY
    for a, b in zip(x, f, strict=True):
        line = line.with_reading(float(a), float(b))
    slope, level = np.polyfit(x, f, 1)
    assert line.solution()[0] == pytest.approx(slope)
    assert line.solution()[1] == pytest.approx(level)
    assert line.solution()[2] == pytest.approx(float((np.polyval([slope, level], x) * f).sum()))
    falling = EMPTY
    for a, b in zip(x, f[::-1], strict=True):
        falling = falling.with_reading(float(a), float(b))
    assert falling.solution()[:2] == (0.0, pytest.approx(float(f.mean())))


@pytest.mark.parametrize("age", [20, 60, 150, 400])
def test_little_is_lost_whenever_the_contact_began(age):
    ramp = np.maximum(np.arange(700) - (700 - age), 0.0)
    starts = told(ramp)
    assert explained_variance(starts, NEVER) > 7.0 / 8.0 * float(
        ramp @ ramp
    )  # an eighth, where starts are twice as far apart


def test_the_latest_start_is_not_too_flat():
    rng, slopes = np.random.default_rng(1), []
    for age in range(40, 300, 10):
        ramp = np.maximum(np.arange(700) - (700.0 - age), 0.0) / age * 4.0 * np.sqrt(30.0 / age)
        starts = told(ramp + rng.normal(size=700))
        line = latest(starts, NEVER, explained_variance(starts, NEVER) - 1.0)
        slopes.append(line.solution()[0] / (ramp[-1] - ramp[-2]) * 1e-5)
    assert np.median(slopes) > 0.95  # in half of the touches at least as stiff as it is
    assert min(slopes) > 0.4


def test_a_tip_that_stands_has_no_slope():
    starts = told(np.ones(100), step=0.0)
    assert latest(starts, NEVER, 0.0).solution()[:2] == (0.0, pytest.approx(1.0))


def test_a_mean_of_few_readings_shows_no_contact():
    """The error of the mean in free motion is in every reading since: as large as it is, it stays below an alarm."""
    rng, behind, shown = np.random.default_rng(2), 100, []
    for _ in range(300):
        rest = rng.normal(size=behind).mean()
        starts = told(rng.normal(size=300) - rest)
        shown.append((explained_variance(starts, behind), explained_variance(starts, NEVER)))
    honest, naive = np.quantile(shown, 0.99, axis=0)
    # Two degrees of freedom and six starts: chi square of 2 passes 16 in 0.03 %.
    assert honest < 16.0
    assert naive > 1.2 * honest
