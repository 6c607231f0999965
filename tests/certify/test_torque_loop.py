"""A torque arm between ticks: against its differential equation, in exact arithmetic, and how its loop bends."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from palpate.certify.discrete_loop import growth, prove, stable_ranges
from palpate.certify.force_certificate import ONE, Ball, exponential
from palpate.certify.torque_loop import TorqueSpringLoop


@given(
    st.floats(10.0, 1e6), st.floats(0.5, 20.0), st.integers(0, 3), st.floats(0.0, 0.99), st.integers(0, 99)
)
@settings(max_examples=30)
def test_a_torque_arm_moves_as_its_differential_equation(stiffness, mass, whole, part, seed):
    h = 1e-3
    loop = TorqueSpringLoop((500.0, 30.0), mass, h, whole, part)
    state = np.random.default_rng(seed).normal(size=whole + 3)
    (A,) = loop.matrices(np.array([stiffness]))
    forces = [-500.0 * state[0] - 30.0 * state[1], *state[2:]]
    swing = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, 0.0, 1.0 / mass], [0.0, 0.0, 0.0]])
    x = np.array([*state[:2], forces[whole + 1]])
    x = expm(swing * h * part) @ x
    x[2] = forces[whole]
    x = expm(swing * h * (1.0 - part)) @ x
    scale = np.abs(A[:2] @ np.diag(np.abs(state))).sum(axis=1) + 1e-12
    assert A[:2] @ state == pytest.approx(x[:2], abs=1e-9 * scale.max())
    assert (A[2:] @ state).tolist() == pytest.approx(forces[:-1])


@pytest.mark.parametrize("stiffness", [1, 1000, 4 * 10**5])
@pytest.mark.parametrize("part", [0.0, 0.25, 0.7])
def test_the_fractions_are_those_of_an_exponential_with_bounds(stiffness, part):
    loop = TorqueSpringLoop((0.0, 0.0), 2.0, 2.0**-9, 0, part)
    A = loop.exact_matrix(Fraction(stiffness))
    flow = [
        [Fraction(0), Fraction(1), Fraction(0)],
        [Fraction(-stiffness, 2), Fraction(0), Fraction(1, 2)],
        [Fraction(0)] * 3,
    ]
    whole, rest = (
        exponential(Ball.of([[value * Fraction(time) for value in row] for row in flow]))
        for time in (2.0**-9, 2.0**-9 * (1.0 - part))
    )
    expected = np.column_stack([whole.middle[:2, :2], whole.middle[:2, 2] - rest.middle[:2, 2]])
    for got, want in zip(A[:2].ravel(), expected.ravel(), strict=True):
        assert abs(got - Fraction(int(want), ONE)) <= Fraction(whole.error + rest.error + 2, ONE)


@given(
    st.floats(1.0, 1e6), st.floats(1.0001, 3.0), st.floats(0.3, 10.0), st.integers(0, 2), st.floats(0.0, 0.99)
)
@settings(max_examples=60)
def test_in_a_cell_the_loop_is_off_the_chord_by_less_than_the_bound(low, ratio, mass, whole, part):
    loop, high = TorqueSpringLoop((900.0, 40.0), mass, 2e-3, whole, part), low * ratio
    s = np.linspace(0.0, 1.0, 9)
    A = loop.matrices(low + s * (high - low))
    chord = (1.0 - s)[:, None, None] * A[0] + s[:, None, None] * A[-1]
    assert (abs(A - chord) <= loop.bend(low, high) + 1e-13 * abs(A).max()).all()


def test_the_bound_is_within_a_factor_of_two_on_soft_springs():
    loop = TorqueSpringLoop((0.0, 0.0), 1.0, 1e-3, 0, 0.0)
    A = loop.matrices(np.array([1e3, 2e3, 3e3]))
    off = abs(A[1] - 0.5 * (A[0] + A[2]))
    assert (loop.bend(1e3, 3e3)[:2, :2] < 2.0 * off[:2, :2]).all()


@pytest.mark.parametrize(("feedback", "whole", "part"), [((600.0, 60.0), 2, 0.0), ((200.0, 28.0), 0, 0.5)])
def test_a_proof_reaches_the_edge_and_no_further(feedback, whole, part):
    loop = TorqueSpringLoop(feedback, 3.0, 1e-3, whole, part)
    edge = min(stable_ranges(loop)[0][1], 2e5)
    low, high = prove([loop], 0.1 * edge, 0.99 * edge)
    assert high == 0.99 * edge
    assert growth(loop, np.geomspace(low, high, 2000)).max() < 1.0
    edge = stable_ranges(loop)[0][1]
    beyond = prove([loop], 0.9 * edge, 1.5 * edge)
    assert beyond is None or beyond[1] <= edge
    assert prove([loop], 1.001 * edge, 1.1 * edge) is None


def test_nothing_is_proved_of_springs_on_which_the_arm_swings_many_times_a_tick():
    assert prove([TorqueSpringLoop((0.0, 1.0), 1e-3, 0.1, 0, 0.0)], 1e6, 2e6) is None


@pytest.mark.parametrize("stiffness", [0.5, 1e5, 1e9])
def test_fractions_and_floats_agree_after_many_swings(stiffness):
    loop = TorqueSpringLoop((900.0, 40.0), 1.0, 1e-3, 1, 0.3)
    (A,) = loop.matrices(np.array([stiffness]))
    exact = loop.exact_matrix(Fraction(stiffness)).astype(float)
    assert np.abs(exact - A).max() < 1e-9 * np.abs(A).max()
