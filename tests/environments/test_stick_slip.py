"""Friction along the surface: within the cone, passive, sticky."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate._jit import kernel
from palpate.environments import StickSlip
from palpate.errors import InputError

DT = 50e-6
GRIP = StickSlip(5000.0, 20.0, 0.7)


@kernel
def drag(grip, rate, normal, dt, out):
    state = grip.start()
    for k in range(rate.size):
        out[k, 0], state = grip.slide(state, rate[k], normal[k], dt)
        out[k, 1] = grip.bending_energy(state)


def run(rate, normal, dt=DT, grip=GRIP, kernel=drag):
    out = np.empty((len(rate), 2))
    kernel(grip, np.asarray(rate, float), np.broadcast_to(float(normal), len(rate)).copy(), dt, out)
    return out.T


wild = st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-20.0, 60.0)), min_size=1, max_size=200)


@pytest.mark.long
@given(wild, st.sampled_from([DT, 1e-3, 0.1]), st.sampled_from([GRIP, StickSlip(5000.0, 0.0, 0.7)]))
@settings(max_examples=200)
def test_it_stays_in_the_cone_and_gives_back_no_more_than_it_took(samples, dt, grip):
    rate, normal = np.array(samples).T
    out = np.empty((rate.size, 2))
    drag(grip, rate, normal, dt, out)
    force, stored = out.T
    assert np.all(np.abs(force) <= 0.7 * np.maximum(normal, 0.0))
    taken = np.cumsum(-force * rate) * dt
    assert np.all(taken - stored >= -1e-12 * (1.0 + np.cumsum(np.abs(force * rate) * dt)))


def test_it_sticks_as_a_spring_anchored_where_it_touched():
    force, _ = run(np.full(200, 0.01), 100.0)
    moved = 0.01 * DT * np.arange(1, 201)
    np.testing.assert_allclose(force, -(5000.0 * moved + 20.0 * 0.01), rtol=1e-12)


def test_it_comes_back_to_where_it_stuck():
    there = np.full(200, 0.01)
    force, stored = run(np.concatenate((there, -there, np.zeros(1))), 100.0)
    assert force[-1] == pytest.approx(0.0, abs=1e-12)
    assert stored[-1] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("rate", [0.1, -0.1])
def test_sliding_it_pulls_back_with_the_limit(rate):
    force, _ = run(np.full(4000, rate), 10.0)
    assert force[-1] == pytest.approx(-7.0 * np.sign(rate), rel=1e-12)


def test_after_sliding_the_anchor_has_moved():
    force, stored = run(np.concatenate((np.full(4000, 0.1), np.zeros(10))), 10.0)
    # 20 mm of slide leave a bend of mu f_n/K, 1.4 mm.
    assert force[-1] == pytest.approx(-7.0, rel=1e-6)
    assert stored[-1] == pytest.approx(0.5 * 7.0**2 / 5000.0, rel=1e-6)


def test_without_pressure_there_is_no_grip():
    force, _ = run(np.full(10, 0.1), 0.0)
    np.testing.assert_array_equal(force, 0.0)
    force, _ = run(np.full(10, 0.1), -5.0)
    np.testing.assert_array_equal(force, 0.0)


def test_compiled_is_plain():
    rate = np.random.default_rng(0).normal(size=2000)
    np.testing.assert_array_equal(run(rate, 10.0), run(rate, 10.0, kernel=drag.plain))


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ((0, 1, 1), "tangential stiffness"),
        ((1, -1, 1), "tangential damping"),
        ((1, 1, -0.1), "friction coef"),
    ],
)
def test_bad_parameters_are_refused(parameters, words):
    with pytest.raises(InputError, match=words):
        StickSlip(*parameters)
