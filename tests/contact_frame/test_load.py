"""Weight and bias of a force sensor, by least squares over orientations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.contact_frame.load import fit_load, fit_load_robustly, turns

WEIGHT, BIAS = np.array([0.3, -0.2, 9.0]), np.array([2.0, -1.0, 4.0])


def shown(turn: Rotation, noise: float, rng) -> np.ndarray:
    return turn.inv().apply(WEIGHT) + BIAS + rng.normal(0, noise, (len(turn), 3))


def wobbling(angle: float, n: int, rng) -> Rotation:
    return Rotation.from_rotvec(rng.normal(0, angle, (n, 3))) * Rotation.from_rotvec([0.4, 1.0, -0.3])


def test_it_is_the_least_squares_of_the_plain_equations():
    rng = np.random.default_rng(0)
    turn = wobbling(0.5, 400, rng)
    force = shown(turn, 0.3, rng)
    matrices = turn.as_matrix()
    rows = np.concatenate([np.hstack([m.T, np.eye(3)]) for m in matrices])
    plain = np.linalg.lstsq(rows, force.ravel(), rcond=None)[0]
    load = fit_load(force, matrices, weighs=True)
    np.testing.assert_allclose(np.r_[load.weight, load.bias], plain, atol=1e-9)
    assert load.separable


def test_the_weight_is_as_far_off_as_it_says():
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(60):
        turn = wobbling(0.3, 500, rng)
        load = fit_load(shown(turn, 0.5, rng), turn.as_matrix(), weighs=True)
        ratios += list((load.weight - WEIGHT) / load.weight_std)
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.2  # the std is that of the worst told axis


def test_a_tool_that_keeps_still_tells_the_sum():
    rng = np.random.default_rng(2)
    turn = wobbling(0.0, 300, rng)
    load = fit_load(shown(turn, 0.0, rng), turn.as_matrix(), weighs=True)
    assert not turns(turn.as_matrix())
    assert not load.separable
    np.testing.assert_allclose(load.weight, 0.0, atol=1e-9)
    np.testing.assert_allclose(load.bias, turn[0].inv().apply(WEIGHT) + BIAS, atol=1e-9)


def test_a_tool_that_turns_about_one_axis_tells_what_lies_across_it():
    """Along the axis the weight does not change in the sensor, and stands in the bias: the sum is right there."""
    rng = np.random.default_rng(3)
    turn = Rotation.from_rotvec(np.outer(rng.uniform(-1, 1, 300), [0.0, 0.0, 1.0]))
    load = fit_load(shown(turn, 0.0, rng), turn.as_matrix(), weighs=True)
    assert not load.separable
    np.testing.assert_allclose(load.weight, [WEIGHT[0], WEIGHT[1], 0.0], atol=1e-9)
    np.testing.assert_allclose(load.bias, BIAS + np.array([0, 0, WEIGHT[2]]), atol=1e-9)
    np.testing.assert_allclose(load.taken_off(shown(turn, 0.0, rng), turn.as_matrix()), 0.0, atol=1e-9)


def test_rows_in_contact_do_not_pull_it():
    rng = np.random.default_rng(4)
    turn = wobbling(0.5, 600, rng)
    force = shown(turn, 0.05, rng)
    force[200:400] += [0.0, 0.0, 30.0]
    load = fit_load_robustly(force, turn.as_matrix(), weighs=True)
    np.testing.assert_allclose(load.weight, WEIGHT, atol=0.05)
    assert np.abs(fit_load(force, turn.as_matrix(), weighs=True).bias - BIAS).max() > 1


def test_a_compensated_sensor_has_no_weight():
    rng = np.random.default_rng(5)
    turn = wobbling(0.5, 300, rng)
    load = fit_load(BIAS + rng.normal(0, 0.01, (300, 3)), turn.as_matrix(), weighs=False)
    assert load.weight == pytest.approx(np.zeros(3))
    assert load.bias == pytest.approx(BIAS, abs=0.01)
