"""Norms in which matrices contract: Lyapunov's equation against SciPy, interior-point steps against differences."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from palpate.force.lyapunov import common, single, weight_of

N = 5


@pytest.fixture
def stable():
    rng = np.random.default_rng(3)
    Phi = rng.standard_normal((3, N, N))
    return 0.3 * Phi / np.linalg.norm(Phi, 2, axis=(1, 2))[:, None, None] + 0.6 * np.diag(
        np.linspace(-1.0, 1.0, N)
    )


def norm_in(L, Phi):
    return float(np.linalg.norm(L.T @ Phi @ np.linalg.inv(L.T), 2))


def test_a_weighted_norm_is_the_answer_of_lyapunovs_equation(stable):
    Phi, W = stable[0], np.diag(np.arange(1.0, N + 1.0))
    rate = 0.5 * (1.0 + np.abs(np.linalg.eigvals(Phi)).max())
    L = single(Phi, W)
    np.testing.assert_allclose(L @ L.T, solve_discrete_lyapunov((Phi / rate).T, W), rtol=1e-10)


def test_the_weight_of_a_norm_has_that_norm_for_an_answer(stable):
    L = common(stable, stable.mean(axis=0))
    assert L is not None
    assert max(norm_in(L, Phi) for Phi in stable) < 1.0
    again = single(stable[0], weight_of(L, stable[0]))
    np.testing.assert_allclose(again, L, rtol=1e-8, atol=1e-12)


def test_what_is_not_stable_has_no_norm(stable):
    assert single(3.0 * stable[0]) is None
    assert common([stable[0], 3.0 * stable[1]], stable[0]) is None
