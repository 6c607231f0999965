"""Troubles of the law: shown once, and an end of the press when they last longer than the lag."""

from __future__ import annotations

import pytest

from palpate.force.guard import BEYOND, DRIFTS, LATE, STALE, SWINGS, TROUBLES
from palpate.press.troubles import Troubles

STANDS, LATELY = TROUBLES[STALE], TROUBLES[LATE]


def test_a_trouble_that_lasts_longer_than_the_lag_ends_the_press_with_its_own_sentence():
    shown: list[str] = []
    troubles = Troubles(0.2, shown.append)
    ends = [troubles.lasting(STANDS, 0.01 * k) for k in range(30)]
    assert ends[:21] == [None] * 21
    assert ends[21:] == [STANDS] * 9
    assert shown == [STANDS]
    assert troubles.ticks == {STANDS: 30}


def test_a_trouble_that_comes_and_goes_is_counted_and_shown_once():
    shown: list[str] = []
    troubles = Troubles(0.2, shown.append)
    for k in range(100):
        assert troubles.lasting(STANDS if k % 20 else "", 0.01 * k) is None
    assert shown == [STANDS]
    assert troubles.ticks == {STANDS: 95}


def test_missed_ticks_alone_end_nothing():
    troubles = Troubles(0.2, lambda text: None)
    assert [troubles.lasting(LATELY, 0.01 * k) for k in range(100)] == [None] * 100
    assert not troubles.ticks


@pytest.mark.parametrize("code", [DRIFTS, BEYOND, SWINGS])
def test_a_trouble_that_is_borne_is_shown_and_counted_and_ends_nothing(code):
    shown: list[str] = []
    troubles = Troubles(0.2, shown.append)
    assert [troubles.lasting(TROUBLES[code], 0.01 * k) for k in range(100)] == [None] * 100
    assert shown == [TROUBLES[code]]
    assert troubles.ticks == {TROUBLES[code]: 100}
