"""Section 7.1: answers of both methods with known values, and gains tuned on runs by which nothing is judged."""

import numpy as np
import pytest

from palpate.bench import with_values
from palpate_thesis.claims import plausible_laboratories
from palpate_thesis.figures import fig_7_01
from palpate_thesis.force_control import gain_sets
from palpate_thesis.force_control.tracking import Tracking, tracking
from palpate_thesis.laboratory import load_laboratory
from palpate_thesis.neural_identifier.network import Identified, NetworkPress, identified
from palpate_thesis.neural_identifier.side_by_side import Pair
from palpate_thesis.runs import Runs

TRUTH = np.array([6000.0, 200.0, 0.1])


def answer(K=6000.0, B=200.0, M=0.1, settled=0.1):
    return Identified(K, B, M, settled, settled, settled, 0.0, 6000.0, 200.0, TRUTH, 0.0)


def test_an_answer_is_the_mean_of_the_last_half_second():
    n = 4000
    K = np.where(np.arange(n) < 250, 3000.0, 6000.0)
    K[-500::2] += 60.0
    curve = np.column_stack([K, np.full(n, 200.0), np.full(n, -1.0)])
    zeros = np.zeros((n, 3))
    press = NetworkPress("foam", zeros, np.zeros(n), 6030.0, zeros, curve, TRUTH)
    given = identified(press, curve)
    assert pytest.approx(6030.0) == given.K
    assert given.over == pytest.approx(1.0)
    assert given.ripple == pytest.approx(30.0 / 6030.0)
    assert (given.settled_K, given.settled_B) == (pytest.approx(0.25), 0.0)
    assert given.realistic == (True, True, False)


@pytest.mark.parametrize(
    ("changes", "realistic"),
    [
        ({"K": 7000.0}, (False, True, True)),
        ({"B": 99.0}, (True, False, True)),
        ({"B": 401.0}, (True, False, True)),
        ({"M": -0.01}, (True, True, False)),
        ({"M": 1.5}, (True, True, False)),
    ],
)
def test_each_coefficient_has_its_own_limit(changes, realistic):
    assert answer(**changes).realistic == realistic


def test_a_method_that_is_faster_and_nearer_leaves_no_choice():
    quick, slow = answer(settled=0.1, M=-2.0), answer(settled=0.5, B=150.0, M=0.3)
    assert Pair(quick, slow).faster == (True, True, True)
    assert Pair(quick, slow).nearer == (False, True)
    assert not fig_7_01.dominates(Pair(quick, slow))
    assert fig_7_01.dominates(Pair(answer(settled=0.1), slow))
    assert fig_7_01.dominates(Pair(slow, answer(settled=0.1)))


def test_gains_are_tuned_by_the_least_error_of_a_run_that_kept_contact():
    def run(rms, lost=0):
        return Tracking(rms, rms, 0.0, 0.0, lost)

    errors = {"low": run(2.0), "high": run(0.1, 1), "mid": run(1.0)}
    assert gain_sets.best_gains(errors) == "mid"
    assert gain_sets.TUNING_SEED not in Runs(range(1000)).seeds


@pytest.mark.long
def test_a_plausible_laboratory_shows_why_hybrid_gains_have_to_be_changed():
    """On a rubber of little damping the foam's gains fail, on foam the rubber's; the network follows on both."""
    laboratory = load_laboratory(plausible_laboratories()["conclusion-gains.hybrid"])
    experiments = {
        (name, surface): with_values(e, changes)
        for name, (changes,) in ((n, grid.values()) for n, grid in gain_sets.ONE_SET.items())
        for surface, e in gain_sets.SURFACES.items()
    }
    results = Runs(range(2), laboratory=laboratory).by_name(experiments, tracking(*gain_sets.JUDGED))
    follow = {key: all(run.follows for run in runs) for key, runs in results.items()}
    assert {key for key, good in follow.items() if not good} == {
        ("hybrid, foam's gains", "rubber"),
        ("hybrid, rubber's gains", "foam"),
    }
