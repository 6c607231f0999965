"""Where the loop is stable, over any number of the experiment."""

import numpy as np
import pytest

from analysis.worlds import surface
from palpate.bench.tables import with_values
from palpate.errors import InputError
from palpate.studies.analysis import linearise, sign_changes, stable_intervals, stable_stiffness

# Of a tip alone, y and phi left out, as a feasibility study had them [N/m].
ONE_DIRECTION = [(60.0, 1.0, 0.003, 12e3), (480.0, 0.25, 0.0015, 410e3)]


def test_sign_changes_are_found_between_the_steps():
    found = list(sign_changes(np.cos, 0.0, 10.0, log=False))
    assert found == pytest.approx([0.5 * np.pi, 1.5 * np.pi, 2.5 * np.pi], abs=1e-3)
    (root,) = sign_changes(lambda x: np.log(x / 300.0), 1.0, 1e4, steps=3, log=True)
    assert root == pytest.approx(300.0, rel=1e-4)
    assert not list(sign_changes(lambda x: np.nan if 4.0 < x < 6.0 else x - 5.0, 0.0, 10.0, log=False))


@pytest.mark.long
@pytest.mark.parametrize(("damping", "kf", "ki", "limit"), ONE_DIRECTION)
def test_the_limits_are_those_of_one_direction_but_for_what_the_others_do(damping, kf, ki, limit):
    """The arm's joints share their inertia, and 20 N on a moving lever are a spring: up to a fifth."""
    low, high = stable_stiffness(surface(0.9 * limit, damping, kf, ki), 0.7 * limit, 1.5 * limit)
    assert low == 0.7 * limit
    assert high == pytest.approx(limit, rel=0.21)


def test_the_boundary_is_where_the_growth_is_one():
    base = surface(1e4, 480.0, 1.0, 0.003)
    low, high = stable_stiffness(base, 5e4, 2e5, x=0.4688)
    assert low == 5e4
    for share in (0.999, 1.001):
        on = linearise(with_values(base, {"surface.stiffness": share * high}), x=0.4688)
        assert on.stable == (share < 1.0)


@pytest.mark.long
def test_intervals_of_a_gain():
    ((low, high),) = stable_intervals(surface(5e4, 480.0, 1.0, 0.003), "controller.kf", 0.0, 3.0)
    assert low == 0.0
    assert 1.0 < high < 3.0
    assert not linearise(surface(5e4, 480.0, 1.05 * high, 0.003)).stable


def test_what_has_no_interval_is_told():
    with pytest.raises(InputError, match="no stiffness from"):
        stable_stiffness(surface(1e4, 60.0, 1.0, 0.003), 1e5, 2e5)
    with pytest.raises(InputError, match="lower end first"):
        stable_intervals(surface(1e4, 60.0, 1.0, 0.003), "controller.kf", 2.0, 1.0)
    with pytest.raises(InputError, match="stiffnes"):
        stable_intervals(surface(1e4, 60.0, 1.0, 0.003), "surface.stiffnes", 1.0, 2.0)


@pytest.mark.long
def test_no_value_of_a_grid_is_on_the_wrong_side():
    base = surface(1e4, 480.0, 1.0, 0.003)
    found = stable_intervals(base, "controller.kf", 1.0, 4.0)
    for value in np.geomspace(1.0, 4.0, 7).tolist():
        told = any(a <= value <= b for a, b in found)
        assert linearise(with_values(base, {"controller.kf": value})).stable == told
