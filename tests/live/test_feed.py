"""The ring of rows: what a reader has not had yet, and what a slow one loses."""

import numpy as np

from palpate.live.player import Feed
from palpate.live.view import COLUMNS


def rows(first, last):
    """Rows whose every number is their place."""
    return np.repeat(np.arange(first, last, dtype=float)[:, None], len(COLUMNS), axis=1)


def test_a_reader_gets_every_row_once_and_in_order():
    feed, had = Feed(rows=10), []
    epoch, count = -1, 0
    for first in range(0, 30, 3):
        feed.put(rows(first, first + 3))
        epoch, count, new, lost = feed.since(epoch, count)
        had += new[:, 0].tolist()
        assert lost == 0
    assert had == list(range(30))


def test_a_slow_reader_is_told_what_it_lost_and_memory_stays():
    feed = Feed(rows=10)
    feed.put(rows(0, 2))
    epoch, count, _, _ = feed.since(-1, 0)
    for first in range(2, 1002, 4):
        feed.put(rows(first, first + 4))
    _, _, new, lost = feed.since(epoch, count)
    assert new[:, 0].tolist() == list(range(992, 1002))
    assert lost == 1000 - 10
    assert len(feed.since(-1, 0)[2]) == 10


def test_another_time_is_another_epoch():
    feed = Feed(rows=10)
    feed.put(rows(0, 5))
    epoch, count, _, _ = feed.since(-1, 0)
    feed.clear()
    feed.put(rows(50, 52))
    later, _, new, lost = feed.since(epoch, count)
    assert later != epoch
    assert new[:, 0].tolist() == [50, 51]
    assert lost == 0


def test_listeners_hear_until_they_leave():
    feed, heard = Feed(rows=4), []
    leave = feed.listen(lambda: heard.append(1))
    feed.put(rows(0, 1))
    feed.put(rows(0, 0))
    leave()
    feed.put(rows(1, 2))
    assert heard == [1]
