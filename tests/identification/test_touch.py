from __future__ import annotations

import numpy as np

from palpate.identification.contacts import Contacts
from palpate.identification.filters import Chain
from palpate.identification.models import Motion
from palpate.identification.options import Lag
from palpate.identification.problem import Memory, Problem, with_rows_before_touch

FORCE = np.arange(200.0)
USABLE = np.ones(200, bool)


def touches(rows, spans, begins, resting=0.0, usable=USABLE):
    motion = Motion(Chain(20.0, 1e-3), np.zeros(200), rows, bonded=False)
    contacts = Contacts((), False, 1.0, 1.0, resting, 0.0, ())
    problem = Problem(motion, FORCE[rows], spans, Lag(0.0), (), 0.0, contacts)
    return with_rows_before_touch(problem, Memory(FORCE, usable, begins, 20))


def test_rows_reach_back_before_each_touch():
    rows = np.r_[np.arange(60, 90, 2), np.arange(150, 180, 2)]
    spans = np.repeat([0, 1], 15)
    touch = touches(rows, spans, [50, 140], 5.0)
    assert touch.motion.rows[0] == 30
    assert set(rows) <= set(touch.motion.rows)
    assert np.array_equal(touch.force, touch.motion.rows - 5.0)
    first, second = touch.motion.rows[touch.spans == 0], touch.motion.rows[touch.spans == 1]
    assert np.all(np.diff(first) == 2)
    assert (first[-1], second[0]) == (88, 120)


def test_they_do_not_reach_into_the_contact_before():
    rows = np.r_[np.arange(60, 90), np.arange(120, 150)]
    spans = np.repeat([0, 1], 30)
    near = touches(rows, spans, [50, 115])
    assert near.motion.rows[near.spans == 1][0] == 109  # 20 after the last row in contact
    none = touches(rows, spans, [50, 105])
    assert none.motion.rows[none.spans == 1][0] == 120


def test_a_log_that_begins_in_contact_has_no_touch():
    assert touches(np.arange(10, 50), np.zeros(40, int), [0]) is None


def test_rows_without_readings_are_left_out():
    usable = USABLE.copy()
    usable[40:45] = False
    touch = touches(np.arange(60, 90), np.zeros(30, int), [50], usable=usable)
    assert not set(range(40, 45)) & set(touch.motion.rows)
