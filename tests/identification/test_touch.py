from __future__ import annotations

import numpy as np

from palpate.identification.touch import touching

FORCE = np.arange(200.0)
USABLE = np.ones(200, bool)


def test_rows_reach_back_before_each_touch():
    rows = np.r_[np.arange(60, 90, 2), np.arange(150, 180, 2)]
    spans = np.repeat([0, 1], 15)
    touch = touching(FORCE, 5.0, rows, spans, [50, 140], 20, USABLE)
    assert touch.rows[0] == 30
    assert set(rows) <= set(touch.rows)
    assert np.array_equal(touch.force, touch.rows - 5.0)
    first, second = touch.rows[touch.spans == 0], touch.rows[touch.spans == 1]
    assert np.all(np.diff(first) == 2)
    assert (first[-1], second[0]) == (88, 120)


def test_they_do_not_reach_into_the_contact_before():
    rows = np.r_[np.arange(60, 90), np.arange(120, 150)]
    spans = np.repeat([0, 1], 30)
    near = touching(FORCE, 0.0, rows, spans, [50, 115], 20, USABLE)
    assert near.rows[near.spans == 1][0] == 109  # 20 after the last row in contact
    none = touching(FORCE, 0.0, rows, spans, [50, 105], 20, USABLE)
    assert none.rows[none.spans == 1][0] == 120


def test_a_log_that_begins_in_contact_has_no_touch():
    assert touching(FORCE, 0.0, np.arange(10, 50), np.zeros(40, int), [0], 20, USABLE) is None


def test_rows_without_readings_are_left_out():
    usable = USABLE.copy()
    usable[40:45] = False
    touch = touching(FORCE, 0.0, np.arange(60, 90), np.zeros(30, int), [50], 20, usable)
    assert not set(range(40, 45)) & set(touch.rows)
