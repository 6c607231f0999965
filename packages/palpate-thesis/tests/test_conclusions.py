"""Section 7.1: answers of both methods with known values, and gains tuned on runs by which nothing is judged."""

import numpy as np
import pytest

from palpate_thesis.force_control import gain_sets
from palpate_thesis.force_control.tracking import Tracking
from palpate_thesis.neural_identifier.side_by_side import Identified
from palpate_thesis.runs import Runs

TRUTH = np.array([6000.0, 200.0, 0.1])


def answer(K=6000.0, B=200.0, M=0.1, settled=0.1):
    return Identified(K, B, M, settled, settled, settled, 0.0, 6000.0, TRUTH)


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


def test_gains_are_tuned_by_the_least_error_of_a_run_that_kept_contact():
    def run(rms, lost=0):
        return Tracking(rms, rms, 0.0, 0.0, lost)

    errors = {
        ("h", "foam", "low"): run(2.0),
        ("h", "foam", "high"): run(0.1, 1),
        ("h", "foam", "mid"): run(1.0),
    }
    assert gain_sets.best_gains(errors)[2] == "mid"
    assert gain_sets.TUNING_SEED not in Runs(range(1000)).seeds
