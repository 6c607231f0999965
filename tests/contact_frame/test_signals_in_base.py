"""Axes at the end of their range."""

from __future__ import annotations

import numpy as np

from palpate.contact_frame.signals_in_base import saturated_rows

TIME = np.arange(1000) / 1000
PLACE = np.column_stack([0 * TIME, 0 * TIME, np.sin(4 * TIME)])
ALL = np.ones(1000, bool)


def force(limit=np.inf):
    rng = np.random.default_rng(0)
    axis = np.minimum(20 * np.sin(4 * TIME) + rng.normal(0, 0.1, 1000), limit)
    return np.column_stack([rng.normal(0, 0.1, 1000), axis, 0 * TIME])


def test_an_axis_at_its_limit_is_found():
    stuck, at_limit = saturated_rows(force(15.0), PLACE, ALL), force()[:, 1] >= 15.0
    assert not stuck[~at_limit].any()
    assert (stuck == at_limit).mean() > 0.99  # a single row there may be a reading


def test_a_tool_that_rests_is_not_at_its_limit():
    held = force(15.0)
    assert not saturated_rows(held, 0 * PLACE, ALL).any()


def test_what_rounds_in_an_axis_without_noise_is_no_limit():
    still = force()
    still[:, 0] = -0.5
    still[:100, 0] += np.linspace(1e-14, 0.0, 100)
    assert not saturated_rows(still, PLACE, ALL).any()


def test_the_air_is_no_limit():
    """A simulated force is exactly constant in free motion."""
    quiet = np.maximum(force(), 2.0)
    assert saturated_rows(quiet, PLACE, ALL).any()
    assert not saturated_rows(quiet, PLACE, quiet[:, 1] > 2.0).any()
