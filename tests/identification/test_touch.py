from __future__ import annotations

import numpy as np

from palpate.identification.filters.state_variable import Chain
from palpate.identification.models import Motion
from palpate.identification.options import Lag
from palpate.identification.problem.problem import Seen, touching

FORCE = np.arange(200.0)
USABLE = np.ones(200, bool)


def seen(rows, spans, begins, usable=USABLE):
    motion = Motion(Chain(20.0, 1e-3), np.zeros(200), rows, bonded=False)
    return Seen(motion, 0.0, FORCE, spans, usable, begins, memory=20, free=(), lag=Lag(0.0))


def test_rows_reach_back_before_each_touch():
    rows = np.r_[np.arange(60, 90, 2), np.arange(150, 180, 2)]
    spans = np.repeat([0, 1], 15)
    touch = touching(seen(rows, spans, [50, 140]), 5.0)
    assert touch.rows[0] == 30
    assert set(rows) <= set(touch.rows)
    assert np.array_equal(touch.force, touch.rows - 5.0)
    first, second = touch.rows[touch.spans == 0], touch.rows[touch.spans == 1]
    assert np.all(np.diff(first) == 2)
    assert (first[-1], second[0]) == (88, 120)


def test_they_do_not_reach_into_the_contact_before():
    rows = np.r_[np.arange(60, 90), np.arange(120, 150)]
    spans = np.repeat([0, 1], 30)
    near = touching(seen(rows, spans, [50, 115]), 0.0)
    assert near.rows[near.spans == 1][0] == 109  # 20 after the last row in contact
    none = touching(seen(rows, spans, [50, 105]), 0.0)
    assert none.rows[none.spans == 1][0] == 120


def test_a_log_that_begins_in_contact_has_no_touch():
    assert touching(seen(np.arange(10, 50), np.zeros(40, int), [0]), 0.0) is None


def test_rows_without_readings_are_left_out():
    usable = USABLE.copy()
    usable[40:45] = False
    touch = touching(seen(np.arange(60, 90), np.zeros(30, int), [50], usable), 0.0)
    assert not set(range(40, 45)) & set(touch.rows)
