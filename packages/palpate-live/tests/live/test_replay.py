"""Logs and records that are played again."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate_live.recorded_run import clear_at_restarts
from palpate_live.view import AT, STRIDE, Replay, ReplayedSignals, View

VIEW = View(title="log", about="", kind="replay", rate=0.0)


def signals(n=2000, rate=1000.0, **more):
    t = 5.0 + np.arange(n) / rate
    return ReplayedSignals({"t": t, "measured": np.sin(40 * t), "depth": t, **more})


def played(replay, seconds, step=0.01):
    return np.concatenate([replay.advance(step) for _ in range(round(seconds / step))])


def test_it_plays_at_its_own_pace_to_the_end():
    replay = Replay(VIEW, signals())
    rows = played(replay, 1.0)
    assert rows[-1, 0] == pytest.approx(6.0, abs=STRIDE)
    rows = np.concatenate([rows, played(replay, 1.5)])
    assert len(rows) == 400
    assert replay.state.ended.startswith("done")
    assert not len(replay.advance(0.1))
    replay.reset()
    assert len(played(replay, 0.5)) == 100


def test_only_what_the_log_has_is_shown():
    assert Replay(VIEW, signals()).view.shown == ("t", "measured", "depth")
    some = Replay(VIEW, signals(K=np.full(2000, 5.0), B=np.full(2000, np.nan)))
    assert some.view.shown == ("t", "measured", "depth", "K")
    assert some.view.span == (5.0, pytest.approx(6.999))


def test_a_moment_comes_with_the_seconds_before_it():
    replay = Replay(VIEW, signals(n=60000))
    replay.seek(40.0)
    rows = replay.advance(0.01)
    assert rows[0, 0] == pytest.approx(30.0, abs=STRIDE)
    assert rows[-1, 0] == pytest.approx(40.01, abs=STRIDE)
    with pytest.raises(InputError, match="spans 5 to"):
        replay.seek(2.0)


def test_the_ends_of_the_measured_force_are_not_lost():
    own = signals(n=20000)
    own.columns["measured"][12345] = 9.0
    own.columns["measured"][17777] = -9.0
    rows = np.concatenate([Replay(VIEW, ReplayedSignals(own.columns)).advance(100.0)])
    assert rows[:, AT["measured"]].max() == 9.0 or rows[:, AT["measured"]].min() == -9.0
    shifted = {name: values[5:] for name, values in own.columns.items()}
    other = Replay(VIEW, ReplayedSignals(shifted)).advance(100.0)[:, AT["measured"]]
    assert {9.0, -9.0} & {
        rows[:, AT["measured"]].max(),
        other.max(),
        rows[:, AT["measured"]].min(),
        other.min(),
    }


def test_a_slow_log_keeps_all_its_rows():
    replay = Replay(VIEW, signals(n=50, rate=10.0))
    assert len(played(replay, 6.0)) == 50


def test_rows_whose_time_does_not_grow_are_left_out_and_counted():
    t = np.array([0.0, 1.0, 1.0, np.nan, 0.5, 2.0])
    kept, notes = clear_at_restarts({"t": t, "measured": np.arange(6.0)})
    assert kept["t"].tolist() == [0.0, 1.0, 2.0]
    assert kept["measured"].tolist() == [0.0, 1.0, 5.0]
    assert notes == ("3 rows are left out: their time does not grow.",)


@pytest.mark.parametrize("t", [[], [1.0, 2.0], [0.0, 1.0, 1.0, 2.0], [0.0, 2.0, 1.0]])
def test_nothing_to_play_is_said(t):
    with pytest.raises(InputError, match=r"nothing to show|do not grow"):
        Replay(VIEW, ReplayedSignals({"t": np.array(t), "measured": np.ones(len(t))}))


def test_what_was_measured_does_not_change():
    with pytest.raises(InputError, match="nothing to change"):
        Replay(VIEW, signals()).set("surface.stiffness", 1.0)
