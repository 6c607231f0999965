"""Schemes that the thesis names and does not run: each against a derivation of its own."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares
from palpate_checks import identifier_checks
from palpate_thesis.continuous_least_squares import ContinuousLeastSquares
from palpate_thesis.explanations import e7_continuous_least_squares as e7

START, PRIOR = (0.0, 0.0, 2e4), np.diag([1.0, 1e4, 1e8])


def shaken(tick, seconds=0.5):
    """Acceleration, rate and depth of two tones, and the force of a foam with a cubic spring in it."""
    t = np.arange(round(seconds / tick) + 1)[:, None] * tick
    w, size = 2 * np.pi * np.array([2.0, 11.0]), np.array([1e-3, 1e-4])
    a, v, x = (
        -(size * w**2 * np.sin(w * t)).sum(1),
        (size * w * np.cos(w * t)).sum(1),
        (size * np.sin(w * t)).sum(1),
    )
    return np.column_stack([a, v, x + 3e-3]), 0.1 * a + 200.0 * v + 5200.0 * x + 1e8 * x**3


def continuous(tick):
    identifier = ContinuousLeastSquares(START, PRIOR, tick, names=("M", "B", "K"))
    identifier.update_many(*shaken(tick, 0.42))
    return identifier


@pytest.mark.parametrize(
    "check", identifier_checks(lambda: ContinuousLeastSquares([0] * 3, 1e3 * PRIOR)), ids=str
)
def test_it_is_an_identifier_as_the_others(check):
    check()


@pytest.mark.parametrize("rate", [0.0, 3.0])
def test_it_solves_its_differential_equations(rate):
    """theta' = P phi e, P' = rate P - P phi (P phi)^T, by an integrator of variable step; phi in closed form."""
    from scipy.integrate import solve_ivp

    def flow(t, state):
        phi, f = (
            np.array([np.interp(t, grid, column) for column in signals.T]) for signals in (samples[0], force)
        )
        P = state[3:].reshape(3, 3)
        g = P @ phi
        return np.concatenate([g * (f[0] - phi @ state[:3]), (rate * P - np.outer(g, g)).ravel()])

    tick = 5e-3
    samples, force = shaken(tick, 0.1), shaken(tick, 0.1)[1][:, None]
    grid = tick * np.arange(len(force))
    start = np.concatenate([START, PRIOR.ravel()])
    solved = solve_ivp(flow, (0.0, grid[-1]), start, "LSODA", rtol=1e-9, atol=1e-9, max_step=tick / 4).y[
        :, -1
    ]
    identifier = ContinuousLeastSquares(START, PRIOR, tick, rate)
    identifier.update_many(*samples)
    exact = 1e-6 if rate == 0.0 else 1e-2  # what is forgotten within a tick is forgotten at its nodes
    assert identifier.theta == pytest.approx(solved[:3], rel=exact)
    assert identifier.covariance.ravel() == pytest.approx(solved[3:], rel=exact, abs=1e-6)


def test_it_is_the_limit_of_the_recursion():
    """Rectangles of a tenth of the width have a tenth of the error."""

    def apart(tick):
        recursive = RecursiveLeastSquares(START, tick * PRIOR)
        recursive.update_many(*shaken(tick, 0.42))
        return np.abs(recursive.theta - continuous(1e-4).theta)

    assert (apart(1e-4) < 0.2 * apart(1e-3)).all()


def test_explicit_steps_diverge_from_a_covariance_that_the_closed_form_bears():
    phi, _ = shaken(1e-3)
    force = phi @ np.array([0.1, 200.0, 5200.0])
    theta = e7.by_euler(phi, force, (1.0, 1e4, 1e8))[:, 2]
    assert np.isnan(theta[-1])
    assert np.isfinite(theta[0])
    assert e7.continuous(phi, force)[-1, 2] == pytest.approx(5200.0, rel=0.05)


def test_a_tick_that_is_none_is_refused():
    with pytest.raises(InputError, match="tick must be above 0"):
        ContinuousLeastSquares(START, PRIOR, 0.0)
