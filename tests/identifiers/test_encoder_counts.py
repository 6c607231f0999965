"""A textbook spring and damper, read by an encoder: identified, and not refused for a reason that is none."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.identifiers import ContactIdentifier

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "online"))
from streams import stream


def found(made):
    one = ContactIdentifier(made.low_pass, 1000.0, made.lag, lag_std=made.lag_std, sampling=made.sampling)
    one.update_many(made.position, made.force)
    return one.estimate()


def assert_stiffness_within_bounds(estimate, made):
    low, high = made.truth["K"]
    half = 1.96 * float(estimate.std[2])
    assert low - 1.5 * half < estimate.theta[2] < high + 1.5 * half


@pytest.mark.parametrize("sensor", ["each tick", "480 Hz"])
@pytest.mark.parametrize("position", ["exact", "counts 2", "counts 10"])
@pytest.mark.parametrize("surface", ["spring-damper", "mass"])
def test_its_stiffness_is_known(surface, position, sensor):
    for seed in (5, 6):
        made = stream(seed, surface, position, sensor)
        estimate = found(made)
        assert not estimate.rejected
        assert estimate.verdicts()["K"] == "identified"
        assert_stiffness_within_bounds(estimate, made)


@pytest.mark.parametrize("sensor", ["each tick", "480 Hz"])
@pytest.mark.parametrize("surface", ["spring-damper", "mass"])
def test_white_noise_of_the_position_rejects_nothing_and_bounds_hold(surface, sensor):
    for seed in (5, 6):  # a motion that is small against the noise does not identify K
        made = stream(seed, surface, "white 3", sensor)
        estimate = found(made)
        assert not estimate.rejected
        assert_stiffness_within_bounds(estimate, made)


def test_a_change_of_the_surface_is_found_and_the_rest_identified():
    made = stream(903, "spring-damper", "counts 2", "each tick", changes=True)
    estimate = found(made)
    assert estimate.samples < 4000
    assert estimate.verdicts()["K"] == "identified"
    assert abs(estimate.theta[2] - made.truth["K"][0]) < 2 * 1.96 * estimate.std[2]


@pytest.mark.parametrize("surface", ["spring-damper", "curved", "relaxing", "rubbed"])
def test_no_change_is_found_on_a_surface_that_stays(surface):
    for seed in range(4):
        made = stream(40 + seed, surface, "counts 5", "each tick")
        assert found(made).samples > 5000


def test_a_motion_below_the_encoder_s_count_is_not_identified():
    made = stream(7, "spring-damper", "exact", "each tick")
    coarse = 2 * float(np.ptp(made.position))
    one = ContactIdentifier(made.low_pass, 1000.0, made.lag, touch=0.0)
    one.update_many(np.round(made.position / coarse) * coarse, made.force)
    assert "identified" not in one.estimate().verdicts().values()
