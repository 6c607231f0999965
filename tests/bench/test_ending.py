"""What ends a run before its time, found in the rows."""

import numpy as np

from palpate.bench.force_input import COLUMNS, StopCondition


def rows(phases, start=0):
    out = np.zeros((len(phases), len(COLUMNS)))
    out[:, 0] = 0.001 * (start + np.arange(len(phases)))
    out[:, 1] = phases
    return out


def test_the_row_before_a_number_that_is_none_is_the_last():
    out = rows([0, 1, 1, 1])
    out[2, list(COLUMNS).index("torque2")] = np.nan
    out[3] = np.inf
    keep, ending = StopCondition(0).judge(out, "")
    assert keep == 2
    assert ending.end == "diverged"
    assert ending.why == "torque2 is not a finite number from 0.002 s on"


def test_losses_are_counted_across_chunks():
    condition = StopCondition(3)
    assert condition.judge(rows([0, 1, 2, 1]), "") == (4, None)
    assert condition.judge(rows([2, 2, 0], 4), "") == (3, None)
    keep, ending = condition.judge(rows([1, 1, 2, 2, 0], 7), "")
    assert keep == 3
    assert ending.end == "lost contact"
    assert ending.why == "contact was lost for the third time at 0.009 s"


def test_a_run_that_is_to_go_on_goes_on():
    assert StopCondition(0).judge(rows([1, 2] * 50), "the controller is unwell") == (100, None)


def test_a_controller_in_trouble_ends_the_run():
    keep, ending = StopCondition(1).judge(rows([1, 1]), "the controller is unwell")
    assert keep == 2
    assert ending.end == "diverged"
    assert ending.why == "the controller is unwell, found at 0.001 s"
