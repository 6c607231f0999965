"""What is proved of the thesis' linear laws: cells and their edges."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from stability import TICK, ForceLaw, command, curvature, edge, laws, prove
from stability import expm as exponential

HYBRID, RUBBER, NETWORK = laws()


@pytest.mark.parametrize("law", [HYBRID, NETWORK], ids=lambda law: law.name)
def test_within_a_cell_everything_contracts_also_while_stiffness_and_gain_change(law):
    cells = prove(law, 200.0, 4e3, 6e3)
    assert (cells[0].low, cells[-1].high) == (4e3, 6e3)
    rng = np.random.default_rng(0)
    for cell in cells:
        state = rng.normal(size=len(cell.norm))
        for _ in range(50):
            K, ki = rng.uniform(cell.low, cell.high), rng.uniform(*law.ki)
            (Phi,) = law.loop(200.0, ki).ticks(np.array([K]))
            after = Phi @ state
            assert np.linalg.norm(cell.norm.T @ after) < np.linalg.norm(cell.norm.T @ state)
            state = after


def test_the_edge_is_where_an_eigenvalue_leaves_the_circle_and_nothing_is_proved_beyond():
    end = edge(RUBBER, 200.0)
    loop = RUBBER.loop(200.0, RUBBER.ki[1])
    below, above = loop.radius(np.array([0.999 * end, 1.001 * end]))
    assert below < 1.0 < above
    assert prove(RUBBER, 200.0, 0.99 * end, 1.001 * end)[-1].high < end
    assert prove(RUBBER, 200.0, 1.01 * end, 1.1 * end) == []
    assert edge(ForceLaw("much too high", 0.0, (0.3, 0.3), 10.0), 60.0) == 0.0


def test_an_exponential_is_as_near_to_its_ends_as_the_bound_says():
    low, high = 5e3, 6e3
    ends = [exponential(TICK * A) for A in HYBRID.loop(200.0, 0.0).rates(np.array([low, high]))]
    bound = curvature(HYBRID, 200.0, low, high)
    for share in (0.2, 0.5, 0.8):
        (A,) = HYBRID.loop(200.0, 0.0).rates(np.array([low + share * (high - low)]))
        off = np.abs(exponential(TICK * A) - (1.0 - share) * ends[0] - share * ends[1])[:5]
        assert (off <= bound + 1e-15).all()
        assert off[1, 0] > 0.1 * bound[1, 0]


def test_the_command_is_that_of_the_tick():
    loop, K = HYBRID.loop(200.0, 0.003), np.array([2e4])
    (Phi,), (A, b, _) = loop.ticks(K), loop.zero_order_hold(K)
    top = np.outer(b[0], command(loop))
    top[:, :5] += A[0]
    np.testing.assert_allclose(Phi[:5], top, atol=1e-12)
